"""Every hostile request to the page gets an answer, and the lists stay readable."""

from __future__ import annotations

import asyncio
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.serve.app import make_app
from pipelines.serve.desk import Desk
from pipelines.serve.library import Library
from pipelines.serve.live import Live
from pipelines.serve.wishes import Wish
from tests.support.hostile import FEW, TEXTS, VALUES, Tally, count, edited, owes_a_sentence, trees
from tests.support.page import ready
from tests.support.uploads import hostile_uploads, picture

TOKEN = "token"
WISH = {
    "action": "Walk",
    "model": "cmu",
    "seconds": 2.0,
    "seed": 1,
    "size": 240,
    "views": ["front"],
    "background": "stage",
}
HEADERS = {"host": "127.0.0.1:8000", "content-type": "application/json"}
LOOP = asyncio.new_event_loop()
"""Event loop of all requests; the process that opens photos belongs to it."""
DEEP = st.sampled_from([700, 900, 990, 5000]).map(
    lambda levels: b'{"model": ' + b"[" * levels + b"]" * levels + b"}"
)


def answer(
    app: Any, method: str, path: str, body: bytes = b"", headers: dict[str, str] | None = None
) -> tuple[int, bytes]:
    """Return status and body of a request, sent by ASGI directly."""
    path, _, query = (
        path.encode("utf-8", "replace").decode().partition("?")
    )  # as uvicorn decodes it
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": f"/{TOKEN}{path}",
        "raw_path": b"",
        "root_path": "",
        "query_string": query.encode("utf-8", "surrogatepass"),
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 8000),
        "headers": [
            (name.encode("latin-1", "replace"), value.encode("latin-1", "replace"))
            for name, value in (HEADERS | (headers or {})).items()
        ],
    }
    parts, given_body = [], iter([{"type": "http.request", "body": body, "more_body": False}])

    async def receive() -> dict[str, Any]:
        return next(given_body, {"type": "http.disconnect"})

    async def send(message: dict[str, Any]) -> None:
        parts.append(message)

    LOOP.run_until_complete(app(scope, receive, send))
    return parts[0]["status"], b"".join(part.get("body", b"") for part in parts[1:])


@pytest.fixture(scope="module")
def page() -> Iterator[tuple[Any, str, str]]:
    """The application with a photo and a failed job, and their names; nothing is computed."""
    with tempfile.TemporaryDirectory() as folder:
        library = Library(Path(folder))
        photo = ready(library)
        job = library.add_job(photo, Wish(action="Walk", model="cmu"))
        job.status = "failed"
        library.keep(job)
        desk = Desk(library, "", cache=str(Path(folder) / "store"))
        yield make_app(desk, Live(desk, ""), TOKEN, lambda: None), photo.id, job.id
        LOOP.run_until_complete(desk.close())
        places = ("photos", "jobs", "incoming", "removed")
        assert {path.name for place in places for path in (Path(folder) / place).glob("*")} == {
            photo.id,
            job.id,
        }


def is_answered(
    page: tuple[Any, str, str],
    method: str,
    path: str,
    body: bytes = b"",
    headers: dict[str, str] | None = None,
) -> None:
    app = page[0]

    def ask() -> None:
        status, said = answer(app, method, path, body, headers)
        assert status < 500
        if status >= 400:
            assert set(json.loads(said)) == {"problem"}
        status, said = answer(app, "GET", "/api/state")
        assert status == 200
        assert len(json.loads(said)["photos"]) == 1

    owes_a_sentence(ask)


BODIES = st.one_of(
    VALUES.map(lambda value: json.dumps(value).encode()),
    DEEP,
    st.binary(max_size=40),
    TEXTS.map(lambda text: text.encode("utf-8", "surrogatepass")),
)


@given(data=st.data())
def test_words(page, data):
    said = trees({"model": "cmu", "text": "walk, then jump for 2 s"}).map(
        lambda tree: json.dumps(tree).encode()
    )
    is_answered(page, "POST", "/api/words", data.draw(st.one_of(said, BODIES)))


@given(data=st.data())
def test_jobs(page, data):
    """A wish is nearly valid; an accepted job is removed again."""
    body = data.draw(
        st.one_of(
            trees({"photo": page[1], "wish": WISH}).map(lambda tree: json.dumps(tree).encode()),
            BODIES,
        )
    )
    is_answered(page, "POST", "/api/jobs", body)
    jobs = json.loads(answer(page[0], "GET", "/api/state")[1])["jobs"]
    for job in (job for job in jobs if job["id"] != page[2]):
        assert answer(page[0], "DELETE", f"/api/jobs/{job['id']}")[0] == 200
        count(Tally(deleted=1))


PLACES = [
    "/api/{}",
    "/page/{}",
    "/photos/{}/{}",
    "/jobs/{}/{}",
    "/jobs/{}/all.zip",
    "/api/photos/{}/again",
    "/api/jobs/{}/cancel",
    "/{}",
    "/page/../{}",
    "/photos/../../{}",
    "/jobs/{}/../{}",
    "/jobs/{}/video.mp4?download={}",
]
NAMES = st.one_of(
    TEXTS,
    st.sampled_from(
        [
            "..",
            ".",
            "%2e%2e",
            "photo.jpg",
            "record.json",
            "video.mp4",
            "\0",
            "a" * 3000,
            "..%2f..%2f",
            "original",
        ]
    ),
)


@given(data=st.data())
def test_addresses(page, data):
    names = st.one_of(NAMES, st.sampled_from([page[1], page[2]]))
    place = data.draw(st.sampled_from(PLACES))
    path = place.format(*(data.draw(names) for _ in range(place.count("{}"))))
    method = data.draw(st.sampled_from(["GET", "POST", "HEAD", "PUT", "PATCH", "X" * 200]))
    header = data.draw(
        st.sampled_from(
            ["range", "origin", "host", "content-length", "if-range", "cookie", "sec-fetch-site"]
        )
    )
    app, written = (
        page[0],
        data.draw(
            st.one_of(
                TEXTS,
                st.sampled_from(
                    ["bytes=0-", "bytes=-1,-1,-1", "bytes=" + "0-1," * 500, "bytes=9-1", "-1"]
                ),
            )
        ),
    )

    def ask() -> None:
        status, _ = answer(app, method, path, headers={header: written.replace("\n", " ")})
        assert status < 500
        assert answer(app, "GET", "/api/state")[0] == 200

    owes_a_sentence(ask)


@settings(max_examples=FEW)
@given(st.one_of(st.sampled_from([picture(), *hostile_uploads()]), edited(picture())), NAMES)
def test_uploads(page, data, name):
    """An accepted photo is removed again."""
    taken = list[str]()

    def ask() -> None:
        status, said = answer(page[0], "POST", f"/api/photos?name={name}", data)
        assert status in (201, 400, 413)
        if status == 201:
            taken.append(json.loads(said)["id"])

    owes_a_sentence(ask)
    for photo in taken:
        assert answer(page[0], "DELETE", f"/api/photos/{photo}")[0] == 200
        count(Tally(deleted=1))
    assert len(json.loads(answer(page[0], "GET", "/api/state")[1])["photos"]) == 1

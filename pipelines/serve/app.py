"""The web application of the page: it accepts photos and jobs, and serves state and files."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import functools
import shutil
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Mapping
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route

from a2v.errors import A2VError, InputError, printable
from a2v.formats.registry import readable_suffixes
from a2v.kinematics.names import LIMB_BONES
from a2v.perception import Corrections
from a2v.perception.corrections import MAX_BYTES as MAX_CORRECTIONS
from a2v.rendering.page import speech_script, viewer_script
from a2v.sessions import WEIGHTS
from pipelines.requests.person import corrections_of
from pipelines.serve.acts import acts
from pipelines.serve.answers import PAGE, Told, failed, file_answer, public, refused
from pipelines.serve.archive import zipped
from pipelines.serve.desk import Desk
from pipelines.serve.edge import MAX_CLIP, MAX_UPLOAD, declared, read_json, save_photo, title
from pipelines.serve.guard import Guard
from pipelines.serve.library import Library
from pipelines.serve.live import Live
from pipelines.serve.records import MASK, PERSON, SHOWN, Job, Photo
from pipelines.serve.stages import STAGES
from pipelines.serve.talk import CORRECTIONS, ORIGINAL
from pipelines.serve.wishes import MAX_ACTION, MODELS, Wish, choices, understood
from pipelines.serve.words import for_page
from pipelines.stages import title_of

VIEWER = "three.js"
"""Name of the script with three.js and `makeSpeech`."""
CLIPS = (".mp4", ".webm", ".mov", ".m4v")
"""Suffixes of videos that the page accepts."""
SAMPLE = WEIGHTS.parent / "samples" / "person.jpg"


def make_app(desk: Desk, live: Live, token: str, ready: Callable[[], None]) -> Guard:
    """Make the application behind its guard.

    `ready` is called once the application has started. The server handles signals.
    """

    @contextlib.asynccontextmanager
    async def life(app: Starlette) -> AsyncIterator[None]:
        desk.start()
        resting = asyncio.create_task(live.rest())
        ready()
        yield
        resting.cancel()
        await asyncio.gather(desk.close(), live.close())

    handlers = {A2VError: failed, HTTPException: refused}
    return Guard(
        Starlette(routes=Handlers(desk, live).routes(), lifespan=life, exception_handlers=handlers),
        token,
    )


class Handlers:
    """The handler of each address."""

    def __init__(self, desk: Desk, live: Live) -> None:
        self._desk, self._live = desk, live
        self._background: set[asyncio.Task[None]] = set()

    @property
    def _library(self) -> Library:
        return self._desk.library

    def routes(self) -> list[Route]:
        """Return all routes below the token."""
        get, post, delete = ["GET"], ["POST"], ["DELETE"]
        return [
            Route("/", self.page, methods=get),
            Route("/page/{name}", self.asset, methods=get),
            Route("/api/choices", self.choices, methods=get),
            Route("/api/state", self.state, methods=get),
            Route("/api/words", self.words, methods=post),
            Route("/api/photos", self.take_photo, methods=post),
            Route("/api/sample", self.take_sample, methods=post),
            Route("/api/photos/{id}", self.remove_photo, methods=delete),
            Route("/api/photos/{id}/again", self.look_again, methods=post),
            Route("/api/photos/{id}/corrections", self.corrections, methods=get),
            Route("/api/photos/{id}/corrections", self.correct, methods=["PUT"]),
            Route("/api/photos/{id}/outline", self.outline, methods=post),
            Route("/api/photos/{id}/more", self.take_more, methods=post),
            Route("/api/photos/{id}/more", self.remove_more, methods=delete),
            Route("/api/photos/{id}/clip", self.take_clip, methods=post),
            Route("/api/photos/{id}/clip", self.remove_clip, methods=delete),
            Route("/api/damaged", self.remove_damaged, methods=delete),
            Route("/api/jobs", self.take_job, methods=post),
            Route("/api/jobs/{id}", self.remove_job, methods=delete),
            Route("/api/jobs/{id}/cancel", self.cancel, methods=post),
            Route("/api/jobs/{id}/again", self.again, methods=post),
            *self._live.routes(self._photo),
            *acts(self._desk, self._photo, self._meanwhile),
            Route("/photos/{id}/{name:path}", self.photo_file, methods=get),
            Route("/jobs/{id}/all.zip", self.everything, methods=get),
            Route("/jobs/{id}/{name:path}", self.job_file, methods=get),
        ]

    async def page(self, request: Request) -> Response:
        """Serve the page; meanwhile the process for motions is loaded."""
        self._meanwhile(self._desk.cast.ready())
        return file_answer(PAGE / "index.html", PAGE)

    async def asset(self, request: Request) -> Response:
        """Serve a style sheet, script or image of the page."""
        name = request.path_params["name"]
        if name == VIEWER:
            script = await self._desk.threads.do(lambda: viewer_script() + speech_script())
            return Response(script, media_type="text/javascript")
        if name not in {path.name for path in PAGE.iterdir()}:
            raise HTTPException(404, "there is no such file")
        return file_answer(PAGE / name, PAGE)

    async def choices(self, request: Request) -> Response:
        """Return the choices that the page offers."""
        return Told(
            await self._desk.threads.do(choices)
            | {
                "upload": MAX_UPLOAD,
                "clip": MAX_CLIP,
                "limbs": list(LIMB_BONES),
                "motions": readable_suffixes(),
            }
        )

    async def state(self, request: Request) -> Response:
        """Return the current state of photos and jobs."""
        photos = [
            public(photo) | {"progress": self._desk.progress.get(photo.id)}
            for photo in self._library.photos.values()
        ]
        waiting = [
            job.id
            for job in sorted(self._library.jobs.values(), key=lambda one: one.created)
            if job.status == "waiting"
        ]
        jobs = []
        for job in self._library.jobs.values():
            place = waiting.index(job.id) + 1 if job.id in waiting else 0
            jobs.append(public(job) | {"progress": self._desk.progress.get(job.id), "place": place})
        return Told(
            {
                "photos": photos,
                "jobs": jobs,
                "motions": [public(motion) for motion in self._library.motions.values()],
                "damaged": len(self._library.damaged),
                "problem": for_page(printable(self._library.problem)),
            }
        )

    async def words(self, request: Request) -> Response:
        """Return the actions that a prompt is matched to."""
        said = await read_json(request)
        text = said.get("text")
        if not isinstance(text, str) or len(text) > MAX_ACTION:
            raise InputError(f"expected some words, at most {MAX_ACTION} letters")
        steps, matches = await self._desk.threads.do(understood, MODELS[0], text)
        parts = [
            {
                "words": match.text,
                "action": step.action,
                "title": title_of(step.action),
                "seconds": step.seconds,
                "near": [{"action": name, "title": title_of(name)} for name in match.others[:3]],
                "wishes": [
                    {"text": for_page(told.text), "kept": told.kept, "why": for_page(told.why)}
                    for told in match.told
                ],
            }
            for step, match in zip(steps, matches, strict=True)
        ]
        return Told({"parts": parts})

    async def take_photo(self, request: Request) -> Response:
        """Receive a photo.

        Its size is checked before and while it is read. A child process decodes its pixels.
        """
        return await self._arrive(
            functools.partial(save_photo, request),
            title(request.query_params.get("name", "")),
            declared(request, MAX_UPLOAD),
        )

    async def take_sample(self, request: Request) -> Response:
        """Add the photo of the sample person as if it had been uploaded."""

        async def copy(path: Path) -> None:
            try:
                await self._desk.threads.do(shutil.copyfile, SAMPLE, path)
            except OSError as error:
                raise InputError(
                    f"the photo cannot be kept: {error.strerror}; free some space and try again"
                ) from error

        return await self._arrive(copy, "sample person", SAMPLE.stat().st_size)

    async def _arrive(
        self, save: Callable[[Path], Awaitable[None]], name: str, size: int
    ) -> Response:
        async with self._desk.arrivals.folder(size) as folder:
            await save(folder / ORIGINAL)
            photo = await self._desk.arrivals.open_photo(folder, name)
            self._desk.wake()
        return Told(public(photo), status_code=201)

    def _meanwhile(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._background.add(task)
        task.add_done_callback(self._background.discard)

    async def remove_photo(self, request: Request) -> Response:
        """Remove a person: the photo, its videos, and all values of the store made from it.

        The answer reports how much was removed.
        """
        return Told(dataclasses.asdict(await self._desk.remove(self._photo(request))))

    async def look_again(self, request: Request) -> Response:
        """Process a photo again."""
        self._desk.again(self._photo(request))
        return Told({})

    async def corrections(self, request: Request) -> Response:
        """Return the saved corrections of a photo."""
        photo = self._photo(request)
        path = self._library.place(photo) / CORRECTIONS if photo.corrected else None
        return Told(
            (
                await self._desk.threads.do(corrections_of, None if path is None else str(path))
            ).said()
        )

    async def correct(self, request: Request) -> Response:
        """Save corrections of a photo; empty corrections remove the earlier ones."""
        photo = self._photo(request)
        self._desk.correct(photo, _corrections(await read_json(request, MAX_CORRECTIONS), photo))
        return Told(public(photo))

    async def outline(self, request: Request) -> Response:
        """Return the outline of the body with given corrections, without saving them."""
        photo = self._photo(request)
        return Told(
            await self._desk.cast.outline(
                photo, _corrections(await read_json(request, MAX_CORRECTIONS), photo)
            )
        )

    async def take_more(self, request: Request) -> Response:
        """Receive a further photo of a person."""
        photo = self._photo(request)
        async with self._desk.arrivals.folder(declared(request, MAX_UPLOAD)) as folder:
            await save_photo(request, folder / ORIGINAL)
            await self._desk.arrivals.add_more(photo, folder)
        return Told(public(photo), status_code=201)

    async def remove_more(self, request: Request) -> Response:
        """Remove the further photos of a person."""
        await self._desk.arrivals.remove_more(self._photo(request))
        return Told({})

    async def take_clip(self, request: Request) -> Response:
        """Receive a video whose motion the person copies."""
        photo, name = self._photo(request), request.query_params.get("name", "")
        suffix = Path(name).suffix.lower()
        if suffix not in CLIPS:
            raise InputError(
                f"this is not named like a video; expected a name that ends in {', '.join(CLIPS)}"
            )
        async with self._desk.arrivals.folder(declared(request, MAX_CLIP)) as folder:
            await save_photo(request, folder / ORIGINAL, MAX_CLIP, "video")
            await self._desk.arrivals.add_clip(photo, folder, suffix, title(name))
        return Told(public(photo), status_code=201)

    async def remove_clip(self, request: Request) -> Response:
        """Remove the video with the motion."""
        await self._desk.arrivals.remove_clip(self._photo(request))
        return Told({})

    async def remove_damaged(self, request: Request) -> Response:
        """Remove records that cannot be read."""
        await self._desk.remove_damaged()
        return Told({})

    async def take_job(self, request: Request) -> Response:
        """Queue a requested video."""
        said = await read_json(request)
        photo = self._library.photos.get(str(said.get("photo")))
        if photo is None:
            raise InputError("this photo is not here any more; choose another")
        wish = Wish.of(said.get("wish"))
        if wish.clip and not photo.clip:
            raise InputError("this person has no video with a motion yet; send one first")
        if wish.motion:
            self._library.motion_file(wish)
        if not wish.recorded:
            await self._desk.threads.do(understood, wish.model, wish.action)
            await self._desk.threads.do(wish.check_path)
        job = self._library.add_job(photo, wish)
        self._desk.wake()
        self._meanwhile(self._desk.warm())
        return Told(public(job), status_code=201)

    async def remove_job(self, request: Request) -> Response:
        """Remove a video."""
        await self._desk.remove(self._job(request))
        return Told({})

    async def cancel(self, request: Request) -> Response:
        """Cancel a video."""
        await self._desk.cancel(self._job(request))
        return Told({})

    async def again(self, request: Request) -> Response:
        """Run a job again."""
        self._desk.again(self._job(request))
        return Told({})

    async def photo_file(self, request: Request) -> Response:
        """Serve the shown version of a photo; the uploaded bytes are never served."""
        photo, name = self._photo(request), request.path_params["name"]
        further = [f"more-{number + 1}.jpg" for number in range(len(photo.more))]
        own = (SHOWN, MASK, CORRECTIONS, PERSON, *STAGES.values(), *further)
        if name not in own and name not in photo.files:
            raise HTTPException(404, "there is no such file")
        kept = name == CORRECTIONS or name in photo.files
        return file_answer(
            self._library.place(photo) / name,
            self._library.folder,
            download=Path(name).name if kept else None,
        )

    async def job_file(self, request: Request) -> Response:
        """Serve one result of a job."""
        job, name = self._job(request), request.path_params["name"]
        if name not in job.files:
            raise HTTPException(404, "there is no such file")
        download = Path(name).name if "download" in request.query_params else None
        return file_answer(self._library.place(job) / name, self._library.folder, download=download)

    async def everything(self, request: Request) -> Response:
        """Serve all results of a job in one zip."""
        job = self._job(request)
        if not job.files:
            raise HTTPException(404, "no result exists yet")
        headers = {"Content-Disposition": 'attachment; filename="a2v.zip"'}
        return StreamingResponse(
            zipped(self._library.place(job), job.files),
            media_type="application/zip",
            headers=headers,
        )

    def _photo(self, request: Request) -> Photo:
        if (photo := self._library.photos.get(request.path_params["id"])) is None:
            raise HTTPException(404, "this photo is not here any more")
        return photo

    def _job(self, request: Request) -> Job:
        if (job := self._library.jobs.get(request.path_params["id"])) is None:
            raise HTTPException(404, "this video is not here any more")
        return job


def _corrections(said: Mapping[str, Any], photo: Photo) -> Corrections:
    """Return the corrections in a request, checked against the size of the photo."""
    found = Corrections.of(said, "the request")
    found.in_pixels(photo.width, photo.height)
    return found

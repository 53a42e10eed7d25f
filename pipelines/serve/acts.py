"""Requests of the stage: what a person does, motions from files, a still of a film, and files for
other tools."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from a2v.animation import RIGS
from a2v.errors import InputError
from a2v.formats.registry import readable_suffixes
from pipelines.serve.answers import Told, public
from pipelines.serve.desk import Desk
from pipelines.serve.edge import MAX_UPLOAD, declared, read_json, save_photo, title
from pipelines.serve.records import Photo
from pipelines.serve.talk import ORIGINAL
from pipelines.serve.wishes import Wish

SAMPLE = "sample"
"""Identity of the sample person, whom the page ships."""
FORMATS = (".glb", ".fbx", ".usdz", ".html", ".bvh", ".npz")
"""Formats of files for other tools that the page offers; the last two hold a motion alone."""


def acts(
    desk: Desk,
    photo_of: Callable[[Request], Photo],
    meanwhile: Callable[[Coroutine[Any, Any, None]], None],
) -> list[Route]:
    """Return the routes below the token. `photo_of` finds the photo of a request, `meanwhile`
    starts what no request waits for."""

    async def play(request: Request) -> Response:
        sample = request.path_params["id"] == SAMPLE
        photo = None if sample else photo_of(request)
        said = await read_json(request)
        wish, first = Wish.of(said.get("wish")), said.get("first") is True
        if wish.clip and (photo is None or not photo.clip):
            raise InputError("this person has no video with a motion yet; send one first")
        return Told(await desk.cast.play(photo, wish, first=first))

    async def prepare(request: Request) -> Response:
        meanwhile(desk.cast.prepare())
        return Told({})

    async def still(request: Request) -> Response:
        photo, said = photo_of(request), await read_json(request)
        return Told(await desk.cast.still(photo, Wish.of(said.get("wish"))))

    async def export(request: Request) -> Response:
        photo, said = photo_of(request), await read_json(request)
        rig, suffix, wish = said.get("rig"), said.get("format"), Wish.of(said.get("wish"))
        if rig not in RIGS or suffix not in FORMATS:
            raise InputError(
                f"expected a rig ({', '.join(RIGS)}) and a format ({', '.join(FORMATS)})"
            )
        return Told({"files": await desk.cast.export(photo, wish, str(rig), str(suffix))})

    async def take_motion(request: Request) -> Response:
        name = request.query_params.get("name", "")
        suffix = Path(name).suffix.lower()
        async with desk.arrivals.folder(declared(request, MAX_UPLOAD)) as folder:
            await save_photo(request, folder / ORIGINAL, MAX_UPLOAD, "file")
            motion = await desk.arrivals.add_motion(
                folder, suffix if suffix in readable_suffixes() else "", title(name)
            )
        return Told(public(motion), status_code=201)

    async def remove_motion(request: Request) -> Response:
        if (motion := desk.library.motions.get(request.path_params["id"])) is None:
            raise HTTPException(404, "this motion is not here any more")
        await desk.arrivals.remove_motion(motion)
        return Told({})

    return [
        Route("/api/prepare", prepare, methods=["POST"]),
        Route("/api/motions", take_motion, methods=["POST"]),
        Route("/api/motions/{id}", remove_motion, methods=["DELETE"]),
        Route("/api/people/{id}/play", play, methods=["POST"]),
        Route("/api/people/{id}/still", still, methods=["POST"]),
        Route("/api/people/{id}/export", export, methods=["POST"]),
    ]

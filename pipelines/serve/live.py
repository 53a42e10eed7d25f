"""The live mode of the page: a camera of this machine drives a person."""

from __future__ import annotations

import asyncio
import base64
import secrets
from collections.abc import Callable, Collection, Mapping
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from a2v.errors import InputError
from pipelines.serve.answers import Told, public
from pipelines.serve.child import Child
from pipelines.serve.desk import Desk
from pipelines.serve.edge import read_data, read_json
from pipelines.serve.records import Photo

MAX_FRAME = 512 << 10
"""Largest number of bytes of a camera frame."""
MAX_WAITING = 3
"""Largest number of frames that wait for an answer."""
FRAME_SECONDS = 60.0
"""Longest time in seconds for a frame; the first ones fit the body's shape."""
OPEN_SECONDS = 600.0
"""Longest time in seconds to load the character."""
ENDED = "this live session has ended; start it again"
IDLE_SECONDS = 180.0
"""Time in seconds without a frame after which the session ends."""


class Live:
    """One live session at a time, in a child process of its own.

    Parameters
    ----------
    desk : Desk
        Its people are driven.
    code : see `Child`
    vmc : port of a program that receives VMC on this machine; 0 sends nothing
    """

    def __init__(self, desk: Desk, code: str, vmc: int = 0) -> None:
        self._desk, self._child, self._vmc = desk, Child(code), vmc
        self._session, self._photo, self._waiting = "", "", 0
        self._opening = asyncio.Lock()
        self._inside: list[str] = []  # photos for which the process works
        desk.leaving.append(self._leave)

    def routes(self, photo_of: Callable[[Request], Photo]) -> list[Route]:
        """Return the routes below the token. `photo_of` finds the photo of a request."""

        async def open_session(request: Request) -> Response:
            return Told(await self.open(photo_of(request)), status_code=201)

        async def frame(request: Request) -> Response:
            self._check(request)
            data = await read_data(request, MAX_FRAME, "the frame is too large")
            return Told(await self.frame(data, _time_of(request)))

        async def record(request: Request) -> Response:
            self._check(request)
            said = await read_json(request)
            return Told(await self.record(bool(said.get("on"))))

        async def close(request: Request) -> Response:
            self._check(request)
            await self.close()
            return Told({})

        return [
            Route("/api/people/{id}/live", open_session, methods=["POST"]),
            Route("/api/live/{session}/frame", frame, methods=["POST"]),
            Route("/api/live/{session}/record", record, methods=["POST"]),
            Route("/api/live/{session}", close, methods=["DELETE"]),
        ]

    async def open(self, photo: Photo) -> dict[str, Any]:
        """Load a person and return the name of the session.

        An earlier session ends.

        Raises
        ------
        InputError
            The person is not made yet, or cannot be loaded.
        """
        task = self._desk.cast.person_task(photo)
        async with self._opening:
            await self.close()
            self._check_photo(photo)
            self._photo = photo.id
            await self._do({"task": "open", "vmc": self._vmc, **task}, OPEN_SECONDS)
            self._check_photo(photo)
            self._session = secrets.token_hex(8)
            return {"session": self._session, "vmc": self._vmc}

    async def frame(self, jpeg: bytes, at: float) -> dict[str, Any]:
        """Return the pose of the character for a camera frame at `at` seconds."""
        if self._waiting >= MAX_WAITING:
            raise HTTPException(429, "too many frames at the same time; wait for their answers")
        self._waiting += 1
        try:
            task = {"task": "frame", "time": at, "jpeg": base64.b64encode(jpeg).decode()}
            return await self._do(task, FRAME_SECONDS)
        finally:
            self._waiting -= 1

    async def record(self, on: bool) -> dict[str, Any]:
        """Start a recording; or stop it and add its files to those of the person."""
        photo = self._desk.library.photos.get(self._photo)
        if photo is None:
            raise HTTPException(404, ENDED)
        done = await self._do({"task": "record" if on else "keep"}, OPEN_SECONDS)
        if on:
            return {}
        self._check_photo(photo)
        photo.files = photo.files | done["files"]
        self._desk.library.keep(photo)
        return public(photo)

    async def close(self) -> None:
        """End the session and its process."""
        self._session = self._photo = ""
        await self._child.stop()

    async def _leave(self, removed: Collection[str]) -> None:
        """End the session of a removed person, and whatever the process still does for it."""
        if self._photo in removed:
            await self.close()
        while any(one in removed for one in self._inside):
            await self._child.stop()
            await asyncio.sleep(0.01)

    def _check_photo(self, photo: Photo) -> None:
        if photo.id not in self._desk.library.photos:
            raise InputError("this photo was removed; choose another")

    async def rest(self) -> None:
        """End a session without frames, forever."""
        while True:
            await asyncio.sleep(5.0)
            if self._child.idle(IDLE_SECONDS):
                await self.close()

    def _check(self, request: Request) -> None:
        given = request.path_params["session"]
        if not self._session or not secrets.compare_digest(given.encode(), self._session.encode()):
            raise HTTPException(404, ENDED)

    async def _do(self, task: Mapping[str, Any], limit: float) -> dict[str, Any]:
        if not (photo := self._photo):  # it ended while the request arrived
            raise HTTPException(404, ENDED)
        self._inside.append(photo)
        try:
            answer = await self._child.do(task, limit=limit)
        finally:
            self._inside.remove(photo)
        if "problem" in answer:
            raise InputError(answer["problem"])
        done: dict[str, Any] = answer["done"]
        return done


def _time_of(request: Request) -> float:
    try:
        return float(request.query_params.get("time", "nan"))
    except ValueError:
        raise InputError("time is not a number; expected seconds") from None

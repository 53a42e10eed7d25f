"""The processes for waiting requests: what a person on the stage does, stills and exported files.

One process lets people act; it is warm, so that an action takes a fraction of a second. Another
makes people, draws stills and writes files. A third looks at photos. None waits for films.
"""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Mapping
from typing import Any

from starlette.exceptions import HTTPException

from a2v.errors import InputError
from a2v.perception import Corrections
from pipelines.serve.child import Child
from pipelines.serve.library import Library
from pipelines.serve.records import Job, Photo
from pipelines.serve.talk import CLIP, CORRECTIONS, ORIGINAL
from pipelines.serve.wishes import Wish
from pipelines.stages import said

MAX_PLAYING = 8
"""Largest number of motions that are asked for at the same time."""
PLAY_SECONDS = 60.0
"""Longest time for a motion, the start of its process included."""
COPY_SECONDS = 1200.0
"""Longest time to copy the motion of a person in a video."""


class Cast:
    """Lets people act.

    Parameters
    ----------
    code : see `Child`
    cache : folder of the store, None for the default

    Attributes
    ----------
    served : list
        Photos and jobs for which a request waits, each with the process that works for it.
    """

    def __init__(self, library: Library, code: str, cache: str | None) -> None:
        self._library, self._cache = library, cache
        self.looker, self.builder, self.player = Child(code), Child(code), Child(code)
        self.served: list[tuple[Photo | Job, Child]] = []
        self._playing = 0

    async def outline(self, photo: Photo, corrections: Corrections) -> dict[str, Any]:
        """Return the outline of the body fitted with these corrections, without saving them.

        See `pipelines.serve.fitting.outline`.


        Raises
        ------
        InputError
            The outline cannot be computed.
        """
        task = {
            "task": "outline",
            "folder": str(self._library.place(photo)),
            "cache": self._cache,
            "corrections": corrections.said(),
        }
        return await self.serve(photo, task, self.looker)

    async def serve(
        self,
        item: Photo | Job | None,
        task: Mapping[str, Any],
        child: Child,
        limit: float | None = None,
    ) -> dict[str, Any]:
        """Run a task for a waiting request; `item` is what it is about."""
        entry = None if item is None else (item, child)
        if entry is not None:
            self.served.append(entry)
        try:
            answer = await child.do(task, limit=limit)
        finally:
            if entry is not None:
                self.served.remove(entry)
        if "problem" in answer:
            raise InputError(answer["problem"])
        done: dict[str, Any] = answer["done"]
        return done

    async def play(self, photo: Photo | None, wish: Wish, *, first: bool = False) -> dict[str, Any]:
        """Return what a person does, or the `first` second; the sample person needs no photo.

        See `pipelines.serve.figure.play`.

        Raises
        ------
        InputError
            The person is not made yet, or cannot do this.
        HTTPException
            429: too many motions are asked for at the same time.
        """
        if self._playing >= MAX_PLAYING:
            raise HTTPException(429, "too many motions at the same time; wait for one of them")
        self._playing += 1
        try:
            files = {"folder": "", "clip": self._clip(None, wish), "cache": self._cache}
            if photo is not None:
                files = self.person_task(photo, wish)
            task = {**files, "task": "play", "wish": wish.said(), "first": first}
            if wish.clip:
                return await self.serve(photo, task, self.builder, COPY_SECONDS)
            return await self.serve(photo, task, self.player, PLAY_SECONDS)
        finally:
            self._playing -= 1

    async def ready(self) -> None:
        """Load what motions need while the page opens."""
        if not self.player.alive:
            with contextlib.suppress(InputError):  # a later request for a motion reports it
                await self.serve(None, {"task": "ready"}, self.player)

    async def prepare(self) -> None:
        """Load what a new person needs while the photo is chosen."""
        for child in (self.looker, self.builder):
            if not child.alive:
                task = {"task": "prepare", "detectors": child is self.looker}
                with contextlib.suppress(InputError):  # the photo itself reports it
                    await self.serve(None, task, child)

    async def still(self, photo: Photo, wish: Wish) -> dict[str, Any]:
        """Draw a frame of a film as it will look.

        Raises
        ------
        InputError
            It cannot be drawn.
        """
        task = {"task": "still", **self.person_task(photo, wish), "wish": wish.said()}
        return await self.serve(photo, task, self.builder)

    async def export(self, photo: Photo, wish: Wish, rig: str, suffix: str) -> dict[str, int]:
        """Write a person with a motion for another tool; return the new files and their sizes.

        Raises
        ------
        InputError
            The person is not made yet, or the file cannot be written.
        """
        task = {"task": "export", **self.person_task(photo, wish), "wish": wish.said()}
        done = await self.serve(
            photo, {**task, "rig": rig, "format": suffix, "name": said(wish.action)}, self.builder
        )
        photo.files = photo.files | done["files"]
        self._library.keep(photo)
        files: dict[str, int] = done["files"]
        return files

    def person_task(self, photo: Photo, wish: Wish | None = None) -> dict[str, Any]:
        """Return the entries of a task for a person: folder, store, and the person's files."""
        if not photo.known:
            raise InputError("this person is not made yet; wait a moment")
        return {"folder": str(self._library.place(photo)), **self.files_of(photo, wish)}

    def files_of(self, photo: Photo, wish: Wish | None) -> dict[str, Any]:
        """Return the person's files for a task; the video with the motion if `wish` copies it."""
        own = self._library.place(photo)
        more = [str(own / f"more-{number + 1}") for number in range(len(photo.more))]
        return {
            "photo": str(own / ORIGINAL),
            "corrections": str(own / CORRECTIONS) if photo.corrected else None,
            "more": more,
            "clip": None if wish is None else self._clip(photo, wish),
            "cache": self._cache,
        }

    def _clip(self, photo: Photo | None, wish: Wish) -> str | None:
        """Return the video or file whose motion the person copies."""
        if wish.motion:
            return str(self._library.motion_file(wish))
        if photo is not None and wish.clip and photo.clip:
            return str(self._library.place(photo) / f"{CLIP}{photo.clip}")
        return None

    def working_on(self, items: Collection[Photo | Job]) -> set[Child]:
        """Return the processes that work for a request about these photos and jobs."""
        return {child for one, child in self.served if one in items}

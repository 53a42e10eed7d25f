"""Receive photos, further photos of a person, and videos and files with a motion.

A child process opens each file; then the file is moved to its record.
"""

from __future__ import annotations

import contextlib
import shutil
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException

from a2v.errors import InputError
from pipelines.engine.forget import Forgotten
from pipelines.requests.person import MOST_PHOTOS as MAX_PHOTOS
from pipelines.serve.child import Child
from pipelines.serve.edge import MAX_UPLOAD
from pipelines.serve.library import Library
from pipelines.serve.records import MAX_TITLE, MOTION, SHOWN, KeptMotion, Photo
from pipelines.serve.talk import CLIP, ORIGINAL

MAX_ARRIVING = 32
"""Largest number of photos and videos that may be uploading at the same time."""
MAX_ARRIVING_BYTES = MAX_ARRIVING * MAX_UPLOAD
"""Largest sum of their sizes, bytes."""
MAX_MOTIONS = 200
"""Largest number of motions that are kept."""
OPEN_SECONDS = 60.0
"""Time limit in seconds for opening an upload."""


class Arrivals:
    """Receives the files of a person, and removes further photos and videos again.

    Parameters
    ----------
    opener : child process that decodes files
    forget : removes from the store all values made of files with the given digests
    """

    def __init__(
        self,
        library: Library,
        opener: Child,
        *,
        forget: Callable[[Iterable[str]], Awaitable[Forgotten]],
    ) -> None:
        self.library, self._opener, self._forget = library, opener, forget
        self._sizes: list[int] = []  # of what is arriving

    @contextlib.asynccontextmanager
    async def folder(self, size: int) -> AsyncIterator[Path]:
        """Make a folder for an upload of at most `size` bytes, and remove it afterwards.

        Raises
        ------
        InputError
            There are too many photos, or the folder cannot be made.
        HTTPException
            503: much is arriving at the moment.
        """
        if len(self._sizes) >= MAX_ARRIVING or sum(self._sizes) + size > MAX_ARRIVING_BYTES:
            raise HTTPException(
                503, "many photos or videos are arriving at the moment; try again in a minute"
            )
        self._sizes.append(size)
        try:
            folder = self.library.arriving()
            try:
                yield folder
            finally:
                shutil.rmtree(folder, ignore_errors=True)  # the file was moved or refused
        finally:
            self._sizes.remove(size)

    async def _opened(self, folder: Path, task: str, **more: str) -> dict[str, Any]:
        """Let the child process open the uploaded file in `folder`; return its facts.

        Raises
        ------
        InputError
            The file cannot be used.
        """
        given = {"task": task, "folder": str(folder), "file": str(folder / ORIGINAL), **more}
        answer = await self._opener.do(given, limit=OPEN_SECONDS)
        if "problem" in answer:
            raise InputError(answer["problem"])
        facts: dict[str, Any] = answer["done"]
        return facts

    async def open_photo(self, folder: Path, title: str) -> Photo:
        """Add the uploaded photo in `folder`.

        Raises
        ------
        InputError
            The file is not a photo or is too large, or there are too many photos.
        """
        facts = await self._opened(folder, "open", shown=str(folder / SHOWN))
        return self.library.add_photo(folder, title, facts)

    async def add_more(self, photo: Photo, folder: Path) -> None:
        """Add the uploaded photo in `folder` as a further photo of the person in `photo`.

        Raises
        ------
        InputError
            The file is not a photo, the person has it already, or there are too many.
        """
        if "," in str(self.library.folder):
            raise InputError(
                "the page's folder has a comma in its name, and commas separate further photos; "
                "start a2v serve with another --folder"
            )
        digest = (await self._opened(folder, "open", shown=str(folder / SHOWN)))["digest"]
        if digest in (photo.digest, *photo.more):
            raise InputError("this photo is here already; take one from another side")
        if len(photo.more) + 2 > MAX_PHOTOS or photo.id not in self.library.photos:
            raise InputError(f"at most {MAX_PHOTOS} photos of one person are taken")
        name = f"more-{len(photo.more) + 1}"  # nothing waits from here on
        self._move(folder / ORIGINAL, photo, name)
        self._move(folder / SHOWN, photo, f"{name}.jpg")
        photo.more, photo.known = [*photo.more, digest], False
        self.library.keep(photo)

    async def remove_more(self, photo: Photo) -> None:
        """Remove the further photos of a person."""
        for number in range(len(photo.more)):
            for name in (f"more-{number + 1}", f"more-{number + 1}.jpg"):
                (self.library.place(photo) / name).unlink(missing_ok=True)
        gone, photo.more, photo.known = photo.more, [], False
        self.library.keep(photo)
        await self._forget(gone)

    async def add_clip(self, photo: Photo, folder: Path, suffix: str, title: str) -> None:
        """Add the uploaded video in `folder` as a motion for the person in `photo`.

        It replaces an earlier video.

        Raises
        ------
        InputError
            The file is not a video, is too large or too long, or the earlier video is in use.
        """
        facts = await self._opened(folder, "clip")
        if photo.id not in self.library.photos:
            raise InputError("this photo was removed; choose another")
        gone = self._take_clip(photo)  # nothing waits until the record is written
        self._move(folder / ORIGINAL, photo, f"{CLIP}{suffix}")
        photo.clip, photo.clip_title = suffix, title[:80] or "video"
        photo.clip_seconds = float(facts["seconds"])
        photo.clip_digest = facts["digest"]
        self.library.keep(photo)
        await self._forget([gone])

    async def remove_clip(self, photo: Photo) -> None:
        """Remove the video with the motion for a person, and the stored values made from it.

        Raises
        ------
        InputError
            A queued or running job uses its motion.
        """
        gone = self._take_clip(photo)
        self.library.keep(photo)
        await self._forget([gone])

    async def add_motion(self, folder: Path, suffix: str, title: str) -> KeptMotion:
        """Add the motion of the uploaded file in `folder`; the file itself is not kept.

        Raises
        ------
        InputError
            The file has no motion of a person, or is too large, or there are too many motions.
        """
        if len(self.library.motions) >= MAX_MOTIONS:
            raise InputError(f"{MAX_MOTIONS} motions are kept here already; remove some first")
        facts = await self._opened(folder, "motion", suffix=suffix, made=str(folder / MOTION))
        for known in self.library.motions.values():
            if known.digest == facts["digest"]:
                return known
        title = title[:MAX_TITLE] or "motion"
        motion = KeptMotion(id=folder.name, title=title, created=time.time(), **facts)
        self.library.take_in(motion, folder)
        self.library.motions[motion.id] = motion
        return motion

    async def remove_motion(self, motion: KeptMotion) -> None:
        """Remove a motion, and the stored values made from it.

        Raises
        ------
        InputError
            A queued or running job uses it.
        """
        if any(job.wish.motion == motion.id and not job.over for job in self.library.jobs.values()):
            raise InputError("this motion is in use; cancel the films that use it first")
        for folder in self.library.remove(motion):
            shutil.rmtree(folder, ignore_errors=True)
        await self._forget([motion.digest])

    def _take_clip(self, photo: Photo) -> str:
        """Remove the video with the motion for a person; return its digest, "" without one."""
        if not photo.clip:
            return ""
        if any(job.wish.clip and not job.over for job in self.library.jobs_of(photo)):
            raise InputError("this video is in use; cancel the jobs that use it first")
        (self.library.place(photo) / f"{CLIP}{photo.clip}").unlink(missing_ok=True)
        gone = photo.clip_digest
        photo.clip, photo.clip_title, photo.clip_seconds, photo.clip_digest = "", "", 0.0, ""
        return gone

    def _move(self, file: Path, photo: Photo, name: str) -> None:
        """Move a file to a person's files."""
        try:
            file.rename(self.library.place(photo) / name)
        except OSError as error:
            raise InputError(
                f"this cannot be kept: {error.strerror}; free some space and send it again"
            ) from error

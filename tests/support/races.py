"""People of the page who are removed at any moment.

The child processes write files (`tests.support.writer`) or are the real ones, which take the ready
person.
"""

from __future__ import annotations

import asyncio
import io
import random
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from starlette.exceptions import HTTPException

from a2v.errors import A2VError
from a2v.perception import Corrections
from a2v.samples.ready import PHOTO
from pipelines.commands.serve import COMPUTE
from pipelines.serve.desk import Desk
from pipelines.serve.library import Library
from pipelines.serve.live import Live
from pipelines.serve.records import Photo
from pipelines.serve.talk import ORIGINAL
from pipelines.serve.wishes import Wish
from tests.support.page import arrived
from tests.support.ready_store import fill
from tests.support.writer import STEP_SECONDS, STEPS, WRITER

WISH = Wish(action="Walk", seconds=0.5, views=("front",), size=128, spp=1)
CORRECTED = Corrections.of({"units": "fractions", "landmarks": {"nose": [0.5, 0.1]}})


def photograph(number: int) -> bytes:
    """A small photo that differs from others in its color."""
    data = io.BytesIO()
    shade = np.full((130, 130, 3), (number % 256, number // 256 + 9, 80), np.uint8)
    Image.fromarray(shade).save(data, "png")
    return data.getvalue()


def busy(
    desk: Desk, live: Live, number: int, film: bytes, picture: bytes
) -> tuple[Photo, list[Any]]:
    """A person of whom something is made, and the requests that are under way."""
    library = desk.library
    photo = arrived(library, picture, f"person {number}")
    work: list[Any] = []

    async def further() -> None:
        async with desk.arrivals.folder(1 << 20) as folder:
            (folder / ORIGINAL).write_bytes(photograph(1000 + number))
            await desk.arrivals.add_more(photo, folder)

    async def filmed() -> None:
        async with desk.arrivals.folder(1 << 20) as folder:
            (folder / ORIGINAL).write_bytes(film)
            await desk.arrivals.add_clip(photo, folder, ".mp4", "film")

    async def corrected() -> None:
        for _ in range(40):
            await asyncio.sleep(0.01)
            desk.correct(photo, CORRECTED)

    async def recorded() -> None:
        await live.open(photo)
        await live.record(True)
        await live.record(False)

    async def exported() -> None:
        await desk.cast.play(photo, WISH)
        await desk.cast.export(photo, WISH, "mixamo", ".glb")

    if number % 3:
        photo.status, photo.known = "ready", number % 2 == 0
        done, _ = library.add_job(photo, WISH), library.add_job(photo, WISH)
        done.status = "done"
        library.keep(done)
        work += [exported()] if number % 3 == 1 else [recorded()]
        work += [corrected()] if number % 2 else []
    work += [further(), filmed()]
    desk.wake()
    return photo, work


def remove_at_moments(
    folder: Path, film: bytes, draw: random.Random, moments: int, *, real: bool = False
) -> None:
    """Remove as many people, each at a drawn moment; nothing of anybody may be left.

    With `real` the maker and the looker are those of the page, and each person is the ready one.
    """
    code, longest = (COMPUTE, 6.0) if real else (WRITER, 2.5 * STEPS * STEP_SECONDS)
    desk = Desk(Library(folder / "page"), code, cache=str(folder / "store"), workers=1)
    live = Live(desk, WRITER)
    room = desk.library.folder

    async def all_moments() -> None:
        desk.start()
        try:
            for number in range(moments):
                if real:
                    fill(folder / "store")  # removing a person forgets what was made of them
                picture = PHOTO.read_bytes() if real else photograph(number)
                photo, work = busy(desk, live, number, film, picture)
                under_way = [asyncio.create_task(one) for one in work]
                await asyncio.sleep(draw.uniform(0.0, longest))
                ids = {photo.id, *(job.id for job in desk.library.jobs_of(photo))}
                await desk.remove(photo)
                said = await asyncio.gather(*under_way, return_exceptions=True)
                odd = [e for e in said if e and not isinstance(e, A2VError | HTTPException)]
                assert not odd, odd
                left = [path for path in room.rglob("*") if ids & set(path.parts)]
                assert not left, (number, left)
            await asyncio.sleep(longest)  # for who still writes
        finally:
            await asyncio.gather(desk.close(), live.close())

    asyncio.run(all_moments())
    files = {path for path in room.rglob("*") if path.is_file() and path.name[0] != "."}
    assert files <= {room / "forgetting", room / "times.json"}, files  # the second is of nobody
    assert not Library(room).photos
    assert not Library(room).damaged

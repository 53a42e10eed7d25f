"""A server with one person who is driven live, and a camera made of pictures."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import uvicorn
from PIL import Image

from a2v.animation import bind
from a2v.body import load_body_model, make_body
from a2v.formats.gltf import write_glb
from a2v.geometry.mesh import vertex_normals
from a2v.types import ByteArray, Character, Surface
from pipelines.serve.app import make_app
from pipelines.serve.desk import Desk
from pipelines.serve.figure import BODY
from pipelines.serve.library import Library
from pipelines.serve.live import Live
from pipelines.serve.live_child import main
from pipelines.serve.records import PERSON
from tests.support.page import ready

DRIVE = "from tests.support.live import drive; drive()"
"""Program of a child process that drives `plain_character`."""
TOKEN = "livetoken0123456789livetoken01234567"


def plain_character() -> Character:
    """Anny's adult in a thin gray skin."""
    model = load_body_model()
    body = make_body(model, np.zeros((model.n_bones, 3), np.float32), grounded=True)
    vertices = body.vertices + 0.008 * vertex_normals(
        body.vertices.astype(np.float64), body.faces.astype(np.int64)
    )
    colors = np.full(vertices.shape, 0.6, np.float32)
    return bind(
        Surface(vertices=vertices.astype(np.float32), faces=body.faces, colors=colors), body
    )


def drive() -> None:
    """Run as the child process."""

    def find(task: Mapping[str, Any]) -> Character:
        return plain_character()

    main(find)


def jpeg(image: ByteArray) -> bytes:
    """An image as JPEG."""
    out = io.BytesIO()
    Image.fromarray(image).save(out, "jpeg", quality=90)
    return out.getvalue()


def write_camera(path: Path, images: Sequence[ByteArray]) -> None:
    """Write the file that Chromium's fake camera plays."""
    path.write_bytes(b"".join(jpeg(image) for image in images))


@contextmanager
def live_server(folder: Path, code: str = DRIVE, vmc: int = 0) -> Iterator[tuple[str, str]]:
    """The address of a server with one person, and the photo's name."""
    library = Library(folder)
    photo = ready(library)
    place = library.place(photo)
    character = plain_character()
    moves = np.repeat(character.body.bone_transforms[None], 3, axis=0)
    write_glb(place / PERSON, character, {"Idle": (moves, 10.0)})
    character.body.save(place / BODY)
    desk = Desk(library, "", cache=str(folder / "store"))
    started = threading.Event()
    app = make_app(desk, Live(desk, code, vmc), TOKEN, started.set)
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="error", lifespan="on"))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    started.wait(30)
    while not server.started:
        thread.join(0.05)
    port = server.servers[0].sockets[0].getsockname()[1]
    try:
        yield f"http://127.0.0.1:{port}/{TOKEN}/", photo.id
    finally:
        server.should_exit = True
        thread.join(30)

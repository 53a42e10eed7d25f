"""Uploads of a browser: pictures, files that are none, and files that would exhaust memory."""

from __future__ import annotations

import io
import os
import struct
import zipfile
import zlib

import numpy as np
from PIL import Image


def picture(size: tuple[int, int] = (160, 200), form: str = "png", **how: object) -> bytes:
    buffer = io.BytesIO()
    pixels = np.random.default_rng(0).integers(0, 255, (size[1], size[0], 3), dtype=np.uint8)
    Image.fromarray(pixels).save(buffer, form, **how)
    return buffer.getvalue()


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def bomb(width: int, height: int) -> bytes:
    """Return a PNG whose header states a very large size."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return (
        b"\x89PNG\r\n\x1a\n"
        + head
        + chunk(b"IDAT", zlib.compress(bytes(1000)))
        + chunk(b"IEND", b"")
    )


def zipped(name: str) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(name, "x")
    return buffer.getvalue()


def hostile_uploads() -> list[bytes]:
    """Files that are no photo, are incomplete, or would exhaust memory."""
    random = np.random.default_rng(1)
    png, jpeg, webp = picture(), picture(form="jpeg"), picture(form="webp")
    texts = [
        b"",
        b"\0",
        b"x",
        b"not a picture",
        b"<svg xmlns='http://www.w3.org/2000/svg'><script>alert(1)</script></svg>",
        b"<!doctype html><script>fetch('/')</script>",
        b"%PDF-1.7",
        b"GIF89a",
        b"\xff\xd8\xff\xe0",
        b"RIFF\xff\xff\xff\xffWEBPVP8 ",
        b"BM" + bytes(60),
        b"II*\0" + b"\xff" * 60,
        b"P6 99999 99999 255\n",
        b"P6\n-1 -1\n255\n",
        b"%!PS-Adobe-3.0 EPSF\n%%BoundingBox: 0 0 9 9\n",
        zipped("../../etc/x"),
        b"\x1f\x8b" + bytes(50),
        b"\x7fELF" + bytes(100),
        b"ftypheic" * 10,
        b"\0\0\0\x1cftypavif" + bytes(100),
        b"push graphic-context\n",
        b"{}",
        b"\x89PNG\r\n\x1a\n",
        b"\x80\x04\x95" + bytes(30),
        b"v 0 0 0\nf 1 1 1\n",
        b"glTF\2\0\0\0",
        os.urandom(4096),
        b"A" * 100_000,
    ]
    sizes = [
        bomb(1 << 20, 1 << 20),
        bomb(2**31 - 1, 1),
        bomb(0, 0),
        bomb(30000, 30000),
        picture((10, 10)),
        picture((2000, 20)),
    ]
    cut = [
        data[: int(len(data) * share)] for data in (png, jpeg, webp) for share in (0.02, 0.3, 0.7)
    ]
    mixed = []
    for data in (png, webp):
        for _ in range(4):
            broken = bytearray(data)
            broken[30:] = random.permutation(np.frombuffer(bytes(broken[30:]), np.uint8)).tobytes()
            mixed.append(bytes(broken))
    return [*texts, *sizes, *cut, *mixed]

"""Join the parts of a ``.gltf``: its JSON, and the arrays and pictures in files beside it."""

from __future__ import annotations

import base64
import binascii
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any
from urllib.parse import unquote

from a2v.io import brief, read_bytes

MAX_PARTS = 1_000
"""Largest number of buffers and pictures of a file."""
_KINDS = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg", b"RIFF": "image/webp"}


def join_parts(source: Path, tree: dict[str, Any], most: int) -> tuple[dict[str, Any], bytes]:
    """Return the JSON and the one binary chunk of a ``.gltf`` with all its parts inside.

    Parts are data URIs, or files in the folder of `source` or below it.

    Parameters
    ----------
    source : Path
        The ``.gltf``.
    tree : dict
        Its JSON.
    most : int
        Largest number of bytes of all parts.

    Raises
    ------
    ValueError
        A part is not in the folder, has too few bytes, or is no picture.
    InputError
        A part cannot be read.
    """
    made = dict(tree)
    buffers, images = (_objects(tree, kind) for kind in ("buffers", "images"))
    if len(buffers) + len(images) > MAX_PARTS:
        raise ValueError(f"has {len(buffers) + len(images)} parts; expected at most {MAX_PARTS}")
    whole, starts = bytearray(), []
    for buffer in buffers:
        length = buffer.get("byteLength")
        if not isinstance(length, int) or isinstance(length, bool) or length < 0:
            raise ValueError(f"has a buffer of {brief(length)} bytes")
        data = _bytes(source, buffer.get("uri"), most - len(whole))
        if len(data) < length:
            raise ValueError(f"has a buffer of {length} bytes with {len(data)} in its file")
        whole += b"\0" * (-len(whole) % 4)
        starts.append(len(whole))
        whole += data[:length]
    views = []
    for view in _objects(tree, "bufferViews"):
        number = view.get("buffer", 0)
        if not isinstance(number, int) or not 0 <= number < len(starts):
            raise ValueError(f"has a bufferView of buffer {brief(number)}")
        offset = view.get("byteOffset", 0)
        if not isinstance(offset, int) or isinstance(offset, bool) or offset < 0:
            raise ValueError(f"has a bufferView at {brief(offset)}")
        views.append(view | {"buffer": 0, "byteOffset": starts[number] + offset})
    for number, image in enumerate(images):
        if "uri" not in image:
            continue
        data = _bytes(source, image["uri"], most - len(whole))
        kind = next((kind for start, kind in _KINDS.items() if data.startswith(start)), None)
        if kind is None:
            raise ValueError(f"has a picture {brief(image['uri'])} that is no PNG, JPEG or WebP")
        whole += b"\0" * (-len(whole) % 4)
        views.append({"buffer": 0, "byteOffset": len(whole), "byteLength": len(data)})
        whole += data
        images[number] = {key: value for key, value in image.items() if key != "uri"}
        images[number] |= {"bufferView": len(views) - 1, "mimeType": kind}
    for key, value in (("images", images), ("bufferViews", views)):
        if value:
            made[key] = value
    made["buffers"] = [{"byteLength": len(whole)}]
    return made, bytes(whole)


def _objects(tree: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    value = tree.get(kind, [])
    if not isinstance(value, list) or any(not isinstance(entry, dict) for entry in value):
        raise ValueError(f"'{kind}' is no list of objects")
    return list(value)


def _bytes(source: Path, uri: object, most: int) -> bytes:
    """Return the bytes of a data URI, or of a file in the folder of `source`."""
    if not isinstance(uri, str):
        raise ValueError(f"has a part at {brief(uri)}; expected a file beside it")
    if uri.startswith("data:"):
        head, _, text = uri.partition(",")
        if not head.endswith(";base64") or len(text) > 4 * most // 3 + 4:
            raise ValueError("has a data URI that is not base64, or too large")
        try:
            return base64.b64decode(text, validate=True)
        except (binascii.Error, ValueError):
            raise ValueError("has a data URI that is not base64") from None
    name = unquote(uri)
    inside = not any(
        path.is_absolute() or ".." in path.parts or path.drive or ":" in name or "\0" in name
        for path in (PurePosixPath(name), PureWindowsPath(name))
    )
    folder = source.parent.resolve()
    if not inside or not (folder / name).resolve().is_relative_to(folder):
        raise ValueError(f"has a part at {brief(uri)}, which is not a file beside it or below")
    return read_bytes(folder / name, limit=max(most, 1))

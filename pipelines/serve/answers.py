"""The answers of the page's application: JSON, files, and refusals."""

from __future__ import annotations

import json
import stat
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from a2v.errors import printable
from pipelines.serve.records import Job, Record
from pipelines.serve.words import for_page
from pipelines.stages import said

PAGE = Path(__file__).parent / "page"
_TYPES = {
    ".html": "text/html",
    ".css": "text/css",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
    ".jpg": "image/jpeg",
    ".png": "image/png",
    ".gif": "image/gif",
    ".webp": "image/webp",
    ".mp4": "video/mp4",
    ".glb": "model/gltf-binary",
    ".json": "application/json",
}
_ALONE = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src "
        "data: blob:; media-src data:; "
        "connect-src data: blob:; frame-ancestors 'self'; sandbox allow-scripts"
    )
}
"""Headers of self-contained pages with inline scripts: a separate origin, no network access."""


class Told(Response):
    """A JSON response in ASCII, which can represent any text."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        """Return a value as bytes of JSON."""
        return json.dumps(content, allow_nan=False, separators=(",", ":")).encode("ascii")


async def failed(request: Request, error: Exception) -> Response:
    """Answer an error of a2v with its message and status 400."""
    return Told({"problem": for_page(printable(str(error)))}, status_code=400)


async def refused(request: Request, error: Exception) -> Response:
    """Answer an HTTP error with its message and its status."""
    assert isinstance(error, HTTPException)
    return Told({"problem": for_page(error.detail)}, status_code=error.status_code)


def public(item: Record) -> dict[str, Any]:
    """Return a record without its digests, in the words of the page."""
    facts: dict[str, Any] = dict(vars(item))
    if isinstance(item, Job):
        facts |= {"wish": item.wish.said(), "title": said(item.wish.action)}
    for name in ("problem", "warnings", "notes"):
        told = facts.get(name, "")
        facts[name] = for_page(told) if isinstance(told, str) else [*map(for_page, told)]
    for name in ("digest", "clip_digest"):
        facts.pop(name, None)
    return facts


def file_answer(path: Path, inside: Path, *, download: str | None = None) -> Response:
    """Answer with a regular file inside `inside`, or with the byte range that a player requests.

    Raises
    ------
    HTTPException
        404: the file is outside `inside`, is not a regular file, or does not exist.
    """
    try:
        if not path.resolve().is_relative_to(inside.resolve()) or not stat.S_ISREG(
            path.lstat().st_mode
        ):
            raise HTTPException(404, "there is no such file")
    except OSError:
        raise HTTPException(404, "there is no such file") from None
    alone = path.suffix == ".html" and inside != PAGE
    headers = _ALONE if alone else {}
    return FileResponse(
        path,
        media_type=_TYPES.get(path.suffix, "application/octet-stream"),
        filename=download,
        headers=headers,
    )

"""Check input from a browser or an old record: normalize and check text once, limit bodies."""

from __future__ import annotations

import asyncio
import re
import unicodedata
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request

from a2v.errors import InputError
from a2v.io import parse_json

MAX_UPLOAD = 40 << 20
MAX_CLIP = 200 << 20
MAX_WORDS = 1 << 16
"""Largest number of bytes of a request that is neither a photo nor a video."""
MAX_LEVELS = 16
"""Largest nesting depth of objects and lists."""
BODY_SECONDS = 30.0
"""Seconds without data within a request after which the browser counts as disconnected."""
_SURROGATE = re.compile("[\ud800-\udfff]")
_UNSEEN = re.compile("[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]+")
"""Control characters and characters that change the writing direction.

Line breaks and tabs are included.
"""


def clean(value: Any, level: int = 0) -> Any:
    """Return a JSON value with texts that can be stored, encoded and shown.

    Texts are composed (NFC), with spaces in place of control characters.


    Raises
    ------
    InputError
        A text has a lone surrogate, which UTF-8 cannot encode, or objects and lists are nested
        deeper than `MAX_LEVELS`.
    """
    if level > MAX_LEVELS:
        raise InputError(f"the request is nested deeper than {MAX_LEVELS} levels")
    if isinstance(value, str):
        if _SURROGATE.search(value):
            raise InputError(
                "a text of the request has half a character (a lone surrogate); send it again in "
                "UTF-8"
            )
        return _UNSEEN.sub(" ", unicodedata.normalize("NFC", value))
    if isinstance(value, dict):
        return {clean(name, level + 1): clean(item, level + 1) for name, item in value.items()}
    if isinstance(value, list):
        return [clean(item, level + 1) for item in value]
    return value


def title(text: str) -> str:
    """Return the title to show for a file name."""
    kept = "".join(letter for letter in unicodedata.normalize("NFC", text) if letter.isprintable())
    return Path(kept.replace("\\", "/")).stem.strip()


async def read_json(request: Request, limit: int = MAX_WORDS) -> Mapping[str, Any]:
    """Return the JSON object in a request of at most `limit` bytes, with cleaned texts.

    Raises
    ------
    InputError
        The request is not a JSON object, or holds invalid text.
    HTTPException
        413: the request is too long; 408: it does not arrive.
    """
    data = await read_data(request, limit, "the request is too long")
    if not data:
        raise InputError("the request is empty; expected an object")
    said = parse_json(data, "the request", "an object")
    if not isinstance(said, dict):
        raise InputError("the request is not a JSON object")
    found: Mapping[str, Any] = clean(said)
    return found


async def read_data(request: Request, limit: int, too_large: str) -> bytes:
    """Return the body of a request of at most `limit` bytes.

    Raises
    ------
    HTTPException
        413: the request is too long, with the message `too_large`; 408: it does not arrive.
    """
    data = bytearray()
    async for part in _parts(request, limit, too_large):
        data += part
    return bytes(data)


async def save_photo(
    request: Request, path: Path, limit: int = MAX_UPLOAD, what: str = "photo"
) -> None:
    """Write the photo or video in a request to `path`, in parts. A failure leaves no file.

    Raises
    ------
    InputError
        The file is empty, or the disk is full.
    HTTPException
        413: the file is too large; 408: it does not arrive.
    """
    try:
        with path.open("xb") as stream:
            async for part in _parts(
                request,
                limit,
                f"this is larger than {limit >> 20} MB; send a smaller {what}",
            ):
                stream.write(part)
        if not path.stat().st_size:
            raise InputError(f"this file is empty; choose another {what}")
    except OSError as error:
        path.unlink(missing_ok=True)
        raise InputError(
            f"the {what} cannot be kept: {error.strerror}; free some space and send it again"
        ) from error
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def declared(request: Request, limit: int) -> int:
    """Return the largest number of bytes that the body of a request may have."""
    length = request.headers.get("content-length", "")
    return min(limit, int(length[:20])) if length.isascii() and length.isdigit() else limit


async def _parts(request: Request, limit: int, too_large: str) -> AsyncIterator[bytes]:
    """Yield the body of a request in parts.

    It is refused if its declared size or its actual size exceeds `limit`, or if it stops arriving.
    """
    length = request.headers.get("content-length", "0")
    if not (length.isascii() and length.isdigit()) or int(length[:20]) > limit:
        raise HTTPException(413, too_large)
    stream, size = request.stream(), 0
    while True:
        try:
            part = await asyncio.wait_for(anext(stream), BODY_SECONDS)
        except StopAsyncIteration:
            return
        except (TimeoutError, asyncio.TimeoutError):
            raise HTTPException(408, "the request does not arrive in time; send it again") from None
        except ClientDisconnect:
            raise HTTPException(400, "the connection was closed") from None
        size += len(part)
        if size > limit:
            raise HTTPException(413, too_large)
        yield part

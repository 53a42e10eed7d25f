"""Access control: only this machine and this page, with the token in the address.

All other requests are refused.
"""

from __future__ import annotations

import asyncio
import json
import re
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

HOSTS = ("127.0.0.1", "localhost", "[::1]")
"""Host names of this machine.

A page elsewhere whose host name resolves to this machine (DNS rebinding) sends another one.
"""

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
        "media-src 'self' blob:; connect-src 'self' blob:; "
        "frame-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'self'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(self), microphone=(), geolocation=()",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""Default headers of every response."""


class Guard:
    """Forwards valid requests to `inner`.

    Their path begins with the token, their host is this machine, and their origin is the page.
    """

    def __init__(self, inner: Application, token: str) -> None:
        self._inner, self._token = inner, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a request as an ASGI application."""
        if scope["type"] == "lifespan":
            await self._inner(scope, receive, send)
            return
        if scope["type"] != "http":
            return
        send = _with_headers(send)
        given = {
            name.decode("latin-1").lower(): value.decode("latin-1")
            for name, value in scope["headers"]
        }
        _, _, rest = scope["path"].partition("/")
        token, slash, path = rest.partition("/")
        if problem := _foreign(given):
            await _refuse(send, 403, problem)
        elif not secrets.compare_digest(token.encode(), self._token.encode()):
            await _refuse(
                send,
                403,
                "this address lacks its token; use the whole address that a2v serve has printed",
            )
        elif not slash:
            await _refuse(send, 404, "the address ends in a slash")
        else:
            raw, begun = f"/{path}", False

            async def answer(message: Message) -> None:
                nonlocal begun
                begun = True
                await send(message)

            try:
                await self._inner(
                    {**scope, "path": raw, "raw_path": raw.encode(), "root_path": ""},
                    receive,
                    answer,
                )
            except asyncio.CancelledError:  # the server stops before the answer is ready
                if not begun:
                    await _refuse(send, 503, "the server is stopping; start it again")


def _foreign(headers: dict[str, str]) -> str:
    """Return the problem with the source of a request, or an empty text."""
    host = headers.get("host", "")
    if re.sub(r":\d{1,5}$", "", host) not in HOSTS:
        return "this server only answers requests to 127.0.0.1 and localhost"
    origin = headers.get("origin")
    if origin is not None and origin != f"http://{host}":
        return "requests from other pages are refused"
    if (
        origin is None
        and headers.get("sec-fetch-site", "none") in ("cross-site", "same-site")
        and headers.get("sec-fetch-mode") != "navigate"
    ):
        return "requests from other pages are refused"
    return ""


def _with_headers(send: Send) -> Send:
    async def answer(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = {name.lower() for name, _ in message.get("headers", [])}
            more = [
                (name.lower().encode(), value.encode())
                for name, value in HEADERS.items()
                if name.lower().encode() not in own
            ]
            message = {**message, "headers": [*message.get("headers", []), *more]}
        await send(message)

    return answer


async def _refuse(send: Send, status: int, sentence: str) -> None:
    body = json.dumps({"problem": sentence}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})

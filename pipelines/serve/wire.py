"""Connection limits: close idle connections, and keep those without the token from blocking others.

All browsers of this machine share one address, so the token in a request identifies a trusted
connection. Until then, the connection counts as a stranger.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

HEADER_SECONDS = 10.0
"""Maximum seconds until the headers of the next request have arrived.

The time counts from the connection, or from the end of the last response.
"""
MAX_STRANGERS = 64
"""Maximum number of connections without a token; beyond it, the oldest is closed.

Browsers open a few in advance.
"""
MAX_CONNECTIONS = 400
"""Maximum number of connections: fifty browsers with six each, and others.

The usual limit of open files is 1,024.
"""


def protocol(token: str) -> type[H11Protocol]:
    """Return uvicorn's HTTP/1.1 protocol with these limits, for one server."""
    path = f"/{token}/"
    strangers: dict[H11Protocol, None] = {}  # in order of arrival

    class Patient(H11Protocol):
        """A connection with a deadline for each request."""

        _deadline: asyncio.TimerHandle | None = None

        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            strangers[self] = None
            self._deadline = self.loop.call_later(HEADER_SECONDS, self._hang_up)
            if len(strangers) > MAX_STRANGERS:
                oldest = next(iter(strangers))
                del strangers[oldest]
                oldest.transport.abort()

        def connection_lost(self, exc: Exception | None) -> None:
            self._cancel_deadline()
            strangers.pop(self, None)
            super().connection_lost(exc)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.scope is not None and self._deadline is not None:
                self._cancel_deadline()
                if self.scope["path"].startswith(path):
                    strangers.pop(self, None)

        def on_response_complete(self) -> None:
            self.scope = None  # type: ignore[assignment]  # until the next request
            super().on_response_complete()
            if not self.transport.is_closing() and self.scope is None:
                self._deadline = self.loop.call_later(HEADER_SECONDS, self._hang_up)

        def _cancel_deadline(self) -> None:
            if self._deadline is not None:
                self._deadline.cancel()
                self._deadline = None

        def _hang_up(self) -> None:
            self._deadline = None
            self.transport.abort()

    return Patient

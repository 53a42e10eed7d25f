"""Connections: whoever does not say what they want is hung up on, and whoever has no token cannot
crowd out those who have.

All browsers of this machine have one address, so connections are told apart by the token in what
they ask for: until a connection has shown it, it is a stranger's.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

HEADER_SECONDS = 10.0
"""From the connection, or the end of the last answer, to the end of a request's headers."""
MAX_STRANGERS = 64
"""Connections without a token; one more, and the one that is silent the longest is closed. Browsers
open a few ahead of need."""
MAX_CONNECTIONS = 400
"""Of all together: fifty browsers with six each, and strangers; the usual limit of open files is
1,024."""


def protocol(token: str) -> type[H11Protocol]:
    """uvicorn's protocol for HTTP/1.1 with these limits, of one server."""
    path = f"/{token}/"
    strangers: dict[H11Protocol, None] = {}  # in the order in which they came

    class Patient(H11Protocol):
        """A connection that is not waited for without end."""

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
            self._asked()
            strangers.pop(self, None)
            super().connection_lost(exc)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.scope is not None and self._deadline is not None:
                self._asked()
                if self.scope["path"].startswith(path):
                    strangers.pop(self, None)

        def on_response_complete(self) -> None:
            self.scope = None  # type: ignore[assignment]  # until the next request
            super().on_response_complete()
            if not self.transport.is_closing() and self.scope is None:
                self._deadline = self.loop.call_later(HEADER_SECONDS, self._hang_up)

        def _asked(self) -> None:
            if self._deadline is not None:
                self._deadline.cancel()
                self._deadline = None

        def _hang_up(self) -> None:
            self._deadline = None
            self.transport.abort()

    return Patient

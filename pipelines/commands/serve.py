"""``a2v serve``: open a page on this machine that makes videos from photos."""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
import socket
import webbrowser
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import A2VError, InputError
from a2v.io import atomic_path, read_bytes
from a2v.system import keep_files_private, lock
from pipelines.answer import Answer
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions, check_writable
from pipelines.options import flag, option
from pipelines.requests.video import VideoRequest

if TYPE_CHECKING:
    from a2v.types import Character
    from pipelines.serve.wishes import Wish

HELP = "Serve a web page on this machine: choose a photo and an action, watch the progress, turn the character and download the files."
EXAMPLES = """examples:
  a2v serve                                     prints the address; open it in a browser of this machine
  a2v serve --browser                           opens it
  a2v serve --folder out/page --port 9000

Only this machine reaches the server, and only with the whole address. Photos, videos and the queue are kept in --folder;
the next start continues the queue. Ctrl-C ends the server."""

LOCAL = "127.0.0.1"
PORT = 8420
COMPUTE = "from pipelines.commands.serve import compute; compute()"
"""Program of the page's child processes."""
DRIVE = "from pipelines.commands.serve import drive; drive()"
"""Program of the live mode."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    folder: str | None = option(
        "folder of photos, videos and the queue (default: ~/.local/share/a2v/page)",
        default=None,
    )
    port: int = option("port on 127.0.0.1; 0 for any free port", default=PORT)
    browser: bool = flag("open the page in the browser")
    vmc: int = option(
        "port on 127.0.0.1 to which the live mode sends VMC (usually 39539); 0 for none", default=0
    )
    workers: int | None = option("number of processes (default: one per core)", default=None)
    cache: str | None = option(
        "folder of cached results (default: $A2V_CACHE, else ~/.cache/a2v)",
        default=None,
        metavar="FOLDER",
    )


def run(options: Options) -> Answer:
    """Serve until interrupted; print the address as soon as the server answers."""
    import uvicorn

    if options.workers is not None and options.workers < 1:
        raise InputError(f"workers is {options.workers}; expected 1 or more")
    if not 0 <= options.vmc <= 65535:
        raise InputError(f"vmc is {options.vmc}; expected a port, 1 to 65535, or 0 for none")
    keep_files_private()  # Only the user may read photos, videos and the token.
    folder = _private_folder(options.folder)
    Store(options.cache).prepare()
    with _lock_folder(folder), _listening(options.port) as listener:
        from pipelines.serve.app import make_app
        from pipelines.serve.desk import Desk
        from pipelines.serve.library import Library
        from pipelines.serve.live import Live
        from pipelines.serve.wire import MAX_CONNECTIONS, protocol

        token = _token(folder)
        address = f"http://{LOCAL}:{listener.getsockname()[1]}/{token}/"

        def ready() -> (
            None
        ):  # A user who has read the address may press Ctrl-C, so the handler is set first.
            print(address, flush=True)
            if options.browser:
                _open(folder, address)

        desk = Desk(Library(folder), COMPUTE, cache=options.cache, workers=options.workers)
        app = make_app(desk, Live(desk, DRIVE, options.vmc), token, ready)
        config = uvicorn.Config(
            app,
            loop="asyncio",
            http=protocol(token),
            ws="none",
            lifespan="on",
            log_level="error",
            access_log=False,
            server_header=False,
            proxy_headers=False,
            timeout_graceful_shutdown=2,
            limit_concurrency=MAX_CONNECTIONS,
        )
        with contextlib.suppress(
            KeyboardInterrupt, asyncio.CancelledError
        ):  # The second interrupt: the first came before the loop had started.
            uvicorn.Server(config).run(sockets=[listener])
    return Answer(text="", facts={"address": address, "folder": folder})


def compute() -> None:
    """Run as a child process of the page: make videos and files with the commands' functions."""
    from pipelines.commands import character, video
    from pipelines.engines import EngineOptions
    from pipelines.rigs import AvatarOptions, RigOptions
    from pipelines.serve.worker import main

    def make(request: VideoRequest, out: str, running: RunOptions, wish: Wish) -> Answer:
        return video.run(
            video.Options(
                person=request.person,
                out=out,
                motion=request.motion,
                film=request.film,
                animation=wish.animation or None,
                sprites=wish.sprites,
                running=running,
            )
        )

    def write(
        request: VideoRequest, clip: str, target: Path, rig: str, running: RunOptions
    ) -> list[Path]:
        rigging = RigOptions(rig=rig)
        avatar = character.avatar_of(target, rigging, AvatarOptions())
        animated = character.animate(
            request.person, {clip: request.motion}, running, deform=None, folder=target.parent
        )
        return character.write_animated(target, animated, rigging, EngineOptions(), avatar)

    main(make, write)


def drive() -> None:
    """Run as the child process of the live mode."""
    from pipelines.serve.figure import person_parameters
    from pipelines.serve.live_child import main
    from pipelines.serve.watched import Watched

    def find(task: Mapping[str, Any]) -> Character:
        from a2v.types import Character

        running = Watched(cache=task["cache"], quiet=True)
        outcome = running.run("engine_character", person_parameters(task))
        return outcome.get("engine_character", Character)

    main(find)


def _private_folder(asked: str | None) -> Path:
    """Return the folder of the page after a check that it can be written.

    Raises
    ------
    InputError
        It cannot be written, or belongs to somebody else.
    """
    if asked is None:
        data = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
        folder = Path(data) / "a2v" / "page"
    else:
        folder = Path(asked)
    return check_writable(folder).resolve()


@contextlib.contextmanager
def _lock_folder(folder: Path) -> Iterator[None]:
    """Lock the folder, since two servers would run every job twice."""
    with open(folder / "lock", "a", encoding="utf-8") as stream:
        if not lock(stream.fileno()):
            raise InputError(
                f"a page runs on {folder} already; open its address, end it first, or choose "
                "another --folder"
            )
        yield


@contextlib.contextmanager
def _listening(port: int) -> Iterator[socket.socket]:
    """Open a socket on this machine's own address."""
    if not 0 <= port <= 65535:
        raise InputError(f"port is {port}; expected 0 to 65535")
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((LOCAL, port))
            listener.listen()  # Connections before the server is ready wait.
        except OSError as error:
            raise InputError(
                f"cannot listen on port {port}: {error.strerror}; choose another --port, or 0 for "
                "any"
            ) from None
        yield listener


def _token(folder: Path) -> str:
    """Return the secret of the address.

    It is stored in the folder, so that an open page still works after a restart.
    """
    path = folder / "token"
    with contextlib.suppress(A2VError, UnicodeDecodeError):
        known = read_bytes(path, limit=1000).decode("ascii").strip()
        if len(known) >= 32 and known.isalnum() and not path.stat().st_mode & 0o077:
            return known
    token = secrets.token_hex(20)
    with atomic_path(path) as temporary:
        temporary.write_text(token, encoding="utf-8")
    return token


def _open(folder: Path, address: str) -> None:
    """Open the address in a browser, through a file that redirects to it.

    The address holds a secret, and other users of the machine can read the arguments of programs.
    """
    path = folder / "open.html"
    with atomic_path(path) as temporary:
        temporary.write_text(
            f'<!doctype html><meta http-equiv="refresh" content="0; url={escape(address)}"><a '
            f'href="{escape(address)}">a2v</a>',
            encoding="utf-8",
        )
    webbrowser.open(path.as_uri())

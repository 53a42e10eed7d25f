"""An object store for workers without a shared folder: S3, GCS, SSH or any other of fsspec.

There are four operations on whole objects. Each is repeated while the store or the network fails
for a moment. An object appears under its key only when it is complete.
"""

from __future__ import annotations

import functools
import importlib.util
import os
import time
import uuid
from collections.abc import Callable
from typing import Any, TypeVar

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.io import shorten

T = TypeVar("T")

ATTEMPTS = 7
FIRST_WAIT = 0.1
"""Seconds before the second attempt; twice as long before each further one."""
MAX_OBJECT_BYTES = 4 << 30
_RENAMING = {"file", "local", "memory", "sftp", "ssh"}
"""Protocols in which a file grows under its name while it is written. Others write at once."""
_OBJECT_STORES = ("s3", "gs", "abfs")
"""Protocols for which obstore is used if it is installed; otherwise fsspec's plug-ins are used."""
_EXTRAS = {
    "s3": "objects",
    "gs": "objects",
    "gcs": "objects",
    "abfs": "objects",
    "ssh": "ssh",
    "sftp": "ssh",
}
_LASTING = (PermissionError, NotADirectoryError, IsADirectoryError)


def is_remote(address: str | os.PathLike[str] | None) -> bool:
    """Return whether a store's address is a URL such as ``s3://bucket/folder``, not a folder."""
    return address is not None and "://" in os.fspath(address)


class Remote:
    """The objects of an object store, each named by its key below a URL.

    Parameters
    ----------
    url : such as ``s3://bucket/folder``, ``gs://...``, ``sftp://user@host/folder`` or
        ``file:///folder``. fsspec's plug-in takes the access from its usual settings (for S3 the
        ``AWS_...`` variables).
    """

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")

    @functools.cached_property
    def _place(self) -> tuple[Any, str]:
        """The file system of the URL, and the folder of the store in it."""
        import fsspec

        protocol = self.url.partition("://")[0]
        try:
            if protocol in _OBJECT_STORES and importlib.util.find_spec("obstore"):
                from obstore.fsspec import register

                register(protocol)
                files, root = fsspec.core.url_to_fs(self.url)
            else:
                files, root = fsspec.core.url_to_fs(self.url, use_listings_cache=False)
        except ImportError as error:
            extra = _EXTRAS.get(protocol)
            hint = f"pip install 'a2v[{extra}]'" if extra else shorten(error, 120)
            raise MissingDependencyError(
                f"the store {self.url} needs a plug-in of fsspec: {hint}"
            ) from error
        except Exception as error:  # each plug-in raises its own errors for an invalid address
            raise InputError(
                f"the store {self.url} cannot be opened ({shorten(error, 120)}); expected a URL "
                "such as s3://bucket/folder"
            ) from error
        return files, root

    def exists(self, key: str) -> bool:
        """Return whether an object exists."""
        return self._retried(lambda files, root: bool(files.exists(f"{root}/{key}")))

    def fetch(self, key: str) -> bytes | None:
        """Return the bytes of an object, or None if it does not exist."""

        def read(files: Any, root: str) -> bytes | None:
            try:
                return bytes(files.cat_file(f"{root}/{key}", start=0, end=MAX_OBJECT_BYTES))
            except FileNotFoundError:
                return None

        return self._retried(read)

    def put(self, key: str, data: bytes) -> None:
        """Write an object; it replaces an existing one."""

        def write(files: Any, root: str) -> None:
            path = f"{root}/{key}"
            protocols = {files.protocol} if isinstance(files.protocol, str) else set(files.protocol)
            if not protocols & _RENAMING:
                files.pipe_file(path, data)
                return
            folder, _, name = path.rpartition("/")
            temporary = f"{folder}/.{name}-{uuid.uuid4().hex[:8]}"
            files.makedirs(folder, exist_ok=True)
            files.pipe_file(temporary, data)
            files.mv(temporary, path)

        self._retried(write)

    def remove(self, key: str) -> None:
        """Remove an object if it exists."""

        def drop(files: Any, root: str) -> None:
            try:
                files.rm_file(f"{root}/{key}")
            except FileNotFoundError:
                return

        self._retried(drop)

    def _retried(self, work: Callable[[Any, str], T]) -> T:
        """Do `work`, and repeat it after a failure that may be temporary.

        Raises
        ------
        A2VError
            It does not pass.
        """
        files, root = self._place
        for attempt in range(ATTEMPTS):
            try:
                return work(files, root)
            except _LASTING as error:
                raise A2VError(
                    f"the store {self.url} refuses: {shorten(error, 120)}; check the access to it"
                ) from error
            except Exception as error:  # plug-ins raise their own errors besides OSError
                if attempt == ATTEMPTS - 1:
                    raise A2VError(
                        f"the store {self.url} fails ({shorten(error, 120)}); finished results are "
                        "kept: repeat the command when it answers"
                    ) from error
                time.sleep(FIRST_WAIT * 2**attempt)
        raise AssertionError

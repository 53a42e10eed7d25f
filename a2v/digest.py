"""`Digest`: the name of content, by which the store, keys and settings compare files and values.

There is one kind of digest. SHA-256 is written only where somebody outside compares it with
`sha256sum`, in reports and results (`a2v.io.sha256`), and is never called a digest.
"""

from __future__ import annotations

import hashlib
import os
import re

from a2v.io import open_file

_HEX = re.compile("[0-9a-f]{40}")


class Digest(str):
    """Forty lower-case hexadecimal digits: BLAKE2b of 20 bytes.

    Raises
    ------
    ValueError
        The text is anything else.
    """

    __slots__ = ()

    def __new__(cls, text: str) -> Digest:
        """Check `text`."""
        if not _HEX.fullmatch(text):
            raise ValueError(f"'{text}' is no digest")
        return super().__new__(cls, text)

    @classmethod
    def of(cls, *parts: bytes | str) -> Digest:
        """Return the digest of the parts, one after the other; text counts as UTF-8."""
        made = hashlib.blake2b(digest_size=20)
        for part in parts:
            made.update(part.encode() if isinstance(part, str) else part)
        return cls(made.hexdigest())

    @classmethod
    def of_file(cls, path: str | os.PathLike[str]) -> Digest:
        """Return the digest of the contents of a file.

        Raises
        ------
        InputError
            It cannot be read.
        """
        made = hashlib.blake2b(digest_size=20)
        with open_file(path) as stream:
            while block := stream.read(1 << 20):
                made.update(block)
        return cls(made.hexdigest())

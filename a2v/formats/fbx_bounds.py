"""What a binary FBX of a stranger unpacks to, measured before three.js reads it.

Node's memory limit does not count arrays of numbers, so a file of 1 MB could take gigabytes.
The layout is that of Blender's FBX reader (io_scene_fbx/parse_fbx.py): nodes with properties, of
which arrays may be packed by zlib.
"""

from __future__ import annotations

import struct
import zlib

MAX_UNPACKED = 512 << 20
"""Largest sum of the unpacked arrays, bytes."""
MAX_TEXT = 64 << 20
"""Largest FBX in text, bytes: three.js keeps its lines and numbers as objects."""
MAX_NODES = 2_000_000
MAX_LEVELS = 64
_MAGIC = b"Kaydara FBX Binary  \0"
_START = 27
"""Bytes before the first node."""
_WIDE = 7500
"""The version from which offsets have 64 bits."""
_SIZES = {b"Y": 2, b"C": 1, b"B": 1, b"I": 4, b"F": 4, b"D": 8, b"L": 8}
_ITEMS = {b"f": 4, b"d": 8, b"l": 8, b"i": 4, b"b": 1, b"c": 1}
_PART = 1 << 20


def check_fbx(data: bytes) -> None:
    """Check that an FBX can be read within memory.

    Raises
    ------
    ValueError
        It is cut off or not an FBX, or exceeds a bound of this module.
    """
    if not data.startswith(_MAGIC):
        if len(data) > MAX_TEXT:
            raise ValueError(f"its text has {len(data) >> 20} MB; at most {MAX_TEXT >> 20}")
        return
    try:
        _Walk(data).nodes()
    except (struct.error, IndexError):
        raise ValueError("it is cut off") from None
    except zlib.error as error:
        raise ValueError(f"an array cannot be unpacked ({error})") from None


class _Walk:
    """A walk over all nodes, without recursion."""

    def __init__(self, data: bytes) -> None:
        self._data, self._left = data, MAX_UNPACKED
        wide = struct.unpack_from("<I", data, 23)[0] >= _WIDE
        self._head = struct.Struct("<QQQB" if wide else "<IIIB")

    def nodes(self) -> None:
        at, ends, count = _START, [len(self._data)], 0
        while ends:
            if at >= ends[-1] or len(self._data) - at < self._head.size:
                at = ends.pop()
                continue
            end, properties, _, name = self._head.unpack_from(self._data, at)
            at += self._head.size + name
            if not end:  # the last of a list of nodes, or of the file
                at = ends.pop()
                continue
            if not at <= end <= ends[-1]:
                raise ValueError("a node reaches beyond the one that it is in")
            count += 1 + properties
            if count > MAX_NODES or len(ends) > MAX_LEVELS:
                raise ValueError(
                    f"it has more than {MAX_NODES} nodes and properties, or {MAX_LEVELS} levels"
                )
            for _ in range(properties):
                at = self._property(at)
            ends.append(end)

    def _property(self, at: int) -> int:
        """Return where the property ends that begins at `at`."""
        kind = self._data[at : at + 1]
        if kind in _SIZES:
            return at + 1 + _SIZES[kind]
        if kind in (b"S", b"R"):
            return at + 5 + int(struct.unpack_from("<I", self._data, at + 1)[0])
        if kind not in _ITEMS:
            raise ValueError("it has a property of an unknown kind")
        count, packed, length = struct.unpack_from("<III", self._data, at + 1)
        size, start = count * _ITEMS[kind], at + 13
        self._left -= size
        if self._left < 0:
            raise ValueError(f"its arrays unpack to more than {MAX_UNPACKED >> 20} MB")
        if start + (length if packed else size) > len(self._data):
            raise ValueError("it is cut off")
        if not packed:
            return start + int(size)
        if _unpacked(self._data[start + 2 : start + length], size) != size:
            raise ValueError(f"an array does not unpack to the {size} bytes that it states")
        return start + int(length)


def _unpacked(data: bytes, most: int) -> int:
    """Return to how many bytes a deflated stream unpacks, or a number over `most`; none are
    kept."""
    unpacker, size = zlib.decompressobj(-zlib.MAX_WBITS), 0  # as three.js: the checksum is ignored
    while data and size <= most and not unpacker.eof:
        size += len(unpacker.decompress(data, _PART))
        data = unpacker.unconsumed_tail
    return size

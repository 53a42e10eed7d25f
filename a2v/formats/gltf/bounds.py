"""What a glTF of a stranger may make a reader allocate and compute, checked on its JSON alone.

The numbers of its accessors are counted while they are read, each before it is read
(`Gltf.accessor`). Every other bound is here and holds before anything is allocated.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

MAX_JSON_BYTES = 16 << 20
MAX_VALUES = 2_000_000
"""Largest number of commas and opening brackets of the JSON. Each may be an object in memory."""
MAX_LEVELS = 64
"""Largest depth of nested lists and objects."""
MAX_ITEMS = 50_000
"""Largest number of nodes, joints, accessors... in a file; characters have hundreds."""
MAX_JOINTS = 2_000
"""Largest number of joints of all skins together, each counted once, and of levels of nodes.
Characters have about a hundred."""
MAX_OWNED = 200_000
"""Largest sum of the joints of the skins, and of those of the skinned nodes."""
MAX_PRIMITIVES = 20_000
"""Largest sum of the primitives of the nodes' meshes."""
MAX_NUMBERS = 32_000_000
"""Largest number of numbers in all accessors that are read of a file, each as often as it is
read."""
MAX_VERTICES = 1_000_000
"""Largest number of vertices of all skinned meshes, as often as nodes use them."""
MAX_WEIGHTS = 32_000_000
"""Largest product of the numbers of vertices and bones."""
MAX_IMAGE_SIDE = 4096


def parse_gltf(text: bytes) -> dict[str, Any]:
    """Parse the JSON of a glTF.

    Raises
    ------
    ValueError
        It is not a JSON object in UTF-8, exceeds a bound of this module, or holds numbers or text
        that no JSON can hold: NaN, infinity, half a surrogate pair.
    """
    if not 0 < len(text) <= MAX_JSON_BYTES:
        raise ValueError(f"{len(text)} bytes; expected 1 to {MAX_JSON_BYTES}")
    values = sum(map(text.count, (b",", b"[", b"{")))
    if values > MAX_VALUES:
        raise ValueError(f"about {values} values; expected at most {MAX_VALUES}")
    try:
        content = json.loads(text.decode("utf-8-sig"))
        _check_levels(content)
        json.dumps(content, ensure_ascii=False, allow_nan=False).encode()
    except RecursionError:
        raise ValueError(f"nested deeper than {MAX_LEVELS} levels") from None
    except UnicodeEncodeError:
        raise ValueError("a text has half a character (a lone surrogate)") from None
    if not isinstance(content, dict):
        raise ValueError("no object")
    return content


def _check_levels(content: Any) -> None:
    level = [content]
    for _ in range(MAX_LEVELS):
        level = [
            inner
            for value in level
            for inner in (
                value.values() if isinstance(value, dict) else value if type(value) is list else ()
            )
            if isinstance(inner, dict | list)
        ]
        if not level:
            return
    raise ValueError(f"nested deeper than {MAX_LEVELS} levels")


def excess(
    nodes: Sequence[dict[str, Any]],
    skins: Sequence[dict[str, Any]],
    meshes: Sequence[dict[str, Any]],
) -> str:
    """Return what of a file's joints and primitives is used too often, before any is read; ""
    if nothing is."""
    joints, parts = (
        [_length(entry.get(key)) for entry in entries]
        for entries, key in ((skins, "joints"), (meshes, "primitives"))
    )
    owned, drawn = sum(joints), 0
    for node in nodes:
        owned += _of(joints, node.get("skin"))
        drawn += _of(parts, node.get("mesh"))
    if owned > MAX_OWNED:
        return f"has {owned} joints of skins and skinned nodes; at most {MAX_OWNED}"
    if drawn > MAX_PRIMITIVES:
        return f"draws {drawn} primitives; at most {MAX_PRIMITIVES} are read"
    return ""


def _length(value: Any) -> int:
    return len(value) if isinstance(value, list) else 0


def _of(lengths: list[int], index: Any) -> int:
    """Return a length by an index that may be anything; wrong ones are refused where they are
    used."""
    known = isinstance(index, int) and not isinstance(index, bool) and 0 <= index < len(lengths)
    return lengths[index] if known else 0

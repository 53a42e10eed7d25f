"""``a2v cache``: show or trim the store of cached results."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from typing import Any

from a2v.errors import InputError
from a2v.io import read_bytes
from pipelines.answer import Answer
from pipelines.engine.forget import forget, ref_of
from pipelines.engine.store import Store
from pipelines.inputs import MAX_PHOTO_BYTES
from pipelines.options import flag, option

HELP = "Show or trim the store of cached results."
EXAMPLES = """examples:
  a2v cache                  where it is and what it holds
  a2v cache --trim 5GB       remove the least recently used results
  a2v cache --forget me.jpg  remove everything that was computed from this photo
  a2v cache --clear          remove everything"""

_UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    cache: str | None = option(
        "folder of the store (default: $A2V_CACHE, else ~/.cache/a2v)",
        default=None,
        metavar="FOLDER",
    )
    trim: str | None = option(
        "remove the least recently used results until this size remains, such as 5GB",
        default=None,
        metavar="SIZE",
    )
    forget: str | None = option(
        "remove everything that was computed from this photo", default=None, metavar="PHOTO"
    )
    clear: bool = flag("remove everything")


def parse_size(text: str) -> int:
    """Return the number of bytes of a size such as "5GB".

    Raises
    ------
    InputError
        The text is not a size.
    """
    found = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([KMGT]?B?)\s*", text.upper())
    unit = found and (
        found.group(2)
        if found.group(2).endswith("B") or not found.group(2)
        else found.group(2) + "B"
    )
    if not found or unit not in _UNITS:
        raise InputError(
            f"'{text}' is not a size; expected a number and a unit, such as 500MB or 5GB"
        )
    return int(float(found.group(1)) * _UNITS[unit])


def run(options: Options) -> Answer:
    """Delete or trim the cached results if requested, then show the rest."""
    from pipelines.nodes.values import Blob

    store, lines, facts = Store(options.cache), list[str](), dict[str, Any]()
    if options.clear or options.trim is not None:
        removed = store.trim(
            0 if options.clear or options.trim is None else parse_size(options.trim),
            everything=options.clear,
        )
        lines.append(f"removed {removed / 1e6:.1f} MB")
        facts["removed_bytes"] = removed
    if options.forget is not None and not options.clear:
        gone = forget(store, [ref_of(Blob.of(read_bytes(options.forget, limit=MAX_PHOTO_BYTES)))])
        lines.append(
            f"forgot {options.forget}: {gone.calls} results, {gone.values} stored values, "
            f"{gone.bytes / 1e6:.1f} MB"
        )
        if gone.unknown:
            lines.append(
                f"  and {gone.unknown} results of an older version of a2v that are not linked "
                "to a photo"
            )
        lines.append("  not removed: the photo itself, and files in --out folders and pages")
        facts["forgotten"] = dataclasses.asdict(gone)
    usage = store.usage()
    lines += [
        f"store: {store.folder}",
        *(
            f"  {name:<24} {count:>7} files {size / 1e6:>10.1f} MB"
            for name, (count, size) in usage.items()
        ),
    ]
    kept = {name: {"files": count, "bytes": size} for name, (count, size) in usage.items()}
    return Answer(text="\n".join(lines), facts={"store": store.folder, "kept": kept, **facts})

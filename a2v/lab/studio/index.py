"""``index.json``: the settings that made a folder of views, so that two kinds are never mixed."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError
from a2v.io import atomic_path, parse_json, read_bytes
from a2v.version import __version__

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def keep_index(
    folder: str | os.PathLike[str],
    settings: DataclassInstance,
    version: int,
    *,
    older: Mapping[str, Any] | None = None,
) -> None:
    """Write a folder's index, or check that it was made with the same settings.

    Parameters
    ----------
    folder : path
    settings : dataclass
        Settings that determine the views.
    version : int
        Version of the views that a seed gives.
    older : mapping, optional
        Values of settings that older folders do not list: those with which they were made.

    Raises
    ------
    InputError
        The folder was made with other settings or another version, or its index is broken.
    """
    path = Path(folder) / "index.json"
    plain = json.loads(json.dumps(dataclasses.asdict(settings)))
    if not path.exists():
        with atomic_path(path) as temporary:
            temporary.write_text(
                json.dumps({"version": version, "a2v": __version__, "settings": plain}, indent=1),
                encoding="utf-8",
            )
        return
    found = parse_json(read_bytes(path, limit=1 << 24), path, "the index.json of a folder of views")
    if not isinstance(found, dict):
        raise InputError(f"{path} holds no JSON object; give a folder of views")
    made = found.get("settings")
    if (
        found.get("version") != version
        or not isinstance(made, dict)
        or {**(older or {}), **made} != plain
    ):
        raise InputError(
            f"{folder} was made with other settings or by another version (see its index.json); "
            "choose another folder"
        )

"""Register file formats by suffix.

A new format takes a module with its reader or writer and an entry in `MOTION_FORMATS` or
`CHARACTER_FORMATS` here. Reading by suffix, the outputs of commands and the lists in error messages
use these tables. Formats that are pictures (`a2v.rendering.DRAWN_FORMATS`,
`a2v.rendering.PAGE_FORMATS`) are entries of the same kinds.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from a2v.errors import InputError
from a2v.formats.bvh import read_bvh, write_bvh
from a2v.formats.characters import Clips, Strengths
from a2v.formats.deepmimic import read_deepmimic
from a2v.formats.fbx import write_fbx
from a2v.formats.gltf import write_glb
from a2v.formats.usd import SUFFIXES as USD_SUFFIXES
from a2v.formats.usd import write_usd
from a2v.kinematics.resample import resample_motion
from a2v.props import Props
from a2v.types import Character, Motion


@dataclass(frozen=True, kw_only=True)
class MotionFormat:
    """A kind of file that holds motions.

    Attributes
    ----------
    suffixes : tuple of str
        Lower case, with the dot.
    read : function of (path, action) or None
        Reads a file to a `Motion`; `action` is its name if the file has none.
    write : function of (path, motion) or None
        Writes a `Motion`, atomically.
    batches : bool
        Whether one file holds a batch of clips; otherwise each clip is written to a separate file.
    title : str
        Name in messages; the suffixes by default.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path, str], Motion] | None = None
    write: Callable[[Path, Motion], object] | None = None
    batches: bool = False
    title: str = ""


class CharacterWriter(Protocol):
    """Writes a `Character`, its `Clips`, the strengths of its expressions and the `Props` of the
    scene, atomically."""

    def __call__(
        self,
        path: Path,
        character: Character,
        clips: Clips,
        /,
        *,
        expressions: Strengths | None,
        props: Props | None,
    ) -> object:
        """Write the file."""


@dataclass(frozen=True, kw_only=True)
class CharacterFormat:
    """A kind of file that holds an animated character.

    Attributes
    ----------
    suffixes : tuple of str
        Lower case, with the dot.
    write : CharacterWriter
    """

    suffixes: tuple[str, ...]
    write: CharacterWriter


MOTION_FORMATS: tuple[MotionFormat, ...] = (
    MotionFormat(
        suffixes=(".bvh",), read=lambda path, action: read_bvh(path, action=action), write=write_bvh
    ),
    MotionFormat(
        suffixes=(".npz",),
        read=lambda path, _: Motion.load(path),
        write=lambda path, motion: motion.save(path),
        batches=True,
    ),
    MotionFormat(
        suffixes=(".txt", ".json"),
        read=lambda path, action: read_deepmimic(path, action=action),
        title="DeepMimic's .txt",
    ),
)
"""Motions as data: BVH, a2v's own ``.npz``, DeepMimic."""

CHARACTER_FORMATS: tuple[CharacterFormat, ...] = (
    CharacterFormat(suffixes=(".glb",), write=write_glb),
    CharacterFormat(suffixes=USD_SUFFIXES, write=write_usd),
    CharacterFormat(suffixes=(".fbx",), write=write_fbx),
)
"""Skinned characters: binary glTF, USD, FBX."""

_Format = TypeVar("_Format", MotionFormat, CharacterFormat)


def suffixes_of(formats: Sequence[MotionFormat] | Sequence[CharacterFormat]) -> tuple[str, ...]:
    """Return every suffix of the `formats` that can be written."""
    return tuple(suffix for item in formats if item.write is not None for suffix in item.suffixes)


def readable_motions(last: str = " or ") -> str:
    """Formats that `read_motion` accepts, for messages: ".bvh, .npz or DeepMimic's .txt"; `last` is
    the word before the last one."""
    titles = [
        item.title or ", ".join(item.suffixes) for item in MOTION_FORMATS if item.read is not None
    ]
    return f"{', '.join(titles[:-1])}{last}{titles[-1]}"


def writer_of(path: str | os.PathLike[str], formats: Sequence[_Format]) -> _Format:
    """Find the one of `formats` that writes the suffix of `path`.

    Raises
    ------
    InputError
        No format has the suffix; the message lists the known ones.
    """
    target = Path(path)
    for item in formats:
        if item.write is not None and target.suffix.lower() in item.suffixes:
            return item
    known = suffixes_of(formats)
    raise InputError(
        f"cannot write {target}; expected a name that ends in {', '.join(known[:-1])} or "
        f"{known[-1]}"
    )


def read_motion(
    path: str | os.PathLike[str], *, fps: float | None = None, action: str = ""
) -> Motion:
    """Read a motion by its file's suffix.

    Parameters
    ----------
    path : path
        ``.bvh`` (`read_bvh`), ``.npz`` (`Motion.save`) or ``.txt``/``.json`` (DeepMimic's
        ``Frames``).
    fps : float or None
        Resample to this rate; None keeps the file's.
    action : str
        Name to store if the file has none; the file's stem by default.

    Returns
    -------
    Motion
        Meters, y up; a batch if the file has one.

    Raises
    ------
    InputError
        Unknown suffix or unreadable file; the message names it (and the line in text formats).
    """
    source = Path(path)
    suffix = source.suffix.lower()
    for item in MOTION_FORMATS:
        if item.read is not None and suffix in item.suffixes:
            motion = item.read(source, action or source.stem)
            return motion if fps is None else resample_motion(motion, fps)
    raise InputError(
        f"{source}: unknown kind of motion '{suffix or 'without suffix'}'; expected "
        f"{readable_motions()}"
    )


def write_motion(
    path: str | os.PathLike[str], motion: Motion, formats: Sequence[MotionFormat] = MOTION_FORMATS
) -> list[Path]:
    """Write a clip, or a batch (N,) of clips, by the path's suffix.

    Parameters
    ----------
    path : path
        If the format holds single clips, a batch becomes ``<stem>_000``, ``<stem>_001``...
    motion : Motion
    formats : sequence of MotionFormat

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    InputError
        No format writes such a name, or the file cannot be written.
    """
    target = Path(path)
    item = writer_of(target, formats)
    assert item.write is not None
    if not motion.batch or item.batches:
        item.write(target, motion)
        return [target]
    targets = [
        target.with_name(f"{target.stem}_{index:03d}{target.suffix}")
        for index in range(motion.batch[0])
    ]
    for index, numbered in enumerate(targets):
        item.write(numbered, motion[index])
    return targets


def write_character(
    path: str | os.PathLike[str],
    character: Character,
    clips: Clips,
    formats: Sequence[CharacterFormat] = CHARACTER_FORMATS,
    *,
    expressions: Strengths | None = None,
    props: Props | None = None,
) -> None:
    """Write a character, its clips, its expressions and the solids of the scene by the path's
    suffix.

    Raises
    ------
    InputError
        No format writes such a name, a clip does not fit the character, or the file cannot be
        written.
    """
    target = Path(path)
    writer_of(target, formats).write(target, character, clips, expressions=expressions, props=props)

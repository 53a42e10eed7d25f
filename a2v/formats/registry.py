"""Register file formats: read by content, written by suffix.

A new format takes a module with its reader or writer and an entry in `MOTION_FORMATS` or
`CHARACTER_FORMATS` here. Readers, the outputs of commands and the lists in error messages use
these tables. Formats that are pictures (`a2v.rendering.DRAWN_FORMATS`,
`a2v.rendering.PAGE_FORMATS`) are entries of the same kinds.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar
from zipfile import ZipFile, is_zipfile

from a2v.errors import InputError
from a2v.formats.bare import write_skeleton
from a2v.formats.bvh import read_bvh, write_bvh
from a2v.formats.characters import Clips, Strengths
from a2v.formats.conventions import clip_number
from a2v.formats.deepmimic import read_deepmimic
from a2v.formats.fbx import STARTS as FBX_STARTS
from a2v.formats.fbx import fbx_to_glb, write_fbx
from a2v.formats.gltf import write_glb
from a2v.formats.gltf.motions import read_moving_bones
from a2v.formats.recording import motion_of
from a2v.formats.smpl import read_smpl_motion
from a2v.formats.usd import SUFFIXES as USD_SUFFIXES
from a2v.formats.usd import write_usd
from a2v.io import open_file, reading
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
    read : function of (path, action, clip) or None
        Reads a file to a `Motion`; `action` is its name if the file has none, `clip` the wanted one
        of several ("" for the best); an unknown clip is refused with a list of those there.
    holds : function of bytes or None
        Whether a file that begins with these bytes is of this kind. None: its suffix decides.
    write : function of (path, motion) or None
        Writes a `Motion`, atomically.
    batches : bool
        Whether one file holds a batch of clips; otherwise each clip is written to a separate file.
    title : str
        Name in messages; the suffixes by default.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path, str, str], Motion] | None = None
    holds: Callable[[bytes], bool] | None = None
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


def _read_arrays(path: Path, action: str, clip: str) -> Motion:
    """Read our own ``.npz``, or arrays of other tools."""
    with open_file(path) as stream, reading(path, "readable .npz"):
        ours = is_zipfile(stream) and "joint_names.npy" in ZipFile(stream).namelist()
    if not ours:
        return read_smpl_motion(path, action=action, clip=clip)
    motion = Motion.load(path)
    count = motion.batch[0] if motion.batch else 1
    if not clip:
        return motion
    number = clip_number(path, clip, count)
    return motion[number] if motion.batch else motion


def _alone(read: Callable[..., Motion]) -> Callable[[Path, str, str], Motion]:
    """Return a reader of a format whose files have one motion."""

    def read_one(path: Path, action: str, clip: str) -> Motion:
        clip_number(path, clip, 1)
        return read(path, action=action)

    return read_one


def _read_bones(path: Path, action: str, clip: str) -> Motion:
    return motion_of(read_moving_bones(path, clip=clip), action=action)


def _read_fbx(path: Path, action: str, clip: str) -> Motion:
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "in.glb"
        fbx_to_glb(path, copy)
        return motion_of(read_moving_bones(copy, name=path, clip=clip), action=action)


MOTION_FORMATS: tuple[MotionFormat, ...] = (
    MotionFormat(
        suffixes=(".bvh",),
        read=_alone(read_bvh),
        holds=lambda head: head.lstrip(b"\xef\xbb\xbf \t\r\n")[:9].upper() == b"HIERARCHY",
        write=write_bvh,
    ),
    MotionFormat(
        suffixes=(".npz",),
        read=_read_arrays,
        holds=lambda head: head.startswith(b"PK\x03\x04"),
        write=lambda path, motion: motion.save(path),
        batches=True,
    ),
    MotionFormat(
        suffixes=(".npy", ".pkl", ".pt"),
        read=_read_arrays,
        holds=lambda head: head.startswith((b"\x93NUMPY", b"\x80")),
    ),
    MotionFormat(
        suffixes=(".fbx",),
        read=_read_fbx,
        holds=lambda head: head[:64].lstrip().startswith(FBX_STARTS),
        write=write_skeleton,
    ),
    MotionFormat(
        suffixes=(".glb",),
        read=_read_bones,
        holds=lambda head: (
            head.startswith(b"glTF")
            or (head.lstrip()[:1] == b"{" and b'"asset"' in head and b'"Frames"' not in head)
        ),
        write=write_skeleton,
    ),
    MotionFormat(suffixes=(".gltf", ".vrm", ".vrma"), read=_read_bones, title=".vrma"),
    MotionFormat(
        suffixes=(".txt", ".json"),
        read=_alone(read_deepmimic),
        holds=lambda head: head.lstrip()[:1] == b"{" and b'"Frames"' in head,
        title="DeepMimic's .txt",
    ),
)
"""Motions as data, and as the animations of characters. The order is that of messages."""

_HEAD = 1 << 16
"""First bytes of a file by which its kind is known."""

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


def readable_suffixes() -> tuple[str, ...]:
    """Return the suffixes of files that `read_motion` accepts."""
    return tuple(
        suffix for item in MOTION_FORMATS if item.read is not None for suffix in item.suffixes
    )


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


def split_clip(path: str | os.PathLike[str]) -> tuple[Path, str]:
    """Split ``FILE#CLIP`` into the file and the name or number of a motion in it, "" without one.

    A file whose own name holds a # stays whole.
    """
    whole = Path(path)
    if "#" not in whole.name or whole.exists():
        return whole, ""
    name, _, clip = whole.name.rpartition("#")
    return whole.with_name(name), clip


def read_motion(
    path: str | os.PathLike[str],
    *,
    fps: float | None = None,
    action: str = "",
    clip: str = "",
) -> Motion:
    """Read a motion of any known kind (`MOTION_FORMATS`): its content decides, then its suffix.

    Parameters
    ----------
    path : path
        BVH (`read_bvh`); our ``.npz``; arrays of AMASS, SMPL-X, MDM... (`read_smpl_motion`);
        FBX, GLB and VRM animations (`read_moving_bones`); DeepMimic's ``Frames``. ``FILE#CLIP``
        (`split_clip`) names the motion of a file that has several.
    fps : float or None
        Resample to this rate; None keeps the file's.
    action : str
        Name to store if the file has none; the file's stem by default.
    clip : str
        Name or number, from 0, of the motion, in place of ``#CLIP``.

    Returns
    -------
    Motion
        Meters, y up; a batch if the file has one.

    Raises
    ------
    InputError
        Unknown kind or unreadable file; the message names it (and the line in text formats). The
        file has no such clip; the message lists those there.
    MissingDependencyError
        An FBX or a compressed glTF needs Node.
    """
    source, named = split_clip(path)
    clip = clip or named
    with open_file(source) as stream:
        head = stream.read(_HEAD)
    suffix = source.suffix.lower()
    readable = [item for item in MOTION_FORMATS if item.read is not None]
    found = [item for item in readable if item.holds is not None and item.holds(head)]
    found += [item for item in readable if suffix in item.suffixes]
    for item in found[:1]:
        assert item.read is not None
        motion = item.read(source, action or source.stem, clip)
        return motion if fps is None else resample_motion(motion, fps)
    kind = f" '{suffix}'" if suffix else ""
    raise InputError(f"{source}: unknown kind of motion{kind}; expected {readable_motions()}")


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

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
from a2v.formats.bvh import read_bvh_bones, write_bvh
from a2v.formats.characters import Clips, Strengths
from a2v.formats.conventions import clip_number
from a2v.formats.deepmimic import read_deepmimic
from a2v.formats.fbx import STARTS as FBX_STARTS
from a2v.formats.fbx import fbx_to_glb, write_fbx
from a2v.formats.gltf import write_glb
from a2v.formats.gltf.motions import read_moving_bones
from a2v.formats.recording import Recording, motion_of, write_map_of_recording
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
    bones : function of (path, clip) or None
        Reads the moving bones of a file; `clip` is the wanted one of several ("" for the best). An
        unknown clip is refused with a list of those there.
    read : function of (path, action, clip) or None
        Reads a file whose joints are known to a `Motion`; `action` is its name if the file has
        none.
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
    bones: Callable[[Path, str], Recording] | None = None
    read: Callable[[Path, str, str], Motion] | None = None
    holds: Callable[[bytes], bool] | None = None
    write: Callable[[Path, Motion], object] | None = None
    batches: bool = False
    title: str = ""

    @property
    def readable(self) -> bool:
        """Whether such files can be read."""
        return self.bones is not None or self.read is not None


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
    if not clip:
        return motion
    number = clip_number(path, clip, motion.batch[0] if motion.batch else 1)
    return motion[number] if motion.batch else motion


def _read_deepmimic(path: Path, action: str, clip: str) -> Motion:
    clip_number(path, clip, 1)
    return read_deepmimic(path, action=action)


def _bvh_bones(path: Path, clip: str) -> Recording:
    clip_number(path, clip, 1)
    return read_bvh_bones(path)


def _gltf_bones(path: Path, clip: str) -> Recording:
    return read_moving_bones(path, clip=clip)


def _fbx_bones(path: Path, clip: str) -> Recording:
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "in.glb"
        fbx_to_glb(path, copy)
        return read_moving_bones(copy, name=path, clip=clip)


MOTION_FORMATS: tuple[MotionFormat, ...] = (
    MotionFormat(
        suffixes=(".bvh",),
        bones=_bvh_bones,
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
        bones=_fbx_bones,
        holds=lambda head: head[:64].lstrip().startswith(FBX_STARTS),
        write=write_skeleton,
    ),
    MotionFormat(
        suffixes=(".glb",),
        bones=_gltf_bones,
        holds=lambda head: (
            head.startswith(b"glTF")
            or (head.lstrip()[:1] == b"{" and b'"asset"' in head and b'"Frames"' not in head)
        ),
        write=write_skeleton,
    ),
    MotionFormat(suffixes=(".gltf", ".vrm", ".vrma"), bones=_gltf_bones, title=".vrma"),
    MotionFormat(
        suffixes=(".txt", ".json"),
        read=_read_deepmimic,
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
    return tuple(suffix for item in MOTION_FORMATS if item.readable for suffix in item.suffixes)


def readable_motions(last: str = " or ") -> str:
    """Formats that `read_motion` accepts, for messages: ".bvh, .npz or DeepMimic's .txt"; `last` is
    the word before the last one."""
    titles = [item.title or ", ".join(item.suffixes) for item in MOTION_FORMATS if item.readable]
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
    bone_map: str | os.PathLike[str] | None = None,
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
    bone_map : path or None
        A table of `write_motion_map` that names the joints of BVH, FBX or glTF.

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
    item, clip, action = _format_of(source), clip or named, action or source.stem
    if item.bones is not None:
        motion = motion_of(item.bones(source, clip), action=action, bone_map=bone_map)
    else:
        _demand_no_map(source, bone_map)
        assert item.read is not None
        motion = item.read(source, action, clip)
    return motion if fps is None else resample_motion(motion, fps)


def write_motion_map(path: str | os.PathLike[str], target: str | os.PathLike[str]) -> None:
    """Write the bones of a motion file as a table to be edited (`a2v.formats.bone_map`), with the
    best guess of their joints; `read_motion` reads it as `bone_map`.

    Raises
    ------
    InputError
        As `read_motion`, but for a skeleton that is not understood.
    """
    source, clip = split_clip(path)
    item = _format_of(source)
    if item.bones is None:
        _demand_no_map(source, target)
    assert item.bones is not None
    write_map_of_recording(item.bones(source, clip), target)


def _demand_no_map(source: Path, bone_map: object) -> None:
    if bone_map is not None:
        raise InputError(f"{source} needs no table of bones: its joints are known; leave it out")


def _format_of(source: Path) -> MotionFormat:
    """Return the format of a motion file."""
    with open_file(source) as stream:
        head = stream.read(_HEAD)
    suffix = source.suffix.lower()
    readable = [item for item in MOTION_FORMATS if item.readable]
    found = [item for item in readable if item.holds is not None and item.holds(head)]
    found += [item for item in readable if suffix in item.suffixes]
    if found:
        return found[0]
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

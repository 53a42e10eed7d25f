"""Write and read FBX of Unreal, Unity, Maya and MotionBuilder: characters with clips, in
centimeters.

`fbx_writer.mjs` beside this file turns our GLB into binary FBX 7.4 with three.js and Comfy's
exporter, run by Node; `fbx_reader.mjs` turns an FBX of other programs into a GLB. The packages come
from npm, once, by the command that `a2v doctor` prints; this module downloads nothing.
"""

from __future__ import annotations

import dataclasses
import json
import os
import tempfile
from pathlib import Path

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.formats.characters import Clips, Strengths
from a2v.formats.fbx_bounds import check_fbx
from a2v.formats.gltf import write_glb
from a2v.io import atomic_path, read_bytes
from a2v.npm import NpmPackages, Script, find_node
from a2v.props import Props
from a2v.types import Character

PACKAGES = NpmPackages("fbx", ("three@0.184.0", "@comfyorg/fbx-exporter-three@1.0.1"))
"""Packages of the script, both MIT: three.js reads GLB, Comfy's is the only maintained exporter of
skins and clips for it."""

_FOLDER = Path(__file__).parent
_SHARED = (_FOLDER / "fbx_scale.mjs", _FOLDER / "glb_parts.mjs")
"""Modules that both scripts import."""
WRITER, READER = (
    Script(
        title=file.stem.replace("_", " "),
        what="FBX",
        instead="or use a .glb",
        files=(file, *_SHARED),
    )
    for file in (_FOLDER / "fbx_writer.mjs", _FOLDER / "fbx_reader.mjs")
)

MAX_BYTES = 256 << 20
"""Largest size of an FBX that is read, bytes."""
STARTS = (b"Kaydara FBX Binary", b"; FBX")
"""First bytes of binary and of text files."""


def can_write() -> bool:
    """Return whether Node and the packages are installed."""
    return find_node() is not None and PACKAGES.installed


def write_fbx(
    path: str | os.PathLike[str],
    character: Character,
    clips: Clips | None = None,
    *,
    expressions: Strengths | None = None,
    props: Props | None = None,
) -> None:
    """Write a textured (or vertex-colored), skinned and animated binary FBX, atomically.

    Centimeters, y up, the person faces +z; bones keep their axes of a GLB. Every clip is an
    animation stack with one key per frame and linear interpolation; expressions are blend shapes.

    Parameters
    ----------
    path : path
    character : Character
    clips : Clips or None
    expressions : Strengths or None
        Strengths of the face's expressions in the clips.
    props : Props or None
        Solids in the scene: each has a mesh with its name.

    Raises
    ------
    InputError
        A clip has the wrong shape, is not finite or has no frames; unknown expressions.
    MissingDependencyError
        Node 18 or newer, or npm's packages, are not installed; the message explains how.
    A2VError
        The writer failed; the message ends with the writer's output.
    """
    fps = max((clip[1] for clip in (clips or {}).values()), default=30.0)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "character.glb"
        write_glb(source, _plain(character), clips, expressions=expressions, props=props)
        glb_to_fbx(source, path, fps=fps)


def glb_to_fbx(source: str | os.PathLike[str], path: str | os.PathLike[str], *, fps: float) -> None:
    """Write a GLB as binary FBX in centimeters, atomically; its clips have `fps` keys per second.
    Pictures of color, normals and glow are embedded; others are left out.

    Raises
    ------
    MissingDependencyError, A2VError
        See `write_fbx`.
    """
    with atomic_path(path) as temporary:
        PACKAGES.run(WRITER, Path(source), temporary, f"{fps:g}")


def fbx_to_glb(source: str | os.PathLike[str], path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Write the bones, skins, meshes, clips and pictures of an FBX as a GLB in meters.

    Pictures are PNG or JPEG of color, normals and glow, embedded or in the folder of the FBX.

    Returns
    -------
    tuple of str
        Names of the pictures that are left out: files of other kinds, missing or over 64 MB.

    Raises
    ------
    InputError
        The file is missing, not an FBX, larger than `MAX_BYTES`, unpacks to more than `check_fbx`
        allows, or three.js cannot read it.
    MissingDependencyError
        There is no Node 18 or newer, or npm's packages are not installed; the message explains how.
    """
    source = Path(source)
    data = read_bytes(source, limit=MAX_BYTES)
    if not data[:64].lstrip().startswith(STARTS):
        raise InputError(f"{source} is not an FBX file")
    try:
        check_fbx(data)
    except ValueError as error:
        raise InputError(f"cannot read {source}: {error}; export it again") from None
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "in.fbx"  # what was checked is what is read
        with atomic_path(copy) as temporary:
            temporary.write_bytes(data)
        try:
            said = PACKAGES.run(READER, copy, Path(path), str(source.parent.absolute()))
        except (MissingDependencyError, InputError):
            raise
        except A2VError as error:
            raise InputError(f"cannot read {source}: {error}") from error
    return tuple(str(name) for name in json.loads(said))


def _plain(character: Character) -> Character:
    """Convert the character for the script: one material with one picture."""
    return dataclasses.replace(
        character, surface=dataclasses.replace(character.surface, normal_map=None, materials=None)
    )

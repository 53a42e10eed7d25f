"""FBX for Unreal, Unity, Maya and MotionBuilder: a rigged, textured character with its clips, in centimetres.

`fbx_writer.mjs` beside this file turns our GLB into binary FBX 7.4 with three.js and Comfy's exporter, run by Node. Both come from npm, once,
by the command that `a2v doctor` prints; here nothing is downloaded.
"""

from __future__ import annotations

import dataclasses
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from a2v.errors import A2VError, MissingDependencyError
from a2v.formats.characters import Clips, Strengths
from a2v.formats.gltf import write_glb
from a2v.io import atomic_path, shorten
from a2v.npm import NpmPackages, find_node
from a2v.system import link_folder
from a2v.types import Character

WRITER = Path(__file__).with_name("fbx_writer.mjs")
PACKAGES = NpmPackages("fbx", ("three@0.184.0", "@comfyorg/fbx-exporter-three@1.0.1"))
"""What the script imports, MIT both: three.js reads GLB as browsers do, Comfy's is the one kept exporter of skins and clips for it."""

SECONDS = 300
"""A writer that takes longer is stopped."""


def can_write() -> bool:
    """Whether Node and the packages are there."""
    return find_node() is not None and PACKAGES.installed


def write_fbx(
    path: str | os.PathLike[str], character: Character, clips: Clips | None = None, *, expressions: Strengths | None = None
) -> None:
    """Write a textured (or vertex-coloured), skinned and animated binary FBX, atomically.

    Centimetres, y up, the person faces +z; bones keep the axes that they have in a GLB. Every clip is an animation stack with
    straight lines between keys, one a frame; expressions are blend shapes.

    Parameters
    ----------
    path : path
    character : Character
    clips : Clips or None
    expressions : Strengths or None
        What the face does in the clips.

    Raises
    ------
    InputError
        A clip has the wrong shape, is not finite or has no frames; unknown expressions.
    MissingDependencyError
        There is no Node 18 or newer, or npm's packages are not installed; the message says how.
    A2VError
        The writer failed; the message ends with its own.
    """
    node = find_node()
    if node is None:
        raise MissingDependencyError(
            "FBX needs Node 18 or newer; install it with: pip install 'a2v[fbx]' (or apt install nodejs), or write a .glb"
        )
    modules = PACKAGES.demand("FBX", "or write a .glb")
    fps = max((clip[1] for clip in (clips or {}).values()), default=30.0)
    with tempfile.TemporaryDirectory() as folder:
        write_glb(Path(folder) / "character.glb", _plain(character), clips, expressions=expressions)
        shutil.copy(WRITER, folder)  # imports are looked for beside the script
        link_folder(Path(folder) / "node_modules", modules.resolve())
        with atomic_path(path) as temporary:
            _run([node, str(Path(folder) / WRITER.name), str(Path(folder) / "character.glb"), str(temporary), f"{fps:g}"])


def _plain(character: Character) -> Character:
    """The character as the script can take it: one material with one picture."""
    return dataclasses.replace(character, surface=dataclasses.replace(character.surface, normal_map=None, materials=None))


def _run(command: list[str]) -> None:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NODE_")}  # no modules from outside
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, env=environment, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise A2VError(f"the FBX writer cannot run {command[0]} ({shorten(error)}); expected Node 18 or newer") from error
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        told = next((line for line in lines if re.match(r"\w*Error\b", line)), lines[-1] if lines else f"exit code {done.returncode}")
        raise A2VError(f"the FBX writer failed ({shorten(told)}); Node 18 or newer is needed, {command[0]} was used")

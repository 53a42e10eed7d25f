"""Compress GLB files by glTF Transform (npm's ``@gltf-transform/cli``, MIT): meshopt or Draco.

Node runs it; this module downloads nothing.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from pathlib import Path

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.io import atomic_path, shorten
from a2v.npm import NpmPackages, find_node

PACKAGES = NpmPackages("gltf_transform", ("@gltf-transform/cli@4.2.1",))
KINDS: tuple[str, ...] = ("meshopt", "draco")
"""meshopt (EXT_meshopt_compression) also compresses expressions and clips; Draco
(KHR_draco_mesh_compression) compresses only the shape."""
SECONDS = 300
"""Time limit of a run, seconds."""
_COMMAND = Path("@gltf-transform", "cli", "bin", "cli.js")


def demand_compression() -> tuple[str, Path]:
    """Find Node and the program of glTF Transform.

    Raises
    ------
    MissingDependencyError
        Node or the package is not installed; the message says how.
    """
    node = find_node()
    if node is None:
        raise MissingDependencyError(
            "--compress needs Node 18 or newer; install it with: pip install 'a2v[fbx]' (or apt "
            "install nodejs), or leave --compress out"
        )
    return node, PACKAGES.demand("--compress", "or leave --compress out") / _COMMAND


def compress_glb(path: str | os.PathLike[str], kind: str) -> None:
    """Replace a binary glTF by a compressed one, atomically.

    Parameters
    ----------
    path : path
    kind : str
        One of `KINDS`.

    Raises
    ------
    InputError
        An unknown kind.
    MissingDependencyError
        See `demand_compression`.
    A2VError
        glTF Transform failed; the message ends with its output.
    """
    if kind not in KINDS:
        raise InputError(f"unknown compression '{kind}'; choose from {', '.join(KINDS)}")
    node, program = demand_compression()
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("NODE_")
    }  # no modules from outside
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made.glb"
        command = [node, str(program), kind, str(Path(path).resolve()), str(made)]
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                timeout=SECONDS,
                env=environment,
                cwd=folder,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise A2VError(
                f"glTF Transform cannot run ({shorten(str(error))}); expected Node 18 or newer at "
                f"{node}"
            ) from error
        if done.returncode or not made.exists():
            told = (
                re.sub(r"\s+", " ", (done.stderr or done.stdout).strip())
                or f"exit code {done.returncode}"
            )
            raise A2VError(
                f"glTF Transform failed ({shorten(told)}); leave --compress out, or install it "
                f"again: {PACKAGES.install_command}"
            )
        with atomic_path(path) as temporary:
            temporary.write_bytes(made.read_bytes())

"""Compress and decode GLB files by glTF Transform (npm, MIT): meshopt or Draco.

Node runs the package ``@gltf-transform/cli``; this module downloads nothing.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.formats.gltf.bounds import MAX_NUMBERS
from a2v.formats.gltf.document import pack_glb
from a2v.formats.gltf.reading import Gltf, read_glb
from a2v.io import atomic_path, shorten
from a2v.npm import NpmPackages, find_node
from a2v.system import link_folder

PACKAGES = NpmPackages("gltf_transform", ("@gltf-transform/cli@4.2.1",))
KINDS: tuple[str, ...] = ("meshopt", "draco")
"""meshopt (EXT_meshopt_compression) also compresses expressions and clips; Draco
(KHR_draco_mesh_compression) compresses only the shape."""
COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
"""Extensions by which the arrays of a glTF are compressed."""
SECONDS = 300
"""Time limit of a run, seconds."""
HEAP_MB = 2048
"""Memory limit of the decoder, MB."""
DECODER = Path(__file__).with_name("decompress.mjs")
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
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made.glb"
        _run([node, str(program), kind, str(Path(path).resolve()), str(made)], made)
        with atomic_path(path) as temporary:
            temporary.write_bytes(made.read_bytes())


def decompress_glb(source: str | os.PathLike[str], target: Path) -> None:
    """Write a GLB without the compression of its arrays (Draco, meshopt).

    Raises
    ------
    MissingDependencyError
        Node or the package is not installed; the message says how.
    A2VError
        glTF Transform failed; the message ends with its output.
    """
    node = find_node()
    if node is None:
        raise MissingDependencyError(
            "a compressed glTF needs Node 18 or newer; install it with: pip install 'a2v[fbx]' (or "
            "apt install nodejs), or save the file without compression"
        )
    modules = PACKAGES.demand("a compressed glTF", "or save the file without compression")
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(DECODER, folder)  # Node looks for imports next to the script
        link_folder(Path(folder) / "node_modules", modules.resolve())
        script = str(Path(folder) / DECODER.name)
        _run([node, f"--max-old-space-size={HEAP_MB}", script, str(source), str(target)], target)


def plain(file: Gltf) -> Gltf:
    """Return a file whose arrays are not compressed. Of a VRM this would lose the extensions.

    Raises
    ------
    InputError
        A compressed VRM, or one that cannot be decoded or unpacks to too much.
    MissingDependencyError
        See `decompress_glb`.
    """
    used = file.json.get("extensionsRequired", file.json.get("extensionsUsed"))
    found = [kind for kind in COMPRESSED if isinstance(used, list) and kind in used]
    if not found:
        return file
    if isinstance(file.json.get("extensions"), dict):
        raise file.fail(f"is a VRM that is compressed ({found[0]}); save it without compression")
    most = sum(file.count(index) for index in range(len(file.items("accessors"))))
    if most > MAX_NUMBERS:
        raise file.fail(f"unpacks to {most} elements; expected at most {MAX_NUMBERS}")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "in.glb"
        copy.write_bytes(pack_glb(file.json, file.binary))
        try:
            decompress_glb(copy, Path(folder) / "out.glb")
        except MissingDependencyError:
            raise
        except A2VError as error:
            raise file.fail(f"is compressed ({found[0]}) and cannot be decoded: {error}") from None
        return read_glb(Path(folder) / "out.glb")


def _run(command: list[str], made: Path) -> None:
    """Run Node, which writes `made`, without modules of the environment."""
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("NODE_")
    }
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=SECONDS,
            env=environment,
            cwd=made.parent,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise A2VError(
            f"glTF Transform cannot run ({shorten(str(error))}); expected Node 18 or newer at "
            f"{command[0]}"
        ) from error
    if done.returncode or not made.exists():
        lines = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
        told = next((line for line in lines if "Error" in line), " ".join(lines))
        raise A2VError(
            f"glTF Transform failed ({shorten(told or f'exit code {done.returncode}')}); leave "
            f"the compression out, or install it again: {PACKAGES.install_command}"
        )

"""Compress GLB files by glTF Transform (npm, MIT), and decode their arrays: meshopt or Draco.

Node runs the package ``@gltf-transform/cli``, and decoders that come with it; this module downloads
nothing.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.formats.gltf.bounds import MAX_NUMBERS
from a2v.formats.gltf.document import pack_glb
from a2v.formats.gltf.reading import Gltf, read_glb
from a2v.io import atomic_path
from a2v.npm import NpmPackages, Script, demand_node

PACKAGES = NpmPackages("gltf_transform", ("@gltf-transform/cli@4.2.1",))
KINDS: tuple[str, ...] = ("meshopt", "draco")
"""meshopt (EXT_meshopt_compression) also compresses expressions and clips; Draco
(KHR_draco_mesh_compression) compresses only the shape."""
COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
"""Extensions by which the arrays of a glTF are compressed."""
_DECODER = Script(
    title="glTF Transform",
    what="a compressed glTF",
    instead="or save the file without compression",
    files=(Path(__file__).with_name("decompress.mjs"),),
)
_ENCODERS = {
    kind: Script(
        title="glTF Transform",
        what="--compress",
        instead="or leave --compress out",
        inside="@gltf-transform/cli/bin/cli.js",
        first=(kind,),
    )
    for kind in KINDS
}


def demand_compression() -> None:
    """Check that Node and glTF Transform are installed.

    Raises
    ------
    MissingDependencyError
        One is not; the message says how.
    """
    script = _ENCODERS[KINDS[0]]
    demand_node(script.what, script.instead)
    PACKAGES.demand(script.what, script.instead)


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
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made.glb"
        PACKAGES.run(_ENCODERS[kind], Path(path), made)
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
    PACKAGES.run(_DECODER, Path(source), target)


def plain(file: Gltf) -> Gltf:
    """Return a file whose arrays are not compressed; all else, as of a VRM, stays as it is.

    Raises
    ------
    InputError
        It cannot be decoded, or unpacks to too much.
    MissingDependencyError
        See `decompress_glb`.
    """
    used = file.json.get("extensionsRequired", file.json.get("extensionsUsed"))
    found = [kind for kind in COMPRESSED if isinstance(used, list) and kind in used]
    if not found:
        return file
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

"""MakeHuman's files from one zip archive: clothes (``.mhclo``), their meshes (``.obj``) and their
materials (``.mhmat``)."""

from __future__ import annotations

import io
import posixpath
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from a2v.errors import InputError
from a2v.io import open_file, reading
from a2v.lab.studio.obj import MOST, ObjMesh, parse_obj
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

BASE_VERTICES = 19158
"""Number of vertices of the mesh ``hm08``, to which everything is bound."""
MOST_FILES = 2000
"""Largest number of files of an archive."""
LARGEST = 16 << 20
"""Largest unpacked size of one of them, bytes."""
MOST_PIXELS = 4096


@dataclass(frozen=True, eq=False)
class Binding:
    """Binding of a mesh to ``hm08``: vertex i is at ``sum_k weights[i, k] * base[corners[i, k]] +
    offsets[i] * scale``.

    Attributes
    ----------
    corners : (V, 3) int
    weights : (V, 3)
    offsets : (V, 3)
        Decimeters; x to the person's left, y up, z to the front.
    scales : tuple of 3 (int, int, float)
        For x, y and z: two vertices of the base, and their distance along the axis at which the
        scale is 1, decimeters.
    hides : (BASE_VERTICES,) bool
        Vertices of the base that it covers.
    layer : int
        Items with a larger number are worn over those with a smaller one.
    """

    corners: IntArray
    weights: FloatArray
    offsets: FloatArray
    scales: tuple[tuple[int, int, float], ...]
    hides: BoolArray
    layer: int


@dataclass(frozen=True, eq=False)
class Item:
    """An item of clothing: its binding, mesh, and texture (H, W, 4) uint8 sRGB with opacity."""

    name: str
    binding: Binding
    mesh: ObjMesh
    texture: ByteArray


class Archive:
    """A zip of MakeHuman's assets; its files are read on demand.

    Parameters
    ----------
    path : path

    Raises
    ------
    InputError
        The archive does not exist, or its files are too many, too large, or outside of their
        folders.
    """

    def __init__(self, path: str | Path) -> None:
        """See the class."""
        self.path = Path(path)
        with self._opened() as archive:
            entries = archive.infolist()
        if len(entries) > MOST_FILES:
            raise InputError(f"{path} holds {len(entries)} files; expected at most {MOST_FILES}")
        for entry in entries:
            name = PurePosixPath(entry.filename)
            if name.is_absolute() or ".." in name.parts or "\\" in entry.filename:
                raise InputError(
                    f"{path} holds '{entry.filename}', which points outside of the archive; "
                    "refusing to read it"
                )
            if entry.file_size > LARGEST:
                raise InputError(
                    f"{path} holds '{entry.filename}' of {entry.file_size >> 20} MiB; expected at "
                    f"most {LARGEST >> 20}"
                )
        self.names = tuple(sorted(entry.filename for entry in entries if not entry.is_dir()))

    def _opened(self) -> zipfile.ZipFile:
        with reading(self.path, "readable zip archive", "MakeHuman's assets"):
            return zipfile.ZipFile(open_file(self.path))

    def bytes(self, name: str) -> bytes:
        """Read a file of the archive."""
        if name not in self.names:
            raise InputError(f"{self.path} holds no '{name}'")
        with (
            self._opened() as archive,
            reading(f"{self.path}:{name}", "readable file of a zip archive"),
            archive.open(name) as stream,
        ):
            data = stream.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise InputError(
                f"{self.path} holds '{name}', which is larger than the archive's directory says"
            )
        return data

    def text(self, name: str) -> str:
        """Read a text file of the archive."""
        return self.bytes(name).decode("utf-8", "replace")

    def beside(self, name: str, other: str) -> str:
        """Resolve ``other``, a reference in the file ``name``, to a name in the archive.

        Raises
        ------
        InputError
            It is outside of the archive.
        """
        found = posixpath.normpath(posixpath.join(posixpath.dirname(name), other.strip()))
        if found.startswith(("..", "/")):
            raise InputError(
                f"{self.path}:{name} names '{other}', which points outside of the archive"
            )
        return found

    def under(self, folder: str, suffix: str) -> dict[str, str]:
        """List files by stem in the folders of a kind of assets, such as ``clothes``."""
        marked = f"/{folder}/"
        return {
            PurePosixPath(name).stem: name
            for name in self.names
            if marked in f"/{name}" and name.endswith(suffix)
        }

    def item(self, name: str) -> Item:
        """Read the item of the ``.mhclo`` of that name.

        Raises
        ------
        InputError
            It is broken, or a file that it refers to is missing.
        """
        source = f"{self.path}:{name}"
        with reading(source, "usable .mhclo"):
            binding, said = parse_mhclo(self.text(name), source)
            mesh_name = self.beside(name, said.get("obj_file", ""))
            mesh = parse_obj(self.text(mesh_name), f"{self.path}:{mesh_name}")
            if mesh.count != len(binding.corners) or mesh.faces.max() >= mesh.count:
                raise InputError(
                    f"{source} binds {len(binding.corners)} vertices, but its mesh has {mesh.count}"
                )
            texture = self.texture(self.beside(name, said.get("material", "")))
        return Item(PurePosixPath(name).stem, binding, mesh, texture)

    def texture(self, material: str) -> ByteArray:
        """Read the texture (H, W, 4) uint8 of an ``.mhmat``; its size is checked before it is
        decoded."""
        from PIL import Image

        words = re.search(r"^diffuseTexture\s+(.+)$", self.text(material), re.MULTILINE)
        if words is None:
            raise InputError(f"{self.path}:{material} names no diffuseTexture")
        name = self.beside(material, words.group(1))
        with (
            reading(f"{self.path}:{name}", "picture", "a JPEG or PNG"),
            Image.open(io.BytesIO(self.bytes(name)), formats=("JPEG", "PNG")) as picture,
        ):
            if max(picture.size) > MOST_PIXELS:
                raise InputError(
                    f"{self.path}:{name} has {picture.width} x {picture.height} pixels; expected "
                    f"at most {MOST_PIXELS} a side"
                )
            return np.asarray(picture.convert("RGBA"))


def parse_mhclo(text: str, source: str) -> tuple[Binding, dict[str, str]]:
    """Parse the binding of a ``.mhclo``, and its other entries by their first word.

    Numbers follow ``verts``, even with other entries in between. ``delete_verts`` lists vertices
    and ranges such as ``10 - 20``.

    Raises
    ------
    InputError
        Something is missing, or refers to vertices that the base does not have.
    """
    rows: list[list[float]] = []
    said: dict[str, str] = {}
    hides = np.zeros(BASE_VERTICES, bool)
    where = ""
    for line in text.splitlines():
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        if words[0][0].isalpha() or words[0][0] == "_":
            said.setdefault(words[0], " ".join(words[1:]))
            where = (
                words[0]
                if words[0] in ("verts", "delete_verts")
                else ""
                if where == "delete_verts"
                else where
            )
            if words[0] == "delete_verts":
                _hide(words[1:], hides, source)
        elif where == "verts":
            rows.append(_row(words, source))
            if len(rows) > MOST:
                raise InputError(f"{source} binds more than {MOST} vertices")
        elif where == "delete_verts":
            _hide(words, hides, source)
    if not rows:
        raise InputError(f"{source} binds no vertices; expected numbers after 'verts'")
    table = np.array(rows)
    if (
        not np.isfinite(table).all()
        or table[:, :3].min() < 0
        or table[:, :3].max() >= BASE_VERTICES
    ):
        raise InputError(
            f"{source} binds to vertices beyond the {BASE_VERTICES} of hm08, or has numbers that "
            "are not finite"
        )
    scales = tuple(_scale(said.get(f"{axis}_scale", ""), source) for axis in "xyz")
    return Binding(
        table[:, :3].astype(np.int64),
        table[:, 3:6],
        table[:, 6:9],
        scales,
        hides,
        int(float(said.get("z_depth", "0") or 0)),
    ), said


def _row(words: list[str], source: str) -> list[float]:
    """Parse three corners, three weights and an offset; a single number is a vertex of the base."""
    values = [float(word) for word in words]
    if len(values) == 1:
        return [values[0]] * 3 + [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    if len(values) not in (6, 9):
        raise InputError(f"{source} has a vertex of {len(values)} numbers; expected 1, 6 or 9")
    return values + [0.0] * (9 - len(values))


def _scale(text: str, source: str) -> tuple[int, int, float]:
    words = text.split()
    if not words:
        return 0, 0, 0.0  # unscaled
    first, second, length = int(words[0]), int(words[1]), float(words[2])
    if not (min(first, second) >= 0 and max(first, second) < BASE_VERTICES and 1e-6 < length < 1e6):
        raise InputError(f"{source} scales by '{text}'; expected two vertices of hm08 and a length")
    return first, second, length


def _hide(words: list[str], hides: BoolArray, source: str) -> None:
    numbers = " ".join(words).replace("-", " - ").split()
    index = 0
    while index < len(numbers):
        first = last = int(numbers[index])
        if index + 2 < len(numbers) and numbers[index + 1] == "-":
            last, index = int(numbers[index + 2]), index + 2
        if not 0 <= first <= last < BASE_VERTICES:
            raise InputError(
                f"{source} deletes the vertices {first} to {last}; hm08 has {BASE_VERTICES}"
            )
        hides[first : last + 1] = True
        index += 1

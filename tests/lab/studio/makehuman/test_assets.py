"""MakeHuman's files, from an archive made here: what is read and what is refused."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from a2v.errors import InputError
from a2v.lab.studio.makehuman.assets import BASE_VERTICES, Archive, parse_mhclo
from a2v.lab.studio.makehuman.binding import (
    carried,
    kept_faces,
    lay_on,
    opaque_faces,
    visible_parts,
)

MHCLO = """# a square on the first three vertices
name square
obj_file square.obj
x_scale 0 1 2.0
y_scale 0 2 4.0
z_scale 0 3 1.0
z_depth 50
material square.mhmat
verts 0
weights square.mhw
0 1 2 1.0 0.0 0.0 0.5 0.5 0.5
0 1 2 0.0 1.0 0.0 0 0 0
0 1 2 0.25 0.25 0.5 0 0 1
2
delete_verts
5 7 - 9 12
100
tag after
"""
OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"


def archive_of(folder: Path, files: dict[str, bytes]) -> Path:
    path = folder / "assets.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def picture(alpha: np.ndarray) -> bytes:
    image = np.full((*alpha.shape, 4), 120, np.uint8)
    image[..., 3] = alpha
    return cv2.imencode(".png", image)[1].tobytes()


@pytest.fixture
def files() -> dict[str, bytes]:
    alpha = np.zeros((16, 16), np.uint8)
    alpha[:, 8:] = 255  # the right half
    return {
        "base/clothes/square/square.mhclo": MHCLO.encode(),
        "base/clothes/square/square.obj": OBJ.encode(),
        "base/clothes/square/square.mhmat": b"diffuseTexture ../../looks/square.png\n",
        "base/looks/square.png": picture(alpha),
    }


@pytest.fixture
def base() -> np.ndarray:
    """Where the first vertices are 0.1 m apart along x, 0.8 along y and 0.1 along z."""
    points = np.zeros((BASE_VERTICES, 3))
    points[1, 0], points[2, 1], points[3, 2] = 0.1, 0.8, 0.1
    return points


def test_a_binding_is_barycentric_and_scaled(base: np.ndarray) -> None:
    binding, said = parse_mhclo(MHCLO, "square.mhclo")
    assert said["obj_file"] == "square.obj"
    assert binding.layer == 50
    placed = lay_on(binding, base)
    # 1 dm apart where 2 would be scale 1: half along x; 8 for 4: twice along y; 1 for 1 along z
    np.testing.assert_allclose(placed[0], [0.5 * 0.05, 2 * 0.05, 0.05])
    np.testing.assert_allclose(placed[1], base[1])
    np.testing.assert_allclose(placed[2], 0.25 * base[1] + 0.5 * base[2] + [0, 0, 0.1])
    np.testing.assert_allclose(placed[3], base[2])  # one number: that vertex itself
    assert np.flatnonzero(binding.hides).tolist() == [5, 7, 8, 9, 12, 100]


def test_bones_are_those_of_the_vertices_below() -> None:
    binding, _ = parse_mhclo(MHCLO, "square.mhclo")
    weights = np.zeros((BASE_VERTICES, 2))
    weights[:, 0] = 1
    weights[2] = [0, 1]
    np.testing.assert_allclose(carried(binding, weights), [[1, 0], [1, 0], [0.5, 0.5], [0, 1]])


def test_an_item_is_read_whole(tmp_path: Path, files: dict[str, bytes]) -> None:
    archive = Archive(archive_of(tmp_path, files))
    assert archive.under("clothes", ".mhclo") == {"square": "base/clothes/square/square.mhclo"}
    item = archive.item("base/clothes/square/square.mhclo")
    assert item.mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert item.texture.shape == (16, 16, 4)
    # the lower right triangle is mostly opaque, the upper left one is not
    assert opaque_faces(item).tolist() == [True, False]
    seen, own = visible_parts([item, item])
    assert np.flatnonzero(~seen).tolist() == [5, 7, 8, 9, 12, 100]
    assert own[0].all()
    assert own[1].all()


def test_what_is_worn_over_hides_skin_and_clothes(tmp_path: Path, files: dict[str, bytes]) -> None:
    below = MHCLO.replace("z_depth 50", "z_depth 5").replace("5 7 - 9 12\n100", "")
    over = MHCLO.replace("5 7 - 9 12\n100", "0 - 2")
    files |= {
        "base/clothes/square/below.mhclo": below.encode(),
        "base/clothes/square/over.mhclo": over.encode(),
    }
    archive = Archive(archive_of(tmp_path, files))
    items = [archive.item(f"base/clothes/square/{name}.mhclo") for name in ("below", "over")]
    for order in ((0, 1), (1, 0)):
        seen, own = visible_parts([items[index] for index in order])
        assert not own[order.index(0)].any()
        assert own[order.index(1)].all()
        assert not seen[:3].any()
        assert seen[3:].all()
    assert kept_faces(np.array([[0, 1, 2], [0, 1, 3]]), seen).tolist() == [
        False,
        True,
    ]  # skin goes on below the hem


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MHCLO.replace("0 1 2 0.0", f"0 1 {BASE_VERTICES} 0.0"), "beyond the 19158"),
        (MHCLO.replace("100", "20000"), "deletes the vertices 20000"),
        (MHCLO.replace("7 - 9", "9 - 7"), "deletes the vertices 9 to 7"),
        (MHCLO.replace("0.25 0.25 0.5 0 0 1", "0.25 0.25 0.5 0 0"), "a vertex of 8 numbers"),
        (MHCLO.replace("0.5 0.5 0.5", "0.5 nan 0.5"), "not finite"),
        (MHCLO.replace("x_scale 0 1 2.0", "x_scale 0 1 0"), "scales by '0 1 0'"),
        ("name nothing\n", "binds no vertices"),
    ],
)
def test_broken_bindings_are_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_mhclo(text, "a.mhclo")


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"../evil.mhclo": b"x"}, "points outside of the archive"),
        ({"/etc/evil": b"x"}, "points outside of the archive"),
        ({"big.obj": bytes(17 << 20)}, "expected at most 16"),
        ({f"many/{index}": b"" for index in range(2001)}, "expected at most 2000"),
    ],
)
def test_hostile_archives_are_refused(
    tmp_path: Path, files: dict[str, bytes], changed: dict[str, bytes], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        Archive(archive_of(tmp_path, files | changed))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (
            {"base/clothes/square/square.mhmat": b"diffuseTexture ../../../../../etc/passwd\n"},
            "points outside of the archive",
        ),
        ({"base/clothes/square/square.mhmat": b"name dull\n"}, "names no diffuseTexture"),
        ({"base/looks/square.png": b"no picture"}, "is not a picture"),
        (
            {
                "base/clothes/square/square.obj": OBJ.replace("v 0 1 0\n", "")
                .replace(" 4/4", "")
                .encode()
            },
            "binds 4 vertices, but its mesh has 3",
        ),
        (
            {"base/clothes/square/square.mhclo": MHCLO.replace("square.obj", "round.obj").encode()},
            "holds no 'base/clothes/square/round.obj'",
        ),
    ],
)
def test_broken_items_are_refused(
    tmp_path: Path, files: dict[str, bytes], changed: dict[str, bytes], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        Archive(archive_of(tmp_path, files | changed)).item("base/clothes/square/square.mhclo")


def test_no_archive_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="makehuman_cc0"):
        Archive(tmp_path / "makehuman_cc0.zip")
    (tmp_path / "text.zip").write_text("text")
    with pytest.raises(InputError, match="zip"):
        Archive(tmp_path / "text.zip")


def test_a_picture_that_says_it_is_huge_is_not_decoded(
    tmp_path: Path, files: dict[str, bytes]
) -> None:
    png = bytearray(files["base/looks/square.png"])
    png[16:24] = (60_000).to_bytes(4, "big") * 2  # width and height
    png[29:33] = zlib.crc32(bytes(png[12:29])).to_bytes(4, "big")
    path = archive_of(tmp_path, {**files, "base/looks/square.png": bytes(png)})
    with pytest.raises(InputError, match=r"60000 x 60000|picture"):
        Archive(path).item("base/clothes/square/square.mhclo")

"""FBX files are read by ufbx, the library of engines and Blender, with our values."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree

from a2v import Character, InputError, MissingDependencyError, npm
from a2v.animation import prepare_rig, retarget
from a2v.errors import A2VError
from a2v.formats import read_motion
from a2v.formats.fbx import PACKAGES, fbx_to_glb, write_fbx
from a2v.formats.gltf.people import read_person
from a2v.npm import find_node
from pipelines.commands.retarget import Options, run
from pipelines.requests.motion import LengthOptions
from tests.support.glb import Glb
from tests.support.hostile import owes_a_sentence
from tests.support.npm import npm_folder

FPS = 10.0
SHUT = {"eyeBlinkLeft": np.array([0, 0, 0.5, 1.0, 0.25, *[0.0] * 95], np.float32)}
Person = tuple[Character, dict[str, tuple[np.ndarray, float]]]


@pytest.fixture(scope="module")
def person(expressive: Character, data_dir: Path) -> Person:
    """Textured, on Mixamo's rig, with expressions, VRChat's visemes and two clips."""
    character, surface = expressive, expressive.surface
    uv = (surface.vertices[surface.faces][..., :2] * [0.4, 0.5] + [0.5, 0.0]).astype(np.float32)
    texture = np.random.default_rng(0).integers(0, 255, (32, 32, 3), dtype=np.uint8)
    textured = dataclasses.replace(
        character, surface=dataclasses.replace(surface, uv=uv, texture=texture)
    )
    moves = {
        name: (
            retarget(
                read_motion(data_dir / "motions" / f"humanoid3d_{name}.txt", fps=FPS),
                character.body,
            ),
            FPS,
        )
        for name in ("cartwheel", "walk")
    }
    return prepare_rig(textured, moves, rig="mixamo", visemes="vrchat")


@pytest.fixture(scope="module")
def packages() -> Iterator[Path]:
    """three.js and the exporter from npm, in an ignored folder."""
    if find_node() is None:
        pytest.skip("FBX needs node; it is not installed")
    folder = npm_folder("fbx", *PACKAGES.packages)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("A2V_FBX", str(folder))
        yield folder


@pytest.fixture(scope="module")
def path(person: Person, packages: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("fbx") / "person.fbx"
    write_fbx(
        target,
        *person,
        expressions={
            "walk": {name: shut[: len(person[1]["walk"][0])] for name, shut in SHUT.items()}
        },
    )
    return target


@pytest.fixture(scope="module")
def light(person: Person, packages: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same person without expressions and clips: Node converts it several times as fast."""
    character = person[0]
    target = tmp_path_factory.mktemp("light") / "person.fbx"
    still = dataclasses.replace(character.surface, face=None)
    write_fbx(target, dataclasses.replace(character, surface=still))
    return target


@pytest.fixture(scope="module")
def walking(path: Path, data_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A retargeted walk beside the clips of the file."""
    target = tmp_path_factory.mktemp("walking") / "out.fbx"
    motion = str(data_dir / "motions" / "humanoid3d_walk.txt")
    given = {"motions": motion, "lengths": LengthOptions(fps=FPS)}
    assert not run(Options(character=str(path), out=str(target), **given)).notes
    assert fbx_to_glb(target, target.with_name("back.glb")) == ()
    return target


@pytest.fixture(scope="module")
def seen(path: Path) -> dict[str, Any]:
    """What ufbx reads."""
    pytest.importorskip("ufbx")
    out = path.with_suffix(".json")
    script = Path(__file__).with_name("look_in_fbx.py")
    done = subprocess.run(
        [sys.executable, str(script), str(path), str(out), str(FPS)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    told: dict[str, Any] = json.loads(out.read_text())
    return told


def transforms(columns: Any) -> np.ndarray:
    """World from bone (..., 4, 4), meters, of columns (..., 4, 3) in centimeters."""
    given = np.asarray(columns, float)
    found = np.broadcast_to(np.eye(4), (*given.shape[:-2], 4, 4)).copy()
    found[..., :3, :] = np.swapaxes(given, -1, -2)
    found[..., :3, 3] /= 100
    return found


def test_units_axes_and_bones(seen: dict[str, Any], person: Person) -> None:
    body = person[0].body
    assert seen["unit"] == pytest.approx(0.01)
    assert seen["axes"] == ["POSITIVE_X", "POSITIVE_Y", "POSITIVE_Z"]
    assert set(seen["bones"]) == set(body.bone_names)
    for bone, name in enumerate(body.bone_names):
        parent = int(body.bone_parents[bone])
        assert seen["parents"][name] == (body.bone_names[parent] if parent >= 0 else "")
        np.testing.assert_allclose(
            transforms(seen["rest"][name]), body.bone_transforms[bone], atol=1e-5
        )


def test_skin_and_texture(seen: dict[str, Any], person: Person) -> None:
    character = person[0]
    surface = character.surface
    places = np.array(seen["vertices"]) / 100
    far, source = cKDTree(surface.vertices).query(places)
    assert far.max() < 1e-5
    assert seen["triangles"] == len(surface.faces)
    weights = np.zeros((len(places), len(character.body.bone_names)))
    for name, (vertices, values) in seen["skin"].items():
        weights[vertices, character.body.bone_names.index(name)] = values
    expected = np.zeros((len(surface.vertices), weights.shape[1]))
    np.add.at(expected, (np.arange(len(expected))[:, None], character.bones), character.weights)
    np.testing.assert_allclose(weights, expected[source], atol=2e-3)
    assert surface.uv is not None
    corners = np.array(seen["uv"])[seen["uv_corners"]].reshape(
        -1, 3, 2
    )  # v counts from below, as ours
    np.testing.assert_allclose(corners, surface.uv, atol=1e-4)
    picture = np.asarray(Image.open(io.BytesIO(bytes.fromhex(seen["texture"]))))
    assert picture.shape == (32, 32, 3)


def test_clips_move_as_ours(seen: dict[str, Any], person: Person) -> None:
    character, clips = person
    assert seen["fps"] == pytest.approx(FPS)
    assert set(seen["clips"]) == set(clips)
    order = [seen["bones"].index(name) for name in character.body.bone_names]
    for name, (moves, _) in clips.items():
        assert seen["clips"][name]["seconds"] == pytest.approx((len(moves) - 1) / FPS, abs=1e-4)
        found = transforms(seen["clips"][name]["frames"])[:, order]
        np.testing.assert_allclose(found[::2], moves, atol=1e-4)
        heads = found[..., :3, 3]
        halves = np.linalg.norm(heads[1::2] - (heads[:-1:2] + heads[2::2]) / 2, axis=-1)
        steps = np.linalg.norm(np.diff(heads[::2], axis=0), axis=-1).max()
        assert halves.max() < steps  # no bone leaps between keys
    assert seen["leap"] < 185  # degrees, or centimeters


def test_expressions_are_blend_shapes_and_blinks_are_in_the_clip(
    seen: dict[str, Any], person: Person
) -> None:
    character = person[0]
    face = character.surface.face
    assert face is not None
    assert set(seen["shapes"]) == set(face.names)
    _, source = cKDTree(character.surface.vertices).query(np.array(seen["vertices"]) / 100)
    assert {"vrc.v_sil", "vrc.v_aa", "vrc.v_ou"} <= set(face.names)
    for name in ("eyeBlinkLeft", "jawOpen", "vrc.v_aa"):
        wanted = np.zeros_like(character.surface.vertices)
        moved, offsets = face.target(name)
        wanted[moved] = offsets
        places, shifts = seen["shapes"][name]
        assert len(places) < 0.5 * len(seen["vertices"])  # none of those that should stay
        found = np.zeros((len(source), 3))
        found[places] = np.array(shifts) / 100
        np.testing.assert_allclose(found, wanted[source], atol=1e-6)
    strengths = seen["clips"]["walk"]["weights"]["eyeBlinkLeft"]
    np.testing.assert_allclose(strengths, SHUT["eyeBlinkLeft"][: len(strengths)], atol=1e-5)
    assert not np.any(seen["clips"]["walk"]["weights"]["jawOpen"])
    assert not np.any(seen["clips"]["cartwheel"]["weights"]["eyeBlinkLeft"])


@pytest.fixture(scope="module")
def foreign(path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Convert the FBX to GLB as for custom characters."""
    target = tmp_path_factory.mktemp("foreign") / "person.glb"
    fbx_to_glb(path, target)
    return target


def test_an_fbx_of_others_is_read_with_its_bones_and_skin(foreign: Path, person: Person) -> None:
    body, surface = person[0].body, person[0].surface
    read = read_person(foreign)
    names = list(body.bone_names)
    assert sorted(read.body.bone_names) == sorted(names)
    order = [read.body.bone_names.index(name) for name in names]
    floor = np.eye(4)
    floor[1, 3] = surface.vertices[:, 1].min()
    np.testing.assert_allclose(
        floor @ read.body.rest_transforms[order], body.bone_transforms, atol=1e-4
    )
    far, _ = cKDTree(read.body.vertices + floor[:3, 3]).query(surface.vertices)
    assert far.max() < 1e-4
    assert len(read.body.vertices) < 1.5 * len(surface.vertices)  # not one per corner of a triangle


def test_retargeted_clips_of_an_fbx_move_as_those_of_its_glb(
    foreign: Path, walking: Path, data_dir: Path, tmp_path: Path
) -> None:
    pytest.importorskip("ufbx")
    given = {"motions": str(data_dir / "motions" / "humanoid3d_walk.txt")}
    target = tmp_path / "out.glb"
    run(Options(character=str(foreign), out=str(target), lengths=LengthOptions(fps=FPS), **given))
    found = read_person(target)
    back = read_person(walking.with_name("back.glb"))
    names = {item["name"] for item in back.file.items("animations")}
    assert "humanoid3d_walk" in names
    assert {"cartwheel", "walk"} <= names  # the file's own clips are kept
    assert sorted(back.body.bone_names) == sorted(found.body.bone_names)
    out = tmp_path / "out.json"
    script = Path(__file__).with_name("look_in_fbx.py")
    subprocess.run([sys.executable, str(script), str(walking), str(out), str(FPS)], check=True)
    told = json.loads(out.read_text())
    assert all(
        name.startswith("mixamorig:") for name in told["bones"]
    )  # as Mixamo writes them, colons and all
    moved = transforms(told["clips"]["humanoid3d_walk"]["frames"])[
        ::2, told["bones"].index("mixamorig:Hips"), :3, 3
    ]
    assert np.ptp(moved[:, 2]) > 0.5  # she walks, in meters
    assert 0.02 < np.ptp(moved[:, 1]) < 0.3


def pictures_of(glb: Path) -> list[bytes]:
    """The encoded pictures of the base colors of a GLB's materials."""
    file = Glb(glb)
    found = []
    for material in file.json["materials"]:
        texture = file.json["textures"][
            material["pbrMetallicRoughness"]["baseColorTexture"]["index"]
        ]
        view = file.json["bufferViews"][file.json["images"][texture["source"]]["bufferView"]]
        start = view.get("byteOffset", 0)
        found.append(bytes(file.blob[start : start + view["byteLength"]]))
    return found


def test_pictures_and_their_places_come_through(
    foreign: Path, walking: Path, person: Person
) -> None:
    surface = person[0].surface
    assert surface.uv is not None
    [picture] = pictures_of(foreign)
    assert Image.open(io.BytesIO(picture)).size == (32, 32)
    file = Glb(foreign)
    primitive = file.json["meshes"][0]["primitives"][0]
    places, uv = (file.array(primitive["attributes"][name]) for name in ("POSITION", "TEXCOORD_0"))
    triangles = file.array(primitive["indices"]).reshape(-1, 3)
    ours = np.concatenate(
        [surface.vertices[surface.faces], surface.uv * [1, -1] + [0, 1]], axis=-1
    ).reshape(-1, 5)
    far, _ = cKDTree(ours).query(
        np.concatenate([places, uv], axis=1)[triangles].reshape(-1, 5)[::7]
    )
    assert far.max() < 1e-3  # each corner has its own place in the picture
    assert pictures_of(walking.with_name("back.glb")) == [picture]


def without_picture(path: Path) -> bytes:
    """An FBX whose embedded picture is of no known kind."""
    data = path.read_bytes()
    for head in (b"\xff\xd8\xff\xe0\0\x10JFIF", b"\x89PNG\r\n\x1a\n"):
        data = data.replace(head, b"\0" * len(head))
    return data


def test_a_picture_beside_the_file_is_read_and_another_kind_is_left_out(
    light: Path, tmp_path: Path
) -> None:
    """An embedded picture of a kind that is not copied, and one that is a file of the folder."""
    (tmp_path / "other.fbx").write_bytes(without_picture(light))
    assert fbx_to_glb(tmp_path / "other.fbx", tmp_path / "out.glb") == ("texture",)
    assert "images" not in Glb(tmp_path / "out.glb").json


def test_an_fbx_that_is_none_is_refused(packages: Path, tmp_path: Path) -> None:
    for name, data, match in (
        ("text.fbx", b"hello", "is not an FBX"),
        ("cut.fbx", b"Kaydara FBX Binary  \0\x1a\0" + bytes(40), "cannot read"),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match=match):
            fbx_to_glb(tmp_path / name, tmp_path / "out.glb")
    with pytest.raises(InputError, match="does not exist"):
        fbx_to_glb(tmp_path / "none.fbx", tmp_path / "out.glb")
    assert not (tmp_path / "out.glb").exists()


def test_what_is_missing_or_wrong_is_told(
    character: Character, packages: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    still = character.body.bone_transforms[None]
    with pytest.raises(InputError, match="clip 'a'"):
        write_fbx(tmp_path / "a.fbx", character, {"a": (still[:, :3], 10.0)})
    monkeypatch.setenv("A2V_NODE", str(tmp_path / "nothing"))
    with pytest.raises(A2VError, match="expected Node 18"):
        write_fbx(tmp_path / "a.fbx", character)
    monkeypatch.delenv("A2V_NODE")
    monkeypatch.setenv("A2V_FBX", str(tmp_path / "none"))
    with pytest.raises(MissingDependencyError, match=r"npm install --prefix .*none three@"):
        write_fbx(tmp_path / "a.fbx", character)
    monkeypatch.setattr(npm, "find_node", lambda: None)
    with pytest.raises(MissingDependencyError, match=r"a2v\[fbx\]"):
        write_fbx(tmp_path / "a.fbx", character)
    assert not list(tmp_path.iterdir())


def bomb(unpacked: int, stated: int) -> bytes:
    """A binary FBX with one array of 64-bit numbers, packed by zlib."""
    pack, blocks = zlib.compressobj(), unpacked >> 20
    start = pack.compress(bytes(unpacked % (1 << 20))) + pack.flush(zlib.Z_FULL_FLUSH)
    block = pack.compress(bytes(1 << 20)) + pack.flush(
        zlib.Z_FULL_FLUSH
    )  # packed the same each time
    check = struct.pack(">I", unpacked % 65521 << 16 | 1)  # Adler-32 of zeros
    packed = start + block * blocks + pack.flush()[:-4] + check
    array = b"d" + struct.pack("<III", stated // 8, 1, len(packed)) + packed
    head = b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 7400)
    name = b"Vertices"
    end = len(head) + 13 + len(name) + len(array)
    node = struct.pack("<IIIB", end, 1, len(array), len(name)) + name + array
    return head + node + bytes(13)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: bomb(600 << 20, 600 << 20), "unpack to more than 512 MB"),
        (lambda: bomb(64 << 20, 800), "does not unpack to the 800 bytes"),
        (lambda: bomb(800, 800)[:60], "reaches beyond"),
        (lambda: b"; FBX 7.3.0 project file\n" + b"0,1," * (17 << 20), "its text has"),
    ],
    ids=["large", "other size", "cut", "text"],
)
def test_an_fbx_that_takes_memory_is_refused_before_node_starts(
    make: Callable[[], bytes], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """1 GB of zeros took 3.2 GB, and the message was about Node."""
    monkeypatch.setattr(npm, "find_node", lambda: pytest.fail("Node was started"))
    (tmp_path / "a.fbx").write_bytes(make())

    def read() -> None:
        with pytest.raises(InputError, match=said):
            fbx_to_glb(tmp_path / "a.fbx", tmp_path / "a.glb")

    owes_a_sentence(read)


def test_pipes_and_links_are_not_followed(light: Path, tmp_path: Path) -> None:
    """Of the file and of the pictures that it names: another folder's picture is not copied."""
    os.mkfifo(tmp_path / "c.fbx")
    with pytest.raises(InputError, match="not a regular file"):
        fbx_to_glb(tmp_path / "c.fbx", tmp_path / "c.glb")
    inside, outside = tmp_path / "in", tmp_path / "out"
    inside.mkdir(), outside.mkdir()
    (inside / "a.fbx").write_bytes(without_picture(light))
    Image.new("RGB", (8, 8)).save(outside / "secret.png")
    for name in ("texture.png", "texture.jpg", "texture"):
        (inside / name).symlink_to(outside / "secret.png")
    assert fbx_to_glb(inside / "a.fbx", tmp_path / "a.glb") == ("texture",)
    for name in ("texture.png", "texture.jpg", "texture"):
        (inside / name).unlink()
        os.mkfifo(inside / name)
    assert fbx_to_glb(inside / "a.fbx", tmp_path / "a.glb") == ("texture",)


@pytest.mark.skipif(os.getuid() != 0, reason="a small file system needs root")
def test_a_full_disk_is_told_as_such(light: Path, tmp_path: Path) -> None:
    """It was told as a fault of Node or of the input."""
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(small)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        with pytest.raises(InputError, match=r"cannot write .*(full|No space)"):
            fbx_to_glb(light, small / "a.glb")
        assert not list(small.glob(".*"))
    finally:
        subprocess.run(["umount", str(small)], check=False)

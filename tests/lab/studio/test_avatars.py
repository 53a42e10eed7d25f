from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.errors import InputError
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.avatars import Avatar, a_pose, avatar_part


def glb(content: dict, binary: bytes = b"") -> bytes:  # type: ignore[type-arg]
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        body += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def two_bone_strip(scale: float = 0.01) -> bytes:
    """A strip of two quads along +y on two scaled bones, with int16 positions."""
    points = np.array([[x, y, 0] for y in (0.0, 0.5, 1.0) for x in (-0.1, 0.1)])
    quantised = np.rint(points * 32767).astype("<i2")
    padded = np.zeros((6, 4), "<i2")
    padded[:, :3] = quantised  # rows of 8 bytes: byteStride
    joints = np.array([[0, 1, 0, 0]] * 6, "u1")
    weights = np.array([[255, 0, 0, 0]] * 2 + [[128, 127, 0, 0]] * 2 + [[0, 255, 0, 0]] * 2, "u1")
    uv = np.array([[x, y] for y in (0.0, 0.5, 1.0) for x in (0.0, 1.0)], "<f4")
    indices = np.array([0, 1, 3, 0, 3, 2, 2, 3, 5, 2, 5, 4], "<u2")
    size = 2.0  # the mesh is drawn twice as large: quantised positions are in units of 2 m
    bind = []
    for height in (0.0, 1.0):
        world = np.eye(4)
        world[1, 3] = height
        world[:3, :3] *= scale
        bind.append((np.linalg.inv(world) @ np.diag([size, size, size, 1.0])).T)
    arrays = [padded, joints, weights, uv, indices, np.array(bind, "<f4")]
    binary, views = b"", []
    for array in arrays:
        data = array.tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        binary += data + b"\0" * (-len(data) % 4)
    views[0]["byteStride"] = 8
    content = {
        "asset": {"version": "2.0"},
        "nodes": [
            {"name": "Hips", "scale": [scale] * 3, "children": [1]},
            {"name": "Spine", "translation": [0, 1 / scale, 0]},
            {
                "name": "strip",
                "mesh": 0,
                "skin": 0,
                "translation": [9, 9, 9],
            },  # a skinned mesh's own node does not count
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {
                            "POSITION": 0,
                            "JOINTS_0": 1,
                            "WEIGHTS_0": 2,
                            "TEXCOORD_0": 3,
                        },
                        "indices": 4,
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [{"name": "cloth", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]}}],
        "skins": [{"joints": [0, 1], "inverseBindMatrices": 5}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5122,
                "type": "VEC3",
                "count": 6,
                "normalized": True,
            },
            {"bufferView": 1, "componentType": 5121, "type": "VEC4", "count": 6},
            {
                "bufferView": 2,
                "componentType": 5121,
                "type": "VEC4",
                "count": 6,
                "normalized": True,
            },
            {"bufferView": 3, "componentType": 5126, "type": "VEC2", "count": 6},
            {"bufferView": 4, "componentType": 5123, "type": "SCALAR", "count": 12},
            {"bufferView": 5, "componentType": 5126, "type": "MAT4", "count": 2},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    return glb(content, binary)


def test_skin_semantics_on_a_known_rig(tmp_path: Path) -> None:
    path = tmp_path / "strip.glb"
    path.write_bytes(two_bone_strip())
    strip = load_avatar(path)
    assert strip.bone_names == ("Hips", "Spine")
    rest = strip.skin(strip.bone_transforms())
    expected = np.array([[x, y, 0] for y in (0.0, 1.0, 2.0) for x in (-0.2, 0.2)])
    np.testing.assert_allclose(rest, expected, atol=1e-4)
    # turning the upper bone by 90 degrees about +z lays the upper half along -x, and carries half
    # of the middle's weight
    turned = strip.skin(strip.bone_transforms({"Spine": (0, 0, np.pi / 2)}))
    np.testing.assert_allclose(turned[4:], [[-1, 0.8, 0], [-1, 1.2, 0]], atol=1e-4)
    np.testing.assert_allclose(turned[:2], expected[:2], atol=1e-4)
    half = 128 / 255
    np.testing.assert_allclose(
        turned[2], half * expected[2] + (1 - half) * np.array([0, 0.8, 0]), atol=1e-4
    )
    # glTF's uv starts at the upper left, ours at the lower left
    image_v = strip.uv[0, 0, 1]
    assert image_v > strip.uv[2, 2, 1]


def test_avatar_stands_in_our_axes(avatar: Avatar) -> None:
    person = avatar.surface()
    low, high = person.vertices.min(axis=0), person.vertices.max(axis=0)
    assert low[1] == pytest.approx(0, abs=1e-5)
    assert 1.5 < high[1] < 2.0
    assert high[0] - low[0] > 0.8 * high[1]  # T-pose
    names = {name: index for index, name in enumerate(avatar.bone_names)}
    rest = avatar.rest_transforms[:, :3, 3]
    assert rest[names["LeftHand"]][0] > 0.5 > -0.5 > rest[names["RightHand"]][0]
    assert rest[names["LeftToeBase"]][2] > rest[names["LeftFoot"]][2] + 0.05  # the feet point to +z
    # faces are counter-clockwise from outside: the body has a positive volume
    body = avatar.faces[avatar.mesh_ids == 0]
    a, b, c = (person.vertices[body[:, k]].astype(float) for k in range(3))
    volume = np.einsum("fi,fi->", a, np.cross(b, c)) / 6
    assert 0.04 < volume < 0.15


def test_parts_lie_where_they_belong(avatar: Avatar) -> None:
    vertices = avatar.surface().vertices
    middle = {
        part: vertices[avatar.parts == index].mean(axis=0) for index, part in enumerate(PARTS)
    }
    assert set(middle) == set(PARTS)
    assert (
        middle["head"][1]
        > middle["neck"][1]
        > middle["torso"][1]
        > middle["left_thigh"][1]
        > middle["left_shin"][1]
        > middle["left_foot"][1]
    )
    for part in ("upper_arm", "lower_arm", "hand", "thigh", "shin", "foot"):
        assert middle[f"left_{part}"][0] > 0 > middle[f"right_{part}"][0]
    assert (
        middle["left_hand"][0]
        > middle["left_lower_arm"][0]
        > middle["left_upper_arm"][0]
        > middle["torso"][0] + 0.05
    )
    assert avatar_part("LeftHandThumb4_end_end") == "left_hand"
    assert avatar_part("RightEye_end") == "head"


def test_posing_moves_limbs_and_keeps_lengths(avatar: Avatar) -> None:
    names = {name: index for index, name in enumerate(avatar.bone_names)}
    posed = avatar.bone_transforms(a_pose(arms=40))
    shoulder, elbow, hand = (
        posed[names[name], :3, 3] for name in ("LeftArm", "LeftForeArm", "LeftHand")
    )
    rest = avatar.rest_transforms[:, :3, 3]
    upper = elbow - shoulder
    assert np.linalg.norm(upper) == pytest.approx(
        np.linalg.norm(rest[names["LeftForeArm"]] - rest[names["LeftArm"]]), rel=1e-5
    )
    # the direction of the upper arm: 40 degrees from the vertical, up to how the T-pose holds it
    assert np.degrees(np.arccos(-upper[1] / np.linalg.norm(upper))) == pytest.approx(40, abs=4)
    assert hand[2] > elbow[2]  # the elbow bends forward
    np.testing.assert_allclose(avatar.bone_transforms(), avatar.rest_transforms, atol=1e-6)
    with pytest.raises(InputError, match="no bone 'Tail'"):
        avatar.bone_transforms({"Tail": (0, 0, 0)})


def test_atlas_holds_both_materials(avatar: Avatar) -> None:
    assert avatar.uv.min() >= 0
    assert avatar.uv.max() <= 1
    hair, body = avatar.uv[avatar.materials == 1][..., 0], avatar.uv[avatar.materials == 0][..., 0]
    assert hair.min() > body.max()  # tiles do not overlap
    texture = avatar.texture.astype(float)
    columns = (hair.mean(axis=1) * texture.shape[1]).astype(int)
    rows = ((1 - avatar.uv[avatar.materials == 1][..., 1].mean(axis=1)) * texture.shape[0]).astype(
        int
    )
    assert texture[rows, columns].mean() < 110  # her hair is dark


def test_round_trip(avatar: Avatar, tmp_path: Path) -> None:
    avatar.save(tmp_path / "avatar.npz")
    again = Avatar.load(tmp_path / "avatar.npz")
    np.testing.assert_array_equal(
        again.surface(a_pose()).vertices, avatar.surface(a_pose()).vertices
    )


def broken_files() -> dict[str, bytes]:
    good = two_bone_strip()
    length = struct.unpack_from("<I", good, 12)[0]
    content, binary = json.loads(good[20 : 20 + length]), good[28 + length :]

    def changed(path: tuple[str | int, ...], value: object) -> bytes:
        copy = json.loads(json.dumps(content))
        at = copy
        for key in path[:-1]:
            at = at[key]
        at[path[-1]] = value
        return glb(copy, binary)

    return {
        "empty": b"",
        "text": b"hello, this is no model at all",
        "truncated": good[:-40],
        "broken json": good[:20] + b"\xff" * length + good[20 + length :],
        "no mesh": glb({"asset": {"version": "2.0"}}),
        "huge accessor": changed(("accessors", 0, "count"), 10**9),
        "negative offset": changed(("bufferViews", 0, "byteOffset"), -8),
        "view outside": changed(("bufferViews", 3, "byteLength"), 10**6),
        "accessor outside": changed(("accessors", 3, "count"), 600),
        "unknown joint": changed(("skins", 0, "joints"), [0, 77]),
        "node loop": changed(("nodes", 1, "children"), [0]),
        "missing weights": changed(("meshes", 0, "primitives", 0, "attributes"), {"POSITION": 0}),
        "index outside": changed(("accessors", 4, "bufferView"), 3),
        "nodes no list": changed(("nodes",), {"a": 1}),
        "rotation of three": changed(("nodes", 0, "rotation"), [0, 0, 1]),
        "texture missing": changed(
            ("materials", 0, "pbrMetallicRoughness"), {"baseColorTexture": {"index": 5}}
        ),
        "joints null": changed(("skins", 0, "joints"), None),
    }


@pytest.mark.parametrize("name", list(broken_files()))
def test_broken_files_are_named(tmp_path: Path, name: str) -> None:
    path = tmp_path / "person.glb"
    path.write_bytes(broken_files()[name])
    with pytest.raises(InputError, match=r"person\.glb") as caught:
        load_avatar(path)
    assert "\n" not in str(caught.value)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nobody\.glb"):
        load_avatar(tmp_path / "nobody.glb")


def test_every_avatar_loads(data_dir: Path) -> None:
    for path in sorted((data_dir / "avatars").glob("*.glb"))[::8]:
        vertices = load_avatar(path).surface(a_pose()).vertices
        assert 1.4 < np.ptp(vertices[:, 1]) < 2.1, path.name

"""Every reader of outside files returns a value or one sentence for hostile variants."""

from __future__ import annotations

import io
import json
import pickle
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pictures

from a2v.body.smpl import JOINTS, SmplModel
from a2v.formats import read_bvh, read_motion, write_bvh
from a2v.formats.arrays_pickle import read_arrays_pickle
from a2v.formats.deepmimic import _FRAME, read_deepmimic
from a2v.formats.gltf.people import read_person
from a2v.formats.gltf.person_clips import write_person
from a2v.kinematics import CMU
from a2v.lab.datasets.files import FileSource
from a2v.lab.evaluation.liquid_warp import read_face_texture
from a2v.lab.evaluation.survey_answers import analyze, read_answers, read_key, survey_table
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.makehuman.assets import Archive
from a2v.perception.apply_corrections import draw_strokes
from a2v.perception.corrections import read_corrections
from a2v.perception.landmarks import read_openpose
from a2v.perception.photo import decode_mask, decode_photo
from a2v.rendering.camera import CameraPath, read_cameras
from a2v.rendering.looks import read_look
from a2v.types import (
    Body,
    Character,
    Motion,
    OrthographicCamera,
    PhotoCamera,
    RenderSettings,
    Subject,
    Surface,
)
from pipelines.cli import main
from pipelines.nodes.values import Blob, Pose, Poses
from tests.support.glb import glb
from tests.support.hostile import bundles, edited, owes_a_sentence, retold, trees
from tests.support.motions import person


def written(content: bytes | str, suffix: str, read: Callable[[Path], object]) -> None:
    """Put `content` into a file for `read`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{suffix}"
        path.write_bytes(
            content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
        )
        owes_a_sentence(lambda: read(path))


def saved(content: dict[str, np.ndarray]) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **content)
    return buffer.getvalue()


# ------------------------------------------------------------------------------------------------------------------ records

ZEROS = np.zeros((4, 20, 3), np.float32)
MOTION = Motion(
    joints=ZEROS,
    rotations=ZEROS,
    root=ZEROS[:, 0],
    fps=12.0,
    parents=CMU.parents,
    joint_names=CMU.joint_names,
    skeleton="cmu",
)
SURFACE = Surface(vertices=ZEROS[0, :3], faces=np.array([[0, 1, 2]], np.int32), colors=ZEROS[0, :3])
BODY = Body(
    model="anny",
    parameters={"shape": np.zeros(2, np.float32)},
    vertices=ZEROS[0, :3],
    faces=np.array([[0, 1, 2]], np.int32),
    bone_names=("root", "tip"),
    bone_parents=np.array([-1, 0], np.int32),
    bone_transforms=np.tile(np.eye(4, dtype=np.float32), (2, 1, 1)),
    rest_transforms=np.tile(np.eye(4, dtype=np.float32), (2, 1, 1)),
    bone_tails=np.zeros((2, 3), np.float32),
    weights=np.full((3, 2), 0.5, np.float32),
    parts=np.zeros(3, np.int8),
)
RECORDS = (
    MOTION,
    OrthographicCamera(scale=2.0, center_u=1.0, center_v=1.0),
    PhotoCamera(
        flat=OrthographicCamera(scale=2.0, center_u=1.0, center_v=1.0), distance=2.0, pitch=0.1
    ),
    Subject(
        image=np.zeros((4, 4, 3), np.uint8),
        mask=np.zeros((4, 4), np.float32),
        keypoints=np.zeros((33, 3), np.float32),
        keypoints_3d=np.zeros((33, 3), np.float32),
        crop=(0, 0, 4, 4),
        photo_size=(4, 4),
    ),
    SURFACE,
    BODY,
    Character(
        surface=SURFACE,
        body=BODY,
        weights=np.ones((3, 4), np.float32),
        bones=np.zeros((3, 4), np.int32),
        anchors=np.zeros(3, np.int32),
        parts=np.zeros(3, np.int8),
    ),
    RenderSettings(),
    CameraPath(name="hero"),
    Blob.of(b"data"),
    Poses(bone_transforms=np.zeros((2, 2, 4, 4), np.float32), fps=12.0),
    Pose(bone_transforms=np.zeros((2, 4, 4), np.float32)),
)


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: type(record).__name__)
@given(data=st.data())
def test_records(record, data):
    content = data.draw(bundles(record.to_arrays()))
    written(saved(content), ".npz", type(record).load)


@given(edited(saved(MOTION.to_arrays())))
def test_damaged_archives(data):
    written(data, ".npz", read_motion)


# ------------------------------------------------------------------------------------------------------------------ motions


def text_of(motion: Motion) -> str:
    with tempfile.TemporaryDirectory() as folder:
        write_bvh(Path(folder) / "a.bvh", motion)
        return (Path(folder) / "a.bvh").read_text()


BVH = text_of(person(frames=3))
CLIP = {"Loop": "wrap", "Frames": [[0.03, 0, 1, 0, *[1.0] * (_FRAME - 4)] for _ in range(3)]}


@given(retold(BVH), st.sampled_from([None, 0.1, 30.0, 1000.0]))
def test_bvh(text, fps):
    owes_a_sentence(
        lambda: read_bvh(text.encode("utf-8", "surrogatepass"), fps=fps, person=fps is None)
    )


@given(edited(BVH.encode()))
def test_damaged_bvh(data):
    owes_a_sentence(lambda: read_bvh(data))


@given(trees(CLIP))
def test_deepmimic(tree):
    written(json.dumps(tree), ".txt", read_deepmimic)


@given(edited(json.dumps(CLIP).encode()))
def test_damaged_deepmimic(data):
    written(data, ".txt", read_deepmimic)


# ------------------------------------------------------------------------------------------------------------------ data sets


def archive() -> bytes:
    buffer, clip = io.BytesIO(), io.BytesIO()
    np.save(clip, np.zeros((4, 24, 3), np.float32))
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as target:
        target.writestr("P01G01R01F0001T0064A0101.npy", clip.getvalue())
        target.writestr("größe.txt", "a")
    return buffer.getvalue()


@given(edited(archive()))
def test_archives_of_data_sets(data):
    def read(path: Path) -> None:
        source = FileSource(path)
        for name in source.names(".npy"):
            source.read_npy(name)

    written(data, ".zip", read)


TRACK = {
    1: {
        "joints3d": np.zeros((3, 49, 3), np.float32),
        "frame_ids": np.arange(3),
        "bbox": [1.5, "text", None],
        "raw": bytearray(b"ab"),
    }
}


@given(st.integers(2, 5).flatmap(lambda protocol: edited(pickle.dumps(TRACK, protocol))))
def test_pickles(data):
    owes_a_sentence(lambda: read_arrays_pickle(data, "clip.pkl"))


def smpl() -> dict[str, np.ndarray]:
    vertices, bones = 6, len(JOINTS[24][1])
    table = np.stack([np.arange(-1, bones - 1), np.arange(bones)])
    return {
        "v_template": np.zeros((vertices, 3)),
        "shapedirs": np.zeros((vertices, 3, 2)),
        "posedirs": np.zeros((vertices, 3, 9 * (bones - 1))),
        "J_regressor": np.zeros((bones, vertices)),
        "weights": np.full((vertices, bones), 1 / bones),
        "kintree_table": table,
        "f": np.array([[0, 1, 2]], np.uint32),
    }


@given(bundles(smpl()))
def test_body_models(content):
    written(saved(content), ".npz", SmplModel.load)


# ------------------------------------------------------------------------------------------------------------------ pictures, cameras, settings

POINTS = {
    "version": 1.3,
    "people": [
        {"pose_keypoints_2d": [float(i) for i in range(75)], "hand_left_keypoints_2d": [1.0] * 63}
    ],
}


@given(trees(POINTS))
def test_openpose(tree):
    owes_a_sentence(lambda: read_openpose(json.dumps(tree).encode(), photo_size=(10, 10)))


@given(edited(json.dumps(POINTS).encode()))
def test_damaged_openpose(data):
    owes_a_sentence(lambda: read_openpose(data))


CORRECTIONS = {
    "units": "fractions",
    "person": 1,
    "landmarks": {"nose": [0.5, 0.1]},
    "limbs": {"left_lower_arm": "front"},
    "mask": [{"add": [[0.1, 0.2]], "radius": 0.1}],
}


@given(trees(CORRECTIONS))
def test_corrections(tree):
    owes_a_sentence(
        lambda: draw_strokes(
            np.zeros((9, 9), np.float32),
            read_corrections(json.dumps(tree).encode(), "x").in_pixels(9, 9).strokes,
        )
    )


LOOK = "sun: [1.2, 1.0, 0.8]\nzenith: [0.4, 0.6, 0.8]\nhaze: 0.25\nsun_direction: [0.7, 0.9, 0.8]\nbounces: 2\n"
CAMERAS = "hero: {azimuth: 30, elevation: 12, fov: 35}\norbit:\n  turn: 360\n  distance: 4\n  follow: false\ntripod: {origin: [2.5, 1.5, 3.0], target: [0, 0.9, 0]}\n"


@given(
    st.one_of(
        retold(CAMERAS),
        trees({"hero": {"azimuth": 30, "origin": [1, 2, 3], "follow": True}}).map(json.dumps),
    )
)
def test_cameras(text):
    written(text, ".yaml", read_cameras)


@given(
    st.one_of(
        retold(LOOK),
        trees({"sun": [1, 0.5, 0.2], "zenith": None, "bounces": 2, "haze": 0.3}).map(json.dumps),
    )
)
def test_looks(text):
    written(text, ".yaml", read_look)


MHCLO = "obj_file a.obj\nx_scale 0 1 2.0\nmaterial a.mhmat\nz_depth 5\nverts 0\n0 1 2 1 0 0 0 0 .5\n2\n7\ndelete_verts\n5 7 - 9\n"
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nf 1/1 2/2 3/2\n"


@given(
    retold(MHCLO),
    retold(OBJ),
    st.sampled_from([b"diffuseTexture a.png\n", b"diffuseTexture ../../a.png\n", b""]),
)
def test_makehuman(clothes, mesh, material):
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as made:
        for name, data in (("a.mhclo", clothes), ("a.obj", mesh)):
            made.writestr(name, data.encode("utf-8", "surrogatepass"))
        made.writestr("a.mhmat", material)
        made.writestr("a.png", picture("PNG"))
    written(archive.getvalue(), ".zip", lambda path: Archive(path).item("a.mhclo"))


FACES = np.array([[0, 1, 2], [0, 2, 3]])
UV = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1/1 3/3/1 4/4/1\n"


@given(st.one_of(retold(UV), edited(UV.encode())))
def test_texture_coordinates(content):
    written(content, ".obj", lambda path: read_face_texture(path, FACES))


SETTINGS = "action: Walk\nframes: 9\nseed: 1\ncount: 2\n"


@given(
    st.one_of(
        retold(SETTINGS).map(lambda text: text.encode("utf-8", "surrogatepass")),
        edited(SETTINGS.encode()),
    )
)
def test_settings(data):
    written(
        data,
        ".yaml",
        lambda path: main(
            [
                "motion",
                "--config",
                str(path),
                "--model",
                "none",
                "--out",
                str(path.with_suffix(".npz")),
            ]
        ),
    )


def picture(form: str, mode: str = "RGB") -> bytes:
    buffer = io.BytesIO()
    Pictures.effect_noise((130, 130), 60).convert(mode).save(buffer, form)
    return buffer.getvalue()


PICTURES = [
    picture("JPEG"),
    picture("PNG", "RGBA"),
    picture("TIFF", "I"),
    picture("GIF", "P"),
    picture("BMP"),
    picture("WEBP"),
    picture("PPM"),
    picture("JPEG2000"),
]


@given(st.sampled_from(PICTURES).flatmap(edited))
def test_photos(data):
    owes_a_sentence(lambda: decode_photo(data))


@given(st.sampled_from(PICTURES).flatmap(edited))
def test_masks(data):
    owes_a_sentence(lambda: decode_mask(data))


# ------------------------------------------------------------------------------------------------------------------ surveys, avatars

KEY: dict[str, Any] = {
    "format": "a2v-survey-key/1",
    "survey": "abc",
    "title": "A title",
    "seed": 0,
    "questions": [
        {"id": "q1", "kind": "preference", "action": "walk", "clips": ["a", "b"]},
        {"id": "q2", "kind": "real", "action": "walk", "clips": ["a"]},
    ],
    "clips": {
        "a": {"source": "real", "action": "walk", "provenance": {}},
        "b": {"source": "ours", "action": "walk", "provenance": {}},
    },
}
ANSWERS = {
    "format": "a2v-survey-answers/1",
    "survey": "abc",
    "participant": "p",
    "answers": [{"question": "q1", "ranking": ["a", "b"]}, {"question": "q2", "real": True}],
}


@given(trees(KEY), trees(ANSWERS))
def test_surveys(key, answers):
    def read(path: Path) -> None:
        path.with_suffix(".a").write_text(json.dumps(answers))
        survey_table(
            analyze(found := read_key(path), [read_answers(path.with_suffix(".a"), found)])
        )

    written(json.dumps(key), ".json", read)


SCENE = {
    "nodes": [
        {"name": "Hips", "children": [1], "rotation": [0, 0, 0, 1]},
        {"name": "Spine", "matrix": [1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
        {"mesh": 0, "skin": 0},
    ],
    "skins": [{"joints": [0, 1], "inverseBindMatrices": 0}],
    "meshes": [
        {
            "name": "m",
            "primitives": [
                {
                    "attributes": {"POSITION": 1, "JOINTS_0": 2, "WEIGHTS_0": 3, "TEXCOORD_0": 4},
                    "indices": 5,
                    "material": 0,
                }
            ],
        }
    ],
    "materials": [{"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    "textures": [{"source": 0}],
    "images": [{"bufferView": 0}],
    "bufferViews": [{"byteOffset": 0, "byteLength": 512}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 2, "type": "MAT4"},
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 0, "componentType": 5121, "count": 3, "type": "VEC4"},
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC4"},
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"},
        {"bufferView": 0, "componentType": 5123, "count": 3, "type": "SCALAR"},
    ],
}


@given(trees(SCENE), st.binary(min_size=512, max_size=512))
def test_avatars(tree, binary):
    written(glb(tree, binary), ".glb", load_avatar)


BONES = (
    "hips",
    "spine",
    "neck",
    "head",
    *(
        f"{side}{name}"
        for side in ("left", "right")
        for name in ("UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand")
    ),
)
PLACES = (
    [0, 1, 0],
    [0, 0.2, 0],
    [0, 0.3, 0],
    [0, 0.1, 0],
    *(
        place
        for side in (1, -1)
        for place in (
            [0.1 * side, 0, 0],
            [0, -0.4, 0],
            [0, -0.4, 0],
            [0.2 * side, 0.3, 0],
            [0.3 * side, 0, 0],
            [0.3 * side, 0, 0],
        )
    ),
)
ABOVE = (-1, 0, 1, 2, 0, 4, 5, 1, 7, 8, 0, 10, 11, 1, 13, 14)
PERSON = {
    "nodes": [
        *(
            {
                "name": name,
                "translation": place,
                "children": [child for child, parent in enumerate(ABOVE) if parent == number],
            }
            for number, (name, place) in enumerate(zip(BONES, PLACES, strict=True))
        ),
        {"mesh": 0, "skin": 0},
    ],
    "skins": [{"joints": list(range(16))}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}]}],
    "bufferViews": [{"byteOffset": 0, "byteLength": 512}],
    "buffers": [{"byteLength": 512}],
    "accessors": [
        {"bufferView": 0, "componentType": 5122, "normalized": True, "count": 60, "type": "VEC3"},
        {"componentType": 5121, "count": 60, "type": "VEC4"},
        {"bufferView": 0, "componentType": 5121, "normalized": True, "count": 60, "type": "VEC4"},
    ],
    "extensions": {
        "VRM": {
            "humanoid": {
                "humanBones": [{"bone": name, "node": node} for node, name in enumerate(BONES)]
            }
        }
    },
}


@given(trees(PERSON), st.binary(min_size=512, max_size=512))
def test_characters_of_others(tree, binary):
    def dance(path: Path) -> None:
        person = read_person(path)
        still = person.body.rest_transforms[None].astype(float)
        write_person(path.with_suffix(".out"), person, {"still": (still, 30.0)})
        read_person(path.with_suffix(".out"))

    written(glb(tree, binary), ".glb", dance)


MOVING = PERSON | {
    "accessors": [
        *PERSON["accessors"],
        {"bufferView": 0, "componentType": 5121, "count": 4, "type": "SCALAR"},
        {"bufferView": 0, "componentType": 5122, "normalized": True, "count": 4, "type": "VEC4"},
        {"bufferView": 0, "componentType": 5122, "normalized": True, "count": 4, "type": "VEC3"},
    ],
    "animations": [
        {
            "name": "a",
            "samplers": [{"input": 3, "output": 4}, {"input": 3, "output": 5}],
            "channels": [
                {"sampler": 0, "target": {"node": 4, "path": "rotation"}},
                {"sampler": 1, "target": {"node": 0, "path": "translation"}},
            ],
        }
    ],
}


@given(trees(MOVING), st.binary(min_size=512, max_size=512))
def test_animations_of_others(tree, binary):
    written(glb(tree, binary), ".glb", read_motion)


def test_a_whole_animation_of_others_is_read(tmp_path):
    (tmp_path / "whole.glb").write_bytes(glb(MOVING, bytes(range(256)) * 2))
    assert read_motion(tmp_path / "whole.glb").frames > 1


AMASS = {
    "poses": np.zeros((4, 156)),
    "trans": np.zeros((4, 3)),
    "mocap_framerate": np.array(30.0),
    "rest_joints": np.zeros((52, 3)),
}


@given(bundles(AMASS))
def test_arrays_of_other_tools(content):
    written(saved(content), ".npz", read_motion)


@given(st.one_of(edited(saved(AMASS)), edited(pickle.dumps(AMASS))))
def test_damaged_arrays_of_other_tools(data):
    written(data, ".pkl", read_motion)


def test_a_whole_character_of_others_is_read(tmp_path):
    """An intact version of what `test_characters_of_others` damages can be read."""
    (tmp_path / "whole.glb").write_bytes(glb(PERSON, bytes(range(256)) * 2))
    person = read_person(tmp_path / "whole.glb")
    write_person(
        tmp_path / "out.glb",
        person,
        {"still": (person.body.rest_transforms[None].astype(float), 30.0)},
    )
    assert len(read_person(tmp_path / "out.glb").nodes) == 16

"""``--pose photo`` stands as in the photo, in every format; ``rest`` does not."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
import trimesh

import a2v
from a2v.samples.ready import PHOTO
from a2v.types import BoolArray, FloatArray, Subject
from pipelines.cli import main
from pipelines.engine.store import Store
from pipelines.requests.video import photo_parameters
from pipelines.run import run
from tests.support.glb import Glb
from tests.support.ready_store import ready_folder

LEAST = 0.95
"""Smallest overlap of the outline with the photo's mask in the pose of the photo."""
MOST = 0.85
"""Largest overlap at rest."""
SIZE = ["--triangles", "8000", "--texture", "512", "--normal-map", "0", "--quiet"]


@pytest.fixture(scope="module")
def mask() -> BoolArray:
    """The person's mask in the upright photo."""
    store = Store(ready_folder())
    subject = run("subject", store=store, **photo_parameters(store, PHOTO)).get("subject", Subject)
    whole = np.zeros(subject.photo_size[::-1], bool)
    left, top, right, bottom = subject.crop
    assert subject.mask.shape == (bottom - top, right - left)
    whole[top:bottom, left:right] = subject.mask > 0.5
    return whole


def reconstruct(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, object]:
    given = ["reconstruct", "--photo", PHOTO, *SIZE, "--cache", ready_folder(), "--json", *words]
    assert main([str(word) for word in given]) == 0
    answer: dict[str, object] = json.loads(capsys.readouterr().out)
    return answer


def seen(points: FloatArray, camera: dict[str, object]) -> FloatArray:
    """Project points (V, 3) as the help of `camera_facts` says: a pinhole, turned down by pitch."""
    offset = points - np.asarray(camera["position"])
    sine, cosine = np.sin(camera["pitch"]), np.cos(camera["pitch"])
    up = cosine * offset[:, 1] - sine * offset[:, 2]
    ahead = -sine * offset[:, 1] - cosine * offset[:, 2]
    right = offset[:, 0]
    return (
        np.asarray(camera["center"]) + camera["focal"] * np.stack([right, -up], 1) / ahead[:, None]
    )


def overlap(
    points: FloatArray, faces: FloatArray, camera: dict[str, object], mask: BoolArray
) -> float:
    """Share of common pixels of the outline and the mask among those of either."""
    drawn = np.zeros(mask.shape, np.uint8)
    corners = np.round((seen(points, camera)[faces] - 0.5) * 16).astype(np.int32)
    for corner in corners:
        cv2.fillConvexPoly(drawn, corner, 1, shift=4)
    return float((drawn.astype(bool) & mask).sum() / (drawn.astype(bool) | mask).sum())


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_the_outline_is_the_photos(suffix, mask, tmp_path, capsys):
    files = {pose: tmp_path / f"{pose}{suffix}" for pose in ("photo", "rest")}
    answers = {
        pose: reconstruct(capsys, "--pose", pose, "--out", path) for pose, path in files.items()
    }
    assert "photo_camera" not in answers["rest"]
    camera = answers["photo"]["photo_camera"]
    assert camera["size"] == list(mask.shape[::-1])
    found = {}
    for pose, path in files.items():
        mesh = trimesh.load(path, force="mesh", process=False)
        found[pose] = overlap(np.asarray(mesh.vertices), np.asarray(mesh.faces), camera, mask)
        assert len(mesh.faces) <= 8000
        assert abs(float(mesh.vertices[:, 1].min())) < 0.03  # on the ground
    assert found["photo"] > LEAST > MOST > found["rest"], found


def test_bones_and_expressions_follow(tmp_path, capsys):
    """A viewer that skins the mesh sees what the file holds, in both poses."""
    for pose in ("photo", "rest"):
        path = tmp_path / f"{pose}.glb"
        reconstruct(capsys, "--pose", pose, "--out", path)
        document = Glb(path)
        skin = document.json["skins"][0]
        inverse = np.swapaxes(document.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4), 1, 2)
        assert np.abs(np.linalg.det(inverse[:, :3, :3]) - 1).max() < 1e-3
        targets = document.json["meshes"][0]["primitives"][0]["targets"]
        assert len(targets) >= 50
    me = a2v.make_character(PHOTO, cache=ready_folder(), triangles=8000, texture=512, normal_map=0)
    path = tmp_path / "photo.glb"
    assert me.save(tmp_path / "same.glb", pose="photo").read_bytes() == path.read_bytes()


def test_clips_of_a_posed_character_move_as_those_at_rest(tmp_path):
    """Bound in the photo's pose it bends a little differently, but goes to the same places."""
    me = a2v.make_character(PHOTO, cache=ready_folder(), triangles=8000, texture=512, normal_map=0)
    clip = {"Walk": a2v.make_motion("Walk", frames=3, cache=ready_folder())}
    shown = [
        Glb(me.save(tmp_path / f"{pose}.glb", clip, pose=pose)).animated("Walk", 1)
        for pose in ("rest", "photo")
    ]
    apart = np.linalg.norm(shown[0] - shown[1], axis=1)
    assert apart.mean() < 0.01
    assert np.quantile(apart, 0.95) < 0.03


def test_what_has_no_photos_pose_is_refused(tmp_path):
    me = a2v.make_character(PHOTO, cache=ready_folder(), triangles=8000, texture=512, normal_map=0)
    for name, more in (
        ("a.vrm", {"author": "A", "license_url": "https://a.b"}),
        ("a.glb", {"rig": "mixamo"}),
    ):
        with pytest.raises(a2v.InputError, match="rest pose of their own"):
            me.save(tmp_path / name, pose="photo", **more)

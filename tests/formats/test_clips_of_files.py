"""``FILE#CLIP`` names one of several motions in a file, wherever a motion file is taken."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats import read_motion, write_motion
from a2v.formats.bare import drawn_bones
from a2v.formats.bvh.writing import rig_of_motion
from a2v.formats.gltf import write_glb
from a2v.formats.registry import split_clip
from a2v.motion import MotionModel
from a2v.motion.keyframes import read_poses
from a2v.types import Motion
from pipelines.batch.rows import read_rows
from pipelines.graph import video_graph
from pipelines.requests.motion import MotionRequest
from pipelines.requests.video import VideoRequest
from pipelines.run import run
from tests.support.motions import person
from tests.support.smpl_files import FILES

LENGTHS = {"two.glb#Short one": 9, "two.glb#1": 9, "two.glb#Walk": 24, "two.glb": 24}
LENGTHS |= {"mdm.npy": 40, "mdm.npy#1": 30, "people.pkl": 40, "people.pkl#0": 5, "one.bvh#0": 9}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("clips")
    body, moves = rig_of_motion(person(frames=24))
    clips = {"Walk": (moves, 30.0), "Short one": (moves[:9], 30.0)}
    write_glb(folder / "two.glb", drawn_bones(body), clips)
    one = person(frames=9)
    write_motion(folder / "one.bvh", one)
    arrays = {name: getattr(one, name) for name in ("joints", "rotations", "root")}
    both = {name: np.stack([value, value[::-1]]) for name, value in arrays.items()}
    dataclasses.replace(one, **both).save(folder / "two.npz")
    (folder / "mdm.npy").write_bytes(FILES["mdm"][0])
    (folder / "people.pkl").write_bytes(FILES["joblib"][0])
    return folder


@pytest.mark.parametrize("name", LENGTHS)
def test_a_clip_is_named_after_the_file(folder: Path, name: str) -> None:
    assert read_motion(f"{folder}/{name}").frames == LENGTHS[name]


def test_a_batch_of_ours_has_numbers(folder: Path) -> None:
    whole = read_motion(folder / "two.npz")
    assert whole.batch == (2,)
    second = read_motion(f"{folder}/two.npz#1")
    assert np.array_equal(second.joints, whole.joints[1])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("two.glb#Jump", "no animation 'Jump'; choose one of 0 'Walk', 1 'Short one'"),
        ("two.npz#2", "no motion '2'; it has 2 motions: choose 0 to 1"),
        ("mdm.npy#two", "no motion 'two'; it has 2 motions: choose 0 to 1"),
        ("people.pkl#7", "no person '7'; choose one of '1', '0'"),
        ("one.bvh#Walk", "no motion 'Walk'; it has one motion: leave it out"),
        ("none.glb#Walk", "none.glb"),
    ],
)
def test_an_unknown_clip_is_answered_with_those_there(folder: Path, name: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_motion(f"{folder}/{name}")


def test_a_name_with_a_number_sign_stays_whole(folder: Path, tmp_path: Path) -> None:
    odd = tmp_path / "take #3.bvh"
    odd.write_bytes((folder / "one.bvh").read_bytes())
    assert split_clip(odd) == (odd, "")
    assert split_clip(f"{tmp_path}/a.glb#b c") == (tmp_path / "a.glb", "b c")
    assert read_motion(odd).frames == 9


def test_a_film_takes_the_named_clip(folder: Path, tmp_path: Path) -> None:
    def made(name: str) -> Motion:
        asked = MotionRequest.of(motion=f"{folder}/{name}", fps=30.0).resolve()
        graph = video_graph(recorded=True)
        return run("motion", graph=graph, executor="serial", **asked.parameters).get(
            "motion", Motion
        )

    assert made("two.glb#Short one").frames == 9
    named = VideoRequest.of(photo="me.jpg", motion=f"{folder}/two.glb#Short one").files()
    assert named["motion"] == f"{folder}/two.glb"  # what the report has the digest of
    assert made("two.glb").frames == 24
    with pytest.raises(InputError, match="1 'Short one'"):
        made("two.glb#Jump")


def test_a_table_of_jobs_and_a_first_pose_take_it_too(folder: Path) -> None:
    (folder / "jobs.csv").write_text("photo,motion\nme.jpg,two.glb#Short one\n")
    (row,) = read_rows(folder / "jobs.csv", VideoRequest.of(photo="me.jpg"))
    assert not row.problem
    assert row.request.motion.resolve().parameters["motion_file"].clip == "Short one"
    model = MotionModel.load("cmu")
    last = read_poses(f"{folder}/two.glb#Short one#8", model)[0][1]
    assert np.allclose(last, read_poses(f"{folder}/two.glb#Walk#8", model)[0][1], atol=1e-3)
    assert len(read_poses(f"{folder}/two.glb#1#3-5", model)) == 3
    assert len(read_poses(f"{folder}/two.glb#Short one", model)) == 1
    with pytest.raises(InputError, match="poses 0 to 8"):
        read_poses(f"{folder}/two.glb#Short one#9", model)

"""Which model makes what is asked for."""

from __future__ import annotations

import pytest

from a2v.errors import InputError
from a2v.motion import MotionModel
from pipelines.motion_options import AUTO, FEW, MANY, motion_inputs, open_model


@pytest.mark.parametrize(
    ("asked", "model"),
    [("Walk", FEW), ("walk, then Jump for 2 s", FEW), ("salsa", MANY), ("walk, then sneak", MANY), ("walk backwards", MANY), ("", MANY), ("xyzzy", MANY)],
)
def test_the_papers_actions_by_name_are_the_few_models(asked, model):
    assert open_model(AUTO, asked).card.dataset == model


def test_paths_and_timelines_need_the_model_that_can_be_directed(tmp_path):
    assert open_model(AUTO, "Walk", directed=True).card.dataset == MANY
    assert open_model(AUTO, timeline="any.yaml").card.dataset == MANY
    assert motion_inputs(action="Walk", model=AUTO, path="0,0 0,2 2,2")["direction"] is not None


def test_a_named_model_is_kept_and_unknown_words_are_refused():
    assert open_model(MANY, "Walk").card.dataset == MANY
    assert open_model("humanact12").card.dataset == "humanact12"
    with pytest.raises(InputError, match="nearest"):
        motion_inputs(action="xyzzy", model=AUTO)
    with pytest.raises(InputError, match="not found"):
        open_model("nobody", "Walk")


def test_a_recorded_motion_takes_no_direction(tmp_path):
    with pytest.raises(InputError, match="path cannot be given with motion"):
        motion_inputs(action="", model=AUTO, motion="a.bvh", path="0,0 0,3")
    with pytest.raises(InputError, match="there is no path"):
        motion_inputs(action="Walk", model=AUTO, pace=1.0)


def test_every_wish_of_the_command_line_reaches_the_direction(tmp_path):
    MotionModel.load(MANY).sample("Walk", frames=30, seed=1).save(tmp_path / "a.npz")
    (tmp_path / "k.yaml").write_text("- {time: 1, at: [0, 1]}\n")
    direction = motion_inputs(
        action="Walk", model=AUTO, path="0,0 0,2 2,2", pace=1.1, heading=90.0, keyframes=str(tmp_path / "k.yaml"),
        start_pose=f"{tmp_path}/a.npz", end_pose=f"{tmp_path}/a.npz#4-6", hold="head 0,1.5,0 from 1 to 2",
    )["direction"]  # fmt: skip
    assert (len(direction.path.points), direction.pace, round(direction.heading, 3)) == (3, 1.1, 1.571)
    assert [key.to_end for key in direction.keyframes] == [False, False, True, True, True]
    assert [round(12 * key.time) for key in direction.keyframes] == [12, 0, 2, 1, 0]
    assert direction.holds[0].joint == "head"

"""The model that is chosen for a request."""

from __future__ import annotations

from pathlib import Path

import pytest

from a2v.errors import InputError
from a2v.motion import MotionModel
from pipelines.requests.motion import AUTO, MANY, MotionRequest, open_model


def parameters(**values: object) -> dict:
    return MotionRequest.of(**values).resolve().parameters


def model_of(**values: object) -> str:
    found = parameters(**values)
    assert not any(step.source for step in found["steps"])
    return str(MotionModel.load(found["model"].path).card.dataset)


@pytest.mark.parametrize(
    ("asked", "model"),
    [
        ("Walk", MANY),
        ("walk, then Jump for 2 s", MANY),
        ("wash", "cmu"),
        ("salsa", MANY),
        ("walk, then sneak", MANY),
        ("walk backwards", MANY),
        ("turn the steering wheel", "humanact12"),
    ],
)
def test_one_model_makes_what_it_can_make_alone(asked, model):
    assert model_of(action=asked) == model


def test_clips_and_several_sources_say_what_makes_each_step():
    mixed = parameters(action="sneak, then bow, then salsa")
    assert [step.source for step in mixed["steps"]] == ["cmu-fine", "clips", "cmu-fine"]
    assert mixed["model"].digest != parameters(action="bow")["model"].digest
    assert parameters(action="bow", fps=30.0)["frames"] == 141  # as it is keyed, with its stances
    assert parameters(action="idle", seconds=7.0, fps=30.0)["frames"] == 210
    with pytest.raises(InputError, match="keyframes cannot be given with Bow"):
        parameters(action="bow", model="clips", keyframes="k.yaml")


@pytest.mark.parametrize(
    ("asked", "file"),
    [
        ("Walk", "motion_humanact12_glmi_m"),
        ("dance", "motion_cmu_glmi_m"),
        ("eat_pie_burger", "motion_humanact12_fine_glmi_m"),
    ],
)
def test_a_decoder_names_the_first_vae_that_knows_the_action(asked, file):
    assert Path(parameters(action=asked, model="glmi-m")["model"].path).stem == file


def test_a_decoder_of_free_data_and_an_action_that_no_vae_knows():
    free = parameters(action="Walk", model="lie", license="free")
    assert Path(free["model"].path).stem == "motion_cmu_lie"
    with pytest.raises(InputError, match=r"none of humanact12-lie, cmu-lie.*they know warm_up"):
        parameters(action="salsa", model="lie")


def test_research_is_left_out_where_licenses_must_be_free():
    with pytest.raises(InputError, match="none of the actions"):
        parameters(action="turn the steering wheel", license="free")
    with pytest.raises(InputError, match="research only"):
        parameters(action="drink", model="humanact12", license="free")


def test_what_was_understood_is_told():
    told = MotionRequest.of(action="wlak slowly, then bow").resolve().understood
    assert told[0].startswith("'wlak slowly' is taken for Walk slowly")
    assert told[1] == "'bow' is taken for Bow [hand-keyed clips]"


def test_paths_and_timelines_need_the_model_that_can_be_directed(tmp_path):
    assert open_model(AUTO).card.dataset == MANY
    assert model_of(action="Walk", path="0,0 0,2 2,2") == MANY
    assert parameters(action="Walk", path="0,0 0,2 2,2")["direction"] is not None


def test_a_named_model_is_kept_and_unknown_words_are_refused():
    assert model_of(action="Walk", model=MANY) == MANY
    assert model_of(action="walk", model="humanact12") == "humanact12"
    with pytest.raises(InputError, match="nearest"):
        parameters(action="xyzzy")
    with pytest.raises(InputError, match="not found"):
        open_model("nobody")


def test_a_recorded_motion_takes_no_direction(tmp_path):
    with pytest.raises(InputError, match="path cannot be given with motion"):
        parameters(motion="a.bvh", path="0,0 0,3")
    with pytest.raises(InputError, match="there is no path"):
        parameters(action="Walk", pace=1.0)


def test_every_wish_of_the_command_line_reaches_the_direction(tmp_path):
    MotionModel.load(MANY).sample("Walk", frames=30, seed=1).save(tmp_path / "a.npz")
    (tmp_path / "k.yaml").write_text("- {time: 1, at: [0, 1]}\n")
    direction = parameters(
        action="Walk",
        path="0,0 0,2 2,2",
        pace=1.1,
        heading=90.0,
        keyframes=str(tmp_path / "k.yaml"),
        start_pose=f"{tmp_path}/a.npz",
        end_pose=f"{tmp_path}/a.npz#4-6",
        hold="head 0,1.5,0 from 1 to 2",
    )["direction"]
    assert (len(direction.path.points), direction.pace, round(direction.heading, 3)) == (
        3,
        1.1,
        1.571,
    )
    assert [key.to_end for key in direction.keyframes] == [False, False, True, True, True]
    assert [round(12 * key.time) for key in direction.keyframes] == [12, 0, 2, 1, 0]
    assert direction.holds[0].joint == "head"

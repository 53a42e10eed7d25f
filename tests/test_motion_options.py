"""Which model makes what is asked for."""

from __future__ import annotations

import pytest

from a2v.errors import InputError
from pipelines.motion_options import AUTO, FEW, MANY, motion_inputs, open_model


@pytest.mark.parametrize(
    ("asked", "model"),
    [("Walk", FEW), ("walk, then Jump for 2 s", FEW), ("salsa", MANY), ("walk, then sneak", MANY), ("walk backwards", MANY), ("", MANY), ("xyzzy", MANY)],
)
def test_the_papers_actions_by_name_are_the_few_models(asked, model):
    assert open_model(AUTO, asked).card.dataset == model


def test_paths_and_timelines_need_the_model_that_can_be_directed(tmp_path):
    assert open_model(AUTO, "Walk", path="0,0 0,3").card.dataset == MANY
    assert open_model(AUTO, timeline="any.yaml").card.dataset == MANY
    assert motion_inputs(action="Walk", model=AUTO, path="0,0 0,2 2,2")["direction"] is not None


def test_a_named_model_is_kept_and_unknown_words_are_refused():
    assert open_model(MANY, "Walk").card.dataset == MANY
    assert open_model("humanact12").card.dataset == "humanact12"
    with pytest.raises(InputError, match="nearest"):
        motion_inputs(action="xyzzy", model=AUTO)
    with pytest.raises(InputError, match="not found"):
        open_model("nobody", "Walk")

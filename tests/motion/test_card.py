"""Model cards: shipped files are read whole; missing or absurd entries are reported by file."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.motion import BUNDLED, MotionModel
from a2v.motion.card import (
    STEP_FORMAT,
    WINDOW_FORMAT,
    StepCard,
    WindowCard,
    check_graph,
    parse_card,
    read_card,
)
from a2v.sessions import WEIGHTS, read_metadata

FILE = Path("mine.onnx")


@pytest.fixture(scope="module", params=["cmu", "humanact12-glmi-r"])
def said(request):
    """Return the descriptions of a shipped flow and a shipped VAE."""
    return read_metadata(
        WEIGHTS / BUNDLED[request.param], (STEP_FORMAT, WINDOW_FORMAT), "motion model"
    )


@pytest.mark.parametrize("name", sorted(BUNDLED))
def test_shipped_files_are_read_whole(name):
    path = WEIGHTS / BUNDLED[name]
    card, said = read_card(path), read_metadata(path, (STEP_FORMAT, WINDOW_FORMAT), "motion model")
    check_graph(card, path)
    for entry in ("dataset", "dataset_digest", "decoder", "fps", "frames", "latent_size"):
        assert getattr(card, entry) == said[entry], entry
    # the files keep the British spelling of these two keys
    assert card.license == said["licence"]
    assert card.meters_per_unit == said["metres_per_unit"]
    assert list(card.actions) == said["actions"]
    assert list(card.joint_names) == said["skeleton"]["joint_names"]
    assert card.skeleton.parents.tolist() == said["skeleton"]["parents"]
    assert list(card.native_signs) == said["native_signs"]
    assert card.bone_lengths.dtype == np.float32
    assert np.allclose(card.bone_lengths, said["bone_lengths"], atol=1e-6)
    assert card.rests_as_named
    if said["format"] == WINDOW_FORMAT:
        assert isinstance(card, WindowCard)
        assert (card.window_frames, card.context_frames) == (
            said["window_frames"],
            said["context_frames"],
        )
        assert [shares.tolist() for shares in card.active] == said["active"]
    else:
        assert isinstance(card, StepCard)
        assert card.hidden_size == said["hidden_size"]


def test_some_entries_may_be_absent(said):
    fewer = {
        name: value
        for name, value in said.items()
        if name not in ("dataset_digest", "held_out", "training", "temperature")
    }
    card = parse_card(fewer, FILE)
    assert (card.dataset_digest, card.held_out) == ("", ())
    for people in ([], ["S1", "S2"]):
        assert list(parse_card(said | {"held_out": people}, FILE).held_out) == people


def test_every_other_entry_is_needed(said):
    extra = {
        "dataset_digest",
        "held_out",
        "training",
        "temperature",
        "steps",
        "guidance",
        "guided_until",
    }
    names = set(said) - extra
    assert len(names) > 11
    for name in names:
        with pytest.raises(
            InputError,
            match=rf"mine\.onnx: its description lacks '{name}', .*; export the model again",
        ):
            parse_card({key: value for key, value in said.items() if key != name}, FILE)
    for name in ("name", "parents", "joint_names", "rest_directions"):
        tree = {key: value for key, value in said["skeleton"].items() if key != name}
        with pytest.raises(InputError, match=rf"mine\.onnx: its description lacks '{name}'"):
            parse_card(said | {"skeleton": tree}, FILE)


@pytest.mark.parametrize(
    ("entry", "value", "words"),
    [
        ("dataset", 3, "is 3; expected a text"),
        ("actions", [], r"is \[\]; expected a list of different texts"),
        ("actions", ["walk", "walk"], "different texts"),
        ("actions", "walk", "different texts"),
        ("fps", 0, "is 0; expected a number from 0.1 to 1000"),
        ("fps", float("nan"), "is nan"),
        ("fps", "20", "is '20'"),
        ("fps", True, "is True"),
        ("frames", 0, "a whole number from 1 to 10000"),
        ("frames", 10**9, "a whole number"),
        ("frames", 2.5, "a whole number"),
        ("latent_size", -3, "a whole number"),
        ("bone_lengths", [1.0], "numbers from 0 to"),
        ("bone_lengths", [float("inf")] * 20, "numbers from 0 to"),
        ("metres_per_unit", 0.0, "is 0.0; expected a number"),
        ("native_signs", [1.0, 1.0], "3 signs"),
        ("native_signs", [1.0, 0.5, 1.0], "3 signs"),
        ("skeleton", [], "an object"),
    ],
)
def test_absurd_entries_are_refused(said, entry, value, words):
    with pytest.raises(
        InputError,
        match=rf"mine\.onnx: '{entry}' in its description .*{words}.*export the model again",
    ):
        parse_card(said | {entry: value}, FILE)


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ("parents", "cycle"),
        ("parents", "half"),
        ("rest_directions", "short"),
        ("rest_directions", "long"),
    ],
)
def test_absurd_trees_are_refused(said, entry, value):
    tree = copy.deepcopy(said["skeleton"])
    if value == "cycle":
        tree["parents"][1] = 5
    elif value == "half":
        tree["parents"][1] = 0.5
    elif value == "short":
        tree["rest_directions"].pop()
    else:
        tree["rest_directions"][1] = [7.0, 0.0, 0.0]
    with pytest.raises(InputError, match=r"mine\.onnx: "):
        parse_card(said | {"skeleton": tree}, FILE)


@pytest.mark.parametrize(
    "changes",
    [{"active": []}, {"active": [[0.5, 2.0]] * 8}, {"context_frames": 100}, {"window_frames": 0}],
)
def test_absurd_windows_are_refused(changes):
    said = read_metadata(WEIGHTS / BUNDLED["cmu"], (WINDOW_FORMAT,), "motion model")
    with pytest.raises(InputError, match=r"mine\.onnx: .*export the model again"):
        parse_card(said | changes, FILE)


def test_an_action_without_clips_cannot_be_asked_for():
    """All clips of an action may be from held-out people."""
    path = WEIGHTS / BUNDLED["cmu"]
    said = read_metadata(path, (WINDOW_FORMAT,), "motion model")
    model = MotionModel(path, parse_card(said | {"active": [[], *said["active"][1:]]}, path))
    assert model.sample("Jump", frames=3).frames == 3
    for ask in (model.sample, model.sample_native):
        with pytest.raises(
            InputError,
            match=r"motion_cmu\.onnx was not trained on clips of 'Walk'; choose another action",
        ):
            ask("Walk", frames=3)

"""Things in hands."""

from __future__ import annotations

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from a2v.animation.hands import Hand
from a2v.animation.held import find_held, thing_of
from a2v.animation.rig import rig_of
from a2v.formats.gltf import write_glb
from a2v.formats.gltf.reading import read_glb
from a2v.motion.catalog import catalog
from a2v.motion.edit import Edit
from a2v.motion.on_rig import retarget_edited
from a2v.motion.plan import plan_motion
from a2v.motion.timeline import Take
from a2v.props import Props
from a2v.samples.ready import load_ready_person
from a2v.types import FloatArray

FPS = 12.0
"""Few frames: retargeting is what takes time."""


@functools.cache
def moved(prompt: str, seed: int = 0, seconds: float = 4.0) -> tuple[FloatArray, Props]:
    """Bone transforms of the ready person and what is in the hands."""
    body = load_ready_person().character.body
    plan = plan_motion(prompt)
    motion = plan.make(Take(frames=round((plan.seconds or seconds) * FPS), fps=FPS, seed=seed))
    moves = retarget_edited(motion, body, Edit())
    return moves, Props.of([]).with_moving(find_held(moves, body, motion))


def places(props: Props, number: int = 0) -> FloatArray:
    return props.moves[:, number, :3, 3]


@pytest.mark.parametrize(
    ("prompt", "things", "hands"),
    [
        ("drink", ["cup"], 1),
        ("slash with two swords", ["sword", "sword"], 2),
    ],
)
def test_things_stay_in_a_hand_and_turn_with_it(prompt: str, things: list[str], hands: int) -> None:
    moves, props = moved(prompt)
    body = load_ready_person().character.body
    rig = rig_of(body)
    assert props.moves.shape[1] == len(things)
    assert all(name.startswith(things[0]) for name in props.names)
    near = set()
    for number in range(len(things)):
        for side in ("left", "right"):
            hand = Hand.of(rig, body.bone_names, side)
            assert hand is not None
            wrist = moves[:, hand.wrist]
            away = places(props, number) - wrist[:, :3, 3]
            turned = np.einsum("tba,tb->ta", wrist[:, :3, :3], away)
            if np.linalg.norm(away, axis=-1).max() < 0.15:
                near.add(side)
                assert np.ptp(turned, axis=0).max() < 1e-3
    assert len(near) == hands


def test_a_box_is_between_the_hands_and_a_ball_flies_and_lands() -> None:
    _, box = moved("hold a box")
    assert box.names == ("box_1",)
    _, ball = moved("throw a ball")
    height = places(ball)[:, 1]
    assert height.max() > 1.0
    assert height[-1] == pytest.approx(0.055, abs=1e-3)
    assert np.linalg.norm(np.diff(places(ball)[-5:], axis=0), axis=-1).max() < 1e-6


def test_only_the_action_with_a_thing_holds_it_and_layers_do_too() -> None:
    _, walk = moved("walk", seconds=2.0)
    assert not walk.names
    assert not len(walk.moves)
    _, both = moved("walk for 2 s, then drink")
    scale = np.linalg.norm(both.moves[:, 0, :3, 0], axis=-1)
    assert scale[: round(1.9 * FPS)].max() < 0.01
    assert scale[-1] == pytest.approx(1, abs=1e-5)
    _, layered = moved("walk while drinking")
    assert layered.names == ("cup_1",)


def test_every_named_thing_has_an_action() -> None:
    found = {thing_of(entry.name) for entry in catalog().entries}
    wanted = {"cup", "phone", "ball", "box", "sword", "long sword", "swords", "guitar", "torch"}
    assert found == wanted | {""}


def test_things_of_clips_are_animated_and_hidden_in_other_clips(tmp_path: Path) -> None:
    person = load_ready_person().character
    drink, cup = moved("drink")
    walk, none = moved("walk", seconds=2.0)
    props = Props.of_clips({"Drink": cup, "Walk": none})
    assert props.clips == ("Drink",)
    target = tmp_path / "two.glb"
    write_glb(target, person, {"Drink": (drink, FPS), "Walk": (walk, FPS)}, props=props)
    document = read_glb(target).json
    node = next(at for at, one in enumerate(document["nodes"]) if "cup" in one["name"])
    for animation in document["animations"]:
        own = [
            channel["target"]["path"]
            for channel in animation["channels"]
            if channel["target"]["node"] == node
        ]
        assert sorted(own) == ["rotation", "scale", "translation"], json.dumps(animation)[:200]


def test_usd_has_a_matrix_in_every_frame(tmp_path: Path) -> None:
    pxr = pytest.importorskip("pxr", reason="USD is not installed")
    from a2v.formats.usd import write_usd

    assert pxr
    from pxr import Usd, UsdGeom

    drink, cup = moved("drink")
    target = tmp_path / "one.usda"
    write_usd(target, load_ready_person().character, {"Drink": (drink, FPS)}, props=cup)
    stage = Usd.Stage.Open(str(target))
    (mesh,) = [prim for prim in stage.Traverse() if prim.GetName() == "cup_1"]
    for frame in (0, len(drink) // 2):
        matrix = np.array(UsdGeom.Xformable(mesh).ComputeLocalToWorldTransform(frame))
        np.testing.assert_allclose(matrix.T, cup.moves[frame, 0], atol=1e-5)

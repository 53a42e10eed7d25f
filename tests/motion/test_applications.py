"""Interpolation, outpainting, body scale and long sequences, on models of both formats."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.kinematics import CMU, HUMANACT12, SKELETONS, bone_lengths, forward_kinematics
from a2v.kinematics.ground import heading
from a2v.lab.datasets.generated import generated_dataset
from a2v.lab.motion.flow import FlowModel, FlowNetwork
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.vae import MotionVAE
from a2v.lab.motion.windows import CodecSettings, WindowCodec
from a2v.motion import MotionModel
from a2v.motion.applications import (
    between,
    interpolate,
    matching_actions,
    on_skeleton,
    outpaint,
    sample_each,
)
from a2v.motion.placement import body_parts, leg_length
from a2v.types import Motion
from export.flow import Sampling, export_flow
from export.motion import export_motion
from tests.support.flows import SMALL
from tests.support.motions import waving


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    """An untrained model of each kind: the tested properties hold for any weights."""
    folder = tmp_path_factory.mktemp("models")
    data = waving(clips=8, frames=40)
    torch.manual_seed(0)
    network = FlowNetwork(2, SMALL)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(torch.randn_like(parameter) * 0.05)
    codec = WindowCodec.fit(
        data, CodecSettings(size=12, context_size=5, context_frames=4), windows=300
    )
    export_flow(
        FlowModel(network.eval(), codec),
        data,
        folder / "flow.onnx",
        license="Apache-2.0",
        sampling=Sampling(steps=1, guidance=1.0),
    )
    vae = MotionVAE(
        data.skeleton, 2, VAESettings(decoder="lie", hidden_size=32, latent_size=6)
    ).eval()
    export_motion(vae, data, folder / "step.onnx", license="Apache-2.0")
    return {name: MotionModel.load(folder / f"{name}.onnx") for name in ("flow", "step")}


@pytest.fixture(params=["flow", "step"])
def model(models, request):
    return models[request.param]


def stepping(joints):
    """Largest step of any joint between frames: (..., T - 1)."""
    return np.linalg.norm(np.diff(joints, axis=-3), axis=-1).max(-1)


def test_the_great_circle_keeps_lengths_and_meets_both_ends():
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, 50))
    share = np.linspace(0, 1, 9)
    arc, line = between(a, b, share), between(a, b, share, linear=True)
    for path in (arc, line):
        assert np.allclose(path[[0, -1]], [a, b], atol=1e-5)
    norms = np.linalg.norm(arc, axis=1)
    assert np.allclose(norms, np.linspace(norms[0], norms[-1], 9), rtol=1e-5)
    assert np.linalg.norm(line[4]) < 0.9 * norms[4]
    unit = arc / norms[:, None]
    angles = np.arccos(np.clip((unit[1:] * unit[:-1]).sum(1), -1, 1))
    assert np.allclose(angles, angles[0], atol=1e-3)
    assert np.allclose(between(a, 2 * a, share), np.outer(1 + share, a), atol=1e-4)


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("frames", [12, 47])
def test_interpolation_goes_from_one_motion_to_the_other(model, frames, linear):
    rows = interpolate(model, "slow", seeds=(3, 8), rows=9, frames=frames, linear=linear)
    assert rows.joints.shape == (9, frames, 20, 3)
    one, two = (model.sample("slow", frames=frames, seed=seed).joints for seed in (3, 8))
    assert np.allclose(rows.joints[0], one, atol=1e-6)
    if model.makes_windows:
        assert np.allclose(rows.joints[-1], two, atol=1e-6)
    first = rows.joints[:, 0] - rows.root[:, :1]
    whole = np.linalg.norm(first[-1] - first[0])
    assert whole > 1e-4
    assert (
        max(np.linalg.norm(b - a) for a, b in itertools.pairwise(first)) < 0.5 * whole + 1e-6
    )  # no jump in a row's first pose


def test_outpainting_keeps_the_given_poses_and_goes_on_smoothly(model):
    start = model.sample("slow", frames=7, seed=2)
    placed = dataclasses.replace(
        start,
        joints=start.joints + np.float32([3, 0, -2]),
        root=start.root + np.float32([3, 0, -2]),
    )
    futures = outpaint(model, placed, "slow", frames=33, count=3, seed=4)
    assert futures.joints.shape == (3, 33, 20, 3)
    assert np.abs(futures.joints[:, :7] - placed.joints).max() < 1e-6
    later = futures.joints[:, 20:]
    assert min(np.abs(later[i] - later[j]).max() for i, j in ((0, 1), (0, 2), (1, 2))) > 1e-4
    steps = stepping(futures.joints)
    assert (steps[:, 6] < 3 * np.delete(steps, 6, axis=1).max(axis=1) + 0.02).all()
    lengths = bone_lengths(futures.joints, CMU)
    assert np.allclose(lengths, lengths[:, :1], atol=1e-4)
    again = forward_kinematics(futures.rotations, futures.root, lengths, CMU)
    assert np.abs(again - futures.joints).max() < 1e-4
    assert np.array_equal(
        futures.joints, outpaint(model, placed, "slow", frames=33, count=3, seed=4).joints
    )


def test_outpainting_depends_on_what_is_given(model):
    """The same noise after two different starts gives two different continuations."""
    futures = [
        outpaint(
            model, model.sample("slow", frames=7, seed=seed), "slow", frames=20, count=1, seed=1
        ).joints[0, 8:]
        for seed in (0, 5)
    ]
    local = [joints - joints[:, :1] for joints in futures]
    assert np.abs(local[0] - local[1]).max() > 1e-4


def test_outpainting_has_the_body_of_the_start(model):
    start = model.sample("slow", frames=7, seed=2, bone_scale=1.3)
    futures = outpaint(model, start, "slow", frames=20, count=1)
    assert np.allclose(
        bone_lengths(futures.joints[0], CMU), bone_lengths(start.joints, CMU)[:1], atol=1e-4
    )
    plain = outpaint(model, model.sample("slow", frames=7, seed=2), "slow", frames=20, count=1)
    if model.makes_windows:  # it knows directions only, so a larger person does the same, larger
        path = [motion.root[0, 6:] - motion.root[0, 6] for motion in (futures, plain)]
        assert np.allclose(path[0], 1.3 * path[1], atol=1e-3)


@pytest.mark.parametrize(
    ("words", "options"),
    [
        ("none are left to generate|make the result longer", {"frames": 7}),
        ("count is 0", {"count": 0}),
    ],
)
def test_impossible_outpainting_is_explained(models, words, options):
    with pytest.raises(InputError, match=words):
        outpaint(models["flow"], models["flow"].sample("slow", frames=7), "slow", **options)
    with pytest.raises(InputError, match="one clip"):
        outpaint(models["flow"], models["flow"].sample("slow", frames=7, count=2), "slow")


def posed(skeleton, frames=6):
    """A person of any skeleton who swings both elbows, facing +z."""
    rotations = np.zeros((frames, skeleton.n_joints, 3))
    for side in ("left", "right"):
        rotations[:, skeleton.index(f"{side}_elbow"), 2] = np.linspace(0, 1, frames)
    root = np.tile([0.3, 1.0, 0.2], (frames, 1))
    joints = forward_kinematics(rotations, root, np.full(skeleton.n_joints, 0.25), skeleton).astype(
        np.float32
    )
    return Motion(
        joints=joints,
        rotations=rotations.astype(np.float32),
        root=joints[:, 0],
        fps=20,
        parents=skeleton.parents,
        joint_names=skeleton.joint_names,
        skeleton=skeleton.name,
    )


@pytest.mark.parametrize("source", sorted(SKELETONS))
@pytest.mark.parametrize("target", ["cmu", "humanact12"])
def test_clips_change_skeletons(source, target):
    motion, skeleton = posed(SKELETONS[source]), SKELETONS[target]
    joints = on_skeleton(motion, skeleton, np.full(skeleton.n_joints, 0.25))
    assert joints.shape == (6, skeleton.n_joints, 3)
    for name in ("pelvis", "left_elbow", "right_wrist", "left_ankle"):
        assert np.allclose(
            joints[:, skeleton.index(name)],
            motion.joints[:, SKELETONS[source].index(name)],
            atol=1e-6,
        )
    lengths = bone_lengths(joints, skeleton)[:, 1:]
    assert lengths.min() > 0.02
    assert np.allclose(lengths, lengths[:1], atol=0.02)
    assert np.abs(heading(joints, skeleton)).max() < 1e-5


def test_a_start_of_another_skeleton_is_continued(models):
    start = posed(HUMANACT12)
    futures = outpaint(models["flow"], start, "fast", frames=24, count=2)
    assert futures.skeleton == "cmu"
    assert np.allclose(
        futures.joints[:, 5, CMU.index("left_wrist")],
        start.joints[5, HUMANACT12.index("left_wrist")],
        atol=1e-5,
    )


def test_headings_turn_with_the_person():
    joints = posed(CMU).joints
    for angle in (-2.5, 0.3, 1.7):
        turn = np.array(
            [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        )
        assert np.allclose(heading(joints @ turn.T, CMU), angle, atol=1e-5)


def test_parts_of_the_body_are_scaled(model):
    plain = model.scaled_bones()
    parts = body_parts(CMU)
    legs = model.scaled_bones({"legs": 1.2, "left_elbow": 0.5})
    ratio = legs[1:] / plain[1:]
    expected = np.ones(20)
    expected[list(parts["legs"])] = 1.2
    expected[CMU.index("left_elbow")] = 0.5
    assert np.allclose(ratio, expected[1:])
    motion = model.sample("slow", frames=10, seed=1, bone_scale={"legs": 1.2, "left_elbow": 0.5})
    assert np.allclose(
        bone_lengths(motion.joints, CMU)[:, 1:], legs[1:] * model.card.meters_per_unit, atol=1e-5
    )
    assert set(parts["arms"]) | set(parts["legs"]) | set(parts["torso"]) | set(
        parts.get("head", ())
    ) == set(range(1, 20))
    with pytest.raises(InputError, match="no bone 'tail'"):
        model.scaled_bones({"tail": 2.0})
    with pytest.raises(InputError, match="bone_scale is 20"):
        model.scaled_bones(20)


def test_a_scaled_person_of_a_window_model_moves_in_proportion(models):
    one, large = (
        models["flow"].sample("fast", frames=47, seed=3, bone_scale=scale).joints
        for scale in (1, 1.5)
    )
    assert np.allclose(large, 1.5 * one, atol=1e-4)


def test_own_bones_replace_the_models(model):
    own = model.bone_lengths * np.linspace(0.8, 1.2, 20, dtype=np.float32)
    motion = model.sample("slow", frames=5, lengths=own)
    assert np.allclose(
        bone_lengths(motion.joints, CMU)[:, 1:], own[1:] * model.card.meters_per_unit, atol=1e-5
    )
    assert leg_length(own, CMU) != pytest.approx(float(leg_length(model.bone_lengths, CMU)))


def test_each_action_of_a_pattern(models):
    names = matching_actions(models["flow"], "*A*")
    assert names == ["fast"]
    clips = sample_each(models["flow"], ["slow", "fast"], frames=9, seed=2)
    assert clips.action == "slow|fast"
    for index, name in enumerate(("slow", "fast")):
        assert np.allclose(
            clips.joints[index], models["flow"].sample(name, frames=9, seed=2).joints
        )
    with pytest.raises(InputError, match="no action of 'flow' matches"):
        matching_actions(models["flow"], "swim*")


def test_a_generated_data_set_is_one_of_its_model(models):
    model = models["flow"]
    dataset = generated_dataset(model, clips=4, frames=12)
    assert (len(dataset), dataset.actions, dataset.skeleton.name, dataset.fps) == (
        8,
        ("slow", "fast"),
        "cmu",
        model.fps,
    )
    clip = dataset.motion(5)
    assert np.allclose(
        clip.joints, model.sample("fast", frames=12, count=4, seed=1).joints[1], atol=1e-5
    )
    assert clip.action == "fast"
    assert len(dataset.split(["S0"])[1]) == 4
    assert (
        dataset.sha256
        == generated_dataset(model, clips=4, frames=12).sha256
        != generated_dataset(model, clips=4, frames=12, seed=9).sha256
    )


SHIPPED = {
    "humanact12": ("walk", "run", "boxing", "throw"),
    "cmu": ("Walk", "Step", "Dance", "Wash"),
}


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_long_sequences_do_not_drift(name):
    """In 600 frames speed, height above the floor, uprightness and floor stay as in the first
    window."""
    model = MotionModel.load(name)
    window = model.card.window_frames
    head = model.skeleton.index("head")
    for action in SHIPPED[name]:
        joints = model.sample(action, frames=600, count=16, seed=1).joints
        speed = np.linalg.norm(np.diff(joints, axis=1), axis=-1).mean(axis=(0, 2))
        low = joints[..., 1].min(-1)
        tall = (joints[..., head, 1] - low).mean(0)
        trunk = joints[..., head, :] - joints[..., 0, :]
        upright = (trunk[..., 1] / np.linalg.norm(trunk, axis=-1)).mean(0)
        last = slice(600 - 2 * window, 600)
        assert 0.6 < speed[last].mean() / speed[:window].mean() < 1.5, action
        assert abs(tall[last].mean() - tall[:window].mean()) < 0.12, action
        assert abs(upright[last].mean() - upright[:window].mean()) < 0.08, action
        floor = np.abs(low[:, last].min(1) - low[:, :window].min(1))
        assert floor.mean() < 0.1, action
        assert np.linalg.norm(np.diff(joints, axis=1), axis=-1).max() * model.fps < 15, action

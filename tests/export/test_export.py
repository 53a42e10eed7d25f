"""ONNX agrees with PyTorch on the same noise, and `sample.py` works alone."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from a2v.errors import InputError
from a2v.kinematics import bone_lengths, forward_kinematics, skeleton_of
from a2v.lab.motion.networks import DECODERS, VAESettings
from a2v.lab.motion.training import TrainSettings, start
from a2v.lab.motion.vae import MotionVAE
from a2v.motion import MotionModel
from a2v.types import Motion
from export import sample as sample_script
from export.motion import cool, export_motion
from export.reread import exported_weights, write_start
from tests.support.motions import waving

SCRIPT = Path(sample_script.__file__)


SMALL = VAESettings(hidden_size=32, latent_size=6)
VARIANTS = [
    dataclasses.replace(SMALL, decoder="plain", roots="relative"),
    dataclasses.replace(SMALL, decoder="lie", prior="fixed"),
    dataclasses.replace(SMALL, decoder="glmi-m", roots="relative", root_rotation=True),
    dataclasses.replace(SMALL, decoder="glmi-r"),
]
"""Every decoder, kind of roots and prior; an export takes 4 to 10 s."""
assert {item.decoder for item in VARIANTS} == set(DECODERS)


@pytest.fixture(
    scope="module",
    params=VARIANTS,
    ids=lambda item: f"{item.decoder} {item.roots} {item.prior}",
)
def exported(request, tmp_path_factory):
    dataset = waving()
    torch.manual_seed(3)
    model = MotionVAE(dataset.skeleton, 2, request.param).eval()
    path = tmp_path_factory.mktemp("export") / f"{request.param.decoder}.onnx"
    export_motion(model, dataset, path, license="Apache-2.0")
    return model, MotionModel.load(path)


@pytest.mark.parametrize(("batch", "frames"), [(1, 1), (1, 60), (4, 23), (33, 5)])
def test_onnx_equals_pytorch_on_the_same_noise(exported, batch, frames):
    model, onnx_model = exported
    rng = np.random.default_rng(batch)
    noise = rng.standard_normal((batch, frames, 6), dtype=np.float32)
    actions = rng.integers(0, 2, (batch, frames))
    lengths = rng.uniform(0.1, 0.5, (batch, 20)).astype(np.float32)
    joints, _ = onnx_model.sampler.run(actions, noise=noise, lengths=lengths)
    expected = model.sample(
        torch.eye(2)[torch.from_numpy(actions)], torch.from_numpy(lengths), torch.from_numpy(noise)
    ).joints.numpy()
    assert np.abs(joints - expected).max() < 1e-4


@pytest.mark.parametrize("exported", [VARIANTS[-1]], indirect=True, ids=["glmi-r absolute learned"])
def test_an_export_gives_its_weights_back(exported, tmp_path):
    model, onnx_model = exported
    dataset, begun = waving(), MotionVAE(waving().skeleton, 2, model.settings)
    path = write_start(onnx_model.path, tmp_path, dataset, model.settings)
    weights = torch.load(path, weights_only=True)["model"]
    begun.load_state_dict(weights)
    for name, weight in model.state_dict().items():
        own = name.replace("posterior.", "prior.")  # an export has none: it begins as the prior
        assert torch.equal(weights[name], weight if own == name else model.state_dict()[own]), name
    settings = TrainSettings(initial=str(path), batch_size=2, threads=1, device="cpu")
    again = start(dataset, model.settings, settings).model.state_dict()
    assert all(torch.equal(again[name], weight) for name, weight in weights.items())
    other = dataclasses.replace(model.settings, hidden_size=16)
    with pytest.raises(InputError, match="has other layers than this training"):
        exported_weights(onnx_model.path, dataset, other)
    (tmp_path / "x.onnx").write_bytes(b"text")
    with pytest.raises(InputError, match="not a motion model"):
        exported_weights(tmp_path / "x.onnx", dataset, model.settings)


def test_the_loop_repeats_nothing_that_the_weights_alone_decide(exported):
    _, onnx_model = exported
    (scan,) = [node for node in onnx.load(onnx_model.path).graph.node if node.op_type == "Scan"]
    body = scan.attribute[[item.name for item in scan.attribute].index("body")].g
    varying = {item.name for item in body.input} | {"lengths"}
    for node in body.node:
        assert varying.intersection(node.input), (
            f"{node.op_type} of {list(node.input)} is the same for every frame"
        )
        varying.update(node.output)


@pytest.mark.parametrize("temperature", [0.5, 1.0])
def test_a_cooled_prior_takes_a_share_of_the_noise(exported, temperature):
    model, _ = exported
    rng = np.random.default_rng(0)
    noise, lengths = (
        torch.from_numpy(rng.standard_normal((3, 9, 6), dtype=np.float32)),
        torch.full((3, 20), 0.3),
    )
    actions = torch.eye(2)[torch.zeros(3, 9, dtype=torch.long)]
    with torch.no_grad():
        cold = cool(model, temperature).sample(actions, lengths, noise).joints
        scaled = model.sample(actions, lengths, noise * temperature).joints
    assert (cold - scaled).abs().max() < 1e-5
    with pytest.raises(InputError, match="temperature is 0"):
        cool(model, 0.0)


def test_frames_one_by_one_equal_the_whole_clip(exported):
    _, model = exported
    session = onnxruntime.InferenceSession(model.path)
    rng = np.random.default_rng(0)
    lengths = np.tile(model.bone_lengths, (2, 1))
    feed = {
        "noise": rng.standard_normal((2, 12, 6), dtype=np.float32),
        "actions": np.array([[0] * 12, [1] * 12]),
        "time": np.tile(np.linspace(0.1, 1, 12, dtype=np.float32), (2, 1)),
    }
    whole = session.run(
        ["joints"], model.sampler.initial_states(2) | feed | {"bone_lengths": lengths}
    )[0]
    states = model.sampler.initial_states(2)
    for t in range(12):
        names = ["joints", *(f"last_{name}" for name in states)]
        frame, *new = session.run(
            names,
            states | {k: v[:, t : t + 1] for k, v in feed.items()} | {"bone_lengths": lengths},
        )
        states = dict(zip(states, new, strict=True))
        assert np.abs(frame[:, 0] - whole[:, t]).max() < 1e-5


def test_sampled_motion_is_consistent(exported):
    _, model = exported
    motion = model.sample("slow", frames=15, count=3, seed=7)
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    again = forward_kinematics(
        motion.rotations, motion.root, bone_lengths(motion.joints, skeleton), skeleton
    )
    assert np.abs(again - motion.joints).max() < 1e-5
    assert np.allclose(motion.joints[..., 1].min(axis=(1, 2)), 0, atol=1e-6)
    assert np.allclose(motion.joints[:, 0, 0, [0, 2]], 0, atol=1e-6)
    assert np.array_equal(motion.joints, model.sample("slow", frames=15, count=3, seed=7).joints)
    assert not np.array_equal(
        motion.joints, model.sample("slow", frames=15, count=3, seed=8).joints
    )
    assert not np.array_equal(
        motion.joints, model.sample("fast", frames=15, count=3, seed=7).joints
    )


def test_a_transition_changes_the_action_on_the_way(exported):
    _, model = exported
    one, two = (
        model.sample("slow", frames=20, seed=1),
        model.sample(["slow", "fast"], frames=20, seed=1),
    )
    assert np.abs(one.joints - one.joints[0, 0] - two.joints + two.joints[0, 0])[:10].max() < 1e-5
    assert np.abs(one.joints - two.joints)[10:].max() > 1e-4
    assert two.action == "slow,fast"


def test_bone_scale_scales_the_bones(exported):
    model, onnx_model = exported
    if model.settings.decoder == "plain":
        pytest.skip("the plain decoder has no bone lengths to scale")
    skeleton = model.skeleton
    base, large = (
        bone_lengths(onnx_model.sample("slow", frames=5, bone_scale=s).joints, skeleton)
        for s in (1.0, 1.5)
    )
    assert np.allclose(large, 1.5 * base, atol=1e-5)


@pytest.mark.parametrize(
    ("action", "message"), [("slwo", "did you mean slow"), ("zzz", "it knows slow, fast")]
)
def test_unknown_actions_name_the_nearest(exported, action, message):
    with pytest.raises(InputError, match=message):
        exported[1].sample(action)


def test_foreign_files_are_refused(tmp_path):
    (tmp_path / "x.onnx").write_bytes(b"nonsense")
    with pytest.raises(InputError, match="not a motion model"):
        MotionModel.load(tmp_path / "x.onnx")
    with pytest.raises(InputError, match="not found"):
        MotionModel.load(tmp_path / "y.onnx")


def test_the_script_gives_the_same_motion_and_needs_nothing_of_the_project(exported, tmp_path):
    _, model = exported
    code = "import sys, sample; code = sample.main(sys.argv[1:]); bad = {'torch', 'a2v', 'scipy'} & set(sys.modules); sys.exit(9 if bad else code)"
    command = [
        sys.executable,
        "-c",
        code,
        str(model.path),
        "--action",
        "fast",
        "--frames",
        "9",
        "--count",
        "2",
        "--seed",
        "4",
        "--out",
        "m.npz",
    ]
    subprocess.run(
        command, cwd=tmp_path, check=True, env={"PYTHONPATH": str(SCRIPT.parent), "PATH": ""}
    )
    written, expected = (
        Motion.load(tmp_path / "m.npz"),
        model.sample("fast", frames=9, count=2, seed=4),
    )
    assert np.abs(written.joints - expected.joints).max() < 1e-6
    assert (written.action, written.seed, written.joint_names) == ("fast", 4, expected.joint_names)


def test_the_script_writes_bvh_whose_joints_are_the_motion(exported, tmp_path):
    from a2v.formats.bvh import read_bvh

    _, model = exported
    assert (
        sample_script.main(
            [str(model.path), "--action", "slow", "--frames", "6", "--out", str(tmp_path / "m.bvh")]
        )
        == 0
    )
    motion, expected = read_bvh(tmp_path / "m.bvh"), model.sample("slow", frames=6)
    assert set(motion.joint_names) == set(expected.joint_names)
    order = [motion.joint_names.index(name) for name in expected.joint_names]
    got, want = motion.joints[:, order], expected.joints
    bones_change = model.card.decoder == "plain"  # a BVH has one set of offsets
    assert (
        np.abs((got - got[0, 0]) - (want - want[0, 0]))[: 1 if bones_change else None].max() < 1e-3
    )
    assert motion.fps == pytest.approx(expected.fps)


def test_the_script_explains_itself(exported, capsys, tmp_path):
    _, model = exported
    assert sample_script.main([str(model.path)]) == 0
    assert "slow" in capsys.readouterr().out
    assert sample_script.main([str(model.path), "--action", "slwo", "--out", "x.npz"]) == 2
    assert "did you mean slow" in capsys.readouterr().err
    assert sample_script.main([str(tmp_path / "none.onnx")]) == 2
    assert json.dumps(
        sample_script.Model(model.path).metadata
    )  # plain JSON, so any language reads it

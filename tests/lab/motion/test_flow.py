"""The window flow: its code, its training, its export, and windows that continue one another."""

from __future__ import annotations

import dataclasses
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.kinematics import CMU, bone_lengths
from a2v.kinematics.ground import face_forward
from a2v.lab.datasets import ClipSampler
from a2v.lab.motion.flow import GUIDANCE, FlowModel, FlowNetwork, FlowSettings, Modulation
from a2v.lab.motion.flow_training import WindowPool, train_flow
from a2v.lab.motion.windows import CodecSettings, LinearCode, WindowCodec, foot_metric
from a2v.motion import MotionModel
from a2v.motion.features import ROOT_WEIGHT, window_features
from a2v.motion.steer import SoftConstraint, steer
from export import sample as sample_script
from export.flow import Sampling, WindowGraph, export_flow
from export.storage import round_to_stored
from tests.support.flows import SMALL
from tests.support.motions import waving


@pytest.fixture(scope="module")
def data():
    return waving(clips=8, frames=40)


@pytest.fixture(scope="module")
def codec(data):
    return WindowCodec.fit(
        data, CodecSettings(size=12, context_size=5, context_frames=4), windows=300
    )


@pytest.fixture(scope="module")
def exported(data, codec, tmp_path_factory):
    torch.manual_seed(0)
    network = FlowNetwork(2, SMALL)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(torch.randn_like(parameter) * 0.05)
    model = FlowModel(network.eval(), codec)
    path = tmp_path_factory.mktemp("flow") / "flow.onnx"
    export_flow(model, data, path, license="Apache-2.0", sampling=Sampling(steps=2))
    return model, MotionModel.load(path)


@pytest.fixture(scope="module")
def wide(data, tmp_path_factory):
    """A wide flow whose windows face forward, its weights before its export, and its file."""
    folder = tmp_path_factory.mktemp("wide")
    settings = dataclasses.replace(SMALL, iterations=3, face_forward=True, balance=0.5)
    codec = train_flow(data, folder, settings=settings).codec
    torch.manual_seed(0)
    network = FlowNetwork(2, dataclasses.replace(settings, width=192))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(torch.randn_like(parameter) * 0.05)
    model = FlowModel(network.eval(), codec)
    before = [parameter.clone() for parameter in network.parameters()]
    export_flow(
        model,
        data,
        folder / "wide.onnx",
        license="Apache-2.0",
        sampling=Sampling(steps=2, guidance=GUIDANCE, guided_until=0.5, temperature=0.8),
    )
    return model, before, folder / "wide.onnx"


def test_features_do_not_depend_on_bone_lengths(data):
    joints = data.joints[0][:20] - data.joints[0][0, 0]
    root = joints[:, :1]
    larger = (joints - root) * 1.3 + root
    assert np.allclose(
        window_features(joints, data.skeleton), window_features(larger, data.skeleton), atol=1e-5
    )


def test_the_code_is_a_whitened_projection():
    rng = np.random.default_rng(0)
    features = (rng.normal(size=(500, 6)) * np.array([5, 3, 1, 0.5, 0.1, 0.01])) @ np.linalg.qr(
        rng.normal(size=(40, 6))
    )[0].T + 7
    for size in (6, 20):  # the Krylov and the dense solver
        code = LinearCode.fit(features.astype(np.float32), size)
        assert np.allclose(code.basis @ code.basis.T, np.eye(size), atol=1e-4)
    code = LinearCode.fit(features.astype(np.float32), 6)
    encoded = code.encode(features)
    assert np.allclose(np.cov(encoded[:, :4], rowvar=False), np.eye(4), atol=0.02)
    assert np.allclose(code.decode(encoded), features, atol=1e-3)


def test_the_foot_metric_is_the_sum_of_squares_it_states():
    """Besides the features, the code has the squares of the feet's places and steps.

    They are found joint by joint along the path to the root.
    """
    rng = np.random.default_rng(0)
    skeleton, frames = CMU, 4
    lengths = rng.uniform(0.1, 0.5, skeleton.n_joints)
    features = rng.normal(size=(frames, skeleton.n_joints, 3))
    joints = np.zeros_like(features)
    joints[:, 0] = features[:, 0] / ROOT_WEIGHT
    for joint in range(1, skeleton.n_joints):
        joints[:, joint] = joints[:, skeleton.parents[joint]] + features[:, joint] * lengths[joint]
    feet = joints[:, list(skeleton.feet)] / lengths[1:].mean()
    expected = (features**2).sum() + 2 * (feet**2).sum() + 5 * (np.diff(feet, axis=0) ** 2).sum()
    flat = features.ravel()
    assert flat @ foot_metric(skeleton, lengths, frames, place=2, step=5) @ flat == pytest.approx(
        expected
    )
    assert np.array_equal(
        foot_metric(skeleton, lengths, frames, place=0, step=0), np.eye(flat.size)
    )


def test_a_code_under_a_metric_is_the_best_in_it():
    rng = np.random.default_rng(1)
    features = rng.normal(size=(300, 20)) * np.linspace(2, 0.2, 20) + 3
    mixing = rng.normal(size=(20, 20))
    metric = mixing @ mixing.T + np.eye(20)
    plain, code = LinearCode.fit(features, 8), LinearCode.fit(features, 8, metric)
    assert np.allclose(code.basis @ metric @ code.basis.T, np.eye(8), atol=1e-4)
    encoded = code.encode(features)
    assert np.allclose(np.cov(encoded, rowvar=False), np.eye(8), atol=0.02)
    assert np.allclose(code.encode(code.decode(encoded)), encoded, atol=1e-3)

    def left_out(fitted: LinearCode, under: np.ndarray) -> float:
        missed = fitted.decode(fitted.encode(features)) - features
        return float(np.einsum("mi,ij,mj->", missed, under, missed))

    assert left_out(code, metric) < 0.9 * left_out(plain, metric)
    assert left_out(plain, np.eye(20)) < 0.9 * left_out(code, np.eye(20))


def test_a_code_cannot_be_larger_than_its_data():
    with pytest.raises(InputError, match="code of 50"):
        LinearCode.fit(np.zeros((20, 100), np.float32), 50)


def test_the_flow_learns_to_make_the_data(data, tmp_path):
    rows = []
    settings = dataclasses.replace(SMALL, iterations=400)
    model = train_flow(data, tmp_path, settings=settings, on_log=lambda _, row: rows.append(row))
    assert rows[-1]["loss"] < 0.65 * rows[0]["loss"]
    n = 400
    zeros = torch.zeros(n)
    with torch.no_grad():
        condition = model.network.condition(
            torch.ones(n, dtype=torch.int64), zeros + 1, torch.zeros(n, 5), zeros
        )
        without = model.network.condition(torch.full((n,), 2), zeros + 1, torch.zeros(n, 5), zeros)
        noise = torch.randn(n, 12, generator=torch.Generator().manual_seed(0))
        made, pushed = (
            model.network.integrate(noise, condition, without, steps=8, guidance=g).numpy()
            for g in (1.0, 2.0)
        )
    codes, labels, _, _ = WindowPool(data, model.codec).draw(600, np.random.default_rng(0))
    real, other = (codes.numpy()[labels.numpy() == label] for label in (1, 0))
    distance = [
        np.linalg.norm(made[:, None] - set_[None], axis=-1).min(1).mean() for set_ in (real, other)
    ]
    assert distance[0] < 0.7 * distance[1]
    # guidance moves away from the other action
    away = [
        np.linalg.norm(made_[:, None] - other[None], axis=-1).min(1).mean()
        for made_ in (made, pushed)
    ]
    assert away[1] > 1.05 * away[0]


def test_guidance_extrapolates_from_no_action():
    torch.manual_seed(0)
    network = FlowNetwork(3, SMALL)
    with torch.no_grad():
        for (
            parameter
        ) in network.parameters():  # the zeros that it starts from would hide the condition
            parameter.add_(torch.randn_like(parameter) * 0.1)
    point = torch.randn(4, 12)
    shape = (torch.ones(4), torch.zeros(4, 5), torch.zeros(4))
    known, without = (network.condition(torch.full((4,), label), *shape) for label in (1, 3))

    def pushed(at: torch.Tensor, time: float, guidance: float) -> torch.Tensor:
        with_action, free = (
            network(at, torch.full((4,), time), condition) for condition in (known, without)
        )
        return free + guidance * (with_action - free)

    def stepped(guidance: float) -> torch.Tensor:
        return point + pushed(point + 0.5 * pushed(point, 0.0, guidance), 0.5, guidance)

    assert not torch.allclose(stepped(1.0), stepped(2.5), atol=1e-3)
    for guidance in (0.0, 1.0, 2.5):
        assert torch.allclose(
            network.integrate(point, known, without, steps=1, guidance=guidance),
            stepped(guidance),
            atol=1e-5,
        )


def test_the_integration_is_of_second_order():
    """Half the steps give four times the error, on a velocity with a known path."""
    network = FlowNetwork(1, SMALL)
    network.modulations = lambda time, condition: [Modulation(time[:, None], condition, condition)]  # type: ignore[method-assign]
    calls = []

    def velocity(point: torch.Tensor, by: list[Modulation]) -> torch.Tensor:
        calls.append(1)
        return point * torch.cos(3 * by[0].scale)

    network.velocity = velocity  # type: ignore[method-assign,assignment]
    noise = torch.linspace(-2, 2, 12).double()[None]
    exact = noise * np.exp(np.sin(3) / 3)
    nothing = torch.zeros(1, 32)
    errors = [
        float((network.integrate(noise, nothing, nothing, steps=steps) - exact).abs().max())
        for steps in (16, 32, 64)
    ]
    for coarse, fine in pairwise(errors):
        assert coarse / fine == pytest.approx(4, rel=0.15)
    calls.clear()
    network.integrate(noise, nothing, nothing, steps=7)
    assert len(calls) == 8


def test_guidance_ends_where_it_is_told_to():
    network = FlowNetwork(1, SMALL)
    rows = []
    network.velocity = lambda point, by: rows.append(len(point)) or point  # type: ignore[method-assign,assignment]
    nothing = torch.zeros(1, 32)
    for until in (0.6, 1.0, 0.0):
        network.integrate(
            torch.ones(1, 12), nothing, nothing, steps=5, guidance=3.0, guided_until=until
        )
    # with and without the action: two rows; the first step has two evaluations; steps start at 0,
    # .2, .4, .6, .8
    assert rows == [2, 2, 2, 2, 1, 1] + [2] * 6 + [1] * 6


class Killed(Exception):
    pass


def test_half_precision_learns_like_full(data, tmp_path):
    """With bfloat16 products and the same draws the losses stay close, and weights stay float32."""
    final = {}
    for half in (False, True):
        rows = []
        settings = dataclasses.replace(SMALL, iterations=150, half=half)
        model = train_flow(
            data,
            tmp_path / str(half),
            settings=settings,
            on_log=lambda _, row, rows=rows: rows.append(row["loss"]),
        )
        final[half] = np.mean(rows[-5:])
        assert all(parameter.dtype == torch.float32 for parameter in model.network.parameters())
    assert final[True] == pytest.approx(final[False], rel=0.03)
    assert final[True] != final[False]


def test_a_killed_run_resumes_to_the_same_weights(data, tmp_path):
    whole = train_flow(data, tmp_path / "whole", settings=SMALL)

    def kill(_model, row):
        if row["iteration"] == 30:
            raise Killed

    with pytest.raises(Killed):
        train_flow(data, tmp_path / "parts", settings=SMALL, on_log=kill)

    resumed = train_flow(data, tmp_path / "parts", settings=SMALL)
    for a, b in zip(whole.network.parameters(), resumed.network.parameters(), strict=True):
        assert torch.equal(a, b)


def test_a_run_goes_on_under_another_code(data, tmp_path):
    """After a change to a code with better feet, the weights map the same noise to similar windows."""
    settings = dataclasses.replace(SMALL, iterations=200, foot_place=0.0, foot_step=0.0)
    first = train_flow(data, tmp_path / "first", settings=settings)
    assert np.array_equal(first.codec.window.basis, first.codec.window.encoder)
    initial = str(tmp_path / "first" / "flow.pt")
    other = dataclasses.replace(
        SMALL, foot_step=4.0, iterations=1, learning_rate=1e-9, initial=initial
    )
    second = train_flow(data, tmp_path / "second", settings=other)
    untrained = train_flow(
        data, tmp_path / "third", settings=dataclasses.replace(other, initial="")
    )
    for name in ("mean", "basis"):
        assert np.array_equal(
            getattr(first.codec.context, name), getattr(second.codec.context, name)
        )

    def windows(model: FlowModel, noise: torch.Tensor) -> np.ndarray:
        n, zeros = len(noise), torch.zeros(len(noise))
        with torch.no_grad():
            condition = model.network.condition(
                torch.ones(n, dtype=torch.int64), zeros + 1, torch.zeros(n, 5), zeros
            )
            return model.codec.window.decode(
                model.network.integrate(noise, condition, condition, steps=8).numpy()
            )

    turn = first.codec.window.rotation_to(second.codec.window)
    noise = torch.randn(50, 12, generator=torch.Generator().manual_seed(0))
    made = windows(first, noise)
    varied = np.linalg.norm(made - made.mean(0), axis=1).mean()
    missed = [
        np.linalg.norm(windows(model, noise @ torch.from_numpy(turn)) - made, axis=1).mean()
        for model in (second, untrained)
    ]
    assert missed[0] < 0.2 * varied < 0.5 * missed[1]
    with pytest.raises(InputError, match="other sizes"):
        train_flow(data, tmp_path / "fourth", settings=dataclasses.replace(other, width=16))


def test_onnx_equals_pytorch(exported, data):
    model, onnx_model = exported
    graph = WindowGraph(model, data, steps=2, guidance=GUIDANCE).eval()
    round_to_stored(graph)
    rng = np.random.default_rng(1)
    for batch in (1, 5):
        windows = ClipSampler(data, 20).windows(rng.integers(0, 8, batch), rng)
        inputs = (
            rng.standard_normal((batch, 12), dtype=np.float32),
            rng.integers(0, 2, batch),
            rng.random(batch, dtype=np.float32),
            windows[:, -4:],
            rng.uniform(0.1, 0.4, (batch, 20)).astype(np.float32),
        )
        noise, labels, active, context, lengths = inputs
        joints, rotations = onnx_model.sampler.run(
            labels, active=active, noise=noise, lengths=lengths, context=context
        )
        with torch.no_grad():
            expected = graph(
                *(
                    torch.from_numpy(x)
                    for x in (noise, labels, active, context, np.ones(batch, np.float32), lengths)
                )
            )
        assert np.abs(joints - expected[0].numpy()).max() < 1e-4
        assert np.abs(rotations - expected[1].numpy()).max() < 1e-3
        assert (
            np.abs(bone_lengths(joints, data.skeleton)[..., 1:] - lengths[:, None, 1:]).max() < 1e-5
        )


def test_wishes_are_met_by_the_graph_as_by_pytorch(exported, data):
    model, onnx_model = exported
    graph = WindowGraph(model, data, steps=2, guidance=GUIDANCE).eval()
    round_to_stored(graph)
    rng = np.random.default_rng(3)
    noise, lengths = (
        rng.standard_normal((2, 12), dtype=np.float32),
        rng.uniform(0.1, 0.4, (2, 20)).astype(np.float32),
    )
    wrist = data.skeleton.joint_names.index("left_wrist")
    rows, offset = onnx_model.sampler.reader(lengths[0]).joints(np.array([10, 19]), [wrist])
    wanted = rows @ rng.standard_normal(12) + offset  # where some other window has it
    steering = steer([SoftConstraint.of(rows, offset, wanted, 1e-4)])
    labels, active = np.array([0, 1]), np.ones(2, np.float32)
    joints, _ = onnx_model.sampler.run(
        labels, active=active, noise=noise, lengths=lengths, steering=steering
    )
    with torch.no_grad():
        arguments = (
            noise,
            labels,
            active,
            np.zeros((2, 4, 20, 3), np.float32),
            np.zeros(2, np.float32),
            lengths,
        )
        expected, _ = graph(
            *map(torch.from_numpy, (*arguments, steering.measure, steering.gain, steering.goal))
        )
    assert np.abs(joints - expected.numpy()).max() < 1e-4
    free, _ = onnx_model.sampler.run(labels, active=active, noise=noise, lengths=lengths)
    missed, before = (
        np.linalg.norm(
            made[0, [10, 19], wrist] - made[0, [10, 19], 0] - wanted[:, 0], axis=-1
        ).max()
        for made in (joints, free)
    )
    assert missed < 0.3 * before


def test_windows_that_face_forward_are_continued_in_any_heading(data, wide):
    sampler = MotionModel.load(wide[2]).sampler
    rng = np.random.default_rng(0)
    noise, lengths = rng.standard_normal((1, 12), dtype=np.float32), data.clip_bone_lengths[:1]
    context = data.joints[0][None, 10:14]
    turn = np.array([[np.cos(1.1), -np.sin(1.1)]])
    made = [
        sampler.run(np.array([0]), active=np.ones(1), noise=noise, lengths=lengths, context=given)[
            0
        ]
        for given in (context, face_forward(context, turn))
    ]
    assert np.abs(face_forward(made[0].astype(np.float64), turn) - made[1]).max() < 1e-4
    assert np.abs(made[0] - made[1]).max() > 0.01
    free = sampler.run(np.array([0]), active=np.ones(1), noise=noise, lengths=lengths)[0]
    assert len(sampler.card.headings) == len(data.actions)
    assert np.isfinite(free).all()


def test_traits_let_actions_share_what_they_learn(data):
    torch.manual_seed(0)
    network = FlowNetwork(2, SMALL, (("kind:a", "style:x"), ("kind:a",)))
    alone = FlowNetwork(2, SMALL)
    assert network.trait is not None
    assert alone.trait is None
    arguments = (torch.ones(3), torch.zeros(3, SMALL.context_size), torch.zeros(3))
    before = network.condition(torch.tensor([0, 1, 2]), *arguments)
    with torch.no_grad():
        network.trait[0] += 1  # "kind:a"
    moved = (network.condition(torch.tensor([0, 1, 2]), *arguments) - before).abs().amax(1)
    assert (moved[:2] > 0.5).all()
    assert moved[2] == 0


def test_matrices_are_stored_as_bytes(data, wide, tmp_path):
    """A wide network takes a third of the float32 size and equals PyTorch with rounded weights."""
    model, before, path = wide
    network = model.network
    with pytest.raises(InputError, match="temperature is 0"):
        export_flow(
            model,
            data,
            tmp_path / "cold.onnx",
            license="Apache-2.0",
            sampling=Sampling(temperature=0.0),
        )
    size = 4 * sum(parameter.numel() for parameter in network.parameters())
    stored = path.read_bytes()
    assert len(stored) < 0.7 * size  # with a graph of 1,100 nodes
    assert str(Path(__file__).parents[2]).encode() not in stored, "paths of this machine"
    moved = [
        float((a - b).norm() / b.norm()) for a, b in zip(network.parameters(), before, strict=True)
    ]
    assert 1e-4 < max(moved) < 0.015
    graph = WindowGraph(model, data, steps=2, guidance=GUIDANCE, guided_until=0.5).eval()
    round_to_stored(graph)
    rng = np.random.default_rng(1)
    noise, lengths = (
        rng.standard_normal((3, 12), dtype=np.float32),
        rng.uniform(0.1, 0.4, (3, 20)).astype(np.float32),
    )
    labels, active = np.array([0, 1, 1]), np.ones(3, np.float32)
    joints, _ = MotionModel.load(path).sampler.run(
        labels, active=active, noise=noise, lengths=lengths
    )
    with torch.no_grad():
        nothing = torch.zeros(3, 4, 20, 3)
        expected, _ = graph(
            *(torch.from_numpy(x) for x in (np.float32(0.8) * noise, labels, active)),
            nothing,
            torch.zeros(3),
            torch.from_numpy(lengths),
        )
    assert np.abs(joints - expected.numpy()).max() < 1e-4


def test_a_window_repeats_the_frames_it_continues(exported, data):
    _, model = exported
    rng = np.random.default_rng(2)
    context = data.joints[0][None, 10:14]
    lengths = data.clip_bone_lengths[:1]
    joints, _ = model.sampler.run(
        np.array([0]),
        active=np.ones(1),
        noise=rng.standard_normal((1, 12)),
        lengths=lengths,
        context=context,
    )
    assert np.abs(joints[:, :4] - (context - context[:, :1, :1])).max() < 2e-3
    step = np.linalg.norm(np.diff(joints[0], axis=0), axis=-1).max(axis=1)
    assert step[3] < 3 * np.median(step) + 0.02


@pytest.mark.parametrize("frames", [5, 20, 47])
def test_motions_of_any_length_without_jumps(exported, frames):
    _, model = exported
    motion = model.sample("slow", frames=frames, count=2, seed=3)
    assert motion.joints.shape[:2] == (2, frames)
    steps = np.linalg.norm(np.diff(motion.joints, axis=1), axis=-1).max(axis=-1)
    if frames > 20:
        inside = np.delete(steps, np.arange(15, steps.shape[1], 16)[: steps.shape[1] // 16], axis=1)
        assert steps.max() < 2 * inside.max() + 1e-6
    assert np.array_equal(
        motion.joints, model.sample("slow", frames=frames, count=2, seed=3).joints
    )


def test_how_long_a_clip_moves_is_drawn_from_the_datas_lengths(exported):
    _, model = exported
    noise = np.random.default_rng(0).standard_normal((4000, model.card.latent_size))
    label = model.label("slow")
    drawn = model.sampler.drawn_shares(np.full(4000, label), noise, following=False)
    known, counts = np.unique(model.card.active[label].astype(np.float32), return_counts=True)
    found, seen = np.unique(drawn, return_counts=True)
    np.testing.assert_array_equal(found, known)
    np.testing.assert_allclose(seen / 4000, counts / counts.sum(), atol=0.03)
    assert (
        model.sampler.drawn_shares(np.full(4000, label), noise, following=True).min()
        >= np.median(known) - 1e-6
    )


def test_clips_of_a_batch_go_on_each_by_itself(exported):
    _, model = exported
    motion = model.sample("slow", frames=45, count=8, seed=1)
    assert np.isfinite(motion.joints).all()
    assert (np.abs(motion.joints[:, 40:]).max(axis=(1, 2, 3)) > 0.1).all()


def test_a_transition_goes_on_from_the_first_action(exported):
    _, model = exported
    one, two = (
        model.sample("slow", frames=20, seed=1),
        model.sample(["slow", "fast"], frames=20, seed=1),
    )
    assert np.abs(one.joints - one.joints[0, 0] - two.joints + two.joints[0, 0])[:10].max() < 1e-5
    assert np.abs(one.joints - two.joints)[10:].max() > 1e-3


def test_the_script_gives_the_same_motion(exported):
    _, model = exported
    made = sample_script.Model(model.path).sample("slow,fast", frames=33, count=2, seed=5)
    expected = model.sample(["slow", "fast"], frames=33, count=2, seed=5)
    assert np.abs(made["joints"] - expected.joints).max() < 1e-5
    assert np.abs(made["rotations"] - expected.rotations).max() < 1e-5


def test_impossible_settings_are_refused():
    with pytest.raises(InputError, match="must be positive"):
        FlowSettings(blocks=0)

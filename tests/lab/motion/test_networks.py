"""The VAE: the paper's sizes, parallel pass against step loop, losses against closed forms."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import torch
from torch.distributions import Normal, kl_divergence

from a2v.kinematics import HUMANACT12, SKELETONS, bone_lengths
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.lab.motion.losses import gaussian_kl, vae_losses
from a2v.lab.motion.networks import DECODERS, Pose, VAESettings
from a2v.lab.motion.vae import MotionVAE, Reconstruction, States, shifted

VARIANTS = [VAESettings(decoder=name) for name in DECODERS]
VARIANTS += [VAESettings(decoder=name, roots="relative") for name in DECODERS]
VARIANTS += [
    VAESettings(decoder=name, roots="relative", root_rotation=True)
    for name in DECODERS
    if name != "plain"
]
VARIANTS += [
    VAESettings(decoder="lie", root_rotation=True),
    VAESettings(decoder="lie", prior="fixed"),
]
"""The four decoders, with and without the journal's additions."""


def variant_name(settings):
    return " ".join(
        [
            settings.decoder,
            *["relative"] * settings.relative,
            *["W0"] * settings.root_rotation,
            *["N(0, I)"] * (settings.prior == "fixed"),
        ]
    )


every_variant = pytest.mark.parametrize("settings", VARIANTS, ids=variant_name)


def parameters(module):
    return sum(p.numel() for p in module.parameters())


def inputs(skeleton=HUMANACT12, batch=3, frames=9, actions=12, latent=30, seed=0):
    g = torch.Generator().manual_seed(seed)
    joints = torch.randn(batch, frames, skeleton.n_joints, 3, generator=g) * 0.3
    joints = joints - joints[:, :1, :1]
    onehot = torch.eye(actions)[torch.randint(0, actions, (batch,), generator=g)]
    lengths = torch.rand(batch, skeleton.n_joints, generator=g)
    noise = torch.randn(batch, frames, latent, generator=g)
    return joints, onehot, lengths, noise


def test_sizes_of_table_3():
    model = MotionVAE(HUMANACT12, 12, VAESettings(decoder="lie"))
    assert parameters(model.posterior) == parameters(model.prior) == 117_820
    assert parameters(model.generator) + parameters(model.pose_decoder) == 227_110
    assert model.posterior.encoder.in_features == model.prior.encoder.in_features == 85
    assert model.generator.encoder.in_features == 115


def seen(pose, model):
    """A pose (B, J, 3) as prior and generator see it, flat."""
    return (pose - pose[:, :1] if model.settings.roots == "relative" else pose).flatten(1)


def seen_by_posterior(joints, model):
    """Poses (B, T, J, 3) as the posterior sees them, flat."""
    if model.settings.roots == "absolute":
        return joints.flatten(2)
    told = joints - joints[:, :, :1]
    told[:, 1:, 0] = joints[:, 1:, 0] - joints[:, :-1, 0]
    told[:, 0, 0] = joints[:, 0, 0]
    return told.flatten(2)


@every_variant
@pytest.mark.parametrize("name", ["humanact12", "cmu", "ntu_vibe"])
def test_the_parallel_pass_equals_a_loop_over_frames(settings, name):
    skeleton = SKELETONS[name]
    torch.manual_seed(0)
    model = MotionVAE(skeleton, 12, settings).double()
    joints, actions, lengths, noise = (x.double() for x in inputs(skeleton))
    previous = shifted(joints)
    parallel = model.reconstruct(joints, actions, lengths, noise)
    states = model.initial_states(3)
    latent = parallel.posterior_mean + torch.exp(0.5 * parallel.posterior_logvar) * noise
    for t in range(joints.shape[1]):
        counter = torch.full((3, 1), (t + 1) / joints.shape[1], dtype=torch.float64)
        context = torch.cat([seen(previous[:, t], model), actions, counter], -1)[:, None]
        mean, logvar, prior = model.prior(context, states.prior)
        assert torch.allclose(mean[:, 0], parallel.prior_mean[:, t], atol=1e-12)
        assert torch.allclose(logvar[:, 0], parallel.prior_logvar[:, t], atol=1e-12)
        outputs, generator = model.generator(
            torch.cat([context, latent[:, t : t + 1]], -1), states.generator
        )
        pose = model.pose_decoder(outputs, previous[:, t : t + 1], lengths, states.trajectory)
        assert torch.allclose(pose.joints[:, 0], parallel.pose.joints[:, t], atol=1e-12)
        states = states._replace(
            prior=prior,
            generator=generator,
            trajectory=states.trajectory if pose.state is None else pose.state,
        )


@every_variant
def test_the_loop_is_a_fixed_point_of_the_parallel_pass(settings):
    """Given the poses that the loop fed back, the parallel pass gives exactly these poses."""
    torch.manual_seed(0)
    model = MotionVAE(HUMANACT12, 12, settings).double()
    joints, actions, lengths, noise = (x.double() for x in inputs())
    own = model.reconstruct(joints, actions, lengths, noise, torch.zeros(3, dtype=torch.bool))
    latent = own.posterior_mean + torch.exp(0.5 * own.posterior_logvar) * noise
    again = model.decode(
        shifted(own.pose.joints), model.condition(actions, joints.shape[1]), latent, lengths
    )
    assert torch.allclose(again.joints, own.pose.joints, atol=1e-10)


@pytest.mark.parametrize("decoder", DECODERS)
def test_teacher_forcing_is_per_sequence(decoder):
    torch.manual_seed(0)
    model = MotionVAE(HUMANACT12, 12, VAESettings(decoder=decoder)).double()
    joints, actions, lengths, noise = (x.double() for x in inputs())
    teacher = torch.tensor([False, True, False])
    every = torch.ones(3, dtype=torch.bool)
    mixed, forced, own = (
        model.reconstruct(joints, actions, lengths, noise, mask)
        for mask in (teacher, every, ~every)
    )
    assert not torch.allclose(forced.pose.joints, own.pose.joints, atol=1e-4)
    for row, expected in zip(range(3), (own, forced, own), strict=True):
        for a, b in zip(
            (mixed.pose.joints, mixed.prior_mean),
            (expected.pose.joints, expected.prior_mean),
            strict=True,
        ):
            assert torch.allclose(a[row], b[row], atol=1e-10)


def reconstruct_frame_by_frame(model, joints, actions, lengths, noise, teacher):
    """Compute `reconstruct` as one loop with autograd."""
    condition = model.condition(actions, joints.shape[1])
    mean, logvar, _ = model.posterior(torch.cat([seen_by_posterior(joints, model), condition], -1))
    latent = mean + torch.exp(0.5 * logvar) * noise
    states, previous = model.initial_states(len(joints)), torch.zeros_like(joints[:, 0])
    poses, priors, before = [], [], []
    for t in range(joints.shape[1]):
        context = torch.cat([seen(previous, model), condition[:, t]], -1)[:, None]
        prior_mean, prior_logvar, prior = model.prior(context, states.prior)
        outputs, generator = model.generator(
            torch.cat([context, latent[:, t : t + 1]], -1), states.generator
        )
        pose = model.pose_decoder(outputs, previous[:, None], lengths, states.trajectory)
        states = States(prior, generator, states.trajectory if pose.state is None else pose.state)
        poses.append(pose)
        before.append(previous)
        priors.append((prior_mean, prior_logvar))
        previous = torch.where(teacher[:, None, None], joints[:, t], pose.joints[:, 0])
    velocity = (
        None if poses[0].velocity is None else torch.cat([pose.velocity for pose in poses], 1)
    )
    pose = Pose(torch.cat([pose.joints for pose in poses], 1), None, velocity, None)
    return Reconstruction(
        pose,
        mean,
        logvar,
        *(torch.cat(parts, 1) for parts in zip(*priors, strict=True)),
        torch.stack(before, 1),
    )


@pytest.mark.parametrize("name", ["humanact12", "cmu"])
@every_variant
def test_gradients_flow_through_the_feedback(settings, name):
    """All gradients of Eq. 12 equal those of autograd through a loop over frames.

    Some sequences are fed their own poses.
    """
    torch.manual_seed(0)
    skeleton = SKELETONS[name]
    model = MotionVAE(skeleton, 12, settings).double()
    joints, actions, lengths, noise = (x.double() for x in inputs(skeleton, batch=4, frames=12))
    teacher = torch.tensor([False, True, False, False])
    gradients = []
    for reconstruct in (model.reconstruct, functools.partial(reconstruct_frame_by_frame, model)):
        model.zero_grad()
        losses = vae_losses(
            reconstruct(joints, actions, lengths, noise, teacher), joints, roots=settings.roots
        )
        (losses.reconstruction + 0.5 * losses.kl + 3 * losses.alignment).backward()
        gradients.append(
            {key: parameter.grad.clone() for key, parameter in model.named_parameters()}
            | {"loss": losses.reconstruction.detach()}
        )
    ours, expected = gradients
    for key, value in expected.items():
        assert value.abs().max() > 0, key
        assert torch.allclose(ours[key], value, rtol=1e-8, atol=1e-9 * float(value.abs().max())), (
            key
        )


def test_the_feedbacks_gradient_is_a_difference_quotient():
    """The derivative of the loss by a weight is exact through all 20 poses that are fed back."""
    torch.manual_seed(0)
    model = MotionVAE(HUMANACT12, 12, VAESettings()).double()
    joints, actions, lengths, noise = (x.double() for x in inputs(frames=20))
    teacher = torch.zeros(3, dtype=torch.bool)

    def loss() -> torch.Tensor:
        return vae_losses(
            model.reconstruct(joints, actions, lengths, noise, teacher),
            joints,
            reconstruction="mse",
        ).reconstruction

    weight = model.generator.encoder.weight
    loss().backward()
    assert weight.grad is not None
    place = divmod(
        int(weight.grad[:, 3:72].abs().argmax()), 69
    )  # a weight that sees the pose fed back
    expected = weight.grad[place[0], place[1] + 3].item()
    values = []
    for sign in (1, -1):
        with torch.no_grad():
            weight[place[0], place[1] + 3] += sign * 1e-5
            values.append(loss().item())
            weight[place[0], place[1] + 3] -= sign * 1e-5
    assert (values[0] - values[1]) / 2e-5 == pytest.approx(expected, rel=1e-5)


def test_without_feedback_the_gradient_is_another_one():
    """With given poses the derivative differs, so the test above can tell them apart."""
    torch.manual_seed(0)
    model = MotionVAE(HUMANACT12, 12, VAESettings()).double()
    joints, actions, lengths, noise = (x.double() for x in inputs(frames=20))
    result = model.reconstruct(joints, actions, lengths, noise, torch.zeros(3, dtype=torch.bool))
    weight = model.generator.encoder.weight
    (fed,) = torch.autograd.grad(vae_losses(result, joints).reconstruction, weight)
    latent = (result.posterior_mean + torch.exp(0.5 * result.posterior_logvar) * noise).detach()
    given = model.decode(
        shifted(result.pose.joints.detach()), model.condition(actions, 20), latent, lengths
    )
    (alone,) = torch.autograd.grad(
        vae_losses(result._replace(pose=given), joints).reconstruction, weight
    )
    assert (fed - alone).abs().max() > 0.05 * fed.abs().max()


@pytest.mark.parametrize("decoder", ["lie", "glmi-m", "glmi-r"])
def test_generated_bones_keep_their_lengths(decoder):
    torch.manual_seed(1)
    model = MotionVAE(HUMANACT12, 12, VAESettings(decoder=decoder))
    _, actions, lengths, noise = inputs(frames=40)
    joints = model.sample(actions[:, None].expand(-1, 40, -1), lengths, noise).joints
    measured = bone_lengths(joints, HUMANACT12)[..., 1:]
    assert (measured - lengths[:, None, 1:]).abs().max() < 1e-5


@pytest.mark.parametrize("decoder", ["lie", "glmi-m", "glmi-r"])
def test_the_body_turns_as_one_with_w0(decoder):
    """Eq. 6 with j from 0: W_0 rotates a pose without changing its shape or anything else."""
    torch.manual_seed(0)
    decode = (
        MotionVAE(HUMANACT12, 12, VAESettings(decoder=decoder, root_rotation=True))
        .double()
        .pose_decoder
    )
    lengths = inputs()[2].double()
    outputs, previous = (
        torch.randn(3, 2, decode.input_size).double(),
        torch.zeros(3, 2, 24, 3).double(),
    )
    turned = torch.tensor([0.3, -0.5, 0.2], dtype=torch.float64)
    poses = []
    for vector in (torch.zeros(3, dtype=torch.float64), turned):
        with torch.no_grad():  # W_0 alone, the same for all
            decode.lie_output.weight[-3:], decode.lie_output.bias[-3:] = (
                0,
                torch.atanh(vector / torch.pi),
            )
        poses.append(decode(outputs, previous, lengths).joints)
    still, moved = (pose - pose[:, :, :1] for pose in poses)
    assert torch.allclose(moved, still @ rotvec_to_rotmat(turned).T, atol=1e-12)
    assert (moved - still).abs().max() > 0.05


@pytest.mark.parametrize("decoder", DECODERS)
def test_relative_roots_do_not_know_where_the_body_is(decoder):
    """A sequence that is moved continues with the same poses there (absolute roots: with others)."""
    joints, actions, lengths, noise = (x.double() for x in inputs())
    away = torch.tensor([3.0, 0.5, -2.0], dtype=torch.float64)
    differences = []
    for roots in ("relative", "absolute"):
        torch.manual_seed(0)
        model = MotionVAE(HUMANACT12, 12, VAESettings(decoder=decoder, roots=roots)).double()
        condition = model.condition(actions, joints.shape[1])
        here, there = (
            model.decode(joints + place, condition, noise, lengths).joints for place in (0, away)
        )
        differences.append((there - here - away).abs().max())
    assert differences[0] < 1e-10 < 0.01 < differences[1]


def test_the_fixed_prior_is_the_standard_normal():
    """Eq. 7: the prior's latent is the noise itself, and the KL term is that from N(0, I)."""
    torch.manual_seed(0)
    model = MotionVAE(HUMANACT12, 12, VAESettings(decoder="lie", prior="fixed")).double()
    joints, actions, lengths, noise = (x.double() for x in inputs())
    assert not parameters(model.prior)
    result = model.reconstruct(joints, actions, lengths, noise)
    mean, logvar = result.posterior_mean, result.posterior_logvar
    expected = 0.5 * (logvar.exp() + mean**2 - 1 - logvar).sum(-1).mean()
    assert vae_losses(result, joints).kl.item() == pytest.approx(expected.item(), rel=1e-9)
    steps = joints.shape[1]
    sampled = model.sample(actions[:, None].expand(-1, steps, -1), lengths, noise).joints
    again = model.decode(shifted(sampled), model.condition(actions, steps), noise, lengths).joints
    assert torch.allclose(again, sampled, atol=1e-10)


def test_kl_agrees_with_torch():
    g = torch.Generator().manual_seed(0)
    m1, v1, m2, v2 = (torch.randn(5, 7, 30, generator=g) for _ in range(4))
    expected = kl_divergence(Normal(m1, torch.exp(0.5 * v1)), Normal(m2, torch.exp(0.5 * v2))).sum(
        -1
    )
    assert torch.allclose(gaussian_kl(m1, v1, m2, v2), expected, rtol=1e-4)
    assert torch.allclose(gaussian_kl(m1, v1, m1, v1), torch.zeros(5, 7), atol=1e-6)


def test_losses_against_closed_forms():
    torch.manual_seed(0)
    model = MotionVAE(HUMANACT12, 12, VAESettings(decoder="glmi-m"))
    joints, actions, lengths, noise = inputs()
    result = model.reconstruct(joints, actions, lengths, noise)
    moved = result._replace(
        pose=result.pose._replace(
            joints=joints + torch.tensor([0.03, 0.0, 0.04]), velocity=result.pose.velocity * 0
        )
    )
    norm, mse = (vae_losses(moved, joints, reconstruction=kind) for kind in ("norm", "mse"))
    assert norm.reconstruction.item() == pytest.approx(24 * 0.05, rel=1e-4)
    assert mse.reconstruction.item() == pytest.approx(0.05**2 / 3, rel=1e-4)
    # All joints are off by 5 cm, those of the frame before are not: relative to the root only the
    # root's own step is wrong.
    away = vae_losses(moved, joints, roots="relative")
    assert away.reconstruction.item() == pytest.approx(0.05, rel=1e-3)
    steps = np.linalg.norm(np.diff(joints[:, :, 0].numpy(), axis=1, prepend=0), axis=-1)
    assert norm.alignment.item() == pytest.approx(steps.mean(), rel=1e-4)
    squared = vae_losses(moved, joints, alignment="mse").alignment
    assert squared.item() == pytest.approx((steps**2).mean() / 3, rel=1e-4)


@pytest.mark.parametrize("decoder", DECODERS)
def test_every_parameter_learns(decoder):
    torch.manual_seed(0)
    model = MotionVAE(HUMANACT12, 12, VAESettings(decoder=decoder))
    joints, actions, lengths, noise = inputs()
    losses = vae_losses(model.reconstruct(joints, actions, lengths, noise), joints)
    (losses.reconstruction + losses.kl + losses.alignment).backward()
    for name, parameter in model.named_parameters():
        assert parameter.grad is not None, name
        assert torch.isfinite(parameter.grad).all(), name
        assert parameter.grad.abs().sum() > 0, name

"""The temporal conditional VAE of action2motion: posterior, prior and generator over time (Sec.
4.1.2-4.1.4)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from a2v.kinematics import Skeleton
from a2v.lab.motion.networks import (
    GaussianGRU,
    Generator,
    Pose,
    PoseDecoder,
    StandardNormal,
    VAESettings,
)
from a2v.lab.motion.recurrence import RollOut, with_feedback


def shifted(frames: Tensor) -> Tensor:
    """Return the previous frames: (B, T, ...) shifted by one, zeros first."""
    return torch.cat([torch.zeros_like(frames[:, :1]), frames[:, :-1]], 1)


class States(NamedTuple):
    """Recurrent states between frames; all zeros before the first."""

    prior: Tensor
    generator: Tensor
    trajectory: Tensor


class Reconstruction(NamedTuple):
    """Training pass over (B, T) frames: decoded pose, both Gaussians (B, T, Z), and the previous
    poses (B, T, J, 3), real or the model's own."""

    pose: Pose
    posterior_mean: Tensor
    posterior_logvar: Tensor
    prior_mean: Tensor
    prior_logvar: Tensor
    before: Tensor


class MotionVAE(nn.Module):
    """Posterior, prior, generator and pose decoder.

    Parameters
    ----------
    skeleton : Skeleton
    n_actions : int
    settings : VAESettings
    """

    def __init__(
        self, skeleton: Skeleton, n_actions: int, settings: VAESettings | None = None
    ) -> None:
        super().__init__()
        settings = settings or VAESettings()
        self.skeleton, self.n_actions, self.settings = skeleton, n_actions, settings
        inputs = 3 * skeleton.n_joints + n_actions + 1
        self.posterior = GaussianGRU(inputs, settings)
        self.prior = (
            StandardNormal(settings) if settings.prior == "fixed" else GaussianGRU(inputs, settings)
        )
        self.pose_decoder = PoseDecoder(skeleton, settings)
        self.generator = Generator(
            inputs + settings.latent_size, self.pose_decoder.input_size, settings
        )

    def initial_states(self, batch: int) -> States:
        """Return zero states for `batch` sequences."""
        like = self.generator.decoder.weight
        size = self.settings.hidden_size
        return States(
            like.new_zeros(1, batch, size),
            like.new_zeros(2, batch, size),
            like.new_zeros(1, batch, size),
        )

    def step(
        self,
        previous: Tensor,
        actions: Tensor,
        counter: Tensor,
        lengths: Tensor,
        noise: Tensor,
        states: States,
    ) -> tuple[Pose, States]:
        """Generate one frame from the prior.

        Parameters
        ----------
        previous : (B, J, 3)
            Previous pose, native units; zeros for the first.
        actions : (B, A)
            One-hot.
        counter : (B, 1)
            Time counter c_t in (0, 1].
        lengths : (B, J)
            Bone lengths, native units.
        noise : (B, Z)
            Standard normal draws.
        states : States
        """
        context = torch.cat([self.settings.feedback(previous).flatten(1), actions, counter], -1)[
            :, None
        ]
        mean, logvar, prior_state = self.prior(context, states.prior)
        latent = mean + torch.exp(0.5 * logvar) * noise[:, None]
        outputs, generator_state = self.generator(
            torch.cat([context, latent], -1), states.generator
        )
        pose = self.pose_decoder(outputs, previous[:, None], lengths, states.trajectory)
        return pose, States(
            prior_state, generator_state, states.trajectory if pose.state is None else pose.state
        )

    def decode(self, previous: Tensor, condition: Tensor, latent: Tensor, lengths: Tensor) -> Pose:
        """Decode sequences whose previous poses (B, T, J, 3) are known: one parallel pass, no loop
        over frames."""
        outputs, _ = self.generator(
            torch.cat([self.settings.feedback(previous).flatten(2), condition, latent], -1)
        )
        pose: Pose = self.pose_decoder(outputs, previous, lengths)
        return pose

    def reconstruct(
        self,
        joints: Tensor,
        actions: Tensor,
        lengths: Tensor,
        noise: Tensor,
        teacher: Tensor | None = None,
    ) -> Reconstruction:
        """Run one training pass.

        Only sequences without teacher forcing need loops over frames (`a2v.lab.motion.recurrence`).

        Parameters
        ----------
        joints : (B, T, J, 3)
            Real poses p_t.
        actions : (B, A)
            One-hot.
        lengths : (B, J)
        noise : (B, T, Z)
            Draws of the reparameterization trick.
        teacher : (B,) bool
            Sequences that get the real previous poses p_{t-1}. The others get the model's own, and
            gradients flow through them. None: all get real poses.
        """
        condition = self.condition(actions, joints.shape[1])
        posterior_mean, posterior_logvar, _ = self.posterior(
            torch.cat([self.observed(joints).flatten(2), condition], -1)
        )
        latent = posterior_mean + torch.exp(0.5 * posterior_logvar) * noise
        own = torch.empty(0) if teacher is None else torch.nonzero(~teacher).squeeze(1)
        given = shifted(joints)
        if not len(own):
            pose = self.decode(given, condition, latent, lengths)
        else:
            rolled = RollOut(
                self.generator,
                self.pose_decoder,
                condition[own],
                latent=latent[own].detach(),
                lengths=lengths[own],
            )
            pose = self.decode(
                given.index_copy(0, own, shifted(rolled.joints)), condition, latent, lengths
            )
            fed, velocity = with_feedback(
                pose.joints[own], None if pose.velocity is None else pose.velocity[own], rolled
            )
            pose = pose._replace(
                joints=pose.joints.index_copy(0, own, fed),
                velocity=None
                if velocity is None or pose.velocity is None
                else pose.velocity.index_copy(0, own, velocity),
            )
            given = given.index_copy(0, own, shifted(fed))
        prior_mean, prior_logvar, _ = self.prior(
            torch.cat([self.settings.feedback(given).flatten(2), condition], -1)
        )
        return Reconstruction(
            pose, posterior_mean, posterior_logvar, prior_mean, prior_logvar, given
        )

    def observed(self, joints: Tensor) -> Tensor:
        """Return real poses (B, T, J, 3) as input of the posterior.

        With relative roots, joints are relative to the root, and the root's entry is its step since
        the previous frame.
        """
        if not self.settings.relative:
            return joints
        roots = joints[:, :, :1]
        return torch.cat([roots - shifted(roots), joints[:, :, 1:] - roots], 2)

    def condition(self, actions: Tensor, frames: int) -> Tensor:
        """Return action and time counter (B, T, A + 1) of sequences with one action (B, A)."""
        counter = torch.arange(1, frames + 1, dtype=actions.dtype, device=actions.device) / frames
        return torch.cat(
            [
                actions[:, None].expand(-1, frames, -1),
                counter[None, :, None].expand(len(actions), -1, -1),
            ],
            -1,
        )

    @torch.no_grad()
    def sample(self, actions: Tensor, lengths: Tensor, noise: Tensor) -> Pose:
        """Generate motions from noise, as the reference for the exported graphs.

        Parameters
        ----------
        actions : (B, T, A)
            One-hot per frame, so that the action can change within a clip.
        lengths : (B, J)
        noise : (B, T, Z)
        """
        batch, frames = noise.shape[:2]
        previous = noise.new_zeros(batch, self.skeleton.n_joints, 3)
        states = self.initial_states(batch)
        poses = []
        for t in range(frames):
            counter = noise.new_full((batch, 1), (t + 1) / frames)
            pose, states = self.step(previous, actions[:, t], counter, lengths, noise[:, t], states)
            previous = pose.joints[:, 0]
            poses.append(pose)

        def joined(parts: list[Tensor | None]) -> Tensor | None:
            known = [part for part in parts if part is not None]
            return torch.cat(known, 1) if known else None

        joints = torch.cat([pose.joints for pose in poses], 1)
        return Pose(
            joints,
            joined([pose.rotations for pose in poses]),
            joined([pose.velocity for pose in poses]),
            None,
        )

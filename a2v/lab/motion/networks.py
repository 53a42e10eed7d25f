"""Parts of the temporal VAE of action2motion: Gaussians, generator and the four pose decodings
(Sec. 4.1.2-4.1.4; sizes of the first paper's Table 3)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, NamedTuple, get_args

import torch
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.kinematics import Skeleton
from a2v.kinematics.gradient import ChainPlan, local_kinematics
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.lab.runs import NEWER

Decoder = Literal["plain", "lie", "glmi-m", "glmi-r"]
DECODERS: tuple[Decoder, ...] = ("plain", "lie", "glmi-m", "glmi-r")
Roots = Literal["absolute", "relative"]
Prior = Literal["learned", "fixed"]


@dataclass(frozen=True)
class VAESettings:
    """Sizes of the networks.

    Attributes
    ----------
    decoder : "plain", "lie", "glmi-m" or "glmi-r"
        Pose decoding of Fig. 4 (a) to (d).
    hidden_size : int
        Width of encoders and GRUs.
    latent_size : int
        Dimension of z.
    trajectory_size : int
        Dimension of h^o, the generator's output for the trajectory network (GLMI only).
    roots : "absolute" or "relative"
        Whether the networks see the root's position, or its step since the last frame ("works
        better", Sec. 4.1.1).
    root_rotation : bool
        Whether a rotation W_0 of the whole body is decoded too (Eq. 6). Without it, the first bones
        of the chains turn with the body. Not for "plain".
    prior : "learned" or "fixed"
        A prior network that sees the previous pose (Eq. 8 and 10), or the standard normal
        distribution N(0, I) in every frame (Eq. 7).
    """

    decoder: Decoder = "glmi-m"
    hidden_size: int = 128
    latent_size: int = 30
    trajectory_size: int = 20
    roots: Roots = field(default="absolute", metadata=NEWER)
    root_rotation: bool = field(default=False, metadata=NEWER)
    prior: Prior = field(default="learned", metadata=NEWER)

    def __post_init__(self) -> None:
        if self.decoder not in DECODERS:
            raise InputError(f"unknown decoder '{self.decoder}'; choose from {', '.join(DECODERS)}")
        if self.roots not in get_args(Roots):
            raise InputError(
                f"unknown roots '{self.roots}'; choose from {', '.join(get_args(Roots))}"
            )
        if self.prior not in get_args(Prior):
            raise InputError(
                f"unknown prior '{self.prior}'; choose from {', '.join(get_args(Prior))}"
            )
        if self.root_rotation and self.decoder == "plain":
            raise InputError(
                "the decoder 'plain' has no rotations; leave root_rotation out, or "
                "choose another decoder"
            )

    @property
    def relative(self) -> bool:
        """Whether `roots` is "relative"."""
        return self.roots == "relative"

    def feedback(self, poses: Tensor) -> Tensor:
        """Return previous poses (..., J, 3) as input of prior and generator: relative to the root
        if `relative`."""
        return poses - poses[..., :1, :] if self.relative else poses


class GaussianGRU(nn.Module):
    """Posterior or prior network: encoder, one GRU layer, mean and log variance (Eq. 9, 10)."""

    def __init__(self, input_size: int, settings: VAESettings) -> None:
        super().__init__()
        self.encoder = nn.Linear(input_size, settings.hidden_size)
        self.gru = nn.GRU(settings.hidden_size, settings.hidden_size, batch_first=True)
        self.mu_net = nn.Linear(settings.hidden_size, settings.latent_size)
        self.logvar_net = nn.Linear(settings.hidden_size, settings.latent_size)

    def forward(self, inputs: Tensor, state: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor]:
        """Return mean and log variance (B, T, Z) and the final state (1, B, H) for inputs (B, T,
        D)."""
        hidden, state = self.gru(self.encoder(inputs), state)
        return self.mu_net(hidden), self.logvar_net(hidden), state


class StandardNormal(nn.Module):
    """The fixed prior N(0, I) of Eq. 7, called like `GaussianGRU`.

    Attributes
    ----------
    logvar : (Z,)
        Zeros, unless a temperature scales the exported model's noise.
    """

    logvar: Tensor

    def __init__(self, settings: VAESettings) -> None:
        super().__init__()
        self.register_buffer("logvar", torch.zeros(settings.latent_size))

    def forward(self, inputs: Tensor, state: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor]:
        """Return mean and log variance (B, T, Z), the same for all inputs (B, T, D), and the
        unchanged state."""
        logvar = self.logvar.expand(*inputs.shape[:2], -1)
        return torch.zeros_like(logvar), logvar, inputs.new_zeros(0) if state is None else state


class Generator(nn.Module):
    """Encoder, two GRU layers and decoder; the pose decoding converts its output to joints."""

    def __init__(self, input_size: int, output_size: int, settings: VAESettings) -> None:
        super().__init__()
        self.encoder = nn.Linear(input_size, settings.hidden_size)
        self.gru = nn.GRU(
            settings.hidden_size, settings.hidden_size, num_layers=2, batch_first=True
        )
        self.decoder = nn.Linear(settings.hidden_size, output_size)

    def forward(self, inputs: Tensor, state: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """Return outputs (B, T, D') and final state (2, B, H) for inputs (B, T, D)."""
        hidden, state = self.gru(self.encoder(inputs), state)
        return self.decoder(hidden), state


class Pose(NamedTuple):
    """What a pose decoder returns for (B, T) frames.

    Attributes
    ----------
    joints : (B, T, J, 3)
        Positions, native units.
    rotations : (B, T, J, 3) or None
        Rotation vectors of the chain convention; None for the plain decoder and with a root
        rotation.
    velocity : (B, T, 3) or None
        Root velocity per frame that GLMI inferred (Eq. 11).
    state : (1, B, H) or None
        State of GLMI-R's GRU.
    """

    joints: Tensor
    rotations: Tensor | None
    velocity: Tensor | None
    state: Tensor | None


class PoseDecoder(nn.Module):
    """The four pose decodings of Fig. 4 with one interface.

    Parameters
    ----------
    skeleton : Skeleton
    settings : VAESettings
    """

    bone_joints: Tensor
    rest: Tensor
    path: Tensor
    along: Tensor

    def __init__(self, skeleton: Skeleton, settings: VAESettings) -> None:
        super().__init__()
        self.skeleton, self.settings = skeleton, settings
        plan = ChainPlan.of(skeleton)
        self.levels = plan.levels
        for name, part in (
            ("bone_joints", plan.joints),
            ("rest", plan.rest),
            ("path", plan.path),
            ("along", plan.along),
        ):
            self.register_buffer(name, part, persistent=False)
        bones = 3 * (skeleton.n_joints - 1 + settings.root_rotation)
        hidden = settings.hidden_size
        trajectory_input = 6 * skeleton.n_joints + settings.trajectory_size
        self.lie_output = nn.Linear(bones, bones) if settings.decoder != "plain" else None
        self.velocity_net: nn.Module | None = None
        self.velocity_gru: nn.GRU | None = None
        if settings.decoder == "glmi-m":
            self.velocity_net = nn.Sequential(
                nn.Linear(trajectory_input, hidden),
                nn.LeakyReLU(0.2),
                nn.Linear(hidden, hidden),
                nn.LeakyReLU(0.2),
                nn.Linear(hidden, 3),
            )
        elif settings.decoder == "glmi-r":
            self.velocity_in = nn.Linear(trajectory_input, hidden)
            self.velocity_gru = nn.GRU(hidden, hidden, batch_first=True)
            self.velocity_net = nn.Linear(hidden, 3)

    @property
    def plan(self) -> ChainPlan:
        """The skeleton's chains in the weights' dtype and place."""
        return ChainPlan(self.bone_joints, self.levels, self.rest, self.path, self.along)

    @property
    def input_size(self) -> int:
        """Width of the generator's output."""
        pose = 3 * (self.skeleton.n_joints + self.settings.root_rotation)
        return (
            pose - 3 + self.settings.trajectory_size
            if self.settings.decoder.startswith("glmi")
            else pose
        )

    @property
    def turns(self) -> int:
        """Number of decoded components of rotation vectors; W_0's are the last three, if it is
        decoded."""
        return 3 * (self.skeleton.n_joints - 1 + self.settings.root_rotation)

    @property
    def follows_trajectory(self) -> bool:
        """Whether the root comes from integrated velocities (GLMI) instead of from the
        generator."""
        return self.settings.decoder.startswith("glmi")

    @property
    def from_last_root(self) -> bool:
        """Whether the decoded position is relative to the root of the last frame."""
        return self.follows_trajectory or self.settings.relative

    def forward(
        self, outputs: Tensor, previous: Tensor, lengths: Tensor, state: Tensor | None = None
    ) -> Pose:
        """Decode generator outputs.

        Parameters
        ----------
        outputs : (B, T, D)
        previous : (B, T, J, 3)
            Previous pose of each frame (zeros for the first), native units.
        lengths : (B, J)
            Bone lengths, native units.
        state : (1, B, H) or None
            State of GLMI-R's GRU before the first frame.
        """
        batch, frames = outputs.shape[:2]
        n = self.skeleton.n_joints
        previous_root = previous[:, :, :1]
        origin = previous_root if self.settings.relative else torch.zeros_like(previous_root)
        if self.lie_output is None:
            return Pose(outputs.reshape(batch, frames, n, 3) + origin, None, None, None)
        bones = self.turns
        # tanh keeps each component within half a turn, so that the norm is below sqrt(3) pi; the
        # paper limits the norm itself to pi
        rotvec = torch.pi * torch.tanh(self.lie_output(outputs[..., :bones]))
        turned = torch.cat(
            [torch.zeros_like(rotvec[..., :3]), rotvec[..., : 3 * n - 3]], -1
        ).reshape(batch, frames, n, 3)
        every = lengths[:, None].expand(-1, frames, -1).flatten(0, 1)
        local = local_kinematics(turned.flatten(0, 1), every, self.plan).reshape(
            batch, frames, n, 3
        )
        if self.settings.root_rotation:
            body = rotvec_to_rotmat(rotvec[..., 3 * n - 3 :])
            local = (body[:, :, None] * local[..., None, :]).sum(-1)
        # a motion's rotations are those of chains that start from the identity
        rotations = None if self.settings.root_rotation else turned
        if not self.follows_trajectory:
            return Pose(local + outputs[:, :, None, bones:] + origin, rotations, None, None)
        inputs = torch.cat(
            [local.flatten(2), (previous - previous_root).flatten(2), outputs[..., bones:]], -1
        )
        if self.velocity_gru is not None:
            inputs, state = self.velocity_gru(self.velocity_in(inputs), state)
        assert self.velocity_net is not None
        velocity = self.velocity_net(inputs)
        return Pose(local + previous_root + velocity[:, :, None], rotations, velocity, state)

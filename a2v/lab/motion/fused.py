"""The products that the motion VAE's layers come down to, named once for the recurrence and the
export.

Layers without a non-linearity between them are one product: less to do for a frame, where it is the
number of operations that costs.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from a2v.lab.motion.networks import GaussianGRU, Generator, PoseDecoder


class Affine(NamedTuple):
    """The map ``weight @ x + bias``.

    Attributes
    ----------
    weight : (O, I)
    bias : (O,)
    """

    weight: Tensor
    bias: Tensor

    def after(self, first: Affine | nn.Linear) -> Affine:
        """This map of what `first` gives, as one."""
        return Affine(self.weight @ first.weight, self.weight @ first.bias + self.bias)


class VelocityLayers(NamedTuple):
    """GLMI's layers from the first product to the root's velocity: `hidden` ones, leaky ReLUs of
    slope `leak` after each, and the `last`."""

    hidden: list[nn.Linear]
    last: nn.Linear
    leak: float


def gru_inputs(gru: nn.GRU, layer: int) -> Affine:
    """What a layer makes of its inputs: (3H, D) and (3H,), gates reset, update, candidate."""
    return Affine(getattr(gru, f"weight_ih_l{layer}"), getattr(gru, f"bias_ih_l{layer}"))


def gru_state(gru: nn.GRU, layer: int) -> Affine:
    """What a layer makes of its state: (3H, H) and (3H,), gates reset, update, candidate."""
    return Affine(getattr(gru, f"weight_hh_l{layer}"), getattr(gru, f"bias_hh_l{layer}"))


def from_root(weight: Tensor) -> Tensor:
    """Columns (O, 3J) for poses as they are, of columns for poses whose joints are relative to the
    root: the root's columns take off what the others add."""
    shared = weight.reshape(len(weight), -1, 3).sum(1)
    return torch.cat([weight[:, :3] - shared, weight[:, 3:]], 1)


def _of_pose(entry: Affine, decoder: PoseDecoder) -> Affine:
    """`entry`, whose first columns are of the pose before as `VAESettings.feedback` has it, for
    that pose as it is."""
    if not decoder.settings.relative:
        return entry
    size = 3 * decoder.skeleton.n_joints
    return Affine(
        torch.cat([from_root(entry.weight[:, :size]), entry.weight[:, size:]], 1), entry.bias
    )


def prior_entry(prior: GaussianGRU, decoder: PoseDecoder) -> Affine:
    """Encoder and gates: (3H, 3J + A + 1) and (3H,), of pose before, action and time counter."""
    return _of_pose(gru_inputs(prior.gru, 0).after(prior.encoder), decoder)


def prior_exit(prior: GaussianGRU) -> Affine:
    """Mean and log variance beneath each other: (2Z, H) and (2Z,), of the state."""
    nets = prior.mu_net, prior.logvar_net
    return Affine(torch.cat([net.weight for net in nets]), torch.cat([net.bias for net in nets]))


def generator_entry(generator: Generator, decoder: PoseDecoder) -> Affine:
    """Encoder and first layer's gates: (3H, 3J + A + 1 + Z) and (3H,), of pose before, action, time
    counter and latent."""
    return _of_pose(gru_inputs(generator.gru, 0).after(generator.encoder), decoder)


def generator_exit(generator: Generator, decoder: PoseDecoder) -> Affine:
    """Decoder and Lie layer: (D, H) and (D,); the rotation vectors' components come first, the
    bones in the order of the plan, then W_0."""
    weight, bias = generator.decoder.weight, generator.decoder.bias
    lie = decoder.lie_output
    if lie is None:
        return Affine(weight, bias)
    bones = decoder.turns
    places = torch.cat(
        [
            decoder.plan.joints - 1,
            torch.arange(decoder.skeleton.n_joints - 1, bones // 3, device=weight.device),
        ]
    )
    order = (3 * places[:, None] + torch.arange(3, device=weight.device)).flatten()
    rotvec = lie.weight[order]
    return Affine(
        torch.cat([rotvec @ weight[:bones], weight[bones:]]),
        torch.cat([rotvec @ bias[:bones] + lie.bias[order], bias[bones:]]),
    )


def velocity_layers(decoder: PoseDecoder) -> VelocityLayers:
    """The layers of GLMI-M's network, or of what follows GLMI-R's GRU."""
    assert decoder.velocity_net is not None
    layers = list(decoder.velocity_net.modules())
    linear = [layer for layer in layers if isinstance(layer, nn.Linear)]
    leak = next((layer.negative_slope for layer in layers if isinstance(layer, nn.LeakyReLU)), 1.0)
    return VelocityLayers(linear[:-1], linear[-1], leak)


def velocity_entry(decoder: PoseDecoder) -> Affine:
    """GLMI's first product of local joints (3J), the poses before (3J) and h^o, GLMI-R's gates
    included: (H or 3H, 6J + h^o).

    The network is told poses relative to their root; here the root's columns take off what the
    others add, so that poses are given as they are.
    """
    first = (
        velocity_layers(decoder).hidden[0] if decoder.velocity_gru is None else decoder.velocity_in
    )
    size = 3 * decoder.skeleton.n_joints
    weight = torch.cat(
        [
            first.weight[:, :size],
            from_root(first.weight[:, size : 2 * size]),
            first.weight[:, 2 * size :],
        ],
        1,
    )
    entry = Affine(weight, first.bias)
    return (
        entry if decoder.velocity_gru is None else gru_inputs(decoder.velocity_gru, 0).after(entry)
    )

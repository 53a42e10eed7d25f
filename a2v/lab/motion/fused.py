"""Fused products of the motion VAE's layers, for the recurrence and the export.

Layers without a non-linearity between them are one product. The time for a single frame depends
mainly on the number of operations.
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
        """Return the map that applies `first`, then this map."""
        return Affine(self.weight @ first.weight, self.weight @ first.bias + self.bias)


class VelocityLayers(NamedTuple):
    """GLMI's layers from the first product to the root's velocity: the `hidden` ones, each followed
    by a leaky ReLU of slope `leak`, and the `last`."""

    hidden: list[nn.Linear]
    last: nn.Linear
    leak: float


def gru_inputs(gru: nn.GRU, layer: int) -> Affine:
    """Return a layer's map of its inputs: (3H, D) and (3H,), gates reset, update, candidate."""
    return Affine(getattr(gru, f"weight_ih_l{layer}"), getattr(gru, f"bias_ih_l{layer}"))


def gru_state(gru: nn.GRU, layer: int) -> Affine:
    """Return a layer's map of its state: (3H, H) and (3H,), gates reset, update, candidate."""
    return Affine(getattr(gru, f"weight_hh_l{layer}"), getattr(gru, f"bias_hh_l{layer}"))


def from_root(weight: Tensor) -> Tensor:
    """Convert columns (O, 3J) for poses relative to the root into columns for absolute poses.

    The root's columns subtract what the other columns add."""
    shared = weight.reshape(len(weight), -1, 3).sum(1)
    return torch.cat([weight[:, :3] - shared, weight[:, 3:]], 1)


def _of_pose(entry: Affine, decoder: PoseDecoder) -> Affine:
    """Convert `entry`, whose first columns take the `VAESettings.feedback` of the previous pose, to
    take the absolute pose."""
    if not decoder.settings.relative:
        return entry
    size = 3 * decoder.skeleton.n_joints
    return Affine(
        torch.cat([from_root(entry.weight[:, :size]), entry.weight[:, size:]], 1), entry.bias
    )


def prior_entry(prior: GaussianGRU, decoder: PoseDecoder) -> Affine:
    """Encoder and gates: (3H, 3J + A + 1) and (3H,), of previous pose, action and time counter."""
    return _of_pose(gru_inputs(prior.gru, 0).after(prior.encoder), decoder)


def prior_exit(prior: GaussianGRU) -> Affine:
    """Return mean and log variance of the state, stacked: (2Z, H) and (2Z,)."""
    nets = prior.mu_net, prior.logvar_net
    return Affine(torch.cat([net.weight for net in nets]), torch.cat([net.bias for net in nets]))


def generator_entry(generator: Generator, decoder: PoseDecoder) -> Affine:
    """Encoder and first layer's gates: (3H, 3J + A + 1 + Z) and (3H,), of previous pose, action,
    time counter and latent."""
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
    """Return the layers of GLMI-M's network, or those after GLMI-R's GRU."""
    assert decoder.velocity_net is not None
    layers = list(decoder.velocity_net.modules())
    linear = [layer for layer in layers if isinstance(layer, nn.Linear)]
    leak = next((layer.negative_slope for layer in layers if isinstance(layer, nn.LeakyReLU)), 1.0)
    return VelocityLayers(linear[:-1], linear[-1], leak)


def velocity_entry(decoder: PoseDecoder) -> Affine:
    """Return GLMI's first product of local joints (3J), the previous poses (3J) and h^o: (H or 3H,
    6J + h^o).

    It includes GLMI-R's gates. The network sees poses relative to their root. Here the root's
    columns subtract what the others add, so that the input is the absolute pose.
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

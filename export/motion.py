"""Export of a trained motion VAE to one self-describing ONNX file.

The graph is the whole sampler: a Scan over frames around prior, generator, pose decoding and
forward kinematics, with the noise as an input, so that the same noise gives the same motion as in
PyTorch. Recurrent states and the previous pose are inputs and outputs: a run over one frame is the
step of transitions, outpainting and endless sequences; a run over many frames makes whole clips
fast.
"""

from __future__ import annotations

import copy
import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import onnx
import onnx.compose
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.kinematics import inverse_kinematics
from a2v.kinematics.gradient import Exponentials, bone_ends, chain_frames, joint_positions
from a2v.lab.datasets import ActionDataset
from a2v.lab.motion.fused import (
    generator_entry,
    generator_exit,
    gru_inputs,
    gru_state,
    prior_entry,
    prior_exit,
    velocity_entry,
    velocity_layers,
)
from a2v.lab.motion.networks import StandardNormal
from a2v.lab.motion.vae import MotionVAE
from a2v.motion.card import STATE_NAMES
from a2v.tracing import OPSET, to_onnx
from export.description import describe
from export.storage import SMALLEST_HALF, round_to_stored, save_model, shrink


def _gru_step(gates: Tensor, state: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
    """New state (B, H) for ``weight_ih @ x + bias_ih`` (B, 3H), written out: it exports to few
    nodes, unlike nn.GRU."""
    resets, updates, candidates = gates.chunk(3, 1)
    by_reset, by_update, by_candidate = nn.functional.linear(state, weight, bias).chunk(3, 1)
    candidate = torch.tanh(candidates + torch.sigmoid(resets + by_reset) * by_candidate)
    return candidate + torch.sigmoid(updates + by_update) * (state - candidate)


def _keeps_turns(model: MotionVAE) -> bool:
    """Whether the decoded rotation vectors are those of a motion.

    They are not if there are none, or if chains start from W_0 instead of the identity.
    """
    return model.settings.decoder != "plain" and not model.settings.root_rotation


class StepGraph(nn.Module):
    """One frame, which the Scan repeats. States are (B, H) each; see `MotionVAE.step`.

    For one clip the number of nodes determines the time. Layers without a non-linearity between
    them are therefore one product, and work for all frames at once is left to `RotationsGraph`.
    """

    def __init__(self, model: MotionVAE) -> None:
        super().__init__()
        self.model = model

    def forward(
        self,
        previous: Tensor,
        prior: Tensor,
        low: Tensor,
        high: Tensor,
        trajectory: Tensor,
        noise: Tensor,
        action: Tensor,
        time: Tensor,
        lengths: Tensor,
    ) -> tuple[Tensor, ...]:
        """Return the new (previous, prior, low, high, trajectory), native units, and if
        `_keeps_turns` the rotation vectors (B, 3 n) of the n bones, in the plan's order and in half
        turns, from -1 to 1; `lengths` are (n, B)."""
        model, decoder = self.model, self.model.pose_decoder
        n, gru = model.skeleton.n_joints, model.generator.gru
        poses = previous.flatten(1)
        context = torch.cat([poses, action, time], -1)
        if isinstance(model.prior, StandardNormal):
            latent = torch.exp(0.5 * model.prior.logvar) * noise
        else:
            gates = nn.functional.linear(context, *prior_entry(model.prior, decoder))
            prior = _gru_step(gates, prior, *gru_state(model.prior.gru, 0))
            mean, logvar = nn.functional.linear(prior, *prior_exit(model.prior)).chunk(2, 1)
            latent = mean + torch.exp(0.5 * logvar) * noise
        gates = nn.functional.linear(
            torch.cat([context, latent], -1), *generator_entry(model.generator, decoder)
        )
        low = _gru_step(gates, low, *gru_state(gru, 0))
        high = _gru_step(nn.functional.linear(low, *gru_inputs(gru, 1)), high, *gru_state(gru, 1))
        outputs = nn.functional.linear(high, *generator_exit(model.generator, decoder))
        if decoder.lie_output is None:
            made = outputs.reshape(-1, n, 3)
            return (
                made + previous[:, :1] if model.settings.relative else made,
                prior,
                low,
                high,
                trajectory,
            )
        half_turns, rest = torch.tanh(outputs[:, : decoder.turns]), outputs[:, decoder.turns :]
        rotvecs = (torch.pi * half_turns).T.reshape(decoder.turns // 3, 3, -1)
        frames = chain_frames(Exponentials.of(rotvecs[: n - 1]), decoder.plan)
        placed = joint_positions(bone_ends(frames, lengths, decoder.plan), decoder.plan)
        if model.settings.root_rotation:
            placed = (Exponentials.of(rotvecs[n - 1 :]).rotmats() * placed[:, None]).sum(2)
        local = placed.flatten(0, 1).T
        step = rest
        if decoder.velocity_net is not None:
            trajectory, step = self._velocity(local, poses, rest, trajectory)
        root = previous[:, 0] + step if decoder.from_last_root else step
        joints = local.reshape(-1, n, 3) + root[:, None]
        states = joints, prior, low, high, trajectory
        return (*states, half_turns) if _keeps_turns(model) else states

    def _velocity(
        self, local: Tensor, poses: Tensor, told: Tensor, trajectory: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return GLMI-R's state and the root's velocity (B, 3), from local joints, the previous
        poses (B, 3 J) and h^o."""
        decoder = self.model.pose_decoder
        made = nn.functional.linear(torch.cat([local, poses, told], -1), *velocity_entry(decoder))
        hidden, last, leak = velocity_layers(decoder)
        if decoder.velocity_gru is not None:
            made = trajectory = _gru_step(made, trajectory, *gru_state(decoder.velocity_gru, 0))
        else:
            made = nn.functional.leaky_relu(made, leak)
        for layer in hidden[1:]:
            made = nn.functional.leaky_relu(layer(made), leak)
        return trajectory, last(made)


class RotationsGraph(nn.Module):
    """Rotation vectors (B, T, J, 3) of all frames, from those of `StepGraph`, or from the joints
    (B, T, J, 3) if it gives none."""

    def __init__(self, model: MotionVAE) -> None:
        super().__init__()
        self.skeleton, self.plain = model.skeleton, not _keeps_turns(model)
        self.places = model.pose_decoder.plan.joints.argsort().tolist()

    def forward(self, made: Tensor) -> Tensor:
        """Return the rotation vectors (B, T, J, 3)."""
        if self.plain:
            return inverse_kinematics(made, self.skeleton)
        rotvec = torch.pi * made.reshape(*made.shape[:2], -1, 3)[:, :, self.places]
        return torch.cat([torch.zeros_like(rotvec[:, :, :1]), rotvec], 2)


def _rotations_model(model: MotionVAE, source: str) -> onnx.ModelProto:
    """`RotationsGraph` of the output `source` as ONNX, with dynamic batch and frames; its names do
    not clash with those of the other graph."""
    graph, n = RotationsGraph(model), model.skeleton.n_joints
    example = torch.randn(2, 3, n, 3) if graph.plain else torch.randn(2, 3, 3 * n - 3)
    sizes = {0: torch.export.Dim("batch", min=1), 1: torch.export.Dim("frames", min=1)}
    proto = to_onnx(graph, (example,), [source], ["rotations"], [sizes])
    return onnx.compose.add_prefix(proto, "rotations/", rename_inputs=False, rename_outputs=False)


def step_model(model: MotionVAE) -> onnx.ModelProto:
    """The step as ONNX, with a dynamic batch."""
    batch, joints, hidden = 2, model.skeleton.n_joints, model.settings.hidden_size
    arguments = (
        torch.randn(batch, joints, 3),
        *(torch.randn(batch, hidden) for _ in range(4)),
        torch.randn(batch, model.settings.latent_size),
        torch.randn(batch, model.n_actions),
        torch.rand(batch, 1),
        torch.rand(joints - 1, batch),
    )
    names = [*STATE_NAMES, "noise", "action", "time", "lengths"]
    outputs = [f"{name}_out" for name in STATE_NAMES]
    if _keeps_turns(model):
        outputs.append("frame_turns")
    dynamic = torch.export.Dim("batch", min=1)
    sizes = [{int(name == "lengths"): dynamic} for name in names]
    # onnxruntime folds products of weights: folded here, they would be rounded a second time
    # when they are stored
    return to_onnx(
        StepGraph(model).eval(), arguments, names, outputs, sizes, fold_below=SMALLEST_HALF
    )


def _hoist(body: onnx.GraphProto) -> list[onnx.NodeProto]:
    """Move nodes that depend on weights alone from a Scan's body to the graph around it."""
    known = {"", *(item.name for item in body.initializer)}
    constant: list[onnx.NodeProto] = []
    repeated: list[onnx.NodeProto] = []
    for node in body.node:
        if known.issuperset(node.input):
            known.update(node.output)
            constant.append(node)
        else:
            repeated.append(node)
    del body.node[:]
    body.node.extend(repeated)
    return constant


def _frame_body(
    step: onnx.ModelProto,
) -> tuple[onnx.GraphProto, list[onnx.NodeProto], list[onnx.TensorProto]]:
    """The Scan's body, and the nodes and weights of the graph around it."""
    body = onnx.GraphProto()
    body.CopyFrom(step.graph)
    # outputs of the Scan for every frame: the joints, which are also a state, and the rotation
    # vectors if there are any
    body.node.append(helper.make_node("Identity", [body.output[0].name], ["frame_joints"]))
    body.output.insert(
        len(STATE_NAMES), onnx.ValueInfoProto(name="frame_joints", type=body.output[0].type)
    )
    folded = _hoist(body)
    weights = list(body.initializer)
    del body.initializer[:]
    body.name = "frame"
    for item in [*body.input, *body.output, *body.value_info]:
        item.type.tensor_type.ClearField("shape")
    # bone lengths are the same for every frame: the body reads them from the graph around it
    kept = [item for item in body.input if item.name != "lengths"]
    del body.input[:]
    body.input.extend(kept)
    return body, folded, weights


def _sequence_values(
    model: MotionVAE,
) -> tuple[list[onnx.ValueInfoProto], list[onnx.ValueInfoProto]]:
    """Inputs and outputs of the whole-sequence graph."""
    joints, hidden, latent = (
        model.skeleton.n_joints,
        model.settings.hidden_size,
        model.settings.latent_size,
    )

    def value(name: str, *shape: str | int, kind: int = TensorProto.FLOAT) -> onnx.ValueInfoProto:
        return helper.make_tensor_value_info(name, kind, list(shape))

    def states(prefix: str) -> list[onnx.ValueInfoProto]:
        pose, *others = (f"{prefix}{name}" for name in STATE_NAMES)
        return [value(pose, "batch", joints, 3), *(value(name, "batch", hidden) for name in others)]

    inputs = [
        value("noise", "batch", "frames", latent),
        value("actions", "batch", "frames", kind=TensorProto.INT64),
        value("time", "batch", "frames"),
        value("bone_lengths", "batch", joints),
        *states(""),
    ]
    clips = [value(name, "batch", "frames", joints, 3) for name in ("joints", "rotations")]
    return inputs, [*clips, value("root", "batch", "frames", 3), *states("last_")]


def sequence_model(model: MotionVAE, meters_per_unit: float) -> onnx.ModelProto:
    """The whole-sequence graph: a Scan of the step over frames, then meters.

    Inputs are noise (N, T, Z), actions (N, T) int64, time (N, T) in (0, 1], bone_lengths (N, J) in
    native units and the states of `STATE_NAMES`; outputs joints (N, T, J, 3) in meters, rotations
    (N, T, J, 3), root (N, T, 3) and ``last_<state>``.
    """
    body, folded, weights = _frame_body(step_model(model.eval()))
    made = ["native_joints", "turns"][: len(body.output) - len(STATE_NAMES)]
    rotations = _rotations_model(model, made[-1])
    scan = helper.make_node(
        "Scan",
        inputs=[*STATE_NAMES, "noise", "action_onehot", "time_column"],
        outputs=[*(f"last_{name}" for name in STATE_NAMES), *made],
        body=body,
        num_scan_inputs=3,
        scan_input_axes=[1, 1, 1],
        scan_output_axes=[1] * len(made),
    )
    constants: dict[str, np.ndarray] = {
        "depth": np.array(model.n_actions, np.int64),
        "off_on": np.array([0, 1], np.float32),
        "meters_per_unit": np.array(meters_per_unit, np.float32),
        "axis2": np.array([2], np.int64),
        "root_index": np.array(0, np.int64),
        "plan_joints": model.pose_decoder.plan.joints.numpy(),
    }
    nodes = [
        helper.make_node("OneHot", ["actions", "depth", "off_on"], ["action_onehot"], axis=-1),
        helper.make_node("Unsqueeze", ["time", "axis2"], ["time_column"]),
        helper.make_node("Transpose", ["bone_lengths"], ["every_length"], perm=[1, 0]),
        helper.make_node("Gather", ["every_length", "plan_joints"], ["lengths"], axis=0),
        *folded,
        scan,
        *rotations.graph.node,
        helper.make_node("Mul", ["native_joints", "meters_per_unit"], ["joints"]),
        helper.make_node("Gather", ["joints", "root_index"], ["root"], axis=2),
    ]
    stored = [
        *weights,
        *rotations.graph.initializer,
        *(numpy_helper.from_array(array, name) for name, array in constants.items()),
    ]
    graph = helper.make_graph(nodes, "a2v_motion", *_sequence_values(model), initializer=stored)
    result = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="a2v", ir_version=10
    )
    onnx.checker.check_model(result, full_check=False)
    return result


def demand_temperature(temperature: float) -> None:
    """Raise InputError unless `temperature` is above 0 and at most 2."""
    if not 0 < temperature <= 2:
        raise InputError(f"temperature is {temperature}; expected a number above 0 and at most 2")


def cool(model: MotionVAE, temperature: float) -> MotionVAE:
    """A copy of `model` whose prior draws latents with `temperature` times its standard deviation.

    Raises
    ------
    InputError
        The temperature is not above 0 and at most 2.
    """
    demand_temperature(temperature)
    copied = copy.deepcopy(model)
    with torch.no_grad():
        prior = copied.prior
        logvar = prior.logvar if isinstance(prior, StandardNormal) else prior.logvar_net.bias
        logvar.add_(2 * math.log(temperature))
    return copied


def export_motion(
    model: MotionVAE,
    dataset: ActionDataset,
    path: str | os.PathLike[str],
    *,
    license: str,
    temperature: float = 1.0,
    extra: Mapping[str, Any] | None = None,
) -> None:
    """Write the ONNX file of `model`; its weights are rounded in place to the stored values.

    Parameters
    ----------
    model : MotionVAE
    dataset : ActionDataset
        Training data: gives actions, skeleton, rates and default bone lengths.
    path : path
    license : str
        License of the weights, shown to users.
    temperature : float
        Temperature of the prior, see `cool`; 1 is the papers'. A lower one makes clips that are
        more typical of their action and less varied.
    extra : mapping
        More metadata (training settings, metrics); must be JSON.

    Raises
    ------
    InputError
        The number of actions differs from that of `dataset`, or the temperature is not above 0 and
        at most 2.
    """
    if len(dataset.actions) != model.n_actions:
        raise InputError(
            f"the model knows {model.n_actions} actions, {dataset.name} has {len(dataset.actions)}"
        )
    demand_temperature(temperature)
    round_to_stored(model.cpu())
    graph = sequence_model(cool(model, temperature), dataset.frame.meters_per_unit)
    shrink(graph)
    save_model(
        graph,
        describe(
            model, dataset, license=license, extra={"temperature": temperature, **(extra or {})}
        ),
        path,
    )

"""Export of a trained motion VAE to one self-describing ONNX file.

The graph is the whole sampler: a Scan over frames around prior, generator, pose decoding and forward
kinematics, with the noise as an input, so that the same noise gives the same motion as in PyTorch. Recurrent
states and the previous pose are inputs and outputs: a run over one frame is the step that transitions,
outpainting and endless sequences are made of; a run over many frames is the fast way to whole clips.
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

from a2v.datasets import ActionDataset
from a2v.errors import InputError
from a2v.kinematics import inverse_kinematics
from a2v.kinematics.gradient import Turns, bone_ends, chain_frames, joint_positions
from a2v.motion.fused import generator_entry, generator_exit, gru_weights, joined
from a2v.motion.networks import MotionVAE
from export.storage import OPSET, SMALLEST_HALF, round_to_stored, save_model, shrink, to_onnx

FORMAT = "a2v-motion/1"


def _gru_step(gates: Tensor, state: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
    """New state (B, H) for ``weight_ih @ x + bias_ih`` (B, 3H), written out: it exports to a handful of nodes, which nn.GRU does not."""
    resets, updates, candidates = gates.chunk(3, 1)
    by_reset, by_update, by_candidate = nn.functional.linear(state, weight, bias).chunk(3, 1)
    candidate = torch.tanh(candidates + torch.sigmoid(resets + by_reset) * by_candidate)
    return candidate + torch.sigmoid(updates + by_update) * (state - candidate)


class StepGraph(nn.Module):
    """One frame: what the Scan repeats. States are (B, H) each; see `MotionVAE.step` for the meaning.

    For one clip it is the number of nodes that costs: layers without a non-linearity between them are one product, and
    what can be done for all frames at once is left to `RotationsGraph`.
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
        """New (previous, prior, low, high, trajectory), native units, and but for the plain decoder the turns (B, 3 n), in the
        plan's order and from -1 to 1; `lengths` are (n, B)."""
        model, decoder = self.model, self.model.pose_decoder
        n, gru = model.skeleton.n_joints, model.generator.gru
        poses = previous.flatten(1)
        context = torch.cat([poses, action, time], -1)
        gates = nn.functional.linear(context, *joined(model.prior.encoder, *gru_weights(model.prior.gru, 0, "ih")))
        prior = _gru_step(gates, prior, *gru_weights(model.prior.gru, 0, "hh"))
        nets = model.prior.mu_net, model.prior.logvar_net
        moments = nn.functional.linear(prior, torch.cat([net.weight for net in nets]), torch.cat([net.bias for net in nets]))
        mean, logvar = moments.chunk(2, 1)
        latent = mean + torch.exp(0.5 * logvar) * noise
        gates = nn.functional.linear(torch.cat([context, latent], -1), *generator_entry(model))
        low = _gru_step(gates, low, *gru_weights(gru, 0, "hh"))
        high = _gru_step(nn.functional.linear(low, *gru_weights(gru, 1, "ih")), high, *gru_weights(gru, 1, "hh"))
        outputs = nn.functional.linear(high, *generator_exit(model))
        if decoder.lie_output is None:
            return outputs.reshape(-1, n, 3), prior, low, high, trajectory
        turns, rest = torch.tanh(outputs[:, : 3 * n - 3]), outputs[:, 3 * n - 3 :]
        frames = chain_frames(Turns.of((torch.pi * turns).T.reshape(n - 1, 3, -1)), decoder.plan)
        local = joint_positions(bone_ends(frames, lengths, decoder.plan), decoder.plan).flatten(0, 1).T
        root = rest
        if decoder.velocity_net is not None:
            trajectory, velocity = self._velocity(local, poses, rest, trajectory)
            root = previous[:, 0] + velocity
        joints = local.reshape(-1, n, 3) + root[:, None]
        return joints, prior, low, high, trajectory, turns

    def _velocity(self, local: Tensor, poses: Tensor, told: Tensor, trajectory: Tensor) -> tuple[Tensor, Tensor]:
        """GLMI-R's state and the root's velocity (B, 3), of local joints, the poses before (B, 3 J) and h^o."""
        decoder, size = self.model.pose_decoder, poses.shape[1]
        assert decoder.velocity_net is not None
        if decoder.velocity_gru is None:
            first, *rest = decoder.velocity_net.children()
        else:
            first, rest = decoder.velocity_in, [decoder.velocity_net]
        assert isinstance(first, nn.Linear)
        inputs = torch.cat([local, poses, told], -1)
        # poses count relative to their root: the root's columns take off what the others add
        before = first.weight[:, size : 2 * size]
        shared = before.reshape(len(before), -1, 3).sum(1)
        weight = torch.cat([first.weight[:, :size], before[:, :3] - shared, before[:, 3:], first.weight[:, 2 * size :]], 1)
        if decoder.velocity_gru is None:
            hidden = nn.functional.linear(inputs, weight, first.bias)
        else:
            into, offset = gru_weights(decoder.velocity_gru, 0, "ih")
            gates = nn.functional.linear(inputs, into @ weight, into @ first.bias + offset)
            hidden = trajectory = _gru_step(gates, trajectory, *gru_weights(decoder.velocity_gru, 0, "hh"))
        for layer in rest:
            hidden = layer(hidden)
        return trajectory, hidden


class RotationsGraph(nn.Module):
    """Rotation vectors (B, T, J, 3) of all frames: of the plain decoder's joints (B, T, J, 3), else of `StepGraph`'s turns."""

    def __init__(self, model: MotionVAE) -> None:
        super().__init__()
        self.skeleton, self.plain = model.skeleton, model.settings.decoder == "plain"
        self.places = model.pose_decoder.plan.joints.argsort().tolist()

    def forward(self, made: Tensor) -> Tensor:
        """See above."""
        if self.plain:
            return inverse_kinematics(made, self.skeleton)
        turns = torch.pi * made.reshape(*made.shape[:2], -1, 3)[:, :, self.places]
        return torch.cat([torch.zeros_like(turns[:, :, :1]), turns], 2)


def _rotations_model(model: MotionVAE, source: str) -> onnx.ModelProto:
    """`RotationsGraph` of the output `source` as ONNX, with dynamic batch and frames; what it adds to a graph has names of its own."""
    graph, n = RotationsGraph(model), model.skeleton.n_joints
    example = torch.randn(2, 3, n, 3) if graph.plain else torch.randn(2, 3, 3 * n - 3)
    sizes = {0: torch.export.Dim("batch", min=1), 1: torch.export.Dim("frames", min=1)}
    proto = to_onnx(graph, (example,), [source], ["rotations"], [sizes])
    return onnx.compose.add_prefix(proto, "rotations/", rename_inputs=False, rename_outputs=False)


STATE_NAMES = ("previous", "prior", "low", "high", "trajectory")


def _step_model(model: MotionVAE) -> onnx.ModelProto:
    """The step as ONNX, with a dynamic batch."""
    batch, joints, hidden = 2, model.skeleton.n_joints, model.settings.hidden_size
    arguments = (
        torch.randn(batch, joints, 3), *(torch.randn(batch, hidden) for _ in range(4)), torch.randn(batch, model.settings.latent_size),
        torch.randn(batch, model.n_actions), torch.rand(batch, 1), torch.rand(joints - 1, batch),
    )  # fmt: skip
    names = [*STATE_NAMES, "noise", "action", "time", "lengths"]
    outputs = [f"{name}_out" for name in STATE_NAMES]
    if model.settings.decoder != "plain":
        outputs.append("frame_turns")
    dynamic = torch.export.Dim("batch", min=1)
    sizes = [{int(name == "lengths"): dynamic} for name in names]
    # products of weights are left to onnxruntime: folded here, they would be rounded a second time when they are stored
    return to_onnx(StepGraph(model).eval(), arguments, names, outputs, sizes, fold_below=SMALLEST_HALF)


def _hoist(body: onnx.GraphProto) -> list[onnx.NodeProto]:
    """Take what depends on weights alone out of a Scan's body, for the graph around it."""
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


def sequence_model(model: MotionVAE, metres_per_unit: float) -> onnx.ModelProto:
    """The whole-sequence graph: a Scan of the step over frames, then metres."""
    step = _step_model(model.eval())
    plan = model.pose_decoder.plan
    joints, hidden, latent = model.skeleton.n_joints, model.settings.hidden_size, model.settings.latent_size
    body = onnx.GraphProto()
    body.CopyFrom(step.graph)
    # what the Scan keeps of every frame: the joints, which are also a state, and the turns if there are any
    body.node.append(helper.make_node("Identity", [body.output[0].name], ["frame_joints"]))
    body.output.insert(len(STATE_NAMES), onnx.ValueInfoProto(name="frame_joints", type=body.output[0].type))
    made = ["native_joints", "turns"][: len(body.output) - len(STATE_NAMES)]
    turning = _rotations_model(model, made[-1])
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
        "metres_per_unit": np.array(metres_per_unit, np.float32),
        "axis2": np.array([2], np.int64),
        "root_index": np.array(0, np.int64),
        "plan_joints": plan.joints.numpy(),
    }
    nodes = [
        helper.make_node("OneHot", ["actions", "depth", "off_on"], ["action_onehot"], axis=-1),
        helper.make_node("Unsqueeze", ["time", "axis2"], ["time_column"]),
        helper.make_node("Transpose", ["bone_lengths"], ["every_length"], perm=[1, 0]),
        helper.make_node("Gather", ["every_length", "plan_joints"], ["lengths"], axis=0),
        *folded,
        scan,
        *turning.graph.node,
        helper.make_node("Mul", ["native_joints", "metres_per_unit"], ["joints"]),
        helper.make_node("Gather", ["joints", "root_index"], ["root"], axis=2),
    ]

    def value(name: str, shape: list[Any], kind: int = TensorProto.FLOAT) -> onnx.ValueInfoProto:
        return helper.make_tensor_value_info(name, kind, shape)

    states = [value("previous", ["batch", joints, 3]), *(value(name, ["batch", hidden]) for name in STATE_NAMES[1:])]
    inputs = [
        value("noise", ["batch", "frames", latent]),
        value("actions", ["batch", "frames"], TensorProto.INT64),
        value("time", ["batch", "frames"]),
        value("bone_lengths", ["batch", joints]),
        *states,
    ]
    outputs = [
        value("joints", ["batch", "frames", joints, 3]),
        value("rotations", ["batch", "frames", joints, 3]),
        value("root", ["batch", "frames", 3]),
        value("last_previous", ["batch", joints, 3]),
        *(value(f"last_{name}", ["batch", hidden]) for name in STATE_NAMES[1:]),
    ]
    graph = helper.make_graph(
        nodes,
        "a2v_motion",
        inputs,
        outputs,
        initializer=[
            *weights,
            *turning.graph.initializer,
            *(numpy_helper.from_array(array, name) for name, array in constants.items()),
        ],
    )
    result = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="a2v", ir_version=10)
    onnx.checker.check_model(result, full_check=False)
    return result


def describe_data(dataset: ActionDataset, *, licence: str) -> dict[str, Any]:
    """Metadata that every exported motion model has: actions, rates, skeleton, units, licence."""
    skeleton = dataset.skeleton
    return {
        "dataset": dataset.name,
        "dataset_digest": dataset.digest,
        "actions": list(dataset.actions),
        "fps": dataset.fps,
        "frames": dataset.length,
        "skeleton": {
            "name": skeleton.name,
            "joint_names": list(skeleton.joint_names),
            "parents": skeleton.parents.tolist(),
            "chains": [list(chain) for chain in skeleton.chains],
            "rest_directions": np.round(skeleton.rest_directions, 9).tolist(),
        },
        "bone_lengths": np.round(np.median(dataset.clip_bone_lengths, axis=0).astype(float), 6).tolist(),
        "metres_per_unit": dataset.frame.metres_per_unit,
        "native_signs": list(dataset.frame.signs),
        "licence": licence,
    }


def describe(model: MotionVAE, dataset: ActionDataset, *, licence: str, extra: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The metadata that makes the file usable alone."""
    return describe_data(dataset, licence=licence) | {
        "format": FORMAT,
        "decoder": model.settings.decoder,
        "latent_size": model.settings.latent_size,
        "hidden_size": model.settings.hidden_size,
        **(extra or {}),
    }


def demand_temperature(temperature: float) -> None:
    """Raise InputError unless `temperature` is above 0 and at most 2."""
    if not 0 < temperature <= 2:
        raise InputError(f"temperature is {temperature}; expected a number above 0 and at most 2")


def cooled(model: MotionVAE, temperature: float) -> MotionVAE:
    """A copy of `model` whose prior draws latents with `temperature` times its standard deviation.

    Raises
    ------
    InputError
        The temperature is not above 0 and at most 2.
    """
    demand_temperature(temperature)
    copied = copy.deepcopy(model)
    with torch.no_grad():
        copied.prior.logvar_net.bias.add_(2 * math.log(temperature))
    return copied


def export_motion(
    model: MotionVAE,
    dataset: ActionDataset,
    path: str | os.PathLike[str],
    *,
    licence: str,
    temperature: float = 1.0,
    extra: Mapping[str, Any] | None = None,
) -> None:
    """Write the ONNX file of `model`, whose weights are rounded in place to what is stored.

    Parameters
    ----------
    model : MotionVAE
    dataset : ActionDataset
        What it was trained on: gives actions, skeleton, rates and default bone lengths.
    path : path
    licence : str
        Licence of the weights, shown to users.
    temperature : float
        Of the prior, see `cooled`; 1 is the papers'. Less makes clips that are more typical of their action, and less varied.
    extra : mapping
        More metadata (training settings, metrics); must be JSON.
    """
    if len(dataset.actions) != model.n_actions:
        raise InputError(f"the model knows {model.n_actions} actions, {dataset.name} has {len(dataset.actions)}")
    demand_temperature(temperature)
    round_to_stored(model.cpu())
    graph = sequence_model(cooled(model, temperature), dataset.frame.metres_per_unit)
    shrink(graph)
    save_model(graph, describe(model, dataset, licence=licence, extra={"temperature": temperature, **(extra or {})}), path)

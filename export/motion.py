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
from a2v.kinematics import Skeleton, inverse_kinematics
from a2v.motion.networks import MotionVAE, gru_step
from export.storage import OPSET, round_to_stored, save_model, shrink

FORMAT = "a2v-motion/1"


class _OneFrameGRU(nn.Module):
    """Stands in for GLMI-R's GRU over a single frame."""

    def __init__(self, gru: nn.GRU) -> None:
        super().__init__()
        self.gru = gru

    def forward(self, inputs: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Output (B, 1, H) and state (1, B, H) of inputs (B, 1, D)."""
        new = gru_step(self.gru, 0, inputs[:, 0], state[0])
        return new[:, None], new[None]


class StepGraph(nn.Module):
    """One frame: what the Scan repeats. States are (B, H) each; see `MotionVAE.step` for the meaning."""

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
        """New (previous, prior, low, high, trajectory) and (joints, rotations) (B, J, 3) of the frame, native units."""
        model = self.model
        batch = previous.shape[0]
        context = torch.cat([previous.reshape(batch, -1), action, time], -1)
        prior = gru_step(model.prior.gru, 0, model.prior.encoder(context), prior)
        latent = model.prior.mu_net(prior) + torch.exp(0.5 * model.prior.logvar_net(prior)) * noise
        low = gru_step(model.generator.gru, 0, model.generator.encoder(torch.cat([context, latent], -1)), low)
        high = gru_step(model.generator.gru, 1, low, high)
        outputs = model.generator.decoder(high)
        decoder = model.pose_decoder
        gru = decoder.velocity_gru
        if gru is None:
            pose = decoder(outputs[:, None], previous[:, None], lengths)
        else:
            decoder.velocity_gru = _OneFrameGRU(gru)  # type: ignore[assignment]
            try:
                pose = decoder(outputs[:, None], previous[:, None], lengths, trajectory[None])
            finally:
                decoder.velocity_gru = gru
            trajectory = pose.state[0]
        joints = pose.joints[:, 0]
        # the plain decoder knows no rotations: `sequence_model` finds them for all frames at once
        rotations = joints if pose.rotations is None else pose.rotations[:, 0]
        return joints, prior, low, high, trajectory, joints, rotations


class RotationsGraph(nn.Module):
    """Rotation vectors (B, T, J, 3) of joints (B, T, J, 3)."""

    def __init__(self, skeleton: Skeleton) -> None:
        super().__init__()
        self.skeleton = skeleton

    def forward(self, native_joints: Tensor) -> Tensor:
        """See `inverse_kinematics`."""
        return inverse_kinematics(native_joints, self.skeleton)


def _rotations_model(skeleton: Skeleton) -> onnx.ModelProto:
    """`RotationsGraph` as ONNX, with dynamic batch and frames; what it adds to a graph has names of its own."""
    sizes = {"native_joints": {0: torch.export.Dim("batch", min=1), 1: torch.export.Dim("frames", min=1)}}
    program = torch.onnx.export(
        RotationsGraph(skeleton), (torch.randn(2, 3, skeleton.n_joints, 3),), dynamo=True, opset_version=OPSET,
        input_names=["native_joints"], output_names=["rotations"], dynamic_shapes=sizes, verbose=False,
    )  # fmt: skip
    assert program is not None
    return onnx.compose.add_prefix(program.model_proto, "rotations/", rename_inputs=False, rename_outputs=False)


STATE_NAMES = ("previous", "prior", "low", "high", "trajectory")


def _step_model(model: MotionVAE) -> onnx.ModelProto:
    """The step as ONNX, with a dynamic batch."""
    batch, joints, hidden = 2, model.skeleton.n_joints, model.settings.hidden_size
    arguments = (
        torch.randn(batch, joints, 3), *(torch.randn(batch, hidden) for _ in range(4)), torch.randn(batch, model.settings.latent_size),
        torch.randn(batch, model.n_actions), torch.rand(batch, 1), torch.rand(batch, joints),
    )  # fmt: skip
    names = [*STATE_NAMES, "noise", "action", "time", "lengths"]
    dynamic = torch.export.Dim("batch", min=1)
    program = torch.onnx.export(
        StepGraph(model).eval(),
        arguments,
        dynamo=True,
        opset_version=OPSET,
        input_names=names,
        output_names=[*(f"{name}_out" for name in STATE_NAMES), "frame_joints", "frame_rotations"],
        dynamic_shapes={
            name: {0: dynamic} for name in ("previous", "prior", "low", "high", "trajectory", "noise", "action", "time", "lengths")
        },
        verbose=False,
    )
    assert program is not None
    return program.model_proto


def sequence_model(model: MotionVAE, metres_per_unit: float) -> onnx.ModelProto:
    """The whole-sequence graph: a Scan of the step over frames, then metres."""
    step = _step_model(model.eval())
    plain = model.settings.decoder == "plain"
    turning = _rotations_model(model.skeleton) if plain else None
    joints, hidden, latent = model.skeleton.n_joints, model.settings.hidden_size, model.settings.latent_size
    body = onnx.GraphProto()
    body.CopyFrom(step.graph)
    weights = list(body.initializer)
    del body.initializer[:]
    body.name = "frame"
    for item in [*body.input, *body.output, *body.value_info]:
        item.type.tensor_type.ClearField("shape")
    # bone lengths are the same for every frame: the body reads them from the graph around it
    kept = [item for item in body.input if item.name != "lengths"]
    del body.input[:]
    body.input.extend(kept)
    for node in body.node:
        for i, name in enumerate(node.input):
            if name == "lengths":
                node.input[i] = "bone_lengths"
    scan = helper.make_node(
        "Scan",
        inputs=[*STATE_NAMES, "noise", "action_onehot", "time_column"],
        outputs=[*(f"last_{name}" for name in STATE_NAMES), "native_joints", "frame_rotations" if plain else "rotations"],
        body=body,
        num_scan_inputs=3,
        scan_input_axes=[1, 1, 1],
        scan_output_axes=[1, 1],
    )
    constants: dict[str, np.ndarray] = {
        "depth": np.array(model.n_actions, np.int64),
        "off_on": np.array([0, 1], np.float32),
        "metres_per_unit": np.array(metres_per_unit, np.float32),
        "axis2": np.array([2], np.int64),
        "root_index": np.array(0, np.int64),
    }
    nodes = [
        helper.make_node("OneHot", ["actions", "depth", "off_on"], ["action_onehot"], axis=-1),
        helper.make_node("Unsqueeze", ["time", "axis2"], ["time_column"]),
        scan,
        *(turning.graph.node if turning is not None else ()),
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
            *(turning.graph.initializer if turning is not None else ()),
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

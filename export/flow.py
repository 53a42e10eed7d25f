"""Export of a trained window flow to one self-describing ONNX file.

The graph maps noise to a whole window of joints. It contains the integration of the flow, decoding,
continuation of given frames and forward kinematics. Longer motions and transitions are windows that
continue one another.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn

from a2v.kinematics import bones_to_rotvecs
from a2v.kinematics.ground import face_forward, first_heading
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.motion.flow import GUIDANCE, FlowModel
from a2v.motion.card import WINDOW_FORMAT
from a2v.motion.features import ROOT_WEIGHT, window_features
from a2v.tracing import to_onnx
from export.description import describe_data
from export.motion import demand_temperature
from export.storage import round_to_stored, save_model, shrink

STEPS = 7
"""Number of integration steps; more do not change the metrics (docs/research/motion-flow.md)."""
FADE_SECONDS = 1.0
"""Time over which the difference between a window and the frames it continues fades out. If it is
shorter, motion rushes after each join (docs/research/motion-flow.md)."""


class WindowGraph(nn.Module):
    """Map noise and condition to a window of joints."""

    mean: Tensor
    basis: Tensor
    context_mean: Tensor
    context_basis: Tensor
    fade: Tensor
    path: Tensor

    def __init__(
        self,
        model: FlowModel,
        dataset: ActionDataset,
        *,
        steps: int,
        guidance: float,
        temperature: float = 1.0,
        guided_until: float = 1.0,
    ) -> None:
        super().__init__()
        codec = model.codec
        self.network, self.skeleton, self.steps = model.network, dataset.skeleton, steps
        self.guidance, self.guided_until, self.temperature = guidance, guided_until, temperature
        self.frames, self.context_frames, self.meters_per_unit = (
            codec.frames,
            codec.context_frames,
            dataset.frame.meters_per_unit,
        )
        self.register_buffer("mean", torch.from_numpy(codec.window.mean))
        self.register_buffer(
            "basis", torch.from_numpy(codec.window.basis * codec.window.scale[:, None])
        )
        self.register_buffer("context_mean", torch.from_numpy(codec.context.mean))
        self.register_buffer(
            "context_basis",
            torch.from_numpy((codec.context.basis * codec.context.inverse_scale[:, None]).T.copy()),
        )
        # the fade ends before the frames that a next window continues
        fade_frames = max(
            1, min(round(FADE_SECONDS * dataset.fps), codec.frames - 2 * codec.context_frames)
        )
        after = np.clip(
            (np.arange(codec.frames) - codec.context_frames + 1) / (fade_frames + 1), 0, 1
        )
        fade = 0.5 * (1 + np.cos(np.pi * after))  # 1 over the given frames, then falling to 0
        self.register_buffer("fade", torch.from_numpy(fade.astype(np.float32))[None, :, None])
        self.register_buffer(
            "path", torch.from_numpy(dataset.skeleton.path_matrix[:, 1:].astype(np.float32))
        )

    def forward(
        self,
        noise: Tensor,
        actions: Tensor,
        active: Tensor,
        context: Tensor,
        has_context: Tensor,
        bone_lengths: Tensor,
        measure: Tensor | None = None,
        gain: Tensor | None = None,
        goal: Tensor | None = None,
    ) -> tuple[Tensor, Tensor]:
        """Joints (meters) and rotations (B, T, J, 3).

        Parameters
        ----------
        noise : (B, D)
        actions : (B,) int64
        active : (B,)
            Share of the window in motion.
        context : (B, P, J, 3)
            Frames to continue, meters; only their motion relative to their first root counts.
        has_context : (B,)
            1 to continue `context`, 0 to start without it.
        bone_lengths : (B, J)
            Native units.
        measure, gain : (K, D)
            Constraints (`a2v.motion.steer`): the linear measurement of a code, and the gain that
            corrects a code by the error of its measurement, as in a Kalman filter.
        goal : (B, K) or (1, K)
            Target of the measurement. None: no constraints. The exported graph then has a single
            constraint of zeros.
        """
        moved = (context - context[:, :1, :1]) / self.meters_per_unit
        heading = self._heading(moved, has_context)
        if heading is not None:
            moved = face_forward(moved, heading)
        given = window_features(moved, self.skeleton)
        code = (given.flatten(1) - self.context_mean) @ self.context_basis
        condition = self.network.condition(actions, active, code, has_context)
        nothing = torch.full_like(actions, self.network.n_actions)
        without = self.network.condition(nothing, active, code, has_context)
        window = self.network.integrate(
            self.temperature * noise, condition, without, steps=self.steps, guidance=self.guidance, guided_until=self.guided_until,
            steer=None if measure is None or gain is None or goal is None else lambda code: code + (goal - code @ measure.T) @ gain,
        )  # fmt: skip
        features = (window @ self.basis + self.mean).reshape(
            noise.shape[0], self.frames, 3 * self.skeleton.n_joints
        )
        # the given frames exactly, then a fade of the window's miss at the last of them
        missed = given - features[:, : self.context_frames]
        held = torch.cat(
            [missed, missed[:, -1:].expand(-1, self.frames - self.context_frames, -1)], 1
        )
        features = features + has_context[:, None, None] * self.fade * held
        if heading is not None:
            back = heading * heading.new_tensor([1.0, -1.0])
            features = face_forward(features.reshape(*features.shape[:2], -1, 3), back).flatten(2)
        root = (features[..., :3] - features[:, :1, :3]) / ROOT_WEIGHT
        # from here on all frames of all clips come last: operations along rows of three cost
        # onnxruntime several times as much
        n, size = self.skeleton.n_joints, (noise.shape[0], self.frames, self.skeleton.n_joints, 3)
        vectors = features[..., 3:].flatten(0, 1).T.reshape(n - 1, 3, -1)
        directions = vectors / torch.clamp(
            torch.sqrt((vectors * vectors).sum(1, keepdim=True)), min=1e-6
        )
        lengths = bone_lengths[:, 1:].T[:, None, :, None]
        bones = (directions.reshape(n - 1, 3, -1, self.frames) * lengths).reshape(n - 1, -1)
        joints = (self.path @ bones).reshape(n, 3, -1) + root.flatten(0, 1).T
        rotvec = bones_to_rotvecs(
            torch.cat([torch.zeros_like(bones[:1]), bones]).reshape(n, 3, -1), self.skeleton
        )
        made = (
            array.reshape(3 * n, -1).T.reshape(size)
            for array in (joints * self.meters_per_unit, rotvec)
        )
        return tuple(made)  # type: ignore[return-value]

    def _heading(self, context: Tensor, has_context: Tensor) -> Tensor | None:
        """Headings of windows, (B, 2) of cosine and sine: the context's, else straight ahead; None
        for flows that learned headings."""
        if not self.network.settings.face_forward:
            return None
        known = has_context[:, None]
        return known * first_heading(context, self.skeleton) + (1 - known) * context.new_tensor(
            [1.0, 0.0]
        )


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """How an exported flow is sampled; it is stored in the file's metadata.

    Attributes
    ----------
    steps : int
        Number of integration steps; see `FlowNetwork.integrate`.
    guidance, guided_until : float
        See `FlowNetwork.integrate`.
    temperature : float
        Factor on the noise: a lower one makes clips that are more typical of their action and less
        varied.
    """

    steps: int = STEPS
    guidance: float = GUIDANCE
    guided_until: float = 1.0
    temperature: float = 1.0


def export_flow(
    model: FlowModel,
    dataset: ActionDataset,
    path: str | os.PathLike[str],
    *,
    license: str,
    extra: Mapping[str, Any] | None = None,
    sampling: Sampling = Sampling(),
) -> None:
    """Write the ONNX file of `model`; its weights are rounded in place to the stored values.

    Parameters
    ----------
    model : FlowModel
    dataset : ActionDataset
        Training data of the model.
    path : path
    license : str
        License of the weights, shown to users.
    extra : mapping
        More metadata; must be JSON.
    sampling : Sampling

    Raises
    ------
    InputError
        The temperature is not above 0 and at most 2.
    """
    demand_temperature(sampling.temperature)
    graph = WindowGraph(model, dataset, **dataclasses.asdict(sampling)).cpu().eval()
    round_to_stored(graph)
    proto = _trace(graph, model)
    _make_optional(
        proto,
        {
            "measure": (1, model.codec.window.basis.shape[0]),
            "gain": (1, model.codec.window.basis.shape[0]),
            "goal": (1, 1),
        },
    )
    shrink(proto)
    _show(proto, {"basis": model.codec.window.basis.shape, "mean": model.codec.window.mean.shape})
    save_model(
        proto,
        describe_data(dataset, license=license)
        | describe_windows(model, dataset)
        | dataclasses.asdict(sampling)
        | dict(extra or {}),
        path,
    )


def describe_windows(model: FlowModel, dataset: ActionDataset) -> dict[str, Any]:
    """Metadata of flows besides `describe_data`: sizes, and the moving share of windows for each
    action."""
    shares = np.minimum(np.array([len(clip) for clip in dataset.joints]) / dataset.length, 1)
    return {
        "format": WINDOW_FORMAT,
        "decoder": "flow",
        "latent_size": model.network.settings.code_size,
        "window_frames": model.codec.frames,
        "context_frames": model.codec.context_frames,
        # moving share of a window before its clip ends: by action, one sorted entry per clip
        "steerable": True,
        **_headings(model, dataset),
        "active": [
            np.sort(np.round(shares[dataset.labels == label], 4)).tolist()
            for label in range(len(dataset.actions))
        ],
    }


def _headings(model: FlowModel, dataset: ActionDataset, *, windows: int = 48) -> dict[str, Any]:
    """First headings of the data's windows by action, for flows that learned windows that face
    +z."""
    if not model.network.settings.face_forward:
        return {}
    sampler, generator = ClipSampler(dataset, dataset.length), np.random.default_rng(0)
    found = []
    for label in range(len(dataset.actions)):
        clips = np.flatnonzero(dataset.labels == label)
        ahead = (
            first_heading(
                sampler.windows(generator.choice(clips, windows), generator), dataset.skeleton
            )
            if len(clips)
            else np.zeros((0, 2))
        )
        found.append(np.round(np.arctan2(ahead[:, 1], ahead[:, 0]).astype(float), 2).tolist())
    return {"headings": found}


def _trace(graph: WindowGraph, model: FlowModel) -> onnx.ModelProto:
    """Trace the graph to ONNX, with a dynamic batch."""
    joints, context, size = (
        graph.skeleton.n_joints,
        model.codec.context_frames,
        model.network.settings.code_size,
    )
    arguments = (
        torch.randn(2, size), torch.zeros(2, dtype=torch.int64), torch.rand(2), torch.randn(2, context, joints, 3),
        torch.rand(2), torch.rand(2, joints), torch.zeros(3, size), torch.zeros(3, size), torch.zeros(2, 3),
    )  # fmt: skip
    names = [
        "noise",
        "actions",
        "active",
        "context",
        "has_context",
        "bone_lengths",
        "measure",
        "gain",
        "goal",
    ]
    batch, wishes = torch.export.Dim("batch", min=1), torch.export.Dim("wishes", min=1)
    free: dict[str, dict[int, Any]] = {
        "measure": {0: wishes},
        "gain": {0: wishes},
        "goal": {0: batch, 1: wishes},
    }
    return to_onnx(
        graph,
        arguments,
        names,
        ["joints", "rotations"],
        [free.get(name, {0: batch}) for name in names],
    )


def _make_optional(proto: onnx.ModelProto, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Give inputs zeros of `shapes` as their defaults; axes of length 1 stay dynamic."""
    for name, shape in shapes.items():
        proto.graph.initializer.append(numpy_helper.from_array(np.zeros(shape, np.float32), name))
        item = next(item for item in proto.graph.input if item.name == name)
        for axis, length in enumerate(shape):
            if length == 1:
                item.type.tensor_type.shape.dim[axis].dim_param = f"{name}_{axis}"


def _show(proto: onnx.ModelProto, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Make weights additional outputs: code that steers from outside needs the meaning of a
    code."""
    for name, shape in shapes.items():
        proto.graph.output.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, shape))

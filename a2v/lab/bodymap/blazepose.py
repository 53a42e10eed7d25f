"""The landmark network of BlazePose as a torch module with trainable weights, which were trained on
real photographs.

It is BlazePose (Bazarevsky et al. 2020), the "full" landmark model of mediapipe's wheel, under
Apache-2.0 like the weights trained from it. The file is read with the TensorFlow Lite schema of the
same wheel.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.errors import InputError
from a2v.io import read_bytes
from a2v.types import FloatArray

FILE = "modules/pose_landmark/pose_landmark_full.tflite"
"""Path in mediapipe's folder."""
DIGEST = "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f"
"""SHA-256 of the file that the tensor numbers below refer to."""
INPUT = 0
"""Number of the tensor of the picture."""
LANDMARKS = 337
"""Number of the tensor of BlazePose's own landmarks (B, 195): u, v and depth in pixels of 256, and
two logits, of 39 points."""


@dataclass(frozen=True, kw_only=True)
class Operation:
    """One step of the graph; tensors are named by their numbers in the file.

    Attributes
    ----------
    kind : str
        "conv", "add", "pool" (maximum of 2 x 2), "double" (bilinear) or "flatten".
    inputs : tuple of int
    output : int
    weights : int
        Number of the convolution in the file, from 0; -1 for other layers.
    stride, groups : int
    padding : tuple of 4 int
        Left, right, top, bottom.
    clipped : bool
        Whether the result is clipped to [0, 6].
    """

    kind: str
    inputs: tuple[int, ...]
    output: int
    weights: int = -1
    stride: int = 1
    groups: int = 1
    padding: tuple[int, ...] = (0, 0, 0, 0)
    clipped: bool = False


@dataclass(frozen=True, eq=False)
class Graph:
    """Operations in the order of execution, and the arrays of the convolutions: ``w<number>`` (out,
    in, k, k), ``b<number>`` (out,)."""

    operations: tuple[Operation, ...]
    arrays: Mapping[str, FloatArray]

    def needed_for(self, outputs: Sequence[int]) -> tuple[Operation, ...]:
        """Return the operations that the tensors `outputs` depend on."""
        needed, kept = set(outputs), []
        for operation in reversed(self.operations):
            if operation.output in needed:
                kept.append(operation)
                needed.update(operation.inputs)
        return tuple(reversed(kept))


@lru_cache(maxsize=1)
def read_blazepose() -> Graph:
    """Read the graph in mediapipe's wheel, for pictures of 256 pixels.

    Raises
    ------
    InputError
        The wheel is missing, or has another version.
    """
    found = find_spec("mediapipe")
    if found is None or found.origin is None:
        raise InputError("mediapipe is not installed; make setup installs it")
    path = Path(found.origin).parent / FILE
    content = read_bytes(path, limit=1 << 24)
    if hashlib.sha256(content).hexdigest() != DIGEST:
        raise InputError(
            f"{path} is not the file of mediapipe 0.10.21; install that version (constraints.txt)"
        )
    from mediapipe.tasks.metadata import schema_py_generated as schema

    model: Any = schema.ModelT.InitFromObj(schema.Model.GetRootAs(content, 0))
    return _Reader(model, schema).graph()


class _Reader:
    """Converts TensorFlow Lite's operators to `Operation`. Half-precision weights become float32,
    and padding becomes part of the convolutions."""

    def __init__(self, model: Any, schema: Any) -> None:
        self.tensors, self.operators = model.subgraphs[0].tensors, model.subgraphs[0].operators
        names = {
            value: name
            for name, value in vars(schema.BuiltinOperator).items()
            if isinstance(value, int)
        }
        self.kinds = [
            names[max(code.builtinCode, code.deprecatedBuiltinCode)] for code in model.operatorCodes
        ]
        types = {
            schema.TensorType.FLOAT32: "<f4",
            schema.TensorType.FLOAT16: "<f2",
            schema.TensorType.INT32: "<i4",
        }
        self.constants: dict[int, np.ndarray] = {}
        for number, tensor in enumerate(self.tensors):
            data = model.buffers[tensor.buffer].data
            if data is not None:
                self.constants[number] = np.frombuffer(bytes(data), types[tensor.type]).reshape(
                    tensor.shape
                )
        self.clips = schema.ActivationFunctionType.RELU6
        self.same = schema.Padding.SAME
        self.padded: dict[int, tuple[int, tuple[int, ...]]] = {}
        self.arrays: dict[str, FloatArray] = {}

    def graph(self) -> Graph:
        """Return all operations except those that follow unused outputs (the softmax of the
        segmentation)."""
        found = [
            self._operation(self.kinds[operator.opcodeIndex], operator)
            for operator in self.operators
        ]
        return Graph(tuple(operation for operation in found if operation is not None), self.arrays)

    def _operation(self, kind: str, operator: Any) -> Operation | None:
        inputs, output, options = (
            tuple(operator.inputs.tolist()),
            int(operator.outputs[0]),
            operator.builtinOptions,
        )
        if kind == "DEQUANTIZE":
            self.constants[output] = self.constants[inputs[0]].astype(np.float32)
            return None
        if kind == "PAD":
            rows = self.constants[inputs[1]]
            self.padded[output] = inputs[0], tuple(int(number) for number in (*rows[2], *rows[1]))
            return None
        if kind in ("CONV_2D", "DEPTHWISE_CONV_2D"):
            return self._convolution(kind == "DEPTHWISE_CONV_2D", inputs, output, options)
        if kind == "ADD":
            return Operation(
                kind="add",
                inputs=inputs,
                output=output,
                clipped=options.fusedActivationFunction == self.clips,
            )
        plain = {"MAX_POOL_2D": "pool", "RESIZE_BILINEAR": "double", "RESHAPE": "flatten"}
        return (
            Operation(kind=plain[kind], inputs=inputs[:1], output=output) if kind in plain else None
        )

    def _convolution(
        self, depthwise: bool, inputs: tuple[int, ...], output: int, options: Any
    ) -> Operation:
        number = len(self.arrays) // 2
        weights = (
            self.constants[inputs[1]]
            .astype(np.float32)
            .transpose((3, 0, 1, 2) if depthwise else (0, 3, 1, 2))
        )
        self.arrays |= {
            f"w{number}": np.ascontiguousarray(weights),
            f"b{number}": self.constants[inputs[2]].astype(np.float32),
        }
        source, padding = self.padded.get(inputs[0], (inputs[0], (0, 0, 0, 0)))
        stride, kernel = int(options.strideH), weights.shape[2]
        if options.padding == self.same:  # TensorFlow puts odd padding at the right and the bottom
            size = int(self.tensors[source].shape[1])
            total = max((-(-size // stride) - 1) * stride + kernel - size, 0)
            padding = (total // 2, total - total // 2) * 2
        return Operation(
            kind="conv",
            inputs=(source,),
            output=output,
            weights=number,
            stride=stride,
            padding=padding,
            groups=weights.shape[0] if depthwise else 1,
            clipped=options.fusedActivationFunction == self.clips,
        )


class BlazePoseLayers(nn.Module):
    """The part of the graph for some output tensors.

    Its weights are the parameters ``numbers.w<number>`` and ``numbers.b<number>``.

    Parameters
    ----------
    outputs : sequence of int
        Tensors to compute, by their numbers in the file.
    """

    def __init__(self, outputs: Sequence[int]) -> None:
        super().__init__()
        graph = read_blazepose()
        self.outputs, self.operations = tuple(outputs), graph.needed_for(outputs)
        chosen = [
            f"{kind}{step.weights}"
            for step in self.operations
            if step.weights >= 0
            for kind in "wb"
        ]
        self.numbers = nn.ParameterDict(
            {name: nn.Parameter(torch.from_numpy(graph.arrays[name].copy())) for name in chosen}
        )
        last = {number: step.output for step in self.operations for number in step.inputs}
        self._free = {
            step.output: [
                n for n in set(step.inputs) if last[n] == step.output and n not in outputs
            ]
            for step in self.operations
        }

    def freeze_until(self, output: int) -> None:
        """Freeze the weights of all steps up to the one that computes the tensor `output`.

        The early layers have been trained on photographs.
        """
        for step in self.operations:
            if step.weights >= 0:
                for kind in "wb":
                    self.numbers[f"{kind}{step.weights}"].requires_grad_(False)
            if step.output == output:
                break

    def forward(self, pictures: Tensor) -> list[Tensor]:
        """Return the outputs, (B, C, H, W) or (B, C), for pictures (B, 3, 256, 256), RGB in [0,
        1]."""
        values = {INPUT: pictures}
        for step in self.operations:
            made = self._step(step, [values[number] for number in step.inputs])
            values[step.output] = functional.relu6(made) if step.clipped else made
            for number in self._free[step.output]:
                del values[number]
        return [values[number] for number in self.outputs]

    def _step(self, step: Operation, given: list[Tensor]) -> Tensor:
        if step.kind == "conv":
            weights, bias = self.numbers[f"w{step.weights}"], self.numbers[f"b{step.weights}"]
            left, right, top, bottom = step.padding
            if (left, top) == (right, bottom):
                return functional.conv2d(
                    given[0], weights, bias, step.stride, (top, left), 1, step.groups
                )
            return functional.conv2d(
                functional.pad(given[0], step.padding),
                weights,
                bias,
                step.stride,
                0,
                1,
                step.groups,
            )
        if step.kind == "add":
            return given[0] + given[1]
        if step.kind == "pool":
            return functional.max_pool2d(given[0], 2)
        if step.kind == "double":
            return functional.interpolate(
                given[0], scale_factor=2.0, mode="bilinear", align_corners=False
            )
        return given[0].flatten(1)

"""Store exported models as small files with a description and no traces of the exporting
machine."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn

from a2v.io import atomic_path

SMALLEST_HALF = 1024
"""Tensors of at least this many numbers are stored as float16."""
SMALLEST_BYTES = 16_384
"""The network's matrices of at least this many numbers are stored as bytes."""


def _stored_as_bytes(tensor_name: str, shape: Sequence[int]) -> bool:
    """Matrices of the network that are stored as bytes with one scale per row; the bases move
    joints directly and keep more digits."""
    return "network" in tensor_name and len(shape) == 2 and math.prod(shape) >= SMALLEST_BYTES


def round_to_stored(module: nn.Module) -> None:
    """Round weights in place to the values that `shrink` stores, so that storing loses nothing
    more.

    Small tensors keep float32: the frequencies of the time's waves must not move.
    """
    with torch.no_grad():
        for name, tensor in [*module.named_parameters(), *module.named_buffers()]:
            if not tensor.is_floating_point() or tensor.numel() < SMALLEST_HALF:
                continue
            if _stored_as_bytes(name, tensor.shape):
                scale = tensor.abs().amax(1, keepdim=True).clamp(min=1e-12) / 127
                tensor.copy_((tensor / scale).round() * scale)
            else:
                tensor.copy_(tensor.half().float())


def shrink(proto: onnx.ModelProto) -> None:
    """Store the network's matrices as bytes with one scale per row and other large tensors as
    float16; arithmetic stays float32.

    Casts and products with scales are constants that onnxruntime folds once when it opens the file.
    """
    graph = proto.graph
    unpacking = []
    for tensor in list(graph.initializer):
        if tensor.data_type != TensorProto.FLOAT or math.prod(tensor.dims) < SMALLEST_HALF:
            continue
        name, values = tensor.name, numpy_helper.to_array(tensor)
        if _stored_as_bytes(name, values.shape):
            scale = np.maximum(
                np.abs(values).max(1, keepdims=True), np.float32(1e-12)
            ) / np.float32(127)
            tensor.CopyFrom(
                numpy_helper.from_array(np.round(values / scale).astype(np.int8), f"{name}_bytes")
            )
            graph.initializer.append(
                numpy_helper.from_array(scale.astype(np.float32), f"{name}_scale")
            )
            unpacking.append(
                helper.make_node("Cast", [f"{name}_bytes"], [f"{name}_cast"], to=TensorProto.FLOAT)
            )
            unpacking.append(helper.make_node("Mul", [f"{name}_cast", f"{name}_scale"], [name]))
        else:
            tensor.CopyFrom(numpy_helper.from_array(values.astype(np.float16), f"{name}_half"))
            unpacking.append(
                helper.make_node("Cast", [f"{name}_half"], [name], to=TensorProto.FLOAT)
            )
    nodes = [*unpacking, *graph.node]
    del graph.node[:]
    graph.node.extend(nodes)


def save_model(
    proto: onnx.ModelProto, metadata: Mapping[str, Any], path: str | os.PathLike[str]
) -> None:
    """Write a graph with its description.

    The exporter's notes about the Python lines of each node are left out. They take more bytes than
    the weights of some models and contain paths of the training machine.
    """
    for node in proto.graph.node:
        del node.metadata_props[:]
        node.doc_string = ""
        for attribute in node.attribute:
            if attribute.HasField("g"):
                for inner in attribute.g.node:
                    del inner.metadata_props[:]
                    inner.doc_string = ""
    for value in [*proto.graph.value_info, *proto.graph.input, *proto.graph.output]:
        del value.metadata_props[:]
    helper.set_model_props(proto, {"a2v": json.dumps(metadata, sort_keys=True)})
    with atomic_path(path) as temporary:
        onnx.save(proto, temporary)

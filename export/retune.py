"""Another guidance and temperature for an exported window flow, whose weights stay: python -m export.retune IN.onnx OUT.onnx --guidance 3 --temperature 0.75."""

from __future__ import annotations

import argparse
import json
import os

import numpy as np
import onnx
from onnx import numpy_helper

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.motion.card import WINDOW_FORMAT
from export.motion import demand_temperature


def retune(source: str | os.PathLike[str], target: str | os.PathLike[str], *, guidance: float, temperature: float) -> None:
    """Write the flow of `source` as one that was exported with another guidance and temperature (see `export.flow.export_flow`).

    Raises
    ------
    InputError
        The file is no window flow, is not guided or has no temperature (1 leaves no trace in a graph), or a number is out of range.
    """
    demand_temperature(temperature)
    proto = onnx.load(os.fspath(source))
    entry = next((item for item in proto.metadata_props if item.key == "a2v"), None)
    said = json.loads(entry.value) if entry else {}
    if entry is None or said.get("format") != WINDOW_FORMAT:
        raise InputError(f"{source} is no window flow of a2v")
    if not guidance >= 0 or guidance == 1:
        raise InputError(f"guidance is {guidance}; expected a number from 0 on, not 1: without guidance the graph is another one")
    graph = proto.graph
    numbers = {item.name: numpy_helper.to_array(item) for item in graph.initializer}
    makers = {name: node for node in graph.node for name in node.output}

    def scaled(value: float) -> list[tuple[onnx.NodeProto, int]]:
        """Products with a number, and which of their inputs it is."""
        return [
            (node, side) for node in graph.node if node.op_type == "Mul" for side in (0, 1)
            if (by := numbers.get(node.input[side])) is not None and by.size == 1 and by.reshape(()) == np.float32(value)
        ]  # fmt: skip

    # free + guidance * (pushed - free) and temperature * noise, as the flow and its graph have them
    pushed = [at for at in scaled(said["guidance"]) if getattr(makers.get(at[0].input[1 - at[1]]), "op_type", "") == "Sub"]
    cooled = [at for at in scaled(said["temperature"]) if at[0].input[1 - at[1]] == "noise"]
    if not pushed or not cooled:
        raise InputError(f"{source} has no {'temperature' if pushed else 'guidance'} in its graph; export it with one")
    for found, name, value in ((pushed, "guidance", guidance), (cooled, "temperature", temperature)):
        graph.initializer.append(numpy_helper.from_array(np.array(value, np.float32), f"retuned_{name}"))
        for node, side in found:
            node.input[side] = f"retuned_{name}"
    used = {name for node in graph.node for name in node.input}
    for item in [item for item in graph.initializer if item.name not in used]:
        graph.initializer.remove(item)
    entry.value = json.dumps(said | {"guidance": guidance, "temperature": temperature}, sort_keys=True)
    with atomic_path(target) as temporary:
        onnx.save(proto, os.fspath(temporary))


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source")
    parser.add_argument("target")
    parser.add_argument("--guidance", type=float, required=True)
    parser.add_argument("--temperature", type=float, required=True)
    given = parser.parse_args()
    retune(given.source, given.target, guidance=given.guidance, temperature=given.temperature)


if __name__ == "__main__":
    main()

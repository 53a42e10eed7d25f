"""Change the guidance and the temperature of an exported window flow; its weights stay.

    python -m export.retune IN.onnx OUT.onnx --guidance 3 --temperature 0.75 [--actions factors.csv]

Guidance makes the clips of some actions similar and slow. The factors, a table of `action,factor`,
give such actions a higher temperature and lively actions a lower one.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
from collections.abc import Mapping, Sequence

import numpy as np
import onnx
from onnx import helper, numpy_helper

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.motion.card import WINDOW_FORMAT
from export.motion import demand_temperature


def retune(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    guidance: float,
    temperature: float,
    factors: Mapping[str, float] | None = None,
) -> None:
    """Rewrite the flow of `source` with another guidance and temperature (see
    `export.flow.export_flow`).

    Parameters
    ----------
    factors : mapping of str to float or None
        Factors on the temperature of some actions; None keeps those of `source`.

    Raises
    ------
    InputError
        The file is not a window flow, is not guided or has no temperature (a temperature of 1 is
        not in the graph), a number is out of range, or an action is unknown.
    """
    demand_temperature(temperature)
    proto = onnx.load(os.fspath(source))
    entry = next((item for item in proto.metadata_props if item.key == "a2v"), None)
    said = json.loads(entry.value) if entry else {}
    if entry is None or said.get("format") != WINDOW_FORMAT:
        raise InputError(f"{source} is not a window flow of a2v")
    if not guidance >= 0 or guidance == 1:
        raise InputError(
            f"guidance is {guidance}; expected a number of at least 0, but not 1: a model "
            "without guidance has another graph"
        )
    own = dict(said.get("temperature_factors", {}) if factors is None else factors)
    if unknown := sorted(set(own) - set(said["actions"])):
        raise InputError(f"{source} has no action '{unknown[0]}'; leave it out of the factors")
    for factor in own.values():
        demand_temperature(temperature * factor)
    graph = proto.graph
    numbers = {item.name: numpy_helper.to_array(item) for item in graph.initializer}
    makers = {name: node for node in graph.node for name in node.output}
    products = [(node, side) for node in graph.node if node.op_type == "Mul" for side in (0, 1)]
    # free + guidance * (pushed - free) and temperature * noise, as the flow and its graph have them
    pushed = [
        (node, side)
        for node, side in products
        if (by := numbers.get(node.input[side])) is not None
        and by.size == 1
        and by.reshape(()) == np.float32(said["guidance"])
        and getattr(makers.get(node.input[1 - side]), "op_type", "") == "Sub"
    ]
    cooled = [(node, side) for node, side in products if node.input[1 - side] == "noise"]
    if not pushed or not cooled:
        raise InputError(
            f"{source} has no {'temperature' if pushed else 'guidance'} in its graph; export the "
            "model with one"
        )
    by_action = np.array([temperature * own.get(name, 1.0) for name in said["actions"]], np.float32)
    values = {
        "guidance": np.array(guidance, np.float32),
        "temperature": by_action if own else np.array(temperature, np.float32),
    }
    for (name, value), found in zip(values.items(), (pushed, cooled), strict=True):
        _replace(graph, numpy_helper.from_array(value, f"retuned_{name}"), found)
    told = {"guidance": guidance, "temperature": temperature, "temperature_factors": own}
    entry.value = json.dumps(
        {**said, **told}
        if own
        else {
            name: value for name, value in {**said, **told}.items() if name != "temperature_factors"
        },
        sort_keys=True,
    )
    with atomic_path(target) as temporary:
        onnx.save(proto, os.fspath(temporary))


def _replace(
    graph: onnx.GraphProto, number: onnx.TensorProto, products: Sequence[tuple[onnx.NodeProto, int]]
) -> None:
    """Put a number, or one per action, into products; constants that are no longer used are
    removed."""
    name = number.name
    for node in [node for node in graph.node if node.name.startswith(f"{name}_")]:
        graph.node.remove(node)
    for item in [item for item in graph.initializer if item.name in (name, f"{name}_axis")]:
        graph.initializer.remove(item)
    graph.initializer.append(number)
    given = name
    if number.dims:
        given = f"{name}_column"
        graph.initializer.append(numpy_helper.from_array(np.array([1], np.int64), f"{name}_axis"))
        graph.node.insert(
            0,
            helper.make_node(
                "Unsqueeze", [f"{name}_own", f"{name}_axis"], [given], name=f"{name}_unsqueeze"
            ),
        )
        graph.node.insert(
            0, helper.make_node("Gather", [name, "actions"], [f"{name}_own"], name=f"{name}_gather")
        )
    for node, side in products:
        node.input[side] = given
    used = {needed for node in graph.node for needed in node.input}
    for item in [item for item in graph.initializer if item.name not in used]:
        graph.initializer.remove(item)


def read_factors(path: str | os.PathLike[str]) -> dict[str, float]:
    """Read the table `action,factor` of a file."""
    with open(path, newline="", encoding="utf-8") as stream:
        return {row["action"]: float(row["factor"]) for row in csv.DictReader(stream)}


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source")
    parser.add_argument("target")
    parser.add_argument("--guidance", type=float, required=True)
    parser.add_argument("--temperature", type=float, required=True)
    parser.add_argument("--actions", help="table of action,factor")
    given = parser.parse_args()
    factors = read_factors(given.actions) if given.actions else None
    retune(
        given.source,
        given.target,
        guidance=given.guidance,
        temperature=given.temperature,
        factors=factors,
    )


if __name__ == "__main__":
    main()

"""Small numeric nodes with the shape of the real graph: singles, a fan-out over frames and over
views, joins."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.record import Record
from pipelines.engine.graph import Step
from pipelines.engine.memo import measure, memo, note, progress
from pipelines.engine.refs import Ref
from pipelines.engine.store import get, put


@dataclass(frozen=True, kw_only=True)
class Numbers(Record):
    values: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Words(Record):
    text: str


@dataclass(frozen=True)
class Scale:
    factor: float = 2.0


def _log(name: str) -> None:
    """One line for every time that a node's body really runs, in whatever process."""
    if folder := os.environ.get("A2V_TEST_LOG"):
        with open(Path(folder) / "log", "a") as stream:
            stream.write(name + "\n")


@memo()
def base(length: int, scale: Scale) -> Ref[Numbers]:
    _log("base")
    progress()(1, 1)
    note("numbers are fine")
    measure({"length": np.int64(length), "parts": {"factor": np.float32(scale.factor)}})
    return put(Numbers(values=np.arange(length) * scale.factor))


@memo()
def item(base: Ref[Numbers]) -> list[Ref[Numbers]]:
    _log("item")
    return [put(Numbers(values=value[None])) for value in get(base, Numbers).values]


@memo()
def square(item: Ref[Numbers]) -> Ref[Numbers]:
    _log("square")
    return put(Numbers(values=get(item, Numbers).values ** 2))


@memo()
def shift(square: np.ndarray, views: tuple[int, ...]) -> np.ndarray:
    _log("shift")
    shifts = np.empty((len(square), len(views)), dtype=object)
    for t in range(len(square)):
        for c, view in enumerate(views):
            shifts[t, c] = put(Numbers(values=np.array([float(view)])))
    return shifts


@memo()
def cell(square: Ref[Numbers], shift: Ref[Numbers], wait: float) -> Ref[Numbers]:
    time.sleep(wait)
    _log("cell")
    return put(Numbers(values=get(square, Numbers).values + get(shift, Numbers).values))


@memo()
def column(cell: np.ndarray) -> Ref[Numbers]:
    _log("column")
    return put(
        Numbers(
            values=np.array([get(one, Numbers).values.sum() for one in cell]).sum(keepdims=True)
        )
    )


@memo()
def total(column: np.ndarray, cell: np.ndarray) -> Ref[Numbers]:
    _log("total")
    assert cell.shape[1] == len(column)
    return put(
        Numbers(
            values=np.array([get(one, Numbers).values.sum() for one in column]).sum(keepdims=True)
        )
    )


GRAPH = (
    Step(base, "base"),
    Step(item, "item", "... -> item[t]"),
    Step(square, "square", "item[t] -> square[t]"),
    Step(shift, "shift", "... -> shift[t, c]"),
    Step(cell, "cell", "square[t], shift[t, c] -> cell[t, c]"),
    Step(column, "column", "cell[:, c] -> column[c]"),
    Step(total, "total"),
)


def expected(length: int, factor: float, views: tuple[int, ...]) -> float:
    return float(sum((t * factor) ** 2 + view for t in range(length) for view in views))

"""Running graphs in parts."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.sessions import ROWS_AT_ONCE, run_rows


class Doubling:
    """Stands for a session; remembers how many rows each run had."""

    def __init__(self) -> None:
        self.rows: list[int] = []

    def run(self, names: list[str], feed: dict[str, np.ndarray]) -> list[np.ndarray]:
        self.rows.append(len(feed["x"]))
        return [{"twice": 2 * feed["x"], "sum": feed["x"] + feed["y"]}[name] for name in names]


@pytest.mark.parametrize("rows", [0, 1, ROWS_AT_ONCE, 2 * ROWS_AT_ONCE + 3])
def test_parts_are_put_together_in_order(rows):
    session = Doubling()
    x = np.random.default_rng(0).normal(size=(rows, 2, 3))
    y = np.arange(rows)[:, None, None] * np.ones((1, 2, 3))
    total, twice = run_rows(session, ["sum", "twice"], {"x": x, "y": y})
    assert np.array_equal(twice, 2 * x)
    assert np.array_equal(total, x + y)
    assert sum(session.rows) == rows
    assert max(session.rows) <= ROWS_AT_ONCE

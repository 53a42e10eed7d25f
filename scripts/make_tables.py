"""The commands that remake the tables of docs/results/motion_*.md; ``--run`` runs them, one after
the other.

Without arguments the commands are listed with what they make. Rows that a table's JSON file has of
the same weights, data and protocol are kept (`a2v evaluate`), so a second run is quick and a killed
one goes on.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Table:
    """A table of the papers: its name, the data set, the shipped models of its rows, and options."""

    name: str
    about: str
    dataset: str
    models: tuple[str, ...]
    more: tuple[str, ...] = ()

    def command(self, data: str, out: Path) -> list[str]:
        """The arguments of a2v."""
        rows = [part for model in self.models for part in ("--model", model)]
        return [
            "evaluate",
            "--dataset",
            self.dataset,
            "--data",
            data,
            *rows,
            *self.more,
            "--out",
            str(out / f"{self.name}.md"),
        ]


VAES = ("humanact12-plain", "humanact12-lie", "humanact12-glmi-m", "humanact12-glmi-r")
TABLES = (
    Table(
        "humanact12",
        "journal 1, conference 1: HumanAct12, both protocols",
        "humanact12",
        ("humanact12", *VAES),
    ),
    Table(
        "humanact12_fine", "journal 1: its 34 fine actions", "humanact12-fine", ("humanact12-fine",)
    ),
    Table(
        "cmu",
        "journal 2, conference 2: CMU, both protocols; journal 4: Walk and Jump",
        "cmu",
        ("cmu", "cmu-glmi-m", "cmu-glmi-r"),
        ("--actions", "Walk,Jump"),
    ),
)


def main() -> int:
    """List the commands, or run them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--run", action="store_true", help="run them (about an hour of a core each)"
    )
    parser.add_argument("--only", choices=[table.name for table in TABLES], help="one table")
    parser.add_argument("--data", default="../shared/data")
    parser.add_argument("--out", type=Path, default=Path("runs/tables"))
    parser.add_argument(
        "--model",
        action="append",
        default=[],
        help="one more row: an .onnx or a baseline.pt of the table's data set",
    )
    parser.add_argument("--repeats", type=int, default=20)
    options = parser.parse_args()
    if options.model and options.only is None:
        parser.error("--model is a row of one table: name it with --only")
    for table in TABLES:
        if options.only not in (None, table.name):
            continue
        more = [part for model in options.model for part in ("--model", model)]
        command = [
            *table.command(options.data, options.out),
            *more,
            "--repeats",
            str(options.repeats),
        ]
        print(f"# {table.about}\na2v {' '.join(command)}", flush=True)
        if options.run:
            subprocess.run([sys.executable, "-m", "pipelines", *command], check=True, cwd=ROOT)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

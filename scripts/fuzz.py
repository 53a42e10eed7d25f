"""Try hostile inputs until there were CASES, in one process of pytest after the other.

Each process draws 60 cases of a kind with a seed of its own, because the memory of hypothesis grows
with what it has drawn. The numbers of all processes are added up in a table.

    python scripts/fuzz.py --cases 20000 --seed 1 --report docs/results/fuzz.md
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from tests.support.hostile import Tally

ROOT = Path(__file__).resolve().parents[1]
EACH = 60
"""Cases of a kind that one process draws."""


def main() -> int:
    """Return how many of the processes failed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=3000, help="inputs in all (default: 3000)")
    parser.add_argument(
        "--seed", type=int, default=1, help="seed of the first process (default: 1)"
    )
    parser.add_argument("--report", type=Path, help="Markdown file for the numbers")
    parser.add_argument("tests", nargs="*", default=["tests/fuzz"], help="default: tests/fuzz")
    options = parser.parse_args()
    tallies, whole, failed, seeds = defaultdict[str, Tally](Tally), Tally(), list[str](), 0
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / "told.json"
        while whole.cases < options.cases:
            seed = options.seed + seeds
            done = subprocess.run(
                [sys.executable, "-m", "pytest", *options.tests, f"--hypothesis-seed={seed}"],
                cwd=ROOT,
                env=os.environ | {"A2V_FUZZ": str(EACH), "A2V_FUZZ_REPORT": str(told)},
                check=False,
            )
            if not told.exists():  # nothing was tried
                return done.returncode or 1
            found = json.loads(told.read_text())
            told.unlink()
            seeds += 1
            failed += [f"{name} (seed {seed})" for name in found["failed"]]
            for name, counts in found["tests"].items():
                tallies[name].add(Tally(**counts))
                whole.add(Tally(**counts))
            if options.report:
                options.report.write_text(
                    page(tallies, whole, failed, f"{options.seed} to {seed}"), encoding="utf-8"
                )
    print(whole.sentence())
    return len(failed)


def page(tallies: dict[str, Tally], whole: Tally, failed: list[str], seeds: str) -> str:
    """The numbers as Markdown."""
    rows = [
        f"| {name} | {one.cases:,} | {one.refused:,} | {one.slowest:.2f} | {one.megabytes:.0f} "
        f"| {one.files:,} | {one.deleted:,} |"
        for name, one in sorted(tallies.items())
    ]
    return "\n".join(
        [
            "# Hostile inputs",
            "",
            f"`make fuzz CASES={whole.cases}`, seeds {seeds}, {EACH} cases of a kind in each "
            f"process: {whole.sentence()}.",
            "",
            f"Failed: {', '.join(failed) or 'none'}.",
            "",
            "| test | inputs | refused | slowest, s | MB at most | files written | deleted |",
            "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
            *rows,
            "",
        ]
    )


if __name__ == "__main__":
    sys.exit(min(main(), 1))

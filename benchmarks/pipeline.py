"""Measure time and memory of `a2v video` at its defaults: a first run on an empty store, then
another action for the same photo.

    python benchmarks/pipeline.py [--photo P] [--frames 60] [--size 512] [--out out/bench.json]

The bar: at most 6 minutes and 4 GB for 60 frames, four views, 512 px on two cores; the second run
reuses the character.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def once(photo: Path, action: str, frames: int, size: int, cache: Path, out: Path) -> dict:
    """Run `a2v video` once; return its report."""
    words = [
        "--photo",
        photo,
        "--action",
        action,
        "--frames",
        frames,
        "--size",
        size,
        "--cache",
        cache,
        "--out",
        out,
        "--quiet",
    ]
    subprocess.run(
        [sys.executable, "-m", "pipelines", "video", *map(str, words)],
        cwd=ROOT,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return json.loads((out / "report.json").read_text())


def main() -> None:
    """Run it twice and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--photo", type=Path, default=ROOT / "a2v" / "samples" / "person.jpg")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--out", type=Path, default=None)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        runs = {
            name: once(
                given.photo,
                action,
                given.frames,
                given.size,
                Path(folder) / "store",
                Path(folder) / name,
            )
            for name, action in (("first", "Walk"), ("second", "Jump"))
        }
    first, second = runs["first"], runs["second"]
    print(
        f"{'node':<12}{'calls':>6}{'first: s':>10}{'cpu s':>8}{'wall s':>8}{'peak MB':>9}{'second: s':>11}{'wall s':>8}{'remembered':>12}"
    )
    for name, node in first["nodes"].items():
        later = second["nodes"].get(name, {"seconds": 0, "span_seconds": 0, "remembered": 0})
        print(
            f"{name:<12}{node['calls']:>6}{node['seconds']:>10.1f}{node['cpu_seconds']:>8.1f}{node['span_seconds']:>8.1f}{node['peak_memory_mb']:>9.0f}"
            f"{later['seconds']:>11.1f}{later['span_seconds']:>8.1f}{later['remembered']:>12}"
        )
    print(
        f"{'all':<12}{'':>6}{'':>18}{first['seconds']:>8.1f}{first['peak_memory_mb']:>9.0f}{'':>11}{second['seconds']:>8.1f}"
    )
    print(
        f"{first['machine']['cores']} cores, {given.frames} frames, "
        f"{len(first['parameters']['render']['views'])} views, {given.size} px"
    )
    if given.out:
        given.out.parent.mkdir(parents=True, exist_ok=True)
        given.out.write_text(json.dumps(runs, indent=2) + "\n")


if __name__ == "__main__":
    main()

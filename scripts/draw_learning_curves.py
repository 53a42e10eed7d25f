"""Draw the learning curves of trained systems: the FID in each run's log.csv over its iterations.

    python scripts/draw_learning_curves.py runs/act runs/latent --out docs/results/curves.png

Each run is a folder of `a2v train baseline` or `a2v train motion` that was started with
--evaluator. A dotted line shows the published FID of the same system. Beside the picture, a table
of the same name (.csv) has the values.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from a2v.lab.evaluation.published import PUBLISHED


def read_curve(run: Path) -> list[tuple[int, float, float]]:
    """Return iteration, FID and accuracy of each line of a run's log.csv that has an FID."""
    with (run / "log.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row.get("fid")]
    return [(int(float(r["iteration"])), float(r["fid"]), float(r["accuracy"])) for r in rows]


def published_fid(name: str, dataset: str) -> float | None:
    """Return the published FID of the system whose name is `name`, or None."""
    plain = name.replace("-", "").lower()
    for system, values in PUBLISHED[dataset].items():
        if system.replace("-", "").replace(" ", "").lower() == plain:
            return values[0]
    return None


def main() -> int:
    """Draw the curves and write their values."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path, help="folders named after their systems")
    parser.add_argument("--dataset", default="humanact12", choices=sorted(PUBLISHED))
    parser.add_argument("--out", type=Path, required=True, help="picture, .png or .svg")
    options = parser.parse_args()
    figure, ax = plt.subplots(figsize=(7, 3.6))
    lines = ["system,iteration,fid,accuracy"]
    for index, run in enumerate(options.runs):
        curve, color = read_curve(run), f"C{index}"
        if not curve:
            parser.error(f"{run}/log.csv has no FID; train with --evaluator")
        lines += [f"{run.name},{t},{fid:.3f},{accuracy:.3f}" for t, fid, accuracy in curve]
        iterations, fids, _ = zip(*curve, strict=True)
        ax.plot(iterations, fids, "o-", c=color, ms=3, lw=1, label=run.name)
        published = published_fid(run.name, options.dataset)
        if published is not None:
            ax.axhline(published, c=color, ls=":", lw=1)
    ax.set(xlabel="iteration", ylabel="FID of 600 samples", yscale="log", title=options.dataset)
    ax.legend(fontsize=8, title="dotted: published", title_fontsize=8)
    figure.tight_layout()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(options.out, dpi=110)
    options.out.with_suffix(".csv").write_text("\n".join(lines) + "\n")
    print(options.out)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

"""Train the network that completes heads (`a2v.reconstruction.coloring.completing`).

    python scripts/fit_heads.py --data ../shared/data --out runs/heads --guides runs/bodymap/views

Charts of the heads of the studio's training split are made once (``training.npz``, ten minutes):
VALID's avatars and `--people` of MakeHuman's. Each example is such a head in other colors, with more
or less hair, photographed from some side and projected on a head with the errors of a fit
(`a2v.lab.heads.imitated`). A stopped training goes on. ``runs/heads`` gets ``person_heads.onnx``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from a2v.body.head_chart import HEIGHT, WIDTH
from a2v.io import read_npz
from a2v.lab.heads.charts import HeadCharts, make_charts
from a2v.lab.heads.imitated import HeadImitator
from a2v.lab.heads.networks import HeadCompleter
from a2v.lab.heads.training import HeadSettings, losses, train_heads
from a2v.lab.studio.avatar_files import list_avatars
from a2v.lab.studio.guide import prepare_guides, unstack_guides
from a2v.reconstruction.coloring.completing import CHANNELS, FILE, FORMAT
from a2v.tracing import to_onnx
from export.storage import round_to_stored, save_model, shrink


def charts_of(split: str, options: argparse.Namespace, people: int) -> HeadCharts:
    """The charts of a split, made unless they exist."""
    path = options.out / f"{split}.npz"
    if not path.exists():
        prepare_guides(list_avatars(Path(options.data) / "avatars"), options.guides)
        guides = unstack_guides(read_npz(options.guides / "guide.npz"))
        with tqdm(desc=split) as bar:

            def progress(done: int, total: int | None) -> None:
                bar.total = total
                bar.update(done - bar.n)

            make_charts(options.data, guides, split, people=people, progress=progress).save(path)
    return HeadCharts.load(path)


def validated(network: HeadCompleter, charts: HeadCharts, count: int = 200) -> dict[str, float]:
    """Mean losses over `count` examples of other heads."""
    imitator, generator = HeadImitator(charts), np.random.default_rng(1)
    found: dict[str, list[float]] = {}
    for _ in range(count):
        chart, target = (torch.from_numpy(one)[None] for one in imitator.draw(generator))
        with torch.no_grad():
            for name, value in losses(network(chart), target, chart).items():
                found.setdefault(name, []).append(float(value))
    return {name: float(np.mean(values)) for name, values in found.items()}


def export(network: HeadCompleter, path: Path, **metadata: object) -> None:
    """Write the network to an ONNX file."""
    network.eval()
    round_to_stored(network)
    chart = torch.zeros(2, CHANNELS, HEIGHT, WIDTH)
    proto = to_onnx(network, (chart,), ["chart"], ["completed"], [{0: torch.export.Dim("count")}])
    shrink(proto)
    save_model(proto, {"format": FORMAT, "license": "Apache-2.0", **metadata}, path)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--guides", type=Path, required=True, help="folder of guide.npz")
    parser.add_argument("--people", type=int, default=260, help="people of MakeHuman's")
    parser.add_argument("--iterations", type=int, default=HeadSettings.iterations)
    options = parser.parse_args()
    charts = charts_of("training", options, options.people)
    settings = HeadSettings(iterations=options.iterations)
    with tqdm(total=settings.iterations) as bar:
        network = train_heads(
            charts,
            options.out,
            settings,
            on_log=lambda row: bar.update(int(row["iteration"]) - bar.n),
        )
    figures = validated(network, charts_of("validation", options, 12))
    print(figures)
    export(
        network, options.out / FILE.name, heads=len(charts.kinds), iterations=settings.iterations
    )


if __name__ == "__main__":
    main()

"""``a2v train baseline``: the systems that the papers compare with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.lab.motion.baselines import NAMES
from a2v.lab.motion.baselines.training import FILE, BaselineSettings, train_baseline
from pipelines.answer import Answer
from pipelines.lab.dataset_options import hold_out
from pipelines.lab.training import RESUMES, LearningOptions, training_bar
from pipelines.options import group

HELP = "Train one of the five systems that the papers compare with, to measure its row again."
EXAMPLES = f"""examples:
  a2v train baseline --name condgru --dataset humanact12 --data ../shared/data --out runs/condgru --iterations 4000 --threads 1
  a2v evaluate --dataset humanact12 --data ../shared/data --model runs/condgru/{FILE} --out table.md

--name is one of {", ".join(NAMES)}.
OUT gets {FILE} (every few minutes) and log.csv. {RESUMES}"""


@dataclass(frozen=True, kw_only=True)
class Options(LearningOptions):
    """What the command takes."""

    training: BaselineSettings = group(BaselineSettings)


def run(options: Options) -> Answer:
    """Train."""
    dataset, _ = hold_out(options.open(), options.held_out)
    chosen = options.training
    with training_bar(f"{dataset.name} {chosen.name}", chosen.iterations) as show:

        def on_log(row: dict[str, float]) -> None:
            show(
                row,
                {
                    name: value
                    for name, value in row.items()
                    if name in ("loss", "discriminator", "generator")
                },
            )

        train_baseline(dataset, options.out, settings=chosen, on_log=on_log)
    return Answer(files=[Path(options.out) / FILE])

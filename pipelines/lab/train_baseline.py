"""``a2v train baseline``: the systems that the papers compare with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.lab.evaluation.baselines import generator_of_baseline
from a2v.lab.evaluation.monitor import EVERY, quick_scores
from a2v.lab.motion.baselines import NAMES
from a2v.lab.motion.baselines.training import (
    FILE,
    BaselineSettings,
    BaselineTraining,
    train_baseline,
)
from pipelines.answer import Answer
from pipelines.lab.dataset_options import hold_out
from pipelines.lab.training import RESUMES, WatchedOptions, training_bar
from pipelines.options import group

HELP = "Train one of the five systems that the papers compare with, to measure its row again."
EXAMPLES = f"""examples:
  a2v train baseline --name condgru --dataset humanact12 --data ../shared/data --out runs/condgru --iterations 4000 --threads 1
  a2v evaluate --dataset humanact12 --data ../shared/data --model runs/condgru/{FILE} --out table.md

--name is one of {", ".join(NAMES)}. --evaluator writes the FID over the iterations into log.csv.
OUT gets {FILE} (every few minutes) and log.csv. {RESUMES}"""


@dataclass(frozen=True, kw_only=True)
class Options(WatchedOptions):
    """Options of the command."""

    training: BaselineSettings = group(BaselineSettings)


def run(options: Options) -> Answer:
    """Train the baseline."""
    dataset, _ = hold_out(options.open(), options.held_out)
    chosen, evaluator = options.training, options.watch(dataset)
    shown = ("loss", "discriminator", "generator")
    with training_bar(f"{dataset.name} {chosen.name}", chosen.iterations) as show:
        scores: dict[str, float] = {}

        def on_log(training: BaselineTraining, row: dict[str, float]) -> None:
            done = training.iteration
            if evaluator is not None and (
                done % (EVERY * chosen.log_every) == 0 or done == chosen.iterations
            ):
                generate = generator_of_baseline(training.trained(), dataset)
                scores.update(quick_scores(generate, dataset, evaluator))
                row |= scores
            show(row, {name: row[name] for name in shown if name in row} | scores)

        train_baseline(dataset, options.out, settings=chosen, on_log=on_log)
    return Answer(files=[Path(options.out) / FILE])

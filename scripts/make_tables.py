"""List the commands that remake the tables of docs/results/motion_*.md; ``--run`` runs them.

Without arguments the commands are listed with the tables that they make. `a2v evaluate` keeps the
rows of a table's JSON file that have the same weights, data and protocol, so a second run is quick
and a stopped run can resume. ``--trainings`` lists the commands that train the twelve VAEs, of which
four take several, one after the other, and the baselines, which are not shipped; ``--model`` adds
such weights to a table.
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


DECODERS = ("plain", "lie", "glmi-m", "glmi-r")
TABLES = (
    Table(
        "humanact12",
        "journal 1, conference 1: HumanAct12, both protocols",
        "humanact12",
        ("humanact12", *(f"humanact12-{decoder}" for decoder in DECODERS)),
    ),
    Table(
        "humanact12_fine",
        "journal 1: its 34 fine actions",
        "humanact12-fine",
        ("humanact12-fine", *(f"humanact12-fine-{decoder}" for decoder in DECODERS)),
    ),
    Table(
        "cmu",
        "journal 2, conference 2: CMU, both protocols; journal 4: Walk and Jump",
        "cmu",
        ("cmu", *(f"cmu-{decoder}" for decoder in DECODERS)),
        ("--actions", "Walk,Jump"),
    ),
)


@dataclass(frozen=True)
class Training:
    """The training of a shipped VAE, or of a baseline: `words` follow `a2v train`, and all seeds are
    0 (docs/results/baselines.md, docs/research/motion-vae.md). It starts from the weights of the
    training of the same data set that `initial` names."""

    name: str
    dataset: str
    words: str
    initial: str = ""

    def command(self, data: str) -> list[str]:
        """The arguments of a2v."""
        kind, *options = self.words.split()
        out = f"runs/{self.dataset}-{self.name}"
        common = f"--threads 1 --seed 0 --dataset {self.dataset} --data {data} --out {out}"
        before = f"--initial runs/{self.dataset}-{self.initial}/checkpoint.pt"
        return ["train", kind, *options, *(before.split() if self.initial else ()), *common.split()]


_VAE = (
    "motion --batch-size 64 --learning-rate 1.5e-3 --schedule cosine --teacher-forcing 0.2 "
    "--kl-end 0.01 --clip-gradient 1"
)
_FLAT = f"{_VAE} --kl-start 0.01"  # the weight of the KL term is constant
_MORE = (
    "motion --batch-size 64 --learning-rate 2e-3 --schedule cosine --teacher-forcing 0.1 "
    "--kl-start 0.01 --kl-end 0.01 --clip-gradient 1 --align-weight 0.3"
)


def _in_stages(
    decoder: str, dataset: str, first: str, *more: int, last: str = ""
) -> list[Training]:
    """A training and its continuations from the weights, by their iterations; `last` are options of
    the last one, which has the name of the decoder alone."""
    stages = [Training(f"{decoder}-1", dataset, f"{_FLAT} --vae.decoder {decoder} {first}")]
    for number, iterations in enumerate(more, 2):
        final = number == len(more) + 1
        name = decoder if final else f"{decoder}-{number}"
        words = f"{_MORE} --vae.decoder {decoder} --iterations {iterations}{last if final else ''}"
        stages.append(Training(name, dataset, words, stages[-1].name))
    return stages


_FAST = "--batch-size 32 --learning-rate 5e-4"
# (system, options, iterations on HumanAct12, on its fine actions, on CMU)
_BASELINES = (
    ("condgru", "--batch-size 32 --learning-rate 1e-3", 800, 600, 400),
    ("two-stage-gan", _FAST, 1200, 1200, 4000),
    ("act-mocogan", _FAST, 6000, 6000, 6000),
    ("dancing2music", "--batch-size 16 --learning-rate 5e-4", 3000, 3000, 3000),
    ("latent-transition", _FAST, 3000, 2000, 3000),
)
TRAININGS = (
    Training("plain", "humanact12", f"{_FLAT} --vae.decoder plain --iterations 4000"),
    *_in_stages("lie", "humanact12", "--iterations 9000", 3500),
    Training(
        "glmi-m",
        "humanact12",
        f"{_FLAT} --vae.decoder glmi-m --align-weight 2 --iterations 5500",
    ),
    *_in_stages("glmi-r", "humanact12", "--align-weight 10 --iterations 7000", 4000),
    Training("plain", "humanact12-fine", f"{_VAE} --vae.decoder plain --iterations 4000"),
    Training("lie", "humanact12-fine", f"{_VAE} --vae.decoder lie --iterations 3600"),
    Training(
        "glmi-m",
        "humanact12-fine",
        f"{_VAE} --vae.decoder glmi-m --align-weight 2 --iterations 3600",
    ),
    Training(
        "glmi-r",
        "humanact12-fine",
        f"{_VAE} --vae.decoder glmi-r --align-weight 0.5 --iterations 3800",
    ),
    Training("plain", "cmu", f"{_VAE} --vae.decoder plain --iterations 6500 --temperature 1.1"),
    Training("lie", "cmu", f"{_VAE} --vae.decoder lie --iterations 9000 --temperature 1.1"),
    *_in_stages(
        "glmi-m",
        "cmu",
        "--align-weight 2 --iterations 5000",
        *(3300, 3200, 2300),
        last=" --temperature 1.05",
    ),
    *_in_stages(
        "glmi-r", "cmu", "--align-weight 10 --iterations 4000", 5500, last=" --temperature 1.05"
    ),
    *(
        Training(
            name, dataset, f"baseline --name {name} {options} --iterations {iterations[index]}"
        )
        for name, options, *iterations in _BASELINES
        for index, dataset in enumerate(("humanact12", "humanact12-fine", "cmu"))
    ),
)


def main() -> int:
    """List the commands, or run them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--run", action="store_true", help="run them (about half an hour of a core in all)"
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
    parser.add_argument("--clips", type=int, default=3000, help="clips of each repeat")
    parser.add_argument(
        "--trainings",
        action="store_true",
        help="list the trainings of the VAEs and of the baselines",
    )
    options = parser.parse_args()
    if options.trainings:
        for training in TRAININGS:
            print(f"a2v {' '.join(training.command(options.data))}")
        return 0
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
            "--clips",
            str(options.clips),
        ]
        print(f"# {table.about}\na2v {' '.join(command)}", flush=True)
        if options.run:
            subprocess.run([sys.executable, "-m", "pipelines", *command], check=True, cwd=ROOT)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

"""``a2v train``: train a model, or go on with a run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from a2v.errors import InputError

HELP = "Train a motion model on a data set: the papers' VAE or our own flow; a run goes on where it was stopped."
EXAMPLES = """examples:
  a2v train motion --dataset cmu --data ../shared/data --out runs/cmu
  a2v train flow --dataset cmu --data ../shared/data --out runs/flow --flow.code_size 192 --flow.threads 1
  a2v train motion --dataset humanact12 --data ../shared/data --out runs/lie --vae.decoder lie --iterations 20000 --threads 1
  a2v train motion --dataset humanact12 --data ../shared/data --out runs/mine --evaluator classifier.tar     with a running FID

OUT gets checkpoint.pt or flow.pt (every few minutes), log.csv and, at the end, motion.onnx for a2v motion, a2v video and export/sample.py.
The same command resumes a run that was stopped. CUDA is used where there is one (--device cpu to stay on the CPU)."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.motion.flow import FlowSettings
    from a2v.motion.networks import VAESettings
    from a2v.motion.training import TrainSettings

    parser.add_argument("what", choices=["motion", "flow"], help="the papers' VAE, or our own window flow")
    parser.add_argument("--dataset", required=True, help="humanact12, humanact12-fine or cmu")
    parser.add_argument("--data", required=True, help="folder or archive that holds it")
    parser.add_argument("--out", required=True, help="folder of the run")
    parser.add_argument(
        "--evaluator", type=str | None, default=None, help="action classifier for a running FID and accuracy (monitoring only)"
    )
    parser.add_argument("--licence", default="see the data set's licence", help="licence of the weights, kept in the exported file")
    parser.add_class_arguments(TrainSettings, None)
    parser.add_argument("--flow", type=FlowSettings, default=FlowSettings(), help="the window flow (train flow)")
    parser.add_argument("--vae", type=VAESettings, default=VAESettings(), help="the network")


def run(settings: Any) -> int:
    """Train and export; print the exported file's path."""
    return _train_flow(settings) if settings.what == "flow" else _train_vae(settings)


def _train_flow(settings: Any) -> int:
    from tqdm import tqdm

    from a2v.datasets import load_dataset
    from a2v.motion.flow import FlowSettings, train_flow
    from export.flow import export_flow

    chosen: FlowSettings = settings.flow
    dataset = load_dataset(settings.dataset, settings.data)
    out = Path(settings.out)
    with tqdm(total=chosen.iterations, desc=f"train {dataset.name} flow", unit="it", file=sys.stderr, smoothing=0.05) as bar:

        def on_log(_: object, row: dict[str, float]) -> None:
            bar.update(int(row["iteration"]) - bar.n)
            bar.set_postfix(loss=f"{row['loss']:.4f}")

        model = train_flow(dataset, out, settings=chosen, on_log=on_log)
    export_flow(model, dataset, out / "motion.onnx", licence=settings.licence, extra={"training": vars(chosen)})
    print(out / "motion.onnx")
    return 0


def _train_vae(settings: Any) -> int:
    from tqdm import tqdm

    from a2v.datasets import load_dataset
    from a2v.evaluation.classifier import load_evaluator
    from a2v.evaluation.monitor import quick_scores
    from a2v.motion.networks import VAESettings
    from a2v.motion.training import TrainSettings, TrainState, train
    from export.motion import export_motion

    chosen = TrainSettings(**{name: settings[name] for name in TrainSettings.__dataclass_fields__})
    vae: VAESettings = settings.vae
    dataset = load_dataset(settings.dataset, settings.data)
    evaluator = load_evaluator(settings.evaluator) if settings.evaluator else None
    if evaluator is not None and evaluator.n_actions != len(dataset.actions):
        raise InputError(f"{evaluator.source} knows {evaluator.n_actions} actions; {dataset.name} has {len(dataset.actions)}")
    out = Path(settings.out)
    with tqdm(total=chosen.iterations, desc=f"train {dataset.name} {vae.decoder}", unit="it", file=sys.stderr, smoothing=0.05) as bar:
        scores: dict[str, float] = {}

        def on_log(state: TrainState, row: dict[str, float]) -> None:
            bar.update(state.iteration - bar.n)
            if evaluator is not None and (state.iteration % (10 * chosen.log_every) == 0 or state.iteration == chosen.iterations):
                scores.update(quick_scores(state.model, dataset, evaluator))
                row |= scores
            shown = {"rec": row["reconstruction"], "kl": row["kl"]} | scores
            bar.set_postfix({name: f"{value:.3g}" for name, value in shown.items()})

        model = train(dataset, out, vae=vae, settings=chosen, on_log=on_log)
    export_motion(
        model,
        dataset,
        out / "motion.onnx",
        licence=settings.licence,
        extra={"training": chosen.__dict__ | {"kl_end": chosen.final_kl(dataset)}},
    )
    print(out / "motion.onnx")
    return 0

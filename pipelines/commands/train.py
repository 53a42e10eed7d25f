"""``a2v train``: train a model, or go on with a run."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from a2v.errors import InputError

HELP = "Train a motion model (the papers' VAE or our own flow), an action classifier or the reconstruction; a run goes on where it was stopped."
EXAMPLES = """examples:
  a2v train motion --dataset cmu --data ../shared/data --out runs/cmu
  a2v train flow --dataset cmu --data ../shared/data --out runs/flow --flow.code_size 192 --flow.threads 1
  a2v train motion --dataset humanact12 --data ../shared/data --out runs/lie --vae.decoder lie --iterations 20000 --threads 1
  a2v train motion --dataset humanact12 --data ../shared/data --out runs/mine --evaluator classifier.tar     with a running FID
  a2v train flow --dataset bvh --data my_actions --out runs/mine          your own: my_actions/walk/*.bvh, my_actions/jump/*.bvh...
  a2v train classifier --dataset bvh --data my_actions --out runs/classifier            what a2v evaluate measures them with
  a2v train flow --dataset humanact12 --data ../shared/data --held_out P03,P10 --out runs/unseen
  a2v train reconstruction --data studio --out runs/person          what a2v studio wrote; shape, then detail and colours

OUT gets checkpoint.pt, flow.pt or classifier.pt (every few minutes), log.csv and, for motion models, at the end motion.onnx for a2v motion,
a2v video and export/sample.py (reconstruction: a folder a stage, and at the end the files for a2v video --implicit.weights OUT). --held_out names subjects that are not learned from (auto: about a fifth of the clips); without it models learn
from all and classifiers hold out by "auto", to print their accuracy on people they have not seen.
The same command resumes a run that was stopped. CUDA is used where there is one (--device cpu to stay on the CPU)."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.evaluation.training import ClassifierSettings
    from a2v.motion.flow import GUIDANCE, FlowSettings
    from a2v.motion.networks import VAESettings
    from a2v.motion.training import TrainSettings
    from a2v.reconstruction.implicit.networks import NetworkSettings
    from a2v.reconstruction.implicit.training import ReconstructionSettings
    from pipelines.motion_data import add_dataset_arguments

    parser.add_argument(
        "what",
        choices=["motion", "flow", "classifier", "reconstruction"],
        help="the papers' VAE, our own window flow, the papers' action classifier, or the pixel-aligned networks",
    )
    add_dataset_arguments(parser, optional=True)
    parser.add_argument("--stages", default="shape,detail,color", help="which networks to train, in this order (train reconstruction)")
    parser.add_argument("--held_out", "--held-out", default="", help="subjects not to learn from: names with commas, auto or none")
    parser.add_argument("--out", required=True, help="folder of the run")
    parser.add_argument(
        "--evaluator", type=str | None, default=None, help="action classifier for a running FID and accuracy (monitoring only)"
    )
    parser.add_argument("--licence", default="see the data set's licence", help="licence of the weights, kept in the exported file")
    parser.add_class_arguments(TrainSettings, None)
    parser.add_argument(
        "--guidance", type=float, default=GUIDANCE, help="how far the exported flow is pushed towards the action; 1: not (train flow)"
    )
    parser.add_argument(
        "--guided_until", type=float, default=1.0, help="time of the exported flow, from 0 to 1, after which it is not pushed (train flow)"
    )
    parser.add_argument(
        "--temperature",
        type=float,
        default=1.0,
        help="of the exported model's noise; below 1: more typical, less varied (train motion, train flow)",
    )
    parser.add_argument("--flow", type=FlowSettings, default=FlowSettings(), help="the window flow (train flow)")
    parser.add_argument("--vae", type=VAESettings, default=VAESettings(), help="the network (train motion)")
    parser.add_argument("--classifier", type=ClassifierSettings, default=ClassifierSettings(), help="the classifier (train classifier)")
    parser.add_argument("--network", type=NetworkSettings, default=NetworkSettings(), help="sizes of the networks (train reconstruction)")
    parser.add_argument(
        "--person", type=ReconstructionSettings, default=ReconstructionSettings(), help="each stage's training (train reconstruction)"
    )


def run(settings: Any) -> int:
    """Train and export; print the exported file's path."""
    kinds = {"flow": _train_flow, "motion": _train_vae, "classifier": _train_classifier, "reconstruction": _train_reconstruction}
    return kinds[settings.what](settings)


def _learned_part(settings: Any) -> tuple[Any, dict[str, list[str]]]:
    """What a motion model learns from, and what its file says about those held out."""
    from pipelines.motion_data import hold_out, open_dataset

    training, unseen = hold_out(open_dataset(settings), settings.held_out)
    return training, {"held_out": sorted(set(unseen.subjects)) if unseen is not None else []}


@contextmanager
def _training_bar(name: str, iterations: int) -> Iterator[Callable[[Mapping[str, float], Mapping[str, float]], None]]:
    """A bar as a context; its value is called with a row of the log and the numbers of it that are shown."""
    from tqdm import tqdm

    with tqdm(total=iterations, desc=f"train {name}", unit="it", file=sys.stderr, smoothing=0.05) as bar:

        def show(row: Mapping[str, float], numbers: Mapping[str, float]) -> None:
            bar.update(int(row["iteration"]) - bar.n)
            bar.set_postfix({name: f"{value:.3g}" for name, value in numbers.items()})

        yield show


def _train_classifier(settings: Any) -> int:
    from a2v.evaluation.training import FILE
    from pipelines.motion_data import hold_out, open_dataset

    training, unseen = hold_out(open_dataset(settings), settings.held_out or "auto")
    run_classifier(training, unseen, Path(settings.out), settings.classifier)
    print(Path(settings.out) / FILE)
    return 0


def run_classifier(training: Any, unseen: Any, out: Path, chosen: Any) -> Any:
    """Train a classifier with a bar; print its accuracy on the clips of `unseen`, if any. Returns the `Evaluator`."""
    from a2v.evaluation.training import train_classifier

    with _training_bar(f"{training.name} classifier", chosen.iterations) as show:

        def on_log(row: dict[str, float]) -> None:
            show(row, {name: row[name] for name in ("loss", "accuracy") if name in row})

        evaluator = train_classifier(training, out, held_out=unseen, settings=chosen, on_log=on_log)
    if unseen is not None:
        people = sorted(set(unseen.subjects))
        who = (
            f"of {', '.join(people[:12])}{' ...' if len(people) > 12 else ''}"
            if not set(people) & set(training.subjects)
            else "of the same people"
        )
        print(f"accuracy on {len(unseen)} clips {who}, not learned from: {evaluator.info['held_out_accuracy']:.3f}")
    return evaluator


def _train_flow(settings: Any) -> int:
    from a2v.motion.flow import FlowSettings
    from a2v.motion.flow_training import train_flow
    from export.flow import export_flow

    chosen: FlowSettings = settings.flow
    dataset, unseen = _learned_part(settings)
    out = Path(settings.out)
    with _training_bar(f"{dataset.name} flow", chosen.iterations) as show:

        def on_log(_: object, row: dict[str, float]) -> None:
            show(row, {"loss": row["loss"]})

        model = train_flow(dataset, out, settings=chosen, on_log=on_log)
    extra = {"training": vars(chosen) | {"initial": Path(chosen.initial).name}} | unseen  # no paths of this machine
    export_flow(
        model,
        dataset,
        out / "motion.onnx",
        licence=settings.licence,
        extra=extra,
        guidance=settings.guidance,
        guided_until=settings.guided_until,
        temperature=settings.temperature,
    )
    print(out / "motion.onnx")
    return 0


def _train_reconstruction(settings: Any) -> int:
    from typing import cast

    from a2v.reconstruction.implicit.training import STAGES, Stage, train_reconstruction
    from export.reconstruction import export_reconstruction

    stages = [name.strip() for name in settings.stages.split(",")]
    if unknown := [name for name in stages if name not in STAGES]:
        raise InputError(f"unknown stage '{unknown[0]}'; choose from {', '.join(STAGES)}")
    out, chosen = Path(settings.out), settings.person
    for stage in stages:
        with _training_bar(stage, chosen.iterations) as show:

            def on_log(row: dict[str, float], show: Any = show) -> None:
                show(row, {name: value for name, value in row.items() if name not in ("iteration", "seconds")})

            train_reconstruction(cast(Stage, stage), settings.data, out, network=settings.network, settings=chosen, on_log=on_log)
    if all((out / stage).is_dir() for stage in STAGES):
        for path in export_reconstruction(out, out, licence=settings.licence, extra={"training": vars(chosen)}):
            print(path)
    else:
        print(out)
    return 0


def _train_vae(settings: Any) -> int:
    from a2v.evaluation.classifier import load_evaluator
    from a2v.evaluation.monitor import quick_scores
    from a2v.motion.networks import VAESettings
    from a2v.motion.training import TrainSettings, VAETraining, train
    from export.motion import export_motion

    chosen = TrainSettings(**{name: settings[name] for name in TrainSettings.__dataclass_fields__})
    vae: VAESettings = settings.vae
    dataset, unseen = _learned_part(settings)
    evaluator = load_evaluator(settings.evaluator) if settings.evaluator else None
    if evaluator is not None:
        evaluator.demand_actions(dataset)
    out = Path(settings.out)
    with _training_bar(f"{dataset.name} {vae.decoder}", chosen.iterations) as show:
        scores: dict[str, float] = {}

        def on_log(training: VAETraining, row: dict[str, float]) -> None:
            if evaluator is not None and (training.iteration % (10 * chosen.log_every) == 0 or training.iteration == chosen.iterations):
                scores.update(quick_scores(training.model, dataset, evaluator))
                row |= scores
            show(row, {"rec": row["reconstruction"], "kl": row["kl"]} | scores)

        model = train(dataset, out, vae=vae, settings=chosen, on_log=on_log)
    export_motion(
        model,
        dataset,
        out / "motion.onnx",
        licence=settings.licence,
        temperature=settings.temperature,
        extra={"training": chosen.__dict__ | {"kl_end": chosen.final_kl(dataset)}} | unseen,
    )
    print(out / "motion.onnx")
    return 0

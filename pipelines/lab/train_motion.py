"""``a2v train motion``: the papers' VAE."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from a2v.lab.evaluation.monitor import EVERY, generator_of_vae, quick_scores
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.training import TrainSettings, VAETraining, train
from export.motion import export_motion
from export.reread import write_start
from pipelines.answer import Answer
from pipelines.lab.training import RESUMES, MotionModelOptions, WatchedOptions, training_bar
from pipelines.options import group, settings

HELP = "Train the papers' motion model, a VAE with one of four decoders."
EXAMPLES = f"""examples:
  a2v train motion --dataset cmu --data ../shared/data --out runs/cmu
  a2v train motion --dataset humanact12 --data ../shared/data --out runs/lie --vae.decoder lie --iterations 20000 --threads 1
  a2v train motion --dataset humanact12 --data ../shared/data --out runs/mine --evaluator classifier.tar     with a running FID
  a2v train motion --dataset cmu --data ../shared/data --out runs/on --initial runs/cmu/checkpoint.pt --learning-rate 5e-5     train on
  a2v train motion --dataset cmu --data ../shared/data --out runs/more --vae.decoder lie --initial a2v/weights/motion_cmu_lie.onnx     from an export

OUT gets checkpoint.pt (every few minutes), log.csv and at the end motion.onnx for a2v motion, a2v
video and export/sample.py. --held-out names subjects that are not learned from (auto: about a
fifth of the clips); without it models learn from all. {RESUMES}"""


@dataclass(frozen=True, kw_only=True)
class Options(WatchedOptions, MotionModelOptions):
    """Options of the command."""

    training: TrainSettings = group(TrainSettings)
    vae: VAESettings = settings(VAESettings)


def run(options: Options) -> Answer:
    """Train and export."""
    chosen, vae = options.training, options.vae
    dataset, unseen = options.learned_part()
    evaluator, out = options.watch(dataset), Path(options.out)
    if chosen.initial.lower().endswith(".onnx"):
        chosen = replace(chosen, initial=str(write_start(chosen.initial, out, dataset, vae)))
    with training_bar(f"{dataset.name} {vae.decoder}", chosen.iterations) as show:
        scores: dict[str, float] = {}

        def on_log(training: VAETraining, row: dict[str, float]) -> None:
            if evaluator is not None and (
                training.iteration % (EVERY * chosen.log_every) == 0
                or training.iteration == chosen.iterations
            ):
                generate = generator_of_vae(training.model, dataset)
                scores.update(quick_scores(generate, dataset, evaluator))
                row |= scores
            show(row, {"rec": row["reconstruction"], "kl": row["kl"]} | scores)

        model = train(dataset, out, vae=vae, settings=chosen, on_log=on_log)
    export_motion(
        model,
        dataset,
        out / "motion.onnx",
        license=options.license,
        temperature=options.temperature,
        extra={"training": options.training.__dict__ | {"kl_end": chosen.final_kl(dataset)}}
        | unseen,
    )
    return Answer(files=[out / "motion.onnx"])

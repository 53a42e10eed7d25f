"""``a2v train flow``: our own window flow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.lab.motion.flow import GUIDANCE, FlowSettings
from a2v.lab.motion.flow_training import train_flow
from export.flow import Sampling, export_flow
from pipelines.answer import Answer
from pipelines.lab.training import RESUMES, MotionModelOptions, training_bar
from pipelines.options import option, settings

HELP = "Train a window flow, our own motion model."
EXAMPLES = f"""examples:
  a2v train flow --dataset cmu --data ../shared/data --out runs/flow --flow.code-size 192 --flow.threads 1
  a2v train flow --dataset bvh --data my_actions --out runs/mine          your own: my_actions/walk/*.bvh, my_actions/jump/*.bvh...
  a2v train flow --dataset humanact12 --data ../shared/data --held-out P03,P10 --out runs/unseen

OUT gets flow.pt (every few minutes), log.csv and at the end motion.onnx for a2v motion, a2v video
and export/sample.py. --held-out names subjects that are not learned from (auto: about a fifth of
the clips); without it models learn from all. {RESUMES}"""


@dataclass(frozen=True, kw_only=True)
class Options(MotionModelOptions):
    """Options of the command."""

    guidance: float = option(
        "strength of the exported flow's guidance towards the action; 1: none", default=GUIDANCE
    )
    guided_until: float = option(
        "time of the exported flow, from 0 to 1, after which it is not guided", default=1.0
    )
    flow: FlowSettings = settings(FlowSettings)


def run(options: Options) -> Answer:
    """Train and export."""
    chosen = options.flow
    dataset, unseen = options.learned_part()
    out = Path(options.out)
    with training_bar(f"{dataset.name} flow", chosen.iterations) as show:

        def on_log(_: object, row: dict[str, float]) -> None:
            show(row, {"loss": row["loss"]})

        model = train_flow(dataset, out, settings=chosen, on_log=on_log)
    extra = {
        "training": vars(chosen) | {"initial": Path(chosen.initial).name}
    } | unseen  # no paths of this machine
    sampling = Sampling(
        guidance=options.guidance,
        guided_until=options.guided_until,
        temperature=options.temperature,
    )
    export_flow(
        model, dataset, out / "motion.onnx", license=options.license, extra=extra, sampling=sampling
    )
    return Answer(files=[out / "motion.onnx"])

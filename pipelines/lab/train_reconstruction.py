"""``a2v train reconstruction``: the pixel-aligned networks of the reconstruction."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

from a2v.errors import InputError
from a2v.lab.surface.networks import NetworkSettings
from a2v.lab.surface.training import STAGES, ReconstructionSettings, Stage, train_reconstruction
from export.reconstruction import export_reconstruction
from pipelines.answer import Answer
from pipelines.lab.training import RESUMES, Show, training_bar
from pipelines.options import option, settings

HELP = "Train the networks that reconstruct a person from a photo: shape, then detail and colors."
EXAMPLES = f"""examples:
  a2v train reconstruction --data studio --out runs/person          what a2v studio wrote; shape, then detail and colors

OUT gets a folder a stage and, when it has all of them, the files for a2v video --implicit.weights
OUT. {RESUMES}"""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    data: str = option("folder that a2v studio wrote")
    out: str = option("folder of the run")
    stages: str = option("which networks to train, in this order", default="shape,detail,color")
    license: str = option(
        "license of the weights, kept in the exported files", default="see the data set's license"
    )
    network: NetworkSettings = settings(NetworkSettings)
    person: ReconstructionSettings = settings(ReconstructionSettings)


def run(options: Options) -> Answer:
    """Train, and export if all networks are available."""
    stages = [name.strip() for name in options.stages.split(",")]
    if unknown := [name for name in stages if name not in STAGES]:
        raise InputError(f"unknown stage '{unknown[0]}'; choose from {', '.join(STAGES)}")
    out, chosen = Path(options.out), options.person
    for stage in stages:
        with training_bar(stage, chosen.iterations) as show:

            def on_log(row: dict[str, float], show: Show = show) -> None:
                show(
                    row,
                    {
                        name: value
                        for name, value in row.items()
                        if name not in ("iteration", "seconds")
                    },
                )

            train_reconstruction(
                cast(Stage, stage),
                options.data,
                out,
                network=options.network,
                settings=chosen,
                on_log=on_log,
            )
    if all((out / stage).is_dir() for stage in STAGES):
        return Answer(
            files=export_reconstruction(
                out, out, license=options.license, extra={"training": vars(chosen)}
            )
        )
    return Answer(files=[out])

"""``a2v studio``: make training views for the reconstruction."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.lab.studio.dataset import write_views
from a2v.lab.studio.settings import StudioSettings
from pipelines.answer import Answer
from pipelines.bar import bar
from pipelines.options import group, option

HELP = (
    "Make synthetic photographs of clothed people with the truth behind them: the data "
    "that the reconstruction is trained on."
)
EXAMPLES = """examples:
  a2v studio --data ../shared/data --out runs/studio --training 3000 --validation 60
  a2v studio --data ../shared/data --out runs/studio --training 6000 --workers 4     resumes where it stopped
  a2v studio --data ../shared/data --out runs/far --distance [6.0,12.0] --guide.depth-arms 12
  a2v studio --data ../shared/data --out runs/around --things 0.2 --furniture 0.15 --cut 0.1 --photographs 0.3

Needs DIR/avatars (rigged .glb people) and DIR/cmu_mocap.zip or DIR/humanact12.zip (poses). A view
is about 1.2 MB and takes about 1.2 s of a core; the first run also fits the guide bodies (some
minutes). Existing views are kept."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    data: str = option("folder with avatars/ and the motion data")
    out: str = option("folder of the data set")
    training: int = option("total number of views of the training split", default=1000)
    validation: int = option(
        "total number of views of people and outfits that are not in the training split", default=60
    )
    workers: int = option("processes, each on one core", default=1)
    studio: StudioSettings = group(StudioSettings)


def run(options: Options) -> Answer:
    """Fill the folder, validation views first."""
    counts = {"validation": options.validation, "training": options.training}
    with bar("views", "view") as progress:
        rate = write_views(
            options.out,
            options.data,
            counts,
            settings=options.studio,
            workers=options.workers,
            progress=progress,
        )
    text = (
        f"{options.out}: {options.training} training and {options.validation} validation "
        f"views; {rate:.2f} new ones a second"
    )
    return Answer(
        files=[Path(options.out)], text=text, facts={"views": counts, "new_a_second": rate}
    )

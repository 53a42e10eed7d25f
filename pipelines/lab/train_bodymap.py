"""``a2v train bodymap``: the network of the place on the body and the depth of each pixel."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.lab.bodymap.training import BodyMapSettings, train_bodymap
from a2v.lab.studio.quick.dataset import write_quick_views
from a2v.lab.studio.quick.settings import QuickSettings
from export.bodymap import export_bodymap
from pipelines.answer import Answer
from pipelines.bar import bar
from pipelines.lab.training import RESUMES, training_bar
from pipelines.options import option, settings

HELP = (
    "Make quick views, then train the network that says of each pixel its place on the "
    "body and its depth, and of a picture 33 landmarks."
)
EXAMPLES = f"""examples:
  a2v train bodymap --data ../shared/data --out runs/bodymap --workers 2
  a2v train bodymap --data ../shared/data --out runs/more --views 60000 --bodymap.initial runs/bodymap
  a2v train bodymap --data ../shared/data --out runs/things --bodymap.initial shipped --blend 0.67

Needs DIR/avatars, DIR/makehuman_cc0.zip (unless --studio.people avatars) and DIR/cmu_mocap.zip or
DIR/humanact12.zip. OUT/views gets the views (45 KB and an eighth of a second of a core each;
before the first one a quarter of an hour for poses and guides), OUT the checkpoint, log.csv and,
at the end, bodymap.onnx. {RESUMES}"""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    data: str = option("folder with avatars/, MakeHuman's archive and the motion data")
    out: str = option("folder of the run")
    views: int = option("total number of training views", default=25_600)
    validation: int = option(
        "total number of views of people, clothes and clips that are not in the training views",
        default=192,
    )
    workers: int = option("processes that make views, each on one core", default=1)
    license: str = option(
        "license of the weights, kept in the exported file", default="see the data set's license"
    )
    blend: float = option(
        "weight of the trained network in the exported file, which is mixed with the "
        "network of bodymap.initial",
        default=1.0,
    )
    studio: QuickSettings = settings(QuickSettings)
    bodymap: BodyMapSettings = settings(BodyMapSettings)


_SHOWN = (
    "views",
    "plane",
    "depth",
    "place",
    "front",
    "held_out_limbs",
    "held_out_limbs_depth",
    "held_out_front_depth",
)


def run(options: Options) -> Answer:
    """Render the missing views, train, export."""
    out, counts = Path(options.out), {"validation": options.validation, "training": options.views}
    prepared = (out / "views" / "bank.npz").exists()
    with bar("poses", "clip", hidden=prepared) as preparing, bar("views", "file") as progress:
        rate = write_quick_views(
            out / "views",
            options.data,
            counts,
            settings=options.studio,
            workers=options.workers,
            progress=progress,
            preparing=preparing,
        )
    with training_bar("bodymap", options.bodymap.iterations) as show:
        train_bodymap(
            out / "views",
            out,
            settings=options.bodymap,
            on_log=lambda row: show(row, {name: row[name] for name in _SHOWN if name in row}),
        )
    extra = {"views": counts, "studio": vars(options.studio)}
    path = export_bodymap(
        out,
        out,
        license=options.license,
        blend=options.blend,
        initial=options.bodymap.initial,
        extra=extra,
    )
    return Answer(files=[path], facts={"new_views_a_second": rate})

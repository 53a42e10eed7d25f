"""``a2v studio``: make training views for the reconstruction."""

from __future__ import annotations

from typing import Any

HELP = "Make synthetic photographs of clothed people with the truth behind them: the data that the reconstruction is trained on."
EXAMPLES = """examples:
  a2v studio --data ../shared/data --out runs/studio --training 3000 --validation 60
  a2v studio --data ../shared/data --out runs/studio --training 6000 --workers 4     goes on where it stopped
  a2v studio --data ../shared/data --out runs/far --distance [6.0,12.0] --guide.depth_arms 12

Needs DIR/avatars (rigged .glb people) and DIR/cmu_mocap.zip or DIR/humanact12.zip (poses). A view is about 1.2 MB and takes about
1.2 s of a core; the first run also fits the guide bodies (some minutes). Existing views are kept."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.studio.settings import StudioSettings

    parser.add_argument("--data", type=str, required=True, help="folder with avatars/ and the motion data")
    parser.add_argument("--out", type=str, required=True, help="folder of the data set")
    parser.add_argument("--training", type=int, default=1000, help="views of the training split, in all")
    parser.add_argument("--validation", type=int, default=60, help="views of people and outfits that training never shows, in all")
    parser.add_argument("--workers", type=int, default=1, help="processes, each on one core")
    parser.add_class_arguments(StudioSettings, None)


def run(settings: Any) -> int:
    """Fill the folder; validation views first."""
    from a2v.studio.dataset import write_views
    from a2v.studio.settings import StudioSettings
    from pipelines.bar import bar

    chosen = StudioSettings(**{name: settings[name] for name in StudioSettings.__dataclass_fields__})
    counts = {"validation": settings.validation, "training": settings.training}
    with bar("views", "view") as progress:
        rate = write_views(settings.out, settings.data, counts, settings=chosen, workers=settings.workers, progress=progress)
    print(f"{settings.out}: {settings.training} training and {settings.validation} validation views; {rate:.2f} new ones a second")
    return 0

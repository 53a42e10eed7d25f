"""``a2v reconstruct``: a photo to a 3D character."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from a2v.errors import InputError

HELP = "Reconstruct the person in a photo as a textured, rigged 3D character, standing as in the photo."
EXAMPLES = """examples:
  a2v reconstruct --photo me.jpg --out me.glb
  a2v reconstruct --photo me.png --mask mask.png --keypoints openpose.json --out me.glb

The file is in metres, y up; the camera is on +z looking down -z, so the photo is the orthographic front view of the mesh."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from pipelines.inputs import add_photo_arguments, add_run_arguments, add_stage_arguments

    parser.add_argument("--out", required=True, help="the .glb to write")
    parser.add_argument(
        "--from", dest="start", type=str | None, default=None, metavar="NODE", help="compute NODE and all that follows anew"
    )
    add_photo_arguments(parser)
    add_stage_arguments(parser, ["perception", "fit", "shape", "color", "bind"])
    add_run_arguments(parser)


def run(settings: Any) -> int:
    """Reconstruct; print the path last."""
    from pipelines.inputs import check_writable, photo_parameters, stages_of
    from pipelines.outputs import write_blob
    from pipelines.progress import Bars
    from pipelines.report import table
    from pipelines.run import run as run_graph
    from pipelines.store import Store

    path = Path(settings.out)
    if path.suffix.lower() != ".glb":
        raise InputError(f"cannot write {path}; expected a name that ends in .glb")
    store = Store(settings.cache)
    check_writable(path.parent)
    params = photo_parameters(store, settings.photo, mask=settings.mask, keypoints=settings.keypoints, **stages_of(settings))
    bars = Bars(quiet=settings.quiet)
    try:
        outcome = run_graph(
            "still", executor=settings.executor, workers=settings.workers, address=settings.address, store=store,
            start=settings.start, progress=bars, **params,
        )  # fmt: skip
    finally:
        bars.close()
    write_blob(outcome, outcome.values["still"], path)
    if not settings.quiet:
        print(table(outcome), file=sys.stderr)
    for text in outcome.notes:
        print(f"note: {text}", file=sys.stderr)
    print(path)
    return 0

"""``a2v reconstruct``: a photo to a 3D character."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from pipelines.answer import Answer
from pipelines.inputs import CharacterStages, PhotoOptions, RunOptions, check_writable
from pipelines.options import group, option
from pipelines.outputs import write_blob
from pipelines.store import Store

HELP = "Reconstruct the person in a photo as a textured, rigged 3D character, standing as in the photo."
EXAMPLES = """examples:
  a2v reconstruct --photo me.jpg --out me.glb
  a2v reconstruct --photo me.png --mask mask.png --keypoints openpose.json --out me.glb

The file is in metres, y up; the camera is on +z looking down -z, so the photo is the orthographic front view of the mesh."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the command takes."""

    photo: PhotoOptions = group(PhotoOptions)
    out: str = option("the .glb to write")
    start: str | None = option("compute NODE and all that follows anew", default=None, names=("--from",), metavar="NODE")
    stages: CharacterStages = group(CharacterStages)
    running: RunOptions = group(RunOptions)


def run(options: Options) -> Answer:
    """Reconstruct."""
    path = Path(options.out)
    if path.suffix.lower() != ".glb":
        raise InputError(f"cannot write {path}; expected a name that ends in .glb")
    check_writable(path.parent)
    parameters = options.photo.parameters(Store(options.running.cache), options.stages)
    outcome = options.running.run("still", parameters, start=options.start)
    write_blob(outcome, outcome.values["still"], path)
    options.running.tell_times(outcome)
    return Answer(files=[path], notes=outcome.notes)

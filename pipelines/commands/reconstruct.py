"""``a2v reconstruct``: make a rigged, textured 3D character from a photo."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from a2v.formats.gltf import write_glb
from a2v.types import Character
from pipelines.answer import Answer
from pipelines.engine.store import Store
from pipelines.engines import EngineOptions
from pipelines.inputs import RunOptions, check_writable
from pipelines.options import group, option
from pipelines.outputs import write_blob
from pipelines.requests.person import PersonRequest

HELP = "Reconstruct the person in a photo as a textured, rigged 3D character in the rest pose of the body."
EXAMPLES = """examples:
  a2v reconstruct --photo me.jpg --out me.glb
  a2v reconstruct --photo me.png --mask mask.png --keypoints openpose.json --out me.glb
  a2v reconstruct --photo me.jpg --triangles 20000 --lods 8000 --compress meshopt --out me.glb      for a game; 0: all triangles

The file is in meters, y up; the camera is on +z looking down -z, so the photo is the orthographic front view of the mesh."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    person: PersonRequest = group(PersonRequest, "the person")
    out: str = option(".glb file to write")
    start: str | None = option(
        "compute NODE and everything after it again",
        default=None,
        names=("--from",),
        metavar="NODE",
    )
    engines: EngineOptions = group(EngineOptions, "exported files")
    running: RunOptions = group(RunOptions, "execution")


def run(options: Options) -> Answer:
    """Reconstruct the person."""
    path = Path(options.out)
    if path.suffix.lower() != ".glb":
        raise InputError(f"cannot write {path}; expected a name that ends in .glb")
    options.engines.check(path)
    check_writable(path.parent)
    parameters = options.person.resolve(Store(options.running.cache))
    outcome = options.running.run(
        "still" if options.engines.plain else "engine_character", parameters, start=options.start
    )
    written = [path]
    if options.engines.plain:
        write_blob(outcome, outcome.values["still"], path)
    else:
        written = options.engines.write(path, outcome.get("engine_character", Character), _write)
    options.running.tell_times(outcome)
    return Answer(files=written, notes=outcome.notes)


def _write(path: Path, character: Character, quality: int) -> None:
    write_glb(path, character, {}, jpeg_quality=quality)

"""``a2v reconstruct``: make a rigged, textured 3D character from a photo."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from a2v.formats.gltf import write_glb
from a2v.formats.obj_ply import write_obj, write_ply
from a2v.types import Character
from pipelines.answer import Answer
from pipelines.engine.store import Store
from pipelines.engines import EngineOptions
from pipelines.inputs import RunOptions, check_writable
from pipelines.options import group, option
from pipelines.poses import PoseOptions
from pipelines.requests.person import PersonRequest

HELP = "Reconstruct the person in a photo as a textured, rigged 3D character."
EXAMPLES = """examples:
  a2v reconstruct --photo me.jpg --out me.glb
  a2v reconstruct --photo me.png --mask mask.png --keypoints openpose.json --out me.glb
  a2v reconstruct --photo me.jpg --triangles 20000 --lods 8000 --compress meshopt --out me.glb      for a game; 0: all triangles
  a2v reconstruct --photo me.jpg --pose photo --out me.obj --json                               as photographed, with the photo's camera

The file is in meters, y up, with the soles on the ground at y = 0. --pose rest, the default: the person faces +z at rest, ready for
animation. --pose photo: the person stands as photographed, and the photo's camera is on +z and looks along -z; --json prints its
place, pitch, focal length and center. A .glb has bones; an .obj or .ply is the mesh alone."""

FORMATS = (".glb", ".obj", ".ply")
"""Suffixes of --out."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    person: PersonRequest = group(PersonRequest, "the person")
    out: str = option(f"file to write: {', '.join(FORMATS)}")
    posing: PoseOptions = group(PoseOptions, "exported files")
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
    check_format(path)
    options.engines.check(path)
    check_writable(path.parent)
    parameters = options.person.resolve(Store(options.running.cache))
    outcome = options.running.run(
        ["engine_character", *options.posing.targets], parameters, start=options.start
    )
    written = write_person(path, options.posing.posed(outcome, "engine_character"), options.engines)
    options.running.tell_times(outcome)
    return Answer(files=written, notes=outcome.notes, facts=options.posing.facts(outcome))


def check_format(path: Path) -> None:
    """Check that a character without clips can be written to `path`.

    Raises
    ------
    InputError
        No format has its suffix.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(
            f"cannot write {path}; expected a name that ends in {', '.join(FORMATS[:-1])} or "
            f"{FORMATS[-1]}"
        )


def write_person(path: Path, character: Character, engines: EngineOptions) -> list[Path]:
    """Write a character without clips in the format of the path's suffix; return the files."""
    suffix = path.suffix.lower()
    if suffix == ".ply":
        write_ply(path, character.surface)
        return [path]
    if suffix == ".obj":
        write_obj(path, character.surface)
        textured = character.surface.texture is not None
        return [path, *(path.with_suffix(one) for one in (".mtl", ".png") if textured)]
    return engines.write(
        path,
        character,
        lambda target, made, quality: write_glb(target, made, {}, jpeg_quality=quality),
    )

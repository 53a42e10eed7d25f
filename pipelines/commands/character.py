"""``a2v character``: a photo and several actions to one file for animators' tools."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError

if TYPE_CHECKING:
    from a2v.formats.registry import CharacterFormat

HELP = "Make one character file with several actions: glTF, USD, or a web page that shows it."
EXAMPLES = """examples:
  a2v character --photo me.jpg --actions Walk,Jump,Run --out me.glb                 three clips in one file
  a2v character --photo me.jpg --actions Walk --motions dance.bvh,kick.txt --out me.glb
  a2v character --photo me.jpg --actions Walk --out me.usdz                          needs pip install 'a2v[usd]'
  a2v character --photo me.jpg --actions Walk,Jump --out me.html                     turnable in the browser, one file
  a2v character --photo me.jpg --actions Walk --exact --out me.glb                   every frame's Eq. 20, as morph targets

Clips are named after their actions or files. GLB and USD are skinned, as all tools expect; --exact instead stores the video's own
deformation, vertex by vertex (one action, no bones)."""


def file_formats() -> tuple[CharacterFormat, ...]:
    """What --out may be: characters as data, and as a page that shows them."""
    from a2v.formats.registry import CHARACTER_FORMATS
    from a2v.rendering.page import PAGE_FORMATS

    return (*CHARACTER_FORMATS, *PAGE_FORMATS)


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.formats.registry import readable_motions, suffixes_of
    from pipelines.inputs import add_model_argument, add_photo_arguments, add_run_arguments, add_stage_arguments

    parser.add_argument("--out", required=True, help=f"the file to write: {', '.join(suffixes_of(file_formats()))}")
    parser.add_argument("--actions", default="", help="of the model, with commas; each becomes a clip")
    parser.add_argument("--motions", default="", help=f"files with commas ({readable_motions(', ')}); each becomes a clip")
    add_model_argument(parser)
    parser.add_argument("--frames", type=int, default=60, help="frames a clip, at most for files")
    parser.add_argument("--fps", type=float | None, default=None, help="resample the clips to this many frames a second")
    parser.add_argument("--seed", type=int, default=0, help="seed of the motions")
    parser.add_argument("--exact", action="store_true", help="Eq. 20 as morph targets of a .glb instead of a skin")
    add_photo_arguments(parser)
    add_stage_arguments(parser, ["perception", "fit", "shape", "color", "bind", "retarget", "deform"])
    add_run_arguments(parser)


def run(settings: Any) -> int:
    """Make the character and its clips; print the path last."""
    import numpy as np

    from a2v.formats.gltf import write_morph_glb
    from a2v.formats.registry import write_character, writer_of
    from a2v.types import Character
    from pipelines.graph import video_graph
    from pipelines.inputs import check_writable, motion_inputs, photo_parameters, stages_of
    from pipelines.nodes.values import Poses, Vertices
    from pipelines.progress import Bars
    from pipelines.run import run as run_graph
    from pipelines.store import Store

    path = Path(settings.out)
    writer_of(path, file_formats())
    wanted = [(name, None) for name in _listed(settings.actions)] + [(Path(file).stem, file) for file in _listed(settings.motions)]
    if not wanted:
        raise InputError("no clip asked for; name actions with --actions (a2v actions lists them) or files with --motions")
    if doubles := [name for index, (name, _) in enumerate(wanted) if name in [other for other, _ in wanted[:index]]]:
        raise InputError(f"clip '{doubles[0]}' is asked for twice; clips of one file need names of their own")
    if settings.exact and (path.suffix.lower() != ".glb" or len(wanted) > 1):
        raise InputError("--exact writes one action to a .glb; leave the others out, or leave --exact out")
    store = Store(settings.cache)
    photo = photo_parameters(store, settings.photo, mask=settings.mask, keypoints=settings.keypoints, **stages_of(settings))
    common = {"model": settings.model, "frames": settings.frames, "seed": settings.seed, "fps": settings.fps}
    parameters = [motion_inputs(action=name, motion=file, **common) for name, file in wanted]
    check_writable(path.parent)
    clips, character, exact = {}, None, None
    for (name, file), moving in zip(wanted, parameters, strict=True):
        bars = Bars(quiet=settings.quiet)
        try:
            outcome = run_graph(
                ["character", "poses", *(["posed"] if settings.exact else [])],
                graph=video_graph(recorded=file is not None),
                executor=settings.executor,
                workers=settings.workers,
                address=settings.address,
                store=store,
                progress=bars,
                **moving,
                **photo,
            )
        finally:
            bars.close()
        character, poses = outcome.get("character", Character), outcome.get("poses", Poses)
        clips[name] = (poses.bone_transforms, poses.fps)
        if settings.exact:
            exact = np.stack([store.get(ref, Vertices).vertices for ref in outcome.values["posed"]])
        for text in outcome.notes:
            print(f"note: {text}", file=sys.stderr)
    assert character is not None
    if exact is not None:
        name = wanted[0][0]
        write_morph_glb(path, character.surface, exact, clips[name][1], clip=name)
    else:
        write_character(path, character, clips, file_formats())
    print(path)
    return 0


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]

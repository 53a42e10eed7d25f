"""``a2v character``: a photo and several actions to one file for animators' tools."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.formats.gltf import VrmMeta, write_morph_glb
from a2v.formats.registry import CHARACTER_FORMATS, readable_motions, suffixes_of, write_character, writer_of
from a2v.kinematics.resample import SHOWN_FPS
from a2v.rendering.page import PAGE_FORMATS
from a2v.types import Character
from pipelines.answer import Answer
from pipelines.graph import video_graph
from pipelines.inputs import MovingStages, PhotoOptions, RunOptions, check_writable
from pipelines.motion_options import AUTO, FPS, FRAMES, MODEL, SECONDS, EditOptions, motion_inputs
from pipelines.nodes.values import Poses, Vertices
from pipelines.options import flag, group, option
from pipelines.rigs import RigOptions, check_avatar, write_avatar
from pipelines.store import Store

HELP = "Make one character file with several actions: glTF, USD, FBX, VRM, or a web page that shows it."
EXAMPLES = """examples:
  a2v character --photo me.jpg --actions Walk,Jump,Run --out me.glb                 three clips in one file
  a2v character --photo me.jpg --actions Walk --motions dance.bvh,kick.txt --out me.glb
  a2v character --photo me.jpg --actions Walk --out me.usdz                          needs pip install 'a2v[usd]'
  a2v character --photo me.jpg --actions Walk,Jump --rig unreal --out me.fbx         centimetres; a2v doctor says what it needs
  a2v character --photo me.jpg --actions Walk,Jump --out me.html                     turnable in the browser, one file
  a2v character --photo me.jpg --actions Walk --rig mixamo --out me.glb              another tool's bones; --root-motion, --loop --in-place
  a2v character --photo me.jpg --actions Walk --author Me --licence-url https://creativecommons.org/licenses/by/4.0/ --out me.vrm
  a2v character --photo me.jpg --actions Walk --exact --out me.glb                   every frame's Eq. 20, as morph targets

Clips are named after their actions or files. GLB, USD and FBX are skinned, as all tools expect; --exact instead stores the video's own
deformation, vertex by vertex (one action, no bones). A .vrm gets its clips beside it, as .vrma."""

AVATAR = ".vrm"
"""Suffix of VRM 1.0."""

FORMATS = (*CHARACTER_FORMATS, *PAGE_FORMATS)
"""What --out may be: characters as data, and as a page that shows them."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the command takes."""

    photo: PhotoOptions = group(PhotoOptions)
    out: str = option(f"the file to write: {', '.join((*suffixes_of(FORMATS), AVATAR))}")
    actions: str = option("of the model, with commas; each becomes a clip", default="")
    motions: str = option(f"files with commas ({readable_motions(', ')}); each becomes a clip", default="")
    model: str = option(MODEL, default=AUTO)
    seconds: float | None = option(SECONDS, default=None)
    frames: int | None = option(FRAMES, default=None)
    fps: float = option(FPS, default=SHOWN_FPS)
    edits: EditOptions = group(EditOptions)
    seed: int = option("seed of the motions", default=0)
    exact: bool = flag("Eq. 20 as morph targets of a .glb instead of a skin")
    rigging: RigOptions = group(RigOptions)
    author: str = option("of a .vrm: who made the avatar", default="")
    licence_url: str = option("of a .vrm: address of the licence that you grant", default="", metavar="URL")
    stages: MovingStages = group(MovingStages)
    running: RunOptions = group(RunOptions)


def run(options: Options) -> Answer:
    """Make the character and its clips."""
    path = Path(options.out)
    wanted = _wanted(options, path)
    avatar = _avatar(options, path)
    store = Store(options.running.cache)
    photo = options.photo.parameters(store, options.stages)
    parameters = [
        motion_inputs(
            action=name,
            motion=file,
            model=options.model,
            seconds=options.seconds,
            frames=options.frames,
            seed=options.seed,
            fps=options.fps,
        )
        for name, file in wanted.items()
    ]
    check_writable(path.parent)
    clips, expressions, character, exact = {}, {}, None, None
    written, notes = [path], list[str]()
    targets = ["character", "poses", *(["posed"] if options.exact else [])]
    for (name, file), moving in zip(wanted.items(), parameters, strict=True):
        outcome = options.running.run(targets, moving | photo, graph=video_graph(recorded=file is not None))
        character, poses = outcome.get("character", Character), outcome.get("poses", Poses)
        clips[name], expressions[name] = (poses.bone_transforms, poses.fps), poses.expressions
        if options.exact:
            exact = np.stack([store.get(ref, Vertices).vertices for ref in outcome.values["posed"]])
        notes += [text for text in outcome.notes if text not in notes]
    assert character is not None
    if exact is not None:
        name = next(iter(wanted))
        write_morph_glb(path, character.surface, exact, clips[name][1], clip=name)
    elif avatar is not None:
        written = write_avatar(path, character, clips, avatar, expressions=expressions)
    else:
        write_character(path, *options.rigging.prepare(character, clips), FORMATS, expressions=expressions)
    return Answer(files=written, notes=notes, facts={"clips": list(clips)})


def _wanted(options: Options, path: Path) -> dict[str, str | None]:
    """The clips to make, by name: None for an action of the model, else a motion file."""
    if path.suffix.lower() != AVATAR:
        writer_of(path, FORMATS)
    wanted: dict[str, str | None] = {}
    asked: list[tuple[str, str | None]] = [(name, None) for name in _listed(options.actions)]
    for name, file in [*asked, *((Path(file).stem, file) for file in _listed(options.motions))]:
        if name in wanted:
            raise InputError(f"clip '{name}' is asked for twice; clips of one file need names of their own")
        wanted[name] = file
    if not wanted:
        raise InputError("no clip asked for; name actions with --actions (a2v actions lists them) or files with --motions")
    if options.exact and (path.suffix.lower() != ".glb" or len(wanted) > 1):
        raise InputError("--exact writes one action to a .glb; leave the others out, or leave --exact out")
    if options.exact and not options.rigging.plain:
        raise InputError("--exact has no bones; leave --rig and --root-motion out")
    return wanted


def _avatar(options: Options, path: Path) -> VrmMeta | None:
    """What a .vrm says about itself; None for other files."""
    if path.suffix.lower() != AVATAR:
        return None
    check_avatar(options.rigging)
    return VrmMeta(name=path.stem, author=options.author, licence_url=options.licence_url)


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]

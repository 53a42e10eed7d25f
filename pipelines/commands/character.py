"""``a2v character``: make one character file with several actions from a photo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from a2v.animation import DeformSettings
from a2v.animation.speech import mouth_of_speech
from a2v.errors import InputError
from a2v.formats.audio import RATE, read_sound
from a2v.formats.characters import Strengths
from a2v.formats.gltf import VrmMeta, write_glb, write_morph_glb
from a2v.formats.registry import (
    CHARACTER_FORMATS,
    readable_motions,
    suffixes_of,
    write_character,
    writer_of,
)
from a2v.props import Props
from a2v.rendering.page import PAGE_FORMATS
from a2v.types import Character, FloatArray
from pipelines.answer import Answer
from pipelines.engine.store import Store
from pipelines.engines import EngineOptions
from pipelines.inputs import RunOptions, check_writable
from pipelines.nodes.values import Poses, Vertices
from pipelines.options import flag, group, option, settings
from pipelines.poses import AT_REST, PoseOptions
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import (
    ACTION,
    CarryOptions,
    EditOptions,
    LengthOptions,
    MotionRequest,
)
from pipelines.requests.person import PersonRequest
from pipelines.requests.video import VideoRequest
from pipelines.rigs import (
    AVATAR,
    RIG_MOTIONS,
    AvatarOptions,
    RigOptions,
    write_avatar,
    write_pose,
)

HELP = "Make one character file with several actions from a photo: glTF, USD, FBX, VRM, or a web page that shows it."
EXAMPLES = """examples:
  a2v character --photo me.jpg --actions Walk,Jump,Run --out me.glb                 three clips in one file
  a2v character --photo me.jpg --actions Walk --motions dance.bvh,kick.txt --out me.glb
  a2v character --photo me.jpg --actions Walk --out me.usdz                          needs pip install 'a2v[usd]'
  a2v character --photo me.jpg --actions Walk,Jump --rig unreal --out me.fbx         centimeters; a2v doctor lists what it needs
  a2v character --photo me.jpg --actions Walk,Jump --out me.html                     turnable in the browser, one file
  a2v character --photo me.jpg --actions Walk --rig mixamo --out me.glb              another tool's bones; --root-motion, --loop --in-place
  a2v character --photo me.jpg --actions Walk --author Me --license-url https://creativecommons.org/licenses/by/4.0/ --out me.vrm
  a2v character --photo me.jpg --actions Walk --vrm 0.x --author Me --license-url https://creativecommons.org/licenses/by/4.0/ --out me.vrm
  a2v character --photo me.jpg --actions Walk --triangles 8000 --texture 1024 --compress meshopt --out me.glb         for a phone
  a2v character --photo me.jpg --say speech.wav --out me.glb                         the mouth speaks; with --action Wave too
  a2v character --photo me.jpg --actions Walk --exact --out me.glb                   the video's own vertices, without bones

Clips are named after their actions or files. GLB, USD and FBX are skinned, as all tools expect; --exact instead stores the video's own
deformation, vertex by vertex (one action, no bones). A .vrm gets its clips beside it, as .vrma."""

FORMATS = (*CHARACTER_FORMATS, *PAGE_FORMATS)
"""Suffixes of --out: character files, and a page that shows the character."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    person: PersonRequest = group(PersonRequest, "the person")
    out: str = option(f"file to write: {', '.join((*suffixes_of(FORMATS), AVATAR))}")
    action: str = option(ACTION, default="")
    actions: str = option("actions, separated by commas; each becomes a clip", default="")
    motions: str = option(
        f"motion files, separated by commas ({readable_motions(', ')}); each becomes a clip",
        default="",
    )
    say: str | None = option(
        "sound of speech (.wav, .mp3...) that moves the mouth in every clip; without a clip the "
        "person stands and speaks",
        default=None,
        metavar="FILE",
    )
    lengths: LengthOptions = group(LengthOptions, "the motions")
    edits: EditOptions = group(EditOptions, "the motions")
    carrying: CarryOptions = group(CarryOptions, "the motions")
    no_props: bool = flag("leave out the steps, ladder or bar of clips that climb", rare=True)
    exact: bool = flag(
        "write the video's own vertices, each frame as a morph target of a .glb, without bones"
    )
    posing: PoseOptions = group(PoseOptions, "exported files")
    pose_file: str | None = option(
        f"with --pose photo: also write the pose as a motion of one frame: {', '.join(RIG_MOTIONS)}",
        default=None,
        metavar="FILE",
        rare=True,
    )
    rigging: RigOptions = group(RigOptions, "exported files")
    avatar: AvatarOptions = group(AvatarOptions, "exported files")
    deform: DeformSettings = settings(DeformSettings, users=("method",))
    engines: EngineOptions = group(EngineOptions, "exported files")
    running: RunOptions = group(RunOptions, "execution")

    def motion(self, name: str, file: str | None) -> MotionRequest:
        """Return the motion of a clip: an action of the model, or a file."""
        shared: list[Any] = [self.lengths, self.edits, self.carrying]
        values = {item.name: getattr(part, item.name) for part in shared for item in fields(part)}
        return MotionRequest(**values, action=name, motion=file)


def run(options: Options) -> Answer:
    """Make the character and its clips."""
    path = Path(options.out)
    avatar = avatar_of(path, options.rigging, options.avatar)
    sound = None if options.say is None else read_sound(options.say)
    if sound is not None:
        options = speaking(options, len(sound) / RATE)
    wanted = _wanted(options, path)
    options.posing.check_rig(path, options.rigging)
    options.engines.check(path)
    pose = None if options.pose_file is None else Path(options.pose_file)
    if pose is not None and (not options.posing.targets or pose.suffix.lower() not in RIG_MOTIONS):
        raise InputError(
            f"cannot write {pose}; --pose-file needs --pose photo and a name that ends in "
            f"{', '.join(RIG_MOTIONS)}"
        )
    motions = {name: options.motion(name, file) for name, file in wanted.items()}
    animated = animate(
        options.person,
        motions,
        options.running,
        deform=options.deform if options.exact else None,
        folder=path.parent,
        no_props=options.no_props,
        posing=options.posing,
    )
    if sound is not None:
        animated = with_speech(animated, sound)
    if options.exact:
        name, written = next(iter(wanted)), [path]
        write_morph_glb(
            path, animated.character.surface, animated.exact, animated.clips[name][1], clip=name
        )
    else:
        written = write_animated(path, animated, options.rigging, options.engines, avatar)
    if pose is not None:
        written += [write_pose(pose, animated.character)]
    facts = {"clips": list(animated.clips), **animated.facts}
    return Answer(files=written, notes=animated.notes, facts=facts)


STANDING = "Idle"
"""Action of somebody who only speaks."""


def speaking(options: Options, seconds: float) -> Options:
    """Return the options of a person who speaks for some seconds: clips are that long by default,
    and the person stands if there are none."""
    lengths = options.lengths
    if lengths.seconds is None and lengths.frames is None:
        lengths = replace(lengths, seconds=seconds)
    alone = not (options.action.strip() or options.actions.strip() or options.motions.strip())
    return replace(options, lengths=lengths, action=STANDING if alone else options.action)


def with_speech(animated: Animated, sound: FloatArray) -> Animated:
    """Return a character whose mouth speaks in all clips."""
    face = animated.character.surface.face
    if face is None:
        return replace(
            animated, notes=[*animated.notes, "the character has no face: --say moves nothing"]
        )
    expressions = {}
    for name, (moves, fps) in animated.clips.items():
        mouth = mouth_of_speech(sound, RATE, frames=len(moves), fps=fps)
        kept = {key: value for key, value in mouth.items() if key in face.names}
        expressions[name] = {**animated.expressions.get(name, {}), **kept}
    return replace(animated, expressions=expressions)


@dataclass(frozen=True, kw_only=True)
class Animated:
    """A character with its clips.

    Attributes
    ----------
    clips : dict
        Bone transforms (T, B, 4, 4) and frames per second, by name.
    expressions : dict
        Strengths (T,) of the face's expressions by clip and name.
    exact : array (T, V, 3)
        Vertices of the last clip by Eq. 20 if requested; else empty.
    props : Props
        Steps, ladders and bars of the clips in which the person climbs.
    notes : list of str
    facts : dict
        What ``--json`` tells of the photo's camera, for the pose of the photo.
    """

    character: Character
    clips: Mapping[str, tuple[FloatArray, float]] = field(default_factory=dict)
    expressions: Strengths = field(default_factory=dict)
    exact: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 3), np.float32))
    props: Props = field(default_factory=lambda: Props.of([]))
    notes: list[str] = field(default_factory=list)
    facts: Mapping[str, object] = field(default_factory=dict)


def animate(
    person: PersonRequest,
    motions: Mapping[str, MotionRequest],
    running: RunOptions,
    *,
    deform: DeformSettings | None,
    folder: Path,
    no_props: bool = False,
    posing: PoseOptions = AT_REST,
) -> Animated:
    """Make the character of a person with clips by name, each the same as in the video.

    With `deform` the exact vertices are returned too.

    Raises
    ------
    InputError
        The request cannot be met, or `folder` cannot be written. This is checked before a long
        computation starts.
    """
    store = Store(running.cache)
    film = FilmRequest(no_props=no_props, deform=DeformSettings() if deform is None else deform)
    asked = {
        name: VideoRequest(person=person, motion=motion, film=film).resolve(store)
        for name, motion in motions.items()
    }
    check_writable(folder)
    clips, expressions, notes = (
        dict[str, tuple[FloatArray, float]](),
        dict[str, Mapping[str, FloatArray]](),
        list[str](),
    )
    solids = dict[str, Props]()
    exact = np.zeros((0, 0, 3), np.float32)
    for name, resolved in asked.items():
        kept = (
            "engine_character" if deform is None else "character"
        )  # Exact vertices are those of the character without simplification.
        outcome = running.run(
            [kept, "poses", *(["vertices"] if deform else ["props"]), *posing.targets],
            resolved.parameters,
            graph=resolved.graph,
        )
        poses = outcome.get("poses", Poses)
        clips[name], expressions[name] = (poses.bone_transforms, poses.fps), poses.expressions
        if deform is None:
            solids[name] = outcome.get("props", Props)
        else:
            exact = np.stack(
                [store.get(ref, Vertices).vertices for ref in outcome.values["vertices"]]
            )
        notes += [text for text in outcome.notes if text not in notes]
    return Animated(
        character=posing.posed(outcome, kept),
        clips=clips,
        expressions=expressions,
        exact=exact,
        props=Props.of_clips(solids),
        notes=notes,
        facts=posing.facts(outcome),
    )


def write_animated(
    path: Path,
    animated: Animated,
    rigging: RigOptions,
    engines: EngineOptions,
    avatar: VrmMeta | None,
) -> list[Path]:
    """Write a skinned character with its clips in the format of the path's suffix.

    `avatar` is the description that a ``.vrm`` holds.
    """
    if avatar is not None:
        return write_avatar(
            path, animated.character, animated.clips, avatar, expressions=animated.expressions
        )
    person, clips = rigging.prepare(animated.character, animated.clips)
    if engines.plain:
        write_character(
            path, person, clips, FORMATS, expressions=animated.expressions, props=animated.props
        )
        return [path]

    def write(target: Path, made: Character, quality: int) -> None:
        write_glb(
            target,
            made,
            clips,
            jpeg_quality=quality,
            expressions=animated.expressions,
            props=animated.props,
        )

    return engines.write(path, person, write)


def avatar_of(path: Path, rigging: RigOptions, avatar: AvatarOptions) -> VrmMeta | None:
    """Return the description that a ``.vrm`` holds; None for other files.

    Raises
    ------
    InputError
        No format has this suffix, or see `AvatarOptions.meta`.
    """
    if path.suffix.lower() != AVATAR:
        writer_of(path, FORMATS)
    return avatar.meta(path, rigging)


def _wanted(options: Options, path: Path) -> dict[str, str | None]:
    """Return the clips to make by name: None for an action of the model, else a motion file."""
    wanted: dict[str, str | None] = {}
    actions = [*filter(None, [options.action.strip()]), *_listed(options.actions)]
    asked: list[tuple[str, str | None]] = [(name, None) for name in actions]
    for name, file in [*asked, *((Path(file).stem, file) for file in _listed(options.motions))]:
        if name in wanted:
            raise InputError(
                f"clip '{name}' is given twice; every clip of a file needs a different name"
            )
        wanted[name] = file
    if not wanted:
        raise InputError(
            "no clip given; name one with --action, several with --actions (a2v actions lists "
            "them), or files with --motions"
        )
    if options.exact and (path.suffix.lower() != ".glb" or len(wanted) > 1):
        raise InputError(
            "--exact writes one action to a .glb; leave the others out, or leave --exact out"
        )
    if options.exact and not options.rigging.plain:
        raise InputError("--exact writes no bones; leave --rig and --root-motion out")
    return wanted


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]

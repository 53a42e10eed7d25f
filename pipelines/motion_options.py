"""What the commands take in of a motion: actions or a file, how long, where to, and what is done to it; checked before anything long runs."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.registry import readable_motions
from a2v.kinematics.resample import SHOWN_FPS
from a2v.motion.edit import Edit
from pipelines.graph import Parameters
from pipelines.options import flag, option
from pipelines.store import File

if TYPE_CHECKING:
    from a2v.motion import MotionModel
    from a2v.motion.prompts import Step
    from a2v.motion.wishes import Direction

AUTO, FEW, MANY = "auto", "cmu", "cmu-fine"
"""The default model, and what it stands for: the papers' eight actions where nothing else is asked for, 124 otherwise."""

MODEL = f"motion model: {AUTO} ({FEW} for its eight actions, else {MANY}), a name, or an .onnx file"
"""What the options that name a motion model say."""

ACTION = "what to do, by name or in words, one after the other with commas or 'then' (see a2v actions)"
SECONDS = "length of a motion (default: 5, or as long as the model's own clips are)"
FRAMES = "length in frames, instead of --seconds"
FPS = "frames a second"
"""What the options of the same names say."""

DEFAULT_SECONDS = 5.0
MAX_FRAMES = 10_000


def length_of(*, frames: int | None, seconds: float | None, fps: float, longest: float = np.inf) -> int:
    """Frames at `fps` of a motion: as many as are asked for, or `seconds`, or `DEFAULT_SECONDS` where those are not `longest`.

    Raises
    ------
    InputError
        Both are asked for, or a number is out of range.
    """
    if frames is not None and seconds is not None:
        raise InputError(f"both frames ({frames}) and seconds ({seconds:g}) are given; give one of them")
    if not 0.5 <= fps <= 240:
        raise InputError(f"fps is {fps}; expected 0.5 to 240")
    if seconds is not None and not 0 < seconds <= MAX_FRAMES / fps:
        raise InputError(f"seconds is {seconds:g}; expected more than 0 and at most {MAX_FRAMES / fps:g} at {fps:g} frames a second")
    if frames is None:
        frames = max(1, round((min(DEFAULT_SECONDS, longest) if seconds is None else seconds) * fps))
    if not 1 <= frames <= MAX_FRAMES:
        raise InputError(f"frames is {frames}; expected 1 to {MAX_FRAMES}")
    return frames


def open_model(name: str, action: str = "", *, timeline: str | None = None, directed: bool = False) -> MotionModel:
    """The named model; for `AUTO` the one for what is asked for: timelines and what is directed take the many actions.

    Raises
    ------
    InputError
        No such model.
    """
    from a2v.motion import MotionModel
    from a2v.motion.prompts import Vocabulary, parse_prompt

    if name != AUTO:
        return MotionModel.load(name)
    if action and timeline is None and not directed:
        few = MotionModel.load(FEW)
        with contextlib.suppress(InputError):  # nothing among the few comes near
            if all(match.score >= 1 for match in parse_prompt(action, Vocabulary.of(few.card))[1]):
                return few
    return MotionModel.load(MANY)


def _who_knows(action: str) -> str:
    """The first shipped model that knows all parts of an action by name; "" if none does."""
    from a2v.motion import MotionModel
    from a2v.motion.prompts import Vocabulary, parse_prompt

    for name in (FEW, MANY, "humanact12", "humanact12-fine"):
        with contextlib.suppress(InputError):
            if all(match.score >= 1 for match in parse_prompt(action, Vocabulary.of(MotionModel.load(name).card))[1]):
                return name
    return ""


def read_steps(model: MotionModel, action: str, timeline: str | None = None) -> tuple[list[Step], list[str]]:
    """The steps of an action in words, or of a timeline's file, and what was taken for what, a line a part that is not an action's own name.

    Raises
    ------
    InputError
        Neither or both are given, a part is empty, or nothing comes near it; the nearest are named.
    """
    from a2v.motion.prompts import Vocabulary, explain, parse_prompt
    from a2v.motion.timeline import read_timeline

    if timeline is not None and action:
        raise InputError("both action and timeline are given; give one of them")
    if timeline is None and not action:
        raise InputError("no action given; name one with --action (a2v actions lists them), or give a --timeline or a --motion")
    known = Vocabulary.of(model.card)
    try:
        steps, matches = parse_prompt(action, known) if timeline is None else read_timeline(timeline, known)
    except InputError as error:
        other = "" if timeline is not None else _who_knows(action)
        raise InputError(f"{error}; --model {other} knows it" if other else str(error)) from None
    return steps, explain([match for match in matches if match.score < 1])


def motion_inputs(
    *,
    action: str,
    model: str,
    motion: str | None = None,
    frames: int | None = None,
    seconds: float | None = None,
    fps: float = SHOWN_FPS,
    seed: int = 0,
    timeline: str | None = None,
    edit: Edit = Edit(),
    **way: Any,
) -> Parameters:
    """The graph's parameters for a generated (`model`) or a recorded (`motion`, a file) motion; see `length_of` and `WayOptions`.

    Raises
    ------
    InputError
        An unknown model or file, an action that nothing comes near (the nearest are named), or a number out of range.
    """
    if motion is not None:
        if alone := [name for name, value in (("timeline", timeline), *way.items()) if value is not None]:
            raise InputError(f"{alone[0]} cannot be given with motion; a recorded motion goes where it went")
        length = length_of(frames=frames, seconds=seconds, fps=fps)
        return {"motion_file": File.of(motion), "action": action, "frames": length, "fps": fps, "edit": edit}
    asked_way = WayOptions(**way)
    opened = open_model(model, action, timeline=timeline, directed=asked_way.given)
    steps, _ = read_steps(opened, action, timeline)
    length = length_of(frames=frames, seconds=seconds, fps=fps, longest=opened.card.frames / opened.fps)
    direction = read_direction(opened, steps, asked_way, fps=fps)
    asked = {"steps": tuple(steps), "frames": length, "seed": seed, "fps": fps}
    return {"model": File.of(opened.path), **asked, "edit": edit, "direction": direction}


def read_direction(model: MotionModel, steps: Sequence[Step], way: WayOptions, *, fps: float, count: int = 1) -> Direction | None:
    """Where the motion shall go, and what shall be on its way; None where nothing is asked for.

    Raises
    ------
    InputError
        A file or a number is none, or the model or the steps cannot take it.
    """
    from a2v.motion.direct import check_directed
    from a2v.motion.keyframes import read_holds, read_keyframes, read_poses
    from a2v.motion.ways import read_path
    from a2v.motion.wishes import Direction, Keyframe

    if way.path is None and way.pace is not None:
        raise InputError(f"pace is {way.pace:g}, but there is no path; give one with --path, or change the tempo with --speed")
    if not way.given:
        return None
    path = None if way.path is None else read_path(way.path)
    check_directed(model, steps, Direction(path=path), count=count)
    keys, holds = ([], []) if way.keyframes is None else read_keyframes(way.keyframes, model, fps=fps)
    if way.start_pose is not None:
        keys += [Keyframe(time=at, joints=pose) for at, pose in read_poses(way.start_pose, model)]
    if way.end_pose is not None:
        poses = read_poses(way.end_pose, model)
        keys += [Keyframe(time=poses[-1][0] - at, joints=pose, to_end=True) for at, pose in poses]
    holds += [] if way.hold is None else read_holds(way.hold)
    heading = None if way.heading is None else float(np.radians(way.heading))
    direction = Direction(path=path, pace=way.pace, heading=heading, keyframes=tuple(keys), holds=tuple(holds))
    check_directed(model, steps, direction)
    return direction


@dataclass(frozen=True, kw_only=True)
class WayOptions:
    """Where a motion goes, and what is on its way (docs/motion.md)."""

    path: str | None = option("go along this: points 'x,z x,z ...' in metres, or a .csv, .yaml or .svg file", default=None)
    pace: float | None = option("metres a second along --path; by default as fast as the action goes", default=None, rare=True)
    heading: float | None = option("face this way all along, degrees: 0 is ahead, 90 the left", default=None, metavar="DEGREES", rare=True)
    keyframes: str | None = option(
        "YAML file of poses of motion files, places and headings at given times, and joints that are held",
        default=None,
        metavar="FILE",
        rare=True,
    )
    start_pose: str | None = option(
        "the first pose: that of a motion file, FILE#12, or FILE#8-15 for some", default=None, metavar="FILE", rare=True
    )
    end_pose: str | None = option("the last pose, likewise", default=None, metavar="FILE", rare=True)
    hold: str | None = option(
        "joints that are held: 'left_wrist 0.3,1.4,0.4 from 1 to 2; ...', metres and seconds; 'left_wrist body ...' from the root",
        default=None, metavar="WHAT", rare=True,
    )  # fmt: skip

    @property
    def given(self) -> bool:
        """Whether anything is asked for."""
        return any(getattr(self, item.name) is not None for item in dataclasses.fields(WayOptions) if item.name != "pace")


@dataclass(frozen=True, kw_only=True)
class EditOptions:
    """What is done to a motion once it is made."""

    loop: bool = flag("a seamless cycle out of the motion")
    in_place: bool = flag("neither travel nor turning; the sway of steps stays")
    mirror: bool = flag("left and right exchanged", rare=True)
    speed: float = option("tempo: 2 is twice as fast", default=1.0, rare=True)

    @property
    def edit(self) -> Edit:
        """The same for the library."""
        return Edit(speed=self.speed, mirror=self.mirror, loop=self.loop, in_place=self.in_place)


@dataclass(frozen=True, kw_only=True)
class PlanOptions:
    """What is done, for how long, and where to."""

    action: str = option(ACTION, default="")
    timeline: str | None = option(
        "YAML file of actions with their lengths, instead of --action (docs/motion.md)", default=None, metavar="FILE"
    )
    model: str = option(MODEL, default=AUTO)
    seconds: float | None = option(SECONDS, default=None)
    frames: int | None = option(FRAMES, default=None, rare=True)
    fps: float = option(FPS, default=SHOWN_FPS)
    seed: int = option("seed of the motion: another seed, another performance", default=0)


@dataclass(frozen=True, kw_only=True)
class MotionOptions(EditOptions, WayOptions, PlanOptions):
    """A motion for one person, generated or recorded."""

    motion: str | None = option(f"recorded motion instead of a model: {readable_motions()}", default=None, metavar="FILE")

    def parameters(self) -> Parameters:
        """See `motion_inputs`."""
        edits = {item.name for item in dataclasses.fields(EditOptions)}
        given = {item.name: getattr(self, item.name) for item in dataclasses.fields(self) if item.name not in edits}
        return motion_inputs(**given, edit=self.edit)

    def explained(self) -> list[str]:
        """What the words of the action were taken for, a line a part that is not an action's own name."""
        if self.motion is not None:
            return []
        return read_steps(open_model(self.model, self.action, timeline=self.timeline, directed=self.given), self.action, self.timeline)[1]

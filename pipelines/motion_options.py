"""What the commands take in of a motion: actions or a file, how long, where to, and what is done to it; checked before anything long runs."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

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
    from a2v.motion.direct import Direction
    from a2v.motion.prompts import Step

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


def open_model(name: str, action: str = "", *, timeline: str | None = None, path: str | None = None) -> MotionModel:
    """The named model; for `AUTO` the one for what is asked for: paths and timelines take the many actions.

    Raises
    ------
    InputError
        No such model.
    """
    from a2v.motion import MotionModel
    from a2v.motion.prompts import Vocabulary, parse_prompt

    if name != AUTO:
        return MotionModel.load(name)
    if action and timeline is None and path is None:
        few = MotionModel.load(FEW)
        with contextlib.suppress(InputError):  # nothing among the few comes near
            if all(match.score >= 1 for match in parse_prompt(action, Vocabulary.of(few.card))[1]):
                return few
    return MotionModel.load(MANY)


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
    steps, matches = parse_prompt(action, known) if timeline is None else read_timeline(timeline, known)
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
    path: str | None = None,
    pace: float | None = None,
    edit: Edit = Edit(),
) -> Parameters:
    """The graph's parameters for a generated (`model`) or a recorded (`motion`, a file) motion; see `length_of`.

    Raises
    ------
    InputError
        An unknown model or file, an action that nothing comes near (the nearest are named), or a number out of range.
    """
    if motion is not None:
        if alone := [name for name, value in (("timeline", timeline), ("path", path)) if value is not None]:
            raise InputError(f"{alone[0]} cannot be given with motion; a recorded motion goes where it went")
        length = length_of(frames=frames, seconds=seconds, fps=fps)
        return {"motion_file": File.of(motion), "action": action, "frames": length, "fps": fps, "edit": edit}
    opened = open_model(model, action, timeline=timeline, path=path)
    steps, _ = read_steps(opened, action, timeline)
    length = length_of(frames=frames, seconds=seconds, fps=fps, longest=opened.card.frames / opened.fps)
    direction = read_direction(opened, steps, path, pace)
    asked = {"steps": tuple(steps), "frames": length, "seed": seed, "fps": fps}
    return {"model": File.of(opened.path), **asked, "edit": edit, "direction": direction}


def read_direction(model: MotionModel, steps: Sequence[Step], path: str | None, pace: float | None) -> Direction | None:
    """Where the motion shall go; None where nothing is asked for.

    Raises
    ------
    InputError
        The path is none, or the model or the steps cannot take one.
    """
    from a2v.motion.direct import Direction, check_directed, read_path

    if path is None:
        if pace is not None:
            raise InputError(f"pace is {pace:g}, but there is no path; give one with --path, or change the tempo with --speed")
        return None
    direction = Direction(path=read_path(path), pace=pace)
    check_directed(model, steps)
    return direction


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
    path: str | None = option("go along this: points 'x,z x,z ...' in metres, or a .csv of two columns", default=None)
    pace: float | None = option("metres a second along --path; by default as fast as the action goes", default=None, rare=True)


@dataclass(frozen=True, kw_only=True)
class MotionOptions(EditOptions, PlanOptions):
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
        return read_steps(open_model(self.model, self.action, timeline=self.timeline, path=self.path), self.action, self.timeline)[1]

"""Request for the motion of a video: actions or a file, length, path and edits.

Everything is checked before a long computation starts.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.animation import BlinkSettings, RetargetSettings
from a2v.errors import InputError
from a2v.footage import FollowSettings
from a2v.formats.registry import split_clip
from a2v.kinematics.resample import SHOWN_FPS
from a2v.motion.catalog import LICENSES
from a2v.motion.edit import Edit
from pipelines.engine.graph import Parameters
from pipelines.engine.refs import File
from pipelines.nodes.values import MotionFile
from pipelines.options import flag, option, settings
from pipelines.requests.fields import Request
from pipelines.requests.offer import offer_nearest
from pipelines.requests.ways import MANY, WayOptions, direction_of

if TYPE_CHECKING:
    from a2v.motion import MotionModel
    from a2v.motion.plan import MotionPlan

AUTO = "auto"
"""The default: all sources (`a2v.motion.plan`)."""

MODEL = f"source of the motion: {AUTO} (all), clips, the name of a model, or an .onnx file"
"""Help of the options that name a motion model."""

ACTION = "action by name or in words; separate several by commas or 'then' (list: a2v actions)"
SECONDS = "length in seconds (default: 5, or the length of the model's clips)"
FRAMES = "length in frames, in place of --seconds"
FPS = "frames per second"
"""Help of options with these names."""

MOTION_FILES = ".bvh, .npz, .fbx, .glb#CLIP... (docs/formats.md), or a video"
"""Help of the options that name a motion file."""
MAP = (
    "table of the bones and their joints, where they are not understood (a file that does not "
    "exist is written, to be edited), of"
)
"""Help of the options that name a table of bones; what has the bones follows."""
FOLLOW_USERS = ("person", "turn", "start", "height", "lens", "camera", "face", "hands")
"""Settings of `FollowSettings` that everybody may want to change."""

DEFAULT_SECONDS = 5.0
MAX_FRAMES = 10_000


def length_of(
    *, frames: int | None, seconds: float | None, fps: float, longest: float = np.inf
) -> int:
    """Return the number of frames of a motion at `fps`.

    This is the given number of frames or `seconds`; otherwise `DEFAULT_SECONDS`, at most `longest`.

    Raises
    ------
    InputError
        Both are given, or a number is out of range.
    """
    if frames is not None and seconds is not None:
        raise InputError(
            f"both frames ({frames}) and seconds ({seconds:g}) are given; give one of them"
        )
    if not 0.5 <= fps <= 240:
        raise InputError(f"fps is {fps}; expected 0.5 to 240")
    if seconds is not None and not 0 < seconds <= MAX_FRAMES / fps:
        raise InputError(
            f"seconds is {seconds:g}; expected more than 0 and at most {MAX_FRAMES / fps:g} at "
            f"{fps:g} frames per second"
        )
    if frames is None:
        frames = max(
            1, round((min(DEFAULT_SECONDS, longest) if seconds is None else seconds) * fps)
        )
    if not 1 <= frames <= MAX_FRAMES:
        raise InputError(f"frames is {frames}; expected 1 to {MAX_FRAMES}")
    return frames


def open_model(name: str) -> MotionModel:
    """Open the named model; for `AUTO`, the one with the most actions.

    Raises
    ------
    InputError
        There is no model of that name.
    """
    from a2v.motion import MotionModel

    return MotionModel.load(MANY if name == AUTO else name)


def read_plan(asked: PlanOptions, *, directed: bool = False) -> MotionPlan:
    """Read the requested action as steps, and find the sources that make them (`plan_motion`).

    If some words name no action, a user at a terminal can choose one of the nearest actions.

    Raises
    ------
    InputError
        See `plan_motion`.
    """
    from a2v.motion.plan import plan_motion
    from a2v.motion.vocabulary import UnknownActionError

    action = asked.action
    while True:
        try:
            return plan_motion(
                action,
                model=asked.model,
                license=asked.license,
                timeline=asked.timeline,
                directed=directed,
                strict=asked.strict,
            )
        except UnknownActionError as error:
            chosen = (
                ""
                if asked.timeline is not None or error.text not in action
                else offer_nearest(error)
            )
            if not chosen:
                raise
            action = action.replace(error.text, chosen)


def plan_length(plan: MotionPlan, *, frames: int | None, seconds: float | None, fps: float) -> int:
    """Return the number of frames of a plan at `fps`; by default, its actions' natural length.

    See `length_of`.
    """
    if frames is None and seconds is None and plan.seconds is not None:
        seconds = plan.seconds
    return length_of(frames=frames, seconds=seconds, fps=fps, longest=plan.longest)


@dataclass(frozen=True, kw_only=True)
class EditOptions:
    """Options for edits of a finished motion."""

    loop: bool = flag("make the motion a seamless cycle")
    in_place: bool = flag("remove travel and turning; keep the sway of the steps")
    mirror: bool = flag("exchange left and right", rare=True)
    speed: float = option("tempo factor; 2 is twice as fast", default=1.0, rare=True)

    @property
    def edit(self) -> Edit:
        """Return these options as the library's `Edit`."""
        return Edit(speed=self.speed, mirror=self.mirror, loop=self.loop, in_place=self.in_place)


@dataclass(frozen=True, kw_only=True)
class ActionOptions:
    """Options for the action."""

    action: str = option(ACTION, default="")
    timeline: str | None = option(
        "YAML file of actions with their lengths, in place of --action (docs/motion.md)",
        default=None,
        metavar="FILE",
    )
    strict: bool = flag(
        "refuse words with an unknown part (default: it is left out, and said)", rare=True
    )


@dataclass(frozen=True, kw_only=True)
class DurationOptions:
    """Options for the length of a motion and its frame rate."""

    seconds: float | None = option(SECONDS, default=None)
    frames: int | None = option(FRAMES, default=None, rare=True)
    fps: float = option(FPS, default=SHOWN_FPS)


@dataclass(frozen=True, kw_only=True)
class LengthOptions(DurationOptions):
    """Options for the length, the model and the seed."""

    model: str = option(MODEL, default=AUTO)
    license: str = option(
        "any, or free: leave out sources that are for research only (HumanAct12)",
        default=LICENSES[0],
        choices=LICENSES,
        rare=True,
    )
    seed: int = option("seed of the motion; another seed gives another performance", default=0)


@dataclass(frozen=True, kw_only=True)
class PlanOptions(LengthOptions, ActionOptions):
    """Options for the action and its length."""


@dataclass(frozen=True, kw_only=True)
class CarryOptions:
    """Options for carrying a motion over to the person's body."""

    from_photo: bool = flag("begin in the pose of the photo and blend into the action")
    raw: bool = flag("skip the contact clean-up: feet may slide as in the motion", rare=True)
    look_at: str = option(
        "where the head looks: camera, ahead, left, right, up, down, back, or x,y,z in meters",
        default="",
        metavar="WHERE",
        rare=True,
    )
    no_blink: bool = flag("keep the eyes open (default: the person blinks)", rare=True)
    retarget: RetargetSettings = settings(
        RetargetSettings,
        users=("raw", "align", "level", "smoothing", "clear_arms", "from_photo", "life"),
    )
    blink: BlinkSettings = settings(BlinkSettings, users=("rate", "seed"))

    def parameters(self) -> Parameters:
        """Return the parameters `retarget` and `blink`."""
        carried = self.retarget
        life = carried.life
        if self.look_at:
            life = dataclasses.replace(life, look=self.look_at)
        carried = dataclasses.replace(
            carried,
            raw=self.raw or carried.raw,
            from_photo=self.from_photo or carried.from_photo,
            life=life,
        )
        return {
            "retarget": carried,
            "blink": dataclasses.replace(self.blink, rate=0) if self.no_blink else self.blink,
        }


@dataclass(frozen=True, kw_only=True)
class ResolvedMotion:
    """A motion that was checked.

    Attributes
    ----------
    parameters : dict
        Parameters of the graph for a generated (`model`) or a recorded (`motion_file`) motion.
    understood : tuple of str
        Interpretation of the words of the action, one line per step.
    """

    parameters: Parameters
    understood: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class MotionRequest(Request, CarryOptions, EditOptions, WayOptions, PlanOptions):
    """A motion for one person, generated or recorded, and how it is carried over to the body."""

    motion: str | None = option(
        f"recorded motion in place of --action: {MOTION_FILES}", default=None, metavar="FILE"
    )
    motion_bone_map: str | None = option(f"{MAP} --motion", default=None, metavar="FILE", rare=True)
    follow: FollowSettings = settings(FollowSettings, users=FOLLOW_USERS)

    def resolve(self) -> ResolvedMotion:
        """Return the graph's parameters of the motion. The words of the action are read once.

        Raises
        ------
        InputError
            The model, file or action is unknown (the message lists the nearest actions), or a
            number is out of range.
        """
        moving: Parameters = {"edit": self.edit, **self.parameters()}
        if self.motion is not None:
            alone = ("timeline", *(item.name for item in dataclasses.fields(WayOptions)))
            if given := [name for name in alone if getattr(self, name) is not None]:
                raise InputError(
                    f"{given[0]} cannot be given with motion; a recorded motion has its own path"
                )
            length = length_of(frames=self.frames, seconds=self.seconds, fps=self.fps)
            file, clip = split_clip(self.motion)
            table = None if self.motion_bone_map is None else File.of(self.motion_bone_map)
            return ResolvedMotion(
                parameters={
                    **moving,
                    "motion_file": MotionFile(file=File.of(file), clip=clip, bones=table),
                    "action": self.action,
                    "frames": length,
                    "fps": self.fps,
                    "follow": self.follow,
                }
            )
        if self.motion_bone_map is not None:
            raise InputError("a table of bones is given, but no file of a motion; leave it out")
        plan = read_plan(self, directed=self.given)
        length = plan_length(plan, frames=self.frames, seconds=self.seconds, fps=self.fps)
        moving["edit"] = plan.merged(self.edit)
        asked = {
            "steps": plan.steps,
            "frames": length,
            "seed": self.seed,
            "fps": self.fps,
            "direction": direction_of(plan, self, fps=self.fps),
        }
        return ResolvedMotion(
            parameters={
                **moving,
                "model": File.of(plan.path)
                if plan.model is not None
                else File(plan.path, plan.digest),
                **asked,
            },
            understood=tuple(plan.lines()),
        )

"""``a2v motion --from-video``: the motion of the person in a video."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from a2v.errors import InputError
from a2v.footage import SUFFIXES, FollowSettings, is_video
from a2v.footage.settings import LONGEST
from a2v.motion.edit import Edit
from a2v.types import Motion
from pipelines.engine.refs import File
from pipelines.graph import video_graph
from pipelines.inputs import RunOptions
from pipelines.nodes.values import MotionFile
from pipelines.options import option, settings
from pipelines.requests.motion import FOLLOW_USERS, PlanOptions, length_of


@dataclass(frozen=True, kw_only=True)
class FilmedOptions:
    """Options for a video that gives the motion."""

    from_video: str | None = option(
        f"follow the person in a video ({', '.join(SUFFIXES[:5])}...), or in all videos of a "
        "folder",
        default=None,
        metavar="FILE",
    )
    follow: FollowSettings = settings(FollowSettings, users=FOLLOW_USERS)


@dataclass(frozen=True)
class Made:
    """A motion, the notes for the user, and its facts."""

    motion: Motion
    notes: Sequence[str] = ()
    facts: Mapping[str, object] = field(default_factory=dict)


def follow_video(
    filmed: FilmedOptions, plan: PlanOptions, edit: Edit, running: RunOptions, others: Sequence[str]
) -> Made:
    """Return the motion of a video in the tempo of `edit`; of the whole video without a length.

    `others` are given options that cannot be combined with a video.

    Raises
    ------
    InputError
        Options that a video cannot take, or what `a2v.footage.follow.follow_person` refuses.
    """
    assert filmed.from_video is not None
    others = [
        *others,
        *(
            name
            for name in ("timeline", "seed")
            if getattr(plan, name) != getattr(PlanOptions, name)
        ),
    ]
    if others:
        raise InputError(
            f"{others[0]} cannot be given with from_video, since the video determines the motion; "
            "leave one of them out"
        )
    if not is_video(filmed.from_video):
        raise InputError(
            f"{filmed.from_video} is not named like a video; expected a name that ends in "
            f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"
        )
    frames = round(LONGEST * plan.fps)
    if plan.frames is not None or plan.seconds is not None:
        frames = length_of(frames=plan.frames, seconds=plan.seconds, fps=plan.fps)
    asked = {
        "motion_file": MotionFile(file=File.of(filmed.from_video)),
        "action": plan.action,
        "frames": frames,
        "fps": plan.fps,
        "follow": filmed.follow,
    }
    tempo = dataclasses.replace(Edit(), speed=edit.speed)
    outcome = running.run("motion", {**asked, "edit": tempo}, graph=video_graph(recorded=True))
    return Made(outcome.get("motion", Motion), outcome.notes)

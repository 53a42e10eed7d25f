"""Decide which wishes of a step can be kept, and tell it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.clips import clip_library
from a2v.motion.layers import is_upper
from a2v.motion.prompts import UNKEPT, Match, Step
from a2v.motion.wishes import told_wishes, without_wishes

STEERED = "cmu-fine"
"""The source that follows a path and turns by an angle."""
TURNS = ("Turn in place",)
"""Actions that turn by a given angle."""
ONE_SHOTS = (
    "Jump", "Jump forward", "High jump", "Jump kick", "Reach up", "Hop forward", "Long jump",
    "Hop on one foot", "Jump and turn",
)  # fmt: skip
"""Actions of the models that are done once, so that repetitions are counted."""
LEAST_SPEED = 0.3
"""Speed of an action from which it has a way, meters per second."""


def refusals(step: Step, alone: bool) -> dict[str, str]:
    """Map the wishes of a step that cannot be kept to reasons. `alone`: the prompt has no other
    step."""
    own, name, clip = step.wishes, step.action, None
    if step.source == CLIPS:
        library = clip_library()
        clip = library.clips[library.index(name)]
    found: dict[str, str] = {}
    travels = clip.pace > LEAST_SPEED if clip is not None else step.source == STEERED
    if own.count is not None:
        countable = name in ONE_SHOTS if clip is None else clip.plays != "loop" or clip.beats > 0
        if not countable:
            found["count"] = f"{name} has no end that could be counted"
    for wish in ("distance", "pace"):
        if getattr(own, wish) is not None and not travels:
            found[wish] = f"{name} of this source follows no way"
    if own.angle is not None and not (step.source == STEERED and name in TURNS):
        found["angle"] = "only a turn in place has an angle"
    if own.distance is not None and own.in_place:
        found["distance"] = "it is in place"
    if own.side == "both":
        found["side"] = f"{name} uses one side"
    elif own.side and clip is not None and not clip.mirrors:
        found["side"] = f"{name} uses both sides alike"
    if own.loop and not alone:
        found["loop"] = "a loop needs a prompt of one action"
    if own.over and not is_upper(own.over):
        found["over"] = f"{own.over} needs the legs"
    return found


def kept_and_told(
    steps: Sequence[Step], matches: Sequence[Match], *, bundled: bool = True
) -> tuple[list[Step], list[Match]]:
    """Return the steps with only the wishes that are kept, and the matches with all of them told;
    each that is not kept lowers the score. A model that is not `bundled` only takes edits."""
    left, told = [], []
    for step, match in zip(steps, matches, strict=True):
        refused = refusals(step, len(steps) == 1)
        if not bundled:
            edits = ("loop", "in_place", "mirror") if len(steps) == 1 else ()
            refused |= {
                name: "a model that is chosen by --model, or a direction, does not take it"
                for name in step.wishes.names()
                if name not in edits
            }
        lines = told_wishes(step.wishes, refused)
        left.append(dataclasses.replace(step, wishes=without_wishes(step.wishes, refused)))
        told.append(
            dataclasses.replace(
                match,
                told=(*match.told, *lines),
                score=match.score * UNKEPT ** len(refused),
            )
        )
    return left, told

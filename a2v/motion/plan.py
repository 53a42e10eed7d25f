"""Turn words or a timeline into typed steps and their sources: `plan_motion`.

The command line, tables, the page and Python all use it. No other code chooses the model or clip of
an action.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from a2v.digest import Digest
from a2v.errors import InputError
from a2v.motion.acting import make_directed, natural_seconds
from a2v.motion.catalog import (
    NAMES,
    RESEARCH,
    SOURCES,
    Understanding,
    catalog,
    read_prompt,
    understand,
    weaknesses,
)
from a2v.motion.clips import LIBRARY
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.direct import make_motion
from a2v.motion.direction import Direction
from a2v.motion.edit import Edit
from a2v.motion.figures import NATURAL_SECONDS
from a2v.motion.keeping import kept_and_told
from a2v.motion.medley import make_sourced
from a2v.motion.model import MotionModel
from a2v.motion.names import BUNDLED, plain_name
from a2v.motion.prompts import Match, Step, explain
from a2v.motion.timeline import Take, read_timeline
from a2v.motion.vocabulary import Vocabulary
from a2v.motion.wishes import without_wishes
from a2v.sessions import file_digest
from a2v.types import Motion

AUTO = "auto"
"""All sources (`a2v.motion.catalog.SOURCES`)."""
DECODERS = ("plain", "lie", "glmi-m", "glmi-r")
"""Decoders of the papers' VAE; each is shipped for CMU, HumanAct12 and its fine actions."""
VAE_DATA = ("humanact12", "cmu", "humanact12-fine")
"""Data sets of the papers' VAEs, in the order in which they are asked for an action: the papers'
own first, the finer actions last."""
DIRECTED = "cmu-fine"
"""The source that can be directed."""


@dataclass(frozen=True)
class MotionPlan:
    """Steps and their sources.

    Attributes
    ----------
    steps : tuple of Step
        Without a source if `model` makes all of them.
    matches : tuple of Match
        The match of each part of the words.
    model : MotionModel or None
        None if clips or several sources make the steps, or a step has wishes.
    edit : Edit
        Loop, in place and mirrored, if the words of a single step ask for them.
    """

    steps: tuple[Step, ...]
    matches: tuple[Match, ...]
    model: MotionModel | None
    edit: Edit = Edit()

    def merged(self, edit: Edit) -> Edit:
        """Return `edit` with what the words ask for."""
        return dataclasses.replace(
            edit,
            loop=edit.loop or self.edit.loop,
            in_place=edit.in_place or self.edit.in_place,
            mirror=edit.mirror != self.edit.mirror,
        )

    @property
    def sources(self) -> tuple[str, ...]:
        """The sources of the steps, each once: names of `SOURCES`, or the model's file."""
        return (
            (self.model.path.stem,)
            if self.model is not None
            else Understanding(self.steps, self.matches).sources
        )

    @property
    def path(self) -> str:
        """One file that the results depend on; `digest` covers all files."""
        return str(LIBRARY if self.model is None else self.model.path)

    @property
    def digest(self) -> Digest:
        """Digest of the contents of every file that the steps use."""
        if self.model is not None:
            return self.model.digest
        files = [
            LIBRARY,
            *(MotionModel.load(source).path for source in self.sources if source != CLIPS),
        ]
        return Digest.of(*(file_digest(path) for path in files))

    @property
    def seconds(self) -> float | None:
        """Natural length in seconds if no length is given; None for a model's actions
        without a length of their own."""
        if self.model is not None:
            return (
                NATURAL_SECONDS.get(self.steps[0].action)
                if len(self.steps) == 1 and self.steps[0].seconds is None
                else None
            )
        return sum(
            step.seconds if step.seconds is not None else natural_seconds(step)
            for step in self.steps
        )

    @property
    def longest(self) -> float:
        """Longest clip of a model, seconds; infinite for other sources."""
        return float("inf") if self.model is None else self.model.card.frames / self.model.fps

    def lines(self) -> list[str]:
        """The matches as text, one line per step."""
        told = explain(self.matches)
        names = [
            NAMES.get(step.source, step.source)
            if self.model is None
            else NAMES.get(self._model_name, self.model.path.stem)
            for step in self.steps
        ]
        weak = weaknesses()
        notes = [
            f"; {weak[step.action]}"
            if step.action in weak and "cmu-fine" in (step.source, self._model_name)
            else "; for research only"
            if {step.source, step.wishes.over_source, self._model_name} & set(RESEARCH)
            else ""
            for step in self.steps
        ]
        return [
            f"{line} [{name}]{note}" for line, name, note in zip(told, names, notes, strict=True)
        ]

    @property
    def _model_name(self) -> str:
        """Name of the one model among the shipped ones; empty for others and for several
        sources."""
        files = {file: name for name, file in BUNDLED.items()}
        return "" if self.model is None else files.get(self.model.path.name, "")

    def make(
        self, take: Take, *, edit: Edit = Edit(), direction: Direction | None = None
    ) -> Motion:
        """Make the motion; see `make_steps`."""
        return make_steps(self.model, self.steps, take, edit=self.merged(edit), direction=direction)


def make_steps(
    model: MotionModel | None,
    steps: Sequence[Step],
    take: Take,
    *,
    edit: Edit = Edit(),
    direction: Direction | None = None,
) -> Motion:
    """Make steps of one model by `make_motion`, and steps with sources by `make_sourced`.

    `make_sourced` takes neither bone lengths nor a direction.

    Raises
    ------
    InputError
        See both.
    """
    if model is not None and not any(step.source for step in steps):
        return make_motion(model, steps, take, edit=edit, direction=direction)
    if direction is not None and take.lengths is None and take.count == 1:
        return make_directed(
            steps, frames=take.frames, fps=take.fps, direction=direction, seed=take.seed, edit=edit
        )
    if direction is not None or take.lengths is not None:
        raise InputError(
            f"{', '.join(step.action for step in steps)}: a motion with hand-keyed "
            "clips has fixed bones and a fixed path; "
            "leave out bone lengths, paths, poses and holds"
        )
    return make_sourced(
        steps, frames=take.frames, fps=take.fps, seed=take.seed, count=take.count, edit=edit
    )


def plan_motion(
    action: str = "",
    *,
    model: str = AUTO,
    license: str = "any",
    timeline: str | os.PathLike[str] | None = None,
    directed: bool = False,
    strict: bool = False,
) -> MotionPlan:
    """Turn words or a timeline into steps and their sources.

    Parameters
    ----------
    action : str
        Names or words, "sneak, then wave, then salsa for 2 s".
    model : str
        "auto" for all sources, "clips" for only the library, a decoder of the papers' VAE
        (`DECODERS`) for the first shipped one that knows the action, or a model as for
        `MotionModel.load`.
    license : "any" or "free"
        "free" leaves out sources for research only.
    timeline : path or None
        A YAML file instead of `action` (`read_timeline`).
    directed : bool
        Whether a direction will be given: then "auto" is the model that can be directed, unless the
        words name a clip.
    strict : bool
        Refuse words with an unknown part; it is left out otherwise, and told.

    Raises
    ------
    InputError
        Neither or both of action and timeline are given, a part matches no action
        (`UnknownActionError`, with the nearest ones), or the model is unknown.
    """
    if timeline is not None and action:
        raise InputError("both action and timeline are given; give one of them")
    if timeline is None and not action:
        raise InputError(
            "no action given; name one with --action (a2v actions lists them), or give a "
            "--timeline or a --motion"
        )
    if model in (AUTO, CLIPS):
        sources = SOURCES if model == AUTO else (CLIPS,)
        whole = catalog(license, sources)
        if timeline is None:
            found = understand(action, license=license, sources=sources, strict=strict)
        else:
            found = Understanding.of(*read_timeline(timeline, whole.vocabulary), whole)
        if not directed or model == CLIPS or found.sources == (CLIPS,):
            return _planned(found)
        model = DIRECTED
    if model in DECODERS:
        vaes = [f"{data}-{model}" for data in VAE_DATA]
        return _first_plan(
            sorted(vaes, key=lambda name: not _has_action(name, action)),
            functools.partial(
                plan_motion, action, license=license, timeline=timeline, strict=strict
            ),
        )
    opened = MotionModel.load(model)
    if license == "free" and "research" in opened.card.license:
        raise InputError(
            f"model {model} is for research only; leave --license free out, or choose another "
            "--model"
        )
    known = Vocabulary.of(opened.card)
    steps, matches = (
        read_prompt(action, known, strict=strict)
        if timeline is None
        else read_timeline(timeline, known)
    )
    named = [dataclasses.replace(step, source=model) for step in steps]
    left, told = kept_and_told(named, matches, bundled=model in SOURCES and not directed)
    return _planned(Understanding(tuple(left), tuple(told)), opened)


def _has_action(model: str, action: str) -> bool:
    """Return whether a model has an action of exactly this name."""
    return plain_name(action) in map(plain_name, MotionModel.load(model).actions)


def _first_plan(models: Sequence[str], plan: Callable[..., MotionPlan]) -> MotionPlan:
    """Return the plan by the first of some models that knows the action.

    Raises
    ------
    InputError
        None does; the message lists their actions.
    """
    for name in models:
        with contextlib.suppress(InputError):
            return plan(model=name)
    known = [
        action for name in models if "fine" not in name for action in MotionModel.load(name).actions
    ]
    raise InputError(
        f"none of {', '.join(models)} can make this motion; they know {', '.join(known)}, and "
        "finer ones (a2v actions --model humanact12-fine)"
    )


def _planned(found: Understanding, model: MotionModel | None = None) -> MotionPlan:
    """Make the plan of steps with sources. Loop, in place and mirrored, wished of a single step,
    become an edit."""
    steps, edit = found.steps, Edit()
    if len(steps) == 1:
        own = steps[0].wishes
        edit = Edit(loop=own.loop, in_place=own.in_place, mirror=own.mirror)
        kept = without_wishes(own, ("loop", "in_place", "mirror"))
        steps = (dataclasses.replace(steps[0], wishes=kept),)
    if any(step.wishes.any for step in steps):
        layers = (
            dataclasses.replace(
                step,
                wishes=dataclasses.replace(
                    step.wishes, over_source=step.wishes.over_source or step.source
                )
                if step.wishes.over
                else step.wishes,
            )
            for step in steps
        )
        return MotionPlan(tuple(layers), found.matches, None, edit)
    if model is None and (CLIPS in found.sources or len(found.sources) > 1):
        return MotionPlan(steps, found.matches, None, edit)
    plain = tuple(dataclasses.replace(step, source="") for step in steps)
    opened = MotionModel.load(found.sources[0]) if model is None else model
    return MotionPlan(plain, found.matches, opened, edit)

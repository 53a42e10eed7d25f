"""Turn words or a timeline into typed steps and their sources: `plan_motion`.

The command line, tables, the page and Python all use it. No other code chooses the model or clip of
an action.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass

from a2v.digest import Digest
from a2v.errors import InputError
from a2v.motion.catalog import (
    NAMES,
    SOURCES,
    Understanding,
    catalog,
    understand,
    weaknesses,
    with_sources,
)
from a2v.motion.clips import LIBRARY
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.direct import make_motion
from a2v.motion.direction import Direction
from a2v.motion.edit import Edit
from a2v.motion.figures import NATURAL_SECONDS
from a2v.motion.medley import make_sourced, natural_seconds
from a2v.motion.model import MotionModel
from a2v.motion.names import BUNDLED
from a2v.motion.prompts import Match, Step, explain, parse_prompt
from a2v.motion.timeline import Take, read_timeline
from a2v.motion.vocabulary import Vocabulary
from a2v.sessions import file_digest
from a2v.types import Motion

AUTO = "auto"
"""All sources (`a2v.motion.catalog.SOURCES`)."""
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
        None if clips or several sources make the steps.
    """

    steps: tuple[Step, ...]
    matches: tuple[Match, ...]
    model: MotionModel | None

    @property
    def sources(self) -> tuple[str, ...]:
        """The sources of the steps, each once: names of `SOURCES`, or the model's file."""
        return (
            (self.model.path.stem,)
            if self.model is not None
            else tuple(dict.fromkeys(step.source for step in self.steps))
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
        return make_steps(self.model, self.steps, take, edit=edit, direction=direction)


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
) -> MotionPlan:
    """Turn words or a timeline into steps and their sources.

    Parameters
    ----------
    action : str
        Names or words, "sneak, then wave, then salsa for 2 s".
    model : str
        "auto" for all sources, "clips" for only the library, or a model as for `MotionModel.load`.
    license : "any" or "free"
        "free" leaves out sources for research only.
    timeline : path or None
        A YAML file instead of `action` (`read_timeline`).
    directed : bool
        Whether a direction will be given: then "auto" is the model that can be directed.

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
    if model == AUTO and directed:
        model = DIRECTED
    if model not in (AUTO, CLIPS):
        opened = MotionModel.load(model)
        if license == "free" and "research" in opened.card.license:
            raise InputError(
                f"model {model} is for research only; leave --license free out, or choose another "
                "--model"
            )
        known = Vocabulary.of(opened.card)
        steps, matches = (
            parse_prompt(action, known) if timeline is None else read_timeline(timeline, known)
        )
        return MotionPlan(tuple(steps), tuple(matches), opened)
    sources = SOURCES if model == AUTO else (CLIPS,)
    if timeline is None:
        found = understand(action, license=license, sources=sources)
    else:
        whole = catalog(license, sources)
        steps, matches = read_timeline(timeline, whole.vocabulary)
        found = Understanding(tuple(with_sources(steps, whole)), tuple(matches))
    if found.sources == (CLIPS,) or len(found.sources) > 1:
        return MotionPlan(found.steps, found.matches, None)
    plain = tuple(dataclasses.replace(step, source="") for step in found.steps)
    return MotionPlan(plain, found.matches, MotionModel.load(found.sources[0]))

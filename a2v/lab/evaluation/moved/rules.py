"""Leave single rules of reading and coloring out, and measure what that changes.

Whatever changes one label makes the patches of a back match anew, and another seed of the matching
changes as much as many rules do. So every rule is measured with several seeds, and its effect is
held against the difference between seeds.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from a2v.animation import standing_character
from a2v.lab.evaluation.moved.cases import MovedCase
from a2v.lab.evaluation.moved.measures import (
    Moved,
    MovedSettings,
    TrueLook,
    color_scores,
    move,
    outer_faces,
)
from a2v.reconstruction.canonical import Sight, canonical_person
from a2v.reconstruction.canonical.coloring import as_person, canonical_painting
from a2v.reconstruction.coloring import STEPS, ColorSettings, Painting, finished
from a2v.reconstruction.face import FaceSettings
from a2v.reconstruction.reading import ReadingSettings, Source, read_photo
from a2v.reconstruction.rules import BAKING, READING
from a2v.types import IntArray, Reconstruction, Surface

METRICS: Mapping[str, str] = {
    "other": "other part's color %",
    "head": "head ΔE",
    "psnr": "PSNR dB",
    "ssim": "SSIM",
}
"""What is compared, in the T-pose."""
_LESS = ("other", "head")
"""Metrics of which less is better."""
CHANGED = 10 / 255
"""A vertex is changed if a channel of its color differs by more than this."""
_SEEDED = "continue_materials"
"""The first step that depends on the seed."""
_STUDENT = {2: 12.71, 3: 4.30, 4: 3.18, 5: 2.78, 6: 2.57, 7: 2.45, 8: 2.36}
"""95 % quantile of Student's t for means of so many values."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One photo colored with one seed, with all rules or without one.

    Attributes
    ----------
    photo : str
    rule : str
        That is left out; "" for none.
    seed : int
    scores : mapping of `METRICS` to value
        Empty for photos without a true person.
    changed : float
        Share of the vertices with another color than with all rules and the same seed; 1 if the
        shape changed.
    """

    photo: str
    rule: str
    seed: int
    scores: Mapping[str, float] = field(default_factory=dict)
    changed: float = 0.0


class Bench:
    """A person of one photo, colored again and again. What comes before a rule is not computed
    again.

    Parameters
    ----------
    name : str
        Of the photo.
    sight : Sight
        With its reading.
    person : Reconstruction
        The canonical person made of it with all rules.
    case : MovedCase, optional
        The true person.
    """

    def __init__(
        self,
        name: str,
        sight: Sight,
        person: Reconstruction,
        case: MovedCase | None,
        color: ColorSettings,
        protocol: MovedSettings,
    ) -> None:
        self.name, self.sight, self.person = name, sight, person
        self.case, self.color, self.protocol = case, color, protocol
        self._true = None if case is None else TrueLook.of(case, 0, protocol)
        self._moved: dict[str, tuple[Moved, IntArray]] = {}
        self._plain: list[Surface] = []
        painting = canonical_painting(person, [sight], color)
        self._before = {}
        for step in STEPS:
            self._before[step.__name__] = painting
            painting = step(painting)

    def trials(self, rules: Sequence[str], seeds: int) -> list[Trial]:
        """Color with all rules, and without each one. A rule that changes nothing with the first
        seed is not tried with the others."""
        found = []
        first = self._before[_SEEDED]
        for seed in range(seeds):
            self._plain.append(self._finished(self.person, first, seed))
            found.append(self._trial("", seed, self._plain[seed]))
        for rule in rules:
            person, painting = self._without(rule)
            for seed in range(seeds):
                trial = self._trial(rule, seed, self._finished(person, painting, seed))
                found.append(trial)
                if not trial.changed:
                    break
        return found

    def _without(self, rule: str) -> tuple[Reconstruction, Painting]:
        """Return the person without a rule, and its painting before the seeded step."""
        names = [step.__name__ for step in STEPS]
        settings = dataclasses.replace(self.color, without="" if rule in READING else rule)
        person, sight, at = self.person, self.sight, names[0]
        if rule in names or rule in BAKING:
            at = min(rule, _SEEDED, key=names.index) if rule in names else _SEEDED
            painting = dataclasses.replace(self._before[at], settings=settings)
        else:
            if rule in READING:
                person, sight = self._read_without(rule)
            if sight is self.sight and rule in READING:
                return person, self._before[_SEEDED]
            painting = canonical_painting(person, [sight], settings)
        for step in STEPS[names.index(at) : names.index(_SEEDED)]:
            painting = painting if step.__name__ in settings.off else step(painting)
        return person, painting

    def _read_without(self, rule: str) -> tuple[Reconstruction, Sight]:
        """Return the photo read without a rule, and the person built from it."""
        sight = self.sight
        source = Source(sight.subject, sight.body, sight.camera, sight.person.surface)
        given = read_photo(source, ReadingSettings(without=rule).readers)
        if given.to_bytes() == sight.reading.to_bytes():
            return self.person, sight
        sight = dataclasses.replace(sight, given=given)
        features = self.person.surface.provenance["features"]
        return canonical_person(sight, face=FaceSettings(features=features)), sight

    def _finished(self, person: Reconstruction, painting: Painting, seed: int) -> Surface:
        """Take the seeded step and all that follow."""
        first = [step.__name__ for step in STEPS].index(_SEEDED)
        settings = dataclasses.replace(painting.settings, seed=seed)
        painting = dataclasses.replace(painting, settings=settings)
        return as_person(person, painting, finished(painting, STEPS[first:]))

    def _trial(self, rule: str, seed: int, made: Surface) -> Trial:
        plain, changed = self._plain[seed], 1.0
        if np.array_equal(made.vertices, plain.vertices):
            away = np.abs(made.colors - plain.colors).max(axis=1)
            changed = float((away > CHANGED).mean())
            assert made.texture is not None
            assert plain.texture is not None
            if not changed and not np.array_equal(made.texture, plain.texture):
                changed = 1e-6  # in the texture only
        return Trial(self.name, rule, seed, self._scores(made), changed)

    def _scores(self, made: Surface) -> dict[str, float]:
        if self.case is None or self._true is None:
            return {}
        assert made.standing is not None
        key = hashlib.sha256(made.standing.vertices.tobytes()).hexdigest()
        character = standing_character(made, self.sight.body)
        if key not in self._moved:
            sight = self.sight
            moved = move(
                self.case, character, sight.body, sight.camera, sight.subject, self.protocol, 1
            )
            self._moved[key] = moved, outer_faces(moved.surface(0))
        moved, outer = self._moved[key]
        moved = dataclasses.replace(moved, character=character)
        return color_scores(self._true, moved.surface(0), outer, self.protocol)


@dataclass(frozen=True)
class Effect:
    """What a rule brings: the score with it minus that without it.

    Attributes
    ----------
    mean, half : float
        Mean over the photos, and half width of the 95 % interval over seeds.
    """

    mean: float
    half: float

    @property
    def clear(self) -> bool:
        """Whether it is larger than the interval."""
        return abs(self.mean) > self.half


def effect_of(trials: Sequence[Trial], rule: str, metric: str) -> Effect:
    """The effect of a rule on a metric, over the photos with a true person on which it acts."""
    plain = {(one.photo, one.seed): one.scores for one in trials if not one.rule}
    own = [one for one in trials if one.rule == rule and one.changed and one.scores]
    if not own:
        return Effect(0.0, 0.0)
    gains = {
        (one.photo, one.seed): plain[one.photo, one.seed][metric] - one.scores[metric]
        for one in own
    }
    return _interval(_means(gains))


def noise_of(trials: Sequence[Trial], metric: str) -> float:
    """Half width of the 95 % interval of the mean over all photos with a true person, over
    seeds."""
    plain = [one for one in trials if not one.rule and one.scores]
    means = _means({(one.photo, one.seed): one.scores[metric] for one in plain})
    return _interval(means).half if means else 0.0


def _means(values: Mapping[tuple[str, int], float]) -> list[float]:
    """Means over the photos, one for each seed, of values by photo and seed."""
    seeds = sorted({seed for _, seed in values})
    return [
        float(np.mean([value for (_, own), value in values.items() if own == seed]))
        for seed in seeds
    ]


def _interval(values: Sequence[float]) -> Effect:
    count = len(values)
    if count < 2:
        return Effect(float(np.mean(values)), float("inf"))
    half = _STUDENT.get(count, 1.96) * float(np.std(values, ddof=1)) / np.sqrt(count)
    return Effect(float(np.mean(values)), float(half))


def rules_table(trials: Sequence[Trial], rules: Mapping[str, str]) -> str:
    """One line a rule: what it is for, on how many photos it acts, and what it brings there."""
    photos = list(dict.fromkeys(one.photo for one in trials))
    lines = [
        f"| rule | what for | acts on, of {len(photos)} | vertices changed % | "
        + " | ".join(METRICS.values())
        + " | clear |",
        "|---" * (len(METRICS) + 5) + "|",
    ]
    for rule, purpose in rules.items():
        own = [one for one in trials if one.rule == rule and one.changed]
        acts = len({one.photo for one in own})
        changed = 100 * float(np.mean([one.changed for one in own])) if own else 0.0
        effects = [effect_of(trials, rule, metric) for metric in METRICS]
        cells = [
            f"{one.mean:+.{digits}f} ± {one.half:.{digits}f}"
            for digits, one in zip((2, 2, 2, 3), effects, strict=True)
        ]
        signs = {
            (one.mean < 0) == (metric in _LESS)
            for metric, one in zip(METRICS, effects, strict=True)
            if one.clear
        }
        clear = {(True,): "better", (False,): "worse", (): "no"}.get(tuple(signs), "both")
        lines.append(
            f"| {rule} | {purpose} | {acts} | {changed:.1f} | {' | '.join(cells)} | {clear} |"
        )
    return "\n".join(lines)

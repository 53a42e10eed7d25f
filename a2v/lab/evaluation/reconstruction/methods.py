"""Run the methods under test on one photo."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError
from a2v.lab.evaluation.reconstruction.cases import Case
from a2v.lab.evaluation.reconstruction.maps import mask_in_photo
from a2v.lab.evaluation.reconstruction.measures import Truth
from a2v.lab.evaluation.reconstruction.settings import BenchmarkSettings
from a2v.processes import safe_children
from a2v.reconstruction.backends import ABLATIONS, DEFAULT_BACKEND, NAMES, backend_of
from a2v.reconstruction.colorings import COLORINGS
from a2v.types import ByteArray, Subject, Surface

if TYPE_CHECKING:
    from a2v.body import FitResult

CHARACTER = "character"
"""Name of the `Method` that makes the canonical character."""


@dataclass(frozen=True)
class Method:
    """A backend with a coloring: ``body-prior``, or ``body-prior:mirrored`` for an ablation.

    Or ``character``, the canonical one, and ``character+180+90`` with further photos, in which the
    person has turned by these degrees (`turns`). `weights` is a folder of weights for backends that
    have some; "" for the shipped ones.
    """

    backend: str
    coloring: str = "ours"
    weights: str = ""
    character: bool = False
    turns: tuple[float, ...] = ()

    @classmethod
    def parse(cls, text: str, weights: str = "") -> Method:
        """Parse a method from its name.

        Raises
        ------
        InputError
            Unknown backend or coloring, or turns that are not degrees.
        """
        first, *turns = text.split("+")
        if first == CHARACTER:
            if not all(turn.isdecimal() and 0 < int(turn) < 360 for turn in turns):
                raise InputError(
                    f"unknown method '{text}'; "
                    "expected degrees from 1 to 359 after every +, as in character+180"
                )
            return cls(DEFAULT_BACKEND, "ours", weights, True, tuple(float(turn) for turn in turns))
        backend, _, coloring = text.partition(":")
        coloring = coloring or "ours"
        if backend not in NAMES and backend not in ABLATIONS:
            raise InputError(
                f"unknown backend '{backend}'; choose from {', '.join((*NAMES, *ABLATIONS))}"
            )
        if coloring not in COLORINGS:
            raise InputError(f"unknown coloring '{coloring}'; choose from {', '.join(COLORINGS)}")
        return cls(backend, coloring, weights)

    @property
    def name(self) -> str:
        """The name, as for `parse`."""
        if self.character:
            return "+".join([CHARACTER, *(f"{turn:.0f}" for turn in self.turns)])
        return self.backend if self.coloring == "ours" else f"{self.backend}:{self.coloring}"


@dataclass(frozen=True)
class Outcome:
    """The results of one photo, in numbers.

    Attributes
    ----------
    name, index, facts
        Of the `Case`.
    scores : mapping of method name to metric to value
    seconds : mapping of method name to stage to wall seconds
    made : mapping of method name to mapping
        Provenance of the surface: digest of the weights, iterations of Eq. 14...
    fit : mapping of `FIT_METRICS` to value
        Of the fitted body, which all methods share.
    failure : str
        Reason why perception, the fit or a method failed; "" otherwise. Failed photos count for no
        method.
    """

    name: str
    index: int
    facts: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    scores: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)
    seconds: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)
    made: Mapping[str, Mapping[str, Any]] = dataclasses.field(default_factory=dict)
    fit: Mapping[str, float] = dataclasses.field(default_factory=dict)
    failure: str = ""

    @property
    def identity(self) -> str:
        """Name of the person, without the outfit."""
        return self.name.rpartition("_")[0]

    @property
    def outfit(self) -> str:
        """Name of the outfit."""
        return self.name.rpartition("_")[2]

    def with_others(self, later: Outcome) -> Outcome:
        """Merge this outcome with that of another run on the same photo."""
        return dataclasses.replace(
            later,
            scores={**self.scores, **later.scores},
            seconds={**self.seconds, **later.seconds},
            made={**self.made, **later.made},
        )


@dataclass(frozen=True, eq=False)
class Result:
    """An outcome with the surfaces by method in the true frame, and the subject (None if the photo
    failed)."""

    case: Case
    outcome: Outcome
    surfaces: Mapping[str, Surface] = dataclasses.field(default_factory=dict)
    subject: Subject | None = None


Again = Callable[[float], Case]
"""Makes another photo of the person of a case, turned by this many degrees."""


def evaluate_case(
    case: Case, methods: Sequence[Method], settings: BenchmarkSettings, again: Again | None = None
) -> Result:
    """Run perception, fit, and each method on one photo. All methods share the fit; those that only
    color share the shape.

    `again` makes the further photos of characters from several photos. If perception, fit or a
    method fails, the outcome has the reason (`Outcome.failure`).
    """
    try:
        return _evaluate(case, methods, settings, again)
    except InputError as error:
        return Result(case, Outcome(case.name, case.index, case.facts, failure=str(error)))


def _evaluate(
    case: Case, methods: Sequence[Method], settings: BenchmarkSettings, again: Again | None
) -> Result:
    from a2v.body import FitSettings, fit_body

    clock = _Clock()
    subject = _seen(case, settings)
    clock.lap("perception")
    fit = fit_body(subject, settings=FitSettings(distance=settings.distance))
    clock.lap("fit")
    photo = _Photo(case, settings, subject, fit, Truth(case, settings), dict(clock.seconds))
    photo.measure_characters([method for method in methods if method.character], again)
    photo.measure_backends([method for method in methods if not method.character])
    made = {name: dict(surface.provenance) for name, surface in photo.surfaces.items()}
    fitted = photo.truth.compare_fit(fit, subject)
    outcome = Outcome(case.name, case.index, case.facts, photo.scores, photo.seconds, made, fitted)
    return Result(case, outcome, photo.surfaces, subject)


@dataclass(eq=False)
class _Photo:
    """One photo with its fitted body, and the results of the methods by their names."""

    case: Case
    settings: BenchmarkSettings
    subject: Subject
    fit: FitResult
    truth: Truth
    common: dict[str, float]
    scores: dict[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)
    seconds: dict[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)
    surfaces: dict[str, Surface] = dataclasses.field(default_factory=dict)

    def measure_characters(self, methods: Sequence[Method], again: Again | None) -> None:
        """Measure canonical characters, of this photo and of further ones (`again`)."""
        from a2v.body import FitSettings, fit_body
        from a2v.body.confidence import looks_wrong
        from a2v.lab.evaluation.reconstruction.characters import character_of

        fitting = FitSettings(distance=self.settings.distance)
        turned: dict[float, tuple[Subject, FitResult]] = {}
        for method in methods:
            clock = _Clock()
            for turn in method.turns:
                if turn not in turned:
                    if again is None:
                        raise InputError(
                            f"{method.name} needs further photos of the person; there are none"
                        )
                    other = _seen(again(turn), self.settings)
                    turned[turn] = other, fit_body(other, settings=fitting)
            further = [turned[turn] for turn in method.turns]
            photos = [
                (self.subject, self.fit),
                *(one for one in further if not looks_wrong(one[1].residuals)),
            ]  # as in the pipeline
            clock.lap("fit")
            colored, settled = character_of(
                [one for one, _ in photos],
                [one for _, one in photos],
                settings=fitting,
                weights=method.weights,
            )
            clock.lap("shape")
            placed = self.truth.place(colored, settled.camera, self.subject)
            seconds = {"fit": self.common["fit"] + clock.seconds["fit"], "color": 0.0}
            self.scores[method.name] = self.truth.compare_shape(placed) | self.truth.compare_colors(
                placed
            )
            self.seconds[method.name] = {**self.common, **clock.seconds, **seconds}
            self.surfaces[method.name] = placed.surface

    def measure_backends(self, methods: Sequence[Method]) -> None:
        """Measure backends with their colorings; those that only color share one shape."""
        for backend in dict.fromkeys((method.backend, method.weights) for method in methods):
            clock = _Clock()
            shape = backend_of(*backend)(self.subject, self.fit.body, self.fit.camera)
            clock.lap("shape")
            geometry: dict[str, float] | None = None
            for method in methods:
                if (method.backend, method.weights) != backend:
                    continue
                clock.start()
                colored = COLORINGS[method.coloring](
                    shape, self.subject, self.fit.body, self.fit.camera
                )
                clock.lap("color")
                placed = self.truth.place(colored, self.fit.camera, self.subject)
                geometry = geometry or self.truth.compare_shape(placed)
                self.scores[method.name] = geometry | self.truth.compare_colors(placed)
                self.seconds[method.name] = self.common | clock.seconds
                self.surfaces[method.name] = placed.surface


def _seen(case: Case, settings: BenchmarkSettings) -> Subject:
    """Find the person in a photo by perception."""
    from a2v.perception import PerceptionSettings, find_person

    mask = case.mask if settings.true_mask else None
    subject = find_person(
        case.image, mask=mask, settings=PerceptionSettings(bodymap=settings.bodymap)
    )
    person, true = mask_in_photo(subject) > 0.5, case.mask > 127
    if (person & true).sum() < 0.5 * (person | true).sum():
        raise InputError(
            "perception did not find the person: its mask and the true one overlap by "
            "less than a half"
        )
    return subject


class _Clock:
    """Wall seconds of named stages."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.start()

    def start(self) -> None:
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name], self._last = now - self._last, now


def peak_memory(case: Case, method: Method, settings: BenchmarkSettings) -> float:
    """Peak resident memory, MiB, of a fresh process that makes the colored surface from the photo
    (libraries included)."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    mask = case.mask if settings.true_mask else None
    with (
        safe_children(),
        ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool,
    ):
        return pool.submit(_peak_of_run, case.image, mask, method, settings.bodymap).result()


def _peak_of_run(image: ByteArray, mask: ByteArray | None, method: Method, bodymap: bool) -> float:
    from a2v.body import fit_body
    from a2v.perception import PerceptionSettings, find_person
    from a2v.system import peak_memory

    with peak_memory() as peak:
        subject = find_person(image, mask=mask, settings=PerceptionSettings(bodymap=bodymap))
        fit = fit_body(subject)
        COLORINGS[method.coloring](
            backend_of(method.backend, method.weights)(subject, fit.body, fit.camera),
            subject,
            fit.body,
            fit.camera,
        )
        return peak() / (1 << 20)

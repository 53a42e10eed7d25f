"""Tables of the benchmark."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from a2v.lab.evaluation.metrics import confidence_interval
from a2v.lab.evaluation.moved.cases import T_POSE

Scores = Mapping[str, Mapping[str, float]]
"""By pose and metric (`compare_moved`)."""

COLUMNS: Mapping[str, tuple[str, str, int]] = {
    "chamfer": ("Chamfer cm↓", "chamfer", 2),
    "within": ("99 % within cm↓", "within", 1),
    "torn": ("Torn %↓", "torn", 2),
    "other": ("Other part's color %↓", "other", 2),
    "head": ("Head ΔE↓", "head", 2),
    "sized_chamfer": ("Chamfer, sizes equal, cm↓", "sized_chamfer", 2),
    "sized_within": ("99 % within, sizes equal, cm↓", "sized_within", 1),
    "size": ("Size %", "size", 1),
    "psnr": ("PSNR↑", "psnr", 2),
    "ssim": ("SSIM↑", "ssim", 3),
}
"""Columns by name: label, metric, decimals."""
MOTION_COLUMNS = ("chamfer", "within", "torn", "psnr", "ssim")


@dataclass(frozen=True)
class MovedOutcome:
    """The result of one photo.

    Attributes
    ----------
    name, index, stance
        Of the case.
    method : str
        Name of the method that made the character.
    scores : mapping of pose to metric to value
    triangles : int
    failure : str
        Reason why no character was made; "" otherwise.
    """

    name: str
    index: int
    stance: str
    method: str
    scores: Scores = field(default_factory=dict)
    triangles: int = 0
    failure: str = ""

    def value(self, metric: str, motion: bool) -> float:
        """The value of the T-pose, or the mean of the frames of `motion`; NaN if it was not
        measured."""
        if not motion:
            return self.scores[T_POSE].get(metric, float("nan"))
        return float(
            np.mean([values[metric] for pose, values in self.scores.items() if pose != T_POSE])
        )


def moved_table(outcomes: Sequence[MovedOutcome]) -> str:
    """Means ± half widths of 95 % intervals over the photos, in T-pose and in motion; one row per
    method."""
    labels = [f"T: {label}" for label, _, _ in COLUMNS.values()] + [
        f"motion: {COLUMNS[name][0]}" for name in MOTION_COLUMNS
    ]
    lines = [
        f"| Character | photos | {' | '.join(labels)} | triangles |",
        "|---" * (len(labels) + 3) + "|",
    ]
    for method in dict.fromkeys(outcome.method for outcome in outcomes):
        mine = [outcome for outcome in outcomes if outcome.method == method]
        good = [outcome for outcome in mine if not outcome.failure]
        if good:
            cells = _cells(
                good, lambda values: "{:.{d}f} ± {:.{d}f}" if len(values) > 1 else "{:.{d}f}"
            )
            triangles = np.mean([one.triangles for one in good])
            lines.append(
                f"| {method} | {len(good)} of {len(mine)} | {' | '.join(cells)} "
                f"| {triangles:,.0f} |"
            )
    return "\n".join(lines)


def photo_table(outcomes: Sequence[MovedOutcome]) -> str:
    """One row per photo."""
    labels = [f"T: {label}" for label, _, _ in COLUMNS.values()] + [
        f"motion: {COLUMNS[name][0]}" for name in MOTION_COLUMNS
    ]
    lines = [
        f"| photo | person | pose | character | {' | '.join(labels)} |",
        "|---" * (len(labels) + 4) + "|",
    ]
    for outcome in outcomes:
        cells = [outcome.failure] if outcome.failure else _cells([outcome], lambda _: "{:.{d}f}")
        who = f"{outcome.index} | {outcome.name} | {outcome.stance} | {outcome.method}"
        lines.append(f"| {who} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cells(outcomes: Sequence[MovedOutcome], form: Callable[[Sequence[float]], str]) -> list[str]:
    cells = []
    for motion, names in ((False, tuple(COLUMNS)), (True, MOTION_COLUMNS)):
        for name in names:
            _, metric, decimals = COLUMNS[name]
            values = [outcome.value(metric, motion) for outcome in outcomes]
            mean, half = (
                confidence_interval(np.asarray(values)) if len(values) > 1 else (values[0], 0.0)
            )
            cells.append(form(values).format(mean, half, d=decimals))
    return cells

"""Tables of photos: measures, and grades by eye."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.io import read_bytes
from a2v.lab.evaluation.photos.measures import PhotoOutcome
from a2v.lab.evaluation.photos.recognition import SAME

COLUMNS: Mapping[str, tuple[str, int]] = {
    "iou": ("outline's IoU↑", 3),
    "color": ("color ΔE↓", 1),
    "color, head": ("head ΔE↓", 1),
    "face px": ("face px", 0),
    "face turned": ("turned °", 0),
    "face": ("face's distance↓", 3),
    "face 35": ("turned by 35°↓", 3),
    "rest": ("feature off↓", 2),
    "blink": ("eyes closed↓", 2),
    "open mouth": ("mouth open↓", 2),
}
"""Columns by measure: label, decimals."""
GRADES = (1, 2, 3, 4, 5)
"""1: nobody would use it; 3: a visible fault; 5: worth posting from every side."""
_MAX_BYTES = 1 << 20


@dataclass(frozen=True)
class Grade:
    """A grade by eye, one of `GRADES`, and its reason."""

    grade: int
    reason: str


def read_grades(path: str | os.PathLike[str]) -> dict[str, Grade]:
    """Read grades by photo: a CSV file with the columns photo, grade, reason.

    Raises
    ------
    InputError
        It cannot be read, lacks a column, or holds another grade.
    """
    text = read_bytes(path, limit=_MAX_BYTES).decode("utf-8", errors="replace")
    rows = csv.DictReader(text.splitlines())
    if not {"photo", "grade", "reason"} <= set(rows.fieldnames or ()):
        raise InputError(
            f"{path} has the columns {', '.join(rows.fieldnames or ()) or 'none'}; expected photo, "
            "grade, reason"
        )
    found = {}
    for row in rows:
        if row["grade"] not in map(str, GRADES):
            raise InputError(
                f"{path} gives the photo {row['photo']} the grade '{row['grade']}'; expected 1 to 5"
            )
        found[Path(row["photo"]).stem] = Grade(int(row["grade"]), row["reason"] or "")
    return found


def summary_lines(outcomes: Sequence[PhotoOutcome], grades: Mapping[str, Grade]) -> list[str]:
    """Return lines of Markdown: counts and medians over the photos."""
    made = [one for one in outcomes if not one.failure]
    lines = [f"{len(made)} of {len(outcomes)} photos became a character."]
    faces = np.array([one.values["face"] for one in made])
    faces = faces[np.isfinite(faces)]
    if len(faces):
        turned = np.array([one.values["face 35"] for one in made])
        lines.append(
            f"Faces: median distance {np.median(faces):.3f} from the front and "
            f"{np.nanmedian(turned):.3f} turned by 35°; {(faces < SAME).sum()} of {len(faces)} are "
            f"recognized (below {SAME})."
        )
    for name, label in (("iou", "outline's IoU"), ("color", "CIELAB difference")):
        values = [one.values[name] for one in made]
        if values:
            lines.append(f"Median {label}: {np.nanmedian(values):.3g}.")
    given = [grades[one.name].grade for one in outcomes if one.name in grades]
    if given:
        counts = ", ".join(f"{given.count(grade)} of grade {grade}" for grade in GRADES)
        lines.append(f"By eye, of {len(given)}: {counts}.")
    return lines


def rank_correlation(expected: Sequence[float], grades: Sequence[float]) -> float:
    """Spearman's rank correlation; ties share their mean rank."""
    from scipy.stats import spearmanr

    return float(spearmanr(expected, grades)[0])


def measures_table(outcomes: Sequence[PhotoOutcome]) -> str:
    """One row per photo with its measures."""
    lines = [
        f"| photo | {' | '.join(label for label, _ in COLUMNS.values())} |",
        "|---" * (len(COLUMNS) + 1) + "|",
    ]
    for one in outcomes:
        cells = [
            _cell(one.values.get(name, float("nan")), digits)
            for name, (_, digits) in COLUMNS.items()
        ]
        lines.append(f"| {one.name} | {one.failure or ' | '.join(cells)} |")
    return "\n".join(lines)


def grades_table(outcomes: Sequence[PhotoOutcome], grades: Mapping[str, Grade]) -> str:
    """One row per photo with its grade, the reason, and the notes of the product."""
    lines = ["| photo | grade | reason | notes |", "|---|---|---|---|"]
    for one in outcomes:
        grade = grades.get(one.name)
        own = ("", "") if grade is None else (str(grade.grade), grade.reason)
        lines.append(f"| {one.name} | {own[0]} | {own[1]} | {'; '.join(one.notes) or 'none'} |")
    return "\n".join(lines)


def _cell(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "–"

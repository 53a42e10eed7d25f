"""``a2v evaluate clips``: measure how one person is tracked through a video."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from a2v.errors import InputError
from a2v.footage.follow import Followed
from a2v.footage.reading import open_reel
from a2v.footage.settings import FollowSettings
from a2v.io import atomic_path, sha256
from a2v.lab.evaluation.films import (
    SHOTS,
    FilmScore,
    Shot,
    film_sheet,
    film_tables,
    measure,
    shoot_panel,
)
from pipelines.answer import Answer
from pipelines.bar import bar
from pipelines.inputs import check_writable
from pipelines.lab.tables import table_path, table_result, write_table
from pipelines.options import flag, option, settings

HELP = (
    "Measure how well one person is tracked through a video, on rendered films of people and "
    "motions that were not used in any training."
)
EXAMPLES = """examples:
  a2v evaluate clips --data ../shared/data --out clips.md
  a2v evaluate clips --data ../shared/data --films 6 --out clips.md               the first six films of the panel
  a2v evaluate clips --data ../shared/data --only 00-strike,03-jump --out clips.md

The films have 640 x 480 pixels and 30 frames per second. They are rendered from recorded motions,
with a camera that is still, turns or is hand-held, and are kept in a folder named like OUT. OUT
gets tables by kind of motion and by camera. The .json beside it has the values of every film; the
.jpg has frames of the films with the result below."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    data: str = option("folder with avatars/, cmu_bvh.zip and cmu_mocap.zip")
    films: int = option("number of films: the first ones of the panel", default=len(SHOTS))
    only: str = option("names of single films, separated by commas; instead of --films", default="")
    out: str = option("file to write, .md; the .json and the .jpg are written beside it")
    follow: FollowSettings = settings(FollowSettings)
    quiet: bool = flag("show no progress bar")

    @property
    def shots(self) -> tuple[Shot, ...]:
        """Return the films.

        Raises
        ------
        InputError
            A name is not in the panel.
        """
        if not self.only:
            return SHOTS[: max(1, self.films)]
        known = {shot.name: shot for shot in SHOTS}
        asked = [name.strip() for name in self.only.split(",")]
        if unknown := [name for name in asked if name not in known]:
            raise InputError(
                f"film '{unknown[0]}' is not in the panel; choose from {', '.join(known)}"
            )
        return tuple(known[name] for name in asked)


def run(options: Options) -> Answer:
    """Measure the films and write the tables."""
    out = table_path(options.out)
    shots = options.shots
    folder = check_writable(out.with_suffix(""))
    scores: list[FilmScore] = []
    with bar("films", "film", hidden=options.quiet) as progress:
        for done, shot in enumerate(shots, 1):
            scores.append(_measured(shot, options, folder))
            progress(done, len(shots))
    text = [
        "# People followed through videos",
        f"{len(shots)} films of `a2v evaluate clips` "
        f"({', '.join(shot.name for shot in shots)}); see docs/footage.md. Joints "
        "from the middle of the hips (shoulders, elbows, "
        "wrists, knees, ankles), in the heading of the first frame, beside "
        "mediapipe's own world landmarks with its tracking and smoothing, turned by "
        "the true camera. "
        "Slide: of feet while the truth's stand.",
        *film_tables(scores),
    ]
    content = {
        "follow": dataclasses.asdict(options.follow),
        "films": [
            {**dataclasses.asdict(shot), **dataclasses.asdict(score)}
            for shot, score in zip(shots, scores, strict=True)
        ],
    }
    written = write_table(out, text, content)
    rows = [
        np.asarray(cv2.imread(str(path)))
        for shot in shots
        if (path := folder / f"{shot.name}.png").exists()
    ]
    if rows:
        with atomic_path(out.with_suffix(".jpg")) as temporary:
            cv2.imwrite(str(temporary), np.concatenate(rows), [cv2.IMWRITE_JPEG_QUALITY, 80])
    return table_result(out, written, content)


def _measured(shot: Shot, options: Options, folder: Path) -> FilmScore:
    """Return the score of a film; a stored score of the same film and settings is used again."""
    film, path = shoot_panel(shot, options.data, folder)
    key, kept = (
        sha256(json.dumps([sha256(path), dataclasses.asdict(options.follow)]).encode())[:16],
        folder / f"{shot.name}.json",
    )
    if kept.exists() and (known := json.loads(kept.read_text(encoding="utf-8")))["key"] == key:
        return FilmScore(**known["score"])
    score, followed = measure(shot, film, path, options.follow)
    _draw(path, followed, folder / f"{shot.name}.png")
    with atomic_path(kept) as temporary:
        temporary.write_text(
            json.dumps({"key": key, "score": dataclasses.asdict(score)}), encoding="utf-8"
        )
    return score


def _draw(path: Path, followed: Followed, target: Path) -> None:
    """Draw six frames of a film above the result."""
    with open_reel(path) as reel:
        frames = [shown.image for shown in reel.frames(side=480)]
    picture = film_sheet(
        frames[round(followed.facts["from"] * followed.motion.fps) :], followed.motion
    )
    with atomic_path(target) as temporary:
        cv2.imwrite(str(temporary), picture[..., ::-1])

"""The papers' user studies: preference ranking and real-or-fake (conference paper, Sec. 4.2.5 and
A.5; journal paper, Table 3).

`write_survey` makes one static page with the clips inside, and a key with the source of each clip.
`a2v.lab.evaluation.survey_answers` reads the files that participants save.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.types import Motion, Progress

REAL = "real"
"""Name of the source of recorded motions."""

MAX_CLIPS = 600
MAX_SOURCES = 12

KEY_FORMAT = "a2v-survey-key/1"
"""Format name of a survey's key."""


@dataclass(frozen=True)
class Film:
    """A finished clip: an action's name, the bytes of an MP4, and its provenance (for the key)."""

    action: str
    mp4: bytes
    provenance: Mapping[str, Any] = field(default_factory=dict)


Sources = Mapping[str, Mapping[str, Sequence[Motion | Film]]]
"""Clips by source (`REAL`, or a model's name) and action."""


@dataclass(frozen=True)
class SurveySettings:
    """The questions of a survey.

    Attributes
    ----------
    preference : int
        Number of questions in which one clip of every source is ranked; the actions alternate.
    real_or_fake : int
        Number of questions about a single clip; half of the clips are real (the papers have 72
        questions).
    size : int
        Side of a clip, pixels.
    seed : int
        Seed of the order, the choice and the names of the clips.
    title : str
        Heading of the page.
    """

    preference: int = 12
    real_or_fake: int = 24
    size: int = 256
    seed: int = 0
    title: str = "Which motion looks right?"

    def __post_init__(self) -> None:
        if min(self.preference, self.real_or_fake) < 0 or self.preference + self.real_or_fake < 1:
            raise InputError(
                f"preference={self.preference}, real_or_fake={self.real_or_fake}; "
                "expected at least one question"
            )


@dataclass(frozen=True)
class Survey:
    """The questions, and the clips and sources of their anonymous names.

    Attributes
    ----------
    title : str
    questions : list of dict
        ``id``, ``kind`` ("preference" or "real"), ``action``, ``clips`` (anonymous names).
    clips : dict of name to Motion or Film
    sources : dict of name to str
        Source of each clip.
    """

    title: str
    questions: list[dict[str, Any]]
    clips: dict[str, Motion | Film]
    sources: dict[str, str]

    @property
    def id(self) -> str:
        """Identifier: 16 hexadecimal digits of a hash of the questions and the sources."""
        return hashlib.sha256(
            json.dumps([self.questions, self.sources], sort_keys=True).encode()
        ).hexdigest()[:16]


def plan_survey(sources: Sources, settings: SurveySettings | None = None) -> Survey:
    """Choose the questions, and give the clips names that do not reveal their sources.

    Parameters
    ----------
    sources : Sources
        Questions are about actions that all sources have. Clips are used in turn, starting again
        from the first.
    settings : SurveySettings or None

    Raises
    ------
    InputError
        Fewer than two sources to rank, no real clips to tell from others, no action in common, or
        too many clips.
    """
    settings = settings or SurveySettings()
    actions = _common_actions(sources, settings)
    generator = np.random.default_rng(settings.seed)
    clips: dict[str, Motion | Film] = {}
    owners: dict[str, str] = {}
    used: dict[tuple[str, str], int] = {}

    def take(source: str, action: str) -> str:
        own = sources[source][action]
        index = used.get((source, action), 0)
        used[source, action] = index + 1
        name = generator.bytes(5).hex()
        clips[name], owners[name] = own[index % len(own)], source
        return name

    questions: list[dict[str, Any]] = []
    for number in range(settings.preference):
        action = actions[number % len(actions)]
        shown = [take(source, action) for source in sources]
        questions.append(
            {
                "kind": "preference",
                "action": action,
                "clips": [shown[i] for i in generator.permutation(len(shown))],
            }
        )
    made = [source for source in sources if source != REAL]
    for number in range(settings.real_or_fake):
        action = actions[(number // 2) % len(actions)]
        source = REAL if number % 2 == 0 else made[(number // 2) % len(made)]
        questions.append({"kind": "real", "action": action, "clips": [take(source, action)]})
    asked = [
        {"id": f"q{place + 1}", **questions[i]}
        for place, i in enumerate(generator.permutation(len(questions)))
    ]
    # sorted by their random names, so that the order of the clips does not reveal the sources
    names = sorted(clips)
    return Survey(
        settings.title,
        asked,
        {name: clips[name] for name in names},
        {name: owners[name] for name in names},
    )


def _common_actions(sources: Sources, settings: SurveySettings) -> list[str]:
    """Return the actions that all sources have. Raises InputError as `plan_survey` does."""
    if not sources or len(sources) > MAX_SOURCES:
        raise InputError(f"{len(sources)} sources of motion; expected 1 to {MAX_SOURCES}")
    if settings.preference and len(sources) < 2:
        raise InputError(
            "preferences need at least two sources of motion; give another model or "
            "the real data, or set preference to 0"
        )
    if settings.real_or_fake and (REAL not in sources or len(sources) < 2):
        raise InputError(
            "real-or-fake questions need the real data and a model; give both, or set "
            "real_or_fake to 0"
        )
    actions = [
        action
        for action in next(iter(sources.values()))
        if all(own.get(action) for own in sources.values())
    ]
    if not actions:
        raise InputError(f"the sources {', '.join(sources)} have no action in common")
    if settings.preference * len(sources) + settings.real_or_fake > MAX_CLIPS:
        raise InputError(
            f"{settings.preference} rankings of {len(sources)} and "
            f"{settings.real_or_fake} single clips exceed {MAX_CLIPS} clips"
        )
    return actions


def write_survey(
    path: str | os.PathLike[str],
    sources: Sources,
    settings: SurveySettings | None = None,
    *,
    progress: Progress | None = None,
) -> Path:
    """Write the page, and beside it the key; returns the key's path (``<name>.key.json``).

    The page holds every clip as an H.264 video and loads nothing; answers stay in the participant's
    browser until they are saved as JSON. Keep the key from participants: `analyze` needs it.

    Raises
    ------
    InputError
        As for `plan_survey`; `path` does not end in .html.
    """
    target = Path(path)
    if target.suffix.lower() != ".html":
        raise InputError(f"cannot write {target}; expected a name that ends in .html")
    settings = settings or SurveySettings()
    survey = plan_survey(sources, settings)
    videos = {}
    for done, (name, motion) in enumerate(survey.clips.items()):
        videos[name] = (
            "data:video/mp4;base64," + base64.b64encode(_video(motion, settings.size)).decode()
        )
        if progress is not None:
            progress(done + 1, len(survey.clips))
    data = json.dumps({"id": survey.id, "questions": survey.questions, "videos": videos})
    page = Template(Path(__file__).with_name("survey.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(survey.title), data=data.replace("<", "\\u003c")
    )
    key_path = target.with_suffix(".key.json")
    key = {
        "format": KEY_FORMAT,
        "survey": survey.id,
        "title": survey.title,
        "seed": settings.seed,
        "questions": survey.questions,
        "clips": {
            name: {
                "source": survey.sources[name],
                "action": clip.action,
                "provenance": dict(clip.provenance),
            }
            for name, clip in survey.clips.items()
        },
    }
    with atomic_path(key_path) as temporary:
        temporary.write_text(json.dumps(key, indent=1), encoding="utf-8")
    with atomic_path(target) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return key_path


def _video(motion: Motion | Film, size: int) -> bytes:
    """Return the clip as an MP4, rendered as a stick figure if it is a motion. The file does not
    reveal its source."""
    if isinstance(motion, Film):
        return motion.mp4
    from a2v.rendering.stickfigure import StickSettings, animate
    from a2v.rendering.video import write_video

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        write_video(path, animate(motion, settings=StickSettings(size=size)), motion.fps, crf=26)
        return path.read_bytes()

"""The papers' user studies: preference ranking and real-or-fake (conference paper, Sec. 4.2.5 and A.5; journal paper, Table 3).

`write_survey` makes one static page with the clips inside, and a key that says which clip is whose; `analyse` turns the
files of answers that participants saved into the papers' percentages.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.types import Motion, Progress

REAL = "real"
"""Name of the source of recorded motions."""

MAX_ANSWER_BYTES = 1 << 20
MAX_KEY_BYTES = 16 << 20
MAX_CLIPS = 600
MAX_SOURCES = 12

_ANSWERS, _KEY = "a2v-survey-answers/1", "a2v-survey-key/1"

Sources = Mapping[str, Mapping[str, Sequence[Motion]]]
"""Clips by source (`REAL`, or a model's name) and action."""


@dataclass(frozen=True)
class SurveySettings:
    """What a participant is asked.

    Attributes
    ----------
    preference : int
        Questions that rank one clip of every source, over all actions in turn.
    real_or_fake : int
        Questions about a single clip, half of them real (the papers have 72).
    size : int
        Pixels a side of a clip.
    seed : int
        Of the order, the choice and the names of the clips.
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
            raise InputError(f"preference={self.preference}, real_or_fake={self.real_or_fake}; expected at least one question")


@dataclass(frozen=True)
class Survey:
    """The questions, and what is behind them.

    Attributes
    ----------
    title : str
    questions : list of dict
        ``id``, ``kind`` ("preference" or "real"), ``action``, ``clips`` (anonymous names).
    clips : dict of name to Motion
    sources : dict of name to str
        Who made each clip.
    """

    title: str
    questions: list[dict[str, Any]]
    clips: dict[str, Motion]
    sources: dict[str, str]

    @property
    def id(self) -> str:
        """16 hexadecimal digits over questions and key."""
        return hashlib.sha256(json.dumps([self.questions, self.sources], sort_keys=True).encode()).hexdigest()[:16]


def plan_survey(sources: Sources, settings: SurveySettings | None = None) -> Survey:
    """Choose the questions and name the clips without a hint to their sources.

    Parameters
    ----------
    sources : Sources
        Only actions that all sources have are asked about. Clips are used up in turn, and again from the first.
    settings : SurveySettings or None

    Raises
    ------
    InputError
        Fewer than two sources to rank, no real clips to tell from others, no action in common, or too many clips.
    """
    settings = settings or SurveySettings()
    if not sources or len(sources) > MAX_SOURCES:
        raise InputError(f"{len(sources)} sources of motion; expected 1 to {MAX_SOURCES}")
    if settings.preference and len(sources) < 2:
        raise InputError("preferences need at least two sources of motion; give another model or the real data, or ask for none")
    if settings.real_or_fake and (REAL not in sources or len(sources) < 2):
        raise InputError("real-or-fake questions need the real data and a model; give both, or ask for none")
    actions = [action for action in next(iter(sources.values())) if all(own.get(action) for own in sources.values())]
    if not actions:
        raise InputError(f"the sources {', '.join(sources)} have no action in common")
    if settings.preference * len(sources) + settings.real_or_fake > MAX_CLIPS:
        raise InputError(
            f"{settings.preference} rankings of {len(sources)} and {settings.real_or_fake} single clips exceed {MAX_CLIPS} clips"
        )
    generator = np.random.default_rng(settings.seed)
    clips: dict[str, Motion] = {}
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
        questions.append({"kind": "preference", "action": action, "clips": [shown[i] for i in generator.permutation(len(shown))]})
    made = [source for source in sources if source != REAL]
    for number in range(settings.real_or_fake):
        action = actions[(number // 2) % len(actions)]
        source = REAL if number % 2 == 0 else made[(number // 2) % len(made)]
        questions.append({"kind": "real", "action": action, "clips": [take(source, action)]})
    asked = [{"id": f"q{place + 1}", **questions[i]} for place, i in enumerate(generator.permutation(len(questions)))]
    names = sorted(clips)  # by their random names, so that the order of the clips tells nothing either
    return Survey(settings.title, asked, {name: clips[name] for name in names}, {name: owners[name] for name in names})


def write_survey(
    path: str | os.PathLike[str], sources: Sources, settings: SurveySettings | None = None, *, progress: Progress | None = None
) -> Path:
    """Write the page, and beside it the key; returns the key's path (``<name>.key.json``).

    The page holds every clip as an H.264 video and loads nothing; answers stay in the participant's browser until they
    are saved as JSON. Keep the key from participants: `analyse` needs it.

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
        videos[name] = "data:video/mp4;base64," + base64.b64encode(_video(motion, settings.size)).decode()
        if progress is not None:
            progress(done + 1, len(survey.clips))
    data = json.dumps({"id": survey.id, "questions": survey.questions, "videos": videos})
    page = Template(Path(__file__).with_name("survey.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(survey.title), data=data.replace("<", "\\u003c")
    )
    key_path = target.with_suffix(".key.json")
    key = {
        "format": _KEY, "survey": survey.id, "title": survey.title, "seed": settings.seed, "questions": survey.questions,
        "clips": {name: {"source": survey.sources[name], "action": clip.action, "provenance": dict(clip.provenance)} for name, clip in survey.clips.items()},
    }  # fmt: skip
    with atomic_path(key_path) as temporary:
        temporary.write_text(json.dumps(key, indent=1), encoding="utf-8")
    with atomic_path(target) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return key_path


def _video(motion: Motion, size: int) -> bytes:
    """The clip as an MP4 of a stick figure; nothing in it tells where it comes from."""
    from a2v.rendering.stickfigure import StickSettings, animate
    from a2v.rendering.video import write_video

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        write_video(path, animate(motion, settings=StickSettings(size=size)), motion.fps, crf=26)
        return path.read_bytes()


def wilson_interval(successes: int, total: int, *, z: float = 1.959964) -> tuple[float, float]:
    """95 % interval of a share by Wilson's score (1927), which stays in [0, 1] and works for few answers.

    Raises
    ------
    InputError
        Not 0 <= successes <= total, or nothing was counted.
    """
    if not 0 <= successes <= total or total < 1:
        raise InputError(f"{successes} of {total} is no share; expected 0 <= successes <= total and at least 1")
    share = successes / total
    middle = (share + z * z / (2 * total)) / (1 + z * z / total)
    half = z / (1 + z * z / total) * math.sqrt(share * (1 - share) / total + z * z / (4 * total * total))
    return max(0.0, middle - half), min(1.0, middle + half)


@dataclass(frozen=True)
class Share:
    """`count` of `total` answers."""

    count: int
    total: int

    @property
    def value(self) -> float:
        """The share; NaN of nothing."""
        return self.count / self.total if self.total else math.nan

    def __str__(self) -> str:
        if not self.total:
            return "-"
        low, high = wilson_interval(self.count, self.total)
        return f"{100 * self.value:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


@dataclass(frozen=True)
class SurveyResult:
    """The papers' percentages.

    Attributes
    ----------
    participants : int
    ranks : dict of source to tuple of int
        How often each source was ranked first, second... (conference paper, Fig. 4).
    over : dict of (source, source) to Share
        How often the first was ranked before the second (journal paper, Table 3); both orders are there.
    judged_real : dict of source to Share
        How often clips of the source were taken for real (conference paper, Fig. 5).
    correct : Share
        Right answers to real-or-fake questions; a half is guessing.
    """

    participants: int
    ranks: dict[str, tuple[int, ...]]
    over: dict[tuple[str, str], Share]
    judged_real: dict[str, Share]
    correct: Share

    def as_dict(self) -> dict[str, Any]:
        """Everything as JSON, with the intervals."""

        def share(item: Share) -> dict[str, Any]:
            interval = list(wilson_interval(item.count, item.total)) if item.total else None
            return {"count": item.count, "total": item.total, "share": item.value if item.total else None, "interval": interval}

        return {
            "participants": self.participants,
            "ranks": {source: list(counts) for source, counts in self.ranks.items()},
            "over": {f"{a} over {b}": share(item) for (a, b), item in self.over.items()},
            "judged_real": {source: share(item) for source, item in self.judged_real.items()},
            "correct": share(self.correct),
        }


def read_key(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The key of a survey, checked.

    Raises
    ------
    InputError
        It is no such file.
    """
    key = _read_json(path, MAX_KEY_BYTES, "the key of a survey (NAME.key.json)")
    try:
        names = set(key["clips"])
        good = (
            key["format"] == _KEY
            and isinstance(key["survey"], str)
            and all(isinstance(clip["source"], str) for clip in key["clips"].values())
        )
        for question in key["questions"]:
            good &= question["kind"] in ("preference", "real") and isinstance(question["id"], str) and names >= set(question["clips"])
    except (KeyError, TypeError, AttributeError):
        good = False
    if not good:
        raise InputError(f"{path} is no key of a survey; expected the NAME.key.json that a2v survey wrote beside the page")
    return key


def read_answers(path: str | os.PathLike[str], key: Mapping[str, Any]) -> dict[str, Any]:
    """One participant's answers, checked against the survey's key.

    Raises
    ------
    InputError
        Too large, no such file, of another survey, an unknown question, an answer twice, or a ranking that does not hold every
        clip of its question once; the message names the file and the question.
    """
    content = _read_json(path, MAX_ANSWER_BYTES, "a participant's answers")
    if content.get("format") != _ANSWERS:
        raise InputError(f"{path} holds no answers to a survey of a2v; expected the file that its page saves")
    if content.get("survey") != key["survey"]:
        raise InputError(f"{path} answers the survey {str(content.get('survey'))[:40]}; the key is of {key['survey']}")
    participant, answers = content.get("participant"), content.get("answers")
    if not isinstance(participant, str) or not 1 <= len(participant) <= 64 or not isinstance(answers, list):
        raise InputError(f"{path}: expected a participant and a list of answers")
    questions = {question["id"]: question for question in key["questions"]}
    seen = set()
    for answer in answers:
        name = answer.get("question") if isinstance(answer, dict) else None
        if not isinstance(name, str) or name not in questions:
            raise InputError(f"{path}: unknown question {str(name)[:40]!r}")
        if name in seen:
            raise InputError(f"{path}: question {name} is answered twice")
        seen.add(name)
        if questions[name]["kind"] == "real":
            if not isinstance(answer.get("real"), bool):
                raise InputError(f"{path}: question {name} needs real: true or false")
            continue
        ranking = answer.get("ranking")
        if (
            not isinstance(ranking, list)
            or not all(isinstance(item, str) for item in ranking)
            or sorted(ranking) != sorted(questions[name]["clips"])
        ):
            raise InputError(f"{path}: the ranking of question {name} must hold each of its {len(questions[name]['clips'])} clips once")
    return content


def _read_json(path: str | os.PathLike[str], limit: int, what: str) -> dict[str, Any]:
    source = Path(path)
    try:
        if source.stat().st_size > limit:
            raise InputError(f"{source} is larger than {limit >> 20} MiB; expected {what}")
        content = json.loads(source.read_text(encoding="utf-8"))
    except InputError:  # which is a ValueError
        raise
    except FileNotFoundError:
        raise InputError(f"{source} does not exist; expected {what}") from None
    except OSError as error:
        raise InputError(f"{source} cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError):
        raise InputError(f"{source} is no JSON; expected {what}") from None
    if not isinstance(content, dict):
        raise InputError(f"{source} holds no JSON object; expected {what}")
    return content


def analyse(key: Mapping[str, Any], answers: Sequence[Mapping[str, Any]]) -> SurveyResult:
    """Count checked answers (`read_answers`) by the key (`read_key`).

    Raises
    ------
    InputError
        No answers, or two files of one participant.
    """
    if not answers:
        raise InputError("no answers to analyse")
    people = [item["participant"] for item in answers]
    if doubles := [name for name in people if people.count(name) > 1]:
        raise InputError(f"participant {doubles[0]} is there twice; keep one file of each")
    source = {name: clip["source"] for name, clip in key["clips"].items()}
    kinds = {question["id"]: question for question in key["questions"]}
    ranked = sorted({source[name] for question in key["questions"] if question["kind"] == "preference" for name in question["clips"]})
    single = sorted({source[name] for question in key["questions"] if question["kind"] == "real" for name in question["clips"]})
    ranks = {name: [0] * len(ranked) for name in ranked}
    before = {(a, b): [0, 0] for a in ranked for b in ranked if a != b}
    real = {name: [0, 0] for name in single}
    correct = [0, 0]
    for answer in (item for person in answers for item in person["answers"]):
        question = kinds[answer["question"]]
        if question["kind"] == "preference":
            order = [source[name] for name in answer["ranking"]]
            for place, name in enumerate(order):
                ranks[name][place] += 1
                for later in order[place + 1 :]:
                    before[name, later][0] += 1
                    before[name, later][1] += 1
                    before[later, name][1] += 1
        else:
            owner = source[question["clips"][0]]
            real[owner][0] += answer["real"]
            real[owner][1] += 1
            correct[0] += answer["real"] == (owner == REAL)
            correct[1] += 1
    return SurveyResult(
        participants=len(people),
        ranks={name: tuple(counts) for name, counts in ranks.items()},
        over={pair: Share(*counts) for pair, counts in before.items()},
        judged_real={name: Share(*counts) for name, counts in real.items()},
        correct=Share(*correct),
    )


def survey_table(result: SurveyResult) -> str:
    """The result as Markdown: ranks, preferences and judgements, with 95 % intervals by Wilson's score."""
    lines = [f"{result.participants} participants; shares with 95 % intervals (Wilson)."]
    rankings = sum(next(iter(result.ranks.values()), ())) if result.ranks else 0
    if rankings:
        places = len(next(iter(result.ranks.values())))
        lines += [
            "",
            f"Ranks in {rankings} rankings:",
            "",
            "| source | " + " | ".join(f"{place + 1}." for place in range(places)) + " | mean rank |",
        ]
        lines.append("|---|" + "---|" * (places + 1))
        for name, counts in result.ranks.items():
            mean = sum((place + 1) * count for place, count in enumerate(counts)) / rankings
            lines.append(f"| {name} | " + " | ".join(str(Share(count, rankings)) for count in counts) + f" | {mean:.2f} |")
        lines += ["", "| preference | share |", "|---|---|"]
        lines += [f"| {a} over {b} | {share} |" for (a, b), share in result.over.items() if a < b or b == REAL]
    if result.correct.total:
        lines += ["", "| source | judged real | answers |", "|---|---|---|"]
        lines += [f"| {name} | {share} | {share.total} |" for name, share in result.judged_real.items()]
        lines.append(f"\nRight answers: {result.correct} of {result.correct.total}; a half is guessing.")
    return "\n".join(lines)

"""Answers to a survey (`a2v.lab.evaluation.survey`), and the papers' percentages of them."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from a2v.errors import InputError
from a2v.io import parse_json, read_bytes
from a2v.lab.evaluation.survey import KEY_FORMAT, REAL

MAX_ANSWER_BYTES = 1 << 20
MAX_KEY_BYTES = 16 << 20

ANSWERS_FORMAT = "a2v-survey-answers/1"
"""Format name of the files that the page saves."""


def wilson_interval(successes: int, total: int, *, z: float = 1.959964) -> tuple[float, float]:
    """95 % interval of a share by Wilson's score (1927), which stays in [0, 1] and works for few
    answers.

    Raises
    ------
    InputError
        Not 0 <= successes <= total, or `total` is 0.
    """
    if not 0 <= successes <= total or total < 1:
        raise InputError(
            f"{successes} of {total} is not a share; expected 0 <= successes <= total "
            "and at least 1"
        )
    share = successes / total
    middle = (share + z * z / (2 * total)) / (1 + z * z / total)
    half = (
        z
        / (1 + z * z / total)
        * math.sqrt(share * (1 - share) / total + z * z / (4 * total * total))
    )
    return max(0.0, middle - half), min(1.0, middle + half)


@dataclass(frozen=True)
class Share:
    """`count` of `total` answers."""

    count: int
    total: int

    @property
    def value(self) -> float:
        """The share; NaN if there are no answers."""
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
        How often the first was ranked above the second (journal paper, Table 3); both orders are
        there.
    by_action : dict of str to dict
        `over` of the questions about each action (journal paper, Fig. 11).
    judged_real : dict of source to Share
        How often clips of the source were taken for real (conference paper, Fig. 5).
    correct : Share
        Right answers to real-or-fake questions; a half is guessing.
    """

    participants: int
    ranks: dict[str, tuple[int, ...]]
    over: dict[tuple[str, str], Share]
    by_action: dict[str, dict[tuple[str, str], Share]]
    judged_real: dict[str, Share]
    correct: Share

    def as_dict(self) -> dict[str, Any]:
        """Everything as JSON, with the intervals."""

        def share(item: Share) -> dict[str, Any]:
            interval = list(wilson_interval(item.count, item.total)) if item.total else None
            return {
                "count": item.count,
                "total": item.total,
                "share": item.value if item.total else None,
                "interval": interval,
            }

        def preferences(over: Mapping[tuple[str, str], Share]) -> dict[str, Any]:
            return {f"{a} over {b}": share(item) for (a, b), item in over.items()}

        return {
            "participants": self.participants,
            "ranks": {source: list(counts) for source, counts in self.ranks.items()},
            "over": preferences(self.over),
            "by_action": {name: preferences(item) for name, item in self.by_action.items()},
            "judged_real": {source: share(item) for source, item in self.judged_real.items()},
            "correct": share(self.correct),
        }


def read_key(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The key of a survey, checked.

    Raises
    ------
    InputError
        The file is not such a key.
    """
    key = _read_json(path, MAX_KEY_BYTES, "the key of a survey (NAME.key.json)")
    try:
        names = set(key["clips"])
        good = (
            key["format"] == KEY_FORMAT
            and isinstance(key["survey"], str)
            and isinstance(key["title"], str)
            and all(isinstance(clip["source"], str) for clip in key["clips"].values())
        )
        for question in key["questions"]:
            good &= (
                question["kind"] in ("preference", "real")
                and len(question["clips"]) > 0
                and isinstance(question["id"], str)
                and isinstance(question["action"], str)
                and names >= set(question["clips"])
            )
    except (KeyError, TypeError, AttributeError):
        good = False
    if not good:
        raise InputError(
            f"{path} is not a key of a survey; expected the NAME.key.json that a2v "
            "survey wrote beside the page"
        )
    return key


def read_answers(path: str | os.PathLike[str], key: Mapping[str, Any]) -> dict[str, Any]:
    """One participant's answers, checked against the survey's key.

    Raises
    ------
    InputError
        The file is too large, missing, not of that format or of another survey; a question is
        unknown or answered twice; or a ranking does not contain each clip of its question once. The
        message names the file and the question.
    """
    content = _read_json(path, MAX_ANSWER_BYTES, "a participant's answers")
    if content.get("format") != ANSWERS_FORMAT:
        raise InputError(
            f"{path} holds no answers to a survey of a2v; expected the file that its page saves"
        )
    if content.get("survey") != key["survey"]:
        raise InputError(
            f"{path} answers the survey {str(content.get('survey'))[:40]}; the key belongs to the "
            f"survey {key['survey']}"
        )
    participant, answers = content.get("participant"), content.get("answers")
    if (
        not isinstance(participant, str)
        or not 1 <= len(participant) <= 64
        or not isinstance(answers, list)
    ):
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
            raise InputError(
                f"{path}: the ranking of question {name} must hold each of its "
                f"{len(questions[name]['clips'])} clips once"
            )
    return content


def _read_json(path: str | os.PathLike[str], limit: int, what: str) -> dict[str, Any]:
    content = parse_json(read_bytes(path, limit=limit), path, what)
    if not isinstance(content, dict):
        raise InputError(f"{path} holds no JSON object; expected {what}")
    return content


def analyze(key: Mapping[str, Any], answers: Sequence[Mapping[str, Any]]) -> SurveyResult:
    """Count checked answers (`read_answers`) by the key (`read_key`).

    Raises
    ------
    InputError
        No answers, or two files of one participant.
    """
    if not answers:
        raise InputError("no answers to analyze")
    people = [item["participant"] for item in answers]
    if doubles := [name for name in people if people.count(name) > 1]:
        raise InputError(f"participant {doubles[0]} has two files; keep one of them")
    source = {name: clip["source"] for name, clip in key["clips"].items()}
    kinds = {question["id"]: question for question in key["questions"]}
    sources = {
        kind: sorted({source[n] for q in key["questions"] if q["kind"] == kind for n in q["clips"]})
        for kind in ("preference", "real")
    }
    ranked = sources["preference"]
    pairs = [(a, b) for a in ranked for b in ranked if a != b]
    ranks = {name: [0] * len(ranked) for name in ranked}
    actions = sorted({q["action"] for q in key["questions"] if q["kind"] == "preference"})
    preferred = {action: {pair: [0, 0] for pair in pairs} for action in actions}
    real = {name: [0, 0] for name in sources["real"]}
    correct = [0, 0]
    for answer in (item for person in answers for item in person["answers"]):
        question = kinds[answer["question"]]
        if question["kind"] == "preference":
            order = [source[name] for name in answer["ranking"]]
            counted = preferred[question["action"]]
            for place, name in enumerate(order):
                ranks[name][place] += 1
                for later in order[place + 1 :]:
                    counted[name, later][0] += 1
                    counted[name, later][1] += 1
                    counted[later, name][1] += 1
        else:
            owner = source[question["clips"][0]]
            real[owner][0] += answer["real"]
            real[owner][1] += 1
            correct[0] += answer["real"] == (owner == REAL)
            correct[1] += 1
    by_action = {
        action: {pair: Share(*counts) for pair, counts in counted.items()}
        for action, counted in preferred.items()
    }
    return SurveyResult(
        participants=len(people),
        ranks={name: tuple(counts) for name, counts in ranks.items()},
        over={pair: _sum([shares[pair] for shares in by_action.values()]) for pair in pairs},
        by_action=by_action,
        judged_real={name: Share(*counts) for name, counts in real.items()},
        correct=Share(*correct),
    )


def _sum(shares: Sequence[Share]) -> Share:
    """Return the share of all answers together."""
    return Share(sum(share.count for share in shares), sum(share.total for share in shares))


def survey_table(result: SurveyResult) -> str:
    """The result as Markdown: ranks, preferences and judgments, with 95 % intervals by Wilson's
    score."""
    lines = [f"{result.participants} participants; shares with 95 % intervals (Wilson)."]
    rankings = sum(next(iter(result.ranks.values()), ())) if result.ranks else 0
    if rankings:
        places = len(next(iter(result.ranks.values())))
        lines += [
            "",
            f"Ranks in {rankings} rankings:",
            "",
            "| source | "
            + " | ".join(f"{place + 1}." for place in range(places))
            + " | mean rank |",
        ]
        lines.append("|---|" + "---|" * (places + 1))
        for name, counts in result.ranks.items():
            mean = sum((place + 1) * count for place, count in enumerate(counts)) / rankings
            lines.append(
                f"| {name} | "
                + " | ".join(str(Share(count, rankings)) for count in counts)
                + f" | {mean:.2f} |"
            )
        named = [pair for pair in result.over if pair[0] < pair[1] or pair[1] == REAL]
        lines += ["", "| preference | share |", "|---|---|"]
        lines += [f"| {a} over {b} | {result.over[a, b]} |" for a, b in named]
        lines += ["", "| action | " + " | ".join(f"{a} over {b}" for a, b in named) + " |"]
        lines.append("|---|" + "---|" * len(named))
        lines += [
            f"| {action} | " + " | ".join(str(shares[pair]) for pair in named) + " |"
            for action, shares in result.by_action.items()
        ]
    if result.correct.total:
        lines += ["", "| source | judged real | answers |", "|---|---|---|"]
        lines += [
            f"| {name} | {share} | {share.total} |" for name, share in result.judged_real.items()
        ]
        lines.append(
            f"\nRight answers: {result.correct} of {result.correct.total}; a half is guessing."
        )
    return "\n".join(lines)

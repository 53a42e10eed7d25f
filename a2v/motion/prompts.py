"""Prompts: free text to a timeline of actions, without a network.

A prompt is split at "then", commas, and "and" between two actions. The duration and exclusions
("not", "no", "without") of each part are extracted, and the rest is matched with the actions
(`a2v.motion.vocabulary`).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from a2v.errors import InputError
from a2v.io import shorten
from a2v.motion.lexicon import canonical_words, plain_words
from a2v.motion.vocabulary import Match as Match
from a2v.motion.vocabulary import Vocabulary as Vocabulary

NUMBERS = {
    "half a": 0.5,
    "half": 0.5,
    "a": 1,
    "an": 1,
    "one": 1,
    "two": 2,
    "three": 3,
    "four": 4,
    "five": 5,
    "six": 6,
    "seven": 7,
    "eight": 8,
    "nine": 9,
    "ten": 10,
    "twelve": 12,
    "fifteen": 15,
    "twenty": 20,
    "thirty": 30,
}
# : Longest step in a prompt, seconds.
MAX_SECONDS = 600.0
MAX_PROMPT = 2000
"""Largest number of letters of a prompt; longer prompts are refused before they are read."""
MAX_PARTS = 40
"""Largest number of parts of a prompt."""

NEGATIONS = frozenset(
    [
        "not",
        "no",
        "dont",
        "doesnt",
        "didnt",
        "isnt",
        "never",
        "without",
        "cant",
        "cannot",
        "avoid",
        "nor",
    ]
)
UNKNOWING = frozenset(["know", "idea", "clue"])
"""Words after a negation that mean a shrug: "I don't know"."""
RESUMES = frozenset(["but", "and", "just", "instead", "rather", "only"])
"""Words that end a negation."""
STILL = frozenset(["move", "anyth", "stir", "budg"])
"""A prompt that only excludes these means standing."""
STANDING = "stand still"
MARGIN = 0.15
"""Least lead of the score of two actions joined by "and" over that of one action."""

_THEN = re.compile(
    r"\s*(?:,\s*(?:and\s+)?then\s+|\s+and\s+then\s+|\s+then\s+|\s*,\s*followed\s+by\s+|\s+followed\s+by\s+|\s+after\s+that\s+|\s*,\s*and\s+|[;,>]|->)\s*",
    re.IGNORECASE,
)
_AND = re.compile(r"\s+and\s+", re.IGNORECASE)
_NAMED = "|".join(sorted(NUMBERS, key=len, reverse=True))
_LONG = r"seconds?|secs?|minutes?|mins?|frames?"
_DURATION = re.compile(
    rf"\b(?:for\s+)?(?:about\s+|around\s+)?(?:(?P<digits>\d+(?:\.\d+)?)\s*-?\s*(?P<unit>{_LONG}|s)|(?P<named>{_NAMED})[\s-]+(?P<word>{_LONG}))\b",
    re.IGNORECASE,
)


@dataclass(frozen=True, kw_only=True)
class Step:
    """One part of a timeline.

    Attributes
    ----------
    action : str
        The model's name of the action.
    seconds : float or None
        Length; None for an equal share of the total.
    frames : int or None
        The same in frames of the result; at most one of the two is given.
    seed : int or None
        Seed of this part's noise; None for that of the whole clip.
    speed : float
        1 as recorded, 2 twice as fast.
    source : str
        Source of the action: a name of `a2v.motion.catalog`; "" for the model that is given with
        the steps.
    """

    action: str
    seconds: float | None = None
    frames: int | None = None
    seed: int | None = None
    speed: float = 1.0
    source: str = ""

    def __post_init__(self) -> None:
        if self.seconds is not None and self.frames is not None:
            raise InputError(
                f"'{self.action}' has both seconds ({self.seconds:g}) and frames ({self.frames}); "
                "give one of them"
            )
        if self.seconds is not None and not 0 < self.seconds <= MAX_SECONDS:
            raise InputError(
                f"'{self.action}' lasts {self.seconds:g} seconds; expected more than 0 and at most "
                f"{MAX_SECONDS:g}"
            )
        if self.frames is not None and self.frames < 1:
            raise InputError(f"'{self.action}' lasts {self.frames} frames; expected at least 1")
        if not 0.25 <= self.speed <= 4:
            raise InputError(f"'{self.action}' has speed {self.speed:g}; expected 0.25 to 4")


@dataclass(frozen=True)
class _Part:
    """A part of a prompt: the requested action, the excluded words, and the length."""

    text: str
    without: frozenset[str] = frozenset()
    seconds: float | None = None
    frames: int | None = None


def parse_prompt(text: str, vocabulary: Vocabulary) -> tuple[list[Step], list[Match]]:
    """Parse a prompt such as "walk slowly, then salsa for 2 s, then jump" into steps and the match
    of each part.

    Raises
    ------
    InputError
        The prompt is too long, a part is empty or means no action (the message names it and the
        nearest actions), or it only excludes words.
    """
    if len(text) > MAX_PROMPT:
        raise InputError(f"the prompt has {len(text)} letters; expected at most {MAX_PROMPT}")
    steps: list[Step] = []
    matches: list[Match] = []
    for part in _parts(text):
        for piece, match in _matched(part, vocabulary):
            again = (
                matches
                and (match.action, match.speed) == (matches[-1].action, matches[-1].speed)
                and match.text != matches[-1].text
            )
            if again and piece.seconds is None and piece.frames is None:
                continue  # "so tired, out of breath" is a single description
            steps.append(
                Step(
                    action=match.action,
                    seconds=piece.seconds,
                    frames=piece.frames,
                    speed=match.speed,
                )
            )
            matches.append(match)
    return steps, matches


def _parts(text: str) -> list[_Part]:
    """Split a prompt into parts. A part with only exclusions is joined to the previous part, or to
    the next."""
    pieces = [piece.strip() for piece in _THEN.split(text.strip().rstrip(".!?"))]
    if not text.strip() or not all(pieces):
        raise InputError(
            f"the prompt '{shorten(text, 80)}' has an empty part; write actions with commas or "
            "'then' between them"
        )
    if len(pieces) > MAX_PARTS:
        raise InputError(f"the prompt has {len(pieces)} parts; expected at most {MAX_PARTS}")
    parts: list[_Part] = []
    waiting: frozenset[str] = frozenset()
    for piece in pieces:
        seconds, frames, rest = take_duration(piece)
        wanted, without = take_negations(rest)
        if not wanted and without and without <= STILL:
            wanted, without = STANDING, frozenset()
        if not wanted and not without:
            wanted = rest
        if not wanted and parts:
            last = parts[-1]
            parts[-1] = _Part(last.text, last.without | without, last.seconds, last.frames)
        elif not wanted:
            waiting |= without
        else:
            parts.append(_Part(wanted, without | waiting, seconds, frames))
            waiting = frozenset()
    if not parts:
        raise InputError(
            f"'{shorten(text, 80)}' only excludes actions; name one to do (a2v actions lists them)"
        )
    return parts


def _matched(part: _Part, vocabulary: Vocabulary) -> list[tuple[_Part, Match]]:
    """Match a part to one action, or to two joined by "and" if both match better than one."""
    halves = [half.strip() for half in _AND.split(part.text, maxsplit=1)]
    whole: Match | None = None
    refusal: InputError | None = None
    try:
        whole = vocabulary.match(part.text, part.without)
    except InputError as error:
        refusal = error
    if len(halves) == 2 and all(halves) and (whole is None or whole.score < 0.95):
        both = [_Part(half, part.without, *take_duration(half)[:2]) for half in halves]
        try:
            found = [
                (piece, match) for piece in both for piece, match in _matched(piece, vocabulary)
            ]
        except InputError as error:
            refusal = refusal or error
        else:
            if whole is None or min(match.score for _, match in found) > whole.score + MARGIN:
                first = found[0][0]
                found[0] = (
                    _Part(
                        first.text,
                        first.without,
                        part.seconds or first.seconds,
                        part.frames or first.frames,
                    ),
                    found[0][1],
                )
                return found
    if whole is None:
        assert refusal is not None
        raise refusal
    return [(part, whole)]


def take_duration(text: str) -> tuple[float | None, int | None, str]:
    """Extract a length in seconds or frames, given by a number and a unit; returns it and the rest
    of the text."""
    found = _DURATION.search(text)
    if found is None:
        return None, None, text
    rest = " ".join((text[: found.start()] + " " + text[found.end() :]).split())
    if not rest:
        return None, None, text
    amount = (
        float(found["digits"])
        if found["digits"]
        else float(NUMBERS[" ".join(found["named"].lower().split())])
    )
    unit = (found["unit"] or found["word"]).lower()
    if unit.startswith("frame"):
        return None, max(1, round(amount)), rest
    return amount * (60 if unit.startswith("min") else 1), None, rest


def take_negations(text: str) -> tuple[str, frozenset[str]]:
    """Split a text into the requested words and the stems of the excluded ones: "run without
    stopping" requests "run". A "no" at the end counts as a requested word."""
    wanted: list[str] = []
    unwanted: list[str] = []
    negated = False
    words = text.split()
    plain = ["".join(plain_words(word)) for word in words]
    for at, (word, bare) in enumerate(zip(words, plain, strict=True)):
        if bare in NEGATIONS and any(plain[at + 1 :]) and plain[at + 1] not in UNKNOWING:
            negated = True
            if wanted and plain[at - 1] in ("do", "does", "is", "but"):
                wanted.pop()
        elif negated and bare in RESUMES:
            negated = False
        elif negated:
            unwanted.append(word)
        else:
            wanted.append(word)
    kept = " ".join(wanted)
    if not canonical_words(kept):
        kept = ""
    return kept, frozenset(canonical_words(" ".join(unwanted)))


def explain(matches: Sequence[Match]) -> list[str]:
    """One line per part: its match, and the nearest other actions unless the name matched
    exactly."""
    lines = []
    for match in matches:
        tempo = "" if match.speed == 1 else f", at {match.speed:g} times its speed"
        near = f" (near: {', '.join(match.others[:3])})" if match.score < 1 and match.others else ""
        lines.append(f"'{shorten(match.text, 80)}' is taken for {match.action}{tempo}{near}")
    return lines

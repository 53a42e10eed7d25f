"""Split prompts into parts, with their lengths and exclusions."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from a2v.errors import InputError
from a2v.io import shorten
from a2v.motion.lexicon import canonical_words, plain_words
from a2v.motion.wishes import NUMBERS, OWN, Told

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

_BODIES = re.compile(
    r"upper\s+body:?\s+(?P<over>.+?)\s*,?\s+(?:and\s+)?(?:with\s+)?lower\s+body:?\s+(?P<base>.+)",
    re.IGNORECASE,
)
_MANNER = re.compile(
    r"(?:looking|facing|gazing)\b.*|with\b.*\b(?:fists?|hands|fingers|palms)(?:\s\w+)?|in place|"
    r"on the spot|mirrored|looped|once|twice|\w+ times",
    re.IGNORECASE,
)
"""A part of a prompt that only says how the part before it is done."""
_THEN = re.compile(
    r"\s*(?:,\s*(?:and\s+)?then\s+|\s+and\s+then\s+|\s+then\s+|\s*,\s*followed\s+by\s+|\s+followed\s+by\s+|\s+after\s+that\s+|\s*,\s*and\s+|[;,>]|->)\s*",
    re.IGNORECASE,
)
_BESIDES = re.compile(
    rf"\b((?:walk|run|jog|march|sneak|stand|sit|danc|crouch|sprint)(?:s|e|es|ing)?)\s+"
    rf"(?={OWN}(?:(?:left|right|both|one)\s+)?(?:hand|arm)s?\s+"
    r"(?:on|in|behind|over|up|out|crossed|folded|raised|spread|stretched)\b)",
    re.IGNORECASE,
)
"""A gesture beside an action without "with": "walk left hand on hip"."""
_REASON = re.compile(
    r"\s+(?:because|so\s+that|in\s+order\s+to|since\s+(?:it|he|she|they|you|i|we)\b).*",
    re.IGNORECASE,
)
"""Why something is done, which is no action."""
_NAMED = "|".join(sorted(NUMBERS, key=len, reverse=True))
_LONG = r"seconds?|secs?|minutes?|mins?|frames?"
_DURATION = re.compile(
    rf"\b(?:for\s+)?(?:about\s+|around\s+)?(?:(?P<digits>\d+(?:\.\d+)?)\s*-?\s*(?P<unit>{_LONG}|s)|(?P<named>{_NAMED})[\s-]+(?P<word>{_LONG}))\b",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Part:
    """A part of a prompt: the requested action, the excluded words, and the length."""

    text: str
    without: frozenset[str] = frozenset()
    seconds: float | None = None
    frames: int | None = None

    @property
    def lasts(self) -> list[Told]:
        """The given length."""
        if self.seconds is not None:
            return [Told("seconds", f"{self.seconds:g} s")]
        return [] if self.frames is None else [Told("frames", f"{self.frames} frames")]


def split_prompt(text: str) -> list[Part]:
    """Split a prompt into parts. A part with only exclusions is joined to the previous part, or to
    the next."""
    text = _BESIDES.sub(r"\1 with ", _BODIES.sub(r"\g<base> while \g<over>", text))
    pieces = [piece.strip() for piece in _THEN.split(text.strip().rstrip(".!?"))]
    if not text.strip() or not all(pieces):
        raise InputError(
            f"the prompt '{shorten(text, 80)}' has an empty part; write actions with commas or "
            "'then' between them"
        )
    if len(pieces) > MAX_PARTS:
        raise InputError(f"the prompt has {len(pieces)} parts; expected at most {MAX_PARTS}")
    parts: list[Part] = []
    waiting: frozenset[str] = frozenset()
    for piece in pieces:
        piece = _REASON.sub("", piece)
        seconds, frames, rest = take_duration(piece)
        if parts and _DURATION.fullmatch(piece):  # "run cycle, 24 frames"
            seconds, frames, _ = take_duration(f"{piece} x")
            parts[-1] = replace(parts[-1], seconds=seconds, frames=frames)
            continue
        if parts and _MANNER.fullmatch(piece):  # "walk, looking left"
            parts[-1] = replace(parts[-1], text=f"{parts[-1].text} {piece}")
            continue
        wanted, without = take_negations(rest)
        if not wanted and without and without <= STILL:
            wanted, without = STANDING, frozenset()
        if not wanted and not without:
            wanted = rest
        if not wanted and parts:
            last = parts[-1]
            parts[-1] = Part(last.text, last.without | without, last.seconds, last.frames)
        elif not wanted:
            waiting |= without
        else:
            parts.append(Part(wanted, without | waiting, seconds, frames))
            waiting = frozenset()
    if not parts:
        raise InputError(
            f"'{shorten(text, 80)}' only excludes actions; name one to do (a2v actions lists them)"
        )
    return parts


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

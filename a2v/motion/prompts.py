"""Prompts: free text to a timeline of actions, without a network.

A prompt is split at "then", commas, and "and" between two actions. The duration and exclusions
("not", "no", "without") of each part are extracted, and the rest is matched with the actions
(`a2v.motion.vocabulary`).
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from a2v.errors import InputError
from a2v.io import shorten
from a2v.motion.layers import is_upper, sits
from a2v.motion.lexicon import plain_words
from a2v.motion.splitting import Part, split_prompt, take_duration
from a2v.motion.vocabulary import Match as Match
from a2v.motion.vocabulary import UnknownActionError
from a2v.motion.vocabulary import Vocabulary as Vocabulary
from a2v.motion.wishes import NONE, Taken, Told, Wishes, take_wishes

# : Longest step in a prompt, seconds.
MAX_SECONDS = 600.0
MAX_PROMPT = 2000
"""Largest number of letters of a prompt; longer prompts are refused before they are read."""
MARGIN = 0.15
"""Least lead of the score of two actions joined by "and" over that of one action."""
UNKEPT = 0.8
"""Factor on the confidence for each wish that is not kept."""
LAYERED_BELOW = 0.75
"""Score of one action below which two in layers are tried."""
LIMB_WORDS = {"arm": "arms", "hand": "arms", "head": "head"}
"""Stems of excluded words that name a limb: it is held still."""

_WHILE = re.compile(r"\s*\b(?:while|whilst|at\s+the\s+same\s+time\s+as)\b\s*", re.IGNORECASE)
_AND = re.compile(r"\s+and\s+", re.IGNORECASE)
_TO = re.compile(r"\s+(?:in)?to\s+(?:a\s+|an\s+)?", re.IGNORECASE)
"""Between two actions of a transition: "stand to crouch"."""
_LOOKS = re.compile(
    r"(?:look|gaz|fac)ing\s+(?:(?:at|to|towards?|into|over)\s+)?(?:the\s+)?"
    r"(?:camera|left|right|up|down|ahead|back)",
    re.IGNORECASE,
)
"""A gaze, which is a wish and no second action."""
LONGEST_SERIES = 4
"""Largest number of names of actions in turn without commas."""
EXACT = 0.95
"""Score from which a text is taken for the name of an action."""


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
    wishes : Wishes
        Count, distance, side and the like.
    """

    action: str
    seconds: float | None = None
    frames: int | None = None
    seed: int | None = None
    speed: float = 1.0
    source: str = ""
    wishes: Wishes = NONE

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
class _Found:
    """What a part is taken for."""

    part: Part
    match: Match
    wishes: Wishes


def parse_prompt(
    text: str, vocabulary: Vocabulary, *, strict: bool = False
) -> tuple[list[Step], list[Match]]:
    """Parse a prompt such as "walk slowly, then salsa for 2 s, then jump" into steps and the match
    of each part.

    A part that is no action is left out and told with the match before or after it, unless
    `strict`.

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
    refused: list[UnknownActionError] = []
    for part in split_prompt(text):
        try:
            pieces = _matched(part, vocabulary)
        except UnknownActionError as error:
            if strict:
                raise
            pieces = _known_half(part, vocabulary)
            if not pieces:
                refused.append(error)
                if matches:
                    matches[-1] = _lacking(matches[-1], error)
                continue
        for number, found in enumerate(pieces):
            match, piece = found.match, found.part
            if not matches and refused and number == 0:
                for unknown in refused:
                    match = _lacking(match, unknown)
            again = (
                matches
                and (match.action, match.speed) == (matches[-1].action, matches[-1].speed)
                and match.text != matches[-1].text
                and found.wishes == steps[-1].wishes
            )
            if again and piece.seconds is None and piece.frames is None:
                continue  # "so tired, out of breath" is a single description
            steps.append(
                Step(
                    action=match.action,
                    seconds=piece.seconds,
                    frames=piece.frames,
                    speed=match.speed,
                    seed=match.seed,
                    wishes=found.wishes,
                )
            )
            matches.append(match)
    if not steps:
        raise refused[0]
    return steps, matches


def _lacking(match: Match, error: UnknownActionError) -> Match:
    """Tell that a part of the prompt is left out."""
    near = f"; the nearest: {', '.join(error.nearest[:3])}" if error.nearest else ""
    told = Told("part", f"'{shorten(error.text, 80)}'", False, f"no action is known{near}")
    return replace(match, told=(*match.told, told), score=match.score * UNKEPT)


def _known_half(part: Part, vocabulary: Vocabulary) -> list[_Found]:
    """Match the side of an "and" that is an action, and tell that the other one is left out; empty
    if neither is."""
    halves = [half.strip() for half in _AND.split(part.text, maxsplit=1)]
    found: list[_Found] = []
    unknown: list[UnknownActionError] = []
    for half in halves if len(halves) == 2 else []:
        try:
            found += _matched(replace(part, text=half), vocabulary)
        except UnknownActionError as error:
            unknown.append(error)
    return [
        *(replace(one, match=_lacking(one.match, error)) for one in found[:1] for error in unknown),
        *found[1:],
    ]


def _matched(part: Part, vocabulary: Vocabulary) -> list[_Found]:
    """Match a part to one action, to two in layers, or to two joined by "and" if both match better
    than one."""
    layers = _WHILE.split(part.text, maxsplit=1)
    if len(layers) == 2 and not _LOOKS.fullmatch(layers[1]):
        with contextlib.suppress(UnknownActionError):  # "duck while running" is one action
            return [_layered(part, layers[0], layers[1], vocabulary)]
    halves = [half for half in map(str.strip, _AND.split(part.text, maxsplit=1)) if half]
    whole: _Found | None = None
    refusal: UnknownActionError | None = None
    try:
        whole = _single(part, vocabulary)
    except UnknownActionError as error:
        refusal = error
    if whole is None or whole.match.score < LAYERED_BELOW:
        over = _with_something(part, vocabulary)
        if over is not None and (whole is None or over.match.score > whole.match.score + MARGIN):
            return [over]
    if turned := _transition(part, vocabulary):
        return turned
    numbers = all(any(letter.isdigit() for letter in half) for half in halves)
    if len(halves) == 2 and (whole is None or numbers or whole.match.score < EXACT):
        both = [Part(half, part.without, *take_duration(half)[:2]) for half in halves]
        try:
            found = [one for piece in both for one in _matched(piece, vocabulary)]
        except UnknownActionError as error:
            refusal = refusal or error
        else:
            seated = len(found) == 2 and sits(found[0].match.action)
            if seated and is_upper(found[1].match.action):  # "sit and eat"
                joint = f"{found[0].match.action} and {found[1].match.action}"
                if vocabulary.has(joint):  # "sit and talk"
                    return [_single(replace(part, text=joint), vocabulary)]
                return [_layered(part, halves[0], halves[1], vocabulary)]
            least = min(one.match.score for one in found)
            named = least >= EXACT and len({one.match.action for one in found}) == len(found)
            named = named and whole is not None and "and" not in plain_words(whole.match.action)
            named = named or all(one.wishes.ends for one in found)  # "turn 90 and walk 3 m"
            if whole is None or named or least > whole.match.score + MARGIN:
                first = found[0].part
                kept = Part(
                    first.text,
                    first.without,
                    part.seconds or first.seconds,
                    part.frames or first.frames,
                )
                return [replace(found[0], part=kept), *found[1:]]
    if whole is None:
        assert refusal is not None
        raise refusal
    return [whole]


def _transition(part: Part, vocabulary: Vocabulary) -> list[_Found]:
    """Match "stand to crouch" and "run jump land", whose pieces are names of actions; empty for all
    else."""
    sides = [side for side in map(str.strip, _TO.split(part.text, maxsplit=1)) if side]
    if len(sides) != 2:
        sides = part.text.split()
        if not 3 <= len(sides) <= LONGEST_SERIES:
            return []
    if vocabulary.rank(part.text)[0][1] >= EXACT:
        return []
    try:
        found = [_single(Part(side, part.without), vocabulary) for side in sides]
    except UnknownActionError:
        return []
    if min(one.match.score for one in found) < EXACT:
        return []
    share = None if part.seconds is None else part.seconds / len(found)
    return [replace(one, part=replace(one.part, seconds=share)) for one in found]


def _single(part: Part, vocabulary: Vocabulary) -> _Found:
    """Match a part to one action, with its wishes. Words of a wish may be a part of the action's
    name, so the action is the best match of the text with and without them."""
    limbs = {LIMB_WORDS[stem]: None for stem in sorted(part.without) if stem in LIMB_WORDS}
    without = frozenset() if limbs else part.without
    exact = vocabulary.has(part.text)
    taken = Taken(Wishes(), 1.0, part.text, part.text) if exact else take_wishes(part.text)
    matches: list[Match] = []
    refusal: UnknownActionError | None = None
    for text in dict.fromkeys((part.text, taken.text, taken.sideless)):
        try:
            matches.append(vocabulary.match(text, without))
        except UnknownActionError as error:
            refusal = refusal or error
    if not matches:
        assert refusal is not None
        raise refusal
    match = max(
        matches,
        key=lambda one: (
            one.score + MARGIN * (taken.wishes.side in plain_words(one.action)),
            -len(one.text),
        ),
    )
    if matches[0].text == part.text and matches[0].score >= EXACT:
        match = matches[0]  # "zombie idle" is one action, not a zombie that is idle
    wishes = replace(taken.wishes, still=tuple(limbs))
    named = set(plain_words(match.action))
    if wishes.side in named or (wishes.side == "both" and "hands" in named):
        wishes = replace(wishes, side="")
    if {"in", "place"} <= named or {"on", "spot"} <= set(plain_words(match.action)):
        wishes = replace(wishes, in_place=False)
    told = [
        *match.told,
        *part.lasts,
        *(Told("without", f"without {word}") for word in sorted(without)),
        *([] if taken.tempo == 1 else [Told("tempo", f"{taken.tempo:g} times its speed")]),
        *([] if taken.seed is None else [Told("take", f"take {taken.seed + 1}")]),
    ]
    match = replace(
        match,
        text=part.text,
        told=tuple(told),
        speed=match.speed * taken.tempo,
        seed=taken.seed,
    )
    return _Found(part, match, wishes)


def _layered(part: Part, one: str, other: str, vocabulary: Vocabulary) -> _Found:
    """Match two actions at once: that of the upper body over the other one."""
    first, second = (
        _single(replace(part, text=text.strip(" ,")), vocabulary) for text in (one, other)
    )
    base, over = first, second
    if not is_upper(over.match.action) and is_upper(base.match.action):
        base, over = over, base
    if not is_upper(over.match.action):
        raise UnknownActionError(part.text, (first.match.action, second.match.action))
    if is_upper(base.match.action) and sits(over.match.action):
        base, over = over, base
    wishes = replace(
        base.wishes,
        over=over.match.action,
        side=over.wishes.side or base.wishes.side,
        look=over.wishes.look or base.wishes.look,
        hands=over.wishes.hands or base.wishes.hands,
    )
    match = replace(base.match, text=part.text, score=min(base.match.score, over.match.score))
    return _Found(part, match, wishes)


def _with_something(part: Part, vocabulary: Vocabulary) -> _Found | None:
    """Match "run with hands up" or "walk holding a torch": an action and one of the upper body."""
    words = part.text.split()
    best: _Found | None = None
    for at in range(1, len(words)):
        if words[at].lower() != "with" and not words[at].lower().endswith("ing"):
            continue
        start = at + (words[at].lower() == "with")
        try:
            found = _layered(part, " ".join(words[:at]), " ".join(words[start:]), vocabulary)
        except UnknownActionError:
            continue
        if best is None or found.match.score > best.match.score:
            best = found
    return best


def explain(matches: Sequence[Match]) -> list[str]:
    """One line per part: its match, its wishes, and the nearest other actions unless the name
    matched exactly."""
    lines = []
    for match in matches:
        tempo = "" if match.speed == 1 else f", at {match.speed:g} times its speed"
        near = f" (near: {', '.join(match.others[:3])})" if match.score < 1 and match.others else ""
        told = "".join(f"; {told.line()}" for told in match.told)
        lines.append(f"'{shorten(match.text, 80)}' is taken for {match.action}{tempo}{near}{told}")
    return lines

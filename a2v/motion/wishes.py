"""Wishes in words: counts, distances, angles, speeds, sides, in place, loop, held limbs, gaze.

`take_wishes` extracts them from a part of a prompt; the rest of the part names the action.
`told_wishes` says which of them are kept (`a2v.motion.keeping` decides that).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from typing import Any

from a2v.errors import InputError

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
MAX_COUNT = 50
MAX_METERS = 200.0
MAX_DEGREES = 1080.0
PACE = (0.1, 10.0)
"""Range of a speed in words, meters per second."""
STEP_METERS = 0.7
"""Length of a step of "walk two steps", meters."""
SIDES = ("left", "right", "both")
LOOKS = ("camera", "ahead", "left", "right", "up", "down", "back")
"""Where a person can look."""
LIMBS = ("arms", "head")
"""Parts of the body that can be held still."""
HANDS = ("relaxed", "fist", "point", "spread")
"""Poses of fingers in words."""

_Reader = Callable[[re.Match[str]], dict[str, Any]]
_Rule = tuple[re.Pattern[str], _Reader]
_TURN = re.compile(r"\b(turn|rotate|spin|pivot|face)(s|ing)?\b", re.IGNORECASE)
_TRAVELS = re.compile(r"\b(walk|run|jog|jump|hop)", re.IGNORECASE)
_N = r"\d+(?:\.\d+)?|" + "|".join(
    sorted(set(NUMBERS) - {"a", "an", "half", "half a"}, key=len, reverse=True)
)
OWN = r"(?:(?:the|your|my|his|her|their|its|one's|a)\s+)?"
"""An article or possessive before a part of the body."""
_ON_ONE = re.compile(rf"\bon\s+{OWN}(?P<n>left|right)\s+(?:leg|foot)\b", re.IGNORECASE)
"""What stands or hops on one side."""
_NO_COUNT = "hands|arms|legs|feet|fists|knees|fingers|swords|sides|people|friends"
"""Words after a number that do not count an action."""
_METERS = {
    "m": 1.0, "ft": 0.3048, "feet": 0.3048, "foot": 0.3048,
    "yard": 0.9144, "km": 1000.0, "mile": 1609.3,
    "cm": 0.01, "step": STEP_METERS, "pace": STEP_METERS,
}  # fmt: skip
_SPEEDS = {
    "m/s": 1.0, "mps": 1.0, "meters per second": 1.0, "km/h": 1 / 3.6, "kmh": 1 / 3.6,
    "kph": 1 / 3.6, "mph": 0.447,
}  # fmt: skip
_TURNS = {"quarter": 90.0, "half": 180.0, "full": 360.0}
_RATES = {"double": 2.0, "twice": 2.0, "half": 0.5, "triple": 3.0}


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """What a step shall be like besides its action; nothing by default.

    Attributes
    ----------
    count : int or None
        How often the action is done.
    distance : float or None
        Way over the ground, meters.
    pace : float or None
        Speed over the ground, meters per second.
    angle : float or None
        Degrees to turn by, to the side of `side`, by default to the left.
    side : str
        "left", "right" or "both": the hand, foot or direction; "" for any.
    in_place, loop, mirror : bool
    still : tuple of str
        Limbs that keep their pose, of `LIMBS`.
    over : str
        Action of the upper body over that of the step.
    over_source : str
        Its source.
    look : str
        Where the person looks, of `LOOKS`; "" for where the action looks.
    hands : str
        Pose of the fingers, of `HANDS`; "" for that of the action.

    Raises
    ------
    InputError
        A value is out of range.
    """

    count: int | None = None
    distance: float | None = None
    pace: float | None = None
    angle: float | None = None
    side: str = ""
    in_place: bool = False
    loop: bool = False
    mirror: bool = False
    still: tuple[str, ...] = ()
    over: str = ""
    over_source: str = ""
    look: str = ""
    hands: str = ""

    def __post_init__(self) -> None:
        for name, low, high in (
            ("count", 1, MAX_COUNT),
            ("distance", 0.1, MAX_METERS),
            ("pace", *PACE),
            ("angle", 1.0, MAX_DEGREES),
        ):
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise InputError(f"{name} is {value:g}; expected {low:g} to {high:g}")
        for name, known in (("side", SIDES), ("look", LOOKS), ("hands", HANDS)):
            if getattr(self, name) not in ("", *known):
                raise InputError(
                    f"{name} is '{getattr(self, name)}'; choose from {', '.join(known)}"
                )
        if odd := set(self.still) - set(LIMBS):
            raise InputError(f"'{min(odd)}' cannot be held still; choose from {', '.join(LIMBS)}")

    @property
    def any(self) -> bool:
        """Whether something is wished."""
        return self != NONE

    @property
    def layered(self) -> bool:
        """Whether the upper body does something else."""
        return bool(self.over or self.still)

    @property
    def ends(self) -> bool:
        """Whether it is done at a certain moment: after a distance, an angle or a count."""
        return (self.distance, self.angle, self.count) != (None, None, None)

    def names(self) -> list[str]:
        """Names of the wishes that are made."""
        return [
            item.name
            for item in fields(self)
            if item.name != "over_source" and getattr(self, item.name) != item.default
        ]


NONE = Wishes()
"""No wish."""


@dataclass(frozen=True)
class Told:
    """A wish, and whether it is kept.

    Attributes
    ----------
    name : str
        A field of `Wishes`, "seconds", "frames", "without", "language" or "part".
    text : str
        The wish in words: "3 times".
    kept : bool
    why : str
        Why it is not kept.
    """

    name: str
    text: str
    kept: bool = True
    why: str = ""

    def line(self) -> str:
        """The wish and its state, as text."""
        return f"{self.text}: kept" if self.kept else f"{self.text}: NOT kept, {self.why}"


def number(text: str) -> float:
    """The value of a number in digits or letters."""
    plain = " ".join(text.lower().split())
    return float(NUMBERS[plain]) if plain in NUMBERS else float(plain)


@dataclass(frozen=True)
class Taken:
    """The wishes of a part of a prompt.

    Attributes
    ----------
    wishes : Wishes
    tempo : float
        1 for the recorded tempo.
    text : str
        The part without its wishes; the side is still in it.
    sideless : str
        The same without the side.
    seed : int or None
        0 for "take 1", 1 for "take 2" and so on.
    """

    wishes: Wishes
    tempo: float
    text: str
    sideless: str
    seed: int | None = None


def take_wishes(text: str) -> Taken:
    """Extract the wishes of a part of a prompt.

    Raises
    ------
    InputError
        A number is out of range.
    """
    found: dict[str, Any] = {}
    text = _ON_ONE.sub(r"on one leg with the \g<n> leg", text)
    text = _stripped(text, _RULES, found)
    angle, turns = "angle" in found, _TURN.search(text)
    sideless = _stripped(text, _SIDE_RULES, found)
    if angle and turns and not _TRAVELS.search(text):
        text = sideless = "turn in place"
    tempo, seed = found.pop("tempo", 1.0), found.pop("seed", None)
    return Taken(Wishes(**found), tempo, text, sideless, seed)


def _stripped(text: str, rules: Iterable[_Rule], found: dict[str, Any]) -> str:
    """Remove what `rules` match from a text, and add what it says to `found`. A text that would
    have no word left stays."""
    for pattern, read in rules:
        match = pattern.search(text)
        if match is None:
            continue
        kept = match.groupdict().get("kept") or ""
        rest = " ".join(f"{text[: match.start()]} {kept} {text[match.end() :]}".split()).strip(" ,")
        if re.search(r"[a-z]{2}", rest, re.IGNORECASE):
            found |= {name: value for name, value in read(match).items() if name not in found}
            text = rest
    return text


def _rule(pattern: str, read: _Reader) -> _Rule:
    return re.compile(pattern, re.IGNORECASE), read


def _distance(match: re.Match[str]) -> dict[str, Any]:
    unit = "km" if match["unit"].lower().startswith("kilo") else match["unit"].lower()
    unit = unit if unit in _METERS else unit.rstrip("s")
    return {"distance": round(number(match["n"]) * _METERS.get(unit, 1.0), 3)}


_RULES: tuple[_Rule, ...] = (
    _rule(
        rf"\b(?:at\s+)?(?P<n>{_N})\s*(?P<unit>{'|'.join(_SPEEDS)})(?!\w)",
        lambda m: {"pace": number(m["n"]) * _SPEEDS[m["unit"].lower()]},
    ),
    _rule(
        rf"\b(?:at\s+)?(?P<n>{_N}|double|twice(?:\s+the)?|triple)\s*(?:x\s+)?(?:the\s+)?(?:normal\s+)?speed\b",
        lambda m: {"tempo": _rate(m["n"])},
    ),
    _rule(r"\btwice\s+as\s+fast\b", lambda m: {"tempo": 2.0}),
    _rule(
        r"(?<=\w) *,?\s+take\s+(?P<n>[1-9]\d{0,8})(?=\s*(?:$|,|\b(?:mirrored|at|for)\b))",
        lambda m: {"seed": int(m["n"]) - 1},
    ),
    _rule(
        rf"\b(?:for\s+|about\s+)?(?P<n>{_N}|a(?=\s+(?:kilo|mile|met)))\s*-?\s*(?P<unit>(?:kilo)?met(?:er|re)s?|miles?|m|ft|feet|foot|yards?|km|cm|steps?|paces?)\b",
        _distance,
    ),
    _rule(
        r"\b(?:by\s+)?(?P<n>\d+)\s*(?:degrees?\b|deg\b|°)",
        lambda m: {"angle": number(m["n"])},
    ),
    _rule(
        r"\b(?P<kept>(?:turn|rotate|spin)(?:\s+(?:to\s+the\s+)?(?:left|right))?)\s+(?P<n>45|90|135|180|270|360)\b",
        lambda m: {"angle": number(m["n"])},
    ),
    _rule(
        r"\b(?:a\s+)?(?P<n>quarter|half|full)[\s-](?P<kept>turn|rotation|spin)\b",
        lambda m: {"angle": _TURNS[m["n"].lower()]},
    ),
    _rule(
        r"\b(?P<n>once|twice|thrice)\b",
        lambda m: {"count": {"once": 1, "twice": 2, "thrice": 3}[m["n"].lower()]},
    ),
    _rule(
        rf"\b(?P<n>{_N})\s*(?:more\s+)?(?:times|x)(?!\w)",
        lambda m: {"count": round(number(m["n"]))},
    ),
    _rule(r"(?<!\w)x\s*(?P<n>\d+)\b", lambda m: {"count": round(number(m["n"]))}),
    _rule(
        r"^(?:(?:do|does|doing|make|perform)s?\s+)?(?P<n>\d+|two|three|four|five|six|seven|eight|nine|ten|twelve|fifteen|twenty|thirty)\s+(?=(?:[a-z-]+\s+)?[a-z-]+s\b)",
        lambda m: {"count": round(number(m["n"]))},
    ),
    _rule(
        rf"(?<!with )\b(?P<n>two|three|four|five|six|seven|eight|nine|ten|\d+)\s+"
        rf"(?P<kept>(?!(?:{_NO_COUNT})\b)[a-z-]{{3,}}s)$",
        lambda m: {"count": round(number(m["n"]))},
    ),
    _rule(
        r"\b(?:in\s+place|on\s+the\s+spot|on\s+spot)\b",
        lambda m: {"in_place": True},
    ),
    _rule(
        r"\b(?:(?:in\s+a\s+)?(?:seamless(?:ly)?|endless(?:ly)?)\s+)?"
        r"(?:loop(?:ed|ing|s|able)?|(?<=\w )cycle(?:\s+loop)?)\b",
        lambda m: {"loop": True},
    ),
    _rule(r"\bseamless(?:ly)?\b", lambda m: {}),
    _rule(r"^mirror\s+(?=\w)|\b(?:mirrored|flipped)\b", lambda m: {"mirror": True}),
    _rule(
        r"(?:\bwhile\s+|,\s*)?\b(?:look(?:ing|s)?|fac(?:ing|es)|gaz(?:ing|es))\s+(?:straight\s+)?(?:(?:at|to|towards?|into|over)\s+)?(?:the\s+)?(?P<n>camera|left|right|up|down|ahead|back)\b",
        lambda m: {"look": m["n"].lower()},
    ),
    _rule(
        r"\b(?:to|at|towards?|into|for)\s+(?:the\s+)?(?:camera|lens|viewer|audience's\s+camera)\b",
        lambda m: {"look": "camera"},
    ),
    _rule(
        rf"\bwith\s+{OWN}(?:clenched\s+fists?|fists?(?:\s+clenched)?)\b|\bclenching\s+{OWN}fists?\b",
        lambda m: {"hands": "fist"},
    ),
    _rule(
        rf"\bwith\s+{OWN}(?:fingers\s+spread|spread\s+fingers|open\s+hands?|open\s+palms?)\b",
        lambda m: {"hands": "spread"},
    ),
    _rule(r"\bwith\s+relaxed\s+(?:hands|fingers)\b", lambda m: {"hands": "relaxed"}),
    _rule(r"(?:(?<=\w) +(?:idle|pose|hold))+$", lambda m: {}),
)
_SIDE_RULES: tuple[_Rule, ...] = (
    _rule(
        rf"\b(?:(?:with|using|on|by)\s+)?{OWN}(?P<n>left|right|both)\s+(?:hand|arm|leg|foot|feet|fist|knee|elbow|side)s?\b",
        lambda m: {"side": m["n"].lower()},
    ),
    _rule(
        rf"\b(?:(?:to|towards?|on)\s+)?{OWN}(?P<n>left|right)\b",
        lambda m: {"side": m["n"].lower()},
    ),
)


def _rate(text: str) -> float:
    plain = text.lower().split()[0]
    return _RATES.get(plain) or number(text)


_WORDED: dict[str, Callable[[Wishes], str]] = {
    "count": lambda own: "once" if own.count == 1 else f"{own.count} times",
    "distance": lambda own: f"{own.distance:g} m",
    "pace": lambda own: f"{own.pace:.3g} m/s",
    "angle": lambda own: f"{own.angle:g} degrees",
    "side": lambda own: "both sides" if own.side == "both" else f"{own.side} side",
    "in_place": lambda own: "in place",
    "loop": lambda own: "as a loop",
    "mirror": lambda own: "mirrored",
    "still": lambda own: f"{' and '.join(own.still)} held still",
    "over": lambda own: f"{own.over} with the upper body",
    "look": lambda own: f"looking {'at the camera' if own.look == 'camera' else own.look}",
    "hands": lambda own: f"hands: {own.hands}",
}


def told_wishes(own: Wishes, refused: dict[str, str]) -> list[Told]:
    """Every wish with whether it is kept; `refused` maps names of wishes to reasons."""
    return [
        Told(name, _WORDED[name](own), name not in refused, refused.get(name, ""))
        for name in own.names()
    ]


def without_wishes(own: Wishes, names: Iterable[str]) -> Wishes:
    """Drop the wishes `names`."""
    defaults = {item.name: item.default for item in fields(Wishes)}
    return replace(own, **{name: defaults[name] for name in names if name in defaults})  # type: ignore[arg-type]

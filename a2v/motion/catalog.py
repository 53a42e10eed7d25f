"""All available actions and their sources: the shipped models and the library of clips.

`understand` converts words to typed steps, each with its source.
"""

from __future__ import annotations

import csv
import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from a2v.errors import InputError
from a2v.motion.card import ModelCard
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.clips import clip_library
from a2v.motion.keeping import kept_and_told
from a2v.motion.languages import LANGUAGES, translated
from a2v.motion.model import MotionModel
from a2v.motion.names import plain_name
from a2v.motion.prompts import UNKEPT, Match, Step, Vocabulary, parse_prompt
from a2v.motion.vocabulary import UnknownActionError, other_names
from a2v.motion.wishes import Told

SOURCES: tuple[str, ...] = (CLIPS, "cmu-fine", "cmu", "humanact12", "humanact12-fine")
"""Sources of actions; if several have an action of the same name, the first one is used. `cmu` has
56 clips at double
speed and walks backwards, as the papers' data do, so it comes after `cmu-fine`."""

WEAK = Path(__file__).with_name("weak.csv")

LICENSES = ("any", "free")
"""Filters of actions by license: all that ship, or only those that are free for every use."""

RESEARCH: tuple[str, ...] = ("humanact12", "humanact12-fine")
"""Sources for research only."""

THEMES = {
    "Walk": "walking",
    "Run": "running",
    "Jump": "jumping",
    "Dance": "dancing",
    "Animal Behavior": "animals",
    "Wash": "housework",
    "Step": "steps and climbing",
    "Climb": "steps and climbing",
}
"""Themes of the papers' actions."""
HUMANACT12_THEMES = {
    "walk": "walking",
    "run": "running",
    "jump": "jumping",
    "boxing": "fighting",
    "throw": "sports",
    "warm": "sports",
    "lift": "sports",
}
"""Themes of HumanAct12's actions by the first word; all others are everyday."""

CONTEXTS: tuple[tuple[tuple[str, ...], dict[str, str]], ...] = (
    (("Sit down", "Sit", "Sit and talk"), {"Talk": "Sit and talk", "Idle": "Sit", "Listen": "Sit"}),
    (
        ("Dribble a basketball", "Shoot a basketball"),
        {"Shoot a pistol": "Shoot a basketball", "Throw a ball": "Shoot a basketball"},
    ),
    (("Lie down", "Lie", "Sleep", "Die"), {"Stand up": "Get up from the back"}),
    (("Sit on the floor", "Sit down on the floor"), {"Stand up": "Stand up from the floor"}),
)
"""Actions, and what others become after them."""

NAMES = {
    "cmu": "CMU motion capture, eight actions",
    "cmu-fine": "CMU motion capture",
    CLIPS: "hand-keyed clips",
    "humanact12": "HumanAct12",
    "humanact12-fine": "HumanAct12, fine",
}
"""Names of the sources in messages."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """An available action.

    Attributes
    ----------
    name : str
    sources : tuple of str
        The members of `SOURCES` that have it, the preferred one first.
    theme : str
    license : str
    note : str
        Known weaknesses of the action; empty if there are none.
    """

    name: str
    sources: tuple[str, ...]
    theme: str
    license: str
    note: str = ""


@dataclass(frozen=True)
class Catalog:
    """The actions of some sources, searchable by words."""

    entries: tuple[Entry, ...]
    vocabulary: Vocabulary

    @cached_property
    def _by_name(self) -> dict[str, Entry]:
        return {entry.name: entry for entry in self.entries}

    def entry(self, action: str) -> Entry:
        """Return the entry of an action."""
        return self._by_name[action]

    def themes(self) -> dict[str, list[Entry]]:
        """Return the entries by theme, with the themes in alphabetical order."""
        names = sorted({entry.theme for entry in self.entries})
        return {name: [entry for entry in self.entries if entry.theme == name] for name in names}


@dataclass(frozen=True)
class Understanding:
    """The steps that a prompt was matched to.

    Attributes
    ----------
    steps : tuple of Step
        Each with its `source`.
    matches : tuple of Match
        One match per step.
    """

    steps: tuple[Step, ...]
    matches: tuple[Match, ...]

    @classmethod
    def of(cls, steps: Sequence[Step], matches: Sequence[Match], known: Catalog) -> Understanding:
        """Give steps their sources, and tell which wishes are kept."""
        left, told = kept_and_told(with_sources(steps, known), matches)
        return cls(tuple(left), tuple(told))

    @property
    def sources(self) -> tuple[str, ...]:
        """The sources of the steps and their layers, each once."""
        own = (source for step in self.steps for source in (step.source, step.wishes.over_source))
        return tuple(dict.fromkeys(filter(None, own)))


@cache
def catalog(license: str = "any", sources: tuple[str, ...] = SOURCES) -> Catalog:
    """Return the actions of `sources` that a license allows.

    Raises
    ------
    InputError
        `license` is not one of `LICENSES`.
    """
    if license not in LICENSES:
        raise InputError(f"license is '{license}'; choose from {', '.join(LICENSES)}")
    found: dict[str, Entry] = {}
    vocabularies = []
    for source in sources:
        if license == "free" and source in RESEARCH:
            continue
        own, words = _clip_entries() if source == CLIPS else _model_entries(source)
        vocabularies.append(words)
        for entry in own:
            key = plain_name(entry.name)
            known = found.get(key)
            found[key] = (
                entry
                if known is None
                else dataclasses.replace(known, sources=(*known.sources, source))
            )
    entries = tuple(found.values())
    names = [entry.name for entry in entries]

    def joined(part: str) -> dict[str, Any]:
        return {
            action: value
            for words in reversed(vocabularies)
            for action, value in getattr(words, part).items()
            if action in names
        }

    vocabulary = Vocabulary(
        tuple(names), joined("descriptions"), joined("kinds"), joined("traits"), other_names()
    )
    return Catalog(entries, vocabulary)


def read_prompt(
    text: str, vocabulary: Vocabulary, *, strict: bool = False
) -> tuple[list[Step], list[Match]]:
    """Read a prompt in any known language (`a2v.motion.languages`) by `parse_prompt`.

    Raises
    ------
    InputError
        See `parse_prompt`; or the language is unknown.
    """
    english = translated(text)
    if english.language == "unknown":
        raise UnknownActionError(
            text, (), f"its language is unknown; known: English, {', '.join(LANGUAGES.values())}"
        )
    steps, matches = parse_prompt(english.text, vocabulary, strict=strict)
    if english.language != "English":
        told = [Told("language", f"{english.language}, read as '{english.text}'")]
        told += [Told("word", f"'{word}'", False, "not in the table") for word in english.left]
        first = matches[0]
        matches[0] = dataclasses.replace(
            first,
            told=(*told, *first.told),
            score=first.score * UNKEPT ** len(english.left),
        )
    return steps, matches


def understand(
    text: str, *, license: str = "any", sources: Sequence[str] = SOURCES, strict: bool = False
) -> Understanding:
    """Match words to steps of any source. If several sources have an action, those that are free
    for every use come first, then one that also has other steps.

    Parameters
    ----------
    text : str
        Such as "sneak, then wave, then salsa for 2 s".
    license : "any" or "free"
    sources : sequence of str
        Of `SOURCES`.
    strict : bool
        Refuse a prompt with an unknown part, which is left out otherwise.

    Raises
    ------
    InputError
        No part matches an action (the message names it and the five nearest), or the prompt has no
        part or is too long.
    """
    known = catalog(license, tuple(sources))
    steps, matches = read_prompt(text, known.vocabulary, strict=strict)
    fitting = _in_context([step.action for step in steps], known)
    steps = [
        dataclasses.replace(step, action=action)
        for step, action in zip(steps, fitting, strict=True)
    ]
    matches = [
        dataclasses.replace(match, action=action)
        for match, action in zip(matches, fitting, strict=True)
    ]
    return Understanding.of(steps, matches, known)


def _in_context(actions: Sequence[str], known: Catalog) -> list[str]:
    """Replace actions by their versions after the ones before ("sit down, then talk", "dribble,
    then shoot")."""
    names = {entry.name for entry in known.entries}
    found: list[str] = []
    context: Mapping[str, str] = {}
    for action in actions:
        kept = action in context or action in context.values()
        action = context[action] if context.get(action) in names else action
        found.append(action)
        starts = next((after for begun, after in CONTEXTS if action in begun), None)
        context = starts if starts is not None else context if kept else {}
    return found


def with_sources(steps: Sequence[Step], known: Catalog) -> list[Step]:
    """Give each step and its layer a source: of the sources that have it, one that is free for
    every use, and of these the one that has most of the steps."""
    counts = Counter(source for step in steps for source in known.entry(step.action).sources)

    def best(action: str) -> str:
        own = known.entry(action).sources
        return max(
            own,
            key=lambda source: (source not in RESEARCH, counts[source], -own.index(source)),
        )

    return [
        dataclasses.replace(
            step,
            source=best(step.action),
            wishes=dataclasses.replace(
                step.wishes, over_source=best(step.wishes.over) if step.wishes.over else ""
            ),
        )
        for step in steps
    ]


def _clip_entries() -> tuple[list[Entry], Vocabulary]:
    clips = clip_library().clips
    entries = [
        Entry(name=clip.name, sources=(CLIPS,), theme=clip.theme, license=clip.license)
        for clip in clips
    ]
    words = Vocabulary(
        tuple(clip.name for clip in clips),
        kinds={clip.name: clip.theme for clip in clips},
        traits={clip.name: [clip.words] for clip in clips},
    )
    return entries, words


def _model_entries(source: str) -> tuple[list[Entry], Vocabulary]:
    card = MotionModel.load(source).card
    words = Vocabulary.of(card)
    license = "research only" if source in RESEARCH else "free"
    return [
        Entry(
            name=name,
            sources=(source,),
            theme=_theme(card, words, name),
            license=license,
            note=weaknesses().get(name, "") if source == "cmu-fine" else "",
        )
        for name in card.actions
    ], words


@cache
def weaknesses() -> dict[str, str]:
    """Return the weak actions of `cmu-fine` with a description of the weakness (``weak.csv``)."""
    with WEAK.open(newline="", encoding="utf-8") as stream:
        return {row["action"]: row["note"] for row in csv.DictReader(stream)}


def _theme(card: ModelCard, words: Vocabulary, action: str) -> str:
    family = words.kinds.get(action, action)
    if family in THEMES:
        return THEMES[family]
    return HUMANACT12_THEMES.get(action.split("_")[0], "everyday")

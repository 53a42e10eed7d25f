"""Prompts: free text to a timeline of actions that a model knows, without a network.

A prompt is split where one thing follows another ("then", commas); each part gives up its duration and its tempo, and its words are
brought to a common form: phrases and words of a table of synonyms (``synonyms.csv``), word stems (Porter's, by snowballstemmer), and
near misses in spelling (rapidfuzz). An action's score is the share of the words that it explains, each weighed by how few actions have
it; what the words leave open, trigrams in common with the action's descriptions decide.
"""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

import snowballstemmer
from rapidfuzz import fuzz, process
from rapidfuzz.distance import OSA

from a2v.errors import InputError
from a2v.motion.card import ModelCard
from a2v.motion.model import plain_name

SYNONYMS = Path(__file__).parent / "synonyms.csv"

#: Words that say nothing about the action.
STOPWORDS = frozenset(
    ["a", "an", "the", "this", "that", "some", "someone", "somebody", "person", "people", "man", "woman", "guy", "girl", "boy", "child", "kid", "he", "she", "they", "it", "his", "her", "their", "its", "him", "them", "one", "is", "are", "be", "being", "does", "do", "did", "doing", "make", "makes", "making", "let", "lets", "please", "can", "could", "would", "should", "will", "want", "go", "goes", "going", "gets", "get", "act", "acts", "acting", "perform", "performs", "performing", "play", "plays", "playing", "pretend", "pretends", "use", "uses", "using", "has", "have", "having", "like", "as", "if", "of", "to", "in", "on", "at", "by", "for", "from", "with", "without", "into", "onto", "over", "under", "through", "past", "along", "towards", "toward", "up", "and", "or", "while", "after", "before", "then", "so", "very", "really", "quite", "just", "bit", "little"]
)
#: Words that tell kinds of motion apart: an action of another kind than the prompt names is less likely.
KINDS = frozenset({"walk", "run", "jump", "danc", "climb", "step"})
#: Tempo, where the chosen action has none of its own.
TEMPO = {"slow": 0.7, "fast": 1.35}

NUMBERS = {
    "half a": 0.5, "half": 0.5, "a": 1, "an": 1, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8,
    "nine": 9, "ten": 10, "twelve": 12, "fifteen": 15, "twenty": 20, "thirty": 30,
}  # fmt: skip
#: Longest step that a prompt may ask for, seconds.
MAX_SECONDS = 600.0

_THEN = re.compile(r"\s*(?:,\s*(?:and\s+)?then\s+|\s+and\s+then\s+|\s+then\s+|\s*,\s*followed\s+by\s+|\s+followed\s+by\s+|\s+after\s+that\s+|[;,>]|->)\s*", re.IGNORECASE)
_NUMBER = r"(?P<number>\d+(?:\.\d+)?|" + "|".join(sorted(NUMBERS, key=len, reverse=True)) + r")"
_DURATION = re.compile(rf"\b(?:for\s+)?(?:about\s+)?{_NUMBER}\s*-?\s*(?P<unit>s|sec|secs|seconds?|min|minutes?|frames?)\b", re.IGNORECASE)
_stem = snowballstemmer.stemmer("english").stemWord

LEAST_SCORE = 0.34  # below it a prompt is refused
LEAST_SPELLING = 86  # of 100: how near a misspelt word must be
UNEXPLAINED_NAME = 0.6  # how much a word of the action's name that the prompt lacks counts against it
OTHER_KIND = 0.55
KIND_SHARE = 0.5  # a word that only the action's family has explains so much
DESCRIPTION_SHARE = 0.06


@dataclass(frozen=True, kw_only=True)
class Step:
    """One part of a timeline.

    Attributes
    ----------
    action : str
        As the model names it.
    seconds : float or None
        How long; None for a share of what the whole has.
    frames : int or None
        The same in frames of the result; at most one of the two is given.
    seed : int or None
        Seed of this part's noise; None for the whole's.
    speed : float
        1 as recorded, 2 twice as fast.
    """

    action: str
    seconds: float | None = None
    frames: int | None = None
    seed: int | None = None
    speed: float = 1.0

    def __post_init__(self) -> None:
        if self.seconds is not None and self.frames is not None:
            raise InputError(f"'{self.action}' has both seconds ({self.seconds:g}) and frames ({self.frames}); give one of them")
        if self.seconds is not None and not 0 < self.seconds <= MAX_SECONDS:
            raise InputError(f"'{self.action}' lasts {self.seconds:g} seconds; expected more than 0 and at most {MAX_SECONDS:g}")
        if self.frames is not None and self.frames < 1:
            raise InputError(f"'{self.action}' lasts {self.frames} frames; expected at least 1")
        if not 0.25 <= self.speed <= 4:
            raise InputError(f"'{self.action}' has speed {self.speed:g}; expected .25 to 4")


@dataclass(frozen=True)
class Match:
    """What a piece of text was taken for.

    Attributes
    ----------
    text : str
    action : str
        The best; its `score` is in [0, 1].
    score : float
    others : tuple of str
        The next best, best first.
    speed : float
        Tempo that the text asks for and the action does not have in its name.
    """

    text: str
    action: str
    score: float
    others: tuple[str, ...]
    speed: float = 1.0


@dataclass(frozen=True)
class Vocabulary:
    """The actions of a model, searchable by free text.

    Attributes
    ----------
    actions : tuple of str
        In label order: of equals, the first is taken.
    descriptions : mapping of str to texts
        What is known of an action besides its name.
    kinds : mapping of str to str
        Family of an action, such as "Walk".
    traits : mapping of str to texts
        Direction, style and the like: they speak for an action, and nothing is missed where a prompt does not say them.
    """

    actions: tuple[str, ...]
    descriptions: Mapping[str, Sequence[str]] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    traits: Mapping[str, Sequence[str]] = field(default_factory=dict)

    @classmethod
    def of(cls, card: ModelCard) -> Vocabulary:
        """What a model's file says of its actions."""
        traits = dict(zip(card.actions, card.traits, strict=True)) if card.traits else {}
        split = {action: [trait.partition(":") for trait in own] for action, own in traits.items()}
        return cls(
            card.actions,
            dict(zip(card.actions, card.descriptions, strict=True)) if card.descriptions else {},
            {action: value for action, own in split.items() for kind, _, value in own if kind == "coarse"},
            {action: [value for kind, _, value in own if kind != "coarse"] for action, own in split.items()},
        )

    @cached_property
    def _names(self) -> list[frozenset[str]]:
        return [frozenset(canonical_words(action)) for action in self.actions]

    @cached_property
    def _kinds(self) -> list[frozenset[str]]:
        return [frozenset(canonical_words(self.kinds.get(action, ""))) for action in self.actions]

    @cached_property
    def _hints(self) -> list[frozenset[str]]:
        return [frozenset(word for text in self.traits.get(action, ()) for word in canonical_words(text)) for action in self.actions]

    @cached_property
    def _weights(self) -> dict[str, float]:
        """How much a word tells: the rarer among the actions, the more."""
        counts = Counter(word for name in self._names for word in name)
        weights = {word: math.log(1 + len(self.actions) / count) for word, count in counts.items()}
        hints = {word for words in (*self._kinds, *self._hints) for word in words} - set(weights)
        tempo = {word: min(weights.get(word, 1.0), 1.0) for word in TEMPO}
        return weights | dict.fromkeys(hints, 0.5) | {word: weight for word, weight in tempo.items() if word in weights}

    @cached_property
    def _trigrams(self) -> list[Counter[str]]:
        texts = (" ".join([action, *self.descriptions.get(action, ())]) for action in self.actions)
        return [trigrams(text) for text in texts]

    def known(self, words: Iterable[str]) -> dict[str, float]:
        """The words that some action has, a misspelt one as what it is nearest to, and how sure that is."""
        found: dict[str, float] = {}
        for word in words:
            if word in self._weights:
                found[word] = 1.0
            elif len(word) >= 4 and (near := process.extractOne(word, self._weights.keys(), scorer=_spelling, score_cutoff=LEAST_SPELLING)):
                found.setdefault(near[0], near[1] / 100)
        return found

    def rank(self, text: str) -> list[tuple[str, float]]:
        """Actions with their scores in [0, 1], best first."""
        words = self.known(canonical_words(text))
        kinds = KINDS & set(words)
        own = trigrams(text)
        total = sum(self._weights[word] for word in words)
        scores = []
        for name, kind, hint, grams in zip(self._names, self._kinds, self._hints, self._trigrams, strict=True):
            explained = sum(
                self._weights[word] * sure * (1.0 if word in name or word in hint else KIND_SHARE)
                for word, sure in words.items()
                if word in name or word in kind or word in hint
            )
            missing = sum(self._weights[word] for word in name if word not in words)
            score = explained / (total + UNEXPLAINED_NAME * missing) if explained else 0.0
            if kinds and not kinds & (name | kind):
                score *= OTHER_KIND
            scores.append((1 - DESCRIPTION_SHARE) * score + DESCRIPTION_SHARE * likeness(own, grams))
        order = sorted(range(len(scores)), key=lambda index: (-scores[index], index))
        return [(self.actions[index], scores[index]) for index in order]

    def match(self, text: str) -> Match:
        """The action that a piece of text means.

        Raises
        ------
        InputError
            Nothing comes near; the message names the five nearest.
        """
        plain = {plain_name(action): action for action in self.actions}
        ranked = self.rank(text)
        others = tuple(action for action, _ in ranked[:6])
        if plain_name(text) in plain:
            action = plain[plain_name(text)]
            return Match(text, action, 1.0, tuple(other for other in others if other != action)[:5])
        best, score = ranked[0]
        if score < LEAST_SCORE:
            raise InputError(f"'{text}' is none of the actions that this model knows; the nearest are {', '.join(others[:5])}")
        words = set(canonical_words(text))
        has = self._names[self.actions.index(best)]
        speed = math.prod(rate for word, rate in TEMPO.items() if word in words and word not in has)
        return Match(text, best, score, others[1:], speed)


def parse_prompt(text: str, vocabulary: Vocabulary) -> tuple[list[Step], list[Match]]:
    """A prompt such as "walk slowly, then salsa for 2 s, then jump" as steps, and what each part was taken for.

    Raises
    ------
    InputError
        A part is empty or means no action; the message names the part and the nearest actions.
    """
    parts = [part.strip() for part in _THEN.split(text.strip())]
    if not text.strip() or not all(parts):
        raise InputError(f"the prompt '{text}' has an empty part; write actions with commas or 'then' between them")
    steps, matches = [], []
    for part in parts:
        seconds, frames, rest = take_duration(part)
        match = vocabulary.match(rest)
        steps.append(Step(action=match.action, seconds=seconds, frames=frames, speed=match.speed))
        matches.append(match)
    return steps, matches


def take_duration(text: str) -> tuple[float | None, int | None, str]:
    """Seconds or frames that a text asks for, and the text without them."""
    found = _DURATION.search(text)
    if found is None:
        return None, None, text
    rest = " ".join((text[: found.start()] + " " + text[found.end() :]).split())
    if not rest:
        return None, None, text
    number = found["number"].lower()
    amount = float(NUMBERS.get(number, 0) or number)
    if found["unit"].lower().startswith("frame"):
        return None, max(1, round(amount)), rest
    return amount * (60 if found["unit"].lower().startswith("min") else 1), None, rest


def canonical_words(text: str) -> list[str]:
    """Words of a text in common form: phrases and synonyms replaced, fillers dropped, stems."""
    words = [_root(word) for word in re.findall(r"[a-z0-9]+", text.lower().replace("'", ""))]
    phrases, longest = _synonyms()
    found: list[str] = []
    at = 0
    while at < len(words):
        for size in range(min(longest, len(words) - at), 0, -1):
            means = phrases.get(tuple(words[at : at + size]))
            if means is not None:
                found += means
                at += size
                break
        else:
            if words[at] not in _stems_of_stopwords():
                found.append(words[at])
            at += 1
    return found


def trigrams(text: str) -> Counter[str]:
    """Counts of all runs of three letters within words."""
    padded = "".join(f" {word} " for word in re.findall(r"[a-z0-9]+", text.lower()))
    return Counter(padded[at : at + 3] for at in range(len(padded) - 2))


def likeness(one: Counter[str], other: Counter[str]) -> float:
    """Cosine between two counts, in [0, 1]."""
    norm = math.sqrt(sum(n * n for n in one.values()) * sum(n * n for n in other.values()))
    return sum(count * other[gram] for gram, count in one.items()) / norm if norm else 0.0


def explain(matches: Sequence[Match]) -> list[str]:
    """A line a part: what it was taken for, and the nearest others."""
    lines = []
    for match in matches:
        tempo = "" if match.speed == 1 else f", at {match.speed:g} times its speed"
        lines.append(f"'{match.text}' is taken for {match.action}{tempo} (near: {', '.join(match.others[:3])})")
    return lines


def _spelling(one: str, other: str, *, score_cutoff: float | None = None) -> float:
    """How alike two words are written, 0 to 100; two neighbouring letters exchanged are a slip of one finger."""
    slip = sorted(one) == sorted(other) and OSA.distance(one, other, score_cutoff=1) == 1
    return 90.0 if slip else fuzz.ratio(one, other, score_cutoff=score_cutoff)


def _root(word: str) -> str:
    """Stem of a word, that of an adverb's adjective: "happily" as "happy"."""
    if len(word) > 4 and word.endswith("ly"):
        word = word[:-3] + "y" if word.endswith("ily") else word[:-2]
    return str(_stem(word))


@cache
def _synonyms() -> tuple[dict[tuple[str, ...], list[str]], int]:
    """Stems of a phrase to the stems that it means; and the longest phrase."""
    with SYNONYMS.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    table = {tuple(_root(word) for word in row["words"].split()): [_root(word) for word in row["means"].split()] for row in rows}
    return table, max(map(len, table))


@cache
def _stems_of_stopwords() -> frozenset[str]:
    return frozenset({_root(word) for word in STOPWORDS} | STOPWORDS)

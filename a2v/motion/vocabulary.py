"""The available actions, searchable by free text.

A prompt's words, in common form (`a2v.motion.lexicon`), are compared with the words of an action's
name and of its other names. An action's score is the fraction of the prompt's words that it
contains, weighted by the rarity of the words among actions. Words that no action has reduce all
scores, by their class. Between equal scores, trigrams in common with the action's descriptions
decide.
"""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

from a2v.errors import InputError
from a2v.io import shorten
from a2v.motion.card import ModelCard
from a2v.motion.lexicon import PARTICLE, PARTICLES, Word, canonical_words, read_words
from a2v.motion.names import plain_name
from a2v.motion.wishes import Told

ALIASES = Path(__file__).with_name("aliases.csv")

# : Words that distinguish kinds of motion. An action of another kind than that of the prompt is
# less likely.
KINDS = frozenset({"walk", "run", "jump", "danc", "climb", "step"})
#: Tempo, if the chosen action has none of its own.
TEMPO = {"slow": 0.7, "fast": 1.35}

LEAST_SCORE = 0.55
"""Score below which a prompt is refused: calibrated on the development half of
``tests/motion/words.csv`` (docs/results/words.md)."""
UNEXPLAINED_NAME = 0.6
"""Penalty of a word of the action's name that the prompt lacks."""
ANOTHER_NAME = 0.1
"""The same penalty if the prompt has none of the name's words but uses others."""
OTHER_KIND = 0.55
KIND_SHARE = 0.5
"""Weight of a word that matches only an action's family."""
HINT_SHARE = 0.8
"""Weight of a word that matches only another name of an action."""
PLACED_WORD = 0.4
"""Factor on the weight of a word of place ("stand up from the floor"), for actions that do not have
it."""
ADVERB = 0.4
"""Factor on the weight of words of manner: "listen carefully", "run away scared"."""
HINT = 0.55
"""Weight of a word that is in no action's name, only in other names."""
TEMPO_WEIGHT = 0.3
ANIMALS = "Animal Behavior"
"""The family of animal motions."""
ANIMAL = 2.0
"""Weight of the name of an animal that acts or is imitated, so that "elephant" means the elephant's
action."""
DESCRIPTION_SHARE = 0.04
LIGHTEST = 0.6
"""Smallest weight of a word of a name that is neither a tempo nor a particle."""
NEAR = 0.2 * DESCRIPTION_SHARE
"""Score above which an action is suggested: it has a word of the text, or a fifth of its trigrams.
"""
OFFERED = 5
"""Number of actions that a refusal suggests."""


class UnknownActionError(InputError):
    """Words that match no action.

    Attributes
    ----------
    text : str
        The words.
    nearest : tuple of str
        The nearest actions, best first; empty if none has a score above `NEAR`.
    """

    def __init__(self, text: str, nearest: Sequence[str], hint: str = "") -> None:
        hint = hint or (
            f"the nearest {'are' if nearest[1:] else 'is'} {', '.join(nearest)}"
            if nearest
            else "describe it in English words, or choose one from the list: a2v actions"
        )
        super().__init__(f"'{shorten(text, 80)}' is none of the actions that are known; {hint}")
        self.text, self.nearest = text, tuple(nearest)


@dataclass(frozen=True)
class Match:
    """The action that a piece of text was matched to.

    Attributes
    ----------
    text : str
    action : str
        The best; its `score` is in [0, 1].
    score : float
    others : tuple of str
        The next best, best first.
    speed : float
        Tempo in the text that is not in the action's name.
    told : tuple of Told
        Wishes of the text, and whether they are kept.
    seed : int or None
        Of this action, if the prompt names a take.
    """

    text: str
    action: str
    score: float
    others: tuple[str, ...]
    speed: float = 1.0
    told: tuple[Told, ...] = ()
    seed: int | None = None


@dataclass(frozen=True)
class Vocabulary:
    """The actions of a model or of several sources, searchable by free text.

    Attributes
    ----------
    actions : tuple of str
        Between equally good ones, the first is chosen.
    descriptions : mapping of str to texts
        Descriptions of an action besides its name; they decide between equal scores.
    kinds : mapping of str to str
        Family of an action, such as "Walk".
    traits : mapping of str to texts
        Direction, style and the like: they raise an action's score, but cost nothing if a prompt
        lacks them.
    aliases : mapping of str to texts
        Other names.
    """

    actions: tuple[str, ...]
    descriptions: Mapping[str, Sequence[str]] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    traits: Mapping[str, Sequence[str]] = field(default_factory=dict)
    aliases: Mapping[str, Sequence[str]] = field(default_factory=dict)

    @classmethod
    def of(cls, card: ModelCard) -> Vocabulary:
        """The vocabulary of a model's actions."""
        traits = dict(zip(card.actions, card.traits, strict=True)) if card.traits else {}
        split = {action: [trait.partition(":") for trait in own] for action, own in traits.items()}
        return cls(
            card.actions,
            dict(zip(card.actions, card.descriptions, strict=True)) if card.descriptions else {},
            {
                action: value
                for action, own in split.items()
                for kind, _, value in own
                if kind == "coarse"
            },
            {
                action: [value for kind, _, value in own if kind != "coarse"]
                for action, own in split.items()
            },
            other_names(),
        )

    @cached_property
    def _names(self) -> list[frozenset[str]]:
        return [frozenset(canonical_words(action)) for action in self.actions]

    @cached_property
    def _kinds(self) -> list[frozenset[str]]:
        return [frozenset(canonical_words(self.kinds.get(action, ""))) for action in self.actions]

    @cached_property
    def _hints(self) -> list[frozenset[str]]:
        return [
            frozenset(
                word for text in self.traits.get(action, ()) for word in canonical_words(text)
            )
            for action in self.actions
        ]

    @cached_property
    def _called(self) -> list[tuple[frozenset[str], ...]]:
        """Return all names of each action: its name, and its other names."""
        return [
            (name, *(frozenset(canonical_words(alias)) for alias in self.aliases.get(action, ())))
            for action, name in zip(self.actions, self._names, strict=True)
        ]

    @cached_property
    def weights(self) -> dict[str, float]:
        """Return the weight of each word, at most 1: higher for words that are rarer among the
        actions' names."""
        counts = Counter(word for name in self._names for word in name)
        rarest = math.log(1 + len(self.actions))
        weights = {
            word: max(LIGHTEST, math.log(1 + len(self.actions) / count) / rarest)
            for word, count in counts.items()
        }
        others = (word for called in self._called for words in called for word in words)
        hints = {
            *others,
            *(word for words in (*self._kinds, *self._hints) for word in words),
        } - set(weights)
        weights |= dict.fromkeys(hints, HINT)
        light = dict.fromkeys(TEMPO, TEMPO_WEIGHT) | dict.fromkeys(PARTICLES, PARTICLE)
        return weights | {word: weight for word, weight in light.items() if word in weights}

    @cached_property
    def _named(self) -> frozenset[str]:
        return frozenset().union(*self._names)

    @cached_property
    def _animals(self) -> frozenset[str]:
        animals = (
            name
            for action, name in zip(self.actions, self._names, strict=True)
            if self.kinds.get(action) == ANIMALS
        )
        return frozenset().union(*animals)

    @cached_property
    def _trigrams(self) -> list[tuple[Counter[str], float]]:
        """Trigrams of the descriptions of each action, and the norm of their counts."""
        texts = (" ".join([action, *self.descriptions.get(action, ())]) for action in self.actions)
        return [(grams, _norm(grams)) for grams in map(trigrams, texts)]

    def read(self, text: str) -> list[Word]:
        """The words of a text in common form."""
        return read_words(text, self.weights)

    def rank(self, text: str, without: Collection[str] = ()) -> list[tuple[str, float]]:
        """Return the actions with their scores in [0, 1], best first, without those that have a
        word of `without` (stems)."""
        read = self.read(text)
        words: dict[str, Word] = {}
        for word in read:
            if word.stem in self.weights and (
                word.stem not in words or word.sure > words[word.stem].sure
            ):
                words[word.stem] = word
        against = sum(word.against for word in read if word.stem not in self.weights)
        # "warm up before a run" is not a run
        said = {stem for stem, word in words.items() if not word.placed} or set(words)
        kinds, own, banned = KINDS & said, trigrams(text), frozenset(without)
        led = {stem for stem, word in words.items() if word.leading} & self._animals
        scores = {}
        for index, (called, kind, hint) in enumerate(
            zip(self._called, self._kinds, self._hints, strict=True)
        ):
            if banned & (called[0] | hint):
                continue
            score = max(self._share(words, name, hint, kind, against) for name in called)
            if kinds and not kinds & (frozenset.union(*called) | kind) and not led & called[0]:
                score *= OTHER_KIND
            scores[index] = (1 - DESCRIPTION_SHARE) * score + DESCRIPTION_SHARE * likeness(
                own, *self._trigrams[index]
            )
        order = sorted(
            scores,
            key=lambda index: (-round(scores[index], 6), self.actions[index].count(" "), index),
        )
        return [(self.actions[index], scores[index]) for index in order]

    def _share(
        self,
        words: Mapping[str, Word],
        name: frozenset[str],
        hint: frozenset[str],
        kind: frozenset[str],
        against: float,
    ) -> float:
        """Return the weight of the `words` that match an action's name, traits or family, relative
        to all words of the prompt and the name."""
        explained, total, told = 0.0, against, False
        for stem, word in words.items():
            weight = ANIMAL if word.leading and stem in self._animals else self.weights[stem]
            share = (
                1.0
                if stem in name
                else HINT_SHARE
                if stem in hint
                else KIND_SHARE
                if stem in kind
                else 0.0
            )
            explained += weight * word.sure * share
            told = told or (share > 0 and weight > TEMPO_WEIGHT)
            least = 0.0 if stem in self._named else word.against
            manner = word.given.endswith("ly") or (word.given.endswith("ed") and not word.leading)
            lighter = ADVERB if manner else PLACED_WORD if word.placed else 1.0
            total += weight if share else max(weight * lighter, least)
        missing = UNEXPLAINED_NAME * sum(self.weights[stem] for stem in name if stem not in words)
        if not name & set(words):
            missing = min(missing, ANOTHER_NAME)
        return explained / (total + missing) if told else 0.0

    def has(self, text: str) -> bool:
        """Return whether a text is the name of an action."""
        return plain_name(text) in self._plain

    @cached_property
    def _plain(self) -> dict[str, str]:
        return {plain_name(action): action for action in reversed(self.actions)}

    def match(self, text: str, without: Collection[str] = ()) -> Match:
        """Return the action that best matches a piece of text, without those that have a word of
        `without`.

        Raises
        ------
        UnknownActionError
            No action is similar enough. The message names up to five that are near.
        """
        ranked = self.rank(text, without)
        others = tuple(action for action, share in ranked[: OFFERED + 1] if share > NEAR)
        if self.has(text) and not without:
            action = self._plain[plain_name(text)]
            return Match(
                text, action, 1.0, tuple(other for other in others if other != action)[:OFFERED]
            )
        best, score = ranked[0] if ranked else ("", 0.0)
        if score < LEAST_SCORE:
            raise UnknownActionError(text, others[:OFFERED])
        words = {word.stem for word in self.read(text)}
        has = self._names[self.actions.index(best)]
        speed = math.prod(rate for word, rate in TEMPO.items() if word in words and word not in has)
        return Match(text, best, min(score, 0.999), others[1:], speed)


def trigrams(text: str) -> Counter[str]:
    """Counts of all runs of three letters within words."""
    padded = "".join(f" {word} " for word in re.findall(r"[a-z0-9]+", text.lower()))
    return Counter(padded[at : at + 3] for at in range(len(padded) - 2))


def likeness(one: Counter[str], other: Counter[str], norm: float) -> float:
    """Return the cosine between two counts, in [0, 1]; `norm` is that of `other`."""
    whole = norm * _norm(one)
    return (
        sum(count * other[gram] for gram, count in one.items() if gram in other) / whole
        if whole
        else 0.0
    )


def _norm(counts: Counter[str]) -> float:
    return math.sqrt(sum(n * n for n in counts.values()))


@cache
def other_names() -> dict[str, tuple[str, ...]]:
    """Return the other names of actions, from ``aliases.csv``."""
    with ALIASES.open(newline="", encoding="utf-8") as stream:
        return {row["action"]: tuple(row["aliases"].split(";")) for row in csv.DictReader(stream)}

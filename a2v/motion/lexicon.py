"""Words of prompts in a common form: stems, synonyms, corrected spelling, and classes.

``synonyms.csv`` is curated; ``words.txt.gz`` and ``senses.csv`` are made from WordNet 3.0
(``scripts/make_word_tables.py``).
"""

from __future__ import annotations

import csv
import gzip
import re
import threading
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

import snowballstemmer
from rapidfuzz import process
from rapidfuzz.distance import OSA

SYNONYMS = Path(__file__).with_name("synonyms.csv")
WORDS = Path(__file__).with_name("words.txt.gz")
SENSES = Path(__file__).with_name("senses.csv")

MAX_WORDS = 60
"""Largest number of words of one part of a prompt that are read."""

# : Words that do not describe an action.
STOPWORDS = frozenset(
    ["a", "an", "the", "this", "that", "some", "any", "someone", "somebody", "something", "anything", "person", "people", "man", "woman", "guy", "girl", "boy", "child", "kid", "i", "me", "my", "you", "your", "we", "he", "she", "they", "it", "his", "her", "their", "its", "him", "them", "himself", "herself", "itself", "one", "is", "are", "be", "being", "am", "was", "does", "do", "did", "doing", "make", "makes", "making", "let", "lets", "please", "can", "could", "would", "should", "will", "want", "wants", "need", "go", "goes", "going", "gets", "get", "act", "acts", "acting", "perform", "performs", "performing", "play", "plays", "playing", "put", "puts", "putting", "pretend", "pretends", "use", "uses", "using", "has", "have", "having", "like", "as", "if", "of", "to", "in", "on", "at", "by", "for", "from", "with", "into", "onto", "over", "under", "through", "past", "along", "towards", "toward", "and", "or", "while", "after", "before", "then", "so", "very", "really", "quite", "just", "bit", "little", "there", "here", "first", "finally", "next", "later", "show", "shows", "try", "tries", "but", "possible", "again", "feel", "feels", "feeling", "two", "three", "four", "five", "six", "ten", "twice", "once", "times", "more", "when", "who", "which", "what", "how", "everybody", "nobody", "thing", "stuff", "normally", "normal", "guys", "dude", "lady", "character", "avatar", "video", "motion", "animation", "movement", "action", "scene"]
)  # fmt: skip

WEIGHTS = {
    "v": 0.9,
    "n": 0.9,
    "m": 0.7,
    "o": 0.4,
    "j": 0.2,
    "r": 0.12,
    "c": 0.06,
    "x": 1.5,
    "": 0.9,
}
"""Penalty of a word that no action has, by its class (see ``words.txt.gz``); "" is the class of
unknown words."""
PARTICLES = frozenset(
    [
        "up",
        "down",
        "around",
        "out",
        "off",
        "away",
        "over",
        "about",
        "back",
        "take",
        "give",
        "hand",
        "hands",
        "both",
        "righthand",
        "lefthand",
        "still",
        "start",
        "begin",
        "place",
    ]
)
PARTICLE = 0.2
"""Largest weight of one of `PARTICLES`: actions are named with and without them."""
HEAD = 1.4
"""Factor on the weight of the first verb of a part."""
PLACED = 0.15
"""Factor on the weight of a noun that is only the place of the action ("through the park")."""
PLACES = frozenset(
    ["on", "after", "before", "during", "until", "in", "at", "through", "to", "into", "along", "past", "towards", "toward", "from", "near", "around", "behind", "across", "down", "up", "under", "inside", "outside", "for", "by", "beside"]
)  # fmt: skip
DETERMINERS = frozenset(
    ["a", "an", "the", "this", "that", "some", "my", "your", "his", "her", "their", "its", "one", "two"]
)  # fmt: skip
LIKE = frozenset(
    [
        "like",
        "as",
        "be",
        "act",
        "imitate",
        "being",
        "pretend",
        "play",
        "acts",
        "acting",
        "is",
        "become",
    ]
)
SUBJECTS = frozenset(
    ["nobody", "everybody", "someone", "somebody", "there", "it", "you", "he", "she", "they", "no"]
)
AUXILIARIES = frozenset(["is", "are", "was", "were", "has", "have", "one"])
RELATIONS = {"same": 0.95, "kind": 0.8}
"""Confidence that a word means its relative in ``senses.csv``, by the relation."""
MENDED = 0.9
"""Confidence in a word with corrected spelling."""
LEAST_MENDED = 4
"""Length of the shortest word whose spelling is corrected, letters."""

_LOCK = threading.Lock()
_stemmer = snowballstemmer.stemmer("english")


@dataclass(frozen=True)
class Word:
    """A word of a prompt.

    Attributes
    ----------
    stem : str
        In common form.
    given : str
        The word as written.
    sure : float
        Confidence that `stem` was meant, in [0, 1].
    against : float
        Smallest penalty for an action without this word.
    placed : bool
        Whether it names a place of the action.
    leading : bool
        Whether it names the actor or a comparison.
    """

    stem: str
    given: str
    sure: float = 1.0
    against: float = 0.0
    placed: bool = False
    leading: bool = False


@lru_cache(maxsize=20_000)
def root(word: str) -> str:
    """Return the stem of a word; of an adverb, the stem of its adjective: "happily" as "happy"."""
    if len(word) > 4 and word.endswith("ly"):
        word = word[:-3] + "y" if word.endswith("ily") else word[:-2]
    with _LOCK:  # Snowball's stemmer stores its current word in itself
        return str(_stemmer.stemWord(word))


def plain_words(text: str) -> list[str]:
    """Split a text into lower-case words; "don't" is "dont", "t-rex" is two words. A comparison
    with a whole sentence ("like nobody is watching") is left out."""
    words = re.findall(r"[a-z0-9]+", text.lower().replace("'", "").replace("’", ""))
    for at in range(1, len(words) - 2):
        if words[at] == "like" and words[at + 1] in SUBJECTS and words[at + 2] in AUXILIARIES:
            return words[:at]
    return words


def canonical_words(text: str) -> list[str]:
    """Words of a text in common form: phrases and synonyms replaced, fillers dropped, stems."""
    return [stem for stem, _ in _canonical(plain_words(text))]


def _canonical(words: Sequence[str]) -> list[tuple[str, tuple[int, int]]]:
    """Return the stems in common form, and the range of words (begin, end) that each is from."""
    roots = [root(word) for word in words]
    phrases, longest = synonyms()
    found: list[tuple[str, tuple[int, int]]] = []
    at = 0
    while at < len(roots):
        for size in range(min(longest, len(roots) - at), 0, -1):
            means = phrases.get(("=" + words[at],)) if size == 1 else None
            means = phrases.get(tuple(roots[at : at + size])) if means is None else means
            if means is not None:
                found += [(stem, (at, at + size)) for stem in means]
                at += size
                break
        else:
            if (
                at + 1 < len(roots)
                and "_".join(roots[at : at + 2]) in dictionary()
                and words[at + 1] not in PARTICLES
            ):
                found.append(("_".join(roots[at : at + 2]), (at, at + 2)))
                at += 1
            elif words[at] not in STOPWORDS and roots[at] not in _stopped():
                found.append((roots[at], (at, at + 1)))
            at += 1
    return found


def read_words(text: str, vocabulary: Collection[str]) -> list[Word]:
    """Map the words of a part of a prompt to stems of a `vocabulary`, with corrected spelling and
    weights.

    A word that is not in the vocabulary can be replaced by a more general one that is
    (``senses.csv``).
    """
    given = plain_words(text)[:MAX_WORDS]
    words = [mended(word, vocabulary) for word in given]
    found, headed = [], False
    for stem, (begin, end) in _canonical(words):
        placed = _placed(words, begin)
        if stem.isdigit() or (placed and _describes(words, begin)):
            continue
        kind = _class_of(words, begin, stem)
        sense = senses().get(stem) if kind in ("v", "m", "n") and stem not in vocabulary else None
        sure = 1.0 if words[begin:end] == given[begin:end] else MENDED
        if sense is not None and sense[0] in vocabulary:
            stem, sure = sense[0], sure * sense[1]
        weight = PARTICLE if stem in PARTICLES else WEIGHTS[kind]
        if kind == "v" and not headed:
            weight, headed = weight * HEAD, True
        if kind in ("o", "c", "n") and placed:
            weight *= PLACED
        headed = headed or (stem in vocabulary and "v" in dictionary().get(stem, ""))
        found.append(
            Word(stem, " ".join(given[begin:end]), sure, weight, placed, _names_actor(words, begin))
        )
    return found


def _class_of(words: Sequence[str], at: int, stem: str) -> str:
    """Return the class of a word at its position. After an article it is no verb; a word in -ing,
    or one that begins a prompt, is a verb if it can be."""
    kinds = dictionary().get(stem, "")
    if "v" in kinds and kinds != "v":
        before = words[at - 1] if at else ""
        rest = kinds.replace("v", "")
        if (
            before in DETERMINERS
            or before in PLACES
            or "j" in dictionary().get(root(before), "")[:1]
        ):
            return rest[0]
        after = words[at + 1] if at + 1 < len(words) else ""
        if (
            at == 0
            and after not in STOPWORDS
            and after not in PARTICLES
            and "v" in dictionary().get(root(after), "")
        ):
            return rest[0]  # "shadow boxing"
        if (
            words[at].endswith("ing")
            or at == 0
            or before in ("to", "and", "then", "he", "she", "they", "you", "i")
        ):
            return "v"
    return kinds[:1]


def _placed(words: Sequence[str], at: int) -> bool:
    """Return whether a preposition of place precedes a word, with only articles and adjectives
    between."""
    for word in reversed(words[max(0, at - 3) : at]):
        if word in PLACES:
            return True
        if word not in DETERMINERS and not dictionary().get(root(word), "").startswith("j"):
            return False
    return False


def _describes(words: Sequence[str], at: int) -> bool:
    """Return whether a participle describes the next word: "the sleeping baby"."""
    after = words[at + 1] if at + 1 < len(words) else "a"
    return words[at].endswith("ing") and words[at - 1] in DETERMINERS and after not in STOPWORDS


def _names_actor(words: Sequence[str], at: int) -> bool:
    """Return whether a word is at the beginning (after articles and adjectives), or follows
    "like"."""
    for word in reversed(words[:at]):
        if word in LIKE:
            return True
        if word not in DETERMINERS and not dictionary().get(root(word), "").startswith("j"):
            return False
    return True


@lru_cache(maxsize=5_000)
def _mended(word: str, known: tuple[str, ...]) -> str:
    limit = 1 if len(word) < 9 else 2
    found = process.extractOne(word, known, scorer=OSA.distance, score_cutoff=limit)
    return str(found[0]) if found is not None else word


def mended(word: str, vocabulary: Collection[str]) -> str:
    """Return the vocabulary's nearest word for an unknown one, one error away (two in long words);
    known words unchanged."""
    stem = root(word)
    doubled = word[:-3] + word[-4:] if word.endswith("ing") else ""
    if doubled and "v" not in dictionary().get(stem, "") and root(doubled) in vocabulary:
        return doubled  # "runing", which has the stem of "rune"
    if (
        len(word) < LEAST_MENDED
        or not word.isalpha()
        or len(word) > 24
        or stem in vocabulary
        or stem in dictionary()
        or word in STOPWORDS
        or stem in _phrase_words()
    ):
        return word
    near = _mended(word, _mendable(tuple(vocabulary)))
    return near if near != word else _mended(stem, _mendable(tuple(vocabulary)))


@lru_cache(maxsize=8)
def _mendable(vocabulary: tuple[str, ...]) -> tuple[str, ...]:
    ended = {
        stem + end
        for stem in vocabulary
        if len(stem) >= LEAST_MENDED - 1
        for end in ("", "ing", "s")
    } | {stem + stem[-1:] + "ing" for stem in vocabulary if 2 < len(stem) < 6}
    return tuple(sorted(ended | {word for word in _phrase_words() if len(word) >= LEAST_MENDED}))


@cache
def synonyms() -> tuple[dict[tuple[str, ...], list[str]], int]:
    """Map phrases to stems of the same meaning ("=cheer": only that exact word); also return the
    length of the longest phrase."""
    with SYNONYMS.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    table = {
        tuple(word if word.startswith("=") else root(word) for word in row["words"].split()): [
            root(word) for word in row["means"].split()
        ]
        for row in rows
    }
    return table, max(map(len, table))


@cache
def _phrase_words() -> frozenset[str]:
    return frozenset(word for phrase in synonyms()[0] for word in phrase)


@cache
def dictionary() -> dict[str, str]:
    """Map stems of English words (two with ``_`` between them) to their classes."""
    lines = gzip.decompress(WORDS.read_bytes()).decode().splitlines()
    return dict(line.split(" ", 1) for line in lines)


@cache
def senses() -> dict[str, tuple[str, float]]:
    """Map each stem to a related, more general stem and the confidence of the relation."""
    with SENSES.open(newline="", encoding="utf-8") as stream:
        return {
            root(row["word"]): (root(row["means"]), RELATIONS[row["relation"]])
            for row in csv.DictReader(stream)
        }


@cache
def _stopped() -> frozenset[str]:
    return frozenset(root(word) for word in STOPWORDS) | STOPWORDS

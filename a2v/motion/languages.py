"""Prompts in other languages: the commonest words of actions, translated to English by a table.

``languages.csv`` has a row for each English phrase and a column for each language; "/" separates
alternatives. A row with "a" holds words that are left out. The table is our own; it is no
dictionary and knows no grammar.
"""

from __future__ import annotations

import csv
import re
import unicodedata
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import snowballstemmer

from a2v.motion.lexicon import STOPWORDS, dictionary, root, synonyms

TABLE = Path(__file__).with_name("languages.csv")
LANGUAGES = {
    "de": "German",
    "es": "Spanish",
    "fr": "French",
    "pt": "Portuguese",
    "it": "Italian",
    "zh": "Chinese",
    "ja": "Japanese",
    "ru": "Russian",
    "ar": "Arabic",
    "hi": "Hindi",
}
"""Columns of the table and their names."""
UNSPACED = ("zh", "ja")
"""Languages without spaces between words."""
LEFT_OUT = "a"
"""The row of words that are left out."""
LEAST_SHARE = 0.5
"""Least share of a text that a language must explain."""
LONGEST = 5
"""Largest number of words of a phrase."""


@dataclass(frozen=True)
class Translation:
    """A prompt in English.

    Attributes
    ----------
    text : str
        The prompt; unchanged for English and for unknown languages.
    language : str
        Name of the language; "unknown" for text that is neither English nor in the table.
    left : tuple of str
        Words that are not in the table, and left out.
    """

    text: str
    language: str = "English"
    left: tuple[str, ...] = ()


def translated(text: str) -> Translation:
    """Translate a prompt by the table, if another language explains more of it than English."""
    english = _english_share(text)
    found: list[tuple[float, str, str, tuple[str, ...]]] = []
    if english < 1:
        for code in LANGUAGES:
            words, share, left = _read(text, code)
            found.append((share, words, LANGUAGES[code], left))
    share, words, language, left = max(found, key=lambda one: one[0], default=(0.0, "", "", ()))
    if share >= LEAST_SHARE and share > english and words.strip(" ,;.!?"):
        return Translation(words, language, left)
    if english == 0 and any(letter.isalpha() and not letter.isascii() for letter in text):
        return Translation(text, "unknown")
    return Translation(text)


def simple(text: str) -> str:
    """Return lower-case text without accents and vowel points."""
    apart = unicodedata.normalize("NFKD", text.lower().replace("’", "'").replace("'", " "))
    kept = (letter for letter in apart if unicodedata.category(letter) != "Mn")
    return unicodedata.normalize("NFC", "".join(kept)).replace("ß", "ss").replace("ё", "е")


def _words(text: str) -> list[str]:
    return re.findall(r"[^\W\d_]+|\d+(?:\.\d+)?|[,;]", simple(text))


def _english_share(text: str) -> float:
    """Share of the words of a text that are English."""
    words = re.findall(r"[^\W\d_]+", text.lower().replace("'", ""))
    known = [
        word in STOPWORDS
        or (word.isascii() and (root(word) in dictionary() or (root(word),) in synonyms()[0]))
        for word in words
    ]
    return float(sum(known)) / max(len(known), 1)


@cache
def _stemmer(code: str) -> snowballstemmer.stemmer:
    names = {"zh": None, "ja": None}
    name = names.get(code, LANGUAGES[code].lower())
    return None if name is None else snowballstemmer.stemmer(name)


@cache
def _stem(word: str, code: str) -> str:
    stemmer = _stemmer(code)
    stem = word if stemmer is None else simple(str(stemmer.stemWord(word)))
    return stem.removesuffix("t") if code == "de" and len(stem) > 4 else stem


@cache
def _table(code: str) -> dict[tuple[str, ...], str]:
    """Map phrases, as stems or as one string of an unspaced language, to English."""
    found: dict[tuple[str, ...], str] = {}
    with TABLE.open(newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            for phrase in filter(None, row[code].split("/")):
                key = (
                    (simple(phrase),)
                    if code in UNSPACED
                    else tuple(_stem(word, code) for word in _words(phrase))
                )
                found.setdefault(key, row["means"])
    return found


def _read(text: str, code: str) -> tuple[str, float, tuple[str, ...]]:
    """Return the English words of a text in a language, the share of it that is in the table, and
    the words that are not."""
    pieces = (
        [letter for letter in simple(text) if not letter.isspace()]
        if code in UNSPACED
        else _words(text)
    )
    stems = pieces if code in UNSPACED else [_stem(word, code) for word in pieces]
    longest = max(map(len, (key[0] for key in _table(code)))) if code in UNSPACED else LONGEST
    english: list[str] = []
    left: list[str] = []
    at = known = counted = 0
    while at < len(pieces):
        for size in range(min(longest, len(pieces) - at), 0, -1):
            key = (
                ("".join(stems[at : at + size]),)
                if code in UNSPACED
                else tuple(stems[at : at + size])
            )
            if key in _table(code):
                means = _table(code)[key]
                english += [] if means == LEFT_OUT else [means]
                known, counted, at = known + size, counted + size, at + size
                break
        else:
            (left if pieces[at].isalpha() else english).append(pieces[at])
            counted += pieces[at].isalpha()
            at += 1
    joined = " ".join(english)
    if code in UNSPACED:
        joined = re.sub(r"(?<=\d) (?=\d)", "", joined).replace("，", ",").replace("、", ",")
    return joined, known / max(counted, 1), tuple(left)

"""Make the tables of words for reading prompts from WordNet 3.0's database (Debian's
package ``wordnet-base``, its license is in ``a2v/motion/words.license.txt``).

    apt-get download wordnet-base && dpkg-deb -x wordnet-base_*.deb wn
    python scripts/make_word_tables.py wn/usr/share/wordnet

- ``a2v/motion/words.txt.gz``: one line per stem with its classes, the most frequent first: ``v`` a
  verb, ``n`` a noun of an act or an event, ``o`` of a thing, ``m`` of an animal, ``c`` of a person,
  place, time, group, quality or feeling, ``j`` an adjective, ``r`` an adverb; ``x``: two words that
  mean something of their own (``sit up``).
- ``a2v/motion/senses.csv``: verbs that are a kind of, or another word for, one of `VERBS`, and
  animals that are a kind of one of `ANIMALS`.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import io
from collections import Counter, defaultdict
from pathlib import Path

from a2v.io import atomic_path
from a2v.motion.lexicon import SENSES, WORDS, root

VERBS = {
    "walk": 1,
    "run": 1,
    "jog": 3,
    "jump": 1,
    "hop": 1,
    "dance": 1,
    "climb": 1,
    "crawl": 1,
    "sneak": 1,
    "march": 1,
    "limp": 1,
    "swim": 1,
    "sit": 1,
    "sleep": 1,
    "talk": 2,
    "nod": 1,
    "bow": 1,
    "throw": 1,
    "push": 1,
    "punch": 1,
    "kick": 1,
    "drink": 1,
    "eat": 1,
    "celebrate": 1,
    "meditate": 1,
    "crouch": 1,
    "shiver": 1,
    "clean": 1,
    "sweep": 1,
    "carry": 1,
    "stretch": 1,
    "die": 1,
    "fly": 1,
    "box": 3,
    "clap": 2,
    "wave": 1,
    "whirl": 2,
    "laugh": 1,
    "cry": 2,
}
"""Verbs in the names of actions, and their senses in WordNet."""
ANIMALS = {
    "monkey": 1,
    "chicken": 2,
    "bear": 1,
    "cat": 1,
    "dog": 1,
    "elephant": 1,
    "mouse": 1,
    "snake": 1,
    "whale": 2,
    "penguin": 1,
    "squirrel": 1,
    "fish": 1,
    "dinosaur": 1,
}
MISLEADING = frozenset(
    [
        "squat",
        "hunker",
        "sing",
        "hymn",
        "hum",
        "chant",
        "carol",
        "choir",
        "croon",
        "cantillate",
        "solmizate",
        "vocalise",
        "warble",
        "yodel",
        "descant",
        "madrigal",
        "psalm",
        "snap",
        "belt",
        "bay",
        "mouse",
        "channel",
        "puddle",
        "reel",
        "down",
        "sling",
        "egg",
    ]
)
"""Words that the dictionary lists as kinds of another, but whose motion looks different."""
SENSES_TRIED = 1
"""Number of a word's most frequent senses that are used."""
DEEPEST = 3
"""Largest number of steps from a kind to its kind."""
CLASSES = (
    dict.fromkeys(("04", "11"), "n")
    | {"05": "m"}
    | dict.fromkeys(("06", "08", "10", "13", "17", "20", "27"), "o")
)
"""Letters of the table by lexicographers' files of nouns; all others are ``c``."""


def read_index(folder: Path, part: str) -> dict[str, list[str]]:
    """Map the words of a part of speech to the places of their senses, the most frequent first."""
    found = {}
    for line in (folder / f"index.{part}").read_text("latin-1").splitlines():
        if not line.startswith(" "):
            fields = line.split()
            found[fields[0]] = fields[-int(fields[2]) :]
    return found


def read_data(folder: Path, part: str) -> dict[str, tuple[str, list[str], list[str]]]:
    """Map places of senses to the lexicographer's file, the words, and the senses that they are
    kinds of."""
    found = {}
    for line in (folder / f"data.{part}").read_text("latin-1").splitlines():
        if line.startswith(" "):
            continue
        fields = line.split(" | ")[0].split()
        count = int(fields[3], 16)
        words = [word.lower() for word in fields[4 : 4 + 2 * count : 2]]
        at = 4 + 2 * count
        pointers = [fields[at + 1 + 4 * k : at + 5 + 4 * k] for k in range(int(fields[at]))]
        found[fields[0]] = (
            fields[1],
            words,
            [place for sign, place, kind, _ in pointers if sign in ("@", "@i") and kind == part[0]],
        )
    return found


def frequencies(folder: Path) -> Counter[tuple[str, str]]:
    """Return how often a word occurs as each part of speech ("1" noun, "2" verb, "3" and "5"
    adjective, "4" adverb)."""
    counts: Counter[tuple[str, str]] = Counter()
    for line in (folder / "cntlist.rev").read_text("latin-1").splitlines():
        key, _, count = line.split()
        word, _, rest = key.partition("%")
        counts[word, "3" if rest[0] == "5" else rest[0]] += int(count)
    return counts


def word_table(folder: Path) -> list[str]:
    """The lines of ``words.txt``."""
    counts = frequencies(folder)
    classes: dict[str, Counter[str]] = defaultdict(Counter)
    nouns, data = read_index(folder, "noun"), read_data(folder, "noun")
    parts = {"2": ("verb", "v"), "3": ("adj", "j"), "4": ("adv", "r"), "1": ("noun", "")}
    heads = {root(word) for word in VERBS}
    for digit, (part, letter) in parts.items():
        for word, places in (nouns if part == "noun" else read_index(folder, part)).items():
            if not word.isascii() or not word.isalpha() or not 2 <= len(word) <= 16:
                continue
            own = letter or CLASSES.get(data[places[0]][0], "c")
            classes[root(word)][own] += counts[word, digit] + 1
    lines = [
        f"{stem} {''.join(letter for letter, _ in letters.most_common(3))}"
        for stem, letters in classes.items()
    ]
    for word, places in nouns.items():
        halves = word.replace("-", "_").split("_")
        if (
            len(halves) == 2
            and all(half.isalpha() for half in halves)
            and CLASSES.get(data[places[0]][0]) == "n"
        ):
            pair = [root(half) for half in halves]
            if heads & set(pair):
                lines.append(f"{'_'.join(pair)} x")
    return sorted(set(lines))


def senses(folder: Path) -> list[dict[str, str]]:
    """The rows of ``senses.csv``."""
    rows: dict[str, tuple[int, str]] = {}
    for part, wanted in (("verb", VERBS), ("noun", ANIMALS)):
        index, data = read_index(folder, part), read_data(folder, part)
        targets = {index[word][sense - 1]: word for word, sense in wanted.items()}
        for word, places in index.items():
            if not word.isalpha() or word in wanted or word in MISLEADING:
                continue
            level, depth = list(places[:SENSES_TRIED]), 0
            while level and depth <= DEEPEST:
                hit = next((targets[place] for place in level if place in targets), None)
                if hit is not None:
                    if word not in rows or depth < rows[word][0]:
                        rows[word] = (depth, hit)
                    break
                level, depth = [above for place in level for above in data[place][2]], depth + 1
    return [
        {"word": word, "means": hit, "relation": "same" if depth == 0 else "kind"}
        for word, (depth, hit) in sorted(rows.items())
    ]


def main() -> None:
    """Write both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    lines, rows = word_table(folder), senses(folder)
    with atomic_path(WORDS) as path:
        path.write_bytes(gzip.compress("\n".join(lines).encode(), mtime=0))
    text = io.StringIO()
    writer = csv.DictWriter(text, ["word", "means", "relation"], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    with atomic_path(SENSES) as path:
        path.write_text(text.getvalue(), encoding="utf-8")
    print(f"{len(lines)} stems ({WORDS.stat().st_size / 1e3:.0f} kB), {len(rows)} senses")


if __name__ == "__main__":
    main()

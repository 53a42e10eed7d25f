"""Count the prompts that are understood: ``python -m benchmarks.words [--half development]
[--show]``.

``tests/motion/words.csv`` was written before the matcher that it measures, ``words_everyday.csv``
before that was changed the next time. A row holds a prompt, what a person would accept, and the
requested lengths. In `accepted`, ``|`` parts the steps of a prompt, ``;`` what is accepted for one
of them, `` / `` other ways to part it; ``*`` stands for any end of a name; ``refuse`` for a
refusal. A prompt is *servable* where every step has an accepted action that is shipped. It is

- *served*: every step is an accepted action, and the lengths are those of the row,
- *refused*: where a refusal is accepted or nothing that is accepted is shipped, this is right,
- *wrong*: anything else.

The development half may be looked at; of the held-out half only the counts are shown.
"""

from __future__ import annotations

import argparse
import csv
import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from a2v.errors import InputError
from a2v.motion.names import plain_name

TESTS = Path(__file__).parents[1] / "tests/motion"
HALVES = ("development", "held-out")
FILES = ("words.csv", "words_everyday.csv", "words_fresh.csv", "words_blind.csv")
MEANT = ("words_meant.csv", "words_meant_blind.csv", "words_later.csv", "words_last.csv")
"""Prompts with wishes, of three kinds, read as the commands read them: unknown parts are left out
and told. `FILES` are read strictly."""
TOLD = {
    "in place": ("in_place",), "speed": ("pace", "tempo"), "steps": ("distance",),
    "without": ("still", "without"),
}  # fmt: skip
"""Wishes of `MEANT`, and their names in `a2v.motion.wishes.Told` where they differ."""

Steps = Sequence[tuple[str, float | None]]
Resolver = Callable[[str], Steps]
"""Function from a prompt to the actions and seconds of its steps; it raises `InputError` for a
refusal."""


@dataclass(frozen=True)
class Row:
    """A prompt and what a person accepts for it."""

    prompt: str
    accepted: tuple[tuple[tuple[str, ...], ...], ...]
    seconds: tuple[float | None, ...]
    half: str

    @classmethod
    def of(cls, row: dict[str, str]) -> Row:
        """A row of the file."""
        ways = tuple(
            tuple(tuple(step.split(";")) for step in way.split("|"))
            for way in row["accepted"].split(" / ")
        )
        seconds = tuple(float(part) if part else None for part in row.get("seconds", "").split("|"))
        return cls(row["prompt"], ways, seconds, row.get("half", HALVES[0]))

    @property
    def may_refuse(self) -> bool:
        """Whether a refusal is accepted."""
        return any("refuse" in step for way in self.accepted for step in way)

    def servable(self, actions: Sequence[str]) -> bool:
        """Whether all of its accepted steps use only `actions`."""
        return any(
            all(any(_is(action, step) for action in actions) for step in way)
            for way in self.accepted
        )

    def serves(self, steps: Steps) -> bool:
        """Whether `steps` are what a person accepts."""
        lengths = self.seconds if any(self.seconds) else (None,) * len(steps)
        return any(
            len(way) == len(steps)
            and len(lengths) == len(steps)
            and all(
                _is(action, step) and seconds == length
                for (action, seconds), step, length in zip(steps, way, lengths, strict=True)
            )
            for way in self.accepted
        )


def _is(action: str, accepted: Sequence[str]) -> bool:
    """Return whether an action has one of the names."""
    return any(
        fnmatchcase(plain_name(action), "*".join(map(plain_name, name.split("*"))))
        for name in accepted
    )


def read_rows(name: str = "words.csv") -> list[Row]:
    """Read the prompts of a file of ``tests/motion``."""
    with (TESTS / name).open(newline="", encoding="utf-8") as stream:
        return [Row.of(row) for row in csv.DictReader(stream)]


def verdict(row: Row, resolve: Resolver, actions: Sequence[str]) -> tuple[str, str]:
    """Return the verdict ("served", "refused right", "refused" or "wrong") and the result."""
    try:
        steps = resolve(row.prompt)
    except InputError as error:
        return ("refused right" if row.may_refuse or not row.servable(actions) else "refused"), str(
            error
        )
    told = ", ".join(
        action + (f" for {seconds:g} s" if seconds is not None else "") for action, seconds in steps
    )
    return ("served" if row.serves(steps) else "wrong"), told


def count(
    rows: Sequence[Row], resolve: Resolver, actions: Sequence[str]
) -> tuple[Counter[str], list[tuple[str, str, str]]]:
    """Count the verdicts, and "servable": rows that are servable and need no refusal. Also return
    (verdict, prompt, answer) of the bad ones."""
    counts: Counter[str] = Counter()
    bad = []
    for row in rows:
        what, told = verdict(row, resolve, actions)
        counts[what] += 1
        if row.servable(actions) and not (row.may_refuse and what == "refused right"):
            counts["servable"] += 1
        if what in ("wrong", "refused"):
            bad.append((what, row.prompt, told))
    return counts, bad


def today(*, strict: bool = True) -> tuple[Resolver, list[str]]:
    """Return the commands' interpretation of prompts, and every available action."""
    from a2v.motion.catalog import catalog, understand

    def resolve(text: str) -> Steps:
        return [(step.action, step.seconds) for step in understand(text, strict=strict).steps]

    return resolve, [entry.name for entry in catalog().entries]


def untold(prompt: str, wishes: str) -> list[str]:
    """Return the wishes of a row of `MEANT` that are neither kept nor said not to be. A side is
    kept by an action that has it in its name, too."""
    from a2v.motion.catalog import understand

    try:
        found = understand(prompt)
    except InputError as error:
        return [] if "language" in str(error) else [*filter(None, wishes.split(";"))]
    told = {told.name for match in found.matches for told in match.told}
    names = " ".join(step.action for step in found.steps)
    missing = []
    for wish in filter(None, wishes.split(";")):
        kind, _, value = wish.partition("=")
        named = value in names if kind == "side" else kind == "in place" and kind in names
        if not told & set(TOLD.get(kind, (kind,))) and not named:
            missing.append(wish)
    return missing


def measure_meant(name: str, show: bool) -> None:
    """Print the counts of a file of `MEANT` by kind, and its wishes that are neither kept nor said."""
    resolve, actions = today(strict=False)
    with (TESTS / name).open(newline="", encoding="utf-8") as stream:
        raw = list(csv.DictReader(stream))
    for kind in dict.fromkeys(row["kind"] for row in raw):
        own = [row for row in raw if row["kind"] == kind]
        counts, bad = count([Row.of(row) for row in own], resolve, actions)
        wished = [wish for row in own for wish in filter(None, row["wishes"].split(";"))]
        lost = [
            (row["prompt"], wish) for row in own for wish in untold(row["prompt"], row["wishes"])
        ]
        print(
            f"{name}, {kind}: {len(own)} prompts, wrong {counts['wrong']}, served "
            f"{counts['served']} of {counts['servable']} servable; {len(wished)} wishes, "
            f"{len(lost)} neither kept nor said"
        )
        if show:
            print("\n".join(f"  {what}: {prompt!r} -> {told}" for what, prompt, told in bad))
            print("\n".join(f"  lost: {prompt!r}: {wish}" for prompt, wish in lost))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--half", choices=HALVES)
    parser.add_argument("--show", action="store_true", help="the bad ones of the development half")
    options = parser.parse_args()
    resolve, actions = today()
    halves = HALVES if options.half is None else (options.half,)
    for name, half in itertools.product(FILES, halves):
        rows = read_rows(name)
        own = [row for row in rows if row.half == half]
        if not own:
            continue
        counts, bad = count(own, resolve, actions)
        share = counts["served"] / max(counts["servable"], 1)
        print(
            f"{name}, {half}: {len(own)} prompts, wrong {counts['wrong']} "
            f"({counts['wrong'] / len(own):.1%}), served {counts['served']} of "
            f"{counts['servable']} servable ({share:.1%}), refused rightly "
            f"{counts['refused right']}"
        )
        if options.show and half == HALVES[0]:
            print("\n".join(f"  {what}: {prompt!r} -> {told}" for what, prompt, told in bad))
    for name in MEANT:
        measure_meant(name, options.show)
    first = read_rows("first_fifty.csv")
    print(
        f"of the {len(first)} that are tried first {count(first, resolve, actions)[0]['served']} "
        f"are served; {len(actions)} actions"
    )


if __name__ == "__main__":
    main()

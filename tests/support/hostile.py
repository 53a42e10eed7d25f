"""Hostile variants of good files, drawn by hypothesis; a reader gives a value or one sentence."""

from __future__ import annotations

import contextlib
import copy
import os
import re
import resource
import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from a2v.errors import A2VError, printable

SECONDS = 10.0
MEGABYTES = 1000.0
HANG = 60
"""Seconds by the clock after which a reader that has computed for less than `IDLE` meanwhile is
stopped: it waits for something that never comes."""
IDLE = 1.0


class Hang(BaseException):
    """A reader that does not come back; no reader catches this."""


@dataclass
class Tally:
    """Counts of the tried cases.

    They are cases, refusals, the slowest case's seconds, an upper bound of its memory, files that
    were written and checked, and people and videos that were deleted and searched for.
    """

    cases: int = 0
    refused: int = 0
    slowest: float = 0.0
    megabytes: float = 0.0
    files: int = 0
    deleted: int = 0

    def add(self, other: Tally) -> None:
        """Add the counts of another one."""
        self.cases, self.refused = self.cases + other.cases, self.refused + other.refused
        self.slowest, self.megabytes = (
            max(self.slowest, other.slowest),
            max(self.megabytes, other.megabytes),
        )
        self.files, self.deleted = self.files + other.files, self.deleted + other.deleted

    def sentence(self) -> str:
        """The counts in words."""
        return (
            f"{self.cases:,} hostile inputs: {self.refused:,} refused in a sentence, the slowest "
            f"took {self.slowest:.1f} s of processor time, none more than {self.megabytes:.0f} MB; "
            f"{self.files:,} files were written, all whole; {self.deleted:,} photos and videos "
            "were deleted, nothing of them left"
        )


COUNT = int(os.environ.get("A2V_FUZZ", "0"))
"""Number of cases per reader, set by `make fuzz`; 0 in the suite."""
FEW = COUNT // 4 or 10
"""Number of slow cases: whole command lines."""

TALLIES: dict[str, Tally] = {}
"""By the name of the test."""

NUMBERS = st.one_of(
    st.sampled_from(
        [
            0,
            -1,
            2**31,
            2**63,
            2**64,
            10**400,
            -(10**400),
            1e-6,
            1e-300,
            1e308,
            float("nan"),
            float("inf"),
            -float("inf"),
            True,
        ]
    ),
    st.integers(-100, 100),
    st.floats(-1e3, 1e3),
)
NESTED = (
    "{a: &a0 {x: 1}, "
    + ", ".join(f"b{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}" for i in range(1, 9))
    + "}"
)
YAML = [
    "<<: *a",
    "&a",
    "*a",
    "&a [*a, *a]",
    "{<<: {a: 1}}",
    NESTED,
    NESTED.replace("<<: ", "c: "),
    "1:1:1:1:1",
    "!!binary a",
    "? ",
]
"""Merge keys, anchors, aliases, tags."""
TEXTS = st.one_of(
    st.sampled_from(
        [
            "",
            "²",
            "\x1b[2J",
            "\ufeff",
            "a\nb",
            "a\0b",
            "ä",
            "\u202e",
            "{",
            "}",
            "[" * 50,
            "9" * 5000,
            "1e999",
            "\ud800",
            *YAML,
        ]
    ),
    st.text(max_size=8),
)
VALUES = st.recursive(
    st.one_of(st.none(), NUMBERS, TEXTS),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=4), inner, max_size=3)
    ),
    max_leaves=6,
)


def owes_a_sentence(read: Callable[[], object]) -> None:
    """Run a reader: it returns a value, or raises an error of a2v of one short line.

    It must do so soon and within a gigabyte.
    """
    _forget_peak()
    begun, said, before, peak = time.process_time(), "a value", _resident(), _peak()
    last = begun

    def look(number: int, frame: object) -> None:
        nonlocal last
        spent, last = time.process_time() - last, time.process_time()
        if spent < IDLE or last - begun > SECONDS:
            raise Hang(
                f"{last - begun:.1f} s of processor time, {spent:.1f} of them within the last "
                f"{HANG} s by the clock"
            )

    old = [(kind, signal.signal(kind, look)) for kind in (signal.SIGALRM, signal.SIGPROF)]
    signal.setitimer(signal.ITIMER_REAL, HANG, HANG)
    signal.setitimer(signal.ITIMER_PROF, SECONDS + IDLE)
    try:
        read()
    except A2VError as error:
        said = str(error)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        for kind, handler in old:
            signal.signal(kind, handler)
    seconds = time.process_time() - begun  # the machine may be busy
    highest = _peak()
    megabytes = (highest if highest > peak else _resident()) - before
    count(Tally(1, int(said != "a value"), seconds, megabytes))
    assert said
    assert "\n" not in said
    assert len(said) < 1500
    assert said == printable(said)
    assert seconds < SECONDS
    assert megabytes < MEGABYTES


def count(tally: Tally) -> None:
    """Add to the counts of the running test."""
    test = os.environ.get("PYTEST_CURRENT_TEST", "").split("::")[-1].split(" ")[0]
    TALLIES.setdefault(test, Tally()).add(tally)


def are_whole(folder: Path, names: str, read: Callable[[Path], object]) -> None:
    """Check that no file below `folder` is unfinished, and that `read` reads all `names`.

    `names` is a glob.
    """
    found = [path for path in folder.rglob("*") if path.is_file()]
    assert not [path for path in found if path.name.startswith(".") and "-a2v" in path.name]
    for path in folder.rglob(names):
        read(path)
    count(Tally(files=len(found)))


def _resident() -> float:
    """Megabytes of this process now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def _peak() -> float:
    """Most megabytes of this process since `_forget_peak`."""
    (line,) = re.findall(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return int(line) / 1024


def _forget_peak() -> None:
    """Reset the peak: an earlier test of this process may have used, and freed, gigabytes."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _paths(tree: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [at]
    if isinstance(tree, dict):
        for key, value in tree.items():
            found += _paths(value, (*at, key))
    elif isinstance(tree, list):
        for index in range(min(len(tree), 6)):
            found += _paths(tree[index], (*at, index))
    return found


@st.composite
def trees(draw: st.DrawFn, tree: Any) -> Any:
    """A JSON value like `tree` of which one to three parts were replaced or left out."""
    made = copy.deepcopy(tree)
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(_paths(made)))
        if not path:
            if draw(st.integers(0, 5)) == 0:
                return draw(VALUES)
            continue
        inside = made
        for step in path[:-1]:
            inside = inside[step]
        if draw(st.booleans()):
            inside[path[-1]] = draw(VALUES)
        else:
            del inside[path[-1]]
    return made


@st.composite
def edited(draw: st.DrawFn, data: bytes) -> bytes:
    """Bytes like `data`: a few places overwritten, cut out, doubled, or the end cut off."""
    made = bytearray(data)
    for _ in range(draw(st.integers(1, 5))):
        start = draw(st.integers(0, max(len(made) - 1, 0)))
        kind = draw(st.integers(0, 4))
        if kind == 0:
            made[start : start + 4] = draw(st.binary(min_size=1, max_size=8))
        elif kind == 1:
            del made[start : start + draw(st.integers(1, 40))]
        elif kind == 2:
            made[start:start] = made[start : start + draw(st.integers(1, 200))]
        elif kind == 3:
            del made[start:]
        elif made:
            made[start] ^= 1 << draw(st.integers(0, 7))
    return bytes(made)


@st.composite
def retold(draw: st.DrawFn, text: str) -> str:
    """Text like `text` of which a few words were replaced, lines doubled or taken away."""
    lines = text.split("\n")
    for _ in range(draw(st.integers(1, 4))):
        index = draw(st.integers(0, len(lines) - 1))
        kind = draw(st.integers(0, 3))
        words = lines[index].split(" ")
        if kind < 2:
            words[draw(st.integers(0, len(words) - 1))] = draw(
                st.one_of(
                    TEXTS, NUMBERS.map(lambda n: str(n) if abs(n) != 10**400 else "1" + "0" * 400)
                )
            )
            lines[index] = " ".join(words)
        elif kind == 2:
            lines.insert(index, lines[index])
        elif len(lines) > 1:
            del lines[index]
    return "\n".join(lines)


@st.composite
def bundles(draw: st.DrawFn, good: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Named arrays like `good`, of which one to three are changed or missing.

    A changed one has another type, shape or text.
    """
    made = dict(good)
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(sorted(good)))
        if draw(st.integers(0, 4)) == 0:
            made.pop(name, None)
            continue
        if draw(st.integers(0, 2)) == 0:
            made[name] = np.asarray(draw(st.one_of(TEXTS, VALUES.map(repr))).replace("\0", ""))
            continue
        dtype = draw(
            st.sampled_from(
                ["f4", "f8", "i4", "i8", "u1", "u8", "?", "U4", "S3", "c8", "M8[s]", "f2"]
            )
        )
        shape = (
            good[name].shape
            if draw(st.booleans())
            else draw(arrays.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4))
        )
        made[name] = draw(arrays.arrays(dtype, shape))
    return made

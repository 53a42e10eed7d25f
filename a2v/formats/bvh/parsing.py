"""Parse a BVH file to a tree of joints and a table of numbers; every error names its line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from a2v.errors import InputError
from a2v.formats.conventions import Bone
from a2v.kinematics.resample import MAX_JOINT_FRAMES
from a2v.types import FloatArray

MAX_JOINTS = 1000
MAX_NUMBERS = 60_000_000
MAX_VALUE = 1e6

ROTATION_AXES = {"Xrotation": 0, "Yrotation": 1, "Zrotation": 2}
POSITION_AXES = {"Xposition": 0, "Yposition": 1, "Zposition": 2}

_NUMBERS = re.compile(r"\s*(OFFSET\s|Frame Time\s*:|[-+.,\d])", re.IGNORECASE)
"""Start of a line that holds numbers."""
_COMMA = re.compile(r"(?<=\d),(?=\d)")
_JOINED = re.compile(r"(?<=[\d.])-(?=[\d.])")

_Fail = Callable[[int, str], InputError]


@dataclass
class Node(Bone):
    """A joint of the file.

    Attributes
    ----------
    offset : list of 3 float or None
        The file's units.
    channels : list of str or None
        Such as ``Xposition`` and ``Zrotation``, in the file's order.
    first : int
        Column of the first channel.
    end : bool
        An End Site.
    """

    offset: list[float] | None = None
    channels: list[str] | None = None
    first: int = 0
    end: bool = False


@dataclass(frozen=True)
class BvhFile:
    """A parsed file.

    Attributes
    ----------
    source : str
        Name of the file in messages.
    nodes : list of Node
    frame_time : float
        Seconds.
    values : (T, C) float64
        Degrees and the file's units, one column per channel.
    notes : tuple of str
        What was read although the format forbids it, a sentence each.
    """

    source: str
    nodes: list[Node]
    frame_time: float
    values: FloatArray
    notes: tuple[str, ...] = ()


def parse_bvh(text: str, source: str) -> BvhFile:
    """Parse a file's text; `source` is its name in messages.

    As in Blender, decimal commas, numbers without a space before a minus sign, frames wrapped over
    lines and a number of frames that differs from the announced one are read; `BvhFile.notes` lists
    them.

    Raises
    ------
    InputError
        The text is empty, truncated, inconsistent, not finite or of absurd size; the message names
        the line.
    """

    def fail(line: int, what: str) -> InputError:
        return InputError(f"{source}:{line}: {what}")

    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if not text.strip():
        raise fail(1, "the file is empty; expected a BVH file that starts with HIERARCHY")
    notes = _mend_numbers(lines, text)
    hierarchy = _Hierarchy(fail)
    row = hierarchy.read(lines)
    table = _Table(lines, hierarchy.columns, len(hierarchy.nodes), fail, notes)
    frame_time, values = table.read(row)
    return BvhFile(source, hierarchy.nodes, frame_time, values, tuple(notes))


def _mend_numbers(lines: list[str], text: str) -> list[str]:
    """Write the numbers in `lines` (changed in place) with a point and with a space before a minus
    sign; return notes. Commas stay if any number has a point."""
    commas, joined = "," in text, _JOINED.search(text) is not None
    if not (commas or joined):
        return []
    rows = [i for i, line in enumerate(lines) if _NUMBERS.match(line)]
    commas = commas and not any("." in lines[i] for i in rows)
    notes = []
    for wanted, pattern, by, note in (
        (commas, _COMMA, ".", "decimal commas were read as points"),
        (joined, _JOINED, " -", "numbers without a space before a minus sign were separated"),
    ):
        count = 0
        for i in rows if wanted else ():
            lines[i], changed = pattern.subn(by, lines[i])
            count += changed
        if count:
            notes.append(note)
    return notes


@dataclass
class _Hierarchy:
    """The part of the hierarchy that has been read so far, from the lines between HIERARCHY and
    MOTION."""

    fail: _Fail
    nodes: list[Node] = field(default_factory=list)
    columns: int = 0
    _open: list[int] = field(default_factory=list)
    _pending: int | None = None  # the joint whose "{" has not been read yet

    def read(self, lines: Sequence[str]) -> int:
        """Read up to the line MOTION; return its number, from 1."""
        keywords = {
            "{": self._enter,
            "}": self._leave,
            "OFFSET": self._offset,
            "CHANNELS": self._channels,
        }
        begun, number = False, 0
        for number, raw in enumerate(lines, start=1):
            words = raw.split()
            if not words:
                continue
            key = words[0].upper()
            if not begun:
                if key.lstrip("\ufeff") != "HIERARCHY":
                    raise self.fail(
                        number,
                        f"expected HIERARCHY, found '{raw.strip()[:40]}'; is this a BVH file?",
                    )
                begun = True
            elif key == "MOTION":
                break
            elif key in ("ROOT", "JOINT") or (
                key == "END" and len(words) > 1 and words[1].upper() == "SITE"
            ):
                self._joint(number, words)
            elif key in keywords:
                keywords[key](number, words)
            else:
                raise self.fail(number, f"unexpected '{raw.strip()[:40]}' in the hierarchy")
        else:
            raise self.fail(
                number, "the file ends inside the hierarchy: no MOTION section; it is truncated"
            )
        self._demand_whole(number)
        return number

    def _demand_whole(self, number: int) -> None:
        if self._open or self._pending is not None:
            name = self.nodes[self._open[-1] if self._open else self._pending or 0].name
            raise self.fail(number, f"MOTION inside of joint '{name}': a '}}' is missing")
        if not self.nodes:
            raise self.fail(number, "no ROOT joint")
        if self.columns == 0:
            raise self.fail(number, "no joint has channels: nothing moves")

    def _joint(self, number: int, words: list[str]) -> None:
        key = words[0].upper()
        if self._pending is not None:
            raise self.fail(
                number,
                f"expected '{{' after joint '{self.nodes[self._pending].name}', found '{words[0]}'",
            )
        if key == "ROOT" and self.nodes:
            raise self.fail(
                number, "a second ROOT; files with several people are not read: split it"
            )
        if key != "ROOT" and not self._open:
            raise self.fail(number, f"{words[0]} outside of any joint")
        parent = self._open[-1] if self._open else -1
        name = f"{self.nodes[parent].name}_end" if key == "END" else " ".join(words[1:])
        if not name:
            raise self.fail(number, f"{words[0]} without a name")
        if len(self.nodes) >= MAX_JOINTS:
            raise self.fail(number, f"more than {MAX_JOINTS} joints")
        self.nodes.append(Node(name, parent, number, end=key == "END"))
        self._pending = len(self.nodes) - 1
        if words[-1] == "{":
            self.nodes[-1].name = self.nodes[-1].name.removesuffix("{").strip()
            self._enter(number, words)

    def _enter(self, number: int, _: list[str]) -> None:
        if self._pending is None:
            raise self.fail(number, "'{' without a joint before it")
        self._open.append(self._pending)
        self._pending = None

    def _leave(self, number: int, _: list[str]) -> None:
        if not self._open:
            raise self.fail(number, "'}' without a matching '{'")
        node = self.nodes[self._open.pop()]
        if node.offset is None:
            raise self.fail(number, f"joint '{node.name}' (line {node.line}) has no OFFSET")
        if node.channels is None and not node.end:
            node.channels = []

    def _offset(self, number: int, words: list[str]) -> None:
        if not self._open:
            raise self.fail(number, "OFFSET outside of any joint")
        node = self.nodes[self._open[-1]]
        node.offset = _floats(words[1:], 3, self.fail, number, f"OFFSET of '{node.name}'")

    def _channels(self, number: int, words: list[str]) -> None:
        if not self._open:
            raise self.fail(number, "CHANNELS outside of any joint")
        names = [word[:1].upper() + word[1:].lower() for word in words[2:]]
        if len(words) < 2 or not (
            words[1].isdecimal() and len(words[1]) < 5 and int(words[1]) == len(names)
        ):
            raise self.fail(
                number,
                f"CHANNELS says {words[1] if len(words) > 1 else 'nothing'} but lists {len(names)} "
                "channels",
            )
        if unknown := [
            name for name in names if name not in ROTATION_AXES and name not in POSITION_AXES
        ]:
            raise self.fail(
                number, f"unknown channel '{unknown[0]}'; expected Xposition ... Zrotation"
            )
        if len(set(names)) < len(names):
            raise self.fail(number, "a channel is listed twice")
        node = self.nodes[self._open[-1]]
        if node.channels is not None:
            raise self.fail(number, f"joint '{node.name}' has CHANNELS twice")
        node.channels, node.first = names, self.columns
        self.columns += len(names)


@dataclass(frozen=True)
class _Table:
    """The part after the line MOTION: `count` channels of `joints` joints per frame."""

    lines: Sequence[str]
    count: int
    joints: int
    fail: _Fail
    notes: list[str]

    def read(self, row: int) -> tuple[float, FloatArray]:
        """Parse the seconds per frame and the table (T, count); MOTION is line `row`."""
        frames, frame_time, row = self._head(row)
        self._demand_size(frames, row)
        numbers = [i for i in range(row, len(self.lines)) if self.lines[i].strip()]
        if not numbers:
            raise self.fail(
                len(self.lines),
                f"no frames after the header that announces {frames}; the file is truncated",
            )
        rows: list[FloatArray] = []
        total = 0
        for i in numbers:
            rows.append(self._numbers(i))
            total += len(rows[-1])
            if total > frames * self.count:
                self._demand_size(-(-total // self.count), i + 1)
        uneven = [i for i, values in zip(numbers, rows, strict=True) if len(values) != self.count]
        if uneven and total == frames * self.count:
            self.notes.append("frames that are wrapped over several lines were joined")
            return frame_time, np.concatenate(rows).reshape(-1, self.count)
        if uneven:
            found = len(rows[numbers.index(uneven[0])])
            last = uneven[0] == numbers[-1] and found < self.count
            raise self.fail(
                uneven[0] + 1,
                f"{found} numbers for {self.count} channels"
                + ("; the file is truncated" if last else ""),
            )
        if len(rows) != frames:
            self.notes.append(
                f"the file announces {frames} frames and has {len(rows)}: all are read"
            )
        return frame_time, np.stack(rows)

    def _head(self, row: int) -> tuple[int, float, int]:
        """Parse the number of frames, the seconds per frame and the first line of the table."""
        head: dict[str, float] = {}
        while row < len(self.lines) and len(head) < 2:
            raw = self.lines[row].strip()
            row += 1
            if not raw:
                continue
            found = re.match(r"^(Frames|Frame Time)\s*:\s*(\S*)$", raw, flags=re.IGNORECASE)
            if not found:
                raise self.fail(row, f"expected 'Frames:' and 'Frame Time:', found '{raw[:40]}'")
            try:
                head[found.group(1).lower()] = float(found.group(2))
            except ValueError:
                raise self.fail(row, f"'{found.group(2)}' is no number") from None
        if len(head) < 2:
            raise self.fail(
                len(self.lines),
                "the file ends before 'Frames:' and 'Frame Time:'; it is truncated",
            )
        frames, frame_time = head["frames"], head["frame time"]
        if not (math.isfinite(frames) and frames == int(frames) and frames >= 1):
            raise self.fail(row, f"the file says it has {frames:g} frames; expected at least 1")
        if not (math.isfinite(frame_time) and 1e-4 <= frame_time <= 10):
            raise self.fail(row, f"Frame Time is {frame_time:g} s; expected 0.0001 to 10")
        return int(frames), frame_time, row

    def _demand_size(self, frames: int, line: int) -> None:
        for each, what, most, things in (
            (self.count, "channels", MAX_NUMBERS, "numbers"),
            (self.joints, "joints", MAX_JOINT_FRAMES, "positions"),
        ):
            if frames * each > most:
                raise self.fail(
                    line,
                    f"{frames:g} frames of {each} {what} are more than {most:,} {things}: cut or "
                    "subsample the file",
                )

    def _numbers(self, row: int) -> FloatArray:
        """Parse the numbers of a line."""
        words = self.lines[row].split()
        try:
            values = np.array(words, dtype=np.float64)
        except ValueError:
            bad = next(word for word in words if not _is_number(word))
            hint = "; expected numbers separated by spaces" if "," in bad else ""
            raise self.fail(row + 1, f"'{bad[:20]}' is no number{hint}") from None
        if not np.isfinite(values).all():
            raise self.fail(
                row + 1,
                f"NaN or infinite number in channel {int(np.argmin(np.isfinite(values))) + 1}",
            )
        if np.abs(values).max() > MAX_VALUE:
            raise self.fail(
                row + 1, f"a value of {np.abs(values).max():.3g} is absurd for a motion"
            )
        return values


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _floats(words: Sequence[str], count: int, fail: _Fail, line: int, what: str) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError:
        raise fail(line, f"{what}: '{' '.join(words)[:40]}' are no numbers") from None
    if len(values) != count:
        raise fail(line, f"{what} has {len(values)} numbers; expected {count}")
    if not all(math.isfinite(value) for value in values):
        raise fail(line, f"{what} holds NaN or infinite numbers")
    if max(map(abs, values)) > MAX_VALUE:
        raise fail(line, f"{what} is {max(map(abs, values)):.3g} long: absurd for a skeleton")
    return values

"""Parse a BVH file to a tree of joints and a table of numbers; every error names its line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.resample import MAX_JOINT_FRAMES
from a2v.types import FloatArray

MAX_JOINTS = 1000
MAX_NUMBERS = 60_000_000
MAX_VALUE = 1e6

ROTATION_AXES = {"Xrotation": 0, "Yrotation": 1, "Zrotation": 2}
POSITION_AXES = {"Xposition": 0, "Yposition": 1, "Zposition": 2}

_Fail = Callable[[int, str], InputError]


@dataclass
class Node:
    """A joint of the file.

    Attributes
    ----------
    name : str
    parent : int
        -1 for the root; parents come first.
    line : int
        Of the file, from 1.
    offset : list of 3 float or None
        The file's units.
    channels : list of str or None
        Such as ``Xposition`` and ``Zrotation``, in the file's order.
    first : int
        Column of the first channel.
    end : bool
        An End Site.
    """

    name: str
    parent: int
    line: int
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
    dropped : bool
        Whether a first frame in the rest pose was left out.
    """

    source: str
    nodes: list[Node]
    frame_time: float
    values: FloatArray
    dropped: bool


def parse_bvh(text: str, source: str) -> BvhFile:
    """Parse a file's text; `source` is its name in messages.

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
    hierarchy = _Hierarchy(fail)
    row = hierarchy.read(lines)
    frame_time, values = _parse_motion(lines, row, hierarchy.columns, len(hierarchy.nodes), fail)
    values, dropped = _without_rest_frame(values, hierarchy.nodes)
    return BvhFile(source, hierarchy.nodes, frame_time, values, dropped)


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


def _without_rest_frame(values: FloatArray, nodes: Sequence[Node]) -> tuple[FloatArray, bool]:
    """Drop the first frame if it is the rest pose; return the table and whether it was dropped.
    CMU's conversions start with a T-pose."""
    columns = [
        node.first + place
        for node in nodes
        for place, name in enumerate(node.channels or ())
        if name in ROTATION_AXES
    ]
    if len(values) > 2 and columns:  # nearly all zeros, and a jump to the next frame
        steps = np.abs((np.diff(values[:3, columns], axis=0) + 180) % 360 - 180).max(axis=1)
        if (values[0, columns] == 0).mean() > 0.8 and steps[0] > max(25.0, 4 * steps[1]):
            return values[1:], True
    return values, False


def _parse_motion(
    lines: list[str], row: int, count: int, joints: int, fail: _Fail
) -> tuple[float, FloatArray]:
    """Parse the seconds per frame and the table (T, count) of `joints` joints after the line
    MOTION, which is line `row`."""
    head: dict[str, float] = {}
    while row < len(lines) and len(head) < 2:
        raw = lines[row].strip()
        row += 1
        if not raw:
            continue
        found = re.match(r"^(Frames|Frame Time)\s*:\s*(\S*)$", raw, flags=re.IGNORECASE)
        if not found:
            raise fail(row, f"expected 'Frames:' and 'Frame Time:', found '{raw[:40]}'")
        try:
            head[found.group(1).lower()] = float(found.group(2))
        except ValueError:
            raise fail(row, f"'{found.group(2)}' is no number") from None
    if len(head) < 2:
        raise fail(len(lines), "the file ends before 'Frames:' and 'Frame Time:'; it is truncated")
    frames, frame_time = head["frames"], head["frame time"]
    if not (math.isfinite(frames) and frames == int(frames) and frames >= 1):
        raise fail(row, f"the file says it has {frames:g} frames; expected at least 1")
    if not (math.isfinite(frame_time) and 1e-4 <= frame_time <= 10):
        raise fail(row, f"Frame Time is {frame_time:g} s; expected 0.0001 to 10")
    if frames * count > MAX_NUMBERS:
        raise fail(
            row,
            f"{frames:g} frames of {count} channels are more than {MAX_NUMBERS:,} numbers: cut or "
            "subsample the file",
        )
    if frames * joints > MAX_JOINT_FRAMES:
        raise fail(
            row,
            f"{frames:g} frames of {joints} joints are more than {MAX_JOINT_FRAMES:,} positions: "
            "cut or subsample the file",
        )
    numbers = [i for i in range(row, len(lines)) if lines[i].strip()]
    rows: list[FloatArray] = []
    for i in numbers:
        words = lines[i].split()
        try:
            values = np.array(words, dtype=np.float64)
        except ValueError:
            bad = next(word for word in words if not _is_number(word))
            raise fail(i + 1, f"'{bad[:20]}' is no number") from None
        if len(values) != count:
            last = i == numbers[-1] and len(values) < count
            raise fail(
                i + 1,
                f"{len(values)} numbers for {count} channels"
                + ("; the file is truncated" if last else ""),
            )
        if not np.isfinite(values).all():
            raise fail(
                i + 1,
                f"NaN or infinite number in channel {int(np.argmin(np.isfinite(values))) + 1}",
            )
        if np.abs(values).max() > MAX_VALUE:
            raise fail(i + 1, f"a value of {np.abs(values).max():.3g} is absurd for a motion")
        rows.append(values)
    if not rows:
        raise fail(
            len(lines),
            f"no frames after the header that announces {frames:g}; the file is truncated",
        )
    if len(rows) != frames:
        more = "more" if len(rows) > frames else "fewer"
        raise fail(
            numbers[-1] + 1,
            f"{len(rows)} frames, {more} than the {frames:g} announced"
            + ("; it is truncated" if more == "fewer" else ""),
        )
    return frame_time, np.stack(rows)


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

"""CMU's clips labeled by the data base's own index: 123 fine actions instead of the
papers' eight.

``cmu_fine.csv`` is curated by hand: it maps an index description to fine action, direction and
style. Clips of a row without an action are left out, because they show several actions or none.
``cmu_fine_clips.csv`` lists clips that are copies of others, and the parts of a clip that show its
action.

The papers' set took every tenth frame of all clips, also of the 56 clips that the index lists with
60 instead of 120 frames per second. So these have twice their speed there (jumps fall with 39
m/s^2). Here they have their true speed, resampled from 6 to 12 Hz. Both feet of every person stand
at the same height (`a2v.lab.datasets.floors`).
"""

from __future__ import annotations

import csv
import dataclasses
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.resample import frames_made, resample_at
from a2v.lab.datasets.base import ActionDataset, Clip
from a2v.lab.datasets.cmu import ACTIONS, load_cmu
from a2v.lab.datasets.files import FileSource, find_source
from a2v.lab.datasets.floors import level_feet
from a2v.types import FloatArray, Motion

INDEX = "cmu_index_with_framerate.csv"
TABLE = Path(__file__).parent / "cmu_fine.csv"
PARTS = Path(__file__).parent / "cmu_fine_clips.csv"

USUAL_FPS = 120.0
"""Frames per second of recordings whose every tenth frame gives 12 Hz."""


class Meaning(NamedTuple):
    """Meaning of a description of the index.

    Attributes
    ----------
    action : str
        Name of the fine action; "" for clips that are left out.
    coarse : str
        The papers' action.
    direction, style : str
        "forward", "left"..., "sad", "crouched"...; "" for none.
    """

    action: str
    coarse: str
    direction: str
    style: str

    @property
    def traits(self) -> tuple[str, ...]:
        """Return its traits that other actions may share, such as ``("coarse:Walk",
        "direction:backward")``."""
        pairs = (("coarse", self.coarse), ("direction", self.direction), ("style", self.style))
        return tuple(f"{kind}:{value}" for kind, value in pairs if value)


@cache
def fine_table() -> Mapping[tuple[str, str], Meaning]:
    """Return the curated table from (the papers' action, description in lower case) to its
    meaning."""
    with TABLE.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {
        (row["coarse"], row["description"]): Meaning(
            row["action"], row["coarse"], row["direction"], row["style"]
        )
        for row in rows
    }


class Entry(NamedTuple):
    """The index entry of a clip: its description in lower case, and frames per second."""

    text: str
    fps: float


class Part(NamedTuple):
    """Curated facts on a clip that are not in the index.

    Attributes
    ----------
    described_as : str
        The clip that it is a copy of; "" for none.
    action : str
        Action by measurement, "-" if the clip is left out; "" for the action of the index.
    fps : float or None
        Frame rate of the recording, if the index is wrong.
    first, last : int or None
        The frames at 12 Hz, from `first` to `last` (exclusive), that show its action.
    """

    described_as: str = ""
    action: str = ""
    fps: float | None = None
    first: int | None = None
    last: int | None = None


@cache
def clip_parts() -> Mapping[str, tuple[Part, ...]]:
    """Return the curated parts by clip; other clips are used whole."""
    with PARTS.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    found: dict[str, list[Part]] = {}
    for row in rows:
        first, last = (int(row[name]) if row[name] else None for name in ("first", "last"))
        part = Part(
            row["described_as"],
            row["action"],
            float(row["fps"]) if row["fps"] else None,
            first,
            last,
        )
        found.setdefault(row["clip"], []).append(part)
    return {clip: tuple(parts) for clip, parts in found.items()}


def load_cmu_fine(path: str | Path) -> ActionDataset:
    """Load the clips of `load_cmu` with the fine actions of `fine_table`, at their true speed and
    with level feet.

    Actions are in the order of the papers' actions, within each by frequency. A clip with several
    parts has as many entries, "01_02", "01_02/2"...; see `recording_of`.

    Raises
    ------
    InputError
        As for `load_cmu`; or the index is missing, or has a description that is not in the table.
    """
    whole = load_cmu(path)
    described = _read_index(find_source(path, archive="cmu_mocap.zip", marker="pose_clip.csv"))
    clips, meanings, texts = _clips(whole, described)
    counts = Counter(meaning.action for meaning in meanings)
    family = {meaning.action: ACTIONS.index(meaning.coarse) for meaning in reversed(meanings)}
    actions = tuple(sorted(counts, key=lambda action: (family[action], -counts[action], action)))
    own = {
        action: [index for index, meaning in enumerate(meanings) if meaning.action == action]
        for action in actions
    }
    left_out = len(whole) - len({recording_of(clip.name) for clip in clips})
    return ActionDataset.from_clips(
        [
            dataclasses.replace(clip, action=actions.index(meaning.action))
            for clip, meaning in zip(clips, meanings, strict=True)
        ],
        name="cmu-fine",
        skeleton=whole.skeleton,
        actions=actions,
        fps=whole.fps,
        length=whole.length,
        frame=whole.frame,
        traits=tuple(_shared([meanings[index] for index in own[action]]) for action in actions),
        descriptions=tuple(
            tuple(sorted({texts[index] for index in own[action]})) for action in actions
        ),
        notes=(*whole.notes, f"{left_out} clips that are many things at once or none are left out"),
    )


def recording_of(clip_name: str) -> str:
    """Return the recording of an entry of `load_cmu_fine`: "01_02" for "01_02/2"."""
    return clip_name.split("/")[0]


def _clips(
    whole: ActionDataset, described: Mapping[str, Entry]
) -> tuple[list[Clip], list[Meaning], list[str]]:
    """Return the parts of all clips with a meaning, at their true speed and with level feet, with
    meanings and descriptions."""
    labels = dict(zip(whole.clip_names, whole.labels.tolist(), strict=True))
    meters, kept = np.float32(whole.frame.meters_per_unit), []
    for index, name in enumerate(whole.clip_names):
        parts = clip_parts().get(name, (Part(),))
        source = parts[0].described_as or name
        text, coarse = (
            described.get(source, Entry("", 0)).text,
            ACTIONS[labels.get(source, labels[name])],
        )
        meaning = fine_table().get((coarse, text))
        if meaning is None:
            raise InputError(
                f"clip {name} ({coarse}) is described as '{text}', which {TABLE.name} does not "
                "know; add a row to it"
            )
        if parts[0].action:
            meaning = _meaning_of(parts[0].action)
        if meaning.action:
            kept.append((index, meaning, text, parts))
    rates = [
        whole.fps * (parts[0].fps or described[whole.clip_names[index]].fps) / USUAL_FPS
        for index, _, _, parts in kept
    ]
    levelled = level_feet(
        [whole.joints[index] * meters for index, *_ in kept],
        [whole.subjects[index] for index, *_ in kept],
        whole.skeleton,
        rates,
    )
    clips, meanings, texts = [], [], []
    for (index, meaning, text, parts), joints, rate in zip(kept, levelled, rates, strict=True):
        timed = joints if rate == whole.fps else _at_rate(whole, index, joints, rate)
        for number, part in enumerate(parts, 1):
            name = whole.clip_names[index] + (f"/{number}" if number > 1 else "")
            clips.append(
                Clip(
                    joints=timed[part.first : part.last] / meters,
                    action=0,
                    name=name,
                    subject=whole.subjects[index],
                )
            )
            meanings.append(meaning)
            texts.append(text)
    return clips, meanings, texts


def _meaning_of(action: str) -> Meaning:
    """Return the first meaning of the table with this action; none for "-"."""
    return next(
        (meaning for meaning in fine_table().values() if meaning.action == action),
        Meaning("", "", "", ""),
    )


def _at_rate(whole: ActionDataset, index: int, joints: FloatArray, rate: float) -> FloatArray:
    """Resample joints (T, J, 3) of clip `index` from `rate` to the set's rate, by cubic splines of
    its rotations (bones keep their lengths)."""
    motion: Motion = dataclasses.replace(whole.motion(index), joints=joints, root=joints[:, 0])
    at = np.arange(frames_made(len(joints), rate, whole.fps)) * (rate / whole.fps)
    return resample_at(motion, np.minimum(at, len(joints) - 1)).joints


def _shared(meanings: Sequence[Meaning]) -> tuple[str, ...]:
    """Return the traits of at least half of an action's clips."""
    found = Counter(trait for meaning in meanings for trait in meaning.traits)
    return tuple(trait for trait, count in found.items() if 2 * count >= len(meanings))


def _read_index(source: FileSource) -> dict[str, Entry]:
    """Read the entries of the database's index, by clip name."""
    names = source.names(INDEX)
    if not names:
        raise InputError(f"{source.path} holds no {INDEX}; the fine actions are made from it")
    rows = csv.reader(io.StringIO(source.read(names[0]).decode("latin-1")))
    entries = [row for row in rows if len(row) > 3 and row[0].isdecimal() and row[1].isdecimal()]
    return {
        f"{int(subject):02d}_{int(trial):02d}": Entry(
            text.strip().lower(), float(rate) if rate.strip().isdecimal() else USUAL_FPS
        )
        for subject, trial, text, rate, *_ in entries
    }

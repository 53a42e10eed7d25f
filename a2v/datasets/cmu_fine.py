"""CMU's clips under what the data base's own index says of them: 124 fine actions instead of the papers' eight.

``cmu_fine.csv`` is curated by hand: what the index says of a clip -> fine action, direction, style. A row without an action
leaves its clips out, since they are many things at once or none.
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

from a2v.datasets.base import ActionDataset, FileSource, find_source
from a2v.datasets.cmu import ACTIONS, load_cmu
from a2v.errors import InputError

INDEX = "cmu_index_with_framerate.csv"
TABLE = Path(__file__).parent / "cmu_fine.csv"


class Meaning(NamedTuple):
    """What a description of the index means.

    Attributes
    ----------
    action : str
        Name of the fine action; "" for clips that are left out.
    coarse : str
        The papers' action.
    direction, style : str
        "forward", "left"..., "sad", "crouched"...; "" where there is none.
    """

    action: str
    coarse: str
    direction: str
    style: str

    @property
    def traits(self) -> tuple[str, ...]:
        """What it shares with other actions, such as ``("coarse:Walk", "direction:backward")``."""
        pairs = (("coarse", self.coarse), ("direction", self.direction), ("style", self.style))
        return tuple(f"{kind}:{value}" for kind, value in pairs if value)


@cache
def fine_table() -> Mapping[tuple[str, str], Meaning]:
    """The curated table: (the papers' action, description in small letters) to what it means."""
    with TABLE.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {(row["coarse"], row["description"]): Meaning(row["action"], row["coarse"], row["direction"], row["style"]) for row in rows}


def load_cmu_fine(path: str | Path) -> ActionDataset:
    """The clips of `load_cmu` under the fine actions of `fine_table`, the most frequent of each of the papers' actions first.

    Raises
    ------
    InputError
        As `load_cmu`; or the index is missing, or describes a clip in a way that the table does not know.
    """
    whole = load_cmu(path)
    described = _read_index(find_source(path, archive="cmu_mocap.zip", marker="pose_clip.csv"))
    meanings, texts = [], []
    for name, label in zip(whole.clip_names, whole.labels, strict=True):
        text = described.get(name, "")
        meaning = fine_table().get((ACTIONS[int(label)], text))
        if meaning is None:
            raise InputError(f"clip {name} ({ACTIONS[int(label)]}) is described as '{text}', which {TABLE.name} does not know; add a row to it")
        meanings.append(meaning)
        texts.append(text)
    kept = [index for index, meaning in enumerate(meanings) if meaning.action]
    counts = Counter(meanings[index].action for index in kept)
    family = {meaning.action: ACTIONS.index(meaning.coarse) for meaning in reversed(meanings)}
    actions = tuple(sorted(counts, key=lambda action: (family[action], -counts[action], action)))
    own = {action: [index for index in kept if meanings[index].action == action] for action in actions}
    return dataclasses.replace(
        whole.subset(kept),
        name="cmu-fine",
        actions=actions,
        labels=np.array([actions.index(meanings[index].action) for index in kept], dtype=np.int64),
        traits=tuple(_shared([meanings[index] for index in own[action]]) for action in actions),
        descriptions=tuple(tuple(sorted({texts[index] for index in own[action]})) for action in actions),
        notes=(*whole.notes, f"{len(whole) - len(kept)} clips that are many things at once or none are left out"),
    )


def _shared(meanings: Sequence[Meaning]) -> tuple[str, ...]:
    """What at least half of an action's clips have."""
    found = Counter(trait for meaning in meanings for trait in meaning.traits)
    return tuple(trait for trait, count in found.items() if 2 * count >= len(meanings))


def _read_index(source: FileSource) -> dict[str, str]:
    """Clip name to its description in the data base's index, in small letters."""
    names = source.names(INDEX)
    if not names:
        raise InputError(f"{source.path} holds no {INDEX}; the fine actions are made from it")
    rows = csv.reader(io.StringIO(source.read(names[0]).decode("latin-1")))
    entries = [row for row in rows if len(row) > 2 and row[0].isdecimal() and row[1].isdecimal()]
    return {f"{int(subject):02d}_{int(trial):02d}": text.strip().lower() for subject, trial, text, *_ in entries}

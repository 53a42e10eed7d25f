"""Read the whole CMU database: 2,435 recordings at 120 or 60 Hz, as ASF and AMC or as BVH, under
curated actions.

The index entry of a recording becomes an action by the table of `cmu_fine`, else by the first
rule of ``cmu_full.csv`` whose pattern is found in it; rules without an action leave recordings out.
Joints are brought to the papers' twenty at 30 Hz.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import re
from collections import Counter
from functools import cache
from pathlib import Path, PurePosixPath

import numpy as np

from a2v.errors import InputError
from a2v.formats.asf_amc import read_amc
from a2v.formats.bvh import read_bvh
from a2v.kinematics import CMU
from a2v.kinematics.resample import resample_motion
from a2v.lab.datasets.base import ActionDataset, Clip
from a2v.lab.datasets.cmu import FRAME
from a2v.lab.datasets.cmu_fine import INDEX, fine_table
from a2v.lab.datasets.files import FileSource, find_source
from a2v.motion.applications import on_skeleton
from a2v.types import Motion, Progress

RULES = Path(__file__).with_name("cmu_full.csv")
FPS = 30.0
"""Rate of the clips, frames per second."""
SECONDS = 5.0
"""Length of a window."""
_RECORDING = re.compile(r"(\d+)_(\d+)\.(amc|bvh)$", re.IGNORECASE)
ENDS = {"left_hand": 0.09, "right_hand": 0.09, "left_foot": 0.13, "right_foot": 0.13, "head": 0.18}
"""Default lengths of bones that a file may lack, meters."""


@cache
def _rules() -> tuple[tuple[re.Pattern[str], str], ...]:
    with RULES.open(newline="", encoding="utf-8") as stream:
        return tuple((re.compile(row["pattern"]), row["action"]) for row in csv.DictReader(stream))


@cache
def _fine() -> dict[str, str]:
    """Map descriptions to fine actions, for all of the papers' actions."""
    return {
        description: meaning.action
        for (_, description), meaning in fine_table().items()
        if meaning.action
    }


def action_of(description: str) -> str | None:
    """Return the action of a description: "" if the recording is left out, None if the description
    is unknown."""
    text = description.strip().lower()
    if text in _fine():
        return _fine()[text]
    return next((action for pattern, action in _rules() if pattern.search(text)), None)


def load_cmu_full(
    folder: str | Path, index: str | Path, *, progress: Progress | None = None
) -> ActionDataset:
    """Load every recording below a folder (or in a zip) that the index describes: ``01/01_01.amc``
    beside ``01/01.asf``, or ``01_01.bvh``.

    Parameters
    ----------
    folder : path
    index : path
        Location of ``cmu_index_with_framerate.csv``: ``cmu_mocap.zip``, its folder, or the folder
        of the zip.
    progress : Progress
        Called after each file.

    Raises
    ------
    InputError
        No recordings, no index, or a file that cannot be used; the message names it.
    """
    described = _read_index(find_source(index, archive="cmu_mocap.zip", marker=INDEX))
    source = FileSource(Path(folder))
    files = _recordings(source)
    skeletons = {
        str(int(PurePosixPath(name).stem)): name
        for name in source.names(".asf")
        if PurePosixPath(name).stem.isdecimal()
    }
    lengths = np.array([ENDS.get(name, 0.1) for name in CMU.joint_names])
    found: list[tuple[str, str, str, np.ndarray]] = []
    left, texts = 0, dict[str, set[str]]()
    for done, (clip, name) in enumerate(sorted(files.items()), 1):
        text, rate = described.get(clip, ("", 120.0))
        action = action_of(text)
        if action is None:
            raise InputError(
                f"{source.path}/{name} is described as '{text}', for which {RULES.name} has no "
                "rule; add one"
            )
        if action:
            motion = resample_motion(_read(source, name, skeletons, rate), FPS)
            joints = on_skeleton(motion, CMU, lengths) / np.float32(FRAME.meters_per_unit)
            found.append((clip, action, text, joints.astype(np.float32)))
            texts.setdefault(action, set()).add(text)
        left += not action
        if progress is not None:
            progress(done, len(files))
    if not found:
        raise InputError(f"{source.path} contains no recording with an action in {RULES.name}")
    counts = Counter(action for _, action, _, _ in found)
    actions = tuple(sorted(counts, key=lambda action: (-counts[action], action)))
    clips = [
        Clip(joints=joints, action=actions.index(action), name=clip, subject=clip.split("_")[0])
        for clip, action, _, joints in found
    ]
    return ActionDataset.from_clips(
        clips,
        name="cmu-full",
        skeleton=CMU,
        actions=actions,
        fps=FPS,
        length=round(SECONDS * FPS),
        frame=FRAME,
        descriptions=tuple(tuple(sorted(texts[action])) for action in actions),
        notes=(f"{left} recordings that are many things at once or none are left out",),
    )


def _read_index(source: FileSource) -> dict[str, tuple[str, float]]:
    """Map each clip to its description and frame rate."""
    rows = csv.reader(io.StringIO(source.read(source.names(INDEX)[0]).decode("latin-1")))
    entries = [
        row
        for row in rows
        if len(row) > 3 and row[0].isdecimal() and row[1].isdecimal() and row[3].isdecimal()
    ]
    return {
        f"{int(subject):02d}_{int(trial):02d}": (text, float(rate))
        for subject, trial, text, rate, *_ in entries
    }


def _recordings(source: FileSource) -> dict[str, str]:
    """Map each clip ("01_01") to its file; an AMC is preferred to a BVH of the same recording."""
    found: dict[str, str] = {}
    for name in [*source.names(".bvh"), *source.names(".amc")]:
        if match := _RECORDING.search(name):
            found[f"{int(match[1]):02d}_{int(match[2]):02d}"] = name
    if not found:
        raise InputError(
            f"{source.path} holds no recordings such as 01/01_01.amc (beside 01/01.asf) or "
            "01_01.bvh"
        )
    return found


def _read(source: FileSource, name: str, skeletons: dict[str, str], rate: float) -> Motion:
    """Read a recording at the rate of the index, because conversions to BVH list 120 for all."""
    where = f"{source.path}/{name}"
    if name.lower().endswith(".bvh"):
        return dataclasses.replace(read_bvh(source.read(name), name=where), fps=rate)
    subject = str(int(PurePosixPath(name).stem.split("_")[0]))
    if subject not in skeletons:
        raise InputError(f"{where} has no skeleton; expected {int(subject):02d}.asf beside it")
    return read_amc(
        source.read(name).decode("latin-1"),
        source.read(skeletons[subject]).decode("latin-1"),
        fps=rate,
        name=where,
    )

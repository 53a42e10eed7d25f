"""AMASS, BABEL, HumanML3D and 100STYLE by their published layouts, for whoever has them.

None of them was available here: the tests write files of the same layout.
"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.bvh import read_bvh
from a2v.formats.registry import read_motion
from a2v.io import parse_json, read_bytes
from a2v.lab.datasets.base import ActionDataset, Clip
from a2v.lab.datasets.bvh_folder import demand_same_joints, skeleton_of_file
from a2v.lab.datasets.files import MAX_FILE_BYTES, check_joints
from a2v.types import Motion, Progress

FPS = 20.0
"""Rate of all four sets here, frames per second: HumanML3D's own."""
LENGTH = 60
"""Frames of a window, as of HumanAct12."""
MAX_JSON_BYTES = 256 << 20
"""Largest file of labels; BABEL's have some ten megabytes."""
MAX_TEXT_BYTES = 1 << 20
"""Largest file of captions or of cuts."""
STYLE_FPS = 60.0
"""Rate of the frame numbers in 100STYLE's Frame_Cuts.csv."""
MOVEMENTS: Mapping[str, str] = {
    "BR": "backwards run",
    "BW": "backwards walk",
    "FR": "forwards run",
    "FW": "forwards walk",
    "ID": "idle",
    "SR": "sidestep run",
    "SW": "sidestep walk",
    "TR1": "transitions 1",
    "TR2": "transitions 2",
    "TR3": "transitions 3",
}
"""Movements of 100STYLE by the codes in its file names."""


@dataclass(frozen=True, kw_only=True)
class _Part:
    """A labeled part of a recording: its file, from `start` to `stop` in seconds."""

    file: Path
    action: str
    subject: str
    name: str
    start: float = 0.0
    stop: float = np.inf


def load_amass(path: str | Path, *, progress: Progress | None = None) -> ActionDataset:
    """Load ``COLLECTION/SUBJECT/*_poses.npz`` or ``*_stageii.npz`` below a folder.

    AMASS has no actions: the collections (CMU, KIT, ACCAD ...) take their place. Joints are those
    of the average SMPL body.

    Raises
    ------
    InputError
        No such files, or one that cannot be used.
    """
    root = _folder(path)
    parts = [
        _Part(
            file=file,
            action=inside.parts[0],
            subject="/".join(inside.parts[:2]),
            name=inside.with_suffix("").as_posix(),
        )
        for file in sorted(root.rglob("*.npz"))
        if file.stem.endswith(("_poses", "_stageii"))
        and len((inside := file.relative_to(root)).parts) > 2
    ]
    if not parts:
        raise InputError(f"{root} holds no COLLECTION/SUBJECT/*_poses.npz; expected AMASS's folder")
    return _made("amass", parts, root, _read_array, progress=progress)


def load_babel(path: str | Path, *, progress: Progress | None = None) -> ActionDataset:
    """Load the parts of AMASS that BABEL labels: ``train.json`` and ``val.json`` in a folder, or in
    its ``babel_v1.0_release``, beside AMASS's collections.

    A part of a recording with one category (``act_cat``) is a clip: of the labels of its frames,
    else of the whole recording. Parts with several categories or none, and recordings whose file is
    not there, are left out and counted in the notes.

    Raises
    ------
    InputError
        No labels, damaged ones, or no recording that they name.
    """
    root = _folder(path)
    files = [
        file
        for folder in (root, root / "babel_v1.0_release")
        for name in ("train.json", "val.json")
        if (file := folder / name).is_file()
    ]
    if not files:
        raise InputError(f"{root} holds no train.json of BABEL; put it beside AMASS's collections")
    parts, lost, mixed = list[_Part](), 0, 0
    for file in files:
        labels = parse_json(read_bytes(file, limit=MAX_JSON_BYTES), file, "BABEL's labels")
        if not isinstance(labels, dict):
            raise InputError(f"{file} is no object of recordings; expected BABEL's labels")
        for key, about in labels.items():
            try:
                recording = _recording(root, str(about["feat_p"]))
                segments = list(_segments(about))
            except (KeyError, TypeError, ValueError, AttributeError):
                raise InputError(
                    f"{file}: the labels of {key} cannot be read; expected BABEL's feat_p, "
                    "seq_ann and frame_ann"
                ) from None
            if recording is None:
                lost += 1
                continue
            inside = recording.relative_to(root)
            for number, (categories, start, stop) in enumerate(segments):
                if len(categories) != 1:
                    mixed += 1
                    continue
                parts.append(
                    _Part(
                        file=recording,
                        action=categories[0],
                        subject="/".join(inside.parts[-3:-1]),
                        name=f"{inside.with_suffix('').as_posix()}/{number}",
                        start=start,
                        stop=stop,
                    )
                )
    if not parts:
        raise InputError(
            f"{root} holds none of the recordings that BABEL labels; unpack AMASS there"
        )
    notes = [f"{lost} recordings are not there", f"{mixed} parts have several categories or none"]
    return _made("babel", parts, root, _read_array, notes=notes, progress=progress)


def load_humanml3d(path: str | Path, *, progress: Progress | None = None) -> ActionDataset:
    """Load HumanML3D's ``new_joints/*.npy`` (T, 22, 3) with its ``texts/*.txt``.

    It has captions and no actions: the verb that most captions of a clip name first is its action,
    and the captions are the descriptions of their action. Mirrored copies (M000000) and captions of
    a part of the clip are left out.

    Raises
    ------
    InputError
        No such files, or one that cannot be used.
    """
    root, captions, parts = _folder(path), dict[str, list[str]](), list[_Part]()
    without = 0
    for file in sorted((root / "new_joints").glob("[0-9]*.npy")):
        text = root / "texts" / f"{file.stem}.txt"
        told = list(_captions(text)) if text.is_file() else []
        verbs = Counter(verb for _, verb in told if verb)
        if not verbs:
            without += 1
            continue
        action = verbs.most_common(1)[0][0]
        captions.setdefault(action, []).extend(caption for caption, _ in told)
        parts.append(_Part(file=file, action=action, subject="unknown", name=file.stem))
    if not parts:
        raise InputError(
            f"{root} holds no new_joints/*.npy with texts/*.txt; expected HumanML3D's folder"
        )
    notes = [f"{without} clips have no caption with a verb"]
    return _made(
        "humanml3d", parts, root, _read_array, notes=notes, captions=captions, progress=progress
    )


def load_100style(path: str | Path, *, progress: Progress | None = None) -> ActionDataset:
    """Load 100STYLE: ``STYLE/STYLE_MOVEMENT.bvh`` and ``Frame_Cuts.csv``, whose frames bound the
    used part of each file.

    An action is a style with a movement ("Drunk, forwards walk"); both are its traits.

    Raises
    ------
    InputError
        No such files, or one that cannot be used.
    """
    root = _folder(path)
    cuts, parts, uncut = _cuts(root / "Frame_Cuts.csv"), list[_Part](), 0
    for file in sorted(root.glob("*/*.bvh")):
        style, _, code = file.stem.rpartition("_")
        if style != file.parent.name or code not in MOVEMENTS:
            continue
        found = cuts.get((style, code))
        if found is None:
            uncut += 1
            continue
        parts.append(
            _Part(
                file=file,
                action=f"{style}, {MOVEMENTS[code]}",
                subject="unknown",
                name=f"{style}/{file.stem}",
                start=found[0],
                stop=found[1],
            )
        )
    if not parts:
        raise InputError(
            f"{root} holds no STYLE/STYLE_FW.bvh with bounds in Frame_Cuts.csv; expected "
            "100STYLE's folder"
        )
    notes = [f"{uncut} files have no bounds in Frame_Cuts.csv"]
    return _made("100style", parts, root, _read_bvh, notes=notes, progress=progress)


LOADERS: Mapping[str, Callable[..., ActionDataset]] = {
    "amass": load_amass,
    "babel": load_babel,
    "humanml3d": load_humanml3d,
    "100style": load_100style,
}
"""Loaders by the names of the data sets."""


def _folder(path: str | Path) -> Path:
    root = Path(path)
    if not root.is_dir():
        raise InputError(f"{root} is not a folder; give the folder of the data set, unpacked")
    return root


def _made(
    name: str,
    parts: Sequence[_Part],
    root: Path,
    read: Callable[[Path, Motion | None], Motion],
    *,
    notes: Sequence[str] = (),
    captions: Mapping[str, Sequence[str]] | None = None,
    progress: Progress | None = None,
) -> ActionDataset:
    """Read the parts of recordings as clips, each file once."""
    actions = tuple(sorted({part.action for part in parts}))
    number = {action: index for index, action in enumerate(actions)}
    clips, short = list[Clip](), 0
    first: tuple[str, Motion] | None = None
    opened: tuple[Path, Motion] | None = None
    for done, part in enumerate(parts):
        where = str(part.file)
        if opened is None or opened[0] != part.file:
            opened = part.file, read(part.file, None if first is None else first[1])
            if first is None:
                first = where, opened[1]
            demand_same_joints(opened[1], where, first)
        motion = opened[1]
        begin = round(min(part.start * FPS, motion.frames))
        end = round(min(part.stop * FPS, motion.frames))
        if end - begin < 2:
            short += 1
        else:
            joints = check_joints(motion.joints, len(motion.parents), where)[begin:end]
            clips.append(
                Clip(
                    joints=joints, action=number[part.action], name=part.name, subject=part.subject
                )
            )
        if progress is not None:
            progress(done + 1, len(parts))
    if first is None or not clips:
        raise InputError(f"{root} holds no clip of two frames at {FPS:g} frames per second")
    return ActionDataset.from_clips(
        clips,
        name=name,
        skeleton=skeleton_of_file(first[1]),
        actions=actions,
        fps=FPS,
        length=LENGTH,
        notes=(*notes, f"{short} parts are shorter than two frames"),
        traits=_traits(actions) if name == "100style" else (),
        descriptions=tuple(tuple(captions[action]) for action in actions) if captions else (),
    )


def _traits(actions: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    pairs = [action.split(", ") for action in actions]
    return tuple((f"style:{style}", f"movement:{movement}") for style, movement in pairs)


def _read_array(file: Path, _: Motion | None) -> Motion:
    """Read one motion of SMPL's rotations or joints."""
    if file.stat().st_size > MAX_FILE_BYTES:
        raise InputError(f"{file} has over {MAX_FILE_BYTES >> 20} MB; expected one recording")
    motion = read_motion(file, fps=FPS)
    if motion.batch:
        raise InputError(f"{file} holds several motions; expected one recording")
    return motion


def _read_bvh(file: Path, first: Motion | None) -> Motion:
    """Read BVH in the unit and axes of the first file."""
    known = {} if first is None else first.provenance
    return read_bvh(
        read_bytes(file, limit=MAX_FILE_BYTES),
        fps=FPS,
        units=float(known["scale"]) if known else None,
        up=str(known["up"]) if known else None,
        name=str(file),
    )


def _recording(root: Path, named: str) -> Path | None:
    """Return the file of a recording by BABEL's ``feat_p``; None if it is not below `root`.

    BABEL's paths have the collection's folder twice (``CMU/CMU/49/49_07_poses.npz``), AMASS's
    archives once.
    """
    inside = PurePosixPath(named)
    if inside.is_absolute() or ".." in inside.parts or len(inside.parts) < 3:
        raise ValueError(named)
    for parts in (inside.parts, inside.parts[1:]):
        if (file := root.joinpath(*parts)).is_file():
            return file
    return None


def _segments(about: Mapping[str, Any]) -> Iterator[tuple[list[str], float, float]]:
    """Return categories, start and end in seconds of each labeled part of a recording."""
    frames = about.get("frame_ann")
    for label in (frames or about["seq_ann"])["labels"]:
        categories = [str(name) for name in label.get("act_cat") or ()]
        start, stop = (float(label["start_t"]), float(label["end_t"])) if frames else (0.0, np.inf)
        if not (0 <= start <= stop):  # NaN too
            raise ValueError(start)
        yield categories, start, stop


def _captions(file: Path) -> Iterator[tuple[str, str]]:
    """Return the captions of a whole clip, each with its first verb ("" for none).

    A line is ``caption#a/DET man/NOUN walk/VERB#start#end``, with zeros or nan for the whole clip.
    """
    text = read_bytes(file, limit=MAX_TEXT_BYTES, empty=True).decode("utf-8", "replace")
    for line in text.splitlines():
        caption, *rest = line.strip().split("#")
        if len(rest) < 3:
            continue
        if {bound.strip().lower() for bound in rest[1:3]} - {"0", "0.0", "nan"}:
            continue
        words = [word.rpartition("/") for word in rest[0].split()]
        yield caption, next((word.lower() for word, _, tag in words if tag == "VERB"), "")


def _cuts(file: Path) -> dict[tuple[str, str], tuple[float, float]]:
    """Return the bounds in seconds by style and movement.

    Columns are STYLE_NAME, then ``BR_START``, ``BR_STOP`` and so on; empty where there is no file.
    """
    if not file.is_file():
        raise InputError(f"{file} does not exist; it bounds the used part of each file")
    text = read_bytes(file, limit=MAX_TEXT_BYTES).decode("utf-8-sig", "replace")
    found = dict[tuple[str, str], tuple[float, float]]()
    for row in csv.DictReader(io.StringIO(text)):
        for code in MOVEMENTS:
            given = row.get(f"{code}_START"), row.get(f"{code}_STOP")
            try:
                start, stop = (float(value or "nan") / STYLE_FPS for value in given)
            except ValueError:
                continue
            if 0 <= start <= stop < np.inf:
                found[str(row.get("STYLE_NAME")), code] = start, stop
    return found

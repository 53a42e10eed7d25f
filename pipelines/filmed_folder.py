"""``a2v motion --from-video FOLDER``: convert a folder of videos to a folder of BVH files.

`a2v train flow --dataset bvh` learns actions from them.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from a2v.errors import InputError
from a2v.footage import is_video
from pipelines.answer import Answer
from pipelines.motion_film import FilmedOptions, Made

MOST_VIDEOS = 2000
"""Maximum number of videos in a folder."""


def videos_below(folder: str | os.PathLike[str]) -> list[tuple[Path, str]]:
    """Find the videos in a folder and its subfolders: path and action, sorted.

    The action of a video is the name of its folder.

    Raises
    ------
    InputError
        There is no video, or there are more than `MOST_VIDEOS`.
    """
    top = Path(folder)
    paths = [path for path in [*top.glob("*"), *top.glob("*/*")] if path.is_file()]
    found = sorted(path for path in paths if is_video(path) and not path.name.startswith("."))
    if not found:
        raise InputError(
            f"{top} has no videos; expected {top}/ACTION/*.mp4, or clips of one action"
        )
    if len(found) > MOST_VIDEOS:
        raise InputError(f"{top} has {len(found)} videos; expected at most {MOST_VIDEOS}")
    return [(path, path.parent.resolve().name) for path in found]


def follow_folder(
    filmed: FilmedOptions,
    out: Path,
    follow: Callable[[FilmedOptions], Made],
    write: Callable[[Made, Path], Answer],
    *,
    rigged: bool,
) -> Answer:
    """Track the person in every video of a folder, and write OUT/ACTION/NAME.bvh.

    A video without a trackable person is left out with a note.

    Parameters
    ----------
    filmed : FilmedOptions
        `from_video` is the folder.
    out : Path
        The folder to write.
    follow, write : functions
        From one video to its motion, and from a motion to its file.
    rigged : bool
        Whether the motions go onto a rig. Without one, fingers are left out: all files of a data
        set must have the same joints.

    Raises
    ------
    InputError
        `out` is a file, there is no video, or none can be followed.
    """
    assert filmed.from_video is not None
    if out.suffix or out.is_file():
        raise InputError(f"cannot write {out}; a folder of videos becomes a folder of .bvh files")
    videos = videos_below(filmed.from_video)
    settings = filmed.follow if rigged else dataclasses.replace(filmed.follow, hands=False)
    files: list[Path] = []
    notes: list[str] = []
    counts: dict[str, int] = {}
    for path, action in videos:
        target = out / action / f"{_plain(path, videos)}.bvh"
        one = dataclasses.replace(filmed, from_video=str(path), follow=settings)
        try:
            answer = write(follow(one), target)
        except InputError as error:
            notes.append(f"{path} is left out: {error}")
            continue
        files += answer.files
        notes += [f"{path}: {note}" for note in answer.notes]
        counts[action] = counts.get(action, 0) + 1
    if not files:
        raise InputError(f"no video of {filmed.from_video} can be followed; the first: {notes[0]}")
    return Answer(files=files, notes=notes, facts={"actions": counts, "videos": len(videos)})


def _plain(path: Path, videos: Sequence[tuple[Path, str]]) -> str:
    """Return the stem of a video, with its suffix if another video there has the same stem."""
    alike = [other for other, _ in videos if other.with_suffix("") == path.with_suffix("")]
    return path.stem if len(alike) == 1 else path.name.replace(".", "_")

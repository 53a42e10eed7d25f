"""``a2v follow``: the motion of the person in a video, or in each video of a folder.

``a2v train flow --dataset bvh`` learns actions from the files of a folder.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from a2v.footage import SUFFIXES, FollowSettings, is_video
from a2v.footage.settings import LONGEST
from a2v.motion.edit import Edit
from a2v.types import Motion
from pipelines.answer import Answer
from pipelines.engine.refs import File
from pipelines.graph import video_graph
from pipelines.inputs import RunOptions
from pipelines.motion_file import MotionFileOptions
from pipelines.nodes.values import MotionFile
from pipelines.options import group, option, settings
from pipelines.requests.motion import FOLLOW_USERS, DurationOptions, length_of

HELP = "Follow the person in a video and write the motion as .npz, .bvh, .fbx, .glb, .vrma, or a picture or video of a stick figure."
EXAMPLES = """examples:
  a2v follow --video clip.mp4 --out me.bvh                   all of it, at most ten minutes
  a2v follow --video clip.mp4 --seconds 8 --follow.start 4 --rig mixamo --out me.bvh
  a2v follow --video clips --out my_actions                  clips/ACTION/*.mp4 to my_actions/ACTION/*.bvh for a2v train flow --dataset bvh"""

MOST_VIDEOS = 2000
"""Maximum number of videos in a folder."""


@dataclass(frozen=True, kw_only=True)
class VideoLengthOptions(DurationOptions):
    """Options for the length of the motion of a video, and its frame rate."""

    seconds: float | None = option("length in seconds (default: the whole video)", default=None)


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    video: str = option(
        f"video ({', '.join(SUFFIXES[:5])}...), or a folder of videos", metavar="FILE"
    )
    file: MotionFileOptions = group(MotionFileOptions)
    action: str = option("name of the action in the file", default="")
    length: VideoLengthOptions = group(VideoLengthOptions)
    follow: FollowSettings = settings(FollowSettings, users=FOLLOW_USERS)
    running: RunOptions = group(RunOptions, "execution")


def run(options: Options) -> Answer:
    """Track the person and write the motion."""
    return _folder(options) if Path(options.video).is_dir() else _one(options)


def _one(options: Options) -> Answer:
    """Track the person in a video, and write the motion; of the whole video without a length.

    Raises
    ------
    InputError
        The file is not named like a video, or what `a2v.footage.follow.follow_person` refuses.
    """
    options.file.check()
    if not is_video(options.video):
        raise InputError(
            f"{options.video} is not named like a video; expected a name that ends in "
            f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"
        )
    length = options.length
    frames = round(LONGEST * length.fps)
    if length.frames is not None or length.seconds is not None:
        frames = length_of(frames=length.frames, seconds=length.seconds, fps=length.fps)
    asked = {
        "motion_file": MotionFile(file=File.of(options.video)),
        "action": options.action,
        "frames": frames,
        "fps": length.fps,
        "follow": options.follow,
        "edit": Edit(speed=options.file.edits.speed),
    }
    outcome = options.running.run("motion", asked, graph=video_graph(recorded=True))
    return options.file.write(outcome.get("motion", Motion), notes=outcome.notes)


def _folder(options: Options) -> Answer:
    """Track the person in every video of a folder, and write OUT/ACTION/NAME.bvh.

    A video without a trackable person is left out with a note. Without a rig, fingers are left out:
    all files of a data set must have the same joints.

    Raises
    ------
    InputError
        The output is a file, there is no video, or none can be followed.
    """
    out = options.file.path
    if out.suffix or out.is_file():
        raise InputError(f"cannot write {out}; a folder of videos becomes a folder of .bvh files")
    dataclasses.replace(options.file, out=f"{out}.bvh").check()
    videos = videos_below(options.video)
    follow = options.follow
    if options.file.rig is None:
        follow = dataclasses.replace(follow, hands=False)
    files: list[Path] = []
    notes: list[str] = []
    counts: dict[str, int] = {}
    for path, action in videos:
        target = out / action / f"{_plain(path, videos)}.bvh"
        file = dataclasses.replace(options.file, out=str(target))
        try:
            answer = _one(dataclasses.replace(options, video=str(path), file=file, follow=follow))
        except InputError as error:
            notes.append(f"{path} is left out: {error}")
            continue
        files += answer.files
        notes += [f"{path}: {note}" for note in answer.notes]
        counts[action] = counts.get(action, 0) + 1
    if not files:
        raise InputError(f"no video of {options.video} can be followed; the first: {notes[0]}")
    return Answer(files=files, notes=notes, facts={"actions": counts, "videos": len(videos)})


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


def _plain(path: Path, videos: Sequence[tuple[Path, str]]) -> str:
    """Return the stem of a video, with its suffix if another video there has the same stem."""
    alike = [other for other, _ in videos if other.with_suffix("") == path.with_suffix("")]
    return path.stem if len(alike) == 1 else path.name.replace(".", "_")

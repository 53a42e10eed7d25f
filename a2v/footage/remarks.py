"""Notes on parts of a person that a video does not show, with times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.footage.reading import Reel
from a2v.footage.settings import LONGEST
from a2v.footage.track import Piece, Track
from a2v.footage.tracking import Sighting
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import BoolArray

PARTS: dict[str, tuple[str, ...]] = {
    **{f"{side} arm": (f"{side}_elbow", f"{side}_wrist") for side in ("left", "right")},
    **{f"{side} leg": (f"{side}_knee", f"{side}_ankle") for side in ("left", "right")},
    "head": ("nose", "left_ear", "right_ear"),
}
"""Parts of a person, and their landmarks."""
UNSURE = 0.35
"""Mean confidence of the landmarks of a part below which it is not seen."""
SHORTEST = 0.4
"""Shortest time in seconds that is reported."""
LIES = 1.7
"""A trunk whose width in the picture is this multiple of its height lies: within 30 degrees."""
MOSTLY = 0.9
"""Share of the frames in which a person lies from which a film may lie on its side."""
_MOST = 12


def clock(seconds: float) -> str:
    """Format seconds as minutes, seconds and tenths: "0:03.2"."""
    tenths = round(10 * max(seconds, 0.0))
    return f"{tenths // 600}:{tenths % 600 / 10:04.1f}"


def unseen_parts(track: Track, start: float) -> list[str]:
    """Return one sentence per part of the person that was not seen for some time. `start` is the
    time in the video of the track's time 0."""
    said: list[tuple[float, str]] = []
    for part, names in {"person": BODY, **PARTS}.items():
        rows = [LANDMARK_INDEX[name] for name in names]
        gone = (
            ~track.seen
            if part == "person"
            else track.seen & (track.confidence[:, rows].mean(axis=1) < UNSURE)
        )
        said += [
            (begin, f"{clock(start + begin)} to {clock(start + end)}: {part} not seen")
            for begin, end in _spans(gone, track)
        ]
    said.sort()
    more = [f"and {len(said) - _MOST} more times a part was not seen"] if len(said) > _MOST else []
    return [text for _, text in said[:_MOST]] + more


BODY: tuple[str, ...] = ("left_hip", "right_hip")


def _spans(flags: BoolArray, track: Track) -> list[tuple[float, float]]:
    """Return the spans of time in which flags (T,) hold for at least `SHORTEST`. Gaps of two frames
    are closed."""
    found: list[tuple[float, float]] = []
    for index in np.flatnonzero(flags):
        begin = float(track.times[index])
        end = float(track.times[min(index + 1, track.frames - 1)])
        if found and begin - found[-1][1] < 0.1:
            found[-1] = (found[-1][0], end)
        else:
            found.append((begin, end))
    return [span for span in found if span[1] - span[0] >= SHORTEST]


def told_pieces(
    pieces: Sequence[Piece], chosen: Piece, sightings: Sequence[Sighting], start: float
) -> list[str]:
    """Report what is left out besides the chosen piece."""
    said = []
    cuts = [clock(start + one.time) for one in sightings if one.cut]
    span = f"{clock(start + sightings[chosen.first].time)} to {clock(start + sightings[chosen.end - 1].time)}"  # noqa: E501
    if cuts:
        said.append(
            f"the video is cut at {', '.join(cuts[:6])}{' and later' if len(cuts) > 6 else ''}; "
            f"{span}, the longest piece, is followed"
        )
    elif len(pieces) > 1:
        said.append(f"the person leaves and comes back; {span}, the longest piece, is followed")
    else:
        before, after = (
            sightings[chosen.first].time,
            sightings[-1].time - sightings[chosen.end - 1].time,
        )
        if before > SHORTEST:
            said.append(
                f"the person is first seen at {clock(start + sightings[chosen.first].time)}"
            )
        if after > SHORTEST:
            said.append(
                "the person is not seen any more from "
                f"{clock(start + sightings[chosen.end - 1].time)} on"
            )
    return said


def told_lying(track: Track) -> list[str]:
    """Say that the person lies across the picture nearly all the time, which is also what a film on
    its side shows."""
    names = ("left_shoulder", "right_shoulder", "left_hip", "right_hip")
    points = track.pixels[:, [LANDMARK_INDEX[name] for name in names], :2]
    trunk = points[:, :2].mean(axis=1) - points[:, 2:].mean(axis=1)
    across = np.abs(trunk[:, 0]) > LIES * np.abs(trunk[:, 1])
    if len(across) == 0 or across.mean() < MOSTLY:
        return []
    turn = 90 if np.median(trunk[across, 0]) > 0 else 270
    return [
        f"the person lies in {across.mean():.0%} of the frames; if the film lies on its side, give "
        f"follow.turn {turn}"
    ]


def told_reel(reel: Reel, last: float, *, people: int, asked: float) -> list[str]:
    """Report damage, length and further people. `last` is the time of the last frame that was read,
    and `asked` the requested number of seconds."""
    said = []
    if reel.damaged:
        said.append(
            f"{len(reel.damaged)} parts of the video are damaged, the first at "
            f"{clock(reel.damaged[0])}; they are left out"
        )
    if not np.isfinite(asked) and last >= LONGEST - 0.5 and reel.seconds > LONGEST + 1:
        said.append(
            f"the video has {clock(reel.seconds)} minutes; only the first {LONGEST / 60:.0f} are "
            "followed"
        )
    if people > 1:
        said.append(
            f"{people} people are in the video; the largest in the middle is followed "
            "(follow.person chooses another)"
        )
    return said

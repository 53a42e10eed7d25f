"""Turn a video into a motion: track the person, fit a body, put it on the ground."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from a2v.digest import Digest
from a2v.errors import InputError
from a2v.footage.expressions import fit_expressions
from a2v.footage.figure import person_skeleton
from a2v.footage.fit import FilmFit, Moves
from a2v.footage.ground import LEGS, evenly, standing
from a2v.footage.hands import Hands, track_hands, with_hands
from a2v.footage.modes import steady_depths
from a2v.footage.reading import RATE, Reel, open_reel
from a2v.footage.remarks import told_lying, told_pieces, told_reel, unseen_parts
from a2v.footage.settings import LONGEST, FollowSettings
from a2v.footage.track import Piece, Track, pieces_of, track_of
from a2v.footage.tracking import Sighting, Tracker
from a2v.geometry.polar import nearest_rotations
from a2v.geometry.vectors import unit
from a2v.kinematics.foot_contacts import PlantSettings
from a2v.kinematics.from_joints import motion_of_joints
from a2v.kinematics.planting import plant_feet
from a2v.kinematics.resample import SHOWN_FPS
from a2v.kinematics.transforms import bone_lengths, on_lengths
from a2v.types import FloatArray, Motion, Progress

PLANTED = PlantSettings(carry=0.5)
"""How feet are planted at the end: feet whose depth is estimated slide more than the body drifts,
so that the body is moved back by half of what standing feet slide."""
LOOKING = 0.8
"""Share of the progress bar that the detectors take."""
_FLOOR = 0.1
"""Share of the frames in which the lower foot may be below the ground."""


@dataclass(frozen=True, kw_only=True)
class Followed:
    """A motion from a video, and notes on it.

    Attributes
    ----------
    motion : Motion
        Meters, y up, 30 frames per second. The person starts above the origin; the camera is in
        the direction of +z.
    remarks : tuple of str
        Notes on unseen parts, with times, and on parts of the video that were left out.
    facts : dict
        Number of ``frames`` that were read, number of frames in which the person was ``seen``,
        ``height`` and ``tilt`` of the camera (meters, degrees), and others.
    """

    motion: Motion
    remarks: tuple[str, ...]
    facts: Mapping[str, Any] = field(default_factory=dict)


def follow_person(
    path: str | os.PathLike[str],
    settings: FollowSettings | None = None,
    *,
    seconds: float | None = None,
    action: str = "",
    progress: Progress | None = None,
) -> Followed:
    """Convert a video of a person to a motion.

    Parameters
    ----------
    path : path
        A video in which one person is mostly visible from head to foot. Sound is ignored.
    settings : FollowSettings, optional
    seconds : float, optional
        Length of the part that is used, from ``settings.start``. By default all of the video, at
        most ten minutes.
    action : str
        Name of the motion; by default the stem of the file.
    progress : Progress, optional
        Called with the work done and the total work, detectors and fit together.

    Raises
    ------
    InputError
        The file is not a readable video, or no person is found in it.
    """
    settings = settings or FollowSettings()
    limit = min(LONGEST, seconds if seconds is not None else np.inf)
    with open_reel(path) as reel, Tracker(settings) as tracker:
        reel.turn(settings.turn)
        sightings, expected = _sightings(reel, tracker, settings, limit, progress)
    piece = _longest(sightings, reel, settings, tracker)
    own = sightings[piece.first : piece.end]
    assert tracker.shape is not None
    track = track_of(own, tracker.shape[::-1], settings)

    def fitted(done: int, total: int) -> None:
        if progress is not None:
            progress(
                expected + round(done / total * expected * (1 / LOOKING - 1)),
                round(expected / LOOKING),
            )

    moves = _fitted(track, settings, fitted)
    motion = grounded_motion(moves.joints, track.times, action=action or Path(path).stem)
    hands = _hands(own, track, moves, motion.frames)
    motion = motion if hands is None else with_hands(motion, hands)
    faces = _faces(own, track, motion.frames)
    remarks = [
        *told_reel(
            reel,
            sightings[-1].time,
            people=tracker.people,
            asked=np.inf if seconds is None else seconds,
        ),
        *told_pieces(pieces_of(sightings), piece, sightings, settings.start),
        *unseen_parts(track, settings.start),
        *told_lying(track),
    ]
    facts = {
        **_facts(path, reel, sightings, track, moves),
        "from": settings.start + own[0].time,
        "expressions": len(faces),
        "hands": [0.0, 0.0] if hands is None else hands.seen.round(2).tolist(),
    }
    return Followed(
        motion=replace(motion, provenance=dict(facts), expressions=faces or None),
        remarks=tuple(remarks),
        facts=facts,
    )


def _sightings(
    reel: Reel,
    tracker: Tracker,
    settings: FollowSettings,
    limit: float,
    progress: Progress | None,
) -> tuple[list[Sighting], int]:
    """Return all sightings of a video, and the expected number of frames."""
    if reel.seconds and settings.start >= reel.seconds:
        raise InputError(
            f"start is {settings.start:g}, but {reel.source} has only {reel.seconds:.1f} seconds; "
            "give an earlier start"
        )
    length = min(limit, max(reel.seconds - settings.start, 0) or limit)
    expected = max(1, round(length * min(reel.rate or RATE, RATE))) if np.isfinite(length) else 1
    sightings: list[Sighting] = []
    frames = reel.frames(side=settings.side, start=settings.start, seconds=limit)
    for sighting in tracker.follow(frames):
        sightings.append(sighting)
        if progress is not None:
            progress(min(len(sightings), expected), round(expected / LOOKING))
    return sightings, expected


def _hands(sightings: list[Sighting], track: Track, moves: Moves, frames: int) -> Hands | None:
    """Return the hands at 30 frames per second; None if they are rarely visible."""
    found = track_hands(
        [one.hands for one in sightings],
        moves.wrists,
        track.yaw,
        track.tilt + moves.tilt,
        track.times,
    )
    if found is None:
        return None
    axes = evenly(found.axes.reshape(track.frames, -1), track.times, SHOWN_FPS)
    fingers = evenly(found.fingers.reshape(track.frames, -1), track.times, SHOWN_FPS)
    return Hands(
        axes=nearest_rotations(axes[:frames].reshape(frames, 2, 3, 3)),
        fingers=unit(fingers[:frames].reshape(frames, *found.fingers.shape[1:])),
        seen=found.seen,
    )


def _faces(sightings: list[Sighting], track: Track, frames: int) -> dict[str, FloatArray]:
    """Return strengths (frames,) of expressions at 30 frames per second."""
    shown = fit_expressions([one.face for one in sightings], track.times)
    at = track.times[0] + np.arange(frames) / SHOWN_FPS
    return {
        name: np.interp(at, track.times, strength).astype(np.float32)
        for name, strength in shown.items()
    }


def _facts(
    path: str | os.PathLike[str], reel: Reel, sightings: list[Sighting], track: Track, moves: Moves
) -> dict[str, Any]:
    """`Followed.facts` except for the start of the motion."""
    return {
        "source": os.fspath(path),
        "digest": Digest.of_file(path),
        "video": [reel.width, reel.height],
        "video_fps": reel.rate,
        "frames": len(sightings),
        "seen": sum(one.keypoints is not None for one in sightings),
        "height": round(_camera_height(moves), 2),
        "tilt": round(float(np.degrees(moves.tilt)), 1),
        "turns": round(float(np.degrees(np.ptp(track.yaw))), 1),
    }


def _longest(
    sightings: list[Sighting], reel: Reel, settings: FollowSettings, tracker: Tracker
) -> Piece:
    """Choose the piece in which the person is seen in most frames."""
    if not sightings:
        raise InputError(
            f"{reel.source} has no frames after {settings.start:g} s; give an earlier start"
        )
    pieces = pieces_of(sightings)
    if not pieces:
        seen = sum(one.keypoints is not None for one in sightings)
        if settings.person > 1 and tracker.people < settings.person:
            raise InputError(
                f"follow.person is {settings.person}, but at most {tracker.people} people are "
                f"distinguished in {reel.source}; give a smaller number"
            )
        if seen:
            raise InputError(
                f"{reel.source} shows a person in only {seen} frames; use a video in which one "
                "person is visible for a second or longer"
            )
        raise InputError(
            f"no person found in {reel.source}; use a video that shows one person from head to foot"
        )
    return max(pieces, key=lambda piece: piece.seen)


def _fitted(track: Track, settings: FollowSettings, progress: Progress) -> Moves:
    """Fit the body in every frame, and again with the contacts of the feet."""
    points = steady_depths(track.points, track.pixels, track.heights, track.times, track.weights)
    fit = FilmFit(settings)
    first = fit.fit(track, points, progress=lambda done, total: progress(done, 2 * total))
    stands = standing(first, track.times)
    return fit.fit(
        track,
        points,
        stands=stands,
        start=first,
        progress=lambda done, total: progress(total + done, 2 * total),
    )


def grounded_motion(tracked: FloatArray, times: FloatArray, *, action: str) -> Motion:
    """Resample joints to 30 frames per second, put them on the ground and plant the feet.

    Parameters
    ----------
    tracked : (T, J, 3)
        `a2v.footage.figure.JOINTS`, meters, y up.
    times : (T,)
        Seconds, increasing.
    action : str
    """
    skeleton = person_skeleton()
    lengths = np.median(bone_lengths(tracked, skeleton), axis=0)
    joints = on_lengths(evenly(tracked, times, SHOWN_FPS), skeleton, lengths)
    joints[..., 1] -= _ground(joints)
    joints -= joints[0, 0] * np.array([1.0, 0.0, 1.0])
    planted = plant_feet(joints, skeleton, SHOWN_FPS, settings=PLANTED).astype(np.float64)
    planted[..., 1] -= np.quantile(planted[:, [leg[1] for leg in LEGS], 1].min(axis=1), 0.02) - TOE
    return motion_of_joints(planted, skeleton, SHOWN_FPS, action=action)


TOE = 0.02
"""Height of the toes' joint of a standing foot, meters."""


def _ground(joints: FloatArray) -> float:
    """Return the height of the ground under joints (T, J, 3)."""
    lowest = joints[:, [leg[1] for leg in LEGS], 1].min(axis=1)
    return float(np.quantile(lowest, _FLOOR)) - TOE


def _camera_height(moves: Moves) -> float:
    return -_ground(moves.joints)

"""Studio films with ground truth: accuracy of tracking one person through a video, compared with
mediapipe's own 3D landmarks."""

from __future__ import annotations

import dataclasses
import os
import time
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from a2v.errors import InputError
from a2v.footage.follow import Followed, follow_person
from a2v.footage.reading import open_reel
from a2v.footage.settings import FollowSettings
from a2v.formats.bvh import read_bvh
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.kinematics.resample import SHOWN_FPS, resample_motion
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.film import Film, FilmSettings, shoot
from a2v.rendering.video import write_video
from a2v.types import ByteArray, FloatArray, Motion

MEASURED: tuple[str, ...] = tuple(
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)
"""Joints that are compared, from the middle of the hips."""
_HIPS = [MEASURED.index("left_hip"), MEASURED.index("right_hip")]
_FEET = tuple(f"{side}_{joint}" for side in ("left", "right") for joint in ("ankle", "foot"))
STANDS = 0.15
"""Speed in meters per second below which a foot of the ground truth stands."""
SHORTEST = 0.5
"""Minimum length of a clip, seconds."""


@dataclass(frozen=True)
class Shot:
    """A clip of the panel.

    Attributes
    ----------
    name : str
    kind : str
        Kind of motion.
    recording : str
        A trial of ``cmu_bvh.zip``, or "Action 3": the third clip of that action of
        ``cmu_mocap.zip`` that is not in the body map's training data.
    first, seconds : float
        The part of the recording; the first frame of a BVH file may be its rest pose.
    person : str
        Name of the avatar.
    camera : str
        Kind of camera, one of `a2v.lab.studio.film.CAMERAS`.
    yaw : float
        Degrees.
    """

    name: str
    kind: str
    recording: str
    first: float
    seconds: float
    person: str
    camera: str
    yaw: float


PEOPLE = (
    "X_AIAN_F_1_Casual", "X_AIAN_M_1_Busi", "X_MENA_F_1_Util", "X_NHPI_F_1_Casual", "X_NHPI_F_2_Busi", "X_NHPI_F_3_Util", "X_NHPI_M_1_Casual",
)  # fmt: skip
"""Avatars that no network was trained on and no setting was tuned on."""
_RECORDINGS: tuple[tuple[str, str, float], ...] = (
    ("strike", "02_05", 1.0), ("walk", "07_02", 0.1), ("bend", "02_06", 2.0), ("jump", "Jump 1", 0.0), ("dance", "Dance 1", 0.0), ("sword", "02_07", 2.0),
    ("run", "09_07", 0.1), ("wash", "02_10", 3.0), ("walk", "07_12", 0.1), ("strike", "02_05", 8.0), ("dance", "Dance 2", 0.0), ("sword", "02_08", 3.0),
    ("jump", "Jump 2", 0.0), ("bend", "02_06", 9.0), ("walk", "08_10", 0.1), ("sword", "02_09", 1.0), ("dance", "Dance 3", 0.0), ("wash", "02_10", 12.0),
    ("jump", "Jump 3", 0.0), ("sword", "02_07", 10.0),
)  # fmt: skip
_CAMERAS = ("still", "hand", "still", "pan")
_YAWS = (0.0, 35.0, -40.0, 80.0, -20.0, 150.0, 15.0)
SHOTS: tuple[Shot, ...] = tuple(
    Shot(
        f"{number:02d}-{kind}",
        kind,
        recording,
        first,
        4.0,
        PEOPLE[number % len(PEOPLE)],
        _CAMERAS[number % 4],
        _YAWS[number % len(_YAWS)],
    )
    for number, (kind, recording, first) in enumerate(_RECORDINGS)
)
"""The panel."""


def recorded(shot: Shot, data: str | os.PathLike[str]) -> Motion:
    """Return the motion of a shot at 30 frames per second.

    Raises
    ------
    InputError
        The data are missing.
    """
    if " " in shot.recording:
        from a2v.lab.datasets import load_dataset
        from a2v.lab.studio.quick.bank import HELD_OUT

        action, number = shot.recording.split()
        found = load_dataset("cmu", Path(data))
        unseen = [
            index
            for index, label in enumerate(found.labels)
            if found.actions[label] == action and index % 10 == HELD_OUT
        ]
        motion = resample_motion(found.motion(unseen[int(number) - 1]), SHOWN_FPS)
    else:
        try:
            with zipfile.ZipFile(Path(data) / "cmu_bvh.zip") as archive:
                text = archive.read(f"cmu_bvh/{shot.recording[:2]}/{shot.recording}.bvh")
        except (OSError, KeyError, zipfile.BadZipFile):
            raise InputError(
                f"{Path(data) / 'cmu_bvh.zip'} lacks {shot.recording}; set --data to "
                "the folder of data"
            ) from None
        motion = read_bvh(text, fps=SHOWN_FPS)
    part = slice(round(shot.first * SHOWN_FPS), round((shot.first + shot.seconds) * SHOWN_FPS))
    cut = {name: getattr(motion, name)[part] for name in ("joints", "rotations", "root")}
    return dataclasses.replace(motion, **cut, action_starts=None, provenance={})


def shoot_panel(shot: Shot, data: str | os.PathLike[str], folder: Path) -> tuple[Film, Path]:
    """Return the film of a shot, and its video, which is rendered if it does not exist."""
    avatar = load_avatar(Path(data) / "avatars" / f"{shot.person}.glb")
    seed = int(shot.name[:2])
    film = shoot(
        avatar, recorded(shot, data), FilmSettings(camera=shot.camera, yaw=shot.yaw, seed=seed)
    )
    path = folder / f"{shot.name}.mp4"
    if not path.exists():
        write_video(path, film.frames(), film.fps, crf=20)
    return film, path


@dataclass(frozen=True)
class FilmScore:
    """Scores of the tracking of the person in a film.

    Attributes
    ----------
    name, kind, camera : str
    frames : int
        Frames that were compared.
    seen : float
        Their share of the film's frames.
    error, mediapipe_error : float
        Mean distance of `MEASURED` from the truth, from the middle of the hips, in the heading of
        the first frame, cm.
    scaled : float
        The same at the truth's size: a video does not show the person's height.
    acceleration, mediapipe_acceleration, true_acceleration : float
        Mean error of the accelerations of the same, and their own mean size, meters per square
        second.
    slide, true_slide : float
        Mean speed of feet while those of the ground truth stand, cm per second.
    travel : float
        Error of the hips' final position, from a common start, cm.
    path : float
        Length of the ground truth's path, cm.
    fps : float
        Frames per second of wall-clock time, and `cpu_fps` of processor time.
    """

    name: str
    kind: str
    camera: str
    frames: int
    seen: float
    error: float
    mediapipe_error: float
    scaled: float
    acceleration: float
    mediapipe_acceleration: float
    true_acceleration: float
    slide: float
    true_slide: float
    travel: float
    path: float
    fps: float
    cpu_fps: float


def measure(
    shot: Shot, film: Film, path: Path, settings: FollowSettings
) -> tuple[FilmScore, Followed]:
    """Track the person in a film, and compare."""
    clock, work = time.perf_counter(), time.process_time()
    followed = follow_person(path, settings)
    clock, work = time.perf_counter() - clock, time.process_time() - work
    heading = _heading(film)
    first = round(followed.facts["from"] * film.fps)
    motion = followed.motion
    count = min(motion.frames, len(film.transforms) - first)
    part = slice(first, first + count)
    truth = np.stack([film.joints[name] for name in MEASURED], axis=1)[part] @ heading.T
    own = motion.joints[:count, [motion.joint_names.index(name) for name in MEASURED]].astype(
        np.float64
    )
    landmarks, known = world_landmarks(path, film)
    landmarks, known = landmarks[part] @ heading.T, known[part]
    theirs, ours, true = (_from_hips(points) for points in (landmarks, own, truth))
    scale = float((ours * true).sum() / (ours**2).sum())
    feet = np.stack([film.joints[name] for name in _FEET], axis=1)[part][..., [0, 2]]
    stands = (np.linalg.norm(np.diff(feet, axis=0), axis=-1) * film.fps) < STANDS
    moved = motion.joints[:count, [motion.joint_names.index(name) for name in _FEET]][
        ..., [0, 2]
    ].astype(np.float64)
    travelled, wanted = (points[:, _HIPS].mean(axis=1) for points in (own, truth))
    score = FilmScore(
        name=shot.name, kind=shot.kind, camera=shot.camera, frames=count, seen=followed.facts["seen"] / len(film.transforms),
        error=100 * _mean_gap(ours, true), mediapipe_error=100 * _mean_gap(theirs[known], true[known]), scaled=100 * _mean_gap(scale * ours, true),
        acceleration=_mean_gap(_acceleration(ours, film.fps), _acceleration(true, film.fps)),
        mediapipe_acceleration=_mean_gap(_acceleration(theirs[known], film.fps), _acceleration(true[known], film.fps)),
        true_acceleration=float(np.linalg.norm(_acceleration(true, film.fps), axis=-1).mean()),
        slide=_slide(moved, stands, film.fps), true_slide=_slide(feet, stands, film.fps),
        travel=100 * float(np.linalg.norm((travelled[-1] - travelled[0] - wanted[-1] + wanted[0])[[0, 2]])),
        path=100 * float(np.linalg.norm(np.diff(wanted[:, [0, 2]], axis=0), axis=-1).sum()),
        fps=followed.facts["frames"] / clock, cpu_fps=followed.facts["frames"] / work,
    )  # fmt: skip
    return score, followed


def world_landmarks(path: Path, film: Film) -> tuple[FloatArray, FloatArray]:
    """Return mediapipe's world landmarks of `MEASURED` (T, 12, 3), meters, and which frames have
    them.

    They are rotated to the world by the true camera. Mediapipe's own tracking and smoothing are on,
    as for every video (complexity 1).
    """
    import mediapipe as mp

    from a2v.perception.detector import silenced

    found = np.full((len(film.transforms), len(MEASURED), 3), np.nan)
    rows = [LANDMARK_INDEX[name] for name in MEASURED]
    with (
        silenced(),
        open_reel(path) as reel,
        mp.solutions.pose.Pose(static_image_mode=False, model_complexity=1) as graph,
    ):
        for frame, shown in enumerate(reel.frames(side=960)):
            points = graph.process(shown.image).pose_world_landmarks
            if points is not None and frame < len(found):
                seen = np.array(
                    [
                        [points.landmark[row].x, -points.landmark[row].y, points.landmark[row].z]
                        for row in rows
                    ]
                )
                found[frame] = seen @ film.path.axes[frame]
    known = ~np.isnan(found).any(axis=(1, 2))
    return np.nan_to_num(found), known


def _heading(film: Film) -> FloatArray:
    """Return rows (3, 3): to the right of the first frame's camera, up, and toward it."""
    right = film.path.axes[0, 0] * np.array([1.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    up = np.array([0.0, 1.0, 0.0])
    return np.stack([right, up, np.cross(right, up)])


def _from_hips(points: FloatArray) -> FloatArray:
    return np.asarray(points - points[:, _HIPS].mean(axis=1, keepdims=True))


def _mean_gap(one: FloatArray, two: FloatArray) -> float:
    return float(np.linalg.norm(one - two, axis=-1).mean()) if len(one) else float("nan")


def _acceleration(points: FloatArray, fps: float) -> FloatArray:
    return np.asarray(np.diff(points, n=2, axis=0) * fps**2)


def _slide(feet: FloatArray, stands: FloatArray, fps: float) -> float:
    """Return the mean speed, cm per second, of feet (T, 4, 2) while they stand (T - 1, 4)."""
    speed = 100 * fps * np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    return float(speed[stands].mean()) if stands.any() else float("nan")


SHEET = 6
"""Frames of a film on its sheet."""
_TILE = 240
"""Length of the longer side of a picture on the sheet, pixels."""


def film_sheet(frames: Sequence[ByteArray], motion: Motion) -> ByteArray:
    """Draw frames of a film, and below each the tracked joints from the camera and from the
    person's left: (H, W, 3) uint8.

    Parameters
    ----------
    frames : of (h, w, 3) uint8
        Frames from the motion's first one on.
    motion : Motion
    """
    columns = []
    for index in np.linspace(0, min(len(frames), motion.frames) - 1, SHEET).round().astype(int):
        image = frames[index]
        size = (_TILE, round(_TILE * image.shape[0] / image.shape[1]))
        joints = motion.joints[index] - motion.joints[index, 0] * np.array([1.0, 0.0, 1.0])
        views = [_stick(joints[:, axes], motion) for axes in ([0, 1], [2, 1])]
        columns.append(
            np.concatenate(
                [
                    cv2.resize(image, size, interpolation=cv2.INTER_AREA),
                    np.concatenate(views, axis=1),
                ]
            )
        )
    return np.asarray(np.concatenate(columns, axis=1), np.uint8)


def _stick(points: FloatArray, motion: Motion) -> ByteArray:
    """Draw bones between points (J, 2), meters, to the right and up; the left side is red."""
    canvas = np.full((_TILE, _TILE // 2, 3), 245, np.uint8)
    scale = _TILE / 2.2
    pixels = np.round(
        np.stack([_TILE / 4 + scale * points[:, 0], _TILE - 12 - scale * points[:, 1]], axis=-1)
    ).astype(int)
    cv2.line(canvas, (0, _TILE - 12), (_TILE // 2, _TILE - 12), (180, 180, 180), 1)
    for joint, parent in enumerate(motion.parents):
        if parent >= 0:
            name = motion.joint_names[joint]
            color = (
                (210, 40, 40)
                if name.startswith("left")
                else (40, 60, 210)
                if name.startswith("right")
                else (60, 60, 60)
            )
            cv2.line(canvas, pixels[parent].tolist(), pixels[joint].tolist(), color, 2, cv2.LINE_AA)
    return canvas


COLUMNS: Mapping[str, str] = {
    "frames": "frames", "error": "cm", "scaled": "cm, true size", "mediapipe_error": "mediapipe cm", "acceleration": "m/s²",
    "mediapipe_acceleration": "mediapipe m/s²", "true_acceleration": "true m/s²", "slide": "slide cm/s", "travel": "end off cm", "path": "path cm",
    "fps": "frames/s", "cpu_fps": "frames per core second",
}  # fmt: skip


def film_tables(scores: Sequence[FilmScore]) -> list[str]:
    """Return tables by kind of motion, by camera, and of every film, in Markdown."""
    by_kind = {
        kind: [one for one in scores if one.kind == kind]
        for kind in dict.fromkeys(one.kind for one in scores)
    }
    by_camera = {
        camera: [one for one in scores if one.camera == camera]
        for camera in dict.fromkeys(one.camera for one in scores)
    }
    return [
        "## By kind of motion", _table({**by_kind, "all": list(scores)}), "## By camera", _table(by_camera),
        "## Every film", _table({f"{one.name}, {one.camera}": [one] for one in scores}),
    ]  # fmt: skip


def _table(groups: Mapping[str, Sequence[FilmScore]]) -> str:
    lines = [
        "| | films | " + " | ".join(COLUMNS.values()) + " |",
        "| --- |" + " ---: |" * (len(COLUMNS) + 1),
    ]
    for name, own in groups.items():
        values = [float(np.nanmean([getattr(one, column) for one in own])) for column in COLUMNS]
        lines.append(
            f"| {name} | {len(own)} | "
            + " | ".join(f"{value:.0f}" if value >= 100 else f"{value:.1f}" for value in values)
            + " |"
        )
    return "\n".join(lines)

"""Track the hands of a person through a video: mediapipe's landmarks in every other frame, smoothed
palms and fingers, and the joints of the fingers for the motion."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from a2v.animation.hands import FINGERS
from a2v.body.registry import load_body_model
from a2v.footage.figure import NAMES, PARENTS
from a2v.geometry.polar import nearest_rotations
from a2v.geometry.vectors import unit
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.kinematics.skeleton import skeleton_from_parents
from a2v.kinematics.transforms import inverse_kinematics
from a2v.perception.detector import Solution, cut_square, silenced
from a2v.types import ByteArray, FloatArray, Motion

SIDES: tuple[str, ...] = ("left", "right")
SMALLEST = 10.0
"""Distance in pixels of the video from the wrist to the knuckles below which a hand is not
searched."""
LEAST = 0.15
"""Share of the frames in which a hand must be found. Below it, both hands keep the pose that suits
the action."""
_CROP = 224
_AROUND = 1.9
"""Half the side of the square that is searched, in lengths of the palm."""
_SPREAD = 0.07
"""Standard deviation in seconds of the weights by which neighboring frames are averaged."""
_REST = 0.04
"""Weight of the relaxed pose relative to that of a frame with a found hand."""
_RELAXED = (0.2, 0.45, 0.22)
"""Bend of a relaxed finger's three joints, radians."""
_MOST_TURN = 1.9
"""Largest plausible turn of the palm from the fitted wrist, radians."""

HAND_JOINTS: tuple[tuple[str, str], ...] = tuple(
    (
        f"{side}_{finger}_{place}",
        f"{side}_wrist" if place == 1 else f"{side}_{finger}_{place - 1}",
    )
    for side in SIDES
    for finger in FINGERS
    for place in (1, 2, 3, 4)
)
"""Joints of the fingers and their parents; the fourth is the tip."""


class HandTracker(Solution):
    """Mediapipe's hand model for one hand in a video; use as a context manager."""

    def _made(self, solutions: Any) -> Any:
        graph = solutions.hands.Hands(
            static_image_mode=False,
            max_num_hands=1,
            model_complexity=0,
            min_detection_confidence=0.25,
        )
        graph.process(np.zeros((32, 32, 3), np.uint8))
        return graph

    def look(self, image: ByteArray, keypoints: FloatArray, side: str) -> FloatArray | None:
        """Find one hand of the person.

        Parameters
        ----------
        image : (H, W, 3) uint8
        keypoints : (33, 3)
            BlazePose landmarks in pixels of the image, and their confidence.
        side : str
            "left" or "right".

        Returns
        -------
        (21, 3) float16 or None
            Meters from the middle of the hand: x to the right, y up, z towards the camera. None if
            the hand is too small, not found, or a hand of the other side.
        """
        wrist, index, little = (
            keypoints[LANDMARK_INDEX[f"{side}_{name}"]] for name in ("wrist", "index", "pinky")
        )
        reach = (index[:2] + little[:2]) / 2 - wrist[:2]
        forearm = wrist[:2] - keypoints[LANDMARK_INDEX[f"{side}_elbow"], :2]
        palm = max(float(np.linalg.norm(reach)), 0.35 * float(np.linalg.norm(forearm)))
        if palm < SMALLEST or min(wrist[2], index[2], little[2]) < 0.3:
            return None
        middle = (wrist[:2] + reach).astype(np.float64)
        square, scale = cut_square(image, middle, _AROUND * palm, _CROP)
        with silenced():
            found = self._graph.process(np.ascontiguousarray(square))
        if not found.multi_hand_landmarks:
            return None
        label = found.multi_handedness[0].classification[0].label
        if (label == "Left") == (side == "left"):  # the model expects mirrored pictures
            return None
        root = found.multi_hand_landmarks[0].landmark[0]
        there = (np.array([root.x, root.y]) - 0.5) * _CROP / scale + middle
        if np.linalg.norm(there - wrist[:2]) > palm:
            return None
        points = [[p.x, -p.y, -p.z] for p in found.multi_hand_world_landmarks[0].landmark]
        return np.array(points, np.float16)


@dataclasses.dataclass(frozen=True)
class Hands:
    """Both hands in every frame.

    Attributes
    ----------
    axes : (T, 2, 3, 3)
        Directions in the world, a row each: along the hand, out of the palm, towards the thumb.
    fingers : (T, 2, 5, 3, 3)
        Directions of the three bones of each of `FINGERS`, in those axes.
    seen : (2,)
        Share of the frames in which each hand was found.
    """

    axes: FloatArray
    fingers: FloatArray
    seen: FloatArray


def track_hands(
    found: Sequence[tuple[FloatArray | None, FloatArray | None]],
    wrists: FloatArray,
    yaw: FloatArray,
    tilt: FloatArray,
    times: FloatArray,
) -> Hands | None:
    """Smooth the landmarks of the hands over time. A hand that is not found for a while gets
    relaxed fingers.

    Parameters
    ----------
    found : T pairs
        Landmarks (21, 3) of the left and of the right hand, as of `HandTracker.look`.
    wrists : (T, 2, 3, 3)
        Rotations of the fitted wrists from the rest pose, in the world.
    yaw, tilt : (T,)
        Turn of the camera to its left and down, radians.
    times : (T,)
        Seconds.

    Returns
    -------
    Hands or None
        None if each hand is found in less than `LEAST` of the frames.
    """
    count = len(found)
    rest_axes = np.stack([_rest(side).axes for side in SIDES])
    fitted = np.einsum("tsij,saj->tsai", wrists, rest_axes)
    axes, fingers = fitted.copy(), np.tile(_relaxed(), (count, 2, 1, 1, 1))
    seen = np.array([[pair[side] is not None for pair in found] for side in (0, 1)])
    if seen.mean(axis=1).max() < LEAST:
        return None
    for side in (0, 1):
        own = np.flatnonzero(seen[side])
        if len(own) < 2:
            continue
        points = np.stack([np.asarray(found[frame][side], np.float64) for frame in own])
        turns = np.stack([_to_world(yaw[frame], tilt[frame]) for frame in own])
        points = np.einsum("tij,tnj->tni", turns, points)
        told = _axes_of(points, SIDES[side])
        bones = np.diff(points[:, 1:].reshape(-1, 5, 4, 3), axis=2)
        local = np.einsum("tai,tfbi->tfba", told, unit(bones))
        change = np.einsum("tai,tbi->tab", told, fitted[own, side])
        angle = np.arccos(np.clip((np.trace(change, axis1=1, axis2=2) - 1) / 2, -1, 1))
        good = angle < _MOST_TURN
        own, local, change = own[good], local[good], change[good]
        if len(own) < 2:
            continue
        weights = _kernel(times, times[own])
        mean = np.einsum("tn,nfba->tfba", weights, local) + _REST * _relaxed()
        fingers[:, side] = unit(mean)
        turn = np.einsum("tn,nab->tab", weights, change) + _REST * np.eye(3)
        axes[:, side] = nearest_rotations(turn) @ fitted[:, side]
    return Hands(axes=axes, fingers=fingers, seen=seen.mean(axis=1))


def with_hands(motion: Motion, hands: Hands) -> Motion:
    """Append the joints of the fingers (`HAND_JOINTS`) to a motion from a video.

    Parameters
    ----------
    motion : Motion
        T frames of `a2v.footage.figure.NAMES`.
    hands : Hands
        Hands in the same frames.
    """
    rows = []
    joints = motion.joints.astype(np.float64)
    for side, name in enumerate(SIDES):
        rest = _rest(name)
        wrist = joints[:, NAMES.index(f"{name}_wrist")]
        world = hands.axes[:, side]
        for finger in range(len(FINGERS)):
            at = wrist + np.einsum("tai,a->ti", world, rest.knuckles[finger])
            rows.append(at)
            for bone in range(3):
                step = np.einsum("tai,ta->ti", world, hands.fingers[:, side, finger, bone])
                at = at + rest.lengths[finger, bone] * step
                rows.append(at)
    joints = np.concatenate([joints, np.stack(rows, axis=1)], axis=1)
    names = (*NAMES, *(name for name, _ in HAND_JOINTS))
    parents = (*PARENTS, *(names.index(parent) for _, parent in HAND_JOINTS))
    skeleton = skeleton_from_parents(parents, names)
    return dataclasses.replace(
        motion,
        joints=joints.astype(np.float32),
        rotations=inverse_kinematics(joints, skeleton).astype(np.float32),
        parents=np.asarray(parents),
        joint_names=names,
    )


@dataclasses.dataclass(frozen=True)
class _RestHand:
    """A hand of the body at rest.

    Attributes
    ----------
    axes : (3, 3)
        See `Hands.axes`.
    knuckles : (5, 3)
        First joints of the fingers from the wrist, meters, in those axes.
    lengths : (5, 3)
        Lengths of the fingers' bones, meters.
    """

    axes: FloatArray
    knuckles: FloatArray
    lengths: FloatArray


@functools.lru_cache(maxsize=2)
def _rest(side: str) -> _RestHand:
    import torch

    model = load_body_model()
    heads = model.rest(torch.from_numpy(model.shape_default))[1].numpy().astype(np.float64)
    letter = side[0].upper()

    def head(name: str) -> FloatArray:
        found: FloatArray = heads[model.bone(f"{name}.{letter}")]
        return found

    wrist = head("wrist")
    chains = np.array(
        [[head(f"finger{finger}-{place}") for place in (1, 2, 3)] for finger in range(1, 6)]
    )
    points = np.zeros((1, 21, 3))
    points[0, 0] = wrist
    points[0, 1:].reshape(5, 4, 3)[:, :3] = chains
    axes = _axes_of(points, side)[0]
    lengths = np.linalg.norm(np.diff(chains, axis=1), axis=-1)
    return _RestHand(
        axes=axes,
        knuckles=(chains[:, 0] - wrist) @ axes.T,
        lengths=np.concatenate([lengths, 0.8 * lengths[:, 1:]], axis=1),
    )


def _axes_of(points: FloatArray, side: str) -> FloatArray:
    """Return axes (T, 3, 3), as `Hands.axes`, of hands with landmarks (T, 21, 3)."""
    wrist, index, middle, little = (points[:, row] for row in (0, 5, 9, 17))
    along = unit(middle - wrist)
    across = np.cross(index - wrist, little - wrist) * (1 if side == "right" else -1)
    palm = unit(across - (across * along).sum(-1, keepdims=True) * along)
    thumb = np.cross(palm, along) * (-1 if side == "right" else 1)
    return np.stack([along, palm, thumb], axis=1)


@functools.lru_cache(maxsize=1)
def _relaxed() -> FloatArray:
    """Return directions (5, 3, 3) of the bones of relaxed fingers, as `Hands.fingers`."""
    bend = np.cumsum(_RELAXED)
    finger = np.stack([np.cos(bend), np.sin(bend), np.zeros(3)], axis=1)
    thumb = unit(np.array([[0.78, 0.36, 0.5], [0.93, 0.3, 0.2], [0.97, 0.22, 0.08]]))
    return np.stack([thumb, *[finger] * 4])


def _to_world(yaw: float, tilt: float) -> FloatArray:
    """Return the rotation (3, 3) from the axes of a camera (right, up, backward) to the world's."""
    down = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    left = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    return np.asarray(left @ down.T)


def _kernel(times: FloatArray, own: FloatArray) -> FloatArray:
    """Return weights (T, n) of frames at `own` (n,) for frames at `times` (T,), seconds."""
    return np.asarray(np.exp(-0.5 * ((times[:, None] - own) / _SPREAD) ** 2))

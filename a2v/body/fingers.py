"""Bend the fingers of a fitted body as in the photo. The fit itself uses three landmarks per hand
and leaves fingers straight."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.skeleton import subtree
from a2v.types import Body, Camera, FloatArray, Subject

SIDES = {"left": ".L", "right": ".R"}
_KNUCKLE = (-0.5, 0.25, 1.6, 0.5)
"""Angle of a finger's knuckle relative to the body's straight, spread finger, radians: lowest,
relaxed, highest, and standard deviation. The following constants have the same form."""
_MIDDLE = (0.0, 0.4, 1.9, 0.5)
"""Angle of a finger's middle joint."""
_SPREAD = (-0.35, 0.0, 0.35, 0.12)
"""Sideways angle of a finger."""
_THUMB_IN = (-0.5, 0.1, 0.9, 0.3)
"""Angle of the thumb toward the palm."""
_THUMB_ACROSS = (-0.6, 0.1, 0.6, 0.3)
"""Angle of the thumb across the palm."""
_THUMB_TIP = (-0.3, 0.2, 1.2, 0.35)
"""Angle of the thumb's tip."""
_TURN = (-0.7, 0.0, 0.7, 0.25)
"""Angle of the whole hand about each of the wrist's three axes."""
_LAST = 0.6
"""Bend of a finger's last joint as a fraction of the middle one's."""
_PARALLEL = (0.14, 0.03, -0.08, -0.2)
"""Sideways turn of relaxed fingers, from the index to the little finger, radians: they are more
parallel than the body's spread ones."""
_PLACE = 0.007
"""Expected error of landmarks in the picture's plane, meters."""
_DEPTH = 0.03
"""Expected error of their depths, meters."""
_STEP = 1e-7
"""Step of the finite differences, radians."""
_SLACK = np.array([0.006, 0.006, 0.1])
"""Expected errors of the fit's wrist to the right and up, meters, and of the logarithm of its
hand's size."""


def bend_fingers(body: Body, subject: Subject, camera: Camera) -> Body:
    """Bend the fingers and turn the hands about the wrist by the landmarks ``subject.hands``; hands
    without landmarks are relaxed.

    Parameters
    ----------
    body : Body
        Anny, fitted to the photo, its fingers straight.
    subject : Subject
    camera : Camera

    Returns
    -------
    Body
        With new bones and skin; ``parameters`` stay those of the fit. `body` itself for another
        model.
    """
    if body.model != "anny":
        return body
    transforms = body.bone_transforms.astype(np.float64)
    for index, letter in enumerate(SIDES.values()):
        hand = _Hand(body, letter)
        seen = None
        if subject.hands is not None and subject.hands[index, 0, 3] > 0:
            seen = _places(subject.hands[index], camera, depth=float(transforms[hand.wrist, 2, 3]))
        transforms = hand.posed(transforms, hand.solved(transforms, seen))
    return reskinned(body, transforms)


class _Hand:
    """One hand of Anny: its bones, its axes at the fitted pose, and its angles.

    Angles (18,): three for the rotation of the hand. Knuckle, middle joint and spread for each
    finger from index to little finger. Three for the thumb: inwards, across, and its tip.
    """

    ranges = np.array(
        [_TURN] * 3 + [_KNUCKLE, _MIDDLE, _SPREAD] * 4 + [_THUMB_IN, _THUMB_ACROSS, _THUMB_TIP]
    )

    def __init__(self, body: Body, letter: str) -> None:
        self.wrist = body.bone_names.index(f"wrist{letter}")
        self.fingers = [
            [body.bone_names.index(f"finger{finger}-{joint}{letter}") for joint in (1, 2, 3)]
            for finger in (1, 2, 3, 4, 5)
        ]
        self.tips = body.bone_tails[[bones[2] for bones in self.fingers]].astype(np.float64)
        self.below = subtree(body.bone_parents, self.wrist)
        heads = body.bone_transforms[:, :3, 3].astype(np.float64)
        knuckles = heads[[bones[0] for bones in self.fingers[1:]]]
        self.along = unit(knuckles[1] - heads[self.wrist])
        across = (knuckles[3] - knuckles[0]) * (1 if letter == ".R" else -1)
        self.palm = unit(np.cross(self.along, across))  # out of the palm
        self.side = np.cross(self.palm, self.along)
        self.middle = self.ranges[:, 1].copy()
        self.middle[5:15:3] = np.array(_PARALLEL) * (-1 if letter == ".L" else 1)

    def posed(self, transforms: FloatArray, angles: FloatArray) -> FloatArray:
        """World transforms (B, 4, 4) with the hand's angles (18,)."""
        return np.asarray(self._posed(transforms, angles[None])[0][0])

    def _posed(self, transforms: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return world transforms (K, B, 4, 4) and fingertips (K, 5, 3) for angles (K, 18)."""
        out, tips = (
            np.repeat(values[None], len(angles), axis=0) for values in (transforms, self.tips)
        )
        for at, bones in enumerate(self.fingers[1:]):
            knuckle, middle, spread = angles[:, 3 + 3 * at : 6 + 3 * at].T[..., None]
            straight = unit(out[0, bones[1], :3, 3] - out[0, bones[0], :3, 3])
            sideways = rotvec_to_rotmat(spread * self.palm)
            hinge = sideways @ unit(np.cross(straight, self.palm))
            _turn(out, tips[:, at + 1], bones, 0, sideways)
            for place, angle in enumerate((knuckle, middle, _LAST * middle)):
                _turn(out, tips[:, at + 1], bones, place, rotvec_to_rotmat(angle * hinge))
        inwards, over, tip = angles[:, 15:].T[..., None]
        thumb = self.fingers[0]
        straight = unit(out[0, thumb[2], :3, 3] - out[0, thumb[0], :3, 3])
        hinge = unit(np.cross(straight, self.palm))
        for place, turn in (
            (0, inwards * hinge + over * self.palm),
            (1, 0.5 * tip * hinge),
            (2, tip * hinge),
        ):
            _turn(out, tips[:, 0], thumb, place, rotvec_to_rotmat(turn))
        whole = rotvec_to_rotmat(angles[:, :3] @ np.stack([self.along, self.palm, self.side]))
        center, back = out[:, self.wrist, :3, 3][:, None].copy(), np.swapaxes(whole, 1, 2)
        moved = out[:, self.below]
        moved[..., :3, :3] = whole[:, None] @ moved[..., :3, :3]
        moved[..., :3, 3] = center + (moved[..., :3, 3] - center) @ back
        out[:, self.below] = moved
        return out, center + (tips - center) @ back

    def points(self, transforms: FloatArray, angles: FloatArray) -> FloatArray:
        """Positions of mediapipe's 21 landmarks (K, 21, 3) at each of angles (K, 18)."""
        out, tips = self._posed(transforms, angles)
        heads = out[..., :3, 3]
        rows = [heads[:, [self.wrist]]]
        for at, bones in enumerate(self.fingers):
            rows += [heads[:, bones], tips[:, [at]]]
        return np.concatenate(rows, axis=1)

    def solved(self, transforms: FloatArray, seen: FloatArray | None) -> FloatArray:
        """Find angles (18,) that move the landmarks to the positions `seen` (21, 3).

        Angles that the landmarks do not determine stay near those of a relaxed hand.
        """
        from scipy.optimize import least_squares

        relaxed, (low, _, high, spread) = self.middle, self.ranges.T
        if seen is None:
            return relaxed

        center = transforms[self.wrist, :3, 3]

        def misses(unknowns: FloatArray) -> FloatArray:
            angles, slack = (
                unknowns[:, :-3],
                unknowns[:, -3:] * _SLACK,
            )  # otherwise fingers would bend to correct a wrong wrist or hand size of the fit
            points = center + np.exp(slack[:, 2])[:, None, None] * (
                self.points(transforms, angles) - center
            )
            points[..., :2] += slack[:, None, :2]
            error = (points - seen)[:, 1:] / [_PLACE, _PLACE, _DEPTH]
            return np.concatenate(
                [error.reshape(len(unknowns), -1), (angles - relaxed) / spread, unknowns[:, -3:]],
                axis=1,
            )

        def slopes(unknowns: FloatArray) -> FloatArray:
            """Return forward differences (m, 21), computed in one batch for speed."""
            changed = misses(
                np.concatenate([unknowns[None], unknowns + _STEP * np.eye(len(unknowns))])
            )
            return np.asarray((changed[1:] - changed[0]).T / _STEP)

        start = np.concatenate([np.clip(relaxed, low, high), np.zeros(3)])
        bounds = np.concatenate([low, np.full(3, -3.0)]), np.concatenate([high, np.full(3, 3.0)])
        found = least_squares(
            lambda x: misses(x[None])[0],
            start,
            slopes,
            bounds,
            loss="soft_l1",
            f_scale=2.0,
            max_nfev=40,
        )
        return np.asarray(found.x[:-3])


def _places(landmarks: FloatArray, camera: Camera, *, depth: float) -> FloatArray:
    """Return the positions (21, 3) of the landmarks (21, 4), meters. Their depths are relative to
    the wrist, whose z is `depth`."""
    return camera.unproject(
        landmarks[:, :2].astype(np.float64),
        depth + landmarks[:, 2].astype(np.float64) / camera.scale,
    )


def _turn(
    out: FloatArray, tips: FloatArray, bones: Sequence[int], place: int, turns: FloatArray
) -> None:
    """Rotate a finger's bones (K, B, 4, 4) from index `place` on, and its tips (K, 3), in place.

    The rotation (K, 3, 3) is about the head of the bone at `place`.
    """
    center = out[:, bones[place], :3, 3].copy()
    for bone in bones[place:]:
        out[:, bone, :3, :3] = turns @ out[:, bone, :3, :3]
        out[:, bone, :3, 3] = center + (turns @ (out[:, bone, :3, 3] - center)[..., None])[..., 0]
    tips[:] = center + (turns @ (tips - center)[..., None])[..., 0]


def reskinned(body: Body, transforms: FloatArray) -> Body:
    """Return the body with its bones at `transforms` (B, 4, 4)."""
    moved = transforms @ np.linalg.inv(body.bone_transforms.astype(np.float64))
    change = np.einsum("vb,bij->vij", body.weights.astype(np.float64), moved)
    plain = np.concatenate([body.vertices, np.ones((len(body.vertices), 1))], axis=1)
    vertices = np.einsum("vij,vj->vi", change, plain)[:, :3]
    tails = np.einsum(
        "bij,bj->bi",
        moved,
        np.concatenate([body.bone_tails, np.ones((len(body.bone_tails), 1))], axis=1),
    )[:, :3]
    return dataclasses.replace(
        body,
        vertices=vertices.astype(np.float32),
        bone_transforms=transforms.astype(np.float32),
        bone_tails=tails.astype(np.float32),
    )

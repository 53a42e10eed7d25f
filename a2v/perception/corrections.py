"""What a user corrects of what was seen in a photo: landmarks, which way a limb points, the mask,
and who is meant."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import brief
from a2v.kinematics import best_scale
from a2v.kinematics.names import LANDMARK_INDEX, LIMB_BONES, LIMBS_BY_HEIGHT
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.plain_yaml import parse_yaml
from a2v.types import FloatArray

MAX_BYTES = 1 << 20
"""Of a file of corrections."""
MAX_STROKES = 500
MAX_POINTS = 20_000
"""Of all strokes together."""
MAX_PERSON = 5
"""People that are told apart in a photo."""
UNITS = ("pixels", "fractions")
WAYS = {"front": 1.0, "back": -1.0}
"""Where the far end of a limb's bone lies, seen from its near end, and the sign of that depth."""
EXPECTED = "a YAML mapping with some of units, person, landmarks, limbs, mask"
_FAR = 100_000.0
"""Largest coordinate, pixels."""
_NEAR = 0.05
"""A landmark that is moved by less keeps its depth; fraction of the person's height."""
_ALONG = {
    f"{side}_{joint}": tuple(f"{side}_{name}" for name in names)
    for side in ("left", "right")
    for joint, names in {
        "wrist": ("pinky", "index", "thumb"),
        "ankle": ("heel", "foot_index"),
    }.items()
}
"""Landmarks of a hand or a foot, which move along with its joint."""
_LEAST_DEPTH = 0.35
"""Part of a limb's length by which its ends differ in depth at least, where somebody says which way
it points."""
_CORE = 0.7
"""Part of a stroke's radius within which the mask is certain; between it and the radius the photo's
edges count too."""


@dataclass(frozen=True, kw_only=True)
class Stroke:
    """A stroke of a brush on the mask.

    Attributes
    ----------
    points : tuple of (u, v)
        In the unit of the `Corrections`.
    radius : float
        The same; a fraction is one of the photo's longer side.
    add : bool
        The person is there, or is not.
    """

    points: tuple[tuple[float, float], ...]
    radius: float
    add: bool


@dataclass(frozen=True, kw_only=True)
class Corrections:
    """What a user says of a photo instead of the detectors.

    Attributes
    ----------
    units : "pixels" or "fractions"
        Of every position: pixels of the upright photo, u to the right and v down, or fractions of
        its width and height.
    person : int, (4,) tuple or None
        Who of several is meant: 1 is the largest; or left, top, right and bottom of a box around
        them.
    landmarks : tuple of (name, u, v)
        BlazePose landmarks; they are certain.
    limbs : tuple of (name, "front" or "back")
        Bones of `LIMB_BONES`: whether the end away from the trunk lies in front of (nearer to the
        camera than) the other one, or behind it.
    strokes : tuple of Stroke
        In the order in which they were drawn.
    """

    units: str = "pixels"
    person: int | tuple[float, ...] | None = None
    landmarks: tuple[tuple[str, float, float], ...] = ()
    limbs: tuple[tuple[str, str], ...] = ()
    strokes: tuple[Stroke, ...] = ()

    @classmethod
    def of(cls, content: object, source: object = "the corrections") -> Corrections:
        """Corrections out of YAML or JSON; see docs/perception.md. `source` is what messages call
        it.

        Raises
        ------
        InputError
            An unknown name, or a value that it cannot have.
        """
        found = {} if content is None else content
        if not isinstance(found, Mapping):
            raise InputError(f"{source}: {brief(found)} is no mapping; expected {EXPECTED}")
        _check_names(found, ("units", "person", "landmarks", "limbs", "mask"), source, "part")
        units = found.get("units", UNITS[0])
        if units not in UNITS:
            raise InputError(f"{source}: units are {brief(units)}; expected {' or '.join(UNITS)}")
        far = 2.0 if units == "fractions" else _FAR
        return cls(
            units=units, person=_person(found.get("person"), far, source), landmarks=_landmarks(found.get("landmarks"), far, source),
            limbs=_limbs(found.get("limbs"), source), strokes=_strokes(found.get("mask"), far, source),
        )  # fmt: skip

    def __bool__(self) -> bool:
        return self.person is not None or bool(self.landmarks or self.limbs or self.strokes)

    def said(self) -> dict[str, Any]:
        """As plain values, from which `of` makes it; what is empty is left out."""
        person = list(self.person) if isinstance(self.person, tuple) else self.person
        mask = [
            {
                "add" if one.add else "remove": [list(point) for point in one.points],
                "radius": one.radius,
            }
            for one in self.strokes
        ]
        landmarks, limbs = {name: [u, v] for name, u, v in self.landmarks}, dict(self.limbs)
        parts = {
            "units": self.units,
            "person": person,
            "landmarks": landmarks,
            "limbs": limbs,
            "mask": mask,
        }
        return {name: value for name, value in parts.items() if value}

    def to_yaml(self) -> str:
        """The text of a file that `read_corrections` reads."""
        import yaml

        return yaml.safe_dump(self.said(), sort_keys=False, default_flow_style=None, width=110)

    def in_pixels(self, width: int, height: int) -> Corrections:
        """The same in pixels of a photo of that size.

        Raises
        ------
        InputError
            A position lies farther outside of the photo than it is large.
        """
        scale = (float(width), float(height)) if self.units == "fractions" else (1.0, 1.0)
        side = max(width, height) if self.units == "fractions" else 1
        moved = self.scaled(scale, (0.0, 0.0), float(side))
        for name, u, v in moved.landmarks:
            if not (-width <= u <= 2 * width and -height <= v <= 2 * height):
                raise InputError(
                    f"the corrections put {name} at ({u:.0f}, {v:.0f}), far outside of the photo's {width} x {height} pixels; are they of this photo?"
                )
        return dataclasses.replace(moved, units="pixels")

    def scaled(
        self, scale: tuple[float, float], offset: tuple[float, float], radius: float
    ) -> Corrections:
        """The same where a position p is ``p * scale + offset`` and radii are `radius` times as
        large."""
        (a, b), (c, d) = scale, offset
        if a == b == radius == 1 and c == d == 0:
            return self
        person = self.person
        if isinstance(person, tuple):
            person = (person[0] * a + c, person[1] * b + d, person[2] * a + c, person[3] * b + d)
        landmarks = tuple((name, u * a + c, v * b + d) for name, u, v in self.landmarks)
        strokes = tuple(
            Stroke(
                points=tuple((u * a + c, v * b + d) for u, v in one.points),
                radius=one.radius * radius,
                add=one.add,
            )
            for one in self.strokes
        )
        return dataclasses.replace(self, person=person, landmarks=landmarks, strokes=strokes)


def read_corrections(data: bytes, source: object) -> Corrections:
    """Corrections out of a YAML file's bytes; `source` is what messages call it.

    Raises
    ------
    InputError
        It is no YAML, too long, or says what cannot be.
    """
    if len(data) > MAX_BYTES:
        raise InputError(
            f"{source} has {len(data) >> 10} kB; expected at most {MAX_BYTES >> 10} kB of corrections"
        )
    return Corrections.of(parse_yaml(data, source, "file of corrections", EXPECTED), source)


# --- what they change; positions are in pixels of the same picture


def draw_strokes(mask: FloatArray, strokes: Sequence[Stroke], *, core: bool = False) -> FloatArray:
    """The mask (H, W) float32 with the strokes drawn into it, in pixels of it; of their `core`
    alone if that is asked."""
    import cv2

    if not strokes:
        return mask
    drawn = mask
    for stroke in strokes:
        touched = np.zeros(mask.shape, np.uint8)
        radius = max(0.5, stroke.radius * (_CORE if core else 1.0))
        points = np.clip(np.round(np.array(stroke.points) * 8), -(2**28), 2**28).astype(np.int32)
        cv2.polylines(
            touched,
            [points[:, None]],
            False,
            1,
            max(1, min(round(2 * radius), 32767)),
            cv2.LINE_8,
            3,
        )
        for point in (points[0], points[-1]):
            cv2.circle(
                touched, (int(point[0]), int(point[1])), round(8 * radius), 1, -1, cv2.LINE_8, 3
            )
        drawn = np.where(touched > 0, np.float32(stroke.add), drawn)
    return np.asarray(drawn, np.float32)


def place_landmarks(points: FloatArray, corrections: Corrections) -> FloatArray:
    """Landmarks (33, 3), u, v and confidence, with the given ones in their places and certain;
    hands and feet move along with wrists and ankles."""
    if not corrections.landmarks:
        return points
    placed = points.copy()
    for name, u, v in corrections.landmarks:
        step = np.array([u, v], points.dtype) - points[LANDMARK_INDEX[name], :2]
        placed[[LANDMARK_INDEX[other] for other in _ALONG.get(name, ())], :2] += step
    for name, u, v in corrections.landmarks:
        placed[LANDMARK_INDEX[name]] = (u, v, 1.0)
    return placed


def correct_landmarks(
    points: FloatArray, points_3d: FloatArray, corrections: Corrections
) -> tuple[FloatArray, FloatArray]:
    """Landmarks in the picture and in space as the corrections have them.

    A landmark that is moved far has no depth from then on: what was seen of it was of something
    else. The bones of `Corrections.limbs` are turned to the said side by the depth that they have,
    or by what their length in the picture leaves, and what hangs on them moves along.

    Parameters
    ----------
    points : (33, 3)
        u, v in pixels, confidence.
    points_3d : (33, 3)
        Meters, y up, +z towards the camera; NaN where unknown.

    Returns
    -------
    The same, changed.
    """
    if not corrections.landmarks and not corrections.limbs:
        return points, points_3d
    placed = place_landmarks(points, corrections)
    space = points_3d.copy()
    known = np.isfinite(points_3d).all(axis=1)
    scale = 0.0
    if known.sum() >= 4:
        flat = points[:, :2] * np.array([1.0, -1.0])
        scale = best_scale(
            points_3d[known, :2].astype(np.float64),
            flat[known].astype(np.float64),
            points[known, 2].astype(np.float64) + 1e-6,
        )
    if scale > 1:
        step = (placed[:, :2] - points[:, :2]) / scale
        space[:, :2] += step * np.array([1.0, -1.0])
        space[np.hypot(*step.T) > _NEAR * TYPICAL_HEIGHT] = np.nan
    for name, way in (
        sorted(corrections.limbs, key=lambda limb: list(LIMB_BONES).index(limb[0]))
        if scale > 1
        else ()
    ):
        _turn(space, name, WAYS[way])
    return placed.astype(points.dtype), space.astype(points_3d.dtype)


def _turn(space: FloatArray, bone: str, sign: float) -> None:
    """Move the far end of a bone, and what hangs on it, to the front (1) or the back (-1); `space`
    (33, 3) is changed."""
    near, far, *hanging = (LANDMARK_INDEX[name] for name in LIMB_BONES[bone])
    if not np.isfinite(space[[near, far]]).all():
        return
    along = space[far] - space[near]
    first, last = (name.split("_")[1] for name in LIMB_BONES[bone][:2])
    length = LIMBS_BY_HEIGHT[(first, last)] * TYPICAL_HEIGHT
    depth = abs(along[2])
    if along[2] * sign < 0 or depth < _LEAST_DEPTH * length:
        left = math.sqrt(max(0.0, length**2 - float(along[:2] @ along[:2])))
        depth = max(depth, left, _LEAST_DEPTH * length)
    space[[far, *hanging], 2] += space[near, 2] + sign * depth - space[far, 2]


def given_landmarks(corrections: Corrections) -> np.ndarray | None:
    """Which landmarks (33,) bool the user has placed; None for none."""
    if not corrections.landmarks:
        return None
    given = np.zeros(len(LANDMARK_INDEX), bool)
    given[[LANDMARK_INDEX[name] for name, _, _ in corrections.landmarks]] = True
    return given


def told_sides(corrections: Corrections) -> np.ndarray | None:
    """The signs (8,) float32 that the user gives the depths of `LIMB_BONES`, 0 for none; None where
    nothing is said."""
    if not corrections.limbs:
        return None
    ways = dict(corrections.limbs)
    return np.array([WAYS.get(ways.get(name, ""), 0.0) for name in LIMB_BONES], np.float32)


# --- reading


def _check_names(found: Mapping[Any, Any], known: Sequence[str], source: object, what: str) -> None:
    for name in found:
        if name not in known:
            raise InputError(
                f"{source}: unknown {what} {brief(name)}; expected some of {', '.join(known)}"
            )


def _number(value: object) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool) and math.isfinite(value)


def _place(value: object, far: float, what: str, source: object) -> tuple[float, float]:
    if (
        not isinstance(value, list | tuple)
        or len(value) != 2
        or not all(map(_number, value))
        or max(map(abs, value)) > far
    ):
        raise InputError(
            f"{source}: {what} is at {brief(value)}; expected two numbers [u, v], at most {far:g}"
        )
    return float(value[0]), float(value[1])


def _person(value: object, far: float, source: object) -> int | tuple[float, ...] | None:
    if value is None:
        return None
    if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= MAX_PERSON:
        return value
    if (
        isinstance(value, list | tuple)
        and len(value) == 4
        and all(_number(one) and abs(one) <= far for one in value)
    ):
        left, top, right, bottom = (float(one) for one in value)
        if left < right and top < bottom:
            return left, top, right, bottom
    raise InputError(
        f"{source}: person is {brief(value)}; expected 1 (the largest) to {MAX_PERSON}, or a box [left, top, right, bottom]"
    )


def _landmarks(value: object, far: float, source: object) -> tuple[tuple[str, float, float], ...]:
    found = {} if value is None else value
    if not isinstance(found, Mapping):
        raise InputError(
            f"{source}: landmarks are {brief(found)}; expected a mapping such as {{left_wrist: [510, 380]}}"
        )
    _check_names(found, list(LANDMARK_INDEX), source, "landmark")
    return tuple(sorted((name, *_place(place, far, name, source)) for name, place in found.items()))


def _limbs(value: object, source: object) -> tuple[tuple[str, str], ...]:
    found = {} if value is None else value
    if not isinstance(found, Mapping):
        raise InputError(
            f"{source}: limbs are {brief(found)}; expected a mapping such as {{left_lower_arm: front}}"
        )
    _check_names(found, list(LIMB_BONES), source, "limb")
    for name, way in found.items():
        if not isinstance(way, str) or way not in WAYS:
            raise InputError(f"{source}: {name} is {brief(way)}; expected front or back")
    return tuple(sorted(found.items()))


def _strokes(value: object, far: float, source: object) -> tuple[Stroke, ...]:
    found = [] if value is None else value
    if not isinstance(found, list | tuple) or len(found) > MAX_STROKES:
        raise InputError(
            f"{source}: mask is {brief(found)}; expected a list of at most {MAX_STROKES} strokes such as {{add: [[510, 380], [520, 400]], radius: 12}}"
        )
    strokes = tuple(
        _stroke(one, far, f"stroke {number} of the mask", source)
        for number, one in enumerate(found, 1)
    )
    if sum(len(one.points) for one in strokes) > MAX_POINTS:
        raise InputError(
            f"{source}: the strokes of the mask have more than {MAX_POINTS} points; draw fewer"
        )
    return strokes


def _stroke(value: object, far: float, what: str, source: object) -> Stroke:
    if not isinstance(value, Mapping) or ("add" in value) == ("remove" in value):
        raise InputError(
            f"{source}: {what} is {brief(value)}; expected add or remove with points, and a radius"
        )
    _check_names(value, ("add", "remove", "radius"), source, f"part of {what}")
    points, radius = value.get("add", value.get("remove")), value.get("radius")
    if not isinstance(points, list | tuple) or not 1 <= len(points) <= MAX_POINTS:
        raise InputError(
            f"{source}: {what} has the points {brief(points)}; expected a list of [u, v]"
        )
    if not _number(radius) or not 0 < radius <= far:  # type: ignore[operator]  # a number, as was just found
        raise InputError(
            f"{source}: {what} has the radius {brief(radius)}; expected a number over 0"
        )
    places = tuple(_place(point, far, f"a point of {what}", source) for point in points)
    return Stroke(points=places, radius=float(radius), add="add" in value)  # type: ignore[arg-type]

"""A user's corrections of the detection in a photo: landmarks, directions of limbs, the mask, and
the selected person."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from a2v.errors import InputError
from a2v.io import brief
from a2v.kinematics.names import LANDMARK_INDEX, LIMB_BONES
from a2v.plain_yaml import parse_yaml

MAX_BYTES = 1 << 20
"""Largest size of a file of corrections, bytes."""
MAX_STROKES = 500
MAX_POINTS = 20_000
"""Largest number of points of all strokes together."""
MAX_PERSON = 5
"""Largest number of people that are distinguished in a photo."""
UNITS = ("pixels", "fractions")
WAYS = {"front": 1.0, "back": -1.0}
"""Position of the far end of a limb's bone relative to its near end, and the sign of that depth."""
EXPECTED = "a YAML mapping with some of units, person, landmarks, limbs, mask"
_FAR = 100_000.0
"""Largest coordinate, pixels."""


@dataclass(frozen=True, kw_only=True)
class Stroke:
    """A brush stroke on the mask.

    Attributes
    ----------
    points : tuple of (u, v)
        In the unit of the `Corrections`.
    radius : float
        In the same unit; a fraction is relative to the photo's longer side.
    add : bool
        True adds the stroke to the person; False removes it.
    """

    points: tuple[tuple[float, float], ...]
    radius: float
    add: bool


@dataclass(frozen=True, kw_only=True)
class Corrections:
    """Values given by the user. They replace the detectors' values.

    Attributes
    ----------
    units : "pixels" or "fractions"
        Of every position: pixels of the upright photo, u to the right and v down, or fractions of
        its width and height.
    person : int, (4,) tuple or None
        Which of several people is selected: 1 is the largest; or left, top, right and bottom of a
        box around the person.
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
        """Make corrections from parsed YAML or JSON; see docs/perception.md.

        `source` is its name in messages.

        Raises
        ------
        InputError
            A name is unknown, or a value is invalid.
        """
        found = {} if content is None else content
        if not isinstance(found, Mapping):
            raise InputError(f"{source}: {brief(found)} is not a mapping; expected {EXPECTED}")
        _check_names(found, ("units", "person", "landmarks", "limbs", "mask"), source, "part")
        units = found.get("units", UNITS[0])
        if units not in UNITS:
            raise InputError(f"{source}: units are {brief(units)}; expected {' or '.join(UNITS)}")
        far = 2.0 if units == "fractions" else _FAR
        return cls(
            units=units,
            person=_person(found.get("person"), far, source),
            landmarks=_landmarks(found.get("landmarks"), far, source),
            limbs=_limbs(found.get("limbs"), source),
            strokes=_strokes(found.get("mask"), far, source),
        )

    def __bool__(self) -> bool:
        return self.person is not None or bool(self.landmarks or self.limbs or self.strokes)

    def said(self) -> dict[str, Any]:
        """Return the corrections as plain values for `of`; empty ones are left out."""
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
        """Return the text of a file for `read_corrections`."""
        import yaml

        return yaml.safe_dump(self.said(), sort_keys=False, default_flow_style=None, width=110)

    def in_pixels(self, width: int, height: int) -> Corrections:
        """Return the corrections in pixels of a photo of this size.

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
                    f"the corrections put {name} at ({u:.0f}, {v:.0f}), far outside of the "
                    f"photo's {width} x {height} pixels; do they belong to it?"
                )
        return dataclasses.replace(moved, units="pixels")

    def scaled(
        self, scale: tuple[float, float], offset: tuple[float, float], radius: float
    ) -> Corrections:
        """Map positions p to ``p * scale + offset``, and multiply radii by `radius`."""
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
    """Read corrections from the bytes of a YAML file; `source` is its name in messages.

    Raises
    ------
    InputError
        The file is not YAML, is too long, or has an invalid value.
    """
    if len(data) > MAX_BYTES:
        raise InputError(
            f"{source} has {len(data) >> 10} kB; expected at most {MAX_BYTES >> 10} kB of "
            "corrections"
        )
    return Corrections.of(parse_yaml(data, source, "file of corrections", EXPECTED), source)


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
        f"{source}: person is {brief(value)}; expected 1 (the largest) to {MAX_PERSON}, or a box "
        "[left, top, right, bottom]"
    )


def _landmarks(value: object, far: float, source: object) -> tuple[tuple[str, float, float], ...]:
    found = {} if value is None else value
    if not isinstance(found, Mapping):
        raise InputError(
            f"{source}: landmarks are {brief(found)}; expected a mapping such as "
            f"{{left_wrist: [510, 380]}}"
        )
    _check_names(found, list(LANDMARK_INDEX), source, "landmark")
    return tuple(sorted((name, *_place(place, far, name, source)) for name, place in found.items()))


def _limbs(value: object, source: object) -> tuple[tuple[str, str], ...]:
    found = {} if value is None else value
    if not isinstance(found, Mapping):
        raise InputError(
            f"{source}: limbs are {brief(found)}; expected a mapping such as "
            f"{{left_lower_arm: front}}"
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
            f"{source}: mask is {brief(found)}; expected a list of at most {MAX_STROKES} strokes "
            f"such as {{add: [[510, 380], [520, 400]], radius: 12}}"
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
    if not _number(radius) or not 0 < radius <= far:  # type: ignore[operator]
        raise InputError(
            f"{source}: {what} has the radius {brief(radius)}; expected a number above 0"
        )
    places = tuple(_place(point, far, f"a point of {what}", source) for point in points)
    return Stroke(points=places, radius=float(radius), add="add" in value)  # type: ignore[arg-type]

"""Perspective cameras: the four that follow the character, and custom ones from a small YAML
file."""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import brief, read_bytes, shorten
from a2v.plain_yaml import parse_yaml
from a2v.record import Record
from a2v.rendering.framing import Framing, Subject
from a2v.types import NAME_PATTERN, VIEWS, FloatArray, RenderSettings

AZIMUTHS = {"front": 0.0, "back": 180.0, "left": 90.0, "right": -90.0}
"""Azimuths of the cameras of `VIEWS`, degrees from the front. A person who faces +z has its left at
+x."""


@dataclass(frozen=True, kw_only=True)
class ViewCamera(Record):
    """A perspective camera that renders a square picture.

    Attributes
    ----------
    origin, target : tuple of 3 float
        Position of the camera and the point that it looks at, meters, world.
    up : tuple of 3 float
        Direction that is up in the picture.
    fov : float
        Field of view, degrees, the same horizontally and vertically.
    """

    origin: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    fov: float = 28.0

    def __post_init__(self) -> None:
        values = np.array([*self.origin, *self.target, *self.up, self.fov], np.float64)
        if not np.isfinite(values).all() or not 0 < self.fov < 180:
            raise InputError(
                f"a camera with fov {self.fov} at {self.origin} cannot be used; expected finite "
                "numbers, fov in (0, 180)"
            )
        if np.linalg.norm(np.cross(self.up, np.subtract(self.target, self.origin))) < 1e-9:
            raise InputError(
                f"the camera at {self.origin} looks along its own up direction; choose another "
                "target or up"
            )

    @property
    def axes(self) -> FloatArray:
        """Rows (3, 3): the picture's right, up, and the direction towards the viewer, unit length,
        world."""
        backward = np.subtract(self.origin, self.target).astype(np.float64)
        backward /= np.linalg.norm(backward)
        right = np.cross(self.up, backward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(backward, right), backward])

    def project(self, points: FloatArray, size: int) -> FloatArray:
        """Project points (..., 3) in meters to pixels (..., 2): u to the right and v down.

        The center of the first pixel is (0.5, 0.5). Points behind the camera give NaN.
        """
        local = (np.asarray(points, np.float64) - self.origin) @ self.axes.T
        depth = np.where(local[..., 2] < 0, -local[..., 2], np.nan)
        reach = size / 2 / np.tan(np.radians(self.fov) / 2)
        return np.stack(
            [size / 2 + reach * local[..., 0] / depth, size / 2 - reach * local[..., 1] / depth],
            axis=-1,
        )


@dataclass(frozen=True, kw_only=True)
class CameraPath(Record):
    """How the camera of one view moves over a clip. Angles are degrees.

    A camera either stands around the character (`azimuth`, `elevation`, `turn`, `distance`,
    `follow`) or at a fixed point of the world (`origin`). A camera at `origin` looks at `target`;
    without a `target` it turns to follow the character.

    Attributes
    ----------
    name : str
        Name of the view and of its files.
    azimuth : float
        Direction from the character to the camera: 0 is in front of the person, 90 at its left, 180
        behind. The front is the person's mean facing over the clip.
    elevation : float
        Angle above the horizon, between -90 and 90, both excluded.
    turn : float
        Angle by which the camera moves around the character over the whole clip, toward the
        person's left. 360 gives a turntable that loops.
    fov : float
        Field of view.
    distance : float or None
        Distance from the character's middle, meters. None: the least distance at which the whole
        body is inside the margin in every frame.
    follow : bool
        True: the camera moves with the character. False: it stands still and shows the whole path.
    origin, target : tuple of 3 float or None
        Meters, world.
    """

    name: str
    azimuth: float = 0.0
    elevation: float = 0.0
    turn: float = 0.0
    fov: float = 28.0
    distance: float | None = None
    follow: bool = True
    origin: tuple[float, float, float] | None = None
    target: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if not re.fullmatch(NAME_PATTERN, self.name):
            raise InputError(
                f"'{self.name}' cannot be the name of a camera; expected letters, digits, - and "
                "_, since files get this name"
            )
        where = f"camera '{self.name}'"
        numbers = [
            self.azimuth,
            self.elevation,
            self.turn,
            self.fov,
            self.distance or 1.0,
            *(self.origin or ()),
            *(self.target or ()),
        ]
        if not np.isfinite(numbers).all():
            raise InputError(f"{where} holds a number that is not finite")
        if not -90 < self.elevation < 90 or not 0 < self.fov < 180:
            raise InputError(
                f"{where} has elevation {self.elevation} and fov {self.fov}; expected -90 < "
                "elevation < 90, 0 < fov < 180"
            )
        if self.distance is not None and self.distance <= 0:
            raise InputError(f"{where} has distance {self.distance}; expected meters above 0")
        if self.target is not None and self.origin is None:
            raise InputError(
                f"{where} has a target but no origin; give both, or azimuth and elevation"
            )
        placed = self.azimuth, self.elevation, self.turn, self.distance, self.follow
        if self.origin is not None and placed != (0.0, 0.0, 0.0, None, True):
            raise InputError(
                f"{where} has an origin, so it is fixed; leave out azimuth, elevation, turn, "
                "distance and follow"
            )

    def toward(self, frames: int, front: float = 0.0) -> FloatArray:
        """Return unit vectors (T, 3) from the character to the camera.

        `front` is the direction of azimuth 0, degrees about +y from +z.
        """
        angle = np.radians(front + self.azimuth + self.turn * np.arange(frames) / frames)
        rise = np.radians(self.elevation)
        return np.stack(
            [
                np.cos(rise) * np.sin(angle),
                np.full(frames, np.sin(rise)),
                np.cos(rise) * np.cos(angle),
            ],
            axis=-1,
        )


TURNTABLE = CameraPath(name="turntable", turn=360.0, elevation=6.0)
"""One turn around the character while it moves. A clip of a single pose gives the classic
turntable."""

MAX_CAMERA_FILE = 1 << 16


def read_cameras(path: str | os.PathLike[str]) -> tuple[CameraPath, ...]:
    """Read cameras from a YAML file: names, and under each the fields of `CameraPath`.

    ::

        hero:   {azimuth: 30, elevation: 12, fov: 35}
        orbit:  {turn: 360, elevation: 10, distance: 4}
        tripod: {origin: [2.5, 1.5, 3.0], target: [0, 0.9, 0], fov: 40}

    Raises
    ------
    InputError
        The file cannot be read, is not a YAML mapping, or has an unknown field or an unusable
        value. The message names the file and the camera.
    """
    import difflib

    try:
        data = read_bytes(path, limit=MAX_CAMERA_FILE, empty=True)
    except InputError as error:
        raise InputError(
            f"cannot read {path}: {str(error).removeprefix(f'cannot read {path}: ')}"
        ) from None
    content = parse_yaml(data, path, "YAML", "a few cameras")
    if not isinstance(content, dict) or not content:
        raise InputError(
            f"{path} has no cameras; expected names, each with fields such as {{azimuth: 30, "
            f"elevation: 12}}"
        )
    kinds = {
        field.name: field
        for field in dataclasses.fields(CameraPath)
        if field.name not in ("name", "provenance")
    }
    cameras = []
    for name, given in content.items():
        if not isinstance(name, str) or not isinstance(given, dict | None):
            raise InputError(
                f"{path}: camera {brief(name)} is not a mapping; expected fields such as "
                f"{{azimuth: 30, elevation: 12}}"
            )
        if name in VIEWS or name in (TURNTABLE.name, "video"):  # files have these names
            raise InputError(f"{path}: the name '{name}' is taken; choose another one")
        values: dict[str, Any] = {}
        for key, value in (given or {}).items():
            if key not in kinds:
                near = difflib.get_close_matches(shorten(key, 60), kinds, n=1)
                hint = f"did you mean {near[0]}?" if near else f"choose from {', '.join(kinds)}"
                raise InputError(
                    f"{path}: camera '{name}' has an unknown field '{shorten(key, 60)}'; {hint}"
                )
            values[key] = _field(value, f"{path}: {key} of camera '{name}'", key)
        try:
            cameras.append(CameraPath(name=name, **values))
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    return tuple(cameras)


def _field(value: Any, what: str, key: str) -> Any:
    def number(item: Any) -> float:
        if isinstance(item, bool) or not isinstance(item, int | float):
            raise InputError(f"{what} is {brief(item)}; expected a number")
        try:
            return float(item)
        except OverflowError:
            raise InputError(f"{what} has hundreds of digits; expected a number") from None

    if key == "follow":
        if not isinstance(value, bool):
            raise InputError(f"{what} is {brief(value)}; expected true or false")
        return value
    if key in ("origin", "target"):
        if not isinstance(value, list) or len(value) != 3:
            raise InputError(
                f"{what} is {brief(value)}; expected three numbers, [x, y, z] in meters"
            )
        return tuple(number(item) for item in value)
    return number(value)


def check_views(views: Sequence[str], cameras: Sequence[CameraPath] = ()) -> None:
    """Reject views that are neither built in nor among `cameras`.

    Raises
    ------
    InputError
        A view is unknown. The message lists the known ones.
    """
    known = [*VIEWS, TURNTABLE.name, *(camera.name for camera in cameras)]
    if unknown := [view for view in views if view not in known]:
        raise InputError(f"unknown view '{unknown[0]}'; choose from {', '.join(known)}")


def follow_cameras(
    track: FloatArray,
    settings: RenderSettings = RenderSettings(),  # noqa: B008 - frozen
    *,
    cameras: Sequence[CameraPath] = (),
    facing: FloatArray | None = None,
    fps: float = 30.0,
    framing: Framing = Framing(),  # noqa: B008 - frozen
) -> dict[str, tuple[ViewCamera, ...]]:
    """Return cameras that follow the character at half its height (paper, section 4.2.2).

    There is one camera per frame and view. The four views share one distance per frame and keep
    their directions over the clip. The standing character takes `Framing.share` of the picture's
    height; the cameras move back smoothly ahead of frames that need more room. (The paper keeps one
    distance over the clip.) If ``settings.follow`` is False, the cameras stand still and show the
    whole path. The distances of a turntable and of `cameras` are independent of the four views.

    Parameters
    ----------
    track : (T, N, 3) float
        The character over time, meters: all vertices, the `extreme_points` of each frame, or
        N = 2 for the least and greatest corners of each frame's bounding box.
    settings : RenderSettings
        Its `views`, `aspect` and `follow`.
    cameras : sequence of CameraPath
        Custom cameras that `views` may name besides the built-in ones.
    facing : (T,) float or None
        Angle about +y from +z to the character's facing, radians. The front view stands in the
        direction of the mean facing, so that it shows the face more than the back. None: at +z.
    fps : float
    framing : Framing

    Returns
    -------
    dict of view to T cameras

    Raises
    ------
    InputError
        `track` has another shape, no frames, or holds NaN; `facing` has another length; or a view
        is unknown.
    """
    check_views(settings.views, cameras)
    subject = Subject.of(track, framing, shape=settings.shape, fps=fps)
    frames = len(subject.path)
    front = 0.0 if facing is None else mean_facing(facing, frames)
    standing = [
        CameraPath(name=view, azimuth=AZIMUTHS[view], fov=framing.fov, follow=settings.follow)
        for view in AZIMUTHS
    ]
    shared = subject.path if settings.follow else subject.still
    needed = np.max(
        [subject.least_distances(shared, one.toward(frames, front), one.fov) for one in standing],
        axis=0,
    )
    found = {
        camera.name: _move_camera(
            camera, subject, front, needed=needed if camera in standing else None
        )
        for camera in (*standing, TURNTABLE, *cameras)
        if camera.name in settings.views
    }
    return {view: found[view] for view in settings.views}


def _move_camera(
    camera: CameraPath, subject: Subject, front: float, *, needed: FloatArray | None
) -> tuple[ViewCamera, ...]:
    """Return the camera of each of the T frames along one path.

    `front` is the direction of azimuth 0, degrees about +y from +z. `needed` (T,) are the distances
    in meters that the four built-in views share; None: the path has its own distances.
    """
    frames = len(subject.path)
    if camera.origin is not None:
        aims = subject.path if camera.target is None else np.tile(camera.target, (frames, 1))
        return tuple(
            ViewCamera(origin=camera.origin, target=_triple(aim), fov=camera.fov) for aim in aims
        )
    targets = subject.path if camera.follow else subject.still
    toward = camera.toward(frames, front)
    own = subject.least_distances(targets, toward, camera.fov) if needed is None else needed
    eases = camera.follow and (needed is not None or camera is TURNTABLE)
    distances = (
        subject.eased_distances(own, camera.fov)
        if eases
        else np.full(frames, camera.distance or own.max())
    )
    origins = targets + distances[:, None] * toward
    return tuple(
        ViewCamera(origin=_triple(origin), target=_triple(target), fov=camera.fov)
        for origin, target in zip(origins, targets, strict=True)
    )


def mean_facing(facing: FloatArray, frames: int) -> float:
    """Return the angle with the largest mean cosine to angles (T,), degrees; 0 if they cancel out.

    Raises
    ------
    InputError
        The number of angles is not `frames`, or one is not finite.
    """
    angles = np.asarray(facing, np.float64)
    if angles.shape != (frames,) or not np.isfinite(angles).all():
        raise InputError(
            f"facing has shape {angles.shape}; expected one finite angle for each of {frames} "
            "frames"
        )
    mean = np.exp(1j * angles).mean()
    return float(np.degrees(np.angle(mean))) if abs(mean) > 1e-6 else 0.0


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z

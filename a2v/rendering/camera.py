"""Perspective cameras, the four that follow the character, and cameras of one's own out of a small YAML file."""

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
from a2v.types import NAME_PATTERN, VIEWS, FloatArray, RenderSettings

AZIMUTHS = {"front": 0.0, "back": 180.0, "left": 90.0, "right": -90.0}
"""Where the cameras of `VIEWS` stand, degrees: the person faces +z and its left is +x."""


@dataclass(frozen=True, kw_only=True)
class ViewCamera(Record):
    """A perspective camera that renders a square picture.

    Attributes
    ----------
    origin, target : tuple of 3 float
        Where it stands and what it looks at, metres, world.
    up : tuple of 3 float
        Direction that is up in the picture.
    fov : float
        Field of view, degrees, the same across and up.
    """

    origin: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    fov: float = 28.0

    def __post_init__(self) -> None:
        values = np.array([*self.origin, *self.target, *self.up, self.fov], np.float64)
        if not np.isfinite(values).all() or not 0 < self.fov < 180:
            raise InputError(f"a camera with fov {self.fov} at {self.origin} cannot be used; expected finite numbers, fov in (0, 180)")
        if np.linalg.norm(np.cross(self.up, np.subtract(self.target, self.origin))) < 1e-9:
            raise InputError(f"the camera at {self.origin} looks along its own up direction; choose another target or up")

    @property
    def axes(self) -> FloatArray:
        """Rows (3, 3): the picture's right, up, and the direction towards the viewer, unit length, world."""
        backward = np.subtract(self.origin, self.target).astype(np.float64)
        backward /= np.linalg.norm(backward)
        right = np.cross(self.up, backward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(backward, right), backward])

    def project(self, points: FloatArray, size: int) -> FloatArray:
        """Pixels (..., 2), u to the right and v down, of points (..., 3) in metres; the first pixel's centre is (0.5, 0.5).

        Points behind the camera give NaN.
        """
        local = (np.asarray(points, np.float64) - self.origin) @ self.axes.T
        depth = np.where(local[..., 2] < 0, -local[..., 2], np.nan)
        reach = size / 2 / np.tan(np.radians(self.fov) / 2)
        return np.stack([size / 2 + reach * local[..., 0] / depth, size / 2 - reach * local[..., 1] / depth], axis=-1)


@dataclass(frozen=True, kw_only=True)
class CameraPath(Record):
    """How one view's camera moves over a clip. Angles are degrees.

    Either it stands around the character (`azimuth`, `elevation`, `turn`, `distance`, `follow`), or at a place of the world
    (`origin`): there it looks at `target`, or turns after the character where none is given.

    Attributes
    ----------
    name : str
        Name of the view and of its files.
    azimuth : float
        Where it stands: 0 before the person, 90 at its left (+x), 180 behind.
    elevation : float
        Height above the horizon as an angle, below 90 and above -90.
    turn : float
        How far it goes around the character over the whole clip, towards the person's left; 360 gives a turntable that loops.
    fov : float
        Field of view.
    distance : float or None
        From the character's middle, metres; None: the least at which the whole body keeps a border at every frame.
    follow : bool
        Go along with the character; False: stand still and see its whole path.
    origin, target : tuple of 3 float or None
        Metres, world.
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
            raise InputError(f"'{self.name}' names no camera; expected letters, digits, - and _, since files are named so")
        where = f"camera '{self.name}'"
        numbers = [self.azimuth, self.elevation, self.turn, self.fov, self.distance or 1.0, *(self.origin or ()), *(self.target or ())]
        if not np.isfinite(numbers).all():
            raise InputError(f"{where} holds a number that is not finite")
        if not -90 < self.elevation < 90 or not 0 < self.fov < 180:
            raise InputError(f"{where} has elevation {self.elevation} and fov {self.fov}; expected -90 < elevation < 90, 0 < fov < 180")
        if self.distance is not None and self.distance <= 0:
            raise InputError(f"{where} has distance {self.distance}; expected metres above 0")
        if self.target is not None and self.origin is None:
            raise InputError(f"{where} has a target but no origin; give both, or azimuth and elevation")
        placed = self.azimuth, self.elevation, self.turn, self.distance, self.follow
        if self.origin is not None and placed != (0.0, 0.0, 0.0, None, True):
            raise InputError(f"{where} has an origin, so it stands there; leave out azimuth, elevation, turn, distance and follow")

    def toward(self, frames: int) -> FloatArray:
        """Unit vectors (T, 3) from the character to the camera."""
        angle = np.radians(self.azimuth + self.turn * np.arange(frames) / frames)
        rise = np.radians(self.elevation)
        return np.stack([np.cos(rise) * np.sin(angle), np.full(frames, np.sin(rise)), np.cos(rise) * np.cos(angle)], axis=-1)


TURNTABLE = CameraPath(name="turntable", turn=360.0, elevation=6.0)
"""Once around the character while it moves; a clip of one pose makes the classical turntable."""

MAX_CAMERA_FILE = 1 << 16


def read_cameras(path: str | os.PathLike[str]) -> tuple[CameraPath, ...]:
    """Cameras of a YAML file: names, and under each the fields of `CameraPath`.

    ::

        hero:   {azimuth: 30, elevation: 12, fov: 35}
        orbit:  {turn: 360, elevation: 10, distance: 4}
        tripod: {origin: [2.5, 1.5, 3.0], target: [0, 0.9, 0], fov: 40}

    Raises
    ------
    InputError
        The file cannot be read, is no YAML mapping, or has an unknown field or an unusable value; file and camera are named.
    """
    import difflib

    try:
        data = read_bytes(path, limit=MAX_CAMERA_FILE, empty=True)
    except InputError as error:
        raise InputError(f"cannot read {path}: {str(error).removeprefix(f'cannot read {path}: ')}") from None
    content = parse_yaml(data, path, "YAML", "a few cameras")
    if not isinstance(content, dict) or not content:
        raise InputError(f"{path} has no cameras; expected names, each with fields such as {{azimuth: 30, elevation: 12}}")
    kinds = {field.name: field for field in dataclasses.fields(CameraPath) if field.name not in ("name", "provenance")}
    cameras = []
    for name, given in content.items():
        if not isinstance(name, str) or not isinstance(given, dict | None):
            raise InputError(f"{path}: camera {brief(name)} is no mapping; expected fields such as {{azimuth: 30, elevation: 12}}")
        if name in VIEWS or name in (TURNTABLE.name, "video"):  # files are named so
            raise InputError(f"{path}: the name '{name}' is taken; choose another one")
        values: dict[str, Any] = {}
        for key, value in (given or {}).items():
            if key not in kinds:
                near = difflib.get_close_matches(shorten(key, 60), kinds, n=1)
                hint = f"did you mean {near[0]}?" if near else f"choose from {', '.join(kinds)}"
                raise InputError(f"{path}: camera '{name}' has an unknown field '{shorten(key, 60)}'; {hint}")
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
            raise InputError(f"{what} is {brief(value)}; expected three numbers, [x, y, z] in metres")
        return tuple(number(item) for item in value)
    return number(value)


def check_views(views: Sequence[str], cameras: Sequence[CameraPath] = ()) -> None:
    """Reject views that are neither built in nor among `cameras`.

    Raises
    ------
    InputError
        It lists what there is.
    """
    known = [*VIEWS, TURNTABLE.name, *(camera.name for camera in cameras)]
    if unknown := [view for view in views if view not in known]:
        raise InputError(f"unknown view '{unknown[0]}'; choose from {', '.join(known)}")


def follow_cameras(
    track: FloatArray,
    settings: RenderSettings = RenderSettings(),  # noqa: B008 - frozen
    *,
    cameras: Sequence[CameraPath] = (),
    fov: float = 28.0,
    margin: float = 0.06,
    smoothing: float = 8.0,
    height: float | None = None,
) -> dict[str, tuple[ViewCamera, ...]]:
    """Cameras at half the character's height that follow it, one a frame and view (paper, section 4.2.2).

    The four views keep one distance and one direction for the whole clip, the same for all of them, so large that the
    whole body stays in the picture at every frame. A turntable and `cameras` have distances of their own.

    Parameters
    ----------
    track : (T, N, 3) float
        The character over time, metres: all vertices, or N = 2 for each frame's bounding box (least and greatest corner).
    settings : RenderSettings
        Its `views`.
    cameras : sequence of CameraPath
        What names in `views` besides the built-in ones mean.
    fov : float
        Of the four views, degrees.
    margin : float
        Free border on each side, a fraction of the picture.
    smoothing : float
        Standard deviation of the Gaussian low-pass on the character's path over the ground, frames.
    height : float or None
        The character's height, metres; None: the median over the clip of the tallest extent, at least half of the largest.

    Returns
    -------
    dict of view to T cameras

    Raises
    ------
    InputError
        `track` has another shape, no frames, or holds NaN; or a view is unknown.
    """
    check_views(settings.views, cameras)
    subject = _Subject.of(track, height=height, smoothing=smoothing, margin=margin, shape=settings.shape)
    frames = len(subject.path)
    standing = [CameraPath(name=view, azimuth=AZIMUTHS[view], fov=fov) for view in settings.views if view in AZIMUTHS]
    shared = max([0.5, *(subject.least_distance(subject.path, camera.toward(frames), fov) for camera in standing)])
    found: dict[str, tuple[ViewCamera, ...]] = {}
    for camera in (*standing, *(one for one in (TURNTABLE, *cameras) if one.name in settings.views)):
        if camera.origin is not None:
            aims = subject.path if camera.target is None else np.tile(camera.target, (frames, 1))
            found[camera.name] = tuple(ViewCamera(origin=camera.origin, target=_triple(aim), fov=camera.fov) for aim in aims)
            continue
        targets, toward = subject.path if camera.follow else subject.still, camera.toward(frames)
        distance = shared if camera in standing else camera.distance or max(0.5, subject.least_distance(targets, toward, camera.fov))
        origins = targets + distance * toward
        found[camera.name] = tuple(
            ViewCamera(origin=_triple(origin), target=_triple(target), fov=camera.fov)
            for origin, target in zip(origins, targets, strict=True)
        )
    return {view: found[view] for view in settings.views}


@dataclass(frozen=True, kw_only=True)
class _Subject:
    """Whom the cameras see: `points` (T, N, 3), its smooth `path` (T, 3) and the middle of all of it, `still` (T, 3), at half its
    height; `margin` is the free border on each side, a fraction of the picture, which spans `sides` of its longer side."""

    points: FloatArray
    path: FloatArray
    still: FloatArray
    margin: float
    sides: tuple[float, float]

    @classmethod
    def of(cls, track: FloatArray, *, height: float | None, smoothing: float, margin: float, shape: tuple[int, int]) -> _Subject:
        """See `follow_cameras`."""
        points = np.asarray(track, np.float64)
        if points.ndim != 3 or points.shape[-1] != 3 or points.shape[0] < 1 or points.shape[1] < 1:
            raise InputError(
                f"the character's track has shape {points.shape}; expected (frames, vertices, 3), or (frames, 2, 3) for bounds"
            )
        if not np.isfinite(points).all():
            raise InputError("the character's track holds NaN or infinite numbers; check the motion that moved it")
        low, high = points.min(axis=1), points.max(axis=1)
        if points.shape[1] == 2:  # the corners of the boxes stand for what is inside
            points = np.stack([np.where([i & 1, i & 2, i & 4], high, low) for i in range(8)], axis=1)
        if height is None:
            extent = high[:, 1] - low[:, 1]
            height = float(max(np.median(extent), 0.5 * extent.max()))
        centre = (low + high) / 2
        centre[:, 1] = height / 2
        still = np.tile((low.min(axis=0) + high.max(axis=0)) / 2, (len(centre), 1))
        still[:, 1] = height / 2
        return cls(
            points=points,
            path=_smooth_path(centre, smoothing),
            still=still,
            margin=margin,
            sides=(shape[0] / max(shape), shape[1] / max(shape)),
        )

    def least_distance(self, targets: FloatArray, toward: FloatArray, fov: float) -> float:
        """Metres from `targets` (T, 3) along `toward` (T, 3) from where the whole of it is in the picture at every frame."""
        reach = (1 - 2 * self.margin) * np.tan(np.radians(fov) / 2)
        right = np.cross((0.0, 1.0, 0.0), toward)
        right /= np.linalg.norm(right, axis=-1, keepdims=True)
        up = np.cross(toward, right)
        offsets = self.points - targets[:, None]
        across, along, depth = (np.einsum("tnc,tc->tn", offsets, axis) for axis in (right, up, toward))
        return float((np.maximum(np.abs(across) / self.sides[0], np.abs(along) / self.sides[1]) / reach + depth).max())


def _smooth_path(centre: FloatArray, smoothing: float) -> FloatArray:
    """A path (T, 3) through a Gaussian of `smoothing` frames."""
    from scipy.ndimage import gaussian_filter1d

    if smoothing <= 0 or len(centre) < 2:
        return centre
    # continued at both ends by point reflection, or the camera would lag behind whoever walks into the clip
    beyond = min(len(centre) - 1, int(4 * smoothing))
    padded = np.pad(centre, ((beyond, beyond), (0, 0)), mode="reflect", reflect_type="odd")
    path: FloatArray = gaussian_filter1d(padded, smoothing, axis=0, mode="nearest")[beyond : beyond + len(centre)]
    return path


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z

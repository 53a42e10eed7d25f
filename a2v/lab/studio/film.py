"""Studio films: an avatar with the motion of recorded people, filmed by a fixed, panning or
hand-held camera, with ground truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from a2v.errors import InputError
from a2v.geometry.rays import RayScene
from a2v.geometry.vectors import unit
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.posing import avatar_body
from a2v.lab.studio.solid import smooth_normals, weld
from a2v.types import ByteArray, FloatArray, IntArray, Motion

CAMERAS = ("still", "pan", "hand")
"""Kinds of camera: on a tripod; on a tripod whose head turns with the person; hand-held, which
turns, shakes and drifts."""
JOINTS: dict[str, str] = {
    "head": "Head",
    **{
        f"{side.lower()}_{joint}": f"{side}{bone}"
        for side in ("Left", "Right")
        for joint, bone in {
            "shoulder": "Arm",
            "elbow": "ForeArm",
            "wrist": "Hand",
            "hip": "UpLeg",
            "knee": "Leg",
            "ankle": "Foot",
            "foot": "ToeBase",
        }.items()
    },
}
"""Joints of the ground truth, and the avatar's bones whose heads they are."""
_ROOM = 7.0
"""Distance from the middle of the room to its walls, meters."""


@dataclass(frozen=True, kw_only=True)
class FilmSettings:
    """Settings of a studio film.

    Attributes
    ----------
    camera : str
        Kind of camera motion, from `CAMERAS`.
    width, height : int
        Size of a frame, pixels.
    lens : float
        Focal length, 35 mm equivalent, millimeters.
    yaw : float
        Direction from which the camera sees the person in the first frame, degrees; 0 is the front.
    distance, held : float
        Distance of the camera from the person's path, and its height above the floor, meters.
    seed : int
        Seed of the room, the light and the shaking hand.
    """

    camera: str = "still"
    width: int = 640
    height: int = 480
    lens: float = 28.0
    yaw: float = 0.0
    distance: float = 4.0
    held: float = 1.4
    seed: int = 0

    def __post_init__(self) -> None:
        if self.camera not in CAMERAS:
            raise InputError(f"camera is '{self.camera}'; choose from {', '.join(CAMERAS)}")


@dataclass(frozen=True, kw_only=True)
class CameraPath:
    """Positions of the camera (T, 3), meters, and its axes (T, 3, 3) in the world, one per row:
    right, up, ahead; `focal` is in pixels."""

    places: FloatArray
    axes: FloatArray
    focal: float


@dataclass(frozen=True, kw_only=True)
class Film:
    """A moving person in front of a camera.

    Attributes
    ----------
    avatar : Avatar
    transforms : (T, B, 4, 4)
        World from bone, meters; the floor is y = 0.
    path : CameraPath
    settings : FilmSettings
    fps : float
    """

    avatar: Avatar
    transforms: FloatArray
    path: CameraPath
    settings: FilmSettings
    fps: float

    @property
    def joints(self) -> dict[str, FloatArray]:
        """Positions (T, 3) of `JOINTS` in the world."""
        return {
            name: self.transforms[:, self.avatar.bone_names.index(bone), :3, 3].astype(np.float64)
            for name, bone in JOINTS.items()
        }

    def frames(self) -> Iterator[ByteArray]:
        """Yield pictures (H, W, 3) uint8."""
        room = _Room(self.settings.seed)
        places = weld(self.avatar.skin(self.avatar.rest_transforms))
        noise = np.random.default_rng([self.settings.seed, 3])
        for frame in range(len(self.transforms)):
            image = _draw(self, frame, room, places)
            image = cv2.GaussianBlur(image, (0, 0), 0.5) + noise.normal(0, 2.0, image.shape)
            yield np.clip(image, 0, 255).astype(np.uint8)


def shoot(avatar: Avatar, motion: Motion, settings: FilmSettings) -> Film:
    """Retarget a motion to an avatar, and place a camera in front of it.

    Parameters
    ----------
    avatar : Avatar
    motion : Motion
        One clip; its rate is the film's.
    """
    from a2v.animation.life import STILL
    from a2v.animation.retarget import RetargetSettings, retarget

    transforms = retarget(motion, avatar_body(avatar), settings=RetargetSettings(life=STILL))
    hips = transforms[:, 0, :3, 3].astype(np.float64)
    return Film(
        avatar=avatar,
        transforms=transforms,
        path=camera_path(hips, motion.fps, settings),
        settings=settings,
        fps=motion.fps,
    )


def camera_path(hips: FloatArray, fps: float, settings: FilmSettings) -> CameraPath:
    """Return a camera path that keeps hips (T, 3) in view."""
    count = len(hips)
    draw = np.random.default_rng([settings.seed, 1])
    flat = hips * [1.0, 0.0, 1.0]
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2 if settings.camera == "still" else flat[0]
    turn = np.radians(settings.yaw)
    away = np.array([np.sin(turn), 0.0, np.cos(turn)])
    focal = settings.lens / 43.27 * float(np.hypot(settings.width, settings.height))
    room = (
        0.5 * float(np.ptp(flat, axis=0).max()) * focal / settings.width * 2
        if settings.camera == "still"
        else 0.0
    )
    place = (
        middle
        + away * max(settings.distance, 1.2 + room + 2.0 * focal / settings.height * 0.62)
        + np.array([0.0, settings.held, 0.0])
    )
    places = np.repeat(place[None], count, axis=0)
    aim = np.repeat((middle + np.array([0.0, 0.9, 0.0]))[None], count, axis=0)
    if settings.camera != "still":
        from scipy.ndimage import gaussian_filter1d

        aim = gaussian_filter1d(flat, 0.35 * fps, axis=0, mode="nearest") + np.array(
            [0.0, 0.9, 0.0]
        )
    roll = np.zeros(count)
    if settings.camera == "hand":
        from scipy.ndimage import gaussian_filter1d

        shake = gaussian_filter1d(
            draw.normal(size=(count + 200, 7)), 0.15 * fps, axis=0, mode="wrap"
        )[100 : 100 + count]
        shake /= max(float(shake.std()), 1e-9)
        places = places + 0.02 * shake[:, :3]
        aim = aim + 0.04 * shake[:, 3:6]
        roll = 0.01 * shake[:, 6]
    ahead = unit(aim - places)
    right = unit(np.cross(ahead, np.array([0.0, 1.0, 0.0])))
    up = np.cross(right, ahead)
    cosine, sine = np.cos(roll)[:, None], np.sin(roll)[:, None]
    axes = np.stack([cosine * right + sine * up, cosine * up - sine * right, ahead], axis=1)
    return CameraPath(places=places, axes=axes, focal=focal)


class _Room:
    """Floor and walls with pictures on them, and a lamp."""

    def __init__(self, seed: int) -> None:
        draw = np.random.default_rng([seed, 2])
        self.floor, self.wall = _texture(draw, 512), _texture(draw, 512)
        for _ in range(14):  # pictures on the walls
            left, top = draw.integers(0, 460, 2)
            width, height = draw.integers(20, 70, 2)
            cv2.rectangle(
                self.wall,
                (int(left), int(top)),
                (int(left + width), int(top + height)),
                draw.uniform(30, 230, 3).tolist(),
                -1,
            )
            cv2.rectangle(
                self.wall,
                (int(left), int(top)),
                (int(left + width), int(top + height)),
                (40.0, 35.0, 30.0),
                2,
            )
        self.lamp = unit(np.array([draw.uniform(-0.6, 0.6), 1.0, draw.uniform(-0.2, 0.8)]))
        self.ambient = float(draw.uniform(0.35, 0.55))

    def shade(self, places: FloatArray, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return colors (n, 3) of the room along rays (n, 3) from `places` (n, 3), and their hits
        on the floor (n, 3), NaN for others."""
        with np.errstate(divide="ignore", invalid="ignore"):
            down = np.where(rays[:, 1] < -1e-6, -places[:, 1] / rays[:, 1], np.inf)
            walls = np.where(
                np.abs(rays[:, [0, 2]]) > 1e-9,
                (np.sign(rays[:, [0, 2]]) * _ROOM - places[:, [0, 2]]) / rays[:, [0, 2]],
                np.inf,
            )
        walls = np.where(walls > 0, walls, np.inf)
        side = walls.argmin(axis=1)
        way = np.minimum(down, walls.min(axis=1))
        hit = places + way[:, None] * rays
        on_floor = down <= walls.min(axis=1)
        along = np.where(side == 0, hit[:, 2], hit[:, 0])
        colors = np.where(
            on_floor[:, None],
            _look_up(self.floor, hit[:, 0] / 4, hit[:, 2] / 4),
            _look_up(self.wall, along / 8, hit[:, 1] / 8),
        )
        colors = np.where((hit[:, 1] > 3.5)[:, None], 225.0, colors)
        return colors, np.where(on_floor[:, None], hit, np.nan)


def _texture(draw: np.random.Generator, size: int) -> FloatArray:
    """Return a mottled texture (size, size, 3) that tiles."""
    base = draw.uniform(70, 190, 3)
    out = np.zeros((size, size, 3), np.float32) + base
    for octave in (4, 16, 64, 128):
        small = draw.normal(0, 26 / np.sqrt(octave / 4), (octave, octave, 1)).astype(np.float32)
        out += cv2.resize(small, (size, size), interpolation=cv2.INTER_CUBIC)[..., None]
    return np.asarray(np.clip(out, 0, 255), np.float32)


def _look_up(texture: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
    size = len(texture)
    columns, rows = (
        np.nan_to_num(np.floor(values * size), posinf=0, neginf=0).astype(np.int64) % size
        for values in (u, v)
    )
    return np.asarray(texture[rows, columns])


def _draw(film: Film, frame: int, room: _Room, places: IntArray) -> FloatArray:
    """Render a picture (H, W, 3) float, 0 to 255."""
    s, path, avatar = film.settings, film.path, film.avatar
    u, v = np.meshgrid(
        np.arange(s.width) + 0.5 - s.width / 2, np.arange(s.height) + 0.5 - s.height / 2
    )
    rays = unit(
        np.stack([u, -v, np.full_like(u, path.focal)], axis=-1).reshape(-1, 3) @ path.axes[frame]
    )
    eye = np.broadcast_to(path.places[frame], rays.shape)
    colors, floor = room.shade(eye, rays)
    vertices = avatar.skin(film.transforms[frame])
    scene = RayScene(vertices, avatar.faces)
    local = (vertices - path.places[frame]) @ path.axes[frame].T
    flat = path.focal * local[:, :2] / np.maximum(local[:, 2:], 0.1)
    low, high = flat.min(axis=0) - 2, flat.max(axis=0) + 2
    near = (
        (u.ravel() >= low[0])
        & (u.ravel() <= high[0])
        & (-v.ravel() >= low[1])
        & (-v.ravel() <= high[1])
    )
    inside = np.flatnonzero(near)
    hits = scene.cast(eye[inside].astype(np.float32), rays[inside].astype(np.float32))
    seen = inside[hits.hit]
    normals = smooth_normals(vertices, avatar.faces, places)
    shading = room.ambient + (1.1 - room.ambient) * np.maximum(
        hits.interpolate(normals, avatar.faces) @ room.lamp, 0
    )
    colors[seen] = (
        _skin_colors(avatar, hits.face[hits.hit], hits.barycentric[hits.hit]) * shading[:, None]
    )
    person = np.linalg.norm(floor[:, [0, 2]] - vertices[:, [0, 2]].mean(axis=0), axis=1) < 2.5
    person[seen] = False
    dark = np.flatnonzero(person)
    shadow = scene.occluded(
        floor[dark].astype(np.float32),
        np.broadcast_to(room.lamp, (len(dark), 3)).astype(np.float32),
    )
    colors[dark[shadow]] *= room.ambient + 0.15
    return np.asarray(colors.reshape(s.height, s.width, 3), np.float32)


def _skin_colors(avatar: Avatar, faces: IntArray, uv: FloatArray) -> FloatArray:
    """Return the texture's colors (n, 3), 0 to 255, where rays met faces (n,) at Embree's
    barycentric coordinates (n, 2)."""
    corners = avatar.uv[faces]
    spot = (
        (1 - uv.sum(axis=1, keepdims=True)) * corners[:, 0]
        + uv[:, :1] * corners[:, 1]
        + uv[:, 1:] * corners[:, 2]
    )
    height, width = avatar.texture.shape[:2]
    columns = np.clip((spot[:, 0] * width).astype(int), 0, width - 1)
    rows = np.clip(((1 - spot[:, 1]) * height).astype(int), 0, height - 1)
    return np.asarray(avatar.texture[rows, columns], np.float32)

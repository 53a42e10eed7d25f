"""Photographs of people in ordinary rooms, and of the same rooms without them, to measure the
removal of people from photos."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear, to_bytes
from a2v.lab.studio.avatar_files import list_avatars
from a2v.lab.studio.posing import natural_pose
from a2v.lab.studio.room_plan import RoomPlan
from a2v.lab.studio.stand import draw_outfit, prepare_avatar
from a2v.lab.studio.streams import Stream
from a2v.record import Record
from a2v.rendering.denoising import Layers, denoise
from a2v.rendering.person_mesh import mesh_object, render_mesh
from a2v.rendering.variant import activate
from a2v.types import ByteArray, FloatArray, Surface

VERSION = 1
"""Version of the rooms that a number gives. Raise it when rooms change."""
ROOMS = 12
"""Number of rooms of the benchmark."""
_SAMPLES = 32
"""Samples per pixel, before denoising."""
_NOISE = 1.5
"""Standard deviation of the sensor's noise, levels of 255; the same in both photos of a room."""
_MIDDLE = 0.42
"""Linear brightness of the median pixel of a photo."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RoomCase(Record):
    """A person in a room.

    Attributes
    ----------
    image, empty : (H, W, 3) uint8
        The photo, and the same room, light, exposure and noise without the person.
    mask : (H, W) float32
        Fraction of each pixel that the person covers.
    floor : (H, W) float32
        Fraction of each pixel of the empty room that shows the floor.
    front : (H, W) float32
        Fraction of each pixel of the photo that shows objects in front of the person.
    facts : mapping
        The avatar; the camera's origin and target, meters (the person stands at the origin of the
        floor); the field of view of the square around the photo, degrees; and the objects in the
        room.
    """

    image: ByteArray
    empty: ByteArray
    mask: FloatArray
    floor: FloatArray
    front: FloatArray
    facts: Mapping[str, Any] = field(default_factory=dict)


def open_room(
    number: int, data: str | os.PathLike[str], kept: str | os.PathLike[str] | None = None
) -> RoomCase:
    """Return room `number`, rendered or read from the folder `kept`.

    Parameters
    ----------
    number : int
        The same number gives the same room and person.
    data : path
        Folder with ``avatars/``.
    kept : path, optional
        Folder where rooms are stored for later calls.

    Raises
    ------
    InputError
        There are no avatars.
    """
    path = None if kept is None else Path(kept) / f"room-{number:03d}-{VERSION}.npz"
    if path is not None and path.exists():
        return RoomCase.load(path)
    avatars = list_avatars(Path(data) / "avatars")
    if not avatars:
        raise InputError(f"{data} has no avatars; give the data's folder")
    generator = np.random.default_rng([number, Stream.ROOM])
    person, name = _person(avatars[(7 * number + 3) % len(avatars)], generator)
    case = _rendered(RoomPlan.draw(number, generator, person), person, name, generator)
    if path is not None:
        case.save(path)
    return case


def _person(path: Path, generator: np.random.Generator) -> tuple[Surface, str]:
    """Return a clothed avatar in a natural pose, standing on the ground at the origin and roughly
    facing +z."""
    outfit = draw_outfit(prepare_avatar(str(path)), generator)
    avatar = outfit.avatar
    vertices = avatar.skin(avatar.bone_transforms(natural_pose(generator)))
    turn = np.radians(generator.uniform(-30, 30))
    vertices = vertices @ np.array(
        [[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]]
    )
    vertices = vertices - np.array(
        [vertices[:, 0].mean(), vertices[:, 1].min(), vertices[:, 2].mean()]
    )
    surface = Surface(
        vertices=vertices.astype(np.float32),
        faces=avatar.faces,
        colors=avatar.vertex_colors(),
        uv=avatar.uv,
        texture=outfit.texture,
    )
    return surface, avatar.name


def _rendered(
    plan: RoomPlan, person: Surface, name: str, generator: np.random.Generator
) -> RoomCase:
    mi = activate("auto", 1)
    width, height = plan.size
    room = _objects(mi, plan)
    full = {**room, "person": mesh_object(mi, render_mesh(person), person)}
    shown, empty = (_traced(mi, plan, objects) for objects in (full, room))
    exposure = _MIDDLE / np.median(empty)
    noise = generator.standard_normal((height, width, 1)) + 0.6 * generator.standard_normal(
        (height, width, 3)
    )
    pictures = [
        to_bytes(np.clip(linear_to_srgb(_tone(light * exposure)) + _NOISE / 255 * noise, 0, 1))
        for light in (shown, empty)
    ]
    square = np.degrees(
        2 * np.arctan(np.tan(np.radians(plan.fov) / 2) * max(width, height) / width)
    )
    camera = {"origin": plan.origin.tolist(), "target": plan.target.tolist(), "fov": float(square)}
    return RoomCase(
        image=pictures[0],
        empty=pictures[1],
        mask=_share(mi, plan, person, "person"),
        floor=_share(mi, plan, None, "floor"),
        front=_share(mi, plan, person, "table"),
        facts={"avatar": name, **camera, "things": sorted({box[0] for box in plan.boxes})},
    )


def _tone(light: FloatArray) -> FloatArray:
    """Compress values above 0.7 smoothly, as cameras do."""
    light = np.maximum(light, 0)
    return np.where(light > 0.7, 0.7 + 0.3 * (1 - np.exp(-np.maximum(light - 0.7, 0) / 0.3)), light)


def _traced(mi: Any, plan: RoomPlan, objects: Mapping[str, Any]) -> FloatArray:
    """Render linear light (H, W, 3), denoised."""
    scene = mi.load_dict({"type": "scene", "sensor": _sensor(mi, plan), **objects})
    color = np.array(
        mi.render(
            scene, integrator=mi.load_dict({"type": "path", "max_depth": 6}), spp=_SAMPLES, seed=1
        ),
        np.float32,
    )
    guide = np.array(
        mi.render(
            scene,
            integrator=mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"}),
            spp=16,
            seed=1,
        ),
        np.float32,
    )
    layers = Layers(
        color=color[..., :3],
        albedo=guide[..., -6:-3],
        normal=guide[..., -3:],
        alpha=np.ones(color.shape[:2], np.float32),
    )
    return denoise(layers)


def _share(mi: Any, plan: RoomPlan, person: Surface | None, name: str) -> FloatArray:
    """Return the fraction of each pixel (H, W) that shows objects whose names begin with `name`:
    only they are white."""
    objects = {key: thing for key, thing in _objects(mi, plan).items() if "bsdf" in thing}
    objects = {
        key: {**thing, "bsdf": _paint(np.full(3, float(key.startswith(name))))}
        for key, thing in objects.items()
    }
    if person is not None:
        white = {"type": "rgb", "value": float(name == "person")}
        objects["person"] = mesh_object(
            mi, render_mesh(person), person, bsdf={"type": "diffuse", "reflectance": white}
        )
    scene = mi.load_dict({"type": "scene", "sensor": _sensor(mi, plan), **objects})
    found = np.array(
        mi.render(
            scene, integrator=mi.load_dict({"type": "aov", "aovs": "albedo:albedo"}), spp=16, seed=1
        ),
        np.float32,
    )
    return np.clip(found[..., -1], 0, 1)


def _sensor(mi: Any, plan: RoomPlan) -> dict[str, Any]:
    """Return the camera as a Mitsuba dictionary."""
    width, height = plan.size
    look = mi.ScalarTransform4f().look_at(
        origin=plan.origin.tolist(), target=plan.target.tolist(), up=[0, 1, 0]
    )
    film = {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "rfilter": {"type": "box"},
        "pixel_format": "rgb",
    }
    return {
        "type": "perspective",
        "fov": plan.fov,
        "fov_axis": "x",
        "to_world": look,
        "film": film,
        "sampler": {"type": "independent"},
    }


def _objects(mi: Any, plan: RoomPlan) -> dict[str, Any]:
    """Return floor, ceiling, walls, furniture and lights as Mitsuba dictionaries."""
    away, turn = plan.back
    side, beside = plan.side
    floor = mi.Bitmap(np.ascontiguousarray(plan.floor))
    tiles = mi.ScalarTransform3f().scale([8.0, 8.0])
    room = mi.ScalarTransform4f
    texture = {"type": "bitmap", "bitmap": floor, "to_uv": tiles, "wrap_mode": "repeat"}
    paint = _paint(plan.wall)
    back = room().rotate([0, 1, 0], turn).translate([0, 1.3, -away])
    where, radius, light = plan.lamp
    daylight, radiance = plan.window
    return {
        "floor": {
            "type": "rectangle",
            "to_world": room().rotate([1, 0, 0], -90).scale(6.0),
            "bsdf": {"type": "diffuse", "reflectance": texture},
        },
        "ceiling": {
            "type": "rectangle",
            "to_world": room().translate([0, 2.6, 0]).rotate([1, 0, 0], 90).scale(8.0),
            "bsdf": _paint(np.full(3, 0.92)),
        },
        "back": {
            "type": "rectangle",
            "to_world": back @ room().scale([8.0, 1.3, 1.0]),
            "bsdf": paint,
        },
        "skirting": {
            "type": "cube",
            "to_world": back
            @ room().translate([0, -1.26, 0.01])
            @ room().scale([8.0, 0.04, 0.012]),
            "bsdf": _paint(np.full(3, 0.9)),
        },
        "side": {
            "type": "rectangle",
            "to_world": room()
            .rotate([0, 1, 0], turn)
            .translate([side * beside, 1.3, 0])
            .rotate([0, 1, 0], -90 * side)
            .scale([8.0, 1.3, 1.0]),
            "bsdf": paint,
        },
        "behind": {
            "type": "rectangle",
            "to_world": room()
            .translate([0, 1.3, 5.5])
            .rotate([0, 1, 0], 180)
            .scale([8.0, 1.3, 1.0]),
            "bsdf": paint,
        },
        "lamp": {
            "type": "disk",
            "to_world": room().translate(where.tolist()).rotate([1, 0, 0], 90).scale(radius),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": light.tolist()}},
        },
        "window": {
            "type": "rectangle",
            "to_world": room()
            .translate([daylight * 3.2, 1.5, 1.5])
            .rotate([0, 1, 0], -90 * daylight)
            .scale([1.0, 0.8, 1.0]),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance.tolist()}},
        },
        **{
            f"{name}{number}": {
                "type": "cube",
                "to_world": room()
                .rotate([0, 1, 0], yaw if name == "table" else 0)
                .translate([0, 0, 0])
                @ (room() if name == "table" else room().rotate([0, 1, 0], turn))
                @ room().translate(middle.tolist()).scale(half.tolist()),
                "bsdf": _paint(color),
            }
            for number, (name, middle, half, yaw, color) in enumerate(plan.boxes)
        },
    }


def _paint(color: FloatArray) -> dict[str, Any]:
    """Return matte paint of an sRGB color (3,)."""
    return {
        "type": "twosided",
        "inside": {
            "type": "diffuse",
            "reflectance": {"type": "rgb", "value": srgb_to_linear(color).tolist()},
        },
    }

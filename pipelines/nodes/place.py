"""Nodes for a view in the photo's own place: the person steps out of the picture."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np

from a2v.animation import RetargetSettings
from a2v.rendering.place import Place
from a2v.rendering.room import Spot
from a2v.types import Body, Character, PhotoCamera, RenderSettings, Subject, Surface
from pipelines.engine.memo import measure, memo, note
from pipelines.engine.refs import Ref
from pipelines.engine.store import current, get, put
from pipelines.nodes.rendering import encode, threaded
from pipelines.nodes.values import Blob, Image, Poses, Vertices, load_character

_STAYS = 0.95
"""Share of the frames on the floor and in the picture above which no note is given."""
_TRIAL = 256
"""Side of the picture by which the lights are fitted, pixels; twice as many for the person's light.
"""


@memo()
def place(
    photo: Ref[Blob],
    subject: Ref[Subject],
    photo_camera: Ref[PhotoCamera],
    body: Ref[Body],
    character: Ref[Character],
    shaded_surface: Ref[Surface],
    frame_settings: Ref[RenderSettings],
) -> Ref[Place]:
    """Paint the person out of the photo; find its camera and matching lights."""
    from a2v.animation.entrance import photo_to_world
    from a2v.body.parts import PARTS
    from a2v.perception import decode_photo
    from a2v.perception.behind import regions_of
    from a2v.perception.paint_out import in_photo, paint_out
    from a2v.rendering.occluders import find_things
    from a2v.rendering.place import estimate_light, exposed, light_on, square
    from a2v.rendering.room import SIDE, find_floor
    from a2v.rendering.viewpoint import find_viewpoint, perspective_camera, soles_slope

    person, found, camera = (
        load_character(current().address, character),
        get(subject, Subject),
        get(photo_camera, PhotoCamera),
    )
    data = bytes(get(photo, Blob))
    picture, frame = square(
        paint_out(decode_photo(data)[..., :3], in_photo(found.mask, found.crop, found.photo_size))
    )
    feet = [person.parts == PARTS.index(name) for name in ("left_foot", "right_foot")]
    surface = get(
        shaded_surface, Surface
    )  # in the photo's pose, which a canonical character does not have
    flat = camera.flatten(surface.vertices)
    seen = dataclasses.replace(surface, vertices=flat)
    viewpoint = find_viewpoint(soles_slope(seen, feet), told=camera.distance or None)
    measure({"slope": viewpoint.slope, "distance": viewpoint.distance, "height": viewpoint.height})
    offset = photo_to_world(get(body, Body))
    taken_by, moved = perspective_camera(found, camera.flat, flat, offset, viewpoint)
    moved += flat - surface.vertices
    vertices = surface.vertices + offset.astype(np.float32) + moved
    stood = vertices[np.logical_or(*feet)][:, [0, 2]].mean(axis=0)
    regions = regions_of(picture, min(SIDE, len(picture)))
    floor = find_floor(picture, taken_by, stood, regions)
    things = find_things(floor, regions, taken_by)
    trial = dataclasses.replace(get(frame_settings, RenderSettings), size=_TRIAL, aspect="1:1")
    look = estimate_light(surface)
    look = exposed(look, 1 / light_on(surface, vertices, taken_by, look, trial).mean(axis=0))
    light = light_on(surface, vertices, taken_by, look, dataclasses.replace(trial, size=2 * _TRIAL))
    return put(
        Place(
            picture=picture,
            camera=taken_by,
            moved=moved,
            look=look,
            frame=frame,
            light=light,
            floor=floor,
            things=things,
        )
    )


@memo()
def spot(
    poses: Ref[Poses], body: Ref[Body], place: Ref[Place], retarget: RetargetSettings
) -> list[Ref[Spot]]:
    """Return where each frame stands in the photo's place.

    The path of the clip is turned and bent so that it stays on the floor and in the picture.
    """
    from a2v.rendering.room import find_detour, standing_room

    moves, where = get(poses, Poses), get(place, Place)
    roots = moves.bone_transforms[:, 0, :3, 3][:, [0, 2]]
    tall = float(np.ptp(get(body, Body).vertices[:, 1]))
    allowed = standing_room(where.floor, where.camera, where.frame, len(where.picture), tall)
    found = find_detour(roots, allowed, fps=moves.fps, entering=retarget.from_photo)
    measure({"on_floor_and_in_picture": found.share})
    if found.share < _STAYS:
        note(
            f"the photo shows too little floor: {1 - found.share:.0%} of the frames of photo.mp4 "
            "leave it, or the picture"
        )
    return [put(one) for one in found.spots]


@memo()
def photo_frame(
    body: Ref[Body],
    shaded_surface: Ref[Surface],
    vertices: Ref[Vertices],
    spot: Ref[Spot],
    place: Ref[Place],
    frame_settings: Ref[RenderSettings],
) -> Ref[Image]:
    """Render one frame in the photo's place; nearer objects occlude the person."""
    from a2v.animation.entrance import photo_to_world
    from a2v.rendering.occluders import behind_things
    from a2v.rendering.viewpoint import as_seen

    renderer, where = (
        _renderer(current().address, shaded_surface, place, frame_settings),
        get(place, Place),
    )
    start = get(shaded_surface, Surface).vertices + photo_to_world(get(body, Body)).astype(
        np.float32
    )
    stands = get(spot, Spot)
    shown = stands.moved(get(vertices, Vertices).vertices)
    picture = renderer.render(as_seen(shown, start, where.moved), where.camera)
    toward = np.array(stands.place) - (where.camera.origin[0], where.camera.origin[2])
    distance = float(np.linalg.norm(toward))
    return put(Image.of(behind_things(picture, where.picture, where.things, distance)))


@functools.lru_cache(maxsize=1)
def _renderer(
    address: str,
    shaded_surface: Ref[Surface],
    place: Ref[Place],
    frame_settings: Ref[RenderSettings],
) -> Any:
    """Return the scene, which is kept for later frames in the same process."""
    from a2v.rendering import Renderer
    from a2v.rendering.place import without_light
    from pipelines.engine.store import Store

    store = Store(address)
    settings = dataclasses.replace(
        threaded(store.get(frame_settings, RenderSettings)), background="image", aspect="1:1"
    )
    where = store.get(place, Place)
    return Renderer(
        without_light(store.get(shaded_surface, Surface), where.light),
        settings,
        look=where.look,
        backdrop=where.picture,
    )


@memo()
def photo_clip(photo_frame: np.ndarray, place: Ref[Place], poses: Ref[Poses]) -> Ref[Blob]:
    """Encode the photo's place as an MP4 of the photo's shape."""
    where = get(place, Place)
    scale = get(photo_frame[0], Image).pixels.shape[0] / len(where.picture)
    left, top, right, bottom = (
        round(edge * scale / 2) * 2 for edge in where.frame
    )  # video needs even sizes
    return put(
        encode(
            (get(ref, Image).pixels[top:bottom, left:right] for ref in photo_frame),
            get(poses, Poses).fps,
        )
    )

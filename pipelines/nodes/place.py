"""The photo's own place as one more view: the person steps out of the picture."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np

from a2v.rendering.place import Place
from a2v.types import Character, OrthographicCamera, RenderSettings, Subject
from pipelines.memo import memo
from pipelines.nodes.rendering import encode, threaded
from pipelines.nodes.values import Blob, Image, Poses, Vertices, load_character
from pipelines.store import Ref, current, get, put

_TRIAL = 256
"""Pixels a side of the picture by which the lights are set; twice as many where their light on the person is read."""


@memo()
def place(
    photo: Ref[Blob], subject: Ref[Subject], photo_camera: Ref[OrthographicCamera], character: Ref[Character], look: Ref[RenderSettings]
) -> Ref[Place]:
    """Paint the person out of the photo, find its camera, and lights under which the character looks as in the photo."""
    from a2v.animation.entrance import photo_to_world
    from a2v.perception import decode_photo
    from a2v.perception.paint_out import in_photo, paint_out
    from a2v.rendering.place import estimate_light, exposed, light_on, square
    from a2v.rendering.place import photo_camera as camera_of

    person, found = load_character(current().address, character), get(subject, Subject)
    pixels = decode_photo(bytes(get(photo, Blob)))[..., :3]
    mask = in_photo(found.mask, found.crop, found.photo_size)
    offset = photo_to_world(person.body)
    camera = camera_of(found, get(photo_camera, OrthographicCamera), person.surface, offset)
    picture, frame = square(paint_out(pixels, mask))
    vertices = person.surface.vertices + offset.astype(np.float32)
    trial = dataclasses.replace(get(look, RenderSettings), size=_TRIAL, aspect="1:1")
    scene = estimate_light(person.surface)
    scene = exposed(scene, 1 / light_on(person.surface, vertices, camera, scene, trial).mean(axis=0))
    light = light_on(person.surface, vertices, camera, scene, dataclasses.replace(trial, size=2 * _TRIAL))
    return put(Place(picture=picture, camera=camera, scene=scene, frame=frame, light=light))


@memo()
def placed(character: Ref[Character], posed: Ref[Vertices], place: Ref[Place], look: Ref[RenderSettings]) -> Ref[Image]:
    """Render one frame in the photo's place."""
    renderer = _renderer(current().address, character, place, look)
    return put(Image.of(renderer.render(get(posed, Vertices).vertices, get(place, Place).camera)))


@functools.lru_cache(maxsize=1)
def _renderer(address: str, character: Ref[Character], place: Ref[Place], look: Ref[RenderSettings]) -> Any:
    """The scene, kept for the frames that follow in the same process."""
    from a2v.rendering import Renderer
    from a2v.rendering.place import without_light
    from pipelines.store import Store

    store = Store(address)
    settings = dataclasses.replace(threaded(store.get(look, RenderSettings)), background="image", aspect="1:1")
    where = store.get(place, Place)
    surface = without_light(load_character(address, character).surface, where.light)
    return Renderer(surface, settings, scene=where.scene, backdrop=where.picture)


@memo()
def photo_clip(placed: np.ndarray, place: Ref[Place], poses: Ref[Poses]) -> Ref[Blob]:
    """The photo's place as an MP4 of the photo's shape."""
    where = get(place, Place)
    scale = get(placed[0], Image).pixels.shape[0] / len(where.picture)
    left, top, right, bottom = (round(edge * scale / 2) * 2 for edge in where.frame)  # video wants even sizes
    return put(encode((get(ref, Image).pixels[top:bottom, left:right] for ref in placed), get(poses, Poses).fps))

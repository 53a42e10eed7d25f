"""One quick view: a posed person, photographed at 256 pixels, and the ground truth of the maps'
pixels."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from a2v.body.places import CanonicalPlaces
from a2v.geometry.rays import Hits, RayScene, SideView, side_view
from a2v.lab.studio.guide import Guide
from a2v.lab.studio.photograph import Around, Film, light_scene, photograph_scene
from a2v.lab.studio.posing import Pose
from a2v.lab.studio.quick.settings import QuickSettings
from a2v.lab.studio.quick.views import MAP, PHOTO, QuickView
from a2v.lab.studio.solid import smooth_normals
from a2v.lab.studio.stand import Outfit, PreparedAvatar, Sitting, Stand, stand
from a2v.lab.studio.things.clutter import NOTHING, Clutter, among
from a2v.lab.studio.things.framing import LEAST_LEFT, Square, unhidden
from a2v.lab.studio.variation import Build
from a2v.types import ByteArray, FloatArray, IntArray, OrthographicCamera, Surface

FILM = Film(size=PHOTO, shadows=128, rays=4, lamp_rays=2, blur=0.8, lamp_blur=0.8)
LEAST_SEEN = 0.03
"""Smallest fraction of the pixels of the map of shadows that must show the person."""


def softened(texture: ByteArray) -> ByteArray:
    """Blur a texture (H, W, 3) to the resolution of quick photos, so that one ray per pixel misses
    no detail."""
    return np.asarray(cv2.GaussianBlur(texture, (0, 0), texture.shape[0] / 1024))


def places_of(prepared: PreparedAvatar, guide: Guide, places: CanonicalPlaces) -> FloatArray:
    """Return the places (V, 3) of an avatar's vertices on the body: those of the nearest vertex of
    its guide, both at rest."""
    from scipy.spatial import cKDTree

    avatar = prepared.avatar
    rest = guide.posed(avatar, Build(), avatar.rest_transforms)
    _, nearest = cKDTree(rest).query(avatar.skin(avatar.rest_transforms))
    return np.asarray(places.places[nearest])


def quick_view(
    outfit: Outfit,
    guide: Guide,
    places: FloatArray,
    pose: Pose,
    settings: QuickSettings,
    generator: np.random.Generator,
    clutter: Clutter = NOTHING,
) -> QuickView | None:
    """Turn, frame, light and photograph a posed person; None if the picture shows too little of the
    person.

    Parameters
    ----------
    outfit : Outfit
        Its texture `softened`.
    guide : Guide
        The person's guide, for the landmarks.
    places : (V, 3) float
        Places of the person's vertices (`places_of`).
    clutter : Clutter
        Objects around the person. The pose must hold those in the hands.
    """
    yaw = float(
        generator.normal(0, settings.yaw)
        if generator.random() < settings.facing
        else generator.uniform(-180, 180)
    )
    placed = stand(outfit, pose, yaw, generator, distance=settings.distance, height=settings.height)
    solids = clutter.solids(placed, generator)
    framed = placed.seen if solids is None else unhidden(placed.seen, solids[0], generator)
    square = _draw_square(framed, settings, generator)
    origin, side = np.append(square.middle, placed.seen[:, 2].mean()), square.side
    alone = _sit(placed, origin, side)
    bare = RayScene(alone.surface.vertices, alone.surface.faces)
    rays, sitting, seen = bare, alone, _see(bare, alone, FILM.shadows)
    person = seen.hits.hit
    if person.mean() < LEAST_SEEN:
        return None
    if solids is not None:
        sitting = among(alone, solids[0].moved(-origin), solids[1])
        rays = RayScene(sitting.surface.vertices, sitting.surface.faces)
        seen = _see(rays, sitting, FILM.shadows)
        left = seen.hits.hit & sitting.is_person(seen.hits.face)
        if left.mean() < LEAST_SEEN or left.sum() < LEAST_LEFT * person.sum():
            return None
    lit = light_scene(rays, sitting, seen, generator, FILM)
    feet = float(
        np.clip(np.ceil(alone.camera.project(alone.surface.vertices)[:, 1].max()) + 2, 0, PHOTO)
    )
    around = Around(
        *clutter.around(PHOTO, feet, person.reshape(FILM.shadows, FILM.shadows), generator)
    )
    photo = photograph_scene(rays, sitting, seen, lit, generator, FILM, around=around)
    fore, rear = _see(bare, alone, MAP), _see(bare, alone, MAP, -1)
    marks = placed.landmarks(guide) - origin
    return QuickView(
        photo=cv2.imencode(
            ".jpg", photo.image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, photo.quality]
        )[1].ravel(),
        mask=photo.mask > 127,
        things=(photo.things > 127) & (photo.mask <= 127),
        places=_places_seen(fore.hits, alone.surface.faces, places),
        front=_depth(fore, side),
        back=_depth(rear, side),
        landmarks=np.stack(
            [marks[:, 0] / side + 0.5, 0.5 - marks[:, 1] / side, marks[:, 2] / side], axis=-1
        ).astype(np.float32),
        scale=1 / side,
        yaw=float((yaw + 180) % 360 - 180),
        camera=np.array(
            [
                placed.frame.over_floor,
                placed.frame.pitch,
                0.5 - square.middle[0] / side,
                0.5 + square.middle[1] / side,
            ],
            np.float32,
        ),
    )


def _see(rays: RayScene, scene: Sitting, size: int, side: int = 1) -> SideView:
    """Render a scene on `size` pixels a side, from the front (1) or, through it, the back (-1)."""
    return side_view(rays, scene.normals, scene.camera, PHOTO, size, side)


def _draw_square(
    seen: FloatArray, settings: QuickSettings, generator: np.random.Generator
) -> Square:
    """Draw the photographed square around a person's vertices (V, 3) in the frame."""
    square = Square.around(seen, float(generator.uniform(settings.fill[0], settings.fill[1])))
    square = replace(
        square, middle=square.middle + square.extent * settings.shift * generator.standard_normal(2)
    )
    return square.cut(generator) if generator.random() < settings.cut else square


def _sit(placed: Stand, origin: FloatArray, side: float) -> Sitting:
    """Return the person around `origin` (3,) in front of the camera of a square of `side`
    meters."""
    outfit = placed.outfit
    avatar, vertices = outfit.avatar, (placed.seen - origin).astype(np.float32)
    surface = Surface(
        vertices=vertices,
        faces=avatar.faces,
        colors=np.zeros((len(vertices), 3), np.float32),
        uv=avatar.uv,
        texture=outfit.texture,
    )
    return Sitting(
        surface=surface,
        normals=smooth_normals(vertices, avatar.faces, outfit.prepared.places),
        camera=OrthographicCamera(scale=PHOTO / side, center_u=PHOTO / 2, center_v=PHOTO / 2),
    )


def _places_seen(hits: Hits, faces: IntArray, places: FloatArray) -> IntArray:
    """Return the places (64, 64, 3) int8 of the nearest corner of each hit of the maps' pixels."""
    face, uv = hits.face[hits.hit], hits.barycentric[hits.hit]
    nearest = np.concatenate([1 - uv.sum(axis=1, keepdims=True), uv], axis=1).argmax(axis=1)
    seen = np.zeros((MAP * MAP, 3), np.int8)
    seen[hits.hit] = np.rint(127 * places[faces[face, nearest]])
    return seen.reshape(MAP, MAP, 3)


def _depth(view: SideView, side: float) -> FloatArray:
    return np.asarray(view.depth / side, np.float16)

"""Photograph a scene and sample the person's surface, without the maps and the signed distances of
a whole view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.rays import RayScene, SideView, side_view
from a2v.lab.studio.photograph import Around, Photograph, light_scene, photograph_scene
from a2v.lab.studio.samples import SurfaceSamples, sample_surface
from a2v.lab.studio.scene import Scene
from a2v.lab.studio.solid import Solid
from a2v.lab.studio.stand import Sitting
from a2v.lab.studio.view import MAP_SIZE, PHOTO_SIZE, jpeg_of
from a2v.types import ByteArray


@dataclass(frozen=True, eq=False)
class Shot:
    """A photo of a scene, with samples of the person's surface.

    Attributes
    ----------
    photo : Photograph
    rays : RayScene
        Of the person alone.
    fore : SideView
        The person alone from the front, `MAP_SIZE` pixels a side.
    solid : Solid
        The person.
    samples : SurfaceSamples
        Points on the person's outer surface.
    """

    photo: Photograph
    rays: RayScene
    fore: SideView
    solid: Solid
    samples: SurfaceSamples

    @property
    def image(self) -> ByteArray:
        """The photo after its JPEG compression, (1024, 1024, 3) uint8 sRGB."""
        import cv2

        code = jpeg_of(self.photo.image, self.photo.quality)
        return np.ascontiguousarray(cv2.imdecode(code, cv2.IMREAD_COLOR)[..., ::-1], np.uint8)


def photograph(
    scene: Scene, count: int, generator: np.random.Generator, backdrop: np.random.Generator
) -> Shot:
    """Photograph a scene and sample the person's surface.

    Parameters
    ----------
    scene : Scene
    count : int
        Number of samples of the surface.
    generator : numpy Generator
        Draws the light, the camera's noise and the samples.
    backdrop : numpy Generator
        Draws the photograph in the background, if there is one.
    """
    rays = RayScene(scene.surface.vertices, scene.surface.faces)
    fore = side_view(rays, scene.normals, scene.camera, PHOTO_SIZE, MAP_SIZE, 1)
    shown: Sitting = scene
    all_rays, front = rays, fore
    if scene.shown is not None:
        shown, surface = scene.shown, scene.shown.surface
        all_rays = RayScene(surface.vertices, surface.faces)
        front = side_view(all_rays, shown.normals, scene.camera, PHOTO_SIZE, MAP_SIZE, 1)
    behind = (
        scene.clutter.photographs.draw(PHOTO_SIZE, backdrop) if scene.clutter.photographs else None
    )
    lit = light_scene(all_rays, shown, front, generator)
    photo = photograph_scene(all_rays, shown, front, lit, generator, around=Around(behind))
    solid = scene.solid()
    samples = sample_surface(scene, solid, all_rays, photo.gain, count, generator)
    return Shot(photo, rays, fore, solid, samples)

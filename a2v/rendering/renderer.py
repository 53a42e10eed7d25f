"""One scene, many frames. Only arrays change between pictures, so nothing is rebuilt or
recompiled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import srgb_bytes
from a2v.rendering.camera import ViewCamera
from a2v.rendering.cutout import LUMINANCE, Cutout, behind, continued
from a2v.rendering.denoising import Layers, denoise, denoise_person
from a2v.rendering.empty import Empty, empty_stage, rays
from a2v.rendering.ground import kept_light
from a2v.rendering.matter import matter_of
from a2v.rendering.person_mesh import mesh_object, render_mesh
from a2v.rendering.region import region
from a2v.rendering.scene import LookSettings, stage
from a2v.rendering.shown import Shown
from a2v.rendering.tracer import Tracer
from a2v.rendering.variant import activate
from a2v.types import BoolArray, ByteArray, FloatArray, RenderSettings, Surface


@dataclass(frozen=True, kw_only=True)
class _Parts:
    """A linear picture (H, W, 3) and its parts.

    `kept` (H, W, 3) is the fraction of the stage's light that the ground keeps. `alpha` (H, W) is
    the fraction of each pixel that the person covers, `person` (H, W) the same, but 0 where the
    person's color was not sampled, and `color` (H, W, 3) is that color times `person`.
    """

    picture: FloatArray
    kept: FloatArray
    color: FloatArray
    person: FloatArray
    alpha: FloatArray


class Renderer:
    """Renders one surface in any number of poses and cameras.

    A picture depends only on its vertices, its camera and the settings, not on earlier pictures. So
    frames may be rendered in any order and by several processes. All frames use the same seed, so
    that still parts do not flicker.

    Parameters
    ----------
    surface : Surface
        Topology and colors: `texture` by `uv` if present, else vertex `colors`.
    settings : RenderSettings
        `spp` is rounded up to a number that multi-jittered sampling supports (8, 16, 35 for 32,
        64).
    look : LookSettings
    bsdf : dict or None
        Mitsuba material, in which "surface" stands for the surface's colors. None: the material of
        `a2v.rendering.matter` with LLVM, else diffuse.
    extra : dict or None
        More Mitsuba objects, or replacements of the stage's ("ground": None removes it).
    backdrop : (H, W, 3) uint8 or None
        sRGB picture for the background "image". Its middle is scaled to fill the frame.
    bare : (V,) bool or None
        Vertices of head and hands. If the surface has no face, those with a skin color determine
        the color of skin (`matter_of`).

    Raises
    ------
    InputError
        The surface has no faces, or the background is "image" and `backdrop` is None.
    """

    def __init__(
        self,
        surface: Surface,
        settings: RenderSettings = RenderSettings(),  # noqa: B008 - frozen
        look: LookSettings = LookSettings(),
        *,
        bsdf: dict[str, Any] | None = None,
        extra: dict[str, Any] | None = None,
        backdrop: ByteArray | None = None,
        bare: BoolArray | None = None,
    ) -> None:
        if len(surface.faces) == 0:
            raise InputError("the surface has no faces to render")
        self._behind = behind(settings, backdrop)
        self.settings, self.look = settings, look
        self._count = len(surface.vertices)
        self._surface = surface
        mi = activate(settings.variant, settings.threads)
        self.variant: str = mi.variant()
        self._mesh = render_mesh(surface)
        objects = stage(mi, look) | (extra or {})
        self._objects = objects
        self._color = mi.load_dict(
            {"type": "path", "max_depth": look.bounces + 1, "rr_depth": 64, "hide_emitters": True}
        )
        # a separate pass costs a sixth of the same pass wrapped around the path integrator
        self._guide = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
        person = mesh_object(mi, self._mesh, surface, bsdf=bsdf)
        self._main = self._scene(mi, {"person": person, **objects})
        own = (
            bsdf is None and not extra and self.variant.startswith("llvm")
        )  # objects that the tracer supports; all others need Mitsuba's integrator
        matter = matter_of(surface, bare) if own and look.gloss else None
        of_faces = None if matter is None else np.median(matter[surface.faces], axis=1)
        self._tracer = Tracer(mi, self._main.scene, person, look, of_faces) if own else None
        self._alone: Shown | None = None
        self._holdout: Shown | None = None
        self._empty: Shown | None = None
        self._ground: FloatArray | None = None
        self._clear: tuple[ViewCamera, Empty] | None = None

    def layers(
        self,
        vertices: FloatArray,
        camera: ViewCamera,
        *,
        spp: int | None = None,
        seed: int | None = None,
    ) -> Layers:
        """Trace one picture without denoising; `spp` and `seed` replace those of the settings."""
        mi = activate(self.variant, self.settings.threads)
        self._show(mi, self._main, camera, np.asarray(vertices, np.float32))
        return self._trace(
            mi,
            self._main,
            self.settings.spp if spp is None else spp,
            self.settings.seed if seed is None else seed,
        )

    def _trace(self, mi: Any, shown: Shown, samples: int, seed: int) -> Layers:
        color = np.array(
            mi.render(shown.scene, integrator=self._color, spp=samples, seed=seed), np.float32
        )
        samples = (
            4 if self.variant.startswith("scalar") else max(samples, 4)
        )  # on other variants this pass is as slow as the full one
        guide = np.array(
            mi.render(shown.scene, integrator=self._guide, spp=samples, seed=seed), np.float32
        )
        missed = 1 - color[..., 3:]
        return Layers(
            color=color[..., :3] + missed * self._sky(shown.camera),
            albedo=guide[..., :3] + missed * self.look.ground_albedo,
            normal=guide[..., 3:6] + missed * np.array((0, 1, 0), np.float32),
            alpha=color[..., 3],
        )

    def linear(self, vertices: FloatArray, camera: ViewCamera) -> FloatArray:
        """Render one picture in linear RGB (H, W, 3) float32, denoised if the settings say so.

        On the unchanged stage only the person and the light on the ground around it are traced and
        denoised, and composited over the empty stage.
        """
        if self._tracer is None:
            return self._finished(self.layers(vertices, camera))
        return self._parts(self._tracer, vertices, camera).picture

    def _parts(self, tracer: Tracer, vertices: FloatArray, camera: ViewCamera) -> _Parts:
        """Trace the person and the ground's light, and composite them with the empty stage."""
        vertices, size, seed = (
            np.asarray(vertices, np.float32),
            self.settings.size,
            self.settings.seed,
        )
        mi = activate(self.variant, self.settings.threads)
        self._show(mi, self._main, camera, vertices, sensor=False)  # the tracer has its own
        empty = self._empty_stage(camera)
        found = region(vertices, self._surface.faces, camera, self.look, empty).within(
            self.settings.window
        )
        kept = kept_light(
            tracer, found, empty, camera, self.settings.spp, seed, clean=self.settings.denoise
        )
        base = empty.color * kept
        alpha, color = np.zeros((size, size), np.float32), np.zeros_like(base)
        pixels = np.flatnonzero(found.person)
        if len(pixels) == 0:
            return _Parts(picture=base, kept=kept, color=color, person=alpha, alpha=alpha)
        traced = tracer.trace(pixels, -(-self.settings.spp // 2) * 2, camera, size, seed)
        window, layers = traced.laid(pixels, size)
        alpha[window] = layers[3]
        hit = alpha > 0
        finest = self._rim(tracer, alpha, camera)
        color[window] = denoise_person(*layers) if self.settings.denoise else layers[0]
        color *= (finest / np.where(hit, alpha, 1))[..., None]
        person = np.where(hit, finest, np.float32(0))
        return _Parts(
            picture=np.asarray(color + (1 - person)[..., None] * base, np.float32),
            kept=kept,
            color=color,
            person=person,
            alpha=finest,
        )

    def _empty_stage(self, camera: ViewCamera) -> Empty:
        """Return the empty stage; cached for a camera that stands still."""
        if self._clear is None or self._clear[0] != camera:
            self._clear = camera, empty_stage(self.look, camera, self.settings.size)
        return self._clear[1]

    def _sky(self, camera: ViewCamera | None) -> FloatArray:
        """Return the sky behind every pixel (H, W, 3)."""
        size = self.settings.size
        if camera is None or self.look.zenith is None:
            return np.broadcast_to(self.look.fill, (size, size, 3))
        ray = rays(camera, size)
        return self.look.sky(ray[..., 1] / np.linalg.norm(ray, axis=-1))

    def _finished(self, layers: Layers) -> FloatArray:
        return denoise(layers) if self.settings.denoise else layers.color

    def cutout(self, vertices: FloatArray, camera: ViewCamera) -> Cutout:
        """Render the person and its shadow without the stage.

        The result holds the person's part of each pixel and the fraction of its light that the
        ground keeps. With a custom material or custom objects the shadow is the difference between
        the ground's pictures without and with the person.
        """
        if self._tracer is not None:
            parts = self._parts(self._tracer, vertices, camera)
            return Cutout.of(parts.color, parts.person, parts.alpha, parts.kept @ LUMINANCE)
        whole, alpha = self.linear(vertices, camera), self._covered(vertices, camera)
        if self._empty is None or self._empty.camera != camera or self._ground is None:
            mi = activate(self.variant, self.settings.threads)
            if self._empty is None:
                self._empty = self._scene(mi, self._objects)
            self._show(mi, self._empty, camera)
            self._ground = self._finished(
                self._trace(mi, self._empty, self.settings.spp, self.settings.seed)
            )
        shade = continued(
            (whole @ LUMINANCE) / np.maximum(self._ground @ LUMINANCE, 1e-4), alpha == 0, 1.0
        )
        return Cutout.of(
            np.maximum(whole - ((1 - alpha) * shade)[..., None] * self._ground, 0),
            alpha,
            alpha,
            shade,
        )

    def _rim(
        self, tracer: Tracer, person: FloatArray, camera: ViewCamera, *, samples: int = 32
    ) -> FloatArray:
        """Return the fraction of each pixel that the person covers (H, W), with more samples along
        the rim, which is not denoised."""
        import cv2

        square, alpha = np.ones((3, 3), np.uint8), person.copy()
        rim = np.flatnonzero(cv2.dilate(person, square) != cv2.erode(person, square))
        if len(rim):
            alpha.reshape(-1)[rim] = tracer.covered(
                rim, samples, camera, self.settings.size, self.settings.seed
            )
        return alpha

    def _covered(
        self, vertices: FloatArray, camera: ViewCamera, *, samples: int = 32
    ) -> FloatArray:
        """Return `mask` without parts that the ground occludes (a toe that sinks into it)."""
        mi = activate(self.variant, self.settings.threads)
        if self._holdout is None:  # render a white person on black ground: the albedo is the mask
            white, black = (
                {"type": "diffuse", "reflectance": {"type": "rgb", "value": [v, v, v]}}
                for v in (1.0, 0.0)
            )
            ground = {
                name: item | {"bsdf": black}
                for name, item in self._objects.items()
                if item is not None and "bsdf" in item
            }
            self._holdout = self._scene(
                mi, {"person": mesh_object(mi, self._mesh, self._surface, bsdf=white), **ground}
            )
            self._albedo = mi.load_dict({"type": "aov", "aovs": "albedo:albedo"})
        self._show(mi, self._holdout, camera, np.asarray(vertices, np.float32))
        image = mi.render(
            self._holdout.scene, integrator=self._albedo, spp=samples, seed=self.settings.seed
        )
        alpha = np.array(image, np.float32)[..., 0]
        return np.clip(np.where(alpha < 1e-3, 0, alpha), 0, 1)

    def _scene(self, mi: Any, objects: dict[str, Any]) -> Shown:
        kept = {name: value for name, value in objects.items() if value is not None}
        scene = mi.load_dict({"type": "scene", **kept, "sensor": self._sensor()})
        return Shown(scene, mi.traverse(scene))

    def render(self, vertices: FloatArray, camera: ViewCamera) -> ByteArray:
        """Render one picture.

        Parameters
        ----------
        vertices : (V, 3) float
            The surface's vertices in this frame, meters.
        camera : ViewCamera

        Returns
        -------
        (height, width, 3) uint8 of the settings' `shape`, sRGB; (height, width, 4) with straight
        alpha where the settings' background is "transparent".

        Raises
        ------
        InputError
            The shape of `vertices` differs from the surface's, or they contain NaN.
        """
        if self.settings.background == "stage":
            return srgb_bytes(self.linear(vertices, camera)[self.settings.window])
        cut = self.cutout(vertices, camera)
        picture = cut.rgba() if self._behind is None else srgb_bytes(cut.over(self._behind))
        return picture[self.settings.window]

    def mask(self, vertices: FloatArray, camera: ViewCamera, *, samples: int = 64) -> FloatArray:
        """Return the fraction of each pixel that the person covers, (size, size) float32 in [0, 1].

        It is estimated from `samples` rays per pixel.
        """
        mi = activate(self.variant, self.settings.threads)
        if self._alone is None:  # a scene with only the person: its alpha channel is the mask
            self._alone = self._scene(mi, {"person": mesh_object(mi, self._mesh, self._surface)})
        self._show(mi, self._alone, camera, np.asarray(vertices, np.float32))
        image = mi.render(
            self._alone.scene, integrator=self._color, spp=samples, seed=self.settings.seed
        )
        return np.array(image, np.float32)[..., 3]

    def _sensor(self) -> dict[str, Any]:
        size = self.settings.size
        return {
            "type": "perspective",
            "fov": 28.0,
            "near_clip": 0.05,
            "far_clip": 10000.0,
            # Open Image Denoise needs pixels that are independent of each other, so the filter is a
            # box
            "film": {
                "type": "hdrfilm",
                "width": size,
                "height": size,
                "rfilter": {"type": "box"},
                "pixel_format": "rgba",
                "component_format": "float32",
            },
            "sampler": {"type": "multijitter", "sample_count": self.settings.spp},
        }

    def _show(
        self,
        mi: Any,
        shown: Shown,
        camera: ViewCamera,
        vertices: FloatArray | None = None,
        *,
        sensor: bool = True,
    ) -> None:
        """Move the person, the lamp and, with `sensor`, the camera of a scene.

        Only changed values are written: any change costs 26 ms of processor time.
        """
        if vertices is not None and vertices.shape != (self._count, 3):
            raise InputError(
                f"the frame has vertices of shape {vertices.shape}; the surface has "
                f"({self._count}, 3)"
            )
        person = None
        if vertices is not None and not shown.holds(vertices):
            if not np.isfinite(vertices).all():
                raise InputError(
                    "the frame's vertices hold NaN or infinite numbers; check the motion that "
                    "moved them"
                )
            person = vertices[self._mesh.source], self._mesh.normals(vertices)
        lamp = self.look.spot_light(camera.target).matrix
        shown.change(mi, person=person, lamp=lamp, camera=camera if sensor else None)
        shown.vertices = None if vertices is None else vertices.copy()

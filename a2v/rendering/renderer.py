"""One scene, many frames: only arrays change between pictures, so nothing is built or compiled again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.rendering.camera import ViewCamera
from a2v.rendering.images import linear_to_srgb, srgb_to_linear, to_bytes
from a2v.rendering.scene import SceneSettings, mesh_object, render_mesh, spot_matrix, stage
from a2v.rendering.variant import activate
from a2v.types import ByteArray, FloatArray, RenderSettings, Surface


@dataclass(frozen=True)
class Layers:
    """What the path tracer saw, before denoising, float32.

    `color` (H, W, 3) is linear RGB over the backdrop, `albedo` (H, W, 3) the linear reflectance and `normal`
    (H, W, 3) the direction, world axes, of what is hit first (the ground's where nothing is, so that the horizon is no edge), `alpha` (H, W) how much of the pixel is person or ground.
    """

    color: FloatArray
    albedo: FloatArray
    normal: FloatArray
    alpha: FloatArray


def denoise(layers: Layers) -> FloatArray:
    """Open Image Denoise on one frame, guided by albedo and normals; linear RGB (H, W, 3) float32.

    Pixels that show nothing but the backdrop are exact already and stay as they are.
    """
    import mitsuba_oidn as oidn

    color, albedo, normal = (np.ascontiguousarray(part, np.float32) for part in (layers.color, layers.albedo, layers.normal))
    clean = np.array(oidn.denoise(color, albedo, normal, hdr=True), np.float32)
    return np.where(layers.alpha[..., None] > 0, clean, color)


@dataclass
class _Shown:
    """A Mitsuba scene, its parameters, and what they hold now."""

    scene: Any
    parameters: Any
    vertices: FloatArray | None = None
    camera: ViewCamera | None = None


class Renderer:
    """Renders one surface in any number of poses and cameras.

    A picture depends on its vertices, camera and the settings alone, not on what was rendered before, so frames may be
    rendered in any order and by several processes. The same seed serves every frame: what does not move does not flicker.

    Parameters
    ----------
    surface : Surface
        Topology and colours: `texture` through `uv` where present, else vertex `colors`.
    settings : RenderSettings
        `spp` is rounded up to what multi-jittered sampling can do (8, 16, 35 for 32, 64).
    scene : SceneSettings
    bsdf : dict or None
        Mitsuba's material, with "surface" where the surface's colours go; None: diffuse.
    extra : dict or None
        More Mitsuba objects, or replacements of the stage's ("ground": None takes it away).

    Raises
    ------
    InputError
        The surface has no faces.
    """

    def __init__(
        self,
        surface: Surface,
        settings: RenderSettings = RenderSettings(),  # noqa: B008 - frozen
        scene: SceneSettings = SceneSettings(),  # noqa: B008 - frozen
        *,
        bsdf: dict[str, Any] | None = None,
        extra: dict[str, Any] | None = None,
    ) -> None:
        if len(surface.faces) == 0:
            raise InputError("the surface has no faces to render")
        self.settings, self.scene_settings = settings, scene
        self._count = len(surface.vertices)
        self._surface = surface
        mi = activate(settings.variant, settings.threads)
        self.variant: str = mi.variant()
        self._mesh = render_mesh(surface)
        objects = stage(mi, scene) | (extra or {})
        stage_scene = mi.load_dict(
            {
                "type": "scene",
                "person": mesh_object(mi, self._mesh, surface, bsdf=bsdf),
                **{name: value for name, value in objects.items() if value is not None},
                "sensor": self._sensor(),
            }
        )
        self._color = mi.load_dict({"type": "path", "max_depth": scene.bounces + 1, "rr_depth": 64, "hide_emitters": True})
        # a pass of its own costs a sixth of what it costs when wrapped around the path integrator
        self._guide = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
        self._main = _Shown(stage_scene, mi.traverse(stage_scene))
        self._alone: _Shown | None = None
        self._backdrop = srgb_to_linear(np.array(scene.background))

    def layers(self, vertices: FloatArray, camera: ViewCamera, *, spp: int | None = None, seed: int | None = None) -> Layers:
        """Trace one picture without denoising (`spp`, `seed`: other than the settings')."""
        mi = activate(self.variant, self.settings.threads)
        self._show(mi, self._main, np.asarray(vertices, np.float32), camera)
        samples = self.settings.spp if spp is None else spp
        chosen = self.settings.seed if seed is None else seed
        color = np.array(mi.render(self._main.scene, integrator=self._color, spp=samples, seed=chosen), np.float32)
        samples = 4 if self.variant.startswith("scalar") else max(samples, 4)  # there, this pass is as slow as the other
        guide = np.array(mi.render(self._main.scene, integrator=self._guide, spp=samples, seed=chosen), np.float32)
        missed = 1 - color[..., 3:]
        return Layers(
            color=color[..., :3] + missed * self._backdrop,
            albedo=guide[..., :3] + missed * self.scene_settings.ground_albedo,
            normal=guide[..., 3:6] + missed * np.array((0, 1, 0), np.float32),
            alpha=color[..., 3],
        )

    def linear(self, vertices: FloatArray, camera: ViewCamera) -> FloatArray:
        """One picture in linear RGB (H, W, 3) float32, denoised if the settings say so."""
        layers = self.layers(vertices, camera)
        return denoise(layers) if self.settings.denoise else layers.color

    def render(self, vertices: FloatArray, camera: ViewCamera) -> ByteArray:
        """One picture.

        Parameters
        ----------
        vertices : (V, 3) float
            The surface's vertices in this frame, metres.
        camera : ViewCamera

        Returns
        -------
        (size, size, 3) uint8, sRGB

        Raises
        ------
        InputError
            `vertices` has another shape than the surface's or holds NaN.
        """
        return to_bytes(linear_to_srgb(self.linear(vertices, camera)))

    def mask(self, vertices: FloatArray, camera: ViewCamera, *, samples: int = 64) -> FloatArray:
        """The fraction of each pixel that the person covers, (size, size) float32 in [0, 1], from `samples` rays a pixel."""
        mi = activate(self.variant, self.settings.threads)
        if self._alone is None:  # a scene of the person alone: its alpha channel is the mask
            person = mesh_object(mi, self._mesh, self._surface)
            scene = mi.load_dict({"type": "scene", "person": person, "sensor": self._sensor()})
            self._alone = _Shown(scene, mi.traverse(scene))
        self._show(mi, self._alone, np.asarray(vertices, np.float32), camera)
        image = mi.render(self._alone.scene, integrator=self._color, spp=samples, seed=self.settings.seed)
        return np.array(image, np.float32)[..., 3]

    def _sensor(self) -> dict[str, Any]:
        size = self.settings.size
        return {
            "type": "perspective",
            "fov": 28.0,
            "near_clip": 0.05,
            "far_clip": 10000.0,
            # Open Image Denoise needs pixels that are independent of each other: a box filter
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

    def _show(self, mi: Any, shown: _Shown, vertices: FloatArray, camera: ViewCamera) -> None:
        """Move the person and the camera of a scene, and only what differs from what it shows."""
        if vertices.shape != (self._count, 3):
            raise InputError(f"the frame has vertices of shape {vertices.shape}; the surface has ({self._count}, 3)")
        parameters = shown.parameters
        if shown.vertices is None or not np.array_equal(shown.vertices, vertices):
            if not np.isfinite(vertices).all():
                raise InputError("the frame's vertices hold NaN or infinite numbers; check the motion that moved them")
            parameters["person.vertex_positions"] = vertices[self._mesh.source].ravel()
            parameters["person.vertex_normals"] = self._mesh.normals(vertices).ravel()
        if camera != shown.camera:
            right, up, backward = camera.axes
            matrix = np.eye(4)
            # Mitsuba's camera looks along +z with +x to the left of the picture
            matrix[:3, :3], matrix[:3, 3] = np.stack([-right, up, -backward], axis=1), camera.origin
            parameters["sensor.to_world"] = _transform(mi, matrix)
            parameters["sensor.x_fov"] = camera.fov
            if "spot.to_world" in parameters:
                parameters["spot.to_world"] = _transform(mi, spot_matrix(camera.target, self.scene_settings))
        parameters.update()
        shown.vertices, shown.camera = vertices.copy(), camera


def _transform(mi: Any, matrix: FloatArray) -> Any:
    return mi.AffineTransform4f(mi.ScalarMatrix4f(matrix.tolist()))

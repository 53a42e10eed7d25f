"""Project a photo onto a surface: the color of each point, and how reliable it is."""

from __future__ import annotations

import copy
import warnings

import numpy as np

from a2v.geometry.images import nearest_known, sample_image
from a2v.geometry.steps import smoothstep
from a2v.geometry.visibility import depth_map
from a2v.reconstruction.coloring.canvas import Canvas
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera, Subject, Surface


def clean_colors(subject: Subject) -> FloatArray:
    """Colors (H, W, 3) float32 in [0, 1] of the person, extended beyond the silhouette, so that no
    background bleeds in.

    Foreground colors by multi-level estimation (Germer et al. 2020, pymatting) where the matte is
    trusted, else those of the nearest such pixel.
    """
    import cv2

    image, alpha = subject.image, np.asarray(subject.mask, np.float32)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numba warns about its threading layer
        from pymatting import estimate_foreground_ml

        foreground = np.clip(
            estimate_foreground_ml(image.astype(np.float64) / 255, alpha.astype(np.float64)), 0, 1
        ).astype(np.float32)
    person = alpha > 0.5
    tall = float(np.ptp(np.nonzero(person)[0]) + 1)
    shrink = max(1.0, 0.003 * tall)
    depth = cv2.distanceTransform(person.astype(np.uint8), cv2.DIST_L2, 5)
    core = (depth > shrink) & (alpha > 0.9)
    if not core.any():
        core = person
    # fingers have no core: their middle is used
    far = cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 5) > 3 * shrink
    core |= person & far
    index = nearest_known(core)
    spread = foreground[index[0], index[1]]
    soft = cv2.GaussianBlur(spread, (0, 0), shrink)
    return np.where(core[..., None], foreground, soft).astype(np.float32)


class PhotoProjection:
    """A photo projected onto a surface: its clean colors, and their reliability at a point.

    With a canvas, pixels that belong to another part are not trusted.
    """

    def __init__(
        self,
        surface: Surface,
        subject: Subject,
        camera: OrthographicCamera,
        canvas: Canvas | None = None,
    ) -> None:
        import cv2

        self.subject, self.camera, self.canvas = subject, camera, canvas
        self.clean = clean_colors(subject)
        height, width = subject.mask.shape
        depth = depth_map(surface.vertices, surface.faces, camera, (width, height))
        # the nearest depth around a pixel, so that at an occluding edge the surface behind does not
        # take the color of the one in front
        self.depth = cv2.dilate(depth, np.ones((3, 3), np.uint8))
        person = (subject.mask > 0.5).astype(np.uint8)
        self.inner = cv2.distanceTransform(
            cv2.copyMakeBorder(person, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=1), cv2.DIST_L2, 5
        )[1:-1, 1:-1]
        tall = float(np.ptp(np.nonzero(person)[0]) + 1)
        self.edge = max(1.0, 0.004 * tall)  # pixels over which the silhouette fades

    def in_colors(self, clean: FloatArray) -> PhotoProjection:
        """Return the same projection of a photo with other colors (H, W, 3)."""
        other = copy.copy(self)
        other.clean = clean
        return other

    def patch_colors(self, vertices: FloatArray, faces: IntArray) -> FloatArray:
        """Colors (V, 3) float64 in [0, 1] of the photo at the vertices (V, 3), averaged over the
        patch of each vertex."""
        import cv2

        spacing = (
            float(np.median(np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1)))
            * self.camera.scale
        )
        softened = (
            cv2.GaussianBlur(self.clean, (0, 0), 0.4 * spacing) if spacing > 1 else self.clean
        )
        return np.clip(sample_image(softened, self.camera.project(vertices)), 0, 1).astype(
            np.float64
        )

    def _pixel(self, points: FloatArray) -> tuple[IntArray, IntArray, BoolArray]:
        pixels = self.camera.project(points)
        height, width = self.depth.shape
        u, v = np.floor(pixels[:, 0]).astype(np.int64), np.floor(pixels[:, 1]).astype(np.int64)
        within = (u >= 0) & (v >= 0) & (u < width) & (v < height)
        return np.clip(u, 0, width - 1), np.clip(v, 0, height - 1), within

    def unoccluded(self, points: FloatArray, tolerance: float = 0.012) -> BoolArray:
        """Return whether nothing is more than `tolerance` meters in front of the points (N, 3), and
        they are inside the photo."""
        u, v, within = self._pixel(points)
        return np.asarray(within & (self.depth[v, u] <= points[:, 2] + tolerance))

    def trust(
        self, points: FloatArray, normals: FloatArray, owners: IntArray | None = None
    ) -> FloatArray:
        """Return the trust from 0 (unseen, grazing, or at the silhouette) to 1 (seen directly) at
        points (N, 3).

        With the `owners` (N,) of the points (`Canvas.owners`), pixels of other parts have none.
        """
        u, v, within = self._pixel(points)
        facing = np.clip((normals[:, 2] - 0.12) / 0.28, 0, 1)
        inner = np.clip(self.inner[v, u] / self.edge - 0.5, 0, 1)
        # smooth step behind occluding edges
        behind = np.clip((points[:, 2] + 0.02 - self.depth[v, u]) / 0.012, 0, 1)
        trust = np.asarray(smoothstep(facing, 0, 1) * inner * behind * within)
        if self.canvas is None or owners is None:
            return trust
        return trust * self.canvas.agrees(self.camera.project(points), owners)

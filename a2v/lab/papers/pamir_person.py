"""Inputs of PaMIR's networks for one person, the picture on white and SMPL's posed body as a
volume, and their outputs: occupancy and colors of points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from a2v.body import load_body_model
from a2v.errors import InputError
from a2v.geometry.mesh import face_normals
from a2v.geometry.rays import RayScene
from a2v.lab.papers.converted import Converted
from a2v.reconstruction.implicit.inputs import make_frame
from a2v.types import Body, FloatArray, OrthographicCamera, Subject

PIXELS = 512
"""Side of the picture, pixels."""
VOXELS = 128
"""Side of the body's volume, voxels."""
FILL = 0.8
"""The person's longer side as a fraction of the picture's, as in the published pictures."""
UNIT = 500.0
"""Pixels per unit of the cube at its middle: the focal length over the distance."""
DISTANCE = 10.0
SIGMA = 0.05
"""Radius of a vertex's influence on voxels, units."""


class PamirPerson:
    """A person as input of PaMIR.

    Parameters
    ----------
    subject : Subject
    body : Body
        Of SMPL, in the photo's pose.
    camera : OrthographicCamera
    geometry, texture : str
        The checkpoints; "" for no texture.
    smpl : str
        SMPL's own file: its template names the places on the body.

    Attributes
    ----------
    scale : float
        Pixels per meter of the networks' picture.

    Raises
    ------
    InputError
        The body is another model's, or a checkpoint another network's.
    """

    def __init__(
        self,
        subject: Subject,
        body: Body,
        camera: OrthographicCamera,
        *,
        geometry: str,
        texture: str,
        smpl: str,
    ) -> None:
        if body.model != "smpl":
            raise InputError(
                f"PaMIR needs SMPL's body, but this one is {body.model}'s; give "
                "SMPL's .npz file with --fit.model"
            )
        frame = make_frame(subject.image, subject.mask, camera, PIXELS, fill=FILL)
        self._camera, self._middle = frame.camera, float(np.mean(body.vertices[:, 2]))
        self.scale = frame.camera.scale
        opacity = frame.mask[..., None]
        picture = frame.image.astype(np.float32) / 255 * opacity + (1 - opacity)
        self._image = np.ascontiguousarray(picture.transpose(2, 0, 1)[None], np.float32)
        self._faces, self._names = body.faces, _names(smpl, len(body.vertices))
        self._see(body.vertices)
        self._texture, self._geometry = texture, Converted("pamir", geometry, PIXELS)
        self._maps = self._seen(self._geometry)

    def field_of(self, vertices: FloatArray) -> Callable[[FloatArray], FloatArray]:
        """Put the body to the vertices (V, 3), meters; return `occupancy` with this body."""
        self._see(vertices)
        self._maps["volume"] = self._geometry.run("volume", body=self._body)
        return self.occupancy

    def _see(self, vertices: FloatArray) -> None:
        self._body = body_volume(self.place(vertices), self._faces, self._names)[None]

    def occupancy(self, points: FloatArray) -> FloatArray:
        """Return the probability (N,) that points (N, 3), meters, lie in the person."""
        return self._geometry.at(self.place(points), **self._maps)

    def colors(self, points: FloatArray) -> FloatArray:
        """Return sRGB (N, 3) in [0, 1] of points (N, 3), meters."""
        network = Converted("pamir-texture", self._texture, PIXELS)
        maps = self._seen(network)
        maps["features"] = np.concatenate([maps["features"], self._maps["features"]], axis=1)
        if maps["features"].shape[1] != network.features:
            raise InputError(
                f"{self._texture} needs {network.features} features; together with "
                f"the geometry's network it has {maps['features'].shape[1]}"
            )
        found: FloatArray = np.clip(
            network.at(self.place(points), image=self._image, **maps), 0, 1
        ).astype(np.float32)
        return found

    def place(self, points: FloatArray) -> FloatArray:
        """Map points (N, 3), meters, to the networks' cube. The networks' perspective camera
        projects them to the same pixels as our orthographic one."""
        pixels = self._camera.project(np.asarray(points, np.float64))
        depth = (points[:, 2] - self._middle) * self._camera.scale / UNIT
        flat = (pixels - PIXELS / 2) / UNIT * (1 - depth[:, None] / DISTANCE)
        return np.asarray(np.stack([flat[:, 0], -flat[:, 1], depth], axis=1), np.float32)

    def _seen(self, network: Converted) -> dict[str, FloatArray]:
        return {
            "features": network.run("features", image=self._image),
            "volume": network.run("volume", body=self._body),
        }


def _names(smpl: str, count: int) -> FloatArray:
    """Return the codes (V, 3) of the vertices: their positions in the template's box, in [0, 1]."""
    from a2v.body import make_body

    template = make_body(load_body_model(smpl)).vertices
    if len(template) != count:
        raise InputError(
            f"{smpl} has {len(template)} vertices and the fitted body {count}; fit "
            "with the same file (--fit.model)"
        )
    low, high = template.min(axis=0), template.max(axis=0)
    return np.asarray((template - low) / (high - low), np.float32)


def body_volume(
    vertices: FloatArray, faces: np.ndarray, names: FloatArray, voxels: int = VOXELS
) -> FloatArray:
    """Blended names (3, D, H, W) of the vertices around each voxel of the cube [-.5, .5] whose
    middle lies in a closed body; 0 elsewhere.

    Weights are exp(-d² / σ²). Axes: z, y and x.
    """
    middles = (np.arange(voxels, dtype=np.float32) + 0.5) / voxels - 0.5
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    near = [np.flatnonzero((middles >= low[axis]) & (middles <= high[axis])) for axis in range(3)]
    z, y, x = (index.ravel() for index in np.meshgrid(near[2], near[1], near[0], indexing="ij"))
    points = np.stack([middles[x], middles[y], middles[z]], axis=1)
    inside = RayScene(vertices, faces).crossings(points, face_normals(vertices, faces)) > 0
    out = np.zeros((3, voxels, voxels, voxels), np.float32)
    x, y, z, points = x[inside], y[inside], z[inside], points[inside]
    squares = (vertices**2).sum(axis=1)
    for start in range(0, len(points), 2048):
        part = slice(start, start + 2048)
        apart = (points[part] ** 2).sum(axis=1)[:, None] + squares - 2 * points[part] @ vertices.T
        weights = np.exp(-np.maximum(apart, 0) / SIGMA**2)
        out[:, z[part], y[part], x[part]] = (
            weights @ names / (weights.sum(axis=1, keepdims=True) + 1e-10)
        ).T
    return out

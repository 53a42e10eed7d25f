"""The `pifu` backend: the surface that the networks see in a photo, and the colours that they expect on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.reconstruction.extraction import ExtractionSettings, extract_surface
from a2v.reconstruction.implicit.inputs import mask_distance
from a2v.reconstruction.implicit.model import ImplicitModel, ImplicitPerson
from a2v.reconstruction.prior import sample_image
from a2v.reconstruction.visibility import person_box, silhouette_iou, vertex_normals
from a2v.types import Body, FloatArray, IntArray, OrthographicCamera, Progress, Subject, Surface

MARGIN = 0.08
"""Clothes and hair reach at most this far beyond the body and the mask, metres."""
RIM = 0.01
"""So near to the mask's contour, metres, the surface is not smoothed: the silhouette stays what it is."""


@dataclass(frozen=True)
class ImplicitSettings:
    """How the networks' field becomes a surface.

    Attributes
    ----------
    weights : str
        Folder of ONNX files of one's own training; "" for the shipped ones.
    resolution : int
        Cells of the finest grid over the person's longer side.
    vertices : int
        Vertices to aim at, at least 25,000.
    smoothing : int
        Rounds of Taubin smoothing of the finished mesh but for its rim: the cells of the networks' maps show as faint lines; 0 for none.
    threads : int
        Of onnxruntime; 0 for its default.
    digest : str
        `ImplicitModel.digest` that the files must have; "" for any.
    """

    weights: str = ""
    resolution: int = 320
    vertices: int = 36_000
    smoothing: int = 8
    threads: int = 0
    digest: str = ""

    def __post_init__(self) -> None:
        self.extraction  # noqa: B018  checks resolution and vertices
        if not 0 <= self.smoothing <= 50:
            raise InputError(f"smoothing is {self.smoothing}; expected 0 to 50 rounds")

    @property
    def extraction(self) -> ExtractionSettings:
        """The settings of `extract_surface`."""
        return ExtractionSettings(resolution=self.resolution, vertices=self.vertices)


def implicit_surface(
    subject: Subject,
    body: Body,
    camera: OrthographicCamera,
    *,
    settings: ImplicitSettings | None = None,
    progress: Progress | None = None,
) -> Surface:
    """Reconstruct the person by pixel-aligned implicit functions (Sec. 4.1 of the journal paper).

    Parameters
    ----------
    subject : Subject
    body : Body
        Fitted to the photo, in the frame of `camera`: guides the networks.
    camera : OrthographicCamera
        Of `subject.image`.
    settings : ImplicitSettings, optional
    progress : Progress, optional

    Returns
    -------
    Surface
        One watertight piece with at least 25,000 vertices; `colors` are the networks' (c^p of Eq. 14: give them to `color_surface` as its
        prior). `provenance` holds `silhouette_iou`.

    Raises
    ------
    InputError
        An empty mask, a body outside of the photo, or no surface found.
    """
    settings = settings or ImplicitSettings()
    model = ImplicitModel.load(settings.weights or None, threads=settings.threads)
    if settings.digest not in ("", model.digest):
        raise InputError(f"the reconstruction model in {model.folder} has the digest {model.digest}, not {settings.digest}")
    person = model.see(subject, body, camera)
    low, high = person_box(body.vertices, person.frame.mask > 0.5, person.frame.camera)
    bounds = np.stack([low - MARGIN, high + MARGIN])
    level = rim_level(person, bounds)
    outline = mask_distance(person.frame.mask, person.frame.camera.scale)

    def field(points: FloatArray) -> FloatArray:
        pixels = person.frame.camera.project(points)
        return np.maximum(person.distance(points) - level, sample_image(outline, pixels, linear=True))

    vertices, faces = extract_surface(field, bounds, settings=settings.extraction, progress=progress)
    inside = -sample_image(outline, person.frame.camera.project(vertices), linear=True) / RIM
    vertices = smooth_surface(vertices, faces, np.clip(inside, 0, 1), settings.smoothing)
    colors = person.colors(vertices, vertex_normals(vertices, faces))
    return Surface(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=np.clip(colors, 0, 1).astype(np.float32),
        provenance={
            "backend": "pifu",
            "model_digest": model.digest,
            "level": level,
            "silhouette_iou": silhouette_iou(vertices, faces, camera, subject.mask),
        },
    )


def smooth_surface(vertices: FloatArray, faces: IntArray, share: FloatArray, rounds: int) -> FloatArray:
    """Vertices (V, 3) after Taubin smoothing, which does not shrink, as far as `share` (V,) from 0 to 1 says."""
    if not rounds:
        return vertices
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    meshes.apply_coord_taubin_smoothing(stepsmoothnum=rounds)
    smooth: FloatArray = np.asarray(meshes.current_mesh().vertex_matrix())
    return vertices + share[:, None] * (smooth - vertices)


def rim_level(person: ImplicitPerson, bounds: FloatArray, *, count: int = 500, step: float = 0.01, largest: float = 0.02) -> float:
    """The level of the field whose silhouette meets the mask's contour, in the median over the contour; metres, from 0 to `largest`.

    A network that is unsure of the depth is unsure of the rim: its zero level lies some millimetres within the person.
    """
    from skimage.measure import find_contours

    contour = np.concatenate(find_contours(np.pad(person.frame.mask, 1), 0.5))[:, ::-1] - 0.5
    chosen = contour[np.linspace(0, len(contour) - 1, count).astype(int)]
    depths = np.arange(bounds[0, 2], bounds[1, 2], step)
    points = person.frame.camera.unproject(np.repeat(chosen, len(depths), axis=0), np.tile(depths, count))
    nearest = person.distance(points.astype(np.float32)).reshape(count, -1).min(axis=1)
    return float(np.clip(np.median(nearest), 0, largest))

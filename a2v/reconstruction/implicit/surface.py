"""The `pifu` backend: the surface that the networks see in a photo, and the colours that they expect on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.reconstruction.extraction import ExtractionSettings, extract_surface
from a2v.reconstruction.implicit.model import ImplicitModel, ImplicitPerson
from a2v.reconstruction.visibility import silhouette_iou, vertex_normals
from a2v.types import Body, FloatArray, OrthographicCamera, Progress, Subject, Surface

MARGIN = 0.08
"""Clothes and hair reach at most this far beyond the body and the mask, metres."""


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
    threads : int
        Of onnxruntime; 0 for its default.
    digest : str
        `ImplicitModel.digest` that the files must have; "" for any.
    """

    weights: str = ""
    resolution: int = 320
    vertices: int = 36_000
    threads: int = 0
    digest: str = ""

    def __post_init__(self) -> None:
        self.extraction  # noqa: B018  checks resolution and vertices

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
    vertices, faces = extract_surface(person.distance, person_bounds(person, body), settings=settings.extraction, progress=progress)
    colors = person.colors(vertices, vertex_normals(vertices, faces))
    return Surface(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=np.clip(colors, 0, 1).astype(np.float32),
        provenance={
            "backend": "pifu",
            "model_digest": model.digest,
            "silhouette_iou": silhouette_iou(vertices, faces, camera, subject.mask),
        },
    )


def person_bounds(person: ImplicitPerson, body: Body) -> FloatArray:
    """Least and largest corner (2, 3) of the box that holds body and mask with a margin, metres."""
    rows, columns = np.nonzero(person.frame.mask > 0.5)
    corners = person.frame.camera.unproject(np.array([[columns.min(), rows.max() + 1], [columns.max() + 1, rows.min()]], np.float64), 0.0)
    low, high = np.min(body.vertices, axis=0), np.max(body.vertices, axis=0)
    low, high = np.minimum(low, [*corners[0, :2], np.inf]), np.maximum(high, [*corners[1, :2], -np.inf])
    bounds: FloatArray = np.stack([low - MARGIN, high + MARGIN])
    return bounds

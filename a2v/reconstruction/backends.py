"""The backends by name, and the ways to colour what they give: one registry for command line, pipeline and benchmark."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

from a2v.errors import InputError
from a2v.geometry.images import sample_image
from a2v.reconstruction.body_prior import SurfaceSettings, body_prior_surface
from a2v.reconstruction.color import ColorSettings, color_surface
from a2v.reconstruction.implicit.surface import ImplicitSettings, implicit_surface
from a2v.reconstruction.papers.surface import PapersSettings, papers_surface
from a2v.types import Body, OrthographicCamera, Progress, Reconstruction, Subject, Surface

Backend = Callable[[Subject, Body, OrthographicCamera], Reconstruction]
"""``(subject, fitted body, its camera) -> reconstruction``."""

BackendSettings = SurfaceSettings | ImplicitSettings | PapersSettings
"""The settings of any backend; their type says which one is meant."""

Coloring = Callable[[Reconstruction, Subject, Body, OrthographicCamera], Surface]
"""``(reconstruction, subject, fitted body, its camera) -> coloured surface``."""


def reconstruct(
    subject: Subject,
    body: Body,
    camera: OrthographicCamera,
    settings: BackendSettings,
    *,
    progress: Progress | None = None,
) -> Reconstruction:
    """The person's surface by the backend that `settings` belong to; see `body_prior_surface`, `implicit_surface`, `papers_surface`, and their errors."""
    if isinstance(settings, PapersSettings):
        shape, expected = papers_surface(subject, body, camera, settings=settings, progress=progress)
        return Reconstruction(surface=shape, backend="papers", expected_colors=expected)
    if isinstance(settings, ImplicitSettings):
        surface = implicit_surface(subject, body, camera, settings=settings, progress=progress)
        return Reconstruction(surface=surface, backend="pifu", expected_colors=surface.colors)
    surface = body_prior_surface(subject, body, camera, settings=settings, progress=progress)
    return Reconstruction(surface=surface, backend="body-prior", from_body=True)


def _backend(settings: BackendSettings) -> Backend:
    return lambda subject, body, camera: reconstruct(subject, body, camera, settings)


SETTINGS: Mapping[str, BackendSettings] = {
    "pifu": ImplicitSettings(), "body-prior": SurfaceSettings(), "papers": PapersSettings(),
}  # fmt: skip
"""Default settings of each backend; their type says which backend is meant."""
ABLATIONS: Mapping[str, BackendSettings] = {"pifu-unlimited": ImplicitSettings(limits=False)}
"""Backends without a part of theirs, for the benchmark."""
DEFAULT_BACKEND = "pifu"
BACKENDS: Mapping[str, Backend] = {name: _backend(settings) for name, settings in SETTINGS.items()}
"""Backends by name, with default settings."""


def backend_of(name: str, weights: str = "") -> Backend:
    """A backend with default settings, but with the weights of a folder of one's own ("" for the shipped ones; ignored where there are none)."""
    return _backend(_with_weights(name, weights))


def backend_digest(name: str, weights: str = "") -> str:
    """Hash of the weights that `backend_of` takes; "" if it has none.

    Raises
    ------
    InputError
        They are missing.
    """
    settings = _with_weights(name, weights)
    if not isinstance(settings, ImplicitSettings):
        return ""
    from a2v.reconstruction.implicit.model import ImplicitModel

    return ImplicitModel.load(settings.weights or None).digest


def _with_weights(name: str, weights: str) -> BackendSettings:
    settings = {**SETTINGS, **ABLATIONS}[name]
    return dataclasses.replace(settings, weights=weights) if isinstance(settings, ImplicitSettings) else settings


def color_by_photo(
    person: Reconstruction,
    subject: Subject,
    body: Body,
    camera: OrthographicCamera,
    *,
    settings: ColorSettings | None = None,
    progress: Progress | None = None,
) -> Surface:
    """What the pipeline does: the photo where it saw the surface, Eq. 14 with the backend's prior (or the default one) elsewhere."""
    from a2v.body import nearest_spots

    spots = nearest_spots(person.surface.vertices, body)
    return color_surface(person.surface, subject, camera, prior=person.expected_colors, spots=spots, settings=settings, progress=progress)


def color_by_equation(person: Reconstruction, subject: Subject, body: Body, camera: OrthographicCamera) -> Surface:
    """Ablation: the photo and Eq. 14 alone; nothing is continued over the unseen side (`ColorSettings.synthesis`)."""
    return color_by_photo(person, subject, body, camera, settings=ColorSettings(synthesis=False))


def color_mirrored(person: Reconstruction, subject: Subject, body: Body, camera: OrthographicCamera) -> Surface:
    """Ablation: every point, seen or not, has the photo's colour at its pixel; the back is the front mirrored."""
    from a2v.geometry.colors import to_bytes
    from a2v.reconstruction.color_prior import clean_colors

    clean = clean_colors(subject)
    height, width = clean.shape[:2]
    pixels = camera.project(person.surface.vertices)
    corners = pixels[person.surface.faces] / np.array([width, height])
    return dataclasses.replace(
        person.surface,
        colors=np.clip(sample_image(clean, pixels), 0, 1).astype(np.float32),
        uv=np.stack([corners[..., 0], 1 - corners[..., 1]], axis=-1).astype(np.float32),
        texture=to_bytes(clean),
    )


def color_by_network(person: Reconstruction, subject: Subject, body: Body, camera: OrthographicCamera) -> Surface:
    """Ablation: the backend's own colours alone, on the vertices.

    Raises
    ------
    InputError
        The backend has none.
    """
    if person.expected_colors is None:
        raise InputError("this backend has no colours of its own; choose another one for the colouring 'network'")
    known = np.isfinite(person.expected_colors).all(axis=1)
    colors = np.where(known[:, None], np.nan_to_num(person.expected_colors), person.expected_colors[known].mean(axis=0))
    return dataclasses.replace(person.surface, colors=colors.astype(np.float32), uv=None, texture=None)


COLORINGS: Mapping[str, Coloring] = {
    "ours": color_by_photo, "eq14": color_by_equation, "mirrored": color_mirrored, "network": color_by_network,
}  # fmt: skip
"""Ways to colour a reconstruction, by name; "ours" is what users get, the others are ablations."""

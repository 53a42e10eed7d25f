"""The backends by name, and the ways to colour what they give: one registry for command line, pipeline and benchmark.

A backend of the laboratory is a `PluggedBackend`: its settings reconstruct by themselves, and `plugged` imports them when they are asked for.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from a2v.errors import InputError
from a2v.geometry.images import sample_image
from a2v.reconstruction.body_prior import SurfaceSettings, body_prior_surface
from a2v.reconstruction.canonical.several import Sight
from a2v.reconstruction.color import ColorEvidence, ColorSettings, color_surface
from a2v.reconstruction.implicit.surface import ImplicitSettings, implicit_surface
from a2v.types import Body, Camera, FloatArray, OrthographicCamera, Progress, Reconstruction, Subject, Surface

Backend = Callable[[Subject, Body, Camera], Reconstruction]
"""``(subject, fitted body, its camera) -> reconstruction``."""

@runtime_checkable
class PluggedBackend(Protocol):
    """The settings of a backend that is no part of the product: a frozen dataclass that reconstructs by itself."""

    def pinned(self) -> PluggedBackend:
        """The same settings with the digest of the files that they name, by which results are remembered."""
        ...

    def reconstruct(
        self, subject: Subject, body: Body, camera: OrthographicCamera, *, progress: Progress | None = None
    ) -> Reconstruction:
        """The person's surface; see `body_prior_surface` for the arguments."""
        ...


BackendSettings = SurfaceSettings | ImplicitSettings | PluggedBackend
"""The settings of any backend; their type says which one is meant."""

Coloring = Callable[[Reconstruction, Subject, Body, Camera], Surface]
"""``(reconstruction, subject, fitted body, its camera) -> coloured surface``."""


def reconstruct(
    subject: Subject,
    body: Body,
    camera: Camera,
    settings: BackendSettings,
    *,
    progress: Progress | None = None,
) -> Reconstruction:
    """The person's surface by the backend that `settings` belong to; see `body_prior_surface` and `implicit_surface`, and their errors.

    All of them work in the camera's flat frame, in which the photo is an orthographic view; the surface is then moved back to the world.
    """
    from a2v.body import flattened

    posed, flat = flattened(body, camera), camera.flat
    if isinstance(settings, PluggedBackend):
        found = settings.reconstruct(subject, posed, flat, progress=progress)
    elif isinstance(settings, ImplicitSettings):
        surface = implicit_surface(subject, posed, flat, settings=settings, progress=progress)
        found = Reconstruction(surface=surface, backend="pifu", expected_colors=surface.colors)
    else:
        surface = body_prior_surface(subject, posed, flat, settings=settings, progress=progress)
        found = Reconstruction(surface=surface, backend="body-prior", from_body=True)
    return _with_vertices(found, camera.raised(found.surface.vertices))


def _with_vertices(person: Reconstruction, vertices: FloatArray) -> Reconstruction:
    return dataclasses.replace(person, surface=dataclasses.replace(person.surface, vertices=vertices))


def _backend(settings: BackendSettings) -> Backend:
    return lambda subject, body, camera: reconstruct(subject, body, camera, settings)


SETTINGS: Mapping[str, BackendSettings] = {"pifu": ImplicitSettings(), "body-prior": SurfaceSettings()}
"""Default settings of each backend of the product; their type says which backend is meant."""
PLUGGED: Mapping[str, str] = {"papers": "a2v.lab.papers:PapersSettings"}
"""Backends of the laboratory: the module and the class of their settings."""
NAMES = (*SETTINGS, *PLUGGED)
"""Every backend that can be chosen by name."""
ABLATIONS: Mapping[str, BackendSettings] = {"pifu-unlimited": ImplicitSettings(limits=False)}
"""Backends without a part of theirs, for the benchmark."""
DEFAULT_BACKEND = "pifu"


def plugged(name: str, **values: object) -> PluggedBackend:
    """The settings of a backend of the laboratory, with `values` in place of its defaults.

    Raises
    ------
    InputError
        What its settings refuse.
    """
    module, _, kind = PLUGGED[name].partition(":")
    settings: PluggedBackend = getattr(importlib.import_module(module), kind)(**values)
    return settings


def backend_of(name: str, weights: str = "") -> Backend:
    """A backend with default settings, but with the weights of a folder of one's own ("" for the shipped ones; ignored where there are none)."""
    return _backend(settings_of(name, weights))


def backend_digest(name: str, weights: str = "") -> str:
    """Hash of the weights that `backend_of` takes; "" if it has none.

    Raises
    ------
    InputError
        They are missing.
    """
    settings = settings_of(name, weights)
    if not isinstance(settings, ImplicitSettings):
        return ""
    from a2v.reconstruction.implicit.model import ImplicitModel

    return ImplicitModel.load(settings.weights or None).digest


def settings_of(name: str, weights: str = "") -> BackendSettings:
    """The default settings of a backend, with weights of one's own as `backend_of` takes them."""
    settings = plugged(name) if name in PLUGGED else {**SETTINGS, **ABLATIONS}[name]
    return dataclasses.replace(settings, weights=weights) if isinstance(settings, ImplicitSettings) else settings


def color_by_photo(
    person: Reconstruction,
    subject: Subject,
    body: Body,
    camera: Camera,
    *,
    settings: ColorSettings | None = None,
    progress: Progress | None = None,
    others: Sequence[Sight] = (),
) -> Surface:
    """What the pipeline does: the photo where it saw the surface, Eq. 14 with the backend's prior (or the default one) elsewhere.

    `others` are further photos of a canonical person; the one that shows the face (``provenance["face_photo"]``) is then the main one.
    """
    from a2v.body.spots import nearest_spots, spots_of

    if others:
        from a2v.reconstruction.canonical.coloring import color_by_photos

        return color_by_photos(person, [Sight(subject, body, camera, person), *others], settings=settings or ColorSettings(), progress=progress)
    standing, canvas = person.surface.standing, None
    seen = dataclasses.replace(person.surface, vertices=camera.flatten(person.surface.vertices))
    if standing is None:
        spots = nearest_spots(person.surface.vertices, body)
    else:
        from a2v.reconstruction.canonical.coloring import canvas_of

        spots = spots_of(standing.anchors, body)
        canvas = canvas_of(seen, subject, body, camera, size=(settings or ColorSettings()).texture)
    evidence = ColorEvidence(prior=person.expected_colors, spots=spots, canvas=canvas)
    colored = color_surface(seen, subject, camera.flat, evidence=evidence, settings=settings, progress=progress)
    return dataclasses.replace(colored, vertices=person.surface.vertices)


def color_by_equation(person: Reconstruction, subject: Subject, body: Body, camera: Camera) -> Surface:
    """Ablation: the photo and Eq. 14 alone; nothing is continued over the unseen side (`ColorSettings.synthesis`)."""
    return color_by_photo(person, subject, body, camera, settings=ColorSettings(synthesis=False))


def color_mirrored(person: Reconstruction, subject: Subject, body: Body, camera: Camera) -> Surface:
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


def color_by_network(person: Reconstruction, subject: Subject, body: Body, camera: Camera) -> Surface:
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

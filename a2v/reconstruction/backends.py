"""The backends by name: one registry for command line, pipeline and benchmark.

A backend of the laboratory is a `PluggedBackend`: its settings reconstruct by themselves, and
`plugged` imports them when they are asked for.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from a2v.reconstruction.body_prior import SurfaceSettings, body_prior_surface
from a2v.reconstruction.implicit.surface import ImplicitSettings, implicit_surface
from a2v.types import (
    Body,
    Camera,
    FloatArray,
    OrthographicCamera,
    Progress,
    Reconstruction,
    Subject,
)

Backend = Callable[[Subject, Body, Camera], Reconstruction]
"""``(subject, fitted body, its camera) -> reconstruction``."""


@runtime_checkable
class PluggedBackend(Protocol):
    """The settings of a backend that is no part of the product: a frozen dataclass that
    reconstructs by itself."""

    def pinned(self) -> PluggedBackend:
        """The same settings with the digest of the files that they name, by which results are
        remembered."""
        ...

    def reconstruct(
        self,
        subject: Subject,
        body: Body,
        camera: OrthographicCamera,
        *,
        progress: Progress | None = None,
    ) -> Reconstruction:
        """The person's surface; see `body_prior_surface` for the arguments."""
        ...


BackendSettings = SurfaceSettings | ImplicitSettings | PluggedBackend
"""The settings of any backend; their type says which one is meant."""


def reconstruct(
    subject: Subject,
    body: Body,
    camera: Camera,
    settings: BackendSettings,
    *,
    progress: Progress | None = None,
) -> Reconstruction:
    """The person's surface by the backend that `settings` belong to; see `body_prior_surface` and
    `implicit_surface`, and their errors.

    All of them work in the camera's flat frame, in which the photo is an orthographic view; the
    surface is then moved back to the world.
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
    return dataclasses.replace(
        person, surface=dataclasses.replace(person.surface, vertices=vertices)
    )


def _backend(settings: BackendSettings) -> Backend:
    return lambda subject, body, camera: reconstruct(subject, body, camera, settings)


SETTINGS: Mapping[str, BackendSettings] = {
    "pifu": ImplicitSettings(),
    "body-prior": SurfaceSettings(),
}
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
    """A backend with default settings, but with the weights of a folder of one's own ("" for the
    shipped ones; ignored where there are none)."""
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
    return (
        dataclasses.replace(settings, weights=weights)
        if isinstance(settings, ImplicitSettings)
        else settings
    )

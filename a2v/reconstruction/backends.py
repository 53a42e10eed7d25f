"""Backends by name: one registry for command line, pipeline and benchmark.

A backend of the laboratory is a `PluggedBackend`, whose settings reconstruct by themselves;
`plugged` imports it on request.
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
    """Settings of a backend outside of the product: a frozen dataclass that reconstructs by
    itself."""

    def pinned(self) -> PluggedBackend:
        """The same settings with the digest of their files, which is a part of the key of stored
        results."""
        ...

    def reconstruct(
        self,
        subject: Subject,
        body: Body,
        camera: OrthographicCamera,
        *,
        progress: Progress | None = None,
    ) -> Reconstruction:
        """Reconstruct the surface of the person; arguments as of `body_prior_surface`."""
        ...


BackendSettings = SurfaceSettings | ImplicitSettings | PluggedBackend
"""Settings of any backend; their type selects the backend."""


def reconstruct(
    subject: Subject,
    body: Body,
    camera: Camera,
    settings: BackendSettings,
    *,
    progress: Progress | None = None,
) -> Reconstruction:
    """Reconstruct the surface of the person by the backend of `settings`; arguments and errors as
    of `body_prior_surface` and `implicit_surface`.

    All backends work in the flat frame of the camera, in which the photo is an orthographic view.
    The surface is then moved back to the world.
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
"""Default settings of each backend of the product; their type selects the backend."""
PLUGGED: Mapping[str, str] = {"papers": "a2v.lab.papers:PapersSettings"}
"""Backends of the laboratory: module and class of their settings."""
NAMES = (*SETTINGS, *PLUGGED)
"""Names of all backends."""
ABLATIONS: Mapping[str, BackendSettings] = {"pifu-unlimited": ImplicitSettings(limits=False)}
"""Variants of backends without one of their parts, for the benchmark."""
DEFAULT_BACKEND = "pifu"


def plugged(name: str, **values: object) -> PluggedBackend:
    """Settings of a backend of the laboratory; `values` replace the defaults.

    Raises
    ------
    InputError
        A value is not valid.
    """
    module, _, kind = PLUGGED[name].partition(":")
    settings: PluggedBackend = getattr(importlib.import_module(module), kind)(**values)
    return settings


def backend_of(name: str, weights: str = "") -> Backend:
    """A backend with default settings and the weights of a custom folder ("" for the shipped ones;
    ignored by backends without weights)."""
    return _backend(settings_of(name, weights))


def backend_digest(name: str, weights: str = "") -> str:
    """Hash of the weights of `backend_of`; "" for backends without weights.

    Raises
    ------
    InputError
        The weights are missing.
    """
    settings = settings_of(name, weights)
    if not isinstance(settings, ImplicitSettings):
        return ""
    from a2v.reconstruction.implicit.model import ImplicitModel

    return ImplicitModel.load(settings.weights or None).digest


def settings_of(name: str, weights: str = "") -> BackendSettings:
    """Default settings of a backend with custom weights, as in `backend_of`."""
    settings = plugged(name) if name in PLUGGED else {**SETTINGS, **ABLATIONS}[name]
    return (
        dataclasses.replace(settings, weights=weights)
        if isinstance(settings, ImplicitSettings)
        else settings
    )

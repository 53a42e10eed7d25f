"""PaMIR's refinement of the body by its own field (Zheng et al. 2021, body reference optimization).

The skin of the body model should lie on the surface that the field describes. The pose is changed
by gradient descent until the field's values at the skin are near one half. Further terms keep the
pose near the initial one and the landmarks at their pixels. The terms and weights are those of the
published code. There, skin inside the person costs half as much as skin outside, since clothes
cover the body.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.body import make_body
from a2v.body.skinning import BodyModel
from a2v.errors import InputError
from a2v.types import Body, FloatArray, OrthographicCamera

if TYPE_CHECKING:
    from torch import Tensor

Field = Callable[[FloatArray], FloatArray]
"""The probability (N,) that points (N, 3), meters, lie in the person."""
FieldOf = Callable[[FloatArray], Field]
"""Makes the field of a body from its vertices (V, 3), since PaMIR's network sees the body too."""
INSIDE = 0.5
"""Cost of a vertex inside the person, as a share of the same value outside."""
SHAPE_WEIGHT = 0.01
LANDMARK_WEIGHT = 500.0
DEPTH_WEIGHT = 5.0
HALF = 256.0
"""Half a side of PaMIR's picture, pixels: the unit of the landmarks' errors."""
UNIT = 500.0
"""Pixels of one unit of PaMIR's cube: the unit of depths."""


@dataclass(frozen=True)
class RefinementSettings:
    """How the pose is refined.

    Attributes
    ----------
    iterations : int
        Steps of Adam.
    rate : float
        Its learning rate, radians.
    renew : int
        Number of steps after which the field is made again for the current body.
    vertices : int
        Number of vertices at which the field is evaluated.
    step : float
        Distance for the field's central differences, meters.
    """

    iterations: int = 50
    rate: float = 2e-3
    renew: int = 20
    vertices: int = 1700
    step: float = 0.005

    def __post_init__(self) -> None:
        if min(self.iterations, self.renew, self.vertices) < 1:
            raise InputError("iterations, renew and vertices must be at least 1")


@dataclass(frozen=True, eq=False)
class Pixels:
    """Where the photo shows the landmarks.

    Attributes
    ----------
    places : (33, 2)
        u and v, pixels of the photo.
    confidence : (33,)
        In [0, 1]; 0 for unseen landmarks.
    camera : OrthographicCamera
        The photo's.
    scale : float
        Pixels per meter of PaMIR's own picture, in which the errors are measured.
    """

    places: FloatArray
    confidence: FloatArray
    camera: OrthographicCamera
    scale: float


@dataclass(frozen=True, eq=False)
class Refined:
    """The refined body, and the field's term before every step and after the last."""

    body: Body
    terms: tuple[float, ...]


def refine_body(
    model: BodyModel,
    body: Body,
    field_of: FieldOf,
    *,
    pixels: Pixels | None = None,
    settings: RefinementSettings | None = None,
) -> Refined:
    """Change the pose of a body so that its skin lies on the surface of a field.

    The orientation of the whole body, its shape and its place do not change.

    Parameters
    ----------
    model : BodyModel
        The one that `body` was made with.
    body : Body
        May be flattened (`a2v.body.flattened`): the differences of its vertices from the model's
        own are kept.
    field_of : callable
    pixels : Pixels, optional
        Without it, the terms for landmarks are left out.
    settings : RefinementSettings, optional

    Raises
    ------
    InputError
        The body is another model's.
    """
    import torch

    settings = settings or RefinementSettings()
    if body.model != model.name or len(body.vertices) != len(model.weights):
        raise InputError(
            f"the body is a {body.model} with {len(body.vertices)} vertices; expected a "
            f"{model.name} with {len(model.weights)}"
        )
    first = {
        name: torch.from_numpy(np.array(body.parameters[name], np.float32))
        for name in ("rotations", "shape", "translation")
    }
    joints = first["rotations"][1:].clone().requires_grad_()
    optimizer = torch.optim.Adam([joints], lr=settings.rate)
    posed = _Posed(model, first, body.vertices)
    every = max(len(body.vertices) // settings.vertices, 1)
    landmarks = None if pixels is None else _LandmarkTerms(posed, pixels)
    terms: list[float] = []
    field: Field | None = None
    for step in range(settings.iterations):
        vertices, marks = posed(joints)
        if step % settings.renew == 0:
            field = field_of(vertices.detach().numpy())
        assert field is not None
        value, slope = _surface_term(field, vertices.detach().numpy()[::every], settings.step)
        terms.append(value)
        # the field has no gradient of its own: its slope at the vertices takes its place
        loss = (torch.from_numpy(slope) * vertices[::every]).sum()
        loss = loss + ((joints - first["rotations"][1:]) ** 2).mean()
        if landmarks is not None:
            loss = loss + landmarks(marks)
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
    with torch.no_grad():
        vertices, _ = posed(joints)
    assert field is not None
    terms.append(_surface_term(field, vertices.numpy()[::every], settings.step)[0])
    rotations = np.concatenate([first["rotations"][:1].numpy(), joints.detach().numpy()])
    made = make_body(
        model,
        rotations,
        first["shape"].numpy(),
        first["translation"].numpy(),
        provenance={**body.provenance, "refined_by": "PaMIR's field"},
    )
    return Refined(dataclasses.replace(made, vertices=vertices.numpy()), tuple(terms))


class _Posed:
    """Vertices and landmarks of a body for the rotations of its joints, with gradients; the
    differences of `seen` (V, 3) from the model's own vertices are added."""

    def __init__(self, model: BodyModel, first: dict[str, Tensor], seen: FloatArray) -> None:
        import torch

        self._model, self._first = model, first
        with torch.no_grad():
            state = model.forward(first["rotations"], first["shape"], first["translation"])
            marks = model.landmarks(state)
            self._moved = torch.from_numpy(np.asarray(seen, np.float32)) - state.vertices
            nearest = torch.cdist(marks, state.vertices).argmin(1)
            self._marks_moved = self._moved[nearest]
            self.marks = marks + self._marks_moved

    def __call__(self, joints: Tensor) -> tuple[Tensor, Tensor]:
        import torch

        rotations = torch.cat([self._first["rotations"][:1], joints])
        state = self._model.forward(rotations, self._first["shape"], self._first["translation"])
        return state.vertices + self._moved, self._model.landmarks(state) + self._marks_moved


class _LandmarkTerms:
    """Landmarks stay at their pixels and at their initial depths."""

    def __init__(self, posed: _Posed, pixels: Pixels) -> None:
        import torch

        places = pixels.camera.unproject(np.asarray(pixels.places, np.float64), 0.0)[:, :2]
        weights = np.asarray(pixels.confidence, np.float64)
        places[weights <= 0] = 0
        self._places = torch.from_numpy(places.astype(np.float32))
        self._weights = torch.from_numpy(weights.astype(np.float32))[:, None]
        self._depths, self._scale = posed.marks[:, 2], pixels.scale

    def __call__(self, marks: Tensor) -> Tensor:
        away = self._weights * (marks[:, :2] - self._places) * (self._scale / HALF)
        deeper = (marks[:, 2] - self._depths) * (self._scale / UNIT)
        return LANDMARK_WEIGHT * (away**2).mean() + DEPTH_WEIGHT * (deeper**2).mean()


def _surface_term(field: Field, vertices: FloatArray, step: float) -> tuple[float, FloatArray]:
    """The mean difference from one half of the field at vertices (V, 3), weighted by `INSIDE`
    where it is above, and its gradient (V, 3)."""
    offsets = step * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    points = (vertices[None] + offsets[:, None]).reshape(-1, 3).astype(np.float32)
    chance = np.asarray(field(points), np.float64).reshape(7, -1)
    away = 0.5 - chance[0]
    weight = np.where(away >= 0, 1.0, INSIDE)
    slope = (chance[1:4] - chance[4:]).T / (2 * step)
    gradient = -(weight * np.sign(away))[:, None] * slope / len(vertices)
    return float((weight * np.abs(away)).mean()), gradient.astype(np.float32)

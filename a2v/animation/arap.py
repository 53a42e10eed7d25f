"""As-rigid-as-possible deformation with soft control points (Eq. 20; Sorkine and Alexa 2007)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from a2v.animation.deform import ControlPoints, blended_matrices, skinning_matrices
from a2v.errors import InputError
from a2v.geometry.compiled import compiled
from a2v.geometry.mesh import Cholesky, cotangent_weights, laplacian
from a2v.geometry.polar import rotations_of
from a2v.types import Character, FloatArray, IntArray


@dataclass(frozen=True, kw_only=True)
class DeformSettings:
    """Settings of the deformation of a character by its bones.

    Attributes
    ----------
    method : "arap" or "skinning"
        "arap" is as-rigid-as-possible deformation (Eq. 20), "skinning" is linear blend skinning (as
        in viewers of GLB files).
    control : float
        Weight of a control point relative to the rigidity of its surroundings (dimensionless; 1 in
        the paper). Smaller values are smoother: a control point acts over about ``1 /
        sqrt(control)`` edges.
    iterations : int
        Largest number of iterations per frame.
    tolerance : float
        Stop when the energy falls by less than this fraction.
    """

    method: Literal["arap", "skinning"] = "arap"
    control: float = 0.05
    iterations: int = 4
    tolerance: float = 1e-2

    def __post_init__(self) -> None:
        if self.method not in ("arap", "skinning"):
            raise InputError(f"deform.method is '{self.method}'; choose arap or skinning")
        if not (np.isfinite(self.control) and self.control > 0):
            raise InputError(f"deform.control is {self.control}; expected a positive weight")
        if self.iterations < 1 or not 0 <= self.tolerance < 1:
            raise InputError(
                f"deform has {self.iterations} iterations and tolerance {self.tolerance}; expected "
                "1 or more, and [0, 1)"
            )


@dataclass(frozen=True)
class ArapResult:
    """A deformed mesh.

    Attributes
    ----------
    vertices : (V, 3) float64
        Meters.
    energies : tuple of float
        Value of the objective after each iteration (it never grows).
    iterations : int
    """

    vertices: FloatArray
    energies: tuple[float, ...]
    iterations: int


class ArapSolver:
    """Minimize the (squared) objective of Eq. 20 for one mesh; the matrix is factored once.

    sum_i sum_j k_ij |(x_i - x_j) - R_i (s_i - s_j)|^2 + sum_l c_l |x_l - target_l|^2

    with cotangent weights k. It alternates between the best rotations (local) and the best
    positions (global, one prefactored sparse Cholesky). Rotations come from quaternion-free Newton
    steps on the axis (Mueller et al. 2016), which need no decomposition, keep determinant +1 and
    start from those of the last iteration.

    Parameters
    ----------
    vertices : (V, 3) float
        Rest positions.
    faces : (F, 3) int
    control : (V,) float
        Weights c_l; 0 for free vertices. At least one must be positive in every connected
        component.
    """

    def __init__(self, vertices: FloatArray, faces: IntArray, control: FloatArray):
        from scipy.sparse import diags

        self.rest = vertices.astype(np.float64)
        self.control = np.asarray(control, dtype=np.float64)
        count = len(self.rest)
        if (
            self.control.shape != (count,)
            or not np.isfinite(self.control).all()
            or (self.control < 0).any()
            or not self.control.any()
        ):
            raise InputError(
                f"control weights must be {count} numbers, none negative and not all zero"
            )
        weights = cotangent_weights(self.rest, faces)
        stiffness = 2 * laplacian(weights)  # every edge is counted from both of its ends
        self._factor = Cholesky(stiffness + diags(self.control))
        weights = weights.tocsr()
        weights.sort_indices()
        self._edges = weights.indptr, weights.indices, weights.data
        i, j = np.repeat(np.arange(count), np.diff(weights.indptr)), weights.indices
        self._constant = float((weights.data * ((self.rest[i] - self.rest[j]) ** 2).sum(1)).sum())

    def solve(
        self,
        targets: FloatArray,
        *,
        start: FloatArray | None = None,
        rotations: FloatArray | None = None,
        iterations: int = 8,
        tolerance: float = 1e-4,
    ) -> ArapResult:
        """Deform the mesh towards `targets`.

        Parameters
        ----------
        targets : (V, 3) float
            Positions of the control points (ignored where the control weight is 0).
        start : (V, 3) float or None
            First guess of the positions; None solves for them from `rotations`.
        rotations : (V, 3, 3) float or None
            First guess of the rotations; identities by default.
        iterations : int
            Largest number of iterations.
        tolerance : float
            Stop when the energy falls by less than this fraction.
        """
        count = len(self.rest)
        turn = (
            np.tile(np.eye(3), (count, 1, 1))
            if rotations is None
            else np.array(rotations, dtype=np.float64)
        )
        pull = self.control[:, None] * np.where(self.control[:, None] > 0, targets, 0.0)
        energies: list[float] = []
        moments = None if start is None else self._moments(np.asarray(start, dtype=np.float64))
        while True:
            if (
                moments is not None
            ):  # the first rotations may be far away; later ones follow in a single step
                turn = rotations_of(moments, turn, steps=1 if energies else 2)
            right = compiled(_right_hand_side)(turn, self.rest, *self._edges) + pull
            x = self._factor.solve(right)
            moments = self._moments(x)
            # at the solution sum_j 2 k (x_i - x_j) = right - c x, so the energy needs no further
            # matrix product
            stretch = float(np.vdot(x, right - self.control[:, None] * x))
            energies.append(self._energy(x, turn, moments, targets, stretch))
            fall = energies[-2] - energies[-1] if len(energies) > 1 else np.inf
            if len(energies) >= iterations or fall <= tolerance * max(
                energies[-1], 1e-12 * self._constant
            ):
                return ArapResult(x, tuple(energies), len(energies))

    def _moments(self, x: FloatArray) -> FloatArray:
        """Return matrices (V, 3, 3): sums over neighbors of k (x_i - x_j) (s_i - s_j)^T."""
        moments: FloatArray = compiled(_moments)(np.ascontiguousarray(x), self.rest, *self._edges)
        return moments

    def _energy(
        self,
        x: FloatArray,
        turn: FloatArray,
        moments: FloatArray,
        targets: FloatArray,
        stretch: float,
    ) -> float:
        rigid = stretch + self._constant - 2 * float(np.vdot(turn, moments))
        gap = np.where(self.control[:, None] > 0, x - targets, 0.0)
        return max(rigid, 0.0) + float(self.control @ np.einsum("va,va->v", gap, gap))


def _moments(x: Any, rest: Any, starts: Any, neighbors: Any, weights: Any) -> Any:
    """Return the covariance (V, 3, 3) of each vertex's edges before and after the deformation.

    Written as plain loops for numba.
    """
    out = np.empty((len(rest), 3, 3))
    for i in range(len(rest)):
        x0, x1, x2, s0, s1, s2 = x[i, 0], x[i, 1], x[i, 2], rest[i, 0], rest[i, 1], rest[i, 2]
        m00 = m01 = m02 = m10 = m11 = m12 = m20 = m21 = m22 = 0.0
        for e in range(starts[i], starts[i + 1]):
            j, k = neighbors[e], weights[e]
            a, b, c = x0 - x[j, 0], x1 - x[j, 1], x2 - x[j, 2]
            u, v, w = k * (s0 - rest[j, 0]), k * (s1 - rest[j, 1]), k * (s2 - rest[j, 2])
            m00, m01, m02 = m00 + a * u, m01 + a * v, m02 + a * w
            m10, m11, m12 = m10 + b * u, m11 + b * v, m12 + b * w
            m20, m21, m22 = m20 + c * u, m21 + c * v, m22 + c * w
        out[i, 0, 0], out[i, 0, 1], out[i, 0, 2] = m00, m01, m02
        out[i, 1, 0], out[i, 1, 1], out[i, 1, 2] = m10, m11, m12
        out[i, 2, 0], out[i, 2, 1], out[i, 2, 2] = m20, m21, m22
    return out


def _right_hand_side(turn: Any, rest: Any, starts: Any, neighbors: Any, weights: Any) -> Any:
    """Return (V, 3): sums over neighbors of k (R_i + R_j) (s_i - s_j). Plain loops for numba."""
    out = np.empty((len(rest), 3))
    for i in range(len(rest)):
        s0, s1, s2 = rest[i, 0], rest[i, 1], rest[i, 2]
        total0 = total1 = total2 = sum0 = sum1 = sum2 = 0.0
        for e in range(starts[i], starts[i + 1]):
            j, k = neighbors[e], weights[e]
            x, y, z = k * (s0 - rest[j, 0]), k * (s1 - rest[j, 1]), k * (s2 - rest[j, 2])
            sum0, sum1, sum2 = sum0 + x, sum1 + y, sum2 + z
            total0 += turn[j, 0, 0] * x + turn[j, 0, 1] * y + turn[j, 0, 2] * z
            total1 += turn[j, 1, 0] * x + turn[j, 1, 1] * y + turn[j, 1, 2] * z
            total2 += turn[j, 2, 0] * x + turn[j, 2, 1] * y + turn[j, 2, 2] * z
        out[i, 0] = total0 + turn[i, 0, 0] * sum0 + turn[i, 0, 1] * sum1 + turn[i, 0, 2] * sum2
        out[i, 1] = total1 + turn[i, 1, 0] * sum0 + turn[i, 1, 1] * sum1 + turn[i, 1, 2] * sum2
        out[i, 2] = total2 + turn[i, 2, 0] * sum0 + turn[i, 2, 1] * sum1 + turn[i, 2, 2] * sum2
    return out


class ArapDeformer:
    """Eq. 20 for a character: locally rigid, pulled towards the reposed body plus displacement
    (`control_points`). It is factored once per character. Every frame starts from its *own*
    skinning result, not from the previous frame, so that frames may be computed in any order and
    on any machine with the same result.

    Parameters
    ----------
    character : Character
    settings : DeformSettings
    """

    def __init__(self, character: Character, settings: DeformSettings = DeformSettings()):
        self.character, self.settings = character, settings
        self._targets = ControlPoints(character)
        self._solver = ArapSolver(
            character.surface.vertices,
            character.surface.faces.astype(np.int64),
            np.full(len(character.surface.vertices), settings.control),
        )

    def solve(self, bone_transforms: FloatArray) -> ArapResult:
        """Deform to one frame's bone transforms (B, 4, 4); energies and iterations are in the
        result."""
        blended = blended_matrices(self.character, bone_transforms)
        rest = self.character.surface.vertices.astype(np.float64)
        start = np.einsum("vab,vb->va", blended[..., :3], rest) + blended[..., 3]
        targets = self._targets(bone_transforms)
        turns = rotations_of(blended[..., :3], _guess(self.character, bone_transforms), steps=2)
        return self._solver.solve(
            targets,
            start=start,
            rotations=turns,
            iterations=self.settings.iterations,
            tolerance=self.settings.tolerance,
        )

    def __call__(self, bone_transforms: FloatArray) -> FloatArray:
        """Vertices (V, 3) float32 for one frame's bone transforms (B, 4, 4)."""
        return self.solve(bone_transforms).vertices.astype(np.float32)


def _guess(character: Character, bone_transforms: FloatArray) -> FloatArray:
    """Return the rotation (V, 3, 3) of each vertex's strongest bone."""
    guess: FloatArray = skinning_matrices(character, bone_transforms)[character.bones[:, 0], :3, :3]
    return guess

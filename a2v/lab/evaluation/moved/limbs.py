"""Turn the limbs of a character in the T-pose so that they lie where those of the truth lie.

Two rigs place their joints differently in the same body. The hip joints of the avatars, for
example, lie 3 cm nearer to the middle of the body than those of Anny. If the directions between
joints are transferred, the feet of the character then stand 3 cm too far out, whatever its shape.
The pose of the T-pose is given by the benchmark, so the limbs are registered to the truth's
surface: small rotations of the joints, the same ones in every pose.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.animation import deform
from a2v.geometry.mesh import vertex_areas
from a2v.geometry.rays import RayScene, at_barycentric
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.evaluation.moved.carry import carried
from a2v.lab.studio.makehuman.hm08 import RIG_BONES
from a2v.types import Character, FloatArray, IntArray, Surface

LIMBS = tuple(
    side + stem for side in ("Left", "Right") for stem in ("Arm", "ForeArm", "UpLeg", "Leg", "Foot")
)
"""Bones that are turned; toes turn with their foot."""
_LARGEST = np.radians(10.0)
"""Largest rotation of a bone."""
_USUAL = np.radians(4.0)
"""Standard deviation of the rotation of a bone."""
_NOISE = 0.01
"""Standard deviation of a point's distance, meters."""
_POINTS = 100.0
"""Number of independent points that the whole surface counts as."""
_FAR = 0.08
"""Largest distance between a point and its partner, meters."""
_ROUNDS = 8
_STEP = 1e-3
"""Step of the numeric derivatives, radians or meters."""


@dataclasses.dataclass(frozen=True, eq=False)
class TruthPose:
    """The true person in the T-pose.

    Attributes
    ----------
    bones : tuple of N str
        Of the person's rig.
    heads : (N, 3) float
        Heads of the bones, meters.
    turns : (N, 3, 3) float
        Rotations of the bones from the T-pose, which are identities.
    vertices : (V, 3) float
        Meters.
    faces : (F, 3) int
        The faces that are visible from outside.
    """

    bones: tuple[str, ...]
    heads: FloatArray
    turns: FloatArray
    vertices: FloatArray
    faces: IntArray


def limb_turns(
    character: Character,
    truth: TruthPose,
    scale: float,
    placed: tuple[FloatArray, FloatArray],
    *,
    points: int = 3000,
    seed: int = 0,
) -> FloatArray:
    """Register the limbs of a character to the truth.

    Gauss-Newton on distances along the truth's normals between nearest points, both ways, with a
    prior on the rotations. The whole character moves rigidly too, but that motion is not returned.

    Parameters
    ----------
    character : Character
    truth : TruthPose
    scale : float
        Meters of the truth per meter of the character.
    placed : (3, 3) rotation and (3,) shift
        Place of the character in the T-pose, about which the registration starts.
    points : int
        Number of vertices of the character, and of faces of the truth, that are used.
    seed : int
        Of their choice.

    Returns
    -------
    (R, 3, 3) float64
        World rotations of `RIG_BONES` in the T-pose, identities for bones outside of `LIMBS`.
    """
    from scipy.spatial import cKDTree

    generator = np.random.default_rng(seed)
    own = _some_vertices(character, points, generator)
    triangles = truth.vertices[truth.faces].astype(np.float64)
    crossed = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(crossed, axis=1)
    normals = crossed / np.maximum(areas, 1e-12)[:, None]
    chosen = generator.choice(len(areas), points, p=areas / areas.sum())
    there, rays = triangles[chosen].mean(axis=1), RayScene(truth.vertices, truth.faces)

    def posed(values: FloatArray) -> FloatArray:
        transforms = carried(
            character.body, truth.bones, truth.heads, truth.turns[None], _rotations(values[:-6])
        )
        moved = scale * deform(own, transforms[0]).astype(np.float64) @ placed[0].T + placed[1]
        middle = moved.mean(axis=0)
        return np.asarray(
            (moved - middle) @ rotvec_to_rotmat(values[-6:-3]).T + middle + values[-3:]
        )

    values = np.zeros(3 * len(LIMBS) + 6)
    for _ in range(_ROUNDS):
        now = posed(values)
        hit = rays.closest(now)
        near = cKDTree(now).query(there)[1]
        partner = np.concatenate([at_barycentric(triangles[hit.face], hit.barycentric), there])
        index = np.concatenate([np.arange(len(now)), near])
        along = np.concatenate([normals[hit.face], normals[chosen]])
        apart = now[index] - partner
        weight = 1.0 * (np.linalg.norm(apart, axis=1) < _FAR)
        residual = (apart * along).sum(axis=1)
        weight = weight / (1 + (residual / (2 * _NOISE)) ** 2)
        slopes = np.empty((len(residual), len(values)))
        for column in range(len(values)):
            stepped = values.copy()
            stepped[column] += _STEP
            slopes[:, column] = ((posed(stepped) - now)[index] * along).sum(axis=1) / _STEP
        strength = _POINTS / (_NOISE**2 * max(float(weight.sum()), 1.0))
        prior = np.full(len(values), 1 / _USUAL**2)
        prior[-6:] = 1e-6
        matrix = strength * (slopes * weight[:, None]).T @ slopes + np.diag(prior)
        values -= np.linalg.solve(
            matrix, strength * slopes.T @ (weight * residual) + prior * values
        )
    return _rotations(values[:-6])


def _rotations(rotations: FloatArray) -> FloatArray:
    """Rotations (R, 3, 3) of `RIG_BONES` from rotation vectors (3 * len(LIMBS),)."""
    turns = np.tile(np.eye(3), (len(RIG_BONES), 1, 1))
    for name, vector in zip(LIMBS, rotations.reshape(-1, 3), strict=True):
        angle = max(float(np.linalg.norm(vector)), 1e-12)
        turns[RIG_BONES.index(name)] = rotvec_to_rotmat(vector * min(1.0, _LARGEST / angle))
    for side in ("Left", "Right"):
        turns[RIG_BONES.index(f"{side}ToeBase")] = turns[RIG_BONES.index(f"{side}Foot")]
    return turns


def _some_vertices(character: Character, count: int, generator: np.random.Generator) -> Character:
    """A character of some vertices, drawn by the area around them; its faces are meaningless."""
    surface = character.surface
    around = vertex_areas(surface.vertices.astype(np.float64), surface.faces)
    chosen = generator.choice(len(around), count, p=around / around.sum())
    return dataclasses.replace(
        character,
        surface=Surface(
            vertices=surface.vertices[chosen],
            faces=np.zeros((1, 3), np.int32),
            colors=surface.colors[chosen],
        ),
        weights=character.weights[chosen],
        bones=character.bones[chosen],
        anchors=character.anchors[chosen],
        parts=character.parts[chosen],
    )

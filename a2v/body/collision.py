"""Keep limbs out of the torso: balls inside of the body must not overlap."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.face import SKIN
from a2v.body.parts import PART_NEIGHBORS, PARTS, part_of_bone
from a2v.body.skinning import BodyState
from a2v.geometry.mesh import face_normals
from a2v.geometry.rays import RayScene
from a2v.types import FloatArray

if TYPE_CHECKING:
    import torch

_APART = 0.02
"""Balls that are nearer to each other than this in the rest pose belong together, meters."""
_GRID = 0.012
"""Distance of the points inside of the body at which balls are tried, meters."""
_LEAST = {"torso": 0.045, "lower_arm": 0.018, "hand": 0.012}
"""Smallest radius of the balls that fill a part, meters."""


class LimbBalls:
    """Balls inside of the body, fixed to bones, and the pairs that must not overlap.

    Their centers and radii are measured on the default shape: for every part, the flesh is cut into
    slices across its longest axis (the torso also into left, middle and right) and each slice gets
    the largest ball that fits. Torso, forearms and hands are also filled with balls, of which those
    of the torso and of an arm must not overlap: between the few balls of the slices a crossed arm
    would pass through the belly.
    """

    def __init__(self, model: AnnyModel):
        import torch

        rest, heads = (value.numpy() for value in model.rest(torch.from_numpy(model.shape_default)))
        centers, radii, bones, parts = [], [], [], []
        main = model.weights.argmax(axis=1)
        for bone, name in enumerate(model.bone_names):
            part = PARTS[part_of_bone(name)]
            own = rest[main == bone]
            if len(own) < 12 or name.startswith(
                ("finger", "toe", "eye", "metacarpal", "clavicle", "shoulder")
            ):
                continue
            wide = part == "torso"
            for low, high in (
                ((-np.inf, -0.05), (-0.05, 0.05), (0.05, np.inf)) if wide else ((-np.inf, np.inf),)
            ):
                piece = own[(own[:, 0] > low) & (own[:, 0] <= high)]
                if len(piece) < 6:
                    continue
                center = (piece.min(axis=0) + piece.max(axis=0)) / 2
                # The ball is bounded by all skin around it, not only by that of its slice.
                radius = np.linalg.norm(rest - center, axis=1).min()
                if radius > 0.015:
                    centers.append(center - heads[bone])
                    radii.append(0.92 * radius)
                    bones.append(bone)
                    parts.append(part)
        touching = {frozenset(pair) for pair in PART_NEIGHBORS}
        limb = ("arm", "hand")
        pairs = []
        for i in range(len(parts)):
            for j in range(i + 1, len(parts)):
                first, second = parts[i], parts[j]
                gap = np.linalg.norm(
                    (centers[i] + heads[bones[i]]) - (centers[j] + heads[bones[j]])
                )
                apart = gap > radii[i] + radii[j] + _APART
                if (first != second and apart and frozenset((first, second)) not in touching) or (
                    frozenset((first, second)) in touching
                    and apart
                    and any(word in first + second for word in limb)
                ):
                    pairs.append((i, j))
        trunk: list[int] = []
        arms: list[int] = []
        for part, center, radius, bone in _filling(model, rest):
            (trunk if part == "torso" else arms).append(len(parts))
            centers.append(center - heads[bone])
            radii.append(radius)
            bones.append(bone)
            parts.append(part)
        for i in trunk:
            for j in arms:
                gap = np.linalg.norm(
                    (centers[i] + heads[bones[i]]) - (centers[j] + heads[bones[j]])
                )
                if gap > radii[i] + radii[j] + _APART:
                    pairs.append((i, j))
        self._bones = torch.tensor(bones)
        self._centers = torch.from_numpy(np.array(centers, dtype=np.float32))
        self._radii = torch.from_numpy(np.array(radii, dtype=np.float32))
        self._pairs = torch.tensor(pairs).T

    def penetration(self, state: BodyState) -> torch.Tensor:
        """Return the overlap (..., P) of every pair, meters; 0 if they do not overlap."""
        transforms = state.transforms[..., self._bones, :, :]
        points = (transforms[..., :3, :3] @ self._centers.to(transforms)[..., None])[
            ..., 0
        ] + transforms[..., :3, 3]
        first, second = self._pairs
        gap = ((points[..., first, :] - points[..., second, :]).square().sum(dim=-1) + 1e-12).sqrt()
        radii = self._radii.to(gap)
        return (radii[first] + radii[second] - gap).clamp(min=0.0)


def _filling(model: AnnyModel, rest: FloatArray) -> list[tuple[str, FloatArray, float, int]]:
    """Balls that fill torso, forearms and hands of the body at `rest` (V, 3), meters: part, center
    (3,), radius, and the bone of the nearest skin. The largest balls come first."""
    from scipy.spatial import cKDTree

    skin = model.faces[model.faces.max(axis=1) < SKIN.stop].astype(np.int64)
    scene = RayScene(rest.astype(np.float32), skin.astype(np.int32))
    normals = face_normals(rest, skin)
    tree = cKDTree(rest[: SKIN.stop])
    found = []
    for name, least in _LEAST.items():
        for part in (name,) if name == "torso" else (f"left_{name}", f"right_{name}"):
            own = rest[: SKIN.stop][model.parts[: SKIN.stop] == PARTS.index(part)]
            axes = [
                np.arange(low, high, _GRID)
                for low, high in zip(own.min(0), own.max(0), strict=True)
            ]
            points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            points = points[scene.crossings(points.astype(np.float32), normals) > 0]
            radius, nearest = tree.query(points, workers=1)
            good = (model.parts[nearest] == PARTS.index(part)) & (radius > least)
            points, radius, nearest = points[good], radius[good], nearest[good]
            while len(points):
                best = int(radius.argmax())
                bone = int(model.weights[nearest[best]].argmax())
                found.append((part, points[best], float(radius[best]), bone))
                left = np.linalg.norm(points - points[best], axis=1) > radius[best]
                points, radius, nearest = points[left], radius[left], nearest[left]
    return found


@lru_cache(maxsize=1)
def limb_balls(model: AnnyModel) -> LimbBalls:
    """Measure the balls of a model; cached."""
    return LimbBalls(model)

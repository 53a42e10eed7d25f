"""Keep limbs out of the torso: balls along the bones must not overlap."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.parts import PART_NEIGHBORS, PARTS, part_of_bone
from a2v.body.skinning import BodyState

if TYPE_CHECKING:
    import torch


class LimbBalls:
    """Balls inside of the body, fixed to bones, and the pairs that must not overlap.

    Their centers and radii are measured on the default shape: for every part, the flesh is cut into
    slices across its longest axis (the torso also into left, middle and right) and each slice gets
    the largest ball that fits.
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
        self._bones = torch.tensor(bones)
        self._centers = torch.from_numpy(np.array(centers, dtype=np.float32))
        self._radii = torch.from_numpy(np.array(radii, dtype=np.float32))
        touching = {frozenset(pair) for pair in PART_NEIGHBORS}
        limb = ("arm", "hand")
        pairs = []
        for i in range(len(parts)):
            for j in range(i + 1, len(parts)):
                first, second = parts[i], parts[j]
                gap = np.linalg.norm(
                    (centers[i] + heads[bones[i]]) - (centers[j] + heads[bones[j]])
                )
                apart = gap > radii[i] + radii[j] + 0.02
                if (first != second and apart and frozenset((first, second)) not in touching) or (
                    frozenset((first, second)) in touching
                    and apart
                    and any(word in first + second for word in limb)
                ):
                    pairs.append((i, j))
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


@lru_cache(maxsize=1)
def limb_balls(model: AnnyModel) -> LimbBalls:
    """Measure the balls of a model; cached."""
    return LimbBalls(model)

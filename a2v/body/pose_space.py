"""The joint angles of a fit: a few dozen with limits, instead of 104 free rotations.

Each angle rotates one bone, or a chain of bones in equal shares (spine, neck), about a fixed
anatomical axis given in world axes at rest. Limits are soft: exceeding them adds a cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.types import FloatArray, IntArray

if TYPE_CHECKING:
    import torch

# name: (bones, axis, low, high, natural, spread); radians. Axes: x, y, z of the world, or "arm"
# (along the upper arm), "forearm", "hinge" (of the elbow, positive bends), "swing" (moves the arm
# forward), "leg" (along the thigh). Written for the left side; the right side is mirrored. Limits,
# natural angles and spreads (standard deviations of everyday standing poses) were chosen by hand.
# With a surface the fit uses the fitted `a2v.body.pose_prior` instead.
_CENTRAL: dict[str, tuple[tuple[str, ...], str, float, float, float, float]] = {
    "waist_bend": (("spine05", "spine04", "spine03"), "x", -0.4, 0.9, 0.0, 0.15),
    "waist_twist": (("spine05", "spine04", "spine03"), "y", -0.5, 0.5, 0.0, 0.15),
    "waist_lean": (("spine05", "spine04", "spine03"), "z", -0.5, 0.5, 0.0, 0.12),
    "chest_bend": (("spine02", "spine01"), "x", -0.3, 0.6, 0.0, 0.12),
    "chest_twist": (("spine02", "spine01"), "y", -0.5, 0.5, 0.0, 0.15),
    "chest_lean": (("spine02", "spine01"), "z", -0.4, 0.4, 0.0, 0.12),
    "neck_bend": (("neck01", "neck02", "neck03"), "x", -0.6, 0.7, 0.0, 0.15),
    "neck_twist": (("neck01", "neck02", "neck03"), "y", -0.7, 0.7, 0.0, 0.3),
    "neck_lean": (("neck01", "neck02", "neck03"), "z", -0.4, 0.4, 0.0, 0.12),
    "head_bend": (("head",), "x", -0.5, 0.5, 0.0, 0.15),
    "head_twist": (("head",), "y", -0.7, 0.7, 0.0, 0.3),
    "head_lean": (("head",), "z", -0.3, 0.3, 0.0, 0.1),
}
_SIDED: dict[str, tuple[tuple[str, ...], str, float, float, float, float]] = {
    "collar_raise": (("clavicle",), "z", -0.15, 0.5, 0.0, 0.1),
    "collar_push": (("clavicle",), "y", -0.3, 0.3, 0.0, 0.1),
    "arm_raise": (("upperarm01",), "z", -0.95, 2.1, -0.5, 0.7),
    "arm_swing": (("upperarm01",), "swing", -1.0, 2.0, 0.0, 0.6),
    "arm_twist": (("upperarm01",), "arm", -1.3, 1.3, 0.0, 0.5),
    "elbow_bend": (("lowerarm01",), "hinge", -0.68, 1.8, -0.4, 0.6),
    "forearm_twist": (("lowerarm02",), "forearm", -1.5, 1.5, 0.0, 0.5),
    "wrist_bend": (("wrist",), "hinge", -0.6, 0.6, 0.0, 0.2),
    "wrist_deviate": (("wrist",), "palm", -0.4, 0.4, 0.0, 0.15),
    "hip_bend": (("upperleg01",), "x", -2.2, 0.7, 0.0, 0.7),
    "hip_spread": (("upperleg01",), "z", -0.5, 1.1, -0.06, 0.3),
    "hip_twist": (("upperleg01",), "leg", -0.8, 0.8, 0.0, 0.25),
    "knee_bend": (("lowerleg01",), "x", -0.12, 2.4, 0.0, 0.7),
    "knee_twist": (("lowerleg01",), "y", -0.3, 0.3, 0.0, 0.1),
    "ankle_bend": (("foot",), "x", -0.5, 0.8, 0.0, 0.25),
    "ankle_twist": (("foot",), "y", -0.4, 0.4, 0.0, 0.12),
    "ankle_roll": (("foot",), "z", -0.35, 0.35, 0.0, 0.12),
}


@dataclass(frozen=True, eq=False)
class PoseSpace:
    """Angles q (D,) and their effect on the bones.

    Attributes
    ----------
    names : tuple of D str
        ``left_``/``right_`` in front of the sided ones.
    basis : (D, B, 3) float32
        Rotation vectors of the bones per radian of each angle.
    limits : (D, 2) float32
        Softly enforced range, radians.
    natural, spread : (D,) float32
        Mean and standard deviation of everyday standing poses.
    mirror : (D,) int
        Index of the same angle on the other side.
    mirror_sign : (D,) float32
        Its sign: a twist or lean of the spine changes it.
    """

    names: tuple[str, ...]
    basis: FloatArray
    limits: FloatArray
    natural: FloatArray
    spread: FloatArray
    mirror: IntArray
    mirror_sign: FloatArray

    def __len__(self) -> int:
        return len(self.names)

    def index(self, name: str) -> int:
        """Position of the angle `name`."""
        return self.names.index(name)

    def rotvecs(self, angles: torch.Tensor) -> torch.Tensor:
        """Rotation vectors (..., B, 3) of the bones for angles (..., D); the root's is zero."""
        import torch

        basis = torch.from_numpy(self.basis).to(angles)
        return (angles @ basis.flatten(1)).reshape(*angles.shape[:-1], *basis.shape[1:])


def pose_space(model: AnnyModel) -> PoseSpace:
    """The angles of Anny's rig, with axes measured on its default shape."""
    import torch

    heads = model.rest(torch.from_numpy(model.shape_default))[1].numpy().astype(float)

    def direction(first: str, last: str) -> np.ndarray:
        vector = heads[model.bone(last)] - heads[model.bone(first)]
        unit: np.ndarray = vector / np.linalg.norm(vector)
        return unit

    def unit(vector: np.ndarray) -> np.ndarray:
        result: np.ndarray = vector / np.linalg.norm(vector)
        return result

    upper, fore = direction("upperarm01.L", "lowerarm01.L"), direction("lowerarm01.L", "wrist.L")
    hinge = unit(np.cross(upper, fore))
    axes = {
        "x": np.array([1.0, 0.0, 0.0]),
        "y": np.array([0.0, 1.0, 0.0]),
        "z": np.array([0.0, 0.0, 1.0]),
        "arm": upper,
        "forearm": fore,
        "hinge": hinge,
        "palm": unit(np.cross(hinge, fore)),
        # rotating about it moves the arm towards +z
        "swing": unit(np.cross(upper, [0.0, 0.0, 1.0])),
        "leg": -direction("upperleg01.L", "lowerleg01.L"),
    }
    names: list[str] = []
    basis: list[np.ndarray] = []
    table: list[tuple[float, float, float, float]] = []
    for prefix, letter, entries in (
        ("", "", _CENTRAL),
        ("left_", ".L", _SIDED),
        ("right_", ".R", _SIDED),
    ):
        for name, (bones, axis, *numbers) in entries.items():
            vector = axes[axis] * ((1.0, -1.0, -1.0) if prefix == "right_" else (1.0, 1.0, 1.0))
            row = np.zeros((model.n_bones, 3))
            for bone in bones:
                row[model.bone(bone + letter)] = vector / len(bones)
            names.append(prefix + name)
            basis.append(row)
            table.append((numbers[0], numbers[1], numbers[2], numbers[3]))
    numbers_ = np.array(table, dtype=np.float32)
    swap = {"left": "right", "right": "left"}
    mirror = [
        names.index(swap[name.split("_")[0]] + "_" + name.split("_", 1)[1])
        if name.split("_")[0] in swap
        else i
        for i, name in enumerate(names)
    ]
    sign = [
        -1.0 if mirror[i] == i and not name.endswith("bend") else 1.0
        for i, name in enumerate(names)
    ]
    return PoseSpace(
        names=tuple(names),
        basis=np.stack(basis).astype(np.float32),
        limits=numbers_[:, :2],
        natural=numbers_[:, 2],
        spread=numbers_[:, 3],
        mirror=np.array(mirror),
        mirror_sign=np.array(sign, dtype=np.float32),
    )

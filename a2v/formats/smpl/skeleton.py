"""The published average skeleton of SMPL, its forward kinematics, and which way is up."""

from __future__ import annotations

import numpy as np

from a2v.formats.conventions import Bone, y_up_rotmat
from a2v.formats.recording import Recording
from a2v.kinematics import HUMANACT12
from a2v.types import FloatArray

NAMES = HUMANACT12.joint_names
"""The 24 joints of SMPL; SMPL-H and SMPL-X have fingers in place of the last two."""
PARENTS = HUMANACT12.parents.tolist()
PELVIS = np.array([-0.0018, -0.2233, 0.0282])
"""Pelvis of the average body, whose origin is what ``trans`` moves, meters."""
OFFSETS = np.array(
    [
        (0, 0, 0), (0.0695, -0.0914, -0.0068), (-0.0677, -0.0905, -0.0043),
        (-0.0025, 0.1090, -0.0267),
        (0.0343, -0.3752, -0.0045), (-0.0383, -0.3826, -0.0089), (0.0055, 0.1352, 0.0011),
        (-0.0136, -0.3980, -0.0437), (0.0158, -0.3984, -0.0423), (0.0015, 0.0529, 0.0254),
        (0.0264, -0.0558, 0.1193), (-0.0254, -0.0481, 0.1233), (-0.0028, 0.2139, -0.0429),
        (0.0788, 0.1217, -0.0341), (-0.0818, 0.1188, -0.0386), (0.0052, 0.0650, 0.0513),
        (0.0910, 0.0305, -0.0089), (-0.0960, 0.0326, -0.0091), (0.2596, -0.0128, -0.0275),
        (-0.2537, -0.0133, -0.0214), (0.2492, 0.0090, -0.0012), (-0.2553, 0.0078, -0.0056),
        (0.0840, -0.0082, -0.0149), (-0.0846, -0.0061, -0.0103),
    ]
)  # fmt: skip
"""Joints (24, 3) of the average SMPL body in its rest pose from their parents, meters, y up,
facing +z: as published in MuJoCo's models of SMPL."""


def posed(turns: FloatArray, path: FloatArray, rest: FloatArray | None = None) -> Recording:
    """Return the joints of the average body, or of one with `rest` (24, 3), under rotations (T, K,
    3, 3) and translations (T, 3)."""
    offsets, pelvis = OFFSETS, PELVIS
    if rest is not None:
        offsets = rest - rest[np.maximum(PARENTS, 0)]
        pelvis = rest[0]
    frames, count = len(turns), len(NAMES)
    world, turned = np.zeros((frames, count, 3)), np.zeros((frames, count, 3, 3))
    for joint, parent in enumerate(PARENTS):
        own = (
            turns[:, joint]
            if joint < turns.shape[1]
            else np.broadcast_to(np.eye(3), (frames, 3, 3))
        )
        if parent < 0:
            world[:, joint], turned[:, joint] = path + pelvis, own
        else:
            world[:, joint] = world[:, parent] + turned[:, parent] @ offsets[joint]
            turned[:, joint] = turned[:, parent] @ own
    local = np.broadcast_to(offsets, world.shape).copy()
    local[:, 0] = world[:, 0]
    bones = [Bone(name, parent) for name, parent in zip(NAMES, PARENTS, strict=True)]
    return Recording(
        source="", bones=bones, local=local, world=world, rotmats=turned, fps=1.0, known=False
    )


def upward_axis(joints: FloatArray, usual: str) -> str:
    """Return the upward axis, "x" to "-z", of joints (T, 22 or more, 3) in SMPL's order.

    It is the `usual` one unless the person stands along another axis, from the ankles to the head,
    and the lowest joint along that axis keeps one height better: gravity. So a handstand stays one.
    """
    along = np.mean(joints[:, 15] - 0.5 * (joints[:, 7] + joints[:, 8]), axis=0)
    size = float(np.median(np.linalg.norm(joints[:, 15] - joints[:, 7], axis=-1))) or 1.0
    axis = int(np.abs(along).argmax())
    best = ("" if along[axis] > 0 else "-") + "xyz"[axis]
    if best == usual or abs(along[axis]) < 0.6 * size:
        return usual

    def unsteady(name: str) -> float:
        heights = (joints @ y_up_rotmat(name).T)[..., 1]
        return float(np.std(heights.min(axis=1)))

    return best if unsteady(best) < 0.7 * unsteady(usual) - 1e-3 * size else usual

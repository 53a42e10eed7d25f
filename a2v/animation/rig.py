"""The rig of a body for retargeting: canonical joints, chains of bones, points under the soles."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from a2v.errors import InputError
from a2v.geometry.mesh import vertex_normals
from a2v.kinematics import rotvec_to_rotmat, skeleton_of, swing_between
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.orientations import rotmats_to_chain
from a2v.kinematics.skeleton import subtree
from a2v.types import Body, BoolArray, FloatArray, IntArray, Motion

SIDES: tuple[str, str] = ("left", "right")


@dataclass(frozen=True)
class Rig:
    """Canonical joints and bone chains of a `Body`, at rest.

    Attributes
    ----------
    bones : dict of str to int
        Bone whose head is each canonical joint.
    parents : (B,) int
    heads : (B, 3) float64
        Heads of the bones in the rest pose, meters.
    rest : (B, 3, 3) float64
        Rest orientations (world from bone).
    joints : dict of str to (3,) float64
        Canonical joints in the rest pose; ``left_foot`` is the ball of the foot, ``left_hand`` the
        knuckles.
    chains : dict of str to list of int
        Bones from one joint to the next: ``spine`` (above the pelvis up to below the neck),
        ``neck`` (from the neck to below the head), ``left_collar`` (from the chest to below the
        shoulder), ``left_shoulder`` (upper arm), ``left_elbow`` (forearm), ``left_hip`` (thigh),
        ``left_knee`` (shin) and those of the right side.
    soles : dict of str to (toe (K,) bool, points (K, 3))
        Points on each foot (``left``, ``right``) in the frame of the foot's bone, and whether they
        bend with the toes.
    skin : (bones (K,), points (K, 3))
        Points on the body's surface in the frames of their bones.
    skin_normals : (K, 3)
        Normals of the surface at these points, in the same frames.
    """

    bones: dict[str, int]
    parents: IntArray
    heads: FloatArray
    rest: FloatArray
    joints: dict[str, FloatArray]
    chains: dict[str, list[int]]
    soles: dict[str, tuple[BoolArray, FloatArray]] = field(repr=False)
    skin: tuple[IntArray, FloatArray] = field(repr=False)
    skin_normals: FloatArray = field(repr=False)

    @property
    def leg_length(self) -> float:
        """Mean length of thigh plus shin, meters."""
        return float(
            np.mean(
                [
                    self.length(f"{s}_hip", f"{s}_knee") + self.length(f"{s}_knee", f"{s}_ankle")
                    for s in SIDES
                ]
            )
        )

    def length(self, a: str, b: str) -> float:
        """Distance of two canonical joints at rest, meters."""
        return float(np.linalg.norm(self.joints[b] - self.joints[a]))

    def middle(self, joint: str) -> FloatArray:
        """Point half-way between the left and the right `joint` at rest."""
        return 0.5 * (self.joints[f"left_{joint}"] + self.joints[f"right_{joint}"])


def rig_of(body: Body) -> Rig:
    """Find the canonical joints in a body's rig.

    Raises
    ------
    InputError
        A joint of the limbs has no bone with a known name.
    """
    parents = body.bone_parents.astype(np.int64)
    bones = canonical_joints(body.bone_names, parents.tolist())
    if missing := missing_joints(bones):
        raise InputError(
            f"body model '{body.model}' has no bone for {', '.join(missing[:4])} among its "
            f"{len(parents)} bones; "
            "rename them to names that a2v.kinematics.names.canonical_joints knows"
        )
    heads = body.rest_transforms[:, :3, 3].astype(np.float64)
    joints = {name: heads[bone] for name, bone in bones.items()}
    for side in SIDES:
        ankle = bones[f"{side}_ankle"]
        toes = [b for b in range(len(parents)) if parents[b] == ankle]
        if toes:  # the middle of the toes' roots is steadier than the big toe
            joints[f"{side}_foot"] = heads[toes].mean(0)
    chains: dict[str, list[int]] = {}
    pelvis, neck, head = bones["pelvis"], bones.get("neck"), bones.get("head")
    top = neck if neck is not None else head
    chains["spine"] = _between(parents, pelvis, top)[1:] if top is not None else []
    chains["neck"] = _between(parents, neck, head) if neck is not None and head is not None else []
    above = set(chains["spine"]) | {pelvis}
    for side in SIDES:
        path = _between(parents, -1, bones[f"{side}_shoulder"])
        chains[f"{side}_collar"] = [
            bone
            for bone in path
            if bone not in above and bone >= 0 and bone not in _between(parents, -1, pelvis)
        ]
        for start, end in (
            ("shoulder", "elbow"),
            ("elbow", "wrist"),
            ("hip", "knee"),
            ("knee", "ankle"),
        ):
            chains[f"{side}_{start}"] = _between(
                parents, bones[f"{side}_{start}"], bones[f"{side}_{end}"]
            )
    owner = body.weights.argmax(axis=1)
    inverse = np.linalg.inv(body.bone_transforms.astype(np.float64))
    turn, shift = inverse[owner, :3, :3], inverse[owner, :3, 3]
    local = np.einsum("vab,vb->va", turn, body.vertices.astype(np.float64)) + shift
    soles = {
        side: _sole(parents, bones[f"{side}_ankle"], owner, local, body.rest_transforms)
        for side in SIDES
    }
    step = max(1, len(owner) // 1500)
    skin = (owner[::step], local[::step])
    normals = np.einsum(
        "vab,vb->va", turn[::step], vertex_normals(body.vertices, body.faces)[::step]
    )
    rest = body.rest_transforms[:, :3, :3].astype(np.float64)
    return Rig(
        bones=bones,
        parents=parents,
        heads=heads,
        rest=rest,
        joints=joints,
        chains=chains,
        soles=soles,
        skin=skin,
        skin_normals=normals,
    )


def joints_of(transforms: FloatArray, rig: Rig) -> dict[str, FloatArray]:
    """Canonical joints (T, 3) of bone transforms (T, B, 4, 4)."""
    out = {}
    for name, bone in rig.bones.items():
        base = bone
        if name in ("left_foot", "right_foot"):
            base = rig.bones[
                name.replace("foot", "ankle")
            ]  # the ball of the foot moves with the foot's bone
        offset = rig.rest[base].T @ (rig.joints[name] - rig.heads[base])
        out[name] = transforms[:, base, :3, :3] @ offset + transforms[:, base, :3, 3]
    for side in SIDES:
        if f"{side}_foot" in rig.joints and f"{side}_foot" not in out:
            base = rig.bones[f"{side}_ankle"]
            offset = rig.rest[base].T @ (rig.joints[f"{side}_foot"] - rig.heads[base])
            out[f"{side}_foot"] = transforms[:, base, :3, :3] @ offset + transforms[:, base, :3, 3]
    return out


def place(points: tuple[IntArray, FloatArray], transforms: FloatArray) -> FloatArray:
    """World positions (T, K, 3) of `points` (bones, positions in their frames) under transforms (T,
    B, 4, 4)."""
    bones, local = points
    used, back = np.unique(bones, return_inverse=True)
    placed: FloatArray = np.zeros((len(transforms), len(bones), 3))
    for k, bone in enumerate(used):  # many points share few bones
        mine = back == k
        placed[:, mine] = (
            local[mine] @ np.swapaxes(transforms[:, bone, :3, :3], 1, 2)
            + transforms[:, bone, None, :3, 3]
        )
    return placed


def sole_points(transforms: FloatArray, rig: Rig, side: str) -> FloatArray:
    """World positions (T, K, 3) of a foot's points with straight toes."""
    bone = rig.bones[f"{side}_ankle"]
    points: FloatArray = (
        rig.soles[side][1] @ np.swapaxes(transforms[:, bone, :3, :3], 1, 2)
        + transforms[:, bone, None, :3, 3]
    )
    return points


def _between(parents: IntArray, start: int | None, end: int | None) -> list[int]:
    """Return the bones on the way down the tree from `start` (included) to `end` (excluded).
    Without a start the way begins at the root."""
    if end is None:
        return []
    path: list[int] = []
    bone = int(parents[end])
    while bone >= 0:
        path.append(bone)
        if bone == start:
            break
        bone = int(parents[bone])
    return path[::-1]


def _sole(
    parents: IntArray, ankle: int, owner: IntArray, local: FloatArray, rest: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """Points on a foot in its bone's frame, and which of them belong to the toes."""
    inside = np.flatnonzero(np.isin(owner, subtree(parents, ankle)))
    if len(inside) == 0:
        return np.zeros(1, dtype=bool), np.zeros((1, 3))
    bones = owner[inside]
    world = np.einsum("kab,kb->ka", rest[bones, :3, :3], local[inside]) + rest[bones, :3, 3]
    low = world[:, 1] < world[:, 1].min() + 0.02
    chosen = [
        np.flatnonzero(low)[:: max(1, int(low.sum()) // 60)],
        np.flatnonzero(~low)[:: max(1, int((~low).sum()) // 40)],
    ]
    keep = np.unique(
        np.concatenate(
            [*chosen, [world[:, 2].argmin(), world[:, 2].argmax(), world[:, 1].argmin()]]
        )
    )
    base = np.linalg.inv(rest[ankle].astype(np.float64))
    points = world[keep] @ base[:3, :3].T + base[:3, 3]
    return bones[keep] != ankle, points


def rig_motion(
    bone_transforms: FloatArray, body: Body, fps: float, *, action: str = "", seed: int = -1
) -> Motion:
    """Return the motion of a body's own rig for `write_bvh`.

    Parameters
    ----------
    bone_transforms : (T, B, 4, 4) float
        World from bone, meters.
    body : Body
    fps : float

    Returns
    -------
    Motion
        Joints are the heads of all bones; bones whose head coincides with their parent's keep their
        place in the list. Rotations carry the bones' twists.

    Raises
    ------
    InputError
        Wrong shape.
    """
    count = len(body.bone_names)
    if np.ndim(bone_transforms) != 4 or np.shape(bone_transforms)[1:] != (count, 4, 4):
        raise InputError(
            f"bone transforms have shape {np.shape(bone_transforms)}; expected (T, {count}, 4, 4)"
        )
    transforms = np.asarray(bone_transforms, dtype=np.float64)
    rest = body.rest_transforms.astype(np.float64)
    parents = body.bone_parents.astype(np.int64)
    offsets = rest[:, :3, 3] - rest[np.maximum(parents, 0), :3, 3]
    from_rest = transforms[..., :3, :3] @ np.swapaxes(rest[:, :3, :3], 1, 2)
    skeleton = skeleton_of("custom", parents.tolist(), body.bone_names)
    rotmats = np.tile(np.eye(3), (len(transforms), count, 1, 1))
    to_offset = rotvec_to_rotmat(
        swing_between(
            skeleton.rest_directions[1:],
            np.where(offsets[1:].any(1, keepdims=True), offsets[1:], skeleton.rest_directions[1:]),
        )
    )
    rotmats[:, 1:] = (
        from_rest[:, parents[1:]] @ to_offset
    )  # the bone that ends at a joint turns with the joint's parent
    return Motion(
        joints=transforms[..., :3, 3].astype(np.float32),
        rotations=rotmats_to_chain(rotmats, skeleton).astype(np.float32),
        root=transforms[:, 0, :3, 3].astype(np.float32),
        fps=float(fps),
        parents=parents,
        joint_names=body.bone_names,
        action=action,
        seed=seed,
        provenance={"body": body.model},
        rest_offsets=np.round(offsets, 7),
    )

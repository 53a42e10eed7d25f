"""Kinematic trees: the skeletons of the papers' data sets, and construction of others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from a2v.errors import InputError
from a2v.types import FloatArray, IntArray


@dataclass(frozen=True)
class Skeleton:
    """A kinematic tree that is covered by chains (paper, Sec. 4.1.1 and Fig. 2).

    Attributes
    ----------
    name : str
    joint_names : tuple of J str
        Joint 0 is the root.
    chains : tuple of tuples of int
        Each lists joints from its start outwards; a chain starts at the root or at a joint of an
        earlier chain, and every joint but the root ends exactly one bone.
    rest_directions : (J, 3) float64
        Unit direction of the bone that ends at each joint when all rotations are zero (world axes:
        y up, facing +z, the person's left +x: a T-pose); zero for the root.
    feet : tuple of int
        Joints that touch the ground (ankles and toes), for contact and skating.
    hips, shoulders : tuple of 2 int or None
        (left, right) joints; the way from right to left points to the person's left.
    """

    name: str
    joint_names: tuple[str, ...]
    chains: tuple[tuple[int, ...], ...]
    rest_directions: FloatArray = field(repr=False)
    feet: tuple[int, ...] = ()
    hips: tuple[int, int] | None = None
    shoulders: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        parents = np.full(len(self.joint_names), -2)
        parents[0] = -1
        for chain in self.chains:
            for parent, joint in pairwise(chain):
                if parents[joint] != -2:
                    raise InputError(f"skeleton '{self.name}': joint {joint} ends two bones")
                if parents[parent] == -2:
                    raise InputError(
                        f"skeleton '{self.name}': chain {chain} starts at joint {chain[0]}, which "
                        "no earlier chain reaches"
                    )
                parents[joint] = parent
        if (parents == -2).any():
            raise InputError(
                f"skeleton '{self.name}': no chain reaches joint {int(np.argmax(parents == -2))}"
            )
        if np.shape(self.rest_directions) != (len(self.joint_names), 3):
            raise InputError(
                f"skeleton '{self.name}': rest_directions must be ({len(self.joint_names)}, 3)"
            )

    @property
    def n_joints(self) -> int:
        """Number of joints J."""
        return len(self.joint_names)

    @cached_property
    def parents(self) -> IntArray:
        """Parent of each joint, (J,) int; -1 for the root."""
        parents = np.full(self.n_joints, -1)
        for chain in self.chains:
            parents[list(chain[1:])] = chain[:-1]
        return parents

    @cached_property
    def levels(self) -> tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]:
        """Bones grouped by their place in their chain: (joints, previous joints of the same chain)
        per place.

        Rotations of one level depend only on the previous level, so forward kinematics is one
        batched product per level instead of a loop over chains and joints. The previous joint of a
        chain's first bone is -1: chains start from the identity.
        """
        levels = []
        for place in range(1, max(map(len, self.chains))):
            bones = [
                (chain[place], chain[place - 1] if place > 1 else -1)
                for chain in self.chains
                if len(chain) > place
            ]
            levels.append(
                (tuple(joint for joint, _ in bones), tuple(previous for _, previous in bones))
            )
        return tuple(levels)

    @cached_property
    def path_matrix(self) -> FloatArray:
        """(J, J) float64 of 0 and 1: ``positions = root + path_matrix @ bone_vectors`` sums bones
        from the root."""
        matrix = np.zeros((self.n_joints, self.n_joints))
        for joint in range(1, self.n_joints):
            node = joint
            while node > 0:
                matrix[joint, node] = 1
                node = int(self.parents[node])
        return matrix

    def index(self, name: str) -> int:
        """Index of the joint called `name`."""
        try:
            return self.joint_names.index(name)
        except ValueError:
            raise InputError(
                f"skeleton '{self.name}' has no joint '{name}'; it has "
                f"{', '.join(self.joint_names)}"
            ) from None


def _directions(table: Sequence[Sequence[float]]) -> FloatArray:
    directions = np.asarray(table, dtype=np.float64)
    length = np.linalg.norm(directions, axis=-1, keepdims=True)
    unit: FloatArray = directions / np.where(length == 0, 1, length)
    return unit


_LEFT = (1, 0, 0)
"""Unit vectors of the world."""
_RIGHT = (-1, 0, 0)
_UP = (0, 1, 0)
_DOWN = (0, -1, 0)
_FRONT = (0, 0, 1)

HUMANACT12 = Skeleton(
    name="humanact12",
    joint_names=(
        "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
        "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
        "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hand", "right_hand",
    ),
    chains=((0, 1, 4, 7, 10), (0, 2, 5, 8, 11), (0, 3, 6, 9, 12, 15), (9, 13, 16, 18, 20, 22), (9, 14, 17, 19, 21, 23)),
    rest_directions=_directions(
        [(0, 0, 0), (0.6, -0.8, 0), (-0.6, -0.8, 0), _UP, _DOWN, _DOWN, _UP, _DOWN, _DOWN, _UP, _FRONT, _FRONT, _UP,
         (0.6, 0.8, 0), (-0.6, 0.8, 0), _UP, _LEFT, _RIGHT, _LEFT, _RIGHT, _LEFT, _RIGHT, _LEFT, _RIGHT]
    ),
    feet=(7, 10, 8, 11),
    hips=(1, 2),
    shoulders=(16, 17),
)  # fmt: skip
"""24 joints in SMPL's order (HumanAct12)."""

CMU = Skeleton(
    name="cmu",
    joint_names=(
        "pelvis", "spine", "neck", "head", "left_shoulder", "left_elbow", "left_wrist", "left_hand", "right_shoulder",
        "right_elbow", "right_wrist", "right_hand", "left_hip", "left_knee", "left_ankle", "left_foot", "right_hip",
        "right_knee", "right_ankle", "right_foot",
    ),
    chains=((0, 1, 2, 3), (0, 12, 13, 14, 15), (0, 16, 17, 18, 19), (1, 4, 5, 6, 7), (1, 8, 9, 10, 11)),
    rest_directions=_directions(
        [(0, 0, 0), _UP, _UP, _UP, _LEFT, _LEFT, _LEFT, _LEFT, _RIGHT, _RIGHT, _RIGHT, _RIGHT, (0.6, -0.8, 0), _DOWN,
         _DOWN, _FRONT, (-0.6, -0.8, 0), _DOWN, _DOWN, _FRONT]
    ),
    feet=(14, 15, 18, 19),
    hips=(12, 16),
    shoulders=(4, 8),
)  # fmt: skip
"""20 joints of the papers' CMU MoCap files (the papers say 22; the released files have 20)."""

NTU_VIBE = Skeleton(
    name="ntu_vibe",
    joint_names=(
        "pelvis", "neck", "right_shoulder", "right_elbow", "right_wrist", "left_shoulder", "left_elbow", "left_wrist",
        "head", "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle", "left_heel",
        "right_heel", "head_top",
    ),
    chains=((0, 12, 13, 14, 15), (0, 9, 10, 11, 16), (0, 1, 8, 17), (1, 5, 6, 7), (1, 2, 3, 4)),
    rest_directions=_directions(
        [(0, 0, 0), _UP, _RIGHT, _RIGHT, _RIGHT, _LEFT, _LEFT, _LEFT, _UP, (-0.8, -0.6, 0), _DOWN, _DOWN, (0.8, -0.6, 0),
         _DOWN, _DOWN, (0, -0.6, -0.8), (0, -0.6, -0.8), _UP]
    ),
    feet=(14, 15, 11, 16),
    hips=(12, 9),
    shoulders=(5, 2),
)  # fmt: skip
"""18 joints that the authors re-estimated with VIBE for NTU-RGBD: OpenPose's body, whose joint 8 is
the nose, with heels but no toes."""

SKELETONS: dict[str, Skeleton] = {
    skeleton.name: skeleton for skeleton in (HUMANACT12, CMU, NTU_VIBE)
}


def skeleton_from_parents(
    parents: Sequence[int],
    joint_names: Sequence[str],
    offsets: FloatArray | None = None,
    *,
    name: str = "custom",
) -> Skeleton:
    """Build a `Skeleton` from a parent list (parents before children), as read from a BVH file.

    A joint's first child continues its chain; every other child starts a new chain.

    Parameters
    ----------
    parents : J ints
        -1 for the root, which is joint 0.
    joint_names : J str
    offsets : (J, 3) float or None
        Rest offsets from the parents (any length); their directions are the rest directions, "up"
        without them.

    Raises
    ------
    InputError
        Parents are not sorted, or there is no root or more than one.
    """
    n = len(parents)
    if n == 0 or parents[0] != -1 or any(not 0 <= parents[j] < j for j in range(1, n)):
        raise InputError(
            f"skeleton '{name}': parents must list the root (-1) first and every parent before its "
            "children"
        )
    children: list[list[int]] = [[] for _ in range(n)]
    for joint in range(1, n):
        children[parents[joint]].append(joint)
    chains: list[tuple[int, ...]] = []
    starts = [(0, child) for child in children[0]]
    while starts:
        start, joint = starts.pop(0)
        chain = [start, joint]
        while children[joint]:
            starts += [(joint, child) for child in children[joint][1:]]
            joint = children[joint][0]
            chain.append(joint)
        chains.append(tuple(chain))
    directions = (
        np.tile(np.asarray(_UP, dtype=np.float64), (n, 1))
        if offsets is None
        else _directions(np.asarray(offsets).tolist())
    )
    directions[0] = 0
    return Skeleton(
        name=name, joint_names=tuple(joint_names), chains=tuple(chains), rest_directions=directions
    )


def skeleton_of(name: str, parents: Sequence[int], joint_names: Sequence[str]) -> Skeleton:
    """Return the known skeleton called `name`, or one built from the parents of a custom motion."""
    known = SKELETONS.get(name)
    if known is not None and known.parents.tolist() == list(parents):
        return known
    return skeleton_from_parents(list(parents), joint_names, name=name)


def subtree(parents: IntArray, bone: int) -> list[int]:
    """Return a bone and all its descendants, parents first."""
    found = [bone]
    for other in range(bone + 1, len(parents)):
        if int(parents[other]) in found:
            found.append(other)
    return found

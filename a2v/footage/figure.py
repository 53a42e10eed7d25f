"""A reduced body model for many poses of one shape: only the bones that landmarks and joints
need."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.pose_space import pose_space
from a2v.kinematics.skeleton import Skeleton, skeleton_from_parents
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.types import FloatArray, IntArray

if TYPE_CHECKING:
    from torch import Tensor

JOINTS: tuple[tuple[str, str, str], ...] = (
    ("pelvis", "", "root"),
    *(
        (
            f"{side}_{joint}",
            f"{side}_{parent}" if parent != "pelvis" else parent,
            f"{bone}.{side[0].upper()}",
        )
        for side in ("left", "right")
        for joint, parent, bone in (
            ("hip", "pelvis", "upperleg01"),
            ("knee", "hip", "lowerleg01"),
            ("ankle", "knee", "foot"),
            ("foot", "ankle", "toe1-1"),
        )
    ),
    ("spine1", "pelvis", "spine04"),
    ("spine2", "spine1", "spine02"),
    ("spine3", "spine2", "spine01"),
    ("neck", "spine3", "neck01"),
    ("head", "neck", "head"),
    ("head_top", "head", "head"),
    ("head_front", "head", "head"),
    *(
        (
            f"{side}_{joint}",
            parent if parent == "spine3" else f"{side}_{parent}",
            f"{bone}.{side[0].upper()}",
        )
        for side in ("left", "right")
        for joint, parent, bone in (
            ("collar", "spine3", "clavicle"),
            ("shoulder", "collar", "upperarm01"),
            ("elbow", "shoulder", "lowerarm01"),
            ("wrist", "elbow", "wrist"),
            ("hand", "wrist", "finger3-1"),
        )
    ),
)
"""Joints of a tracked person: name, parent, and the bone of Anny whose head is the joint (except
`_POINTS`)."""
NAMES: tuple[str, ...] = tuple(name for name, _, _ in JOINTS)
PARENTS: tuple[int, ...] = tuple(
    -1 if not parent else NAMES.index(parent) for _, parent, _ in JOINTS
)
_POINTS = {"head_top": (0.0, 0.17, 0.02), "head_front": (0.0, 0.04, 0.16)}
"""Offsets of joints that are not the head of a bone, from the head of their bone at rest,
meters."""


@lru_cache(maxsize=1)
def person_skeleton() -> Skeleton:
    """The skeleton of `JOINTS`."""
    import dataclasses

    index = NAMES.index
    plain = skeleton_from_parents(PARENTS, NAMES)
    return dataclasses.replace(
        plain,
        feet=tuple(
            index(f"{side}_{joint}") for side in ("left", "right") for joint in ("ankle", "foot")
        ),
        hips=(index("left_hip"), index("right_hip")),
        shoulders=(index("left_shoulder"), index("right_shoulder")),
    )


class Figure:
    """A body of one shape that computes landmarks and joints from poses. It has only the bones that
    `PoseSpace` turns (26 of Anny's 104).

    Parameters
    ----------
    model : AnnyModel
    shape : (S,) tensor
        If it requires gradients, landmarks and joints do as well.
    """

    def __init__(self, model: AnnyModel, shape: Tensor):
        """See the class."""
        import torch

        self.frame = _Frame.of(model)
        rest, heads = model.rest(shape.double(), model.landmark_vertices)
        frame = self.frame
        moving = heads[frame.bones]
        self.steps = torch.cat([moving[:1], moving[1:] - moving[frame.parents[1:]]])
        """From the parent's head at rest (n, 3); the first: from the origin."""
        self.marks = torch.einsum(
            "lv,vb,vbk->lbk", frame.of_vertices, frame.weights, rest[:, None] - moving[None]
        )
        fixed = heads - moving[frame.carrier]
        self.marks = self.marks + torch.einsum(
            "lB,Bb,Bk->lbk", frame.of_bones, frame.carried, fixed
        )
        self.wrists = frame.wrists
        """Rows of the moving bones that carry the left and the right hand."""
        self.points = (
            torch.zeros(len(JOINTS), 3, dtype=torch.float64)
            + heads[frame.joint_bones]
            - moving[frame.joint_carrier]
            + frame.joint_offsets
        )

    def pose(self, root: Tensor, angles: Tensor, place: Tensor) -> tuple[Tensor, Tensor]:
        """World rotations (T, n, 3, 3) and heads (T, n, 3) of the moving bones.

        Parameters
        ----------
        root : (T, 3, 3)
            Rotation of the whole body.
        angles : (T, D)
        place : (T, 3)
            Added to everything, meters.
        """
        import torch

        frame = self.frame
        local = rotvec_to_rotmat((angles @ frame.basis).reshape(*angles.shape[:-1], -1, 3))
        turns: list[Tensor] = [root]
        heads: list[Tensor] = [place + self.steps[0]]
        for bone in range(1, len(frame.bones)):
            parent = int(frame.parents[bone])
            turns.append(turns[parent] @ local[..., bone, :, :])
            heads.append(heads[parent] + turns[parent] @ self.steps[bone])
        return torch.stack(turns, dim=-3), torch.stack(heads, dim=-2)

    def landmarks(self, turns: Tensor, heads: Tensor) -> Tensor:
        """BlazePose's landmarks (T, 33, 3), meters."""
        import torch

        return torch.einsum("tbij,lbj->tli", turns, self.marks) + self.frame.shares @ heads

    def joints(self, turns: Tensor, heads: Tensor) -> Tensor:
        """Return the positions (T, J, 3) of `JOINTS`, meters."""
        carrier = self.frame.joint_carrier
        moved: Tensor = (turns[:, carrier] @ self.points[None, :, :, None])[..., 0] + heads[
            :, carrier
        ]
        return moved


class _Frame:
    """The parts of a `Figure` that do not depend on the shape."""

    def __init__(self, model: AnnyModel):
        import torch

        space = pose_space(model)
        turned = np.abs(space.basis).sum(axis=(0, 2)) > 0
        turned[0] = True
        bones = np.flatnonzero(turned)
        place = {int(bone): index for index, bone in enumerate(bones)}
        carrier = np.array(
            [place[self._moving(model.bone_parents, turned, bone)] for bone in range(model.n_bones)]
        )
        self.bones, self.carrier = torch.from_numpy(bones), torch.from_numpy(carrier)
        above = [
            -1
            if bone == 0
            else place[self._moving(model.bone_parents, turned, int(model.bone_parents[bone]))]
            for bone in bones
        ]
        self.parents = torch.tensor(above)
        self.basis = torch.from_numpy(
            space.basis[:, bones].reshape(len(space), -1).astype(np.float64)
        )
        self.carried = torch.nn.functional.one_hot(self.carrier, len(bones)).double()
        ids, of_vertices, of_bones = model._landmark_table
        self.of_vertices, self.of_bones = of_vertices.double(), of_bones.double()
        self.weights = (
            torch.from_numpy(model.weights[ids.numpy()].astype(np.float64)) @ self.carried
        )
        self.shares = self.of_vertices @ self.weights + self.of_bones @ self.carried
        self.joint_bones = torch.tensor([model.bone(bone) for _, _, bone in JOINTS])
        self.joint_carrier = self.carrier[self.joint_bones]
        self.wrists = [int(self.carrier[model.bone(f"wrist.{side}")]) for side in "LR"]
        self.joint_offsets = torch.tensor(
            [_POINTS.get(name, (0.0, 0.0, 0.0)) for name, _, _ in JOINTS], dtype=torch.float64
        )

    @staticmethod
    def _moving(parents: IntArray, turned: FloatArray, bone: int) -> int:
        while not turned[bone]:
            bone = int(parents[bone])
        return bone

    @classmethod
    def of(cls, model: AnnyModel) -> _Frame:
        """The cached frame of a model."""
        return _frame_of(model)

    @cached_property
    def count(self) -> int:
        """Number of moving bones."""
        return len(self.bones)


@lru_cache(maxsize=2)
def _frame_of(model: AnnyModel) -> _Frame:
    return _Frame(model)

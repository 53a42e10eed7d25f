"""Base of all body models: a tree of bones and a skin that follows it (linear blend skinning).
Shape and pose give vertices and bones."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from a2v.errors import InputError
from a2v.types import Body, FloatArray, IntArray

if TYPE_CHECKING:
    from torch import Tensor

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


@dataclass(frozen=True)
class BodyState:
    """Result of `BodyModel.forward`: tensors that carry gradients.

    Attributes
    ----------
    vertices : (..., V, 3)
        Meters; if `vertex_ids` was given only these vertices, in their order.
    transforms : (..., B, 4, 4)
        World from bone at this pose; the translation is the bone's head.
    rest_heads : (..., B, 3)
        Bone heads in the rest pose of this shape.
    rest_vertices : (..., V, 3)
        The same vertices in the rest pose of this shape.
    """

    vertices: Tensor
    transforms: Tensor
    rest_heads: Tensor
    rest_vertices: Tensor

    @property
    def joints(self) -> Tensor:
        """Bone heads at this pose, (..., B, 3) meters."""
        return self.transforms[..., :3, 3]


@runtime_checkable
class BodyModel(Protocol):
    """A parametric, skinned body.

    Conventions that every model keeps: meters, y up, facing +z, the person's left on +x. In the
    rest pose (all rotations zero) every bone's frame is parallel to the world's, so a rotation
    vector is given **in world axes at rest**: ``world_j = world_parent(j) @ translate(head_j -
    head_parent(j)) @ rotate(rotvec_j)``. Entry 0 rotates the whole body about the pelvis.
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
    joint_bones: Mapping[
        str, str
    ]  # names of joints in JOINT_BONES, and the bone whose head each is

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

    def forward(
        self,
        rotations: Tensor,
        shape: Tensor,
        translation: Tensor | None = None,
        *,
        vertex_ids: Tensor | None = None,
    ) -> BodyState:
        """Pose the body.

        Parameters
        ----------
        rotations : (..., B, 3)
            Rotation vectors relative to the parent, in world axes at rest; zero is the rest pose.
            float32 or float64.
        shape : (..., S)
        translation : (..., 3), optional
            Meters, added to everything.
        vertex_ids : (n,) int64, optional
            Compute these vertices only.
        """
        ...

    def tails(self, vertices: Tensor, joints: Tensor) -> Tensor:
        """Return the far ends of the bones (..., B, 3): the main child's head, or the tip of the
        flesh for a bone without children.

        From posed vertices (..., V, 3) and bone heads (..., B, 3), all in meters.
        """
        ...

    def landmarks(self, state: BodyState) -> Tensor:
        """The 33 BlazePose landmarks (..., 33, 3) of a state with all vertices, meters."""
        ...


class BoneTree:
    """Forward kinematics over a tree of bones, level by level."""

    def __init__(self, parents: IntArray):
        """`parents` (B,), -1 for the root."""
        import torch

        levels: list[IntArray] = []
        self._above: list[Tensor] = []
        """Position of each bone's parent within the previous level, from the second level on."""
        current = np.flatnonzero(parents < 0)
        while len(current):
            if levels:
                place = {int(bone): number for number, bone in enumerate(levels[-1])}
                self._above.append(torch.as_tensor([place[int(parents[bone])] for bone in current]))
            levels.append(current)
            current = np.flatnonzero(np.isin(parents, current))
        order = np.concatenate(levels)
        self._sizes = [len(level) for level in levels]
        self._order = torch.from_numpy(order)
        self._parents = torch.from_numpy(np.maximum(parents, 0).astype(np.int64)[order])
        self._inverse_order = torch.argsort(self._order)

    def pose(
        self, rotmats: Tensor, rest_heads: Tensor, translation: Tensor | None = None
    ) -> Tensor:
        """World transforms (..., B, 4, 4) of the bones from rotations (..., B, 3, 3) and rest heads
        (..., B, 3)."""
        import torch

        batch = np.broadcast_shapes(tuple(rotmats.shape[:-3]), tuple(rest_heads.shape[:-2]))
        rotmats, rest_heads = rotmats.expand(*batch, -1, -1, -1), rest_heads.expand(*batch, -1, -1)
        heads = rest_heads.index_select(-2, self._order)
        step = heads - rest_heads.index_select(-2, self._parents)
        turned = rotmats.index_select(-3, self._order)
        # index_select has a much cheaper gradient than an index in brackets
        moves = torch.cat([turned, step[..., None]], dim=-1)
        first, *later = torch.split(moves, self._sizes, dim=-3)
        root = heads[..., : self._sizes[0], :]
        if translation is not None:
            root = root + translation[..., None, :]
        placed = [torch.cat([first[..., :3], root[..., None]], dim=-1)]
        for own, above in zip(later, self._above, strict=True):
            parent = placed[-1].index_select(-3, above)
            moved = parent[..., :3] @ own
            placed.append(torch.cat([moved[..., :3], moved[..., 3:] + parent[..., 3:]], dim=-1))
        top = torch.cat(placed, dim=-3).index_select(-3, self._inverse_order)
        bottom = torch.tensor([0.0, 0.0, 0.0, 1.0], dtype=top.dtype).expand(*top.shape[:-2], 1, 4)
        return torch.cat([top, bottom], dim=-2)


def blend_skin(
    rest_vertices: Tensor, weights: Tensor, *, transforms: Tensor, rest_heads: Tensor
) -> Tensor:
    """Linear blend skinning: the posed vertices (..., V, 3), meters.

    Parameters
    ----------
    rest_vertices : (..., V, 3)
    weights : (V, B)
    transforms : (..., B, 4, 4)
        World from bone, of `BoneTree.pose`.
    rest_heads : (..., B, 3)
        Heads of the bones at rest.
    """
    import torch

    linear = transforms[..., :3, :3]
    offset = transforms[..., :3, 3] - (linear @ rest_heads[..., None])[..., 0]
    affine = torch.cat([linear, offset[..., None]], dim=-1).flatten(-2)  # (..., B, 12)
    blended = (weights @ affine).reshape(*affine.shape[:-2], -1, 3, 4)
    return (blended[..., :3] @ rest_vertices[..., None])[..., 0] + blended[..., 3]


def keep_recent(
    kept: dict[Key, Value], key: Key, make: Callable[[], Value], *, count: int = 4
) -> Value:
    """Return `kept[key]`, or make and store it; the oldest of `count` entries is dropped.

    A fit needs the same few vertices many times.
    """
    if key not in kept:
        while len(kept) >= count:
            kept.pop(next(iter(kept)))
        kept[key] = make()
    return kept[key]


def make_body(
    model: BodyModel,
    rotations: FloatArray | None = None,
    shape: FloatArray | Mapping[str, float] | None = None,
    translation: FloatArray | Sequence[float] | None = None,
    *,
    grounded: bool = False,
    provenance: Mapping[str, Any] | None = None,
) -> Body:
    """Make a `Body` of `model` in one pose and shape.

    Parameters
    ----------
    rotations : (B, 3) float, optional
        Rotation vectors in the convention of `BodyModel`; the rest pose if left out.
    shape : (S,) float or mapping, optional
        Shape parameters, or the ones that differ from the default by name.
    translation : (3,) float, optional
        Meters.
    grounded : bool
        Move the body so that its lowest point has y = 0 and its pelvis x = z = 0.

    Raises
    ------
    InputError
        A shape parameter's name is unknown, or a wrong number of values.
    """
    import torch

    values = _shape_values(model, shape)
    rotvecs = (
        np.zeros((model.n_bones, 3), np.float32)
        if rotations is None
        else np.asarray(rotations, dtype=np.float32)
    )
    if rotvecs.shape != (model.n_bones, 3):
        raise InputError(
            f"body rotations have shape {rotvecs.shape}; expected ({model.n_bones}, 3)"
        )
    move = (
        np.zeros(3, np.float32)
        if translation is None
        else np.asarray(translation, dtype=np.float32)
    )
    with torch.no_grad():
        state = model.forward(
            torch.from_numpy(rotvecs), torch.from_numpy(values), torch.from_numpy(move)
        )
        if grounded:
            pelvis = state.joints[0]
            shift = -torch.stack([pelvis[0], state.vertices[:, 1].min(), pelvis[2]])
            move = move + shift.numpy()
            state = model.forward(
                torch.from_numpy(rotvecs), torch.from_numpy(values), torch.from_numpy(move)
            )
        tails = model.tails(state.vertices, state.joints)
        rest = np.tile(np.eye(4, dtype=np.float32), (model.n_bones, 1, 1))
        rest[:, :3, 3] = state.rest_heads.numpy()
    return Body(
        model=model.name,
        parameters={"rotations": rotvecs, "shape": values, "translation": move.astype(np.float32)},
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


def _shape_values(model: BodyModel, shape: FloatArray | Mapping[str, float] | None) -> FloatArray:
    """Return all shape parameters (S,) float32 of `make_body`'s `shape`."""
    if isinstance(shape, Mapping):
        if unknown := [name for name in shape if name not in model.shape_names]:
            raise InputError(
                f"unknown shape parameter '{unknown[0]}'; choose from "
                f"{', '.join(model.shape_names)}"
            )
        values = model.shape_default.copy()
        for key, value in shape.items():
            values[model.shape_names.index(key)] = value
    else:
        values = model.shape_default if shape is None else np.asarray(shape, dtype=np.float32)
    if values.shape != (model.n_shape,):
        raise InputError(f"body shape has shape {values.shape}; expected ({model.n_shape},)")
    return values

"""The SMPL family (SMPL, SMPL-H, SMPL-X) from the user's own file (Loper et al. 2015; Romero et al.
2017; Pavlakos et al. 2019).

The models are free for research only, so none is shipped. `smplx` has the same license and is not
needed: linear blend skinning is implemented here. The file is the ``.npz`` of the models' sites
(arrays ``v_template``, ``shapedirs``, ``posedirs``, ``J_regressor``,
``weights``, ``kintree_table``, ``f``). Pickles are not opened, since they can run any program.
"""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.parts import PARTS, parts_of_bones
from a2v.body.skinning import BodyModel, BodyState, BoneTree, blend_skin, keep_recent
from a2v.errors import InputError
from a2v.io import open_file, reading
from a2v.kinematics.names import BLAZEPOSE
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.types import FloatArray, IntArray

if TYPE_CHECKING:
    import torch
    from torch import Tensor

MAX_MODEL_BYTES = 2 << 30
MAX_SHAPES = 10
"""Number of shape coefficients that are used, of the 10 to 400 in a file."""

_BODY = (
    "pelvis",
    "left_hip",
    "right_hip",
    "spine1",
    "left_knee",
    "right_knee",
    "spine2",
    "left_ankle",
    "right_ankle",
    "spine3",
    "left_foot",
    "right_foot",
    "neck",
    "left_collar",
    "right_collar",
    "head",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
)
_FINGERS = tuple(
    f"{side}_{finger}{place}"
    for side in ("left", "right")
    for finger in ("index", "middle", "pinky", "ring", "thumb")
    for place in (1, 2, 3)
)
JOINTS: dict[int, tuple[str, tuple[str, ...]]] = {
    24: ("smpl", (*_BODY, "left_hand", "right_hand")),
    52: ("smplh", (*_BODY, *_FINGERS)),
    55: ("smplx", (*_BODY, "jaw", "left_eye_smplhf", "right_eye_smplhf", *_FINGERS)),
}
"""Name of the model and of its joints, by the number of joints."""

# Joints with the same position in SMPL's regressors and in Anny; those of the spine differ.
_LIMB_JOINTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
_JOINT_BONES = {
    **{"hips": "pelvis", "neck": "neck", "head": "head"},
    **{
        f"{side}_{joint}": f"{side}_{joint}" for side in ("left", "right") for joint in _LIMB_JOINTS
    },
}


class SmplModel(BodyModel):
    """A model of the SMPL family as a `BodyModel`.

    Joints carry SMPL's names. Rotation vectors are in world axes at rest (SMPL's own convention);
    shape parameters are its first ten betas. The rest pose is the T-pose, the pelvis a little below
    the origin.
    """

    joint_bones = _JOINT_BONES

    def __init__(self, arrays: dict[str, np.ndarray]):
        import torch

        self.bone_parents: IntArray = _parents(arrays["kintree_table"])
        self.name, self.bone_names = JOINTS[len(self.bone_parents)]
        self.faces: IntArray = arrays["f"].astype(np.int32)
        weights = arrays["weights"].astype(np.float32)
        self.weights: FloatArray = weights / weights.sum(axis=1, keepdims=True)
        self.parts: IntArray = parts_of_bones(self.bone_names, self.weights)
        count = min(MAX_SHAPES, arrays["shapedirs"].shape[2])
        self.shape_names: tuple[str, ...] = tuple(f"beta{index}" for index in range(count))
        self.shape_default: FloatArray = np.zeros(count, np.float32)
        self.shape_bounds: FloatArray = np.tile(np.array([-4.0, 4.0], np.float32), (count, 1))
        self._template = torch.from_numpy(arrays["v_template"].astype(np.float32))
        self._shapes = torch.from_numpy(arrays["shapedirs"][:, :, :count].astype(np.float32))
        poses = arrays["posedirs"].astype(np.float32)
        self._poses = torch.from_numpy(np.ascontiguousarray(poses.reshape(-1, poses.shape[-1]).T))
        regressor = arrays["J_regressor"].astype(np.float64)
        self._joints = tuple(
            torch.from_numpy(
                np.einsum("jv,v...->j...", regressor, value.numpy()).astype(np.float32)
            )
            for value in (self._template, self._shapes)
        )
        self._kept: dict[tuple[bytes | None, torch.dtype], tuple[Tensor, ...]] = {}
        self._weights = torch.from_numpy(self.weights)
        self._tree = BoneTree(self.bone_parents)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SmplModel:
        """Read a model file.

        Raises
        ------
        InputError
            The file is missing, is not a ``.npz``, is too large, or has another format. The message
            names the reason.
        """
        return cls(_read(Path(path)))

    def forward(
        self,
        rotations: Tensor,
        shape: Tensor,
        translation: Tensor | None = None,
        *,
        vertex_ids: Tensor | None = None,
    ) -> BodyState:
        """Pose the body, as in `BodyModel.forward`."""
        import torch

        batch = np.broadcast_shapes(tuple(rotations.shape[:-2]), tuple(shape.shape[:-1]))
        rotvecs = rotations.expand(*batch, self.n_bones, 3).reshape(-1, self.n_bones, 3)
        betas = shape.expand(*batch, self.n_shape).reshape(-1, self.n_shape)
        template, shapes, poses, weights, joints, joint_shapes = self._arrays(
            vertex_ids, betas.dtype
        )
        rest = template + torch.einsum("ns,vcs->nvc", betas, shapes)
        heads = joints + torch.einsum("ns,jcs->njc", betas, joint_shapes)
        rotmats = rotvec_to_rotmat(rotvecs)
        moves = None if translation is None else translation.expand(*batch, 3).reshape(-1, 3)
        transforms = self._tree.pose(rotmats, heads, moves)
        bent = ((rotmats[:, 1:] - torch.eye(3, dtype=betas.dtype)).flatten(1) @ poses).reshape(
            rest.shape
        )
        posed = blend_skin(rest + bent, weights, transforms=transforms, rest_heads=heads)
        shaped = [
            value.reshape(*batch, *value.shape[1:]) for value in (posed, transforms, heads, rest)
        ]
        return BodyState(
            vertices=shaped[0], transforms=shaped[1], rest_heads=shaped[2], rest_vertices=shaped[3]
        )

    def _arrays(self, vertex_ids: Tensor | None, dtype: torch.dtype) -> tuple[Tensor, ...]:
        """Return template, shapes, pose corrections and weights of some vertices, and those of the
        joints."""

        def chosen() -> tuple[Tensor, ...]:
            ids = slice(None) if vertex_ids is None else vertex_ids
            poses = self._poses.reshape(len(self._poses), -1, 3)[:, ids].flatten(1)
            found = (
                self._template[ids],
                self._shapes[ids],
                poses,
                self._weights[ids],
                *self._joints,
            )
            return tuple(value.to(dtype) for value in found)

        return keep_recent(
            self._kept,
            (None if vertex_ids is None else vertex_ids.numpy().tobytes(), dtype),
            chosen,
        )

    def tails(self, vertices: Tensor, joints: Tensor) -> Tensor:
        """Return the far ends of the joints' bones (..., B, 3): the main child's joint, or the
        tip of the flesh."""
        import torch

        main = {
            "pelvis": "spine1",
            "spine3": "neck",
            "left_wrist": "left_middle1",
            "right_wrist": "right_middle1",
        }
        ends = []
        for bone, name in enumerate(self.bone_names):
            children = np.flatnonzero(self.bone_parents == bone)
            wanted = main.get(name)
            if wanted in self.bone_names:
                ends.append(joints[..., self.bone_names.index(wanted), :])
            elif len(children):
                ends.append(joints[..., int(children[0]), :])
            else:
                ends.append(vertices[..., torch.from_numpy(self._tips[bone]), :].mean(dim=-2))
        return torch.stack(ends, dim=-2)

    def landmarks(self, state: BodyState) -> Tensor:
        """The 33 BlazePose landmarks (..., 33, 3) of a state with all vertices, meters."""
        import torch

        points = []
        for joint, ids in self._landmark_table:
            points.append(
                state.joints[..., joint, :]
                if joint is not None
                else state.vertices[..., torch.from_numpy(ids), :].mean(dim=-2)
            )
        return torch.stack(points, dim=-2)

    @cached_property
    def _tips(self) -> dict[int, np.ndarray]:
        """Vertices at the far end of every joint without a child."""
        rest, heads = self._template.numpy(), self._joints[0].numpy()
        tips = {}
        for bone in np.flatnonzero(~np.isin(np.arange(self.n_bones), self.bone_parents)):
            own = np.flatnonzero(self.weights[:, bone] >= min(0.5, self.weights[:, bone].max()))
            tips[int(bone)] = own[
                np.argsort(
                    (rest[own] - heads[bone]) @ (heads[bone] - heads[self.bone_parents[bone]])
                )[-4:]
            ]
        return tips

    @cached_property
    def _landmark_table(self) -> list[tuple[int | None, np.ndarray]]:
        """Return for each landmark a joint, or the vertices of the template whose mean it is."""
        rest = self._template.numpy()
        none = np.zeros(0, np.int64)
        skull = np.flatnonzero(self.parts == PARTS.index("head"))
        nose = skull[rest[skull, 2].argmax()]
        wide = float(np.ptp(rest[skull, 0]))
        table: list[tuple[int | None, np.ndarray]] = []
        for name in BLAZEPOSE:
            side, _, joint = name.partition("_")
            sign = -1.0 if "right" in name else 1.0
            if f"{side}_{joint}" in self.bone_names:
                table.append((self.bone_names.index(f"{side}_{joint}"), none))
            elif joint in ("pinky", "index", "thumb"):
                hand = (
                    f"{side}_{joint}1" if f"{side}_{joint}1" in self.bone_names else f"{side}_hand"
                )
                table.append((self.bone_names.index(hand), none))
            elif joint in ("heel", "foot_index"):
                foot = np.flatnonzero(self.parts == PARTS.index(f"{side}_foot"))
                order = foot[np.argsort(rest[foot, 2])]
                table.append((None, order[:4] if joint == "heel" else order[-4:]))
            # landmarks of the face: the vertex nearest to the usual position relative to the tip of
            # the nose
            else:
                along, up = {
                    "ear": (0.5, 0.2),
                    "eye": (0.2, 0.22),
                    "eye_inner": (0.1, 0.22),
                    "eye_outer": (0.3, 0.22),
                }.get(joint, (0.0, 0.0))
                if name.startswith("mouth"):
                    along, up = 0.16, -0.2
                place = rest[nose] + wide * np.array([sign * along, up, 0.0])
                flat = ((rest[skull, :2] - place[:2]) ** 2).sum(axis=1)
                if joint != "ear":
                    flat[rest[skull, 2] < np.median(rest[skull, 2])] = (
                        np.inf
                    )  # not the back of the head
                table.append((None, skull[[int(flat.argmin())]]))
        return table


def _parents(table: np.ndarray) -> IntArray:
    parents = np.array(table[0], np.int64)
    parents[0] = -1  # stored as 2**32 - 1
    return parents


def _read(path: Path) -> dict[str, np.ndarray]:
    if path.suffix.lower() == ".pkl":
        raise InputError(
            f"{path} is a pickle, which can run any program; convert it to .npz first "
            "(docs/body.md shows how)"
        )
    needed = {
        "v_template": 2,
        "shapedirs": 3,
        "posedirs": 3,
        "J_regressor": 2,
        "weights": 2,
        "kintree_table": 2,
        "f": 2,
    }
    expected = "the .npz of an SMPL, SMPL-H or SMPL-X model"
    with (
        reading(path, "readable .npz", expected),
        open_file(path) as stream,
        np.load(stream, allow_pickle=False) as archive,
    ):
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise InputError(f"{path} holds a single array; expected an SMPL model as .npz")
        sizes = (
            {}
            if archive.zip is None
            else {
                item.filename.removesuffix(".npy"): item.file_size
                for item in archive.zip.infolist()
            }
        )
        if missing := [name for name in needed if name not in archive.files]:
            raise InputError(f"{path} is not an SMPL model: it has no array {', '.join(missing)}")
        if sum(sizes.get(name, 0) for name in needed) > MAX_MODEL_BYTES:
            raise InputError(
                f"{path} unpacks to more than {MAX_MODEL_BYTES >> 30} GiB; refusing to read it"
            )
        arrays = {
            name: archive[name] for name in needed
        }  # other arrays of SMPL-X contain pickled objects
    with reading(path, "usable SMPL model", expected):
        return _checked(path, arrays, needed)


def _checked(
    path: Path, arrays: dict[str, np.ndarray], needed: dict[str, int]
) -> dict[str, np.ndarray]:
    """Check that the arrays have the dimensions `needed` and fit each other; return them."""
    for name, dimensions in needed.items():
        if arrays[name].dtype.kind not in "fiu":
            raise InputError(f"{path}: {name} has the type {arrays[name].dtype}; expected numbers")
        if arrays[name].ndim != dimensions or not np.isfinite(arrays[name]).all():
            raise InputError(
                f"{path}: {name} has shape {arrays[name].shape}; expected {dimensions} dimensions "
                "of finite numbers"
            )
    vertices, bones = len(arrays["v_template"]), arrays["kintree_table"].shape[1]
    if bones not in JOINTS:
        raise InputError(
            f"{path} has {bones} joints; expected "
            f"{', '.join(f'{count} ({name})' for count, (name, _) in JOINTS.items())}"
        )
    wanted = {
        "v_template": (vertices, 3),
        "shapedirs": (vertices, 3, arrays["shapedirs"].shape[2]),
        "posedirs": (vertices, 3, 9 * (bones - 1)),
        "J_regressor": (bones, vertices),
        "weights": (vertices, bones),
        "f": (len(arrays["f"]), 3),
    }
    for name, shape in wanted.items():
        if arrays[name].shape != shape:
            raise InputError(f"{path}: {name} has shape {arrays[name].shape}; expected {shape}")
    faces, parents = arrays["f"], _parents(arrays["kintree_table"])
    if (
        not np.issubdtype(faces.dtype, np.integer)
        or faces.astype(np.int64).min(initial=0) < 0
        or faces.max(initial=0) >= vertices
    ):
        raise InputError(f"{path}: f has indices of vertices that do not exist")
    if (parents[1:] < 0).any() or (parents[1:] >= np.arange(1, bones)).any():
        raise InputError(f"{path}: kintree_table does not list parents before children")
    return arrays

"""Forward kinematics of many poses at once with its gradient written out (torch), for training.

Autograd would keep some hundred arrays of 3x3 matrices; the gradient needs two: rotating the bone
that ends at joint j by a small angle about an axis moves every later bone b of its chain by axis x
b. So the derivative by that angle is the sum of b x (gradient by b), the torque.

Arrays are (bones, 3, N) here, the poses last: every operation runs along N contiguous numbers.
Bones are in the order of `ChainPlan.joints`: by their place in their chain, longer chains first. So
the bones of one place are a slice, and their predecessors are the beginning of the previous slice.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import torch
from torch import Tensor

from a2v.kinematics.skeleton import Skeleton
from a2v.kinematics.so3 import MATRIX_BASIS, constant
from a2v.kinematics.transforms import compose_rows


class ChainPlan(NamedTuple):
    """A skeleton's chains (Eq. 6) as arrays.

    Attributes
    ----------
    joints : (n,) int64
        The joint at which each of the n = J - 1 bones ends.
    levels : tuple of slice
        Bones by their place in their chain.
    rest : (n, 3)
        Rest directions.
    path : (J, n)
        1 where a bone is on the way from the root to a joint.
    along : (n, n)
        1 if the bone of the column is that of the row, or comes after it in its chain.
    """

    joints: Tensor
    levels: tuple[slice, ...]
    rest: Tensor
    path: Tensor
    along: Tensor

    @classmethod
    def of(cls, skeleton: Skeleton, dtype: torch.dtype = torch.float32) -> ChainPlan:
        """The plan of a skeleton, on the CPU."""
        chains = sorted((chain[1:] for chain in skeleton.chains), key=len, reverse=True)
        joints: list[int] = []
        levels = []
        for place in range(len(chains[0])):
            here = [chain[place] for chain in chains if len(chain) > place]
            levels.append(slice(len(joints), len(joints) + len(here)))
            joints += here
        chain_of = {
            joint: (number, place)
            for number, chain in enumerate(chains)
            for place, joint in enumerate(chain)
        }
        along = [
            [
                float(chain_of[a][0] == chain_of[b][0] and chain_of[b][1] >= chain_of[a][1])
                for b in joints
            ]
            for a in joints
        ]
        rest, path = (
            torch.as_tensor(array, dtype=dtype)
            for array in (skeleton.rest_directions[joints], skeleton.path_matrix[:, joints])
        )
        return cls(
            torch.tensor(joints), tuple(levels), rest, path, torch.tensor(along, dtype=dtype)
        )


class Exponentials(NamedTuple):
    """Rotation vectors, and the coefficients of their exponentials: sin(a)/a and (1 - cos(a))/a^2,
    each (..., N)."""

    rotvec: Tensor
    square: Tensor
    sinc: Tensor
    cosc: Tensor

    @classmethod
    def of(cls, rotvec: Tensor) -> Exponentials:
        """Coefficients of rotation vectors (..., 3, N), radians."""
        square = (rotvec * rotvec).sum(-2)
        angle = square.clamp_min(1e-24).sqrt()
        half = torch.sin(0.5 * angle) / angle
        return cls(rotvec, square, torch.sin(angle) / angle, 2 * half * half)

    def matrices(self, linear: Tensor, quadratic: Tensor) -> Tensor:
        """I + linear W + quadratic W^2, W = hat(rotvec): (..., 3, 3, N)."""
        # W^2 = w w^T - |w|^2 I; few operations, because their number determines the time in a loop
        # over frames
        rotvec = self.rotvec
        basis = constant(MATRIX_BASIS, rotvec)
        parts = torch.cat(
            [(1 - quadratic * self.square)[..., None, :], linear[..., None, :] * rotvec], -2
        )
        scaled = quadratic[..., None, :] * rotvec
        product = (basis @ parts).unflatten(-2, (3, 3))  # type: ignore[no-untyped-call]
        return torch.addcmul(product, scaled[..., :, None, :], rotvec[..., None, :, :])

    def rotmats(self) -> Tensor:
        """Rotation matrices (..., 3, 3, N) (Eq. 4)."""
        return self.matrices(self.sinc, self.cosc)

    def right_jacobians(self) -> Tensor:
        """J with exp(rotvec + d) = exp(rotvec) exp(J d) for small d: (..., 3, 3, N)."""
        s = self.square
        series = 1 / 6 - s / 120 * (1 - s / 42 * (1 - s / 72 * (1 - s / 110)))
        return self.matrices(
            -self.cosc, torch.where(s < 0.25, series, (1 - self.sinc) / s.clamp_min(0.25))
        )


def chain_frames(exponentials: Exponentials, plan: ChainPlan) -> Tensor:
    """Orientations (n, 3, 3, N) of bones, from rotation vectors (n, 3, N) relative to the bone
    before."""
    local = exponentials.rotmats()
    frames = [local[plan.levels[0]]]
    for here in plan.levels[1:]:
        frames.append(compose_rows(frames[-1][: here.stop - here.start], local[here]))
    return torch.cat(frames)


def bone_ends(frames: Tensor, lengths: Tensor, plan: ChainPlan) -> Tensor:
    """Bone vectors (n, 3, N) of orientations (n, 3, 3, N) and lengths (n, N)."""
    return (frames * plan.rest[:, None, :, None]).sum(2) * lengths[:, None]


def joint_positions(bones: Tensor, plan: ChainPlan) -> Tensor:
    """Joints (J, 3, N), the root at the origin, of bone vectors (n, 3, N)."""
    return (plan.path @ bones.flatten(1)).view(-1, *bones.shape[1:])


def bone_gradients(joints: Tensor, plan: ChainPlan) -> Tensor:
    """Gradient (n, 3, N) by the bone vectors, of the gradient (J, 3, N) by the joints."""
    return (plan.path.T @ joints.flatten(1)).view(-1, *joints.shape[1:])


def cross_matrices(bones: Tensor) -> Tensor:
    """hat(bones): (..., 3, 3, N) of (..., 3, N)."""
    result = bones.new_zeros(*bones.shape[:-2], 3, 3, bones.shape[-1])
    for (i, j), part in zip(((2, 1), (0, 2), (1, 0)), bones.unbind(-2), strict=True):
        result[..., i, j, :] = part
        result[..., j, i, :] = -part
    return result


def rotvec_gradients(bones: Tensor, crosses: Tensor, axes: Tensor, plan: ChainPlan) -> Tensor:
    """Gradient (n, 3, N) by the rotation vectors.

    Parameters
    ----------
    bones : (n, 3, N)
        Gradient by the bone vectors.
    crosses : (n, 3, 3, N)
        `cross_matrices` of the bone vectors.
    axes : (n, 3, 3, N)
        `rotvec_axes`: column c is the axis about which component c of a rotation vector rotates its
        bone.
    plan : ChainPlan
    """
    torques = (crosses * bones[:, None]).sum(2)
    torques = (plan.along @ torques.flatten(1)).view_as(torques)
    return (axes * torques[:, :, None]).sum(1)


def rotvec_axes(exponentials: Exponentials, frames: Tensor) -> Tensor:
    """Axes (n, 3, 3, N) about which the components of the rotation vectors rotate their bones."""
    return compose_rows(frames, exponentials.right_jacobians())


class _Kinematics(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, rotvec: Tensor, lengths: Tensor, plan: ChainPlan) -> Tensor:
        exponentials, frames, bones, joints = _pose(rotvec, lengths, plan)
        ctx.save_for_backward(*exponentials, frames, bones)
        ctx.plan = plan
        return joints

    @staticmethod
    def backward(ctx: Any, joints: Tensor) -> tuple[Tensor, None, None]:
        *parts, frames, bones = ctx.saved_tensors
        plan: ChainPlan = ctx.plan
        pulled = bone_gradients(joints.permute(1, 2, 0).contiguous(), plan)
        inner = rotvec_gradients(
            pulled, cross_matrices(bones), rotvec_axes(Exponentials(*parts), frames), plan
        )
        result = joints.new_zeros(len(plan.path), 3, joints.shape[0])
        result[plan.joints] = inner
        return result.permute(2, 0, 1), None, None


def _pose(
    rotvec: Tensor, lengths: Tensor, plan: ChainPlan
) -> tuple[Exponentials, Tensor, Tensor, Tensor]:
    """Exponentials, frames and bones of rotation vectors (N, J, 3) and lengths (N, J), and the
    joints (N, J, 3)."""
    exponentials = Exponentials.of(rotvec.permute(1, 2, 0)[plan.joints].contiguous())
    frames = chain_frames(exponentials, plan)
    bones = bone_ends(frames, lengths.T[plan.joints], plan)
    return exponentials, frames, bones, joint_positions(bones, plan).permute(2, 0, 1).contiguous()


def local_kinematics(rotations: Tensor, lengths: Tensor, plan: ChainPlan) -> Tensor:
    """`forward_kinematics` with the root at the origin, differentiable by the rotations alone, and
    only once.

    Parameters
    ----------
    rotations : (N, J, 3)
        Rotation vectors; entry 0 is not used.
    lengths : (N, J)
    plan : ChainPlan
        In the dtype of `rotations`.

    Returns
    -------
    (N, J, 3)
        Positions relative to the root.
    """
    if not torch.is_grad_enabled():
        return _pose(rotations, lengths, plan)[-1]
    result: Tensor = _Kinematics.apply(rotations, lengths, plan)  # type: ignore[no-untyped-call]
    return result

"""What a fit solves for: orientation, angles, shape, place and the camera's scale."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.body.pose_space import PoseSpace
from a2v.kinematics.so3 import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.types import FloatArray, OrthographicCamera

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(eq=False)
class Unknowns:
    """The parameters of a fit; float64 leaf tensors.

    Attributes
    ----------
    base : (3, 3)
        Orientation that `root` is relative to (constant).
    root : (3,)
        Rotation vector of the whole body.
    angles : (D,)
        See `PoseSpace`.
    shape : (S,)
    translation : (3,)
        Metres.
    log_scale : ()
        Logarithm of the camera's scale.
    center : tuple of 2 float
        The camera's centre; constant, since the translation does the same.
    """

    base: Tensor
    root: Tensor
    angles: Tensor
    shape: Tensor
    translation: Tensor
    log_scale: Tensor
    center: tuple[float, float]

    @classmethod
    def build(
        cls, *, root: FloatArray, angles: FloatArray, shape: FloatArray, translation: FloatArray, camera: OrthographicCamera
    ) -> Unknowns:
        """From plain numbers; `root` is a rotation vector (3,)."""
        import torch

        def leaf(values: Any) -> Tensor:
            return torch.tensor(np.asarray(values, dtype=np.float64)).requires_grad_()

        return cls(
            base=torch.tensor(rotvec_to_rotmat(np.asarray(root, dtype=np.float64))),
            root=leaf(np.zeros(3)),
            angles=leaf(angles),
            shape=leaf(shape),
            translation=leaf(translation),
            log_scale=leaf(np.log(camera.scale)),
            center=(camera.center_u, camera.center_v),
        )

    def rotmats(self, space: PoseSpace) -> Tensor:
        """Rotation matrices (B, 3, 3) of the bones."""
        import torch

        local = rotvec_to_rotmat(space.rotvecs(self.angles))
        first = rotvec_to_rotmat(self.root) @ self.base
        return torch.cat([first[None], local[1:]])

    def root_rotvec(self) -> FloatArray:
        """Orientation of the whole body as one rotation vector (3,)."""
        result: FloatArray = rotmat_to_rotvec((rotvec_to_rotmat(self.root.detach()) @ self.base).numpy())
        return result

    def with_angles(self, angles: FloatArray) -> Unknowns:
        """The same with other angles (D,); unknowns of its own."""
        return Unknowns.build(
            root=self.root_rotvec(),
            angles=angles,
            shape=self.shape.detach().numpy(),
            translation=self.translation.detach().numpy(),
            camera=self.camera(),
        )

    def camera(self) -> OrthographicCamera:
        """The camera as a record."""
        return OrthographicCamera(scale=float(self.log_scale.detach().exp()), center_u=self.center[0], center_v=self.center[1])

    def fix_camera(self, camera: OrthographicCamera) -> None:
        """Take over a camera for good."""
        import torch

        self.log_scale = torch.tensor(np.log(camera.scale), dtype=torch.float64)
        self.center = (camera.center_u, camera.center_v)

    def project(self, points: Tensor) -> Tensor:
        """Pixels (..., 2) of points (..., 3)."""
        import torch

        scale = self.log_scale.exp()
        return torch.stack([self.center[0] + scale * points[..., 0], self.center[1] - scale * points[..., 1]], dim=-1)

"""The unknowns of a fit: orientation, angles, shape, position and the camera's scale."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.body.pose_space import PoseSpace
from a2v.body.settings import LEAST_DISTANCE
from a2v.body.view import LEVEL, View
from a2v.camera import seen_from
from a2v.kinematics.so3 import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.types import FloatArray, OrthographicCamera, PhotoCamera

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
        Meters.
    log_scale : ()
        Logarithm of the camera's scale.
    center : tuple of 2 float
        The camera's center; constant, since the translation does the same.
    pitch : ()
        Angle by which a perspective camera looks down, radians.
    log_distance : ()
        Logarithm of a perspective camera's distance.
    view : View
        Perspective, if any: the optical axis meets the depth of `translation`, or `aim_depth` if
        that is not None.
    """

    base: Tensor
    root: Tensor
    angles: Tensor
    shape: Tensor
    translation: Tensor
    log_scale: Tensor
    center: tuple[float, float]
    pitch: Tensor
    log_distance: Tensor
    view: View = LEVEL
    aim_depth: float | None = None

    @classmethod
    def build(
        cls,
        *,
        root: FloatArray,
        angles: FloatArray,
        shape: FloatArray,
        translation: FloatArray,
        camera: OrthographicCamera,
        view: View = LEVEL,
    ) -> Unknowns:
        """Make unknowns from arrays. `root` is a rotation vector (3,), `camera` the camera of the
        flat frame."""
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
            pitch=leaf(view.pitch),
            log_distance=leaf(np.log(view.distance or 1.0)),
            view=view,
        )

    def rotmats(self, space: PoseSpace) -> Tensor:
        """Rotation matrices (B, 3, 3) of the bones."""
        import torch

        local = rotvec_to_rotmat(space.rotvecs(self.angles))
        first = rotvec_to_rotmat(self.root) @ self.base
        return torch.cat([first[None], local[1:]])

    def root_rotvec(self) -> FloatArray:
        """Orientation of the whole body as one rotation vector (3,)."""
        result: FloatArray = rotmat_to_rotvec(
            (rotvec_to_rotmat(self.root.detach()) @ self.base).numpy()
        )
        return result

    def with_angles(self, angles: FloatArray) -> Unknowns:
        """Copy the unknowns with other angles (D,)."""
        return Unknowns.build(
            root=self.root_rotvec(),
            angles=angles,
            shape=self.shape.detach().numpy(),
            translation=self.translation.detach().numpy(),
            camera=self.camera().flat,
            view=dataclasses.replace(
                self.view, pitch=float(self.pitch.detach()), distance=self.distance
            ),
        )

    def camera(self) -> PhotoCamera:
        """The camera as a record."""
        flat = OrthographicCamera(
            scale=float(self.log_scale.detach().exp()),
            center_u=self.center[0],
            center_v=self.center[1],
        )
        if self.view.distance == 0:
            return PhotoCamera(flat=flat, source=self.view.source)
        x, y, z = (float(value.detach()) for value in self._aim())
        aim = (x, y, z)
        return PhotoCamera(
            flat=flat,
            aim=aim,
            distance=self.distance,
            pitch=float(self.pitch.detach()),
            source=self.view.source,
        )

    def fix_camera(self, camera: PhotoCamera) -> None:
        """Set a camera, which the fit then does not change."""
        import torch

        self.log_scale = torch.tensor(np.log(camera.scale), dtype=torch.float64)
        self.center = (camera.flat.center_u, camera.flat.center_v)
        self.view, self.aim_depth = View.of(camera), camera.aim[2]
        self.pitch = torch.tensor(camera.pitch, dtype=torch.float64)
        self.log_distance = torch.tensor(np.log(camera.distance or 1.0), dtype=torch.float64)

    @property
    def distance(self) -> float:
        """The camera's distance, meters; 0 for an orthographic camera."""
        return float(self._clamped_distance().detach()) if self.view.distance > 0 else 0.0

    def _clamped_distance(self) -> Tensor:
        """The distance () of a perspective camera, meters, not below `LEAST_DISTANCE`."""
        return self.log_distance.exp().clamp_min(LEAST_DISTANCE)

    def _aim(self) -> tuple[Tensor, Tensor, Tensor]:
        """Point at which the optical axis meets the person's depth, meters."""
        import torch

        scale, (u, v) = self.log_scale.exp(), self.view.axis
        depth = (
            self.translation[2]
            if self.aim_depth is None
            else torch.tensor(self.aim_depth, dtype=scale.dtype)
        )
        return (u - self.center[0]) / scale, (self.center[1] - v) / scale, depth

    def camera_height(self, ground: Tensor) -> Tensor:
        """Return the height of a perspective camera above y = `ground` (), meters."""
        return self._aim()[1] + self._clamped_distance() * self.pitch.tan() - ground

    def project(self, points: Tensor) -> Tensor:
        """Project points (..., 3) to pixels (..., 2)."""
        import torch

        scale = self.log_scale.exp()
        if self.view.distance > 0:
            x, y, z = self._aim()
            offset = points[..., 0] - x, points[..., 1] - y, points[..., 2] - z
            right, up = seen_from(*offset, distance=self._clamped_distance(), pitch=self.pitch)
            return torch.stack(
                [self.view.axis[0] + scale * right, self.view.axis[1] - scale * up], dim=-1
            )
        return torch.stack(
            [self.center[0] + scale * points[..., 0], self.center[1] - scale * points[..., 1]],
            dim=-1,
        )

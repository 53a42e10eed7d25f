"""Move the parts of a Mitsuba scene, only as far as they differ from the present ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.types import FloatArray


@dataclass
class Shown:
    """A Mitsuba scene, its parameters and their present values.

    Attributes
    ----------
    scene, parameters : objects of Mitsuba
    vertices : (V, 3) float32 or None
        Vertices of the person, meters.
    camera : ViewCamera or None
    lamp : (4, 4) or None
        World from the spot lamp's disk.
    """

    scene: Any
    parameters: Any
    vertices: FloatArray | None = None
    camera: ViewCamera | None = None
    lamp: FloatArray | None = None

    def holds(self, vertices: FloatArray) -> bool:
        """Return whether the person has these vertices (V, 3)."""
        return self.vertices is not None and np.array_equal(self.vertices, vertices)

    def change(
        self,
        mi: Any,
        *,
        person: tuple[FloatArray, FloatArray] | None,
        lamp: FloatArray,
        camera: ViewCamera | None,
    ) -> None:
        """Set the mesh's vertices and normals (N, 3), the lamp's matrix (4, 4) and the camera.

        None keeps the present value. Any change costs 26 ms of processor time, so the scene is left
        alone if everything is equal.
        """
        changed = False
        if person is not None:
            changed = True
            self.parameters["person.vertex_positions"] = person[0].ravel()
            self.parameters["person.vertex_normals"] = person[1].ravel()
        if camera is not None and camera != self.camera:
            changed, self.camera = True, camera
            right, up, backward = camera.axes
            matrix = np.eye(4)
            # Mitsuba's camera looks along +z, with +x to the left of the picture
            matrix[:3, :3], matrix[:3, 3] = np.stack([-right, up, -backward], axis=1), camera.origin
            self.parameters["sensor.to_world"] = _transform(mi, matrix)
            self.parameters["sensor.x_fov"] = camera.fov
        if "spot.to_world" in self.parameters and (
            self.lamp is None or not np.array_equal(self.lamp, lamp)
        ):
            changed, self.lamp = True, lamp
            self.parameters["spot.to_world"] = _transform(mi, lamp)
        if changed:
            self.parameters.update()


def _transform(mi: Any, matrix: FloatArray) -> Any:
    return mi.AffineTransform4f(mi.ScalarMatrix4f(matrix.tolist()))

"""A character and the photo that it was made from, and its pictures."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.animation import deform, express, load_rig
from a2v.animation.rest_pose import rest_transforms
from a2v.body.face import points_on_face
from a2v.body.parts import on_parts
from a2v.lab.evaluation.framed import framed_surface
from a2v.reconstruction.beside_photo import Reposed, repose
from a2v.reconstruction.face.look_again import EXPRESSIONS, expressed, head_of, picture_of_head
from a2v.types import (
    ByteArray,
    Character,
    FloatArray,
    PhotoCamera,
    Subject,
    Surface,
)

HEAD_EXTENT = 0.36
"""Width of the pictures of heads, meters."""
_BORDER = 1.08
_SHARES = (0.3, 0.7)
"""Frames of the motion that are shown, as shares of it."""


@dataclass(frozen=True, eq=False)
class Made:
    """A character from a photo.

    Attributes
    ----------
    subject : Subject
    camera : PhotoCamera
        Of `subject.image`.
    surface : Surface
        Colored, in the pose of the photo.
    character : Character
    motion : (T, B, 4, 4)
        World from bone in each frame of a motion.
    notes : tuple of str
        For the user.
    """

    subject: Subject
    camera: PhotoCamera
    surface: Surface
    character: Character
    motion: FloatArray
    notes: tuple[str, ...] = ()

    def beside(self, *, size: int) -> Reposed:
        """The character beside the photo, with `size` pixels along the photo's longer side."""
        return repose(self.surface, self.character.parts, self.subject, self.camera, size=size)

    def t_pose(self) -> Surface:
        """The character in T-pose."""
        return self._moved(rest_transforms(self.character.body, load_rig("vrm")))

    def frames(self) -> list[Surface]:
        """The character in two frames of the motion, with closed eyes in the second one."""
        found = []
        for share, strengths in zip(_SHARES, ({}, EXPRESSIONS["blink"]), strict=True):
            pose = self.motion[int(share * (len(self.motion) - 1))]
            found.append(
                self._moved(pose, express(self.character, self._posed(pose), pose, strengths))
            )
        return found

    def head(
        self, *, azimuth: float = 0.0, size: int, expression: str = "rest"
    ) -> tuple[ByteArray, FloatArray]:
        """A picture (size, size, 3) of the head at rest, seen from `azimuth` degrees, and the
        places (478, 3) of mediapipe's landmarks in it, pixels; their depths grow towards the
        camera."""
        own, parts = self.character.surface, np.asarray(self.character.parts)
        head = head_of(own, parts)
        face = points_on_face(own.vertices)
        bald = parts[: len(self.character.body.vertices)]
        skull = own.vertices[: len(bald)][on_parts(bald, "head")]
        middle = np.append((skull.min(axis=0) + skull.max(axis=0))[:2] / 2, face[:, 2].mean())
        middle = middle - np.array([0.0, 0.0, 0.07])
        vertices = expressed(own, own.vertices, EXPRESSIONS[expression])
        picture = picture_of_head(head, vertices, middle, HEAD_EXTENT, size=size, azimuth=azimuth)
        angle = np.radians(azimuth)
        turn = np.array(
            [
                [np.cos(angle), 0, -np.sin(angle)],
                [0, -1, 0],
                [np.sin(angle), 0, np.cos(angle)],
            ]
        )
        places = (points_on_face(vertices) - middle) @ turn.T * size / HEAD_EXTENT
        return picture, places + np.array([size / 2, size / 2, 0.0])

    def _posed(self, transforms: FloatArray) -> FloatArray:
        return deform(self.character, transforms)

    def _moved(self, transforms: FloatArray, vertices: FloatArray | None = None) -> Surface:
        posed = self._posed(transforms) if vertices is None else vertices
        return dataclasses.replace(
            self.character.surface, vertices=posed.astype(np.float32), face=None
        )


def turned(surface: Surface, azimuth: float, size: int) -> ByteArray:
    """A picture (size, size, 3) of a whole character."""
    return framed_surface(surface, surface.vertices, azimuth, size, border=_BORDER)

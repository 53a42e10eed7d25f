"""A camera before a face, and a person whose face is that of a body."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from a2v.body.face import face_landmarks
from a2v.body.parts import PARTS, on_parts
from a2v.types import Body, BoolArray, OrthographicCamera, Subject
from tests.support.subjects import blank_subject

SKIN, BLACK, GREEN = (205, 150, 120), (32, 26, 24), (40, 130, 70)
CAMERA = OrthographicCamera(scale=2048 / 1.8, center_u=1024.0, center_v=1990.0)


def photographed(body: Body, *, turned: float = 0.0) -> Subject:
    """Return a person with the face of `body`, brows 4 mm higher and eyes 3 mm wider apart."""
    ids, weights = face_landmarks()
    points = np.einsum("kc,kcd->kd", weights, body.vertices[ids].astype(np.float64))
    middle = points[:, :2].mean(axis=0)
    points[:, 0] += 0.0015 * np.tanh((points[:, 0] - middle[0]) / 0.02)
    points[:, 1] += 0.004 * np.clip((points[:, 1] - middle[1]) / 0.06, 0, 1)
    away = points - points.mean(axis=0)
    cosine, sine = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    points[:, 0], points[:, 2] = (
        points[:, 0] - away[:, 0] + cosine * away[:, 0] + sine * away[:, 2],
        cosine * away[:, 2] - sine * away[:, 0],
    )
    face = np.concatenate([CAMERA.project(points), CAMERA.scale * points[:, 2:]], axis=1)
    return blank_subject(2048, face=face.astype(np.float32))


def with_hair(
    body: Body, down: float, *, cloth: tuple[int, int, int] = GREEN, width: float = 0.11
) -> Subject:
    """A person whose black hair hangs beside the neck to the height `down`, meters from the chin
    (negative: below it), and reaches `width` meters to both sides."""
    subject = photographed(body)
    assert subject.face is not None
    image = np.full_like(subject.image, 230)
    mask = np.zeros(image.shape[:2], np.uint8)

    def silhouette(*names: str) -> BoolArray:
        drawn = np.zeros(mask.shape, np.uint8)
        points = CAMERA.project(body.vertices.astype(np.float64)).astype(np.int32)
        faces = body.faces[on_parts(body.parts, *names)[body.faces].all(axis=1)]
        for corners in points[faces]:
            cv2.fillConvexPoly(drawn, corners, 1)
        return drawn > 0

    every = silhouette(*PARTS)
    image[every], mask[every] = cloth, 1
    bare = silhouette("head", "neck")
    image[bare] = SKIN
    face = subject.face[:, :2].astype(np.int32)
    chin = int(face[152, 1] - down * CAMERA.scale)
    crown, middle = np.nonzero(bare)[0].min(), int(face[:, 0].mean())
    hair = np.zeros(mask.shape, bool)
    aside = int(width * CAMERA.scale)
    hair[crown - 10 : chin, middle - aside : middle + aside] = True
    hull = np.zeros(mask.shape, np.uint8)
    cv2.fillConvexPoly(hull, cv2.convexHull(face), 1)
    hair &= (hull == 0) & ~(silhouette("neck"))
    image[hair], mask[hair] = BLACK, 1
    image[hull > 0] = SKIN
    return dataclasses.replace(subject, image=image, mask=mask.astype(subject.mask.dtype))

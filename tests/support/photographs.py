"""A body that is photographed wider than it is: with a jacket, hair and a skirt."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from a2v.body import PARTS, load_body_model, make_body
from a2v.geometry.visibility import depth_map
from a2v.kinematics.names import BLAZEPOSE
from a2v.types import Body, OrthographicCamera, Subject

SIZE = (460, 640)
SKIN, HAIR, JACKET, SKIRT = (0.85, 0.62, 0.5), (0.15, 0.1, 0.06), (0.2, 0.3, 0.7), (0.6, 0.1, 0.15)


def dressed_scene() -> tuple[Subject, Body, OrthographicCamera]:
    """A body at rest and a photo of it with 2 cm of cloth and hair, and a skirt."""
    body = make_body(load_body_model("anny"))
    vertices = body.vertices - np.array([0, body.vertices[:, 1].min(), 0], np.float32)
    body = dataclasses.replace(body, vertices=vertices)
    tall = float(np.ptp(vertices[:, 1]))
    camera = OrthographicCamera(scale=560 / tall, center_u=SIZE[0] / 2, center_v=610.0)
    bare = np.isfinite(depth_map(vertices, body.faces, camera, SIZE))
    y = (camera.center_v - (np.arange(SIZE[1]) + 0.5)) / camera.scale / tall
    wide = (
        cv2.dilate(bare.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (15, 15)))
        > 0
    )
    x = np.abs(np.arange(SIZE[0]) + 0.5 - camera.center_u)[None] / camera.scale / tall
    rows = y[:, None]
    torso, crown = (rows > 0.5) & (rows < 0.84), rows > 0.95
    mask = bare | (wide & ((torso & (x < 0.16)) | crown))
    skirt = (rows > 0.28) & (rows < 0.52) & (x < 0.10 + 0.30 * (0.52 - rows))
    mask |= skirt
    image = np.empty((*SIZE[::-1], 3))
    image[:] = SKIN
    image[np.broadcast_to(torso, mask.shape)] = JACKET
    image[skirt] = SKIRT
    image[np.broadcast_to(rows > 0.955, mask.shape)] = HAIR
    image[~mask] = (0, 1, 0)  # a color that must not bleed in
    points = np.zeros((33, 3), np.float32)
    head = vertices[body.parts == PARTS.index("head")]
    middle = float(np.median(head[:, 0]))
    for name, dx, dy in (
        ("left_eye", 0.03, 0.93),
        ("right_eye", -0.03, 0.93),
        ("mouth_left", 0.025, 0.893),
        ("mouth_right", -0.025, 0.893),
        ("left_ear", 0.075, 0.925),
        ("right_ear", -0.075, 0.925),
    ):
        points[BLAZEPOSE.index(name)] = (
            *camera.project(np.array([middle + dx, dy * tall, 0.0])),
            0.99,
        )
    subject = Subject(
        image=(image * 255).astype(np.uint8),
        mask=mask.astype(np.float32),
        keypoints=points,
        keypoints_3d=np.full((33, 3), np.nan, np.float32),
        crop=(0, 0, *SIZE),
        photo_size=SIZE,
    )
    return subject, body, camera

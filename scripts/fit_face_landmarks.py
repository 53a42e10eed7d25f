"""Find mediapipe's face landmarks on the body model: makes
``a2v/body/data/face_landmarks_anny.npz``.

Heads of several shapes are drawn from the front, with colored eyes, brows and lips, and the
detector finds its landmarks on them. So a landmark of a photo is at the same place of the face. The
mean over the shapes is stored, each as a point of a triangle.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from a2v.body.face import actions_of
from a2v.body.registry import default_rest, load_body_model
from a2v.geometry.rays import ray_scene
from a2v.io import write_npz
from a2v.perception.face import FaceDetector

OUT = Path(__file__).resolve().parent.parent / "a2v" / "body" / "data" / "face_landmarks_anny.npz"
SIZE, EXTENT, SHAPES = 512, 0.34, 24


def main() -> int:
    model = load_body_model("anny")
    generator = np.random.default_rng(0)
    default = default_rest()
    front = front_faces(default, model.faces)
    found = []
    with FaceDetector() as detector:
        for number in range(SHAPES):
            shape = model.shape_default.copy()
            if number:
                low, high = model.shape_bounds[:6].T
                shape[:6] = low + (high - low) * generator.uniform(0.15, 0.85, 6)
            vertices = model.rest(torch.from_numpy(shape))[0].numpy().astype(np.float64)
            middle = vertices[13574:].mean(axis=0) - [0, 0.02, 0]
            points = detector.one(draw(vertices, model.faces, middle, shade=0.75 + 0.01 * number))
            if points is None:
                print(number, "no face")
                continue
            xy = middle[:2] + (points[:, :2] / SIZE - 0.5) * [EXTENT, -EXTENT]
            corners, weights = on_triangles(vertices, model.faces, front, xy)
            found.append(np.einsum("kc,kcd->kd", weights, default[model.faces[corners]]))
    mean = np.median(found, axis=0)
    print(
        len(found),
        "heads; spread in mm:",
        1000 * np.median(np.std(np.array(found)[..., :2], axis=0)),
    )
    faces, weights = on_triangles(default, model.faces, front, mean[:, :2])
    write_npz(
        OUT,
        {"vertices": model.faces[faces].astype(np.int32), "weights": weights.astype(np.float32)},
    )
    return 0


def front_faces(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the faces (F,) bool of the skin that a camera in front of the face sees, without the
    eyes."""
    scene = ray_scene(vertices, faces, threads=1)
    middle = vertices[faces].mean(axis=1)
    start = middle + np.array([0, 0, 5.0])
    hit = scene.cast_rays(
        np.concatenate([start, np.tile([0, 0, -1.0], (len(start), 1))], axis=1).astype(np.float32)
    )["t_hit"].numpy()
    return (np.abs(hit - 5.0) < 1e-3) & (faces.max(axis=1) < 13348) & (middle[:, 1] > 0.6)


def on_triangles(
    vertices: np.ndarray, faces: np.ndarray, front: np.ndarray, xy: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the front face (K,) at or next to each place (K, 2), and barycentric coordinates (K,
    3) in it."""
    flat = vertices * [1, 1, 0]
    own = np.flatnonzero(front)
    hits = ray_scene(flat, faces[own], threads=1).compute_closest_points(
        np.pad(xy, ((0, 0), (0, 1))).astype(np.float32)
    )
    second = hits["primitive_uvs"].numpy()
    return own[hits["primitive_ids"].numpy()], np.concatenate(
        [1 - second.sum(axis=1, keepdims=True), second], axis=1
    )


def draw(
    vertices: np.ndarray, faces: np.ndarray, middle: np.ndarray, *, shade: float
) -> np.ndarray:
    """The head from the front (SIZE, SIZE, 3) uint8, in the colors of skin, lips, brows and
    eyes."""
    ticks = ((np.arange(SIZE) + 0.5) / SIZE - 0.5) * EXTENT
    x, y = np.meshgrid(middle[0] + ticks, middle[1] - ticks)
    rays = np.stack([x, y, np.full_like(x, 5.0), 0 * x, 0 * x, 0 * x - 1], axis=-1).astype(
        np.float32
    )
    hits = ray_scene(vertices, faces, threads=1).cast_rays(rays)
    face, normal = hits["primitive_ids"].numpy().astype(np.int64), hits["primitive_normals"].numpy()
    seen = np.isfinite(hits["t_hit"].numpy())
    face = np.where(seen, face, 0)
    color = np.full((SIZE, SIZE, 3), [0.82, 0.62, 0.52])
    actions = actions_of()
    puckered = np.zeros(len(vertices))
    for name in ("mouthRollUpper", "mouthRollLower"):
        ids, offsets = actions[name]
        puckered[ids] = np.maximum(puckered[ids], np.linalg.norm(offsets, axis=1))
    lips = puckered[faces[face]].min(axis=-1) > 0.0045
    color[lips] = [0.68, 0.38, 0.38]
    eye = faces[face].min(axis=-1) >= 13574
    color[eye] = [0.9, 0.9, 0.9]
    for part in (slice(13574, 13646), slice(13646, 13718)):
        center = vertices[part].mean(axis=0)
        radius = np.hypot(x - center[0], y - center[1])
        color[eye & (radius < 0.006)] = [0.3, 0.2, 0.12]
        color[eye & (radius < 0.0025)] = 0.04
    return (
        (
            255
            * np.where(
                seen[..., None],
                color * shade * np.clip(0.25 + 0.8 * np.abs(normal[..., 2:]), 0, 1),
                0.7,
            )
        )
        .clip(0, 255)
        .astype(np.uint8)
    )


if __name__ == "__main__":
    raise SystemExit(main())

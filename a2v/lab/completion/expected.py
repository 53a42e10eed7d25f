"""The prior of a canonical character's hidden colors by the network, to compare with the pipeline's
rules.

`with_completion` replaces ``expected_colors`` of a character; the coloring then continues with its
own rules.
"""

from __future__ import annotations

import dataclasses
import functools

import cv2
import numpy as np
import torch

from a2v.body.face import teeth
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import vertex_normals, within
from a2v.lab.completion.layout import (
    COLUMNS,
    ROWS,
    Sheets,
    default_rest,
    lay_out,
    pixels_of,
)
from a2v.lab.completion.networks import Completion
from a2v.reconstruction.canonical.coloring import canvas_of
from a2v.reconstruction.canonical.topology import topology
from a2v.reconstruction.projection import PhotoProjection
from a2v.reconstruction.shading import photo_without_shading
from a2v.types import Body, Camera, FloatArray, Reconstruction, Subject

_HIDDEN = 0.03
"""Distance of a vertex behind the surface of its sheet from which on the sheet does not show it,
meters."""


@functools.cache
def _places() -> tuple[Sheets, FloatArray, FloatArray, FloatArray]:
    """The sheets of the characters' mesh; pixels (V, 2) of its vertices, their depths (V,), and
    the shares (V,) of the front."""
    mesh = topology()
    rest = mesh.refined(np.concatenate([default_rest(), teeth().vertices]))
    pixels, front = pixels_of(rest, mesh.faces)
    return lay_out(rest, mesh.faces), pixels, rest[:, 2], front


def sheets_of_photo(
    photo: PhotoProjection, vertices: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What a photo shows of a character with vertices (V, 3): colors (2, 3, H, W), CIELAB / 100,
    and trust (2, 1, H, W)."""
    assert photo.canvas is not None
    sheets = _places()[0]
    where = np.flatnonzero(sheets.filled.ravel())
    corner = topology().faces[sheets.face.ravel()[where]]
    weight = sheets.barycentric.reshape(-1, 3)[where][..., None].astype(np.float64)
    point, normal = within(vertices, corner, weight), within(normals, corner, weight)
    pixels = photo.camera.project(point)
    strongest = corner[np.arange(len(corner)), weight[..., 0].argmax(axis=1)]
    trust = photo.trust(point, normal) * photo.canvas.agrees(pixels, photo.canvas.parts[strongest])
    spacing = 0.3 * photo.camera.scale / 142
    clean = cv2.GaussianBlur(photo.clean, (0, 0), spacing) if spacing > 0.5 else photo.clean
    values = np.zeros((2 * ROWS * COLUMNS, 4), np.float32)
    values[where, 3] = trust
    values[where, :3] = np.clip(sample_image(clean, pixels), 0, 1) * trust[:, None]
    values = values.reshape(2, ROWS, COLUMNS, 4)
    small = np.stack(
        [cv2.resize(one, (COLUMNS // 2, ROWS // 2), interpolation=cv2.INTER_AREA) for one in values]
    )
    filled = np.stack(
        [
            cv2.resize(one, (COLUMNS // 2, ROWS // 2), interpolation=cv2.INTER_AREA)
            for one in sheets.filled.astype(np.float32)
        ]
    )
    color = small[..., :3] / np.maximum(small[..., 3:], 1e-4)
    lab = np.stack([cv2.cvtColor(one, cv2.COLOR_RGB2LAB) for one in color]) / 100
    share = np.clip(small[..., 3] / np.maximum(filled, 1e-4), 0, 1)
    lab *= share[..., None] > 0.01
    return lab.transpose(0, 3, 1, 2).astype(np.float32), share[:, None].astype(np.float32)


def completed_colors(
    photo: PhotoProjection, vertices: FloatArray, normals: FloatArray, network: Completion
) -> FloatArray:
    """Colors (V, 3), sRGB in [0, 1], that the network expects at the vertices (V, 3) of a
    character; NaN where the sheets do not show them."""
    sheets, pixels, depth, front = _places()
    colors, trust = sheets_of_photo(photo, vertices, normals)
    with torch.no_grad():
        made = network(torch.from_numpy(colors)[None], torch.from_numpy(trust)[None])
    lab = made[0].float().numpy()
    found, share = np.zeros((len(depth), 3)), np.zeros(len(depth))
    for side, own in ((0, front), (1, 1 - front)):
        image = np.ascontiguousarray(100 * lab[side].transpose(1, 2, 0), np.float32)
        filled = sample_image(sheets.filled[side].astype(np.float32), pixels)
        surface = sample_image(sheets.depth[side], pixels) / np.maximum(filled, 1e-3)
        shown = own * (np.abs(surface - depth) < _HIDDEN)
        found += shown[:, None] * sample_image(image, pixels / 2)
        share += shown
    mean = (found / np.maximum(share, 1e-3)[:, None]).astype(np.float32)
    colors = np.clip(cv2.cvtColor(mean[None], cv2.COLOR_LAB2RGB)[0], 0, 1)
    result = np.full((len(vertices), 3), np.nan)
    result[: len(depth)] = np.where((share > 1e-3)[:, None], colors, np.nan)
    return result


def with_completion(
    person: Reconstruction, subject: Subject, body: Body, camera: Camera, network: Completion
) -> Reconstruction:
    """Replace the expected colors of a canonical character of one photo by those of the network;
    the arguments are those of `a2v.reconstruction.colorings.color_by_photo`."""
    surface = dataclasses.replace(person.surface, vertices=camera.flatten(person.surface.vertices))
    vertices = np.asarray(surface.vertices, np.float64)
    faces = np.asarray(surface.faces, np.int64)
    normals = vertex_normals(vertices, faces)
    photo = PhotoProjection(surface, subject, camera.flat)
    photo.canvas = canvas_of(surface, subject, body, camera, size=256)
    trust = photo.trust(vertices, normals) * photo.canvas.agrees(
        camera.flat.project(vertices), photo.canvas.parts
    )
    known = (trust > 0.5) & photo.unoccluded(vertices) & (normals[:, 2] > 0)
    photo.clean = photo_without_shading(
        photo.clean,
        camera.flat,
        vertices,
        faces,
        normals,
        colors=photo.patch_colors(vertices, faces),
        seen=known,
    )
    given = completed_colors(photo, vertices, normals, network)
    if person.expected_colors is not None:
        given = np.where(np.isfinite(given), given, person.expected_colors)
    return dataclasses.replace(person, expected_colors=given.astype(np.float32))

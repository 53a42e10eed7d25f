"""The `body-prior` backend: the fitted body pushed out to the person's silhouette (clothes, hair).

It has three steps. (1) The body's rim is pulled to the contour of the mask by a smooth deformation
of its skin, which also moves loose cloth outward in depth. (2) Parts of the mask that the body does
not reach (hair, skirts, bags) are fused as inflated lobes in a signed distance grid, and parts
outside the mask are cut off. (3) One closed surface is extracted and remeshed evenly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from a2v.body.skin import outer_skin
from a2v.errors import InputError
from a2v.geometry.rays import ray_scene
from a2v.geometry.visibility import person_box, silhouette_iou
from a2v.geometry.volume import Grid, signed_distance
from a2v.reconstruction.body_prior.cloth import LegColumns
from a2v.reconstruction.body_prior.columns import binary_distance, front_seen, mask_distance
from a2v.reconstruction.body_prior.rim import SkinDeformer, drape, pull_to_contour
from a2v.reconstruction.body_prior.settings import SurfaceSettings
from a2v.reconstruction.body_prior.volume import Skin, add_lobes, close_head, close_toes, part_arms
from a2v.reconstruction.extraction import mesh_grid
from a2v.types import (
    Body,
    BoolArray,
    FloatArray,
    IntArray,
    OrthographicCamera,
    Progress,
    Subject,
    Surface,
)


def body_prior_surface(
    subject: Subject,
    body: Body,
    camera: OrthographicCamera,
    *,
    settings: SurfaceSettings | None = None,
    progress: Progress | None = None,
) -> Surface:
    """Push the fitted body out (and in) to the mask's contour.

    Parameters
    ----------
    subject : Subject
        The front view of the surface has to cover its mask.
    body : Body
        In the frame of `camera`.
    camera : OrthographicCamera
        Of `subject.image`.

    Returns
    -------
    Surface
        One watertight piece with at least 25,000 vertices, gray. `provenance` holds
        `silhouette_iou` and its value for the bare body.

    Raises
    ------
    InputError
        An empty mask, or a body that does not overlap it.
    """
    settings = settings or SurfaceSettings()
    steps = settings.rounds + 3
    report = progress or (lambda done, total: None)
    mask = np.asarray(subject.mask, np.float32)
    skin, skin_faces, _ = outer_skin(body)
    before = _overlap(skin, skin_faces, camera, mask)
    dressed = dress(
        subject, body, camera, settings=settings, report=lambda done: report(done, steps)
    )
    found, triangles = _extract(dressed.field, dressed.grid, settings.vertices)
    vertices = _restore_face(found, dressed.skin, dressed.faces, dressed.parts, dressed.grid.cell)
    report(settings.rounds + 2, steps)
    after = silhouette_iou(vertices, triangles, camera, mask)
    report(steps, steps)
    return Surface(
        vertices=vertices.astype(np.float32),
        faces=triangles.astype(np.int32),
        colors=np.full((len(vertices), 3), 0.7, np.float32),
        provenance={
            "backend": "body-prior",
            "silhouette_iou": after,
            "body_silhouette_iou": before,
            "cell": dressed.grid.cell,
        },
    )


@dataclass(frozen=True, eq=False)
class DressedBody:
    """A body as wide as the photo shows it, with clothes and hair.

    Attributes
    ----------
    field : (nx, ny, nz) float32
        Signed distance on `grid`, meters, negative inside; cut off some cells from the surface.
    grid : Grid
    cloth : (nx, ny)
        Weight of cloth between the legs in a column's depth, from 0 to 1.
    skin : (S, 3) float64
        The body's outer skin, pulled to the contour. `field` also contains the parts that the skin
        does not reach.
    faces : (G, 3) int64
    parts : (S,) int8
        As of `outer_skin`.
    """

    field: FloatArray
    grid: Grid
    cloth: FloatArray
    skin: FloatArray
    faces: IntArray
    parts: IntArray


def dress(
    subject: Subject,
    body: Body,
    camera: OrthographicCamera,
    *,
    settings: SurfaceSettings,
    reach: float = 0.0,
    report: Callable[[int], None] = lambda done: None,
) -> DressedBody:
    """Pull the body to the mask's contour, and add the parts of the mask that it does not reach.

    Distances are exact up to `reach` meters, and at least three cells, from the surface.

    Raises
    ------
    InputError
        The mask has no contour.
    """
    mask = np.asarray(subject.mask, np.float32)
    skin, faces, parts = outer_skin(body)
    grid = _make_grid(skin, mask > 0.5, camera, settings)
    band = max(3, int(np.ceil(reach / grid.cell)) + 1)
    outline = mask_distance(mask, camera, grid)
    bare, deformer = skin, SkinDeformer(skin, faces)
    without_cloth = _outside_of_cloth(skin, faces, parts, grid, outline)
    for turn in range(settings.rounds):
        skin = pull_to_contour(skin, parts, grid, without_cloth, deformer, settings, turn)
        report(turn + 1)

    skin = drape(skin, faces, parts, deformer, bare)
    field = close_toes(
        close_head(signed_distance(skin, faces, grid, band=band), skin, parts, grid),
        skin,
        parts,
        grid,
    )
    report(settings.rounds + 1)
    field, cloth = add_lobes(field, Skin(skin, faces, parts), grid, outline, settings, band=band)
    # cut off parts outside the mask by a rounded extrusion of the mask
    field = np.maximum(field, np.minimum(outline, 3 * grid.cell)[:, :, None])
    return DressedBody(part_arms(field, bare, faces, parts, grid), grid, cloth, skin, faces, parts)


def _outside_of_cloth(
    skin: FloatArray, faces: IntArray, parts: IntArray, grid: Grid, outline: FloatArray
) -> FloatArray:
    """Return the distance (nx, ny) to the contour of the mask without cloth between the legs, so
    that no leg is pulled to a skirt's hem."""
    missing = (outline < 0) & ~np.isfinite(front_seen(skin, faces, grid))
    gaps = LegColumns.of(skin, faces, parts, grid).gaps(missing)
    return np.maximum(outline, -binary_distance(gaps, grid.cell)) if gaps.any() else outline


def _overlap(
    skin: FloatArray, faces: IntArray, camera: OrthographicCamera, mask: FloatArray
) -> float:
    """Return the intersection over union of body and mask; an empty mask and a body elsewhere are
    refused."""
    if (mask > 0.5).sum() < 64:
        raise InputError("the subject's mask is empty; expected the person in it")
    overlap = silhouette_iou(skin, faces, camera, mask)
    if overlap < 0.2:
        raise InputError(
            f"body and mask overlap by {overlap:.0%} only; fit the body to this photo first "
            "(a2v.body.fit_body)"
        )
    return overlap


def _make_grid(
    skin: FloatArray, person: BoolArray, camera: OrthographicCamera, settings: SurfaceSettings
) -> Grid:
    low, high = person_box(skin, person, camera)
    cell = float((high - low).max() / settings.resolution)
    border = np.array([6 * cell, 6 * cell, 6 * cell + 0.10])
    shape = np.ceil((high - low + 2 * border) / cell).astype(int) + 1
    return Grid(low - border, cell, (int(shape[0]), int(shape[1]), int(shape[2])))


def _extract(field: FloatArray, grid: Grid, target: int) -> tuple[FloatArray, IntArray]:
    """Extract the largest closed piece of the softened zero level, even and with about `target`
    vertices."""
    from scipy.ndimage import gaussian_filter

    field = np.pad(gaussian_filter(field, 0.7)[1:-1, 1:-1, 1:-1], 1, constant_values=3 * grid.cell)
    if not (field < 0).any():
        raise InputError(
            "no part of the body lies within the mask; fit the body to this photo first "
            "(a2v.body.fit_body)"
        )
    return mesh_grid(field, grid, target, smoothing=6)


def _restore_face(
    vertices: FloatArray, skin: FloatArray, faces: IntArray, parts: IntArray, cell: float
) -> FloatArray:
    """Move the head's vertices back to the skin, which the grid has blunted, if they are within a
    cell of it."""
    own = faces[(parts[faces] == 0).all(axis=1)]
    if not len(own):
        return vertices
    scene = ray_scene(skin, own, threads=0)
    low, high = skin[own].min(axis=(0, 1)) - cell, skin[own].max(axis=(0, 1)) + cell
    index = np.nonzero(((vertices > low) & (vertices < high)).all(axis=1))[0]
    if not len(index):
        return vertices
    closest = scene.compute_closest_points(vertices[index].astype(np.float32))["points"].numpy()
    shift = closest - vertices[index]
    far = np.linalg.norm(shift, axis=1) / cell
    result = vertices.copy()
    result[index] += shift * np.clip(2.0 - 2.0 * far, 0, 1)[:, None] * 0.8
    return result

"""The `body-prior` backend: the fitted body pushed out to the person's silhouette (clothes, hair).

Three steps: (1) the body's rim is pulled to the contour of the mask by a smooth deformation of the body's skin, which also takes loose
cloth outwards in depth; (2) what the mask has and no body reaches (hair, skirts, bags) is fused as an inflated lobe in a signed
distance grid, and what sticks out of the mask is cut; (3) one closed surface is extracted and evened out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.body.skin import outer_skin
from a2v.errors import InputError
from a2v.geometry.images import contour_distance, nearest_known, trace_contours
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import ray_scene
from a2v.geometry.visibility import cast_depth, person_box, silhouette_iou
from a2v.geometry.volume import Grid, signed_distance
from a2v.reconstruction.extraction import mesh_grid
from a2v.types import Body, BoolArray, FloatArray, IntArray, OrthographicCamera, Progress, Subject, Surface


@dataclass(frozen=True)
class SurfaceSettings:
    """How the body becomes the surface.

    Attributes
    ----------
    resolution : int
        Grid cells over the person's longer side; 320 gives cells of about 5 mm.
    vertices : int
        Vertices to aim at, at least 25,000.
    reach : float
        How far the rim may be pulled to the silhouette, metres.
    rounds : int
        Rounds of matching and deforming.
    depth : float
        Share of the sideways push that is also given in depth.
    lobe : float
        Half thickness at most of fused hair, skirts and bags, metres.
    """

    resolution: int = 320
    vertices: int = 36_000
    reach: float = 0.12
    rounds: int = 5
    depth: float = 0.7
    lobe: float = 0.09

    def __post_init__(self) -> None:
        if not 200 <= self.resolution <= 640:
            raise InputError(f"resolution is {self.resolution}; expected 200 to 640 cells")
        if not 25_000 <= self.vertices <= 200_000:
            raise InputError(f"vertices is {self.vertices}; expected 25000 to 200000")
        if not 1 <= self.rounds <= 20:
            raise InputError(f"rounds is {self.rounds}; expected 1 to 20")
        if not (0 <= self.reach <= 0.5 and 0 <= self.depth <= 2 and 0 <= self.lobe <= 0.5):
            raise InputError("reach and lobe are metres from 0 to 0.5, depth a share from 0 to 2")


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
        Its mask is what the front view must cover.
    body : Body
        In the frame of `camera`.
    camera : OrthographicCamera
        Of `subject.image`.

    Returns
    -------
    Surface
        One watertight piece with at least 25,000 vertices, grey. `provenance` holds `silhouette_iou` and its value for the bare body.

    Raises
    ------
    InputError
        An empty mask, or a body that does not overlap it.
    """
    settings = settings or SurfaceSettings()
    steps = settings.rounds + 3
    report = progress or (lambda done, total: None)
    mask = np.asarray(subject.mask, np.float32)
    person = mask > 0.5
    if person.sum() < 64:
        raise InputError("the subject's mask is empty; expected the person in it")
    skin, faces, parts = outer_skin(body)
    before = silhouette_iou(skin, faces, camera, mask)
    if before < 0.2:
        raise InputError(f"body and mask overlap by {before:.0%} only; fit the body to this photo first (a2v.body.fit_body)")

    grid = _make_grid(skin, person, camera, settings)
    mask_distance = _mask_distance(mask, camera, grid)
    deformer = _Deformer(skin, faces)
    bare = skin
    for turn in range(settings.rounds):
        skin = _pull_to_contour(skin, faces, parts, grid, mask_distance, deformer, settings, turn)
        report(turn + 1, steps)

    skin = _drape(skin, faces, parts, deformer, bare)
    field = signed_distance(skin, faces, grid)
    field = _close_head(field, skin, parts, grid)
    field = _close_toes(field, skin, parts, grid)
    report(settings.rounds + 1, steps)
    field = _add_lobes(field, skin, faces, grid, mask_distance, settings)
    # cut what sticks out of the mask by a rounded extrusion of it
    field = np.maximum(field, np.minimum(mask_distance, 3 * grid.cell)[:, :, None])
    field = _part_arms(field, bare, faces, parts, grid)
    vertices, triangles = _extract(field, grid, settings.vertices)
    vertices = _restore_face(vertices, skin, faces, parts, grid.cell)
    report(settings.rounds + 2, steps)
    iou = silhouette_iou(vertices, triangles, camera, mask)
    report(steps, steps)
    return Surface(
        vertices=vertices.astype(np.float32),
        faces=triangles.astype(np.int32),
        colors=np.full((len(vertices), 3), 0.7, np.float32),
        provenance={"backend": "body-prior", "silhouette_iou": iou, "body_silhouette_iou": before, "cell": grid.cell},
    )


def _make_grid(skin: FloatArray, person: BoolArray, camera: OrthographicCamera, settings: SurfaceSettings) -> Grid:
    low, high = person_box(skin, person, camera)
    cell = float((high - low).max() / settings.resolution)
    border = np.array([6 * cell, 6 * cell, 6 * cell + 0.10])
    shape = np.ceil((high - low + 2 * border) / cell).astype(int) + 1
    return Grid(low - border, cell, (int(shape[0]), int(shape[1]), int(shape[2])))


def _mask_distance(mask: FloatArray, camera: OrthographicCamera, grid: Grid) -> FloatArray:
    """Signed distance to the mask's contour (nx, ny), metres, negative inside, at the grid's columns; sub-pixel through the opacity."""
    import cv2
    from scipy.spatial import cKDTree

    x, y = np.meshgrid(grid.axis(0), grid.axis(1), indexing="ij")
    pixels = camera.project(np.stack([x, y, np.zeros_like(x)], axis=-1)).astype(np.float32)
    per_cell = camera.scale * grid.cell
    soft = cv2.GaussianBlur(mask, (0, 0), max(0.5, 0.35 * per_cell))
    opacity = cv2.remap(soft, pixels[..., 0] - 0.5, pixels[..., 1] - 0.5, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    contours = trace_contours(soft)
    if not contours:
        raise InputError("the subject's mask has no contour; expected a person before a background")
    distance = np.reshape(cKDTree(np.concatenate(contours)).query(pixels.reshape(-1, 2), workers=1)[0], x.shape) / camera.scale
    return np.where(opacity > 0.5, -distance, distance).astype(np.float32)


class _Deformer:
    """Smooth fields on the skin by screened diffusion with cotangent weights.

    Harmonic rather than bi-Laplacian: a displacement never exceeds the constraints around it, so the face between two ears that are pulled
    to the hair's contour cannot overshoot. A second, short diffusion takes the kinks off.
    """

    def __init__(self, vertices: FloatArray, faces: IntArray) -> None:
        import scipy.sparse as sp

        count = len(vertices)
        corners = vertices[faces]
        rows, columns, values = [], [], []
        for corner in range(3):
            a, b = corners[:, (corner + 1) % 3] - corners[:, corner], corners[:, (corner + 2) % 3] - corners[:, corner]
            sine = np.maximum(np.linalg.norm(np.cross(a, b), axis=1), 1e-12)
            # negative cotangents (obtuse slivers) would break the maximum principle
            values.append(np.clip((a * b).sum(axis=1) / sine, 0.01, 20.0) / 2)
            rows.append(faces[:, (corner + 1) % 3])
            columns.append(faces[:, (corner + 2) % 3])
        row, column, value = np.concatenate(rows), np.concatenate(columns), np.concatenate(values)
        adjacency = sp.csr_matrix((value, (row, column)), (count, count))
        adjacency = adjacency + adjacency.T
        self._stiffness = (sp.diags(np.asarray(adjacency.sum(axis=1)).ravel()) - adjacency).tocsc()
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 6
        self._mass = np.maximum(np.bincount(faces.ravel(), np.repeat(area, 3), minlength=count), 1e-9)

    def spread(self, weight: FloatArray, target: FloatArray, *, near: float, fade: FloatArray) -> FloatArray:
        """A field (V, k) near `target` (V, k) where `weight` (V,) in [0, 1] says so.

        It keeps to the constraints over lengths of `near` metres and fades out over `fade` (V,) metres.
        """
        import scipy.sparse as sp
        from scipy.sparse.linalg import splu

        pull = weight * self._mass / near**2
        rough = self._solve(self._stiffness + sp.diags(pull + self._mass / fade**2), pull[:, None] * target, splu)
        return self._solve(sp.diags(self._mass) + near**2 * self._stiffness, self._mass[:, None] * rough, splu)

    @staticmethod
    def _solve(system: Any, right: FloatArray, splu: Any) -> FloatArray:
        factor = splu(system.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        return np.asarray(factor.solve(np.ascontiguousarray(right)))


def _sample(values: FloatArray, points: FloatArray, grid: Grid) -> FloatArray:
    """Bilinear values of a column map (nx, ny) at x, y of points (N, >=2)."""
    import cv2

    place = ((points[:, :2] - grid.origin[:2]) / grid.cell).astype(np.float32)
    out = [
        cv2.remap(values, place[None, i : i + 30000, 1], place[None, i : i + 30000, 0], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[
            0
        ]
        for i in range(0, len(place), 30000)
    ]
    return np.concatenate(out)


def _columns_seen(skin: FloatArray, faces: IntArray, grid: Grid) -> tuple[FloatArray, FloatArray]:
    """Front and back depth (nx, ny) of the skin at the grid's columns, metres; -inf and +inf where there is none."""
    x, y = np.meshgrid(grid.axis(0), grid.axis(1), indexing="ij")
    front = cast_depth(ray_scene(skin, faces, threads=0), x, y, float(skin[:, 2].max()) + 1)
    mirrored = skin * np.array([1.0, 1.0, -1.0])
    back = -cast_depth(ray_scene(mirrored, faces, threads=0), x, y, float(mirrored[:, 2].max()) + 1)
    return front, back


def _signed(inside: BoolArray, cell: float) -> FloatArray:
    """Signed distance of a binary map (negative inside), metres, contour between the nodes, lightly smoothed."""
    import cv2

    return np.asarray(cv2.GaussianBlur((contour_distance(inside) * cell).astype(np.float32), (0, 0), 1.0))


def _pull_to_contour(
    skin: FloatArray,
    faces: IntArray,
    parts: IntArray,
    grid: Grid,
    mask_distance: FloatArray,
    deformer: _Deformer,
    settings: SurfaceSettings,
    turn: int,
) -> FloatArray:
    from a2v.body.parts import PARTS

    front, _ = _columns_seen(skin, faces, grid)
    own = _signed(np.isfinite(front), grid.cell)
    slope_own = np.stack(np.gradient(own, grid.cell), axis=-1).astype(np.float32)
    slope_mask = np.stack(np.gradient(mask_distance, grid.cell), axis=-1).astype(np.float32)
    inset = _sample(own, skin, grid)
    at_rim = np.abs(inset) < 1.5 * grid.cell
    # a vertex a little inside of the rim stays that much inside: else each round would flatten the flanks
    gap = _sample(mask_distance, skin, grid) - inset
    to_mask = np.stack([_sample(np.ascontiguousarray(slope_mask[..., i]), skin, grid) for i in (0, 1)], axis=1)
    to_mask /= np.maximum(np.linalg.norm(to_mask, axis=1, keepdims=True), 1e-6)
    outward = np.stack([_sample(np.ascontiguousarray(slope_own[..., i]), skin, grid) for i in (0, 1)], axis=1)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-6)
    agreement = (to_mask * outward).sum(axis=1)
    move = -gap[:, None] * to_mask
    part = np.array(PARTS, dtype=object)[parts]
    stiff = np.isin(part, ["left_hand", "right_hand", "left_foot", "right_foot"])
    reach = np.where(stiff, 0.5, np.where(part == "head", 0.4, 1.0)) * settings.reach
    good = at_rim & (agreement > 0.4) & (np.abs(gap) < reach)
    weight = np.where(good, agreement, 0.0) * np.where(stiff, 0.3, 1.0)
    normals = vertex_normals(skin, faces)
    head = part == "head"
    # the face keeps its shape: the contour around it is hair as often as skin
    fade = np.where(head & (normals[:, 2] > 0.35), 0.04, np.where(head, 0.2, 0.25))
    near = 0.02 if turn < settings.rounds // 2 else 0.01
    flat = deformer.spread(weight, move, near=near, fade=fade)
    # Loose cloth stands off all around: the push along the rim's outward direction becomes a push along the normals in depth.
    push = deformer.spread(weight, (move * outward).sum(axis=1)[:, None], near=0.03, fade=np.minimum(fade, 0.12))[:, 0]
    share = np.where(head, np.where(normals[:, 2] > 0, 0.0, 0.8), np.where(stiff, 0.3, 1.0)) * settings.depth
    share = deformer.spread(np.ones(len(skin)), share[:, None], near=0.03, fade=np.full(len(skin), 10.0))[:, 0]
    result = skin.copy()
    result[:, :2] += np.clip(flat, -settings.reach, settings.reach)
    result[:, 2] += np.clip(push, -0.02, 0.05) * share * normals[:, 2]
    return result


def _drape(skin: FloatArray, faces: IntArray, parts: IntArray, deformer: _Deformer, bare: FloatArray) -> FloatArray:
    """Smooth the forms of the body where cloth was pushed away from it: a loose jacket shows no navel."""
    from a2v.body.parts import PARTS

    covered: BoolArray = np.isin(
        parts, [PARTS.index(name) for name in ("torso", "left_thigh", "right_thigh", "left_upper_arm", "right_upper_arm")]
    )
    normals = vertex_normals(bare, faces)
    stand_off = np.clip(((skin - bare) * normals).sum(axis=1), 0, None)
    every = np.full(len(skin), 10.0)
    # mean of the stand-off around the limb, not of the rim alone
    loose: FloatArray = deformer.spread(np.where(covered, 1.0, 0.2), stand_off[:, None], near=0.06, fade=every)[:, 0]
    loose = np.where(covered, np.clip(loose / 0.012, 0, 1), 0.0)
    share = deformer.spread(np.ones(len(skin)), loose[:, None], near=0.03, fade=every)[:, 0]
    smooth = deformer.spread(np.ones(len(skin)), skin - bare.mean(axis=0), near=0.035, fade=every) + bare.mean(axis=0)
    # the rim stays where the photo has it
    change = (smooth - skin) * share[:, None]
    change[:, :2] = 0.0
    return np.asarray(skin + change)


def _close_head(field: FloatArray, skin: FloatArray, parts: IntArray, grid: Grid) -> FloatArray:
    """Fill the mouth's cavity: what a closed slit of the lips would enclose, at least two cells below the skin (creases stay)."""
    from scipy.ndimage import binary_dilation, binary_erosion, binary_fill_holes

    head = skin[parts == 0]
    if len(head) == 0:
        return field
    low = np.clip(((head.min(axis=0) - grid.origin) / grid.cell).astype(int) - 6, 0, None)
    high = ((head.max(axis=0) - grid.origin) / grid.cell).astype(int) + 7
    box = tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
    solid = field[box] < 0
    cavity = binary_erosion(binary_fill_holes(binary_dilation(solid)), iterations=3, border_value=1) & ~solid
    field[box] = np.where(cavity, np.float32(-grid.cell), field[box])
    return field


def _part_arms(field: FloatArray, bare: FloatArray, faces: IntArray, parts: IntArray, grid: Grid) -> FloatArray:
    """Carve a gap of two cells where a sleeve has grown together with the trunk, or a raised arm would draw a web of cloth.

    The gap runs half-way between the bare arm and the bare trunk, outside of both; near the armhole only where the two face each other.
    """
    from scipy.spatial import cKDTree

    from a2v.body.parts import PARTS

    normals = vertex_normals(bare, faces)
    trunk = np.nonzero(np.isin(parts, [PARTS.index(name) for name in ("torso", "left_thigh", "right_thigh")]))[0]
    if len(trunk) == 0:
        return field
    torso = parts == PARTS.index("torso")
    tree = cKDTree(bare[trunk])
    field = field.copy()
    for side in ("left", "right"):
        upper = parts == PARTS.index(f"{side}_upper_arm")
        arm = np.nonzero(upper | np.isin(parts, [PARTS.index(f"{side}_{name}") for name in ("lower_arm", "hand")]))[0]
        hole = faces[upper[faces].any(axis=1) & torso[faces].any(axis=1)]
        if len(arm) == 0 or len(hole) == 0:
            continue
        low = np.maximum(((bare[arm].min(axis=0) - grid.origin) / grid.cell).astype(np.int64) - 12, 0)
        high = ((bare[arm].max(axis=0) - grid.origin) / grid.cell).astype(np.int64) + 13
        cells = np.argwhere(field[tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))] < 1.5 * grid.cell) + low
        points = grid.origin + cells * grid.cell
        far, nearest = (np.asarray(found) for found in tree.query(points, workers=1))
        near, index = (np.asarray(found) for found in cKDTree(bare[arm]).query(points, workers=1))
        kept = (near < 0.12) & (far < 0.12) & (np.abs(near - far) < 6 * grid.cell)
        cells, points, body, limb = cells[kept], points[kept], trunk[nearest[kept]], arm[index[kept]]
        gap = 1.1 * grid.cell - 0.5 * np.abs(near - far)[kept]  # distance to the half-way surface
        outside = ((points - bare[body]) * normals[body]).sum(axis=1) > -0.004
        outside &= ((points - bare[limb]) * normals[limb]).sum(axis=1) > -0.004
        facing = (normals[body] * normals[limb]).sum(axis=1) < 0
        beyond = np.linalg.norm(bare[limb] - bare[hole].mean(axis=(0, 1)), axis=1) > 0.13
        carved = outside & (facing | beyond)
        i, j, k = cells[carved].T
        field[i, j, k] = np.maximum(field[i, j, k], gap[carved])
    return field


def _close_toes(field: FloatArray, skin: FloatArray, parts: IntArray, grid: Grid) -> FloatArray:
    """Fill the gaps between the toes (a morphological closing by two cells): most people are photographed in shoes."""
    from scipy.ndimage import binary_closing

    from a2v.body.parts import PARTS

    ball = np.linalg.norm(np.indices((5, 5, 5)) - 2.0, axis=0) < 2.5
    for name in ("left_foot", "right_foot"):
        foot = skin[parts == PARTS.index(name)]
        if len(foot) == 0:
            continue
        ahead = foot[:, 2] > foot[:, 2].min() + 0.5 * np.ptp(foot[:, 2])
        low = np.clip(((foot[ahead].min(axis=0) - grid.origin) / grid.cell).astype(int) - 4, 0, None)
        high = ((foot[ahead].max(axis=0) - grid.origin) / grid.cell).astype(int) + 5
        box = tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
        solid = field[box] < 0
        gaps = binary_closing(np.pad(solid, 3), ball)[3:-3, 3:-3, 3:-3] & ~solid
        field[box] = np.where(gaps, np.float32(-0.5 * grid.cell), field[box])
    return field


def _add_lobes(
    field: FloatArray, skin: FloatArray, faces: IntArray, grid: Grid, mask_distance: FloatArray, settings: SurfaceSettings
) -> FloatArray:
    """Fuse inflated volumes where the mask has something that the body does not reach."""
    import cv2

    front, back = _columns_seen(skin, faces, grid)
    covered = np.isfinite(front)
    wanted = mask_distance < 0
    # slivers along the rim (under a centimetre and a half) are no hair and no skirt
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    missing = (
        cv2.dilate(cv2.morphologyEx((wanted & ~covered).astype(np.uint8), cv2.MORPH_OPEN, disk), disk).astype(bool) & wanted & ~covered
    )
    if not missing.any():
        return field
    # thickness from the medial width of the mask's protruding region: a round profile from contour to middle
    inner = np.where(wanted, -mask_distance, 0).astype(np.float32)
    span = max(3, int(2 * settings.lobe / grid.cell)) | 1
    radius = np.clip(cv2.dilate(inner, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (span, span))), 2 * grid.cell, settings.lobe)
    radius = cv2.GaussianBlur(radius.astype(np.float32), (0, 0), span / 4)
    depth = np.minimum(inner, radius)
    half = np.sqrt(np.maximum(depth * (2 * radius - depth), 0))
    # continue the body's middle and thickness into the lobe
    nearest = nearest_known(covered)
    middle = np.where(covered, (np.where(covered, front, 0) + np.where(covered, back, 0)) / 2, 0)[nearest]
    middle = cv2.GaussianBlur(middle.astype(np.float32), (0, 0), 3.0)
    thick = np.where(covered, np.where(covered, front, 0) - np.where(covered, back, 0), 0)
    near_thick = cv2.GaussianBlur(
        cv2.dilate(thick.astype(np.float32), np.ones((13, 13), np.uint8))[nearest].astype(np.float32), (0, 0), 3.0
    )
    half = np.minimum(half, np.maximum(0.5 * near_thick, 0.015))
    half = np.maximum(half, 0.8 * grid.cell)
    # fade out into the body over a few centimetres
    into = cv2.distanceTransform((~missing).astype(np.uint8), cv2.DIST_L2, 5) * grid.cell
    fade = np.clip(1.0 - into / 0.015, 0, 1)
    z = grid.axis(2).astype(np.float32)
    active = (into < 0.015) & wanted
    i, j = np.nonzero(active)
    lobe = (np.abs(z[None] - middle[i, j, None]) - (half * fade)[i, j, None]) * 0.8 + (1 - fade[i, j, None]) * 2 * grid.cell
    limit = 3 * grid.cell
    field[i, j] = _smooth_min(field[i, j], np.clip(lobe, -limit, limit).astype(np.float32), 1.5 * grid.cell)
    return field


def _smooth_min(a: FloatArray, b: FloatArray, width: float) -> FloatArray:
    """Polynomial smooth union of two distance fields."""
    mix = np.clip(width - np.abs(a - b), 0, None)
    return np.asarray(np.minimum(a, b) - mix * mix / (4 * width))


def _extract(field: FloatArray, grid: Grid, target: int) -> tuple[FloatArray, IntArray]:
    """The largest closed piece of the softened zero level, even and with about `target` vertices."""
    from scipy.ndimage import gaussian_filter

    field = np.pad(gaussian_filter(field, 0.7)[1:-1, 1:-1, 1:-1], 1, constant_values=3 * grid.cell)
    if not (field < 0).any():
        raise InputError("nothing is left of the body inside the mask; fit the body to this photo first (a2v.body.fit_body)")
    return mesh_grid(field, grid, target, smoothing=6)


def _restore_face(vertices: FloatArray, skin: FloatArray, faces: IntArray, parts: IntArray, cell: float) -> FloatArray:
    """Lay the head's vertices back on the skin that the grid has blunted, where it is within a cell."""
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

"""Refine a rough mask to an opacity at the photo's full resolution."""

from __future__ import annotations

import warnings

import numpy as np

from a2v.types import BoolArray, ByteArray, FloatArray


def refine_mask(
    image: ByteArray,
    rough: FloatArray,
    *,
    height: float,
    band: float = 0.015,
    grabcut_side: int = 640,
) -> FloatArray:
    """Refine the rough mask of a person to an alpha matte.

    GrabCut (Rother et al. 2004) moves the contour to the image's edges within a band around the
    rough one; closed-form matting (Levin et al. 2008) then finds the opacities in a narrow band
    around the new contour. Where the colors on both sides are
    similar (black trousers in front of black), GrabCut cannot separate them, and its change is
    undone.

    Parameters
    ----------
    image : (H, W, 3) uint8
    rough : (H, W) float32 in [0, 1]
    height : float
        Height of the person, pixels: the unit of `band`.
    band : float
        How far the contour may move, fraction of `height`.
    grabcut_side : int
        GrabCut works on the image reduced to this longer side, pixels.

    Returns
    -------
    (H, W) float32 in [0, 1].
    """
    cut = _grabcut(image, rough, reach=band * height, side=grabcut_side)
    cut = keep_person(cut)
    if not cut.any():
        return rough.astype(np.float32)
    return keep_soft(_matte(image, cut, reach=max(2.0, 0.35 * band * height)))


def load_pymatting() -> None:
    """Import pymatting, without the warning of numba about its threads."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import pymatting  # noqa: F401


def _grabcut(image: ByteArray, rough: FloatArray, reach: float, side: int) -> BoolArray:
    import cv2

    rows, columns = rough.shape
    scale = min(1.0, side / max(rows, columns))
    size = (max(1, round(columns * scale)), max(1, round(rows * scale)))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    prior = cv2.resize(rough, size, interpolation=cv2.INTER_AREA)
    inside = prior > 0.5
    if inside.sum() < 16 or inside.all():
        return rough > 0.5
    radius = max(2.0, reach * scale)
    depth_in = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, 5)
    depth_out = cv2.distanceTransform((~inside).astype(np.uint8), cv2.DIST_L2, 5)
    trimap = np.where(inside, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    trimap[((depth_in > radius) & (prior > 0.99)) | (prior > 0.995)] = cv2.GC_FGD
    trimap[(depth_out > radius) & (prior < 0.3)] = cv2.GC_BGD
    # thin limbs have no core deeper than the band, so their middle line counts as certain
    ridge = (depth_in >= cv2.dilate(depth_in, np.ones((3, 3), np.uint8))) & (depth_in > 1.5)
    trimap[ridge & (prior > 0.8)] = cv2.GC_FGD
    result = trimap.copy()
    cv2.setRNGSeed(0)  # GrabCut's k-means draws from OpenCV's generator
    try:
        cv2.grabCut(
            small, result, None, np.zeros((1, 65)), np.zeros((1, 65)), 4, cv2.GC_INIT_WITH_MASK
        )
    except cv2.error:  # too few samples of one side
        return rough > 0.5
    cut = (result == cv2.GC_FGD) | (result == cv2.GC_PR_FGD)
    cut = np.where(_contrast(small, depth_in, depth_out, radius) > 12.0, cut, inside)
    smooth = cv2.GaussianBlur(cut.astype(np.float32), (0, 0), 0.8)
    return np.asarray(cv2.resize(smooth, (columns, rows), interpolation=cv2.INTER_CUBIC) > 0.5)


def _contrast(
    image: ByteArray, depth_in: FloatArray, depth_out: FloatArray, radius: float
) -> FloatArray:
    """Difference of the mean colors (CIELAB units) just inside and just outside of the contour
    near each pixel."""
    import cv2

    lab = cv2.cvtColor(image.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    reach = 3 * radius
    means = []
    for depth in (depth_in, depth_out):
        weight = ((depth > 0.5 * radius) & (depth < reach)).astype(np.float32)
        total = cv2.GaussianBlur(weight, (0, 0), reach)
        mean = (
            cv2.GaussianBlur(lab * weight[..., None], (0, 0), reach)
            / np.maximum(total, 1e-4)[..., None]
        )
        means.append(mean)
    return np.asarray(np.linalg.norm(means[0] - means[1], axis=-1))


def _matte(image: ByteArray, cut: BoolArray, reach: float) -> FloatArray:
    """Apply closed-form matting within `reach` pixels of the contour of `cut`.

    All other pixels are certainly inside or outside.
    """
    import cv2

    load_pymatting()
    from pymatting import cf_laplacian, cg, ichol

    depth_in = cv2.distanceTransform(cut.astype(np.uint8), cv2.DIST_L2, 5)
    depth_out = cv2.distanceTransform((~cut).astype(np.uint8), cv2.DIST_L2, 5)
    radius = float(np.clip(reach, 2.0, 10.0))
    # outside of the contour there may be hair; inside, a thin limb must keep a certain core
    unknown = ((depth_in > 0) & (depth_in <= radius)) | ((depth_out > 0) & (depth_out <= radius))
    ridge = cut & (depth_in >= cv2.dilate(depth_in, np.ones((3, 3), np.uint8))) & (depth_in > 1)
    unknown &= ~ridge
    alpha = cut.astype(np.float64)
    rows, columns = np.nonzero(unknown)
    if len(rows) < 4:
        return alpha.astype(np.float32)
    top, bottom = max(0, rows.min() - 2), rows.max() + 3
    left, right = max(0, columns.min() - 2), columns.max() + 3
    window = (slice(top, bottom), slice(left, right))
    free = unknown[window].ravel()
    known_alpha = alpha[window].ravel()
    laplacian = cf_laplacian(
        image[window].astype(np.float64) / 255, epsilon=1e-6, is_known=~free
    ).tocsr()[free]
    system = laplacian[:, free].tocsc()
    right_side = -laplacian[:, ~free] @ known_alpha[~free]
    # a weak prior toward the cut keeps the system regular in windows of a single color
    weight = 1e-4
    system.setdiag(system.diagonal() + weight)
    right_side = right_side + weight * known_alpha[free]
    try:
        solution = cg(
            system,
            right_side,
            x0=known_alpha[free].copy(),
            M=ichol(system),
            rtol=1e-4,
            maxiter=1000,
        )
    except ValueError:  # no convergence or a failed factorization: return the binary cut
        return np.asarray(cv2.GaussianBlur(cut.astype(np.float32), (0, 0), 0.7))
    filled = known_alpha.copy()
    filled[free] = np.clip(solution, 0, 1)
    alpha[window] = filled.reshape(alpha[window].shape)
    return alpha.astype(np.float32)


def keep_person(mask: BoolArray, *, minimum: float = 0.02) -> BoolArray:
    """Drop islands smaller than `minimum` of the largest one's area, and fill pinholes (under 0.1 %
    of the person)."""
    import cv2

    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        mask.astype(np.uint8), connectivity=8
    )
    if count <= 1:
        return mask
    areas = stats[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    kept = (areas >= minimum * areas.max())[labels] & mask
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        (~kept).astype(np.uint8), connectivity=4
    )
    holes = stats[:, cv2.CC_STAT_AREA] < max(4.0, 0.001 * kept.sum())
    return np.asarray(kept | (holes[labels] & ~kept))


def keep_soft(alpha: FloatArray) -> FloatArray:
    """Clear opacity that is not connected to the person: stray islands of the matte."""
    import cv2

    core = keep_person(alpha > 0.5)
    near = cv2.dilate(core.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    result = np.where(near, alpha, 0)
    result[core & (alpha < 0.5)] = 1.0  # filled pinholes
    result[~core & (result > 0.5)] = 0.0
    return result.astype(np.float32)

"""Reconstruct the background behind a person from regions with straight borders, each with its own
shading.

The picture is divided into regions of one material. Straight borders between two regions are
continued through the hole, and cut it into cells. Every cell is assigned to a region so that the
cost of borders is smallest. Within a region the color is a smooth function of the position.
"""

from __future__ import annotations

import numpy as np

from a2v.geometry.mesh import joined_by
from a2v.perception.borders import assign_regions
from a2v.perception.patch_fill import fill_by_patches
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

_SIDE = 400
"""Longest side at which regions are found, pixels."""
_GAP = 0.02
"""Half of the width of gaps in the hole that are too narrow to show the background, such as that
between the legs, as a fraction of the longer side."""
_LIGHTNESS = 0.5
"""Weight of lightness relative to a and b in the search for regions, so that shading makes no
borders."""
_SMALLEST = 0.0012
"""Smallest region, as a fraction of the picture."""
_MERGED = (5.0, 10.0)
"""Neighboring regions become one if their chroma differs by less, and their lightness at the border
by less, CIELAB."""
_SOFT = (2.5, 5.0, 14.0)
"""They become one, too, if chroma and lightness at their border and their mean chroma differ by
less: a lamp's glow has no sharp border."""
_SPECK = 0.0025
"""Regions smaller than this, as a fraction of the picture, are treated as part of the hole."""
_PARTED = (4.0, 10.0)
"""Regions on two sides of the hole are the same if chroma and lightness differ by less than
these."""
_ISLAND = 0.03
"""Largest region, as a fraction of the picture, that is treated as part of the hole if only the
hole surrounds it."""
_REGIONS = 12
"""Largest number of regions that reach behind the person."""
_ROUNDS = 6
"""Iterations of the robust fit of a region's shading."""
_STEP = 15.0
"""Largest correction of a shading where it meets the rim, CIELAB."""
_TEXTURE = 40.0
"""Largest value of a texture, CIELAB."""
_SLOW = 5.0
"""Standard deviation of the smoothing below which colors are texture, pixels."""
_ERROR = 3.0
"""Errors of a shading beyond this have less weight, CIELAB."""


def regions_of(picture: ByteArray, side: int) -> IntArray:
    """Divide a picture (H, W, 3) into regions of one material, numbered from 0.

    The result (h, w) has a longer side of `side` pixels.
    """
    import cv2

    scale = side / max(picture.shape[:2])
    size = round(scale * picture.shape[1]), round(scale * picture.shape[0])
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    return _known_regions(cv2.cvtColor(small, cv2.COLOR_RGB2Lab), np.zeros(small.shape[:2], bool))


def find_regions(colors: FloatArray, hole: BoolArray) -> IntArray:
    """Find the regions around a hole and continue them behind it.

    Parameters
    ----------
    colors : (H, W, 3) float32
        CIELAB.
    hole : (H, W) bool

    Returns
    -------
    (H, W) int32
        The region of each pixel.
    """
    labels = _known_regions(colors, hole)
    return assign_regions(labels, labels < 0)


def fill_by_regions(
    colors: FloatArray, hole: BoolArray, regions: IntArray, shadow: BoolArray
) -> FloatArray:
    """Fill a hole with the shading and the texture of the regions behind it.

    The shading meets the rim of the hole without a step. In a shadow only the shading is replaced.

    Parameters
    ----------
    colors : (H, W, 3) float32
        CIELAB.
    hole : (H, W) bool
    regions : (H, W) int
        See `find_regions`.
    shadow : (H, W) bool

    Returns
    -------
    (H, W, 3) float32
        `colors` outside of hole and shadow.
    """
    import cv2

    unknown = hole | shadow
    smooth = fit_shading(colors, regions, hole, unknown)
    texture, brighter = np.zeros_like(smooth), np.zeros_like(smooth)
    for label in np.unique(regions[unknown]):
        own = regions == label
        inner = cv2.erode(own.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool) & ~hole
        off = colors - smooth
        lit = _spread(np.clip(off, -_STEP, _STEP), inner & ~shadow)
        shaded = _spread(off, inner & shadow)
        brighter[own] = (lit - shaded)[own]
        texture[inner] = (off - np.where(shadow[..., None], shaded, lit))[inner]
        smooth[own] += lit[own]
    fine = fill_by_patches(np.clip(texture, -_TEXTURE, _TEXTURE), hole)
    behind = cv2.GaussianBlur(smooth, (0, 0), 0.7) + fine
    lighter = (
        colors + cv2.GaussianBlur(shadow.astype(np.float32), (0, 0), 2.0)[..., None] * brighter
    )
    return np.asarray(np.where(hole[..., None], behind, lighter), np.float32)


def _spread(values: FloatArray, known: BoolArray) -> FloatArray:
    """Smooth values (H, W, 3) where they are known, and extend them to the other pixels.

    The values are means over larger and larger squares; 0 if no value is known.
    """
    import cv2

    height, width = known.shape
    total = np.zeros_like(values)
    filled = np.zeros(known.shape, np.float32)
    weight = known.astype(np.float32)
    for level in range(1, int(np.ceil(np.log2(max(height, width)))) + 1):
        sigma = _SLOW * 2.0 ** (level - 1)
        if sigma > 2 * max(height, width):
            break
        scale = max(1.0, sigma / 4)
        size = max(1, round(width / scale)), max(1, round(height / scale))
        small = cv2.resize(weight, size, interpolation=cv2.INTER_AREA)
        sums = cv2.resize(values * weight[..., None], size, interpolation=cv2.INTER_AREA)
        blur = sigma / scale
        share = cv2.GaussianBlur(small, (0, 0), blur)
        mean = cv2.GaussianBlur(sums, (0, 0), blur) / np.maximum(share, 1e-6)[..., None]
        trust = np.clip(share / 0.25, 0, 1)
        mean, trust = (cv2.resize(one, (width, height)) for one in (mean, trust))
        gain = (1 - filled) * trust
        total += gain[..., None] * mean
        filled += gain
    return np.asarray(total / np.maximum(filled, 1e-6)[..., None], np.float32)


def _known_regions(colors: FloatArray, hole: BoolArray) -> IntArray:
    """Regions (H, W) of the picture outside of the hole, -1 inside."""
    import cv2
    from skimage.segmentation import felzenszwalb

    height, width = hole.shape
    scale = min(1.0, _SIDE / max(height, width))
    size = max(round(scale * width), 8), max(round(scale * height), 8)
    known = cv2.resize((~hole).astype(np.float32), size, interpolation=cv2.INTER_AREA)
    small = cv2.resize(colors * ~hole[..., None], size, interpolation=cv2.INTER_AREA)
    small = (small / np.maximum(known, 1e-3)[..., None]).astype(np.float32)
    reach = 2 * round(_GAP * max(size)) + 1
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    wide = np.pad((known <= 0.99).astype(np.uint8), reach)  # a gap at the edge does not count
    closed = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, disk)[reach:-reach, reach:-reach]
    seen = closed == 0
    small = cv2.medianBlur(small, 3)
    even = np.where(seen[..., None], small * (_LIGHTNESS, 1, 1), 500.0)
    least = max(12, round(_SMALLEST * seen.size))
    found = felzenszwalb(even / 100, scale=120, sigma=0, min_size=least, channel_axis=-1)
    found = np.where(seen, found, -1)
    found = _merged(small, found, hole=~seen)
    wide = cv2.dilate(closed, np.ones((5, 5), np.uint8)) > 0
    found = np.where((found < 0) & ~wide, _grown_into(found, ~wide), found)
    large = cv2.resize(found.astype(np.float32), (width, height), interpolation=cv2.INTER_NEAREST)
    return np.where(hole, -1, large).astype(np.int32)


def _grown_into(labels: IntArray, where: BoolArray) -> IntArray:
    """Label the unlabeled pixels in `where` like the nearest labeled pixel."""
    from scipy.ndimage import distance_transform_edt

    if not (labels >= 0).any():
        return np.where(where, 0, labels).astype(np.int32)
    nearest = distance_transform_edt(labels < 0, return_distances=False, return_indices=True)
    return np.where(where, labels[tuple(nearest)], labels).astype(np.int32)


def _merged(colors: FloatArray, labels: IntArray, hole: BoolArray) -> IntArray:
    """Merge neighboring regions of one material.

    Then merge the smallest region with its most similar neighbor until at most `_REGIONS` touch the
    hole. Islands in the hole get -1.
    """
    import cv2

    near = cv2.dilate(hole.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    numbers = _numbered(labels)
    for _ in range(40):
        count = int(numbers.max()) + 1
        inside = numbers >= 0
        flat = numbers[inside]
        sizes = np.bincount(flat, minlength=count)
        means = np.stack(
            [np.bincount(flat, colors[inside][:, c], count) / sizes for c in range(3)], axis=1
        )
        pairs, light, tint = _neighbors(colors, numbers)
        chroma = _chroma_difference(means[pairs[:, 0]], means[pairs[:, 1]])
        alike = ((chroma < _MERGED[0]) & (light < _MERGED[1])) | (
            (tint < _SOFT[0]) & (light < _SOFT[1]) & (chroma < _SOFT[2])
        )
        if alike.any():
            into = joined_by(count, pairs[alike])
        else:
            into = np.arange(count)
            touching = np.unique(numbers[near & inside])
            price = chroma + 0.5 * light
            if len(touching) > _REGIONS and np.isin(pairs, touching).any():
                smallest = touching[np.argmin(sizes[touching])]
                own = (pairs == smallest).any(axis=1)
                if not own.any():
                    break
                one, two = pairs[np.argmin(np.where(own, price, np.inf))]
                into[smallest] = two if smallest == one else one
            else:
                break
        numbers = _numbered(np.where(inside, into[numbers], -1))
    alone = np.setdiff1d(numbers[near & inside], _neighbors(colors, numbers)[0])
    sizes = np.bincount(numbers[numbers >= 0])
    alone = alone[sizes[alone] < _ISLAND * numbers.size]
    alone = np.union1d(alone, np.flatnonzero(sizes < _SPECK * numbers.size))
    numbers = _numbered(np.where(np.isin(numbers, alone), -1, numbers))
    names = np.unique(numbers[near & (numbers >= 0)])
    means = np.array([colors[numbers == name].mean(axis=0) for name in names]).reshape(-1, 3)
    one, two = np.triu_indices(len(names), 1)
    same = (_chroma_difference(means[one], means[two]) < _PARTED[0]) & (
        np.abs(means[one, 0] - means[two, 0]) < _PARTED[1]
    )
    into = np.arange(int(numbers.max()) + 1)
    groups = joined_by(len(names), np.stack([one[same], two[same]], axis=1))
    into[names] = names[[np.flatnonzero(groups == group)[0] for group in groups]]
    return _numbered(np.where(numbers >= 0, into[numbers], -1))


def _chroma_difference(one: FloatArray, two: FloatArray) -> FloatArray:
    """Return the difference of chroma (N,) of colors (N, 3), CIELAB.

    Within one material, chroma grows with the lightness.
    """
    plain = np.linalg.norm(one[:, 1:] - two[:, 1:], axis=1)
    level = np.minimum(one[:, :1], two[:, :1])
    scaled = one[:, 1:] / np.maximum(one[:, :1], 1) - two[:, 1:] / np.maximum(two[:, :1], 1)
    return np.asarray(np.minimum(plain, np.linalg.norm(level * scaled, axis=1)))


def _numbered(labels: IntArray) -> IntArray:
    """Renumber the regions as 0, 1, ...; -1 stays."""
    names, numbers = np.unique(labels, return_inverse=True)
    return (numbers.reshape(labels.shape) - int(names[0] < 0)).astype(np.int32)


def _neighbors(colors: FloatArray, numbers: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return pairs of neighboring regions (P, 2), and the median steps of lightness and chroma (P,)
    across their borders."""
    rows, steps = [], []
    far = 3  # pixels: beyond the blur of the border
    for axis in (0, 1):
        first, second = range(numbers.shape[axis] - far), range(far, numbers.shape[axis])
        one, two = np.take(numbers, first, axis=axis), np.take(numbers, second, axis=axis)
        border = (one != two) & (one >= 0) & (two >= 0)
        rows.append(np.sort(np.stack([one[border], two[border]], axis=1), axis=1))
        step = (
            np.take(colors, first, axis=axis)[border] - np.take(colors, second, axis=axis)[border]
        )
        steps.append(np.abs(step))
    pairs, own = np.unique(np.concatenate(rows), axis=0, return_inverse=True)
    step = np.concatenate(steps)
    order = np.argsort(own.reshape(-1), kind="stable")
    cuts = np.cumsum(np.bincount(own.reshape(-1), minlength=len(pairs)))[:-1]
    medians = np.array([np.median(part, axis=0) for part in np.split(step[order], cuts)])
    medians = medians.reshape(-1, 3)
    return pairs.reshape(-1, 2), medians[:, 0], np.linalg.norm(medians[:, 1:], axis=1)


def fit_shading(
    colors: FloatArray, labels: IntArray, hole: BoolArray, unknown: BoolArray
) -> FloatArray:
    """Return the smooth color (H, W, 3) of every pixel's region.

    It is a polynomial of the position, fitted to the known pixels of the region. Pixels near the
    hole weigh more; errors larger than `_ERROR` weigh less.
    """
    import cv2

    height, width = hole.shape
    longest = max(height, width)
    away = cv2.distanceTransform((~hole).astype(np.uint8), cv2.DIST_L2, 5).reshape(-1)
    rows, columns = np.indices(hole.shape)
    y, x = ((rows - height / 2) / longest).ravel(), ((columns - width / 2) / longest).ravel()
    values = colors.reshape(-1, 3)
    result = colors.astype(np.float32).copy()
    for label in np.unique(labels[unknown]):
        own = labels == label
        use = own & ~unknown
        if use.sum() < 20:
            use = own & ~hole
        if not use.any():
            use = ~hole
        inner = cv2.erode(use.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
        use = inner if inner.sum() > 200 else use
        at = np.flatnonzero(use)
        terms = _terms(len(at), use.size)
        if len(at) > 20000:
            at = at[:: len(at) // 20000]
        weight = np.exp(-away[at] / (0.2 * longest))
        solution = _robust_fit(
            _basis(x[at], y[at], terms), values[at].astype(np.float64), weight, terms
        )
        everywhere = np.flatnonzero(own)
        full = _basis(x[everywhere], y[everywhere], terms)
        result.reshape(-1, 3)[everywhere] = (full @ solution).astype(np.float32)
    return result


def _terms(count: int, size: int) -> list[tuple[int, int]]:
    """Return the exponents of x and y of a region's polynomial. Its degree, 0 to 3, grows with the
    share of the picture that is known to show the region: `count` of `size` pixels."""
    if count < 60:
        degree = 0
    elif count < 0.004 * size:
        degree = 1
    elif count < 0.03 * size:
        degree = 2
    else:
        degree = 3
    return [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]


def _basis(x: FloatArray, y: FloatArray, terms: list[tuple[int, int]]) -> FloatArray:
    """Return the terms (n, M) of a polynomial at positions `x`, `y` (n,)."""
    return np.stack([(x**i) * (y**j) for i, j in terms], axis=1)


def _robust_fit(
    basis: FloatArray, values: FloatArray, weight: FloatArray, terms: list[tuple[int, int]]
) -> FloatArray:
    """Fit the coefficients (M, 3) of the polynomial with terms `basis` (n, M) to values (n, 3),
    CIELAB, with weights (n,).

    Errors beyond `_ERROR` have less weight; if the value is too dark, errors beyond half of it.
    """
    trust = np.ones(len(values))
    ridge = np.diag([1e-6 * 10.0 ** (i + j) for i, j in terms]) * weight.sum()
    for _ in range(_ROUNDS):
        scaled = basis * (weight * trust)[:, None]
        solution = np.linalg.solve(scaled.T @ basis + ridge, scaled.T @ values)
        error = values - basis @ solution
        size = np.linalg.norm(error, axis=1)
        trust = 1 / (1 + (size / np.where(error[:, 0] < 0, 0.5, 1.0) / _ERROR) ** 2)
    return np.asarray(solution)

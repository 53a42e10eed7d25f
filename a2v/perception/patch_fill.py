"""Fill holes of a picture with patches of the same picture, from coarse to fine.

After Wexler et al. (TPAMI 2007) and Barnes et al. (PatchMatch, SIGGRAPH 2009): every patch that
touches the hole gets the most similar known patch, and every pixel of the hole gets the mean of
the patches over it. A patch may be brighter or darker than its example (Darabi et al.,
Image Melding, SIGGRAPH 2012), so that the gradient of a wall continues through the hole without
bands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.compiled import compiled
from a2v.types import BoolArray, FloatArray, IntArray

HALF = 3
"""Half the side of a patch, pixels: 7 by 7."""
_COARSE = 130
"""Longest side of the coarsest level, pixels."""
_ROBUST = 2
"""Rounds of reweighting when differences are integrated."""
_EVEN = 1.0
"""Errors of a difference below this count by their squares, CIELAB."""
_LOOSE = 1e-6
"""Weight of the previous colors, so that the system has one solution."""
_GRAIN = 2.5
"""Standard deviation of the smoothing below which detail is grain, pixels."""
_LEAST = 32
"""Shortest side of a level, pixels."""


@dataclass(frozen=True)
class PatchSettings:
    """Settings of filling a hole.

    Attributes
    ----------
    rounds : int
        Rounds of matching and integrating at the coarsest level; a quarter of them at each finer
        one, at least one.
    brighter : float
        Largest difference of a patch's mean lightness from its example's, CIELAB.
    tinted : float
        The same for a and b.
    level : float
        Cost of an example that lies a whole picture height above or below, CIELAB squared. Floors
        and walls change with the height.
    seed : int
    """

    rounds: int = 8
    brighter: float = 30.0
    tinted: float = 6.0
    level: float = 3000.0
    seed: int = 0


def fill_by_patches(
    picture: FloatArray, hole: BoolArray, settings: PatchSettings | None = None
) -> FloatArray:
    """Fill a hole.

    Parameters
    ----------
    picture : (H, W, 3) float
        CIELAB.
    hole : (H, W) bool
    settings : PatchSettings, optional

    Returns
    -------
    (H, W, 3) float32
        `picture` outside of the hole. Where no known patch of 7 by 7 pixels is left, the hole is
        filled smoothly.
    """
    import cv2

    settings = settings or PatchSettings()
    levels = [(np.asarray(picture, np.float32), np.asarray(hole, bool))]
    while min(levels[-1][1].shape) >= 2 * _LEAST and max(levels[-1][1].shape) > _COARSE:
        colors, missing = levels[-1]
        height, width = (side // 2 for side in missing.shape)
        share = cv2.resize(
            (~missing).astype(np.float32), (width, height), interpolation=cv2.INTER_AREA
        )
        known = cv2.resize(
            colors * ~missing[..., None], (width, height), interpolation=cv2.INTER_AREA
        )
        levels.append((known / np.maximum(share, 1e-6)[..., None], share < 0.99))
    generator = np.random.default_rng(settings.seed)
    current, places = _shifted(*levels[-1]), None
    for number, (colors, missing) in enumerate(reversed(levels)):
        if number:
            height, width = missing.shape
            finer = cv2.resize(current, (width, height), interpolation=cv2.INTER_CUBIC)
            current = np.where(missing[..., None], finer, colors).astype(np.float32)
        last = number == len(levels) - 1
        current, places = _level(
            current,
            missing,
            places,
            max(1, settings.rounds >> (2 * number)),
            settings,
            generator,
            sharp=last,
        )
    return current


def _shifted(colors: FloatArray, hole: BoolArray) -> FloatArray:
    """Fill the hole with shifted pieces of the picture (He and Sun, ECCV 2012; OpenCV's shift
    maps).

    They keep lines straight, but show seams.
    """
    import cv2

    if not hole.any() or hole.all():
        return colors.copy()
    rgb = np.clip(255 * cv2.cvtColor(colors, cv2.COLOR_Lab2RGB), 0, 255).astype(np.uint8)
    lab = cv2.cvtColor(rgb, cv2.COLOR_RGB2Lab)
    filled = lab.copy()
    cv2.xphoto.inpaint(lab, 255 * (~hole).astype(np.uint8), filled, cv2.xphoto.INPAINT_SHIFTMAP)
    found = cv2.cvtColor(
        cv2.cvtColor(filled, cv2.COLOR_Lab2RGB).astype(np.float32) / 255, cv2.COLOR_RGB2Lab
    )
    return np.where(hole[..., None], found, colors)


def _level(
    current: FloatArray,
    hole: BoolArray,
    places: FloatArray | None,
    rounds: int,
    settings: PatchSettings,
    generator: np.random.Generator,
    *,
    sharp: bool,
) -> tuple[FloatArray, FloatArray | None]:
    """Return the picture after some rounds at one level, and the example (H, W, 2) of each pixel.

    With `sharp`, the last round takes each pixel from its own example only.
    """
    import cv2

    height, width = hole.shape
    side = np.ones((2 * HALF + 1, 2 * HALF + 1), np.uint8)
    border = np.zeros(hole.shape, bool)
    border[HALF : height - HALF, HALF : width - HALF] = True
    touched = cv2.dilate(hole.astype(np.uint8), side).astype(bool)
    sources, targets = np.argwhere(border & ~touched), np.argwhere(border & touched)
    if not len(sources) or not len(targets):
        return current, None
    if places is None:
        place = (
            sources[generator.integers(0, len(sources), hole.size)]
            .reshape(height, width, 2)
            .astype(np.int32)
        )
    else:
        doubled = cv2.resize(
            places.astype(np.float32), (width, height), interpolation=cv2.INTER_NEAREST
        )
        place = (2 * doubled + np.indices(hole.shape).transpose(1, 2, 0) % 2).astype(np.int32)
    allowed = (border & ~touched).astype(np.uint8)
    wrong = (
        allowed[np.clip(place[..., 0], 0, height - 1), np.clip(place[..., 1], 0, width - 1)] == 0
    )
    place[wrong] = sources[generator.integers(0, len(sources), int(wrong.sum()))]
    near = cv2.distanceTransform(hole.astype(np.uint8), cv2.DIST_L2, 5)
    trust = np.power(1.15, -near.astype(np.float32)) if near.max() < 400 else 1 / (1 + near)
    limits = np.array(
        [settings.brighter, settings.tinted, settings.tinted, settings.level / height**2],
        np.float32,
    )
    match, slopes = compiled(_match), compiled(_slopes)
    for number in range(rounds):
        finished = number == rounds - 1
        cost = np.zeros(hole.shape, np.float32)
        seed = int(generator.integers(0, 2**31 - 1))
        match(current, allowed, targets, place, cost, limits, seed)
        good = float(np.percentile(cost[targets[:, 0], targets[:, 1]], 75)) + 1e-3
        weights = np.exp(-cost / (2 * good)) * trust + np.float32(1e-12)
        across, down, weight = slopes(current, hole, targets, place, weights, HALF)
        example = current
        current = _integrated(
            example, hole, across, down, weight, rounds=_ROBUST if finished else 1
        )
        if (
            sharp and finished
        ):  # a mean of several examples has no grain, unlike each pixel's own example
            across, down, weight = slopes(example, hole, targets, place, weights, 0)
            grain = _integrated(example, hole, across, down, weight, rounds=1) - current
            current = current + np.where(
                hole[..., None], grain - cv2.GaussianBlur(grain, (0, 0), _GRAIN), 0
            )
    return current, place


def _match(picture, allowed, targets, place, cost, limits, seed):  # type: ignore[no-untyped-def]  # compiled by numba
    """Two passes over `targets`: each takes a neighbor's example, or one drawn around its own, if
    that is more alike. Plain loops: compiled by numba.

    `limits` are the largest shifts of the three channels, and the cost of a row of distance
    squared.
    """
    height, width = allowed.shape
    half = 3
    count = float((2 * half + 1) ** 2)
    np.random.seed(seed)  # noqa: NPY002 - numba's own state, not numpy's

    def unlike(y, x, sy, sx):  # type: ignore[no-untyped-def]
        total = limits[3] * (y - sy) ** 2
        for c in range(3):
            first = 0.0
            second = 0.0
            for dy in range(-half, half + 1):
                for dx in range(-half, half + 1):
                    off = picture[y + dy, x + dx, c] - picture[sy + dy, sx + dx, c]
                    first += off
                    second += off * off
            shift = first / count
            shift = min(max(shift, -limits[c]), limits[c])
            # the shift costs something, or any plain patch would match
            total += (
                second / count - 2 * shift * first / count + shift * shift + 0.1 * shift * shift
            )
        return total

    def take(y, x, sy, sx):  # type: ignore[no-untyped-def]
        if half <= sy < height - half and half <= sx < width - half and allowed[sy, sx] > 0:
            found = unlike(y, x, sy, sx)  # type: ignore[no-untyped-call]
            if found < cost[y, x]:
                cost[y, x], place[y, x, 0], place[y, x, 1] = found, sy, sx

    for i in range(len(targets)):
        y, x = targets[i]
        cost[y, x] = unlike(y, x, place[y, x, 0], place[y, x, 1])  # type: ignore[no-untyped-call]
    for sweep in range(2):
        step = 1 if sweep == 0 else -1
        for n in range(len(targets)):
            y, x = targets[n if sweep == 0 else len(targets) - 1 - n]
            if half <= y - step < height - half:
                take(y, x, place[y - step, x, 0] + step, place[y - step, x, 1])  # type: ignore[no-untyped-call]
            if half <= x - step < width - half:
                take(y, x, place[y, x - step, 0], place[y, x - step, 1] + step)  # type: ignore[no-untyped-call]
            reach = max(height, width)
            while reach >= 1:
                down = np.random.randint(-reach, reach + 1)  # noqa: NPY002
                across = np.random.randint(-reach, reach + 1)  # noqa: NPY002
                take(y, x, place[y, x, 0] + down, place[y, x, 1] + across)  # type: ignore[no-untyped-call]
                reach //= 2


def _slopes(picture, hole, targets, place, weights, half):  # type: ignore[no-untyped-def]  # compiled by numba
    """Return the mean difference of every pixel of the hole to its right and lower neighbor, over
    the examples of all patches that contain the pixel.

    Plain loops for numba.
    """
    height, width = hole.shape
    across = np.zeros((height, width, 3), np.float32)
    down = np.zeros((height, width, 3), np.float32)
    weight = np.zeros((height, width, 2), np.float32)
    for i in range(len(targets)):
        y, x = targets[i]
        sy, sx = place[y, x]
        own = weights[y, x]
        for dy in range(-half, half + 1):
            for dx in range(-half, half + 1):
                here = hole[y + dy, x + dx]
                if (half == 0 or dx < half) and (here or hole[y + dy, x + dx + 1]):
                    weight[y + dy, x + dx, 0] += own
                    for c in range(3):
                        across[y + dy, x + dx, c] += own * (
                            picture[sy + dy, sx + dx + 1, c] - picture[sy + dy, sx + dx, c]
                        )
                if (half == 0 or dy < half) and (here or hole[y + dy + 1, x + dx]):
                    weight[y + dy, x + dx, 1] += own
                    for c in range(3):
                        down[y + dy, x + dx, c] += own * (
                            picture[sy + dy + 1, sx + dx, c] - picture[sy + dy, sx + dx, c]
                        )
    for y in range(height):
        for x in range(width):
            for c in range(3):
                if weight[y, x, 0] > 0:
                    across[y, x, c] /= weight[y, x, 0]
                if weight[y, x, 1] > 0:
                    down[y, x, c] /= weight[y, x, 1]
    return across, down, weight


def _integrated(
    picture: FloatArray,
    hole: BoolArray,
    across: FloatArray,
    down: FloatArray,
    weight: FloatArray,
    *,
    rounds: int,
) -> FloatArray:
    """Return the picture (H, W, 3) with a filled hole. Its pixels have nearly the given differences
    to the pixel on the right (`across`) and below (`down`), and meet the known pixels.

    The sum of the differences' absolute errors is minimized instead of their squares (reweighted in
    `rounds`). So a piece that does not match the rim gives an edge, and its color does not spread
    over the hole.
    """
    number = np.full(hole.shape, -1)
    number[hole] = np.arange(hole.sum())
    rows, columns = np.indices(hole.shape)
    firsts, seconds, steps = [], [], []
    for axis, slope in ((1, across), (0, down)):
        first = (rows[:, :-1], columns[:, :-1]) if axis else (rows[:-1], columns[:-1])
        second = (rows[:, 1:], columns[:, 1:]) if axis else (rows[1:], columns[1:])
        wanted = (hole[first] | hole[second]) & (weight[first][..., 1 - axis] > 0)
        firsts.append(np.stack([first[0][wanted], first[1][wanted]], axis=1))
        seconds.append(np.stack([second[0][wanted], second[1][wanted]], axis=1))
        steps.append(slope[first][wanted])
    one, two, step = (
        np.concatenate(firsts),
        np.concatenate(seconds),
        np.concatenate(steps).astype(np.float64),
    )
    a, b = number[one[:, 0], one[:, 1]], number[two[:, 0], two[:, 1]]
    values = picture.astype(np.float64).copy()
    trusted = np.ones(len(a))
    for _ in range(rounds):
        values[hole] = _solved(values, (one, two), (a, b), step, trusted, values[hole])
        error = np.linalg.norm(
            values[two[:, 0], two[:, 1]] - values[one[:, 0], one[:, 1]] - step, axis=1
        )
        trusted = 1 / (error + _EVEN)
    return values.astype(np.float32)


def _solved(
    values: FloatArray,
    pairs: tuple[IntArray, IntArray],
    numbers: tuple[IntArray, IntArray],
    step: FloatArray,
    trusted: FloatArray,
    start: FloatArray,
) -> FloatArray:
    """Solve for the colors (n, 3) of the hole's pixels by weighted least squares.

    `pairs` are the pixels (m, 2) of each difference, and `numbers` (m,) their indices in the hole
    or -1. `step` (m, 3) is the difference, `trusted` (m,) its weight, and `start` (n, 3) are the
    colors where nothing else is known.
    """
    from scipy.sparse import coo_matrix

    from a2v.geometry.mesh import factored

    a, b = numbers
    count = len(start)
    diagonal, right = np.full(count, _LOOSE), _LOOSE * start
    for own, other, far, sign in ((a, b, pairs[1], -1.0), (b, a, pairs[0], 1.0)):
        inside = own >= 0
        np.add.at(diagonal, own[inside], trusted[inside])
        rim = inside & (other < 0)
        known = values[far[rim, 0], far[rim, 1]]
        np.add.at(right, own[rim], trusted[rim, None] * known)
        np.add.at(right, own[inside], sign * trusted[inside, None] * step[inside])
    both = (a >= 0) & (b >= 0)
    rows = np.concatenate([np.arange(count), a[both], b[both]])
    columns = np.concatenate([np.arange(count), b[both], a[both]])
    entries = np.concatenate([diagonal, -trusted[both], -trusted[both]])
    system = coo_matrix((entries, (rows, columns)), shape=(count, count))
    return np.asarray(factored(system).solve(right))

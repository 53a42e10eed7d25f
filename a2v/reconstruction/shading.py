"""The shading that a photo holds, and the photo without it: a plain intrinsic decomposition over
the reconstructed surface.

Color is albedo times shading. The shading is one number a point: irradiance as a function of the
normal, spherical harmonics of second order (Ramamoorthi and Hanrahan, SIGGRAPH 2001), times a power
of how open the point lies. The albedo takes few values (Horn 1974; as Retinex and its followers
have it): the seen colors fall into `_STUFFS` groups, each of one albedo. Both are fitted by turns,
robustly. Colors keep their hue, since all three channels are divided by the same number.
"""

from __future__ import annotations

import numpy as np

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.images import nearest_known
from a2v.geometry.mesh import evened
from a2v.geometry.rays import RayScene, pixel_rays
from a2v.geometry.sampling import cosine_directions
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera

LIMITS = (0.6, 1.6)
"""Least and most shading that is taken out, against its mean of 1."""

_STUFFS = 6
"""Groups of colors that share an albedo."""
_TURNS = 8
"""How often groups and light are fitted by turns."""

_LIGHTNESS = 0.2
"""What lightness counts for beside hue where colors are grouped: a shaded side is the same
stuff."""

_STIFF = 0.02
"""How stiffly the light keeps to being even: a penalty on the squares of its harmonics, in units of
the mean squared error."""

_OPEN = 0.5
"""Power of the openness."""
_RAYS = 32
"""Rays by which it is found."""

_CLIPPED = 0.9
"""Luminance from which on the sensor is full: it says nothing about light."""
_DARK = 0.01
"""Luminance up to which the sensor sees noise."""

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_MAP = 512


def photo_without_shading(
    photo: FloatArray,
    camera: OrthographicCamera,
    vertices: FloatArray,
    faces: IntArray,
    normals: FloatArray,
    *,
    colors: FloatArray,
    seen: BoolArray,
) -> FloatArray:
    """A photo whose person looks as in even light of the same mean.

    Parameters
    ----------
    photo : (H, W, 3) float32
        sRGB in [0, 1].
    camera : OrthographicCamera
        Of the photo's pixels.
    vertices, faces, normals : (V, 3), (F, 3), (V, 3)
        The surface in the frame of `camera`; unit normals.
    colors : (V, 3)
        sRGB that the photo has at the vertices.
    seen : (V,) bool
        Which vertices it shows well.
    """
    shading = estimate_shading(
        normals,
        openness(vertices, faces, normals),
        colors,
        np.where(seen, np.maximum(normals[:, 2], 0), 0),
    )
    over = _over_photo(shading, camera, vertices, faces, (photo.shape[0], photo.shape[1]))
    linear = srgb_to_linear(photo)
    over = np.maximum(
        over, linear.max(axis=2)
    )  # nothing becomes brighter than white, in any channel
    return np.asarray(linear_to_srgb(linear / np.maximum(over, LIMITS[0])[..., None]), np.float32)


def openness(
    vertices: FloatArray, faces: IntArray, normals: FloatArray, *, rays: int = _RAYS
) -> FloatArray:
    """Share (V,) of even light from all around that reaches each vertex past the surface itself;
    `normals` (V, 3) are unit."""
    scene, generator = RayScene(vertices, faces), np.random.default_rng(0)
    start = (vertices + 0.004 * normals).astype(np.float32)
    free = np.zeros(len(vertices))
    for _ in range(rays):
        free += ~scene.occluded(start, cosine_directions(normals, generator))
    return evened(faces, free / rays, 2)


def estimate_shading(
    normals: FloatArray, free: FloatArray, colors: FloatArray, weight: FloatArray
) -> FloatArray:
    """How brightly each vertex is lit, (V,) float64 within `LIMITS` (with their mean over the seen
    ones 1 before limits).

    Parameters
    ----------
    normals : (V, 3)
        Unit.
    free : (V,)
        `openness`.
    colors : (V, 3)
        sRGB in [0, 1] of the photo.
    weight : (V,)
        How much of the photo each vertex stands for; 0 where the photo does not show it.
    """
    linear = srgb_to_linear(np.clip(colors, 0, 1))
    bright = linear @ _LUMINANCE
    told = np.flatnonzero((weight > 0) & (bright < _CLIPPED) & (bright > _DARK))
    shading = np.ones(len(normals))
    if len(told) < 20 * _STUFFS:
        return shading
    shape = _harmonics(normals) * (np.clip(free, 0.2, 1) ** _OPEN)[:, None]
    for _ in range(_TURNS):
        group = _grouped(linear_to_srgb(np.clip(linear[told] / shading[told, None], 0, 1)))
        albedo = np.array(
            [
                np.median(bright[told][group == one] / shading[told][group == one])
                for one in range(group.max() + 1)
            ]
        )
        ratio = bright[told] / albedo[group]
        ratio = np.clip(ratio / np.exp(np.average(np.log(ratio), weights=weight[told])), 0.1, 4)
        shading = np.clip(shape @ _fitted(shape[told], ratio, weight[told]), *LIMITS)
        shading /= np.average(shading, weights=weight)
    return np.clip(shading, *LIMITS)


def _harmonics(normals: FloatArray) -> FloatArray:
    """The nine real spherical harmonics up to second order, without their factors, (V, 9)."""
    x, y, z = normals.T
    return np.stack(
        [np.ones_like(x), x, y, z, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y], axis=1
    )


def _grouped(colors: FloatArray) -> IntArray:
    """Which of at most `_STUFFS` groups of like colors each of the sRGB colors (n, 3) belongs to,
    (n,), all of them used."""
    from scipy.cluster.vq import kmeans2
    from skimage.color import rgb2lab

    lab = np.round(rgb2lab(colors) * np.array([_LIGHTNESS, 1, 1]), 1)
    count = min(
        _STUFFS, len(np.unique(lab, axis=0))
    )  # it cannot make more groups than there are colors
    _, group = kmeans2(lab, count, minit="++", iter=20, seed=0)
    return np.asarray(np.unique(group, return_inverse=True)[1]).ravel()


def _fitted(shape: FloatArray, ratio: FloatArray, weight: FloatArray) -> FloatArray:
    """Coefficients (9,) with which `shape` (n, 9) gives `ratio` (n,): prints, beards and cast
    shadows count little (Cauchy's weights)."""
    even = np.zeros(shape.shape[1])
    even[0] = 1
    stiff = np.diag(np.where(even > 0, 1e-4, _STIFF))
    found, share = even, weight.astype(np.float64)
    for _ in range(8):
        square = (shape * share[:, None]).T @ shape / share.sum() + stiff
        found = np.linalg.solve(
            square, (shape * share[:, None]).T @ ratio / share.sum() + stiff @ even
        )
        off = np.abs(ratio - shape @ found)
        share = weight / (1 + (off / (1.5 * 1.48 * np.median(off) + 1e-4)) ** 2)
    return np.asarray(found)


def _over_photo(
    values: FloatArray,
    camera: OrthographicCamera,
    vertices: FloatArray,
    faces: IntArray,
    shape: tuple[int, int],
) -> FloatArray:
    """Values (V,) of vertices on the pixels of a photo of `shape`, (H, W) float32, where the camera
    sees them; carried on from there."""
    import cv2

    step = max(1.0, max(shape) / _MAP)
    rows, columns = (np.arange(max(1, round(side / step))) + 0.5 for side in shape)
    pixels = np.stack(np.meshgrid(columns * step, rows * step), axis=-1)
    far = float(np.abs(vertices[:, 2]).max()) + 1
    hits = RayScene(vertices, faces).cast(
        pixel_rays(camera, pixels.reshape(-1, 2), far), np.array([0, 0, -1], np.float32)
    )
    known = hits.hit.reshape(pixels.shape[:2])
    if not known.any():
        return np.ones(shape, np.float32)
    small = np.ones(known.shape, np.float32)
    small[known] = hits.interpolate(values[:, None], faces)[:, 0]
    small = small[nearest_known(known)]
    return np.asarray(
        cv2.resize(small, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR), np.float32
    )

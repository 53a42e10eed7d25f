"""Remove the shading from a photo: a simple intrinsic decomposition over the reconstructed surface.

Color is albedo times shading. The shading is one number per point: irradiance as a function of the
normal, spherical harmonics of second order (Ramamoorthi and Hanrahan, SIGGRAPH 2001), times a power
of the openness of the point (its ambient visibility). The albedo takes few values (Horn 1974;
Retinex): the visible colors fall into `_STUFFS` groups, each of one albedo. Both are fitted
alternately and robustly. Colors keep their hue, since all three channels are divided by the same
number.
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
"""Smallest and largest shading that is removed, relative to its mean of 1."""

_STUFFS = 6
"""Number of groups of colors that share an albedo."""
_TURNS = 8
"""Number of rounds in which groups and light are fitted alternately."""

_LIGHTNESS = 0.2
"""Weight of lightness relative to hue when colors are grouped: a shaded side is the same
material."""

_STIFF = 0.02
"""Penalty on the squared harmonics of the light, which keeps it even, in units of the mean squared
error."""

_OPEN = 0.5
"""Power of the openness."""
_RAYS = 32
"""Number of rays by which the openness is found."""

_CLIPPED = 0.9
"""Luminance above which the sensor is saturated."""
_DARK = 0.01
"""Luminance below which the sensor measures noise."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear RGB in the luminance."""
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
    """Relight the person of a photo with even light of the same mean.

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
        Vertices that the photo shows well.
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
    """Share (V,) of even light from all directions that reaches each vertex past the surface
    itself; `normals` (V, 3) are unit."""
    scene, generator = RayScene(vertices, faces), np.random.default_rng(0)
    start = (vertices + 0.004 * normals).astype(np.float32)
    free = np.zeros(len(vertices))
    for _ in range(rays):
        free += ~scene.occluded(start, cosine_directions(normals, generator))
    return evened(faces, free / rays, 2)


def estimate_shading(
    normals: FloatArray, free: FloatArray, colors: FloatArray, weight: FloatArray
) -> FloatArray:
    """Brightness (V,) float64 of the light on each vertex, within `LIMITS`; before the limits its
    mean over the visible vertices is 1.

    Parameters
    ----------
    normals : (V, 3)
        Unit.
    free : (V,)
        `openness`.
    colors : (V, 3)
        sRGB in [0, 1] of the photo.
    weight : (V,)
        Area of the photo that each vertex stands for; 0 for vertices that it does not show.
    """
    linear = srgb_to_linear(np.clip(colors, 0, 1))
    bright = linear @ LUMINANCE
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
    """Group (n,) of each sRGB color (n, 3): at most `_STUFFS` groups of similar colors, none
    empty."""
    from scipy.cluster.vq import kmeans2
    from skimage.color import rgb2lab

    lab = np.round(rgb2lab(colors) * np.array([_LIGHTNESS, 1, 1]), 1)
    count = min(_STUFFS, len(np.unique(lab, axis=0)))  # there cannot be more groups than colors
    _, group = kmeans2(lab, count, minit="++", iter=20, seed=0)
    return np.asarray(np.unique(group, return_inverse=True)[1]).ravel()


def _fitted(shape: FloatArray, ratio: FloatArray, weight: FloatArray) -> FloatArray:
    """Coefficients (9,) with which `shape` (n, 9) gives `ratio` (n,). Prints, beards and cast
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
    """Draw values (V,) of visible vertices on a photo of `shape`, (H, W) float32, and extend them
    to all pixels."""
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

"""Inputs of the networks, the same for a training view and a photo: one square frame, the guide's
maps, points.

The *frame* is a square of the photo around the person, whose longer side fills 0.9 of it. A `place`
is a position in the frame, -1 to 1, x to the right and y down. It is independent of the resolution
of a map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.geometry.images import contour_distance, nearest_known
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import RayScene, side_view, signed_distance_and_normals
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, OrthographicCamera

FRAME = 1024
"""Side of the frame, pixels: input of the fine level. The whole-person networks take half of it."""
GUIDE = 256
"""Side of the guide's maps, pixels."""
FILL = 0.9
"""The person's longer side as a fraction of the frame's side."""
REACH = 0.3
"""Distances to the mask are clipped at this, meters."""


@dataclass(frozen=True)
class Frame:
    """A square picture of the person and its camera.

    Attributes
    ----------
    image : (S, S, 3) uint8
        sRGB, gray outside of the photo.
    mask : (S, S) float32
        Opacity of the person in [0, 1].
    camera : OrthographicCamera
        Projects world points to pixels of `image`.
    """

    image: ByteArray
    mask: FloatArray
    camera: OrthographicCamera

    @property
    def size(self) -> int:
        """Side of the frame, pixels."""
        return int(self.mask.shape[0])


def frame_box(mask: FloatArray, fill: float = FILL) -> tuple[float, float, float]:
    """Return middle (u, v) and side of the square around the person in a mask (H, W), pixels.

    The person's longer side fills `fill` of the square.

    Raises
    ------
    InputError
        The mask is empty.
    """
    rows, columns = np.nonzero((mask > 0.5).any(axis=1))[0], np.nonzero((mask > 0.5).any(axis=0))[0]
    if not len(rows):
        raise InputError("the mask is empty; expected the person in it")
    low, high = np.array([columns[0], rows[0]]), np.array([columns[-1], rows[-1]]) + 1
    middle = (low + high) / 2
    return float(middle[0]), float(middle[1]), float((high - low).max()) / fill


def make_frame(
    image: ByteArray,
    mask: FloatArray,
    camera: OrthographicCamera,
    size: int = FRAME,
    *,
    fill: float = FILL,
) -> Frame:
    """Cut the square around the person out of a photo (H, W, 3) with its mask (H, W) and camera,
    and scale it to `size`."""
    import cv2

    u, v, side = frame_box(mask, fill)
    zoom = size / side
    matte = np.asarray(mask, np.float32)
    if zoom < 1:  # OpenCV's warp samples only four pixels
        image, matte = (cv2.GaussianBlur(x, (0, 0), 0.45 / zoom) for x in (image, matte))
    # pixel centers are at halves here and at integers in OpenCV
    shift = size / 2 - zoom * np.array([u, v]) + 0.5 * zoom - 0.5
    move = np.array([[zoom, 0, shift[0]], [0, zoom, shift[1]]])
    flags = cv2.INTER_LINEAR if zoom < 1 else cv2.INTER_CUBIC
    cut = cv2.warpAffine(
        image,
        move,
        (size, size),
        flags=flags,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(128, 128, 128),
    )
    opacity = cv2.warpAffine(
        matte, move, (size, size), flags=flags, borderMode=cv2.BORDER_CONSTANT, borderValue=0
    )
    moved = OrthographicCamera(
        scale=camera.scale * zoom,
        center_u=size / 2 + (camera.center_u - u) * zoom,
        center_v=size / 2 + (camera.center_v - v) * zoom,
    )
    return Frame(np.asarray(cut, np.uint8), np.clip(opacity, 0, 1), moved)


def photo_input(image: ByteArray, mask: FloatArray, size: int) -> FloatArray:
    """Return the photo's channels (4, size, size) float32: colors minus mid gray times the mask,
    and the mask."""
    import cv2

    opacity = np.asarray(mask, np.float32)
    values = np.concatenate(
        [(image.astype(np.float32) / 255 - 0.5) * opacity[..., None], opacity[..., None]], axis=-1
    )
    if values.shape[0] != size:
        values = cv2.resize(values, (size, size), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(values.transpose(2, 0, 1))


@dataclass(frozen=True)
class GuideMaps:
    """Front and back of a body on the frame's pixels, as the photo's camera sees them (the back
    through the body).

    Attributes
    ----------
    depth_front, depth_back : (H, W) float32
        z, meters; NaN outside the body.
    normals_front, normals_back : (H, W, 3) float32
        Unit normals in the camera's axes; 0 outside the body.
    """

    depth_front: FloatArray
    depth_back: FloatArray
    normals_front: FloatArray
    normals_back: FloatArray


class GuideMesh:
    """A closed body mesh, vertices (V, 3) meters and faces (F, 3), for distances of points and maps
    of pixels."""

    def __init__(self, vertices: FloatArray, faces: IntArray) -> None:
        self._vertices, self._faces = np.asarray(vertices, np.float32), np.asarray(faces)
        self._normals = vertex_normals(self._vertices, self._faces).astype(np.float32)
        self._rays = RayScene(self._vertices, self._faces)

    @property
    def mesh(self) -> tuple[FloatArray, IntArray]:
        """Vertices (V, 3) and faces (F, 3)."""
        return self._vertices, self._faces

    def at(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the signed distance (N,) to the body, meters, negative inside, and its unit normal
        (N, 3) at the nearest point."""
        return signed_distance_and_normals(
            self._vertices, self._faces, self._normals, self._rays, np.asarray(points, np.float32)
        )

    def maps(self, camera: OrthographicCamera, frame: int, size: int = GUIDE) -> GuideMaps:
        """Return its maps at `size` pixels for the camera of a frame of `frame` pixels."""
        front, back = (
            side_view(self._rays, self._normals, camera, frame, size, side) for side in (1, -1)
        )
        return GuideMaps(front.depth, back.depth, front.normals, back.normals)


def mask_distance(mask: FloatArray, pixels_per_meter: float) -> FloatArray:
    """Return the signed distance (H, W) to the contour of ``mask > 0.5``, meters, negative inside,
    clipped at `REACH`."""
    return np.clip(contour_distance(mask > 0.5) / pixels_per_meter, -REACH, REACH).astype(
        np.float32
    )


def guide_input(maps: GuideMaps, distance: FloatArray) -> FloatArray:
    """Return the guide's channels (10, H, W) float32: its maps, its mask, and `mask_distance`.

    Outside the body the maps are extended from the nearest pixel.
    """
    there: BoolArray = np.isfinite(maps.depth_front)
    if not there.any():
        raise InputError(
            "the body lies outside of the photo's frame; fit it to this photo first "
            "(a2v.body.fit_body)"
        )
    index = nearest_known(there)
    depth = np.stack([maps.depth_front, maps.depth_back])[:, index[0], index[1]]
    normals = np.concatenate([maps.normals_front, maps.normals_back], axis=-1)[
        index[0], index[1]
    ].transpose(2, 0, 1)
    channels: FloatArray = np.concatenate([normals, depth, there[None], distance[None]]).astype(
        np.float32
    )
    return channels


def place_of(points: FloatArray, camera: OrthographicCamera, frame: int) -> FloatArray:
    """Return the places (..., 2) float32, from -1 to 1, of points (..., 3) in a frame of `frame`
    pixels."""
    return np.asarray(camera.project(points) * (2 / frame) - 1, np.float32)

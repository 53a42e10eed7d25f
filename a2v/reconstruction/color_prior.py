"""What the unseen side may look like where no network says so: the front mirrored, and hair on the
back of the head."""

from __future__ import annotations

import warnings

import numpy as np

from a2v.geometry.images import nearest_known, sample_image
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.colored import ColoredMesh
from a2v.types import BoolArray, FloatArray, OrthographicCamera, Subject


def clean_colors(subject: Subject) -> FloatArray:
    """The person's own colors (H, W, 3) float32 in [0, 1], carried on beyond the silhouette: no
    background bleeds in.

    Foreground colors by multi-level estimation (Germer et al. 2020, pymatting) where the matte is
    trusted, the nearest such pixel elsewhere.
    """
    import cv2

    image, alpha = subject.image, np.asarray(subject.mask, np.float32)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numba remarks on its threading layer
        from pymatting import estimate_foreground_ml

        foreground = np.clip(
            estimate_foreground_ml(image.astype(np.float64) / 255, alpha.astype(np.float64)), 0, 1
        ).astype(np.float32)
    person = alpha > 0.5
    tall = float(np.ptp(np.nonzero(person)[0]) + 1)
    shrink = max(1.0, 0.003 * tall)
    depth = cv2.distanceTransform(person.astype(np.uint8), cv2.DIST_L2, 5)
    core = (depth > shrink) & (alpha > 0.9)
    if not core.any():
        core = person
    # fingers have no core: their middle is the best there is
    far = cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 5) > 3 * shrink
    core |= person & far
    index = nearest_known(core)
    spread = foreground[index[0], index[1]]
    soft = cv2.GaussianBlur(spread, (0, 0), shrink)
    return np.where(core[..., None], foreground, soft).astype(np.float32)


def head_box(
    subject: Subject, *, least: float = 0.3
) -> tuple[float, float, float, float, float] | None:
    """Left, top, right, chin and eye line of the head in the photo, pixels; None without a face's
    landmarks."""
    points = subject.keypoints
    eyes, mouth, sides = points[[2, 5]], points[[9, 10]], points[[7, 8]]
    if min(eyes[:, 2].min(), mouth[:, 2].min()) < least:
        return None
    eye_line = float(eyes[:, 1].mean())
    drop = float(mouth[:, 1].mean()) - eye_line
    # from the side, the face's landmarks are close together: its height is a safer ruler than its
    # width
    unit = max(drop, 0.5 * float(np.ptp(sides[:, 0])), 1.0)
    rows = np.nonzero(subject.mask.max(axis=1) > 0.5)[0]
    middle = float(np.concatenate([eyes, sides])[:, 0].mean())
    top = max(float(rows[0]) if len(rows) else 0.0, eye_line - 4.0 * unit)
    return middle - 2.0 * unit, top, middle + 2.0 * unit, eye_line + 2.1 * unit, eye_line


def seen_face(
    subject: Subject,
    pixels: FloatArray,
    colors: FloatArray,
    *,
    known: BoolArray,
    head: BoolArray | None,
) -> tuple[BoolArray, FloatArray | None]:
    """Which vertices (V,), at `pixels` (V, 2), lie in the photo's face, and the color (3,) of its
    cheeks (None where it shows none).

    `colors` (V, 3) are the photo's at the vertices, `known` (V,) those that it saw, `head` (V,)
    those of head and neck.
    """
    none, box = np.zeros(len(pixels), bool), head_box(subject)
    ahead = subject.keypoints_3d[0, 2] - subject.keypoints_3d[[7, 8], 2].mean()
    if box is None or ahead < 0:  # landmarks of a face are guessed on the back of a head, too
        return none, None
    left, _, right, chin, eye_line = box
    unit, across = (chin - eye_line) / 2.1, np.abs(pixels[:, 0] - (left + right) / 2)
    row = pixels[:, 1]
    face = known & (across < 1.4 * unit) & (row > eye_line - unit) & (row < chin + 0.1 * unit)
    face &= head if head is not None else True
    cheeks = face & (np.abs(row - eye_line - 0.65 * unit) < 0.35 * unit) & (across < unit)
    return face, np.median(colors[cheeks], axis=0) if cheeks.sum() >= 5 else None


def skin_of_hands(colors: FloatArray) -> FloatArray | None:
    """The skin's color (3,) by those of the hands (n, 3); None where they show too little, or
    gloves: people's skin is reddish to yellow."""
    if len(colors) < 40:
        return None
    color = np.median(colors, axis=0)
    _, a, b = _lab(color)
    return color if np.hypot(a, b) > 8 and 25 < np.degrees(np.arctan2(b, a)) < 80 else None


def mirrored_prior(
    mesh: ColoredMesh,
    *,
    known: BoolArray,
    clean: FloatArray,
    subject: Subject,
    camera: OrthographicCamera,
    head: BoolArray | None,
) -> FloatArray:
    """Prior colors (V, 3) for Eq. 14.

    The color that the photo has at the same place (the back of a jacket looks like its front), but
    no skin of the neckline below the collar. Behind the ears, what borders the head in the same row
    (hair, a hat) runs around it, down to the nape or as far as hair hangs beside the neck, so that
    no face looks backwards.

    Parameters
    ----------
    mesh : ColoredMesh
        In the frame of `camera`.
    known : (V,) bool
        Vertices whose colors the photo shows well.
    clean : (H, W, 3)
        `clean_colors(subject)`.
    head : (V,) bool, optional
        Vertices of head and neck; guessed from the landmarks where None.
    """
    import cv2

    vertices, normals, colors = mesh.vertices, mesh.normals, mesh.colors
    person = subject.mask > 0.5
    tall = float(np.ptp(np.nonzero(person)[0]) + 1)
    blur = max(0.8, 0.004 * tall)
    pixels, box = camera.project(vertices), head_box(subject)
    plain = sample_image(cv2.GaussianBlur(clean, (0, 0), blur), pixels)
    if box is None:
        return plain
    left, top, right, chin, eye_line = box
    unit, middle = (chin - eye_line) / 2.1, (left + right) / 2
    inside = (
        (pixels[:, 0] > left)
        & (pixels[:, 0] < right)
        & (pixels[:, 1] < chin + unit)
        & (pixels[:, 1] > top - 0.05 * tall)
    )
    inside &= pixels[:, 1] < chin if head is None else head
    cheeks = (
        inside
        & known
        & (np.abs(pixels[:, 1] - eye_line - 0.65 * unit) < 0.35 * unit)
        & (np.abs(pixels[:, 0] - middle) < unit)
    )
    crown = inside & known & (pixels[:, 1] < top + 0.28 * (eye_line - top))
    if crown.sum() < 5:
        return plain
    skin = np.median(colors[cheeks if cheeks.sum() >= 5 else crown], axis=0)
    look = _HeadLook(clean, person, box, skin=skin, typical=np.median(colors[crown], axis=0))

    row, across = pixels[:, 1], pixels[:, 0] - middle
    torso = sample_image(cv2.GaussianBlur(look.without_neckline(clean), (0, 0), blur), pixels)
    below = (
        smoothstep(row, look.collar - 0.3 * unit, look.collar)
        * (np.abs(across) < 3.5 * unit)
        * (row < chin + 8 * unit)
    )[:, None]
    prior = below * torso + (1 - below) * plain
    behind = _behind_ears(
        vertices, normals, inside, row, subject=subject, look=look, scale=camera.scale
    )
    # skin from the hairline to the collar, hair above or as far down as it hangs
    neck = behind * inside * smoothstep(-row, -look.collar, -(look.collar - 0.2 * unit))
    prior = prior + (neck * ~known)[:, None] * (0.92 * skin - prior)
    hanging = np.abs(across) < (1.9 * unit if look.hair_end > look.nape + 0.3 * unit else np.inf)
    hair = behind * (
        inside | (hanging & (vertices[:, 2] < np.median(vertices[inside, 2])) & (row > look.nape))
    )
    hair = (
        hair
        * hanging
        * smoothstep(-row, -(look.hair_end + 0.15 * unit), -(look.hair_end - 0.15 * unit))
    )
    return np.asarray(prior + (hair * ~known)[:, None] * (look.around(row, across) - prior))


def _behind_ears(
    vertices: FloatArray,
    normals: FloatArray,
    inside: BoolArray,
    row: FloatArray,
    *,
    subject: Subject,
    look: _HeadLook,
    scale: float,
) -> FloatArray:
    """How far (V,), 0 to 1, vertices lie behind the ears, in the direction in which the head looks.

    `inside` (V,) are the head's, `row` (V,) their pixel rows, `scale` the camera's pixels per
    meter.
    """
    angle = _head_azimuth(subject)
    where = vertices - np.median(vertices[inside], axis=0)
    ahead = (where[:, 0] * np.sin(angle) + where[:, 2] * np.cos(angle)) * scale / look.unit
    forehead = look.eye_line - look.top
    behind = np.maximum(
        smoothstep(-ahead, -0.6, 0.0),
        smoothstep(-row, -(look.eye_line - 0.3 * forehead), -(look.eye_line - 0.5 * forehead)),
    )
    # the neck is no sphere around the head's middle: there what faces backwards counts
    away = normals[:, 0] * np.sin(angle) + normals[:, 2] * np.cos(angle)
    low = smoothstep(row, look.nape - 0.2 * look.unit, look.nape + 0.2 * look.unit)
    return np.asarray((1 - low) * behind + low * smoothstep(-away, -0.3, 0.2))


_SHADE = np.array([0.5, 1.0, 1.0])
"""What lightness, a and b count for in comparisons of colors: shadows are no other stuff."""


class _HeadLook:
    """What the photo says of a head's unseen side: hair by rows, where it ends, where the collar
    is."""

    def __init__(
        self,
        clean: FloatArray,
        person: BoolArray,
        box: tuple[float, float, float, float, float],
        *,
        skin: FloatArray,
        typical: FloatArray,
    ) -> None:
        left, top, right, chin, eye_line = box
        self.top, self.eye_line = top, eye_line
        self.unit, self.middle, self.chin = (chin - eye_line) / 2.1, (left + right) / 2, chin
        self.nape = eye_line + 1.3 * self.unit
        self.skin = _lab(skin)
        self._lab = _lab(clean)
        height = len(person)
        self._centers, self._halves = _row_extents(person, left, right)
        first, last = max(0, int(top)), min(height - 1, int(self.nape))
        rows = np.arange(first, last + 1)
        sides = []
        for side in (-1, 1):
            column = self._centers[rows] + side * 0.82 * self._halves[rows]
            found = sample_image(clean, np.stack([column, rows + 0.5], axis=1)).astype(np.float64)
            bare = self._toward_skin(_lab(found), _lab(typical)) > 0.18
            sides.append(
                _filled_rows(np.where(bare[:, None], np.nan, found), typical, 0.12 * self.unit)
            )
        self._first, self._sides = first, sides
        self.hair = _lab(
            np.median(
                np.concatenate([side[: max(1, int(eye_line) - first)] for side in sides]), axis=0
            )
        )
        self.collar = self._collar(person)
        self.hair_end = self._hair_end(person)

    def _toward_skin(self, colors: FloatArray, hair: FloatArray) -> FloatArray:
        """Where CIELAB colors (..., 3) lie between `hair` (0) and the skin (1) by hue: glossy hair
        and striped hats are no skin."""
        hue = np.array([0.15, 1.0, 1.0])
        way = (self.skin - hair) * hue
        share: FloatArray = ((colors - hair) * hue) @ way / max(float(way @ way), 1e-6)
        return share

    @staticmethod
    def _nearer(colors: FloatArray, one: FloatArray, other: FloatArray) -> BoolArray:
        """Whether CIELAB colors (..., 3) are nearer to `one` than to `other`; shade counts
        half."""
        return np.asarray(
            np.linalg.norm((colors - one) * _SHADE, axis=-1)
            < np.linalg.norm((colors - other) * _SHADE, axis=-1)
        )

    def _window(self, row: int, low: float, high: float) -> FloatArray:
        """Colors of a row from `low` to `high` units beside the middle, both sides."""
        columns = np.arange(self._lab.shape[1])
        distance = np.abs(columns - self.middle) / self.unit
        found: FloatArray = self._lab[row, (distance >= low) & (distance <= high)]
        return found

    def _cloth(self) -> FloatArray | None:
        """Median color of the clothes below the neck; None where that is skin."""
        rows = range(int(self.chin + 1.5 * self.unit), int(self.chin + 3.5 * self.unit))
        found = [self._window(row, 1.0, 2.5) for row in rows if row < len(self._lab)]
        if not found:
            return None
        color: FloatArray = np.median(np.concatenate(found), axis=0)
        return None if np.linalg.norm((color - self.skin) * _SHADE) < 9 else color

    def _collar(self, person: BoolArray) -> float:
        """Row where the neck's sides turn from skin to clothes."""
        cloth = self._cloth()
        default = self.chin + 0.2 * self.unit
        if cloth is None:
            return default
        rows = np.arange(
            int(self.chin - 0.6 * self.unit), min(int(self.chin + 1.5 * self.unit), len(person))
        )
        for row in rows:
            edge = [int(self._centers[row] + side * 0.8 * self._halves[row]) for side in (-1, 1)]
            inner = self._lab[row, np.clip(edge, 0, self._lab.shape[1] - 1)]
            if (
                self._nearer(inner, cloth, self.skin).all()
                and not self._nearer(inner, self.hair, cloth).any()
            ):
                return float(row)
        return default

    def _hair_end(self, person: BoolArray) -> float:
        """Row down to which hair hangs beside the neck, at least the nape."""
        end = self.nape
        cloth = self._cloth()
        for row in range(int(self.nape), min(int(self.chin + 3 * self.unit), len(person))):
            columns = np.nonzero(person[row])[0]
            columns = columns[
                (np.abs(columns - self.middle) > 0.7 * self.unit)
                & (np.abs(columns - self.middle) < 2.2 * self.unit)
            ]
            colors = self._lab[row, columns]
            like = np.linalg.norm((colors - self.hair) * _SHADE, axis=-1) < 18
            like &= ~self._nearer(colors, self.skin, self.hair)
            if cloth is not None:
                like &= ~self._nearer(colors, cloth, self.hair)
            if like.sum() < 0.2 * self.unit:
                break
            end = float(row)
        return end if end > self.nape + 0.8 * self.unit else self.nape

    def around(self, row: FloatArray, across: FloatArray) -> FloatArray:
        """Colors (N, 3) at pixel rows (N,) and pixels beside the middle (N,): from the left
        border's to the right border's."""
        place = np.clip(row.astype(np.int64) - self._first, 0, len(self._sides[0]) - 1)
        half = self._halves[np.clip(row.astype(np.int64), 0, len(self._halves) - 1)]
        share = np.clip(0.5 + 0.6 * across / np.maximum(half, 1.0), 0, 1)[:, None]
        mixed: FloatArray = (1 - share) * self._sides[0][place] + share * self._sides[1][place]
        return mixed

    def without_neckline(self, clean: FloatArray) -> FloatArray:
        """The photo with skin and hair around the neckline replaced by the nearest clothes."""
        import cv2

        cloth = self._cloth()
        if cloth is None:
            return clean
        height, width = clean.shape[:2]
        top, bottom = (
            max(0, int(self.chin - self.unit)),
            min(height, int(self.chin + 8 * self.unit)),
        )
        low, high = (
            max(0, int(self.middle - 3.5 * self.unit)),
            min(width, int(self.middle + 3.5 * self.unit)),
        )
        part = self._lab[top:bottom, low:high]
        bare = self._nearer(part, self.skin, cloth) & (
            np.linalg.norm((part - self.skin) * _SHADE, axis=-1) < 22
        )
        if self.hair_end > self.nape:
            bare |= self._nearer(part, self.hair, cloth) & (
                np.linalg.norm((part - self.hair) * _SHADE, axis=-1) < 12
            )
        # lapels, ties and zips are the front's
        bare[
            : max(1, int(self.chin + 4 * self.unit) - top),
            np.abs(np.arange(low, high) - self.middle) < 1.1 * self.unit,
        ] = True
        bare[: max(1, int(self.collar) - top)] = True
        size = max(3, int(0.25 * self.unit) | 1)
        bare = cv2.dilate(
            bare.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
        ).astype(bool)
        if bare.all():
            return clean
        index = nearest_known(~bare)
        result = clean.copy()
        patch = clean[top:bottom, low:high][index[0], index[1]]
        blurred = cv2.GaussianBlur(patch, (0, 0), max(0.8, 0.25 * self.unit))
        result[top:bottom, low:high] = np.where(
            bare[..., None], blurred, clean[top:bottom, low:high]
        )
        return result


def _head_azimuth(subject: Subject) -> float:
    """Radians by which the head is turned towards the picture's right (+x); 0 where unknown."""
    nose, ears = subject.keypoints_3d[0], subject.keypoints_3d[[7, 8]].mean(axis=0)
    ahead = nose - ears
    return (
        float(np.arctan2(ahead[0], max(float(ahead[2]), 0.0))) if np.isfinite(ahead).all() else 0.0
    )


def _lab(colors: FloatArray) -> FloatArray:
    """CIELAB (..., 3) of sRGB in [0, 1] (..., 3)."""
    from skimage.color import rgb2lab

    lab: FloatArray = rgb2lab(np.clip(colors, 0, 1))
    return lab


def _filled_rows(values: FloatArray, fallback: FloatArray, width: float) -> FloatArray:
    """Rows (N, 3) with NaN rows taken from the nearest known ones, smoothed over `width` rows."""
    from scipy.ndimage import gaussian_filter1d

    known = np.nonzero(np.isfinite(values[:, 0]))[0]
    if len(known) == 0:
        return np.tile(fallback, (len(values), 1))
    near = known[np.abs(np.arange(len(values))[:, None] - known[None]).argmin(axis=1)]
    smooth: FloatArray = gaussian_filter1d(values[near], max(width, 0.5), axis=0, mode="nearest")
    return smooth


def _row_extents(person: BoolArray, left: float, right: float) -> tuple[FloatArray, FloatArray]:
    """Middle and half width of the head in each row of the mask, between the columns `left` and
    `right`, pixels."""
    low, high = max(0, int(left)), min(person.shape[1], int(right) + 1)
    window = person[:, low:high]
    first = window.argmax(axis=1) + low
    last = high - window[:, ::-1].argmax(axis=1)
    empty = ~window.any(axis=1)
    first[empty], last[empty] = int((left + right) / 2), int((left + right) / 2) + 1
    return (first + last) / 2, (last - first) / 2

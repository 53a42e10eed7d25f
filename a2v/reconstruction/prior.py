"""What the unseen side may look like where no network says so: the front mirrored, and hair on the back of the head."""

from __future__ import annotations

import warnings

import numpy as np

from a2v.types import BoolArray, ByteArray, FloatArray, OrthographicCamera, Subject


def clean_colors(subject: Subject) -> FloatArray:
    """The person's own colours (H, W, 3) float32 in [0, 1], carried on beyond the silhouette: no background bleeds in.

    Foreground colours by multi-level estimation (Germer et al. 2020, pymatting) where the matte is trusted, the nearest such pixel elsewhere.
    """
    import cv2
    from scipy.ndimage import distance_transform_edt

    image, alpha = subject.image, np.asarray(subject.mask, np.float32)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numba remarks on its threading layer
        from pymatting import estimate_foreground_ml

        foreground = np.clip(estimate_foreground_ml(image.astype(np.float64) / 255, alpha.astype(np.float64)), 0, 1).astype(np.float32)
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
    index = distance_transform_edt(~core, return_distances=False, return_indices=True)
    spread = foreground[index[0], index[1]]
    soft = cv2.GaussianBlur(spread, (0, 0), shrink)
    return np.where(core[..., None], foreground, soft).astype(np.float32)


def head_box(subject: Subject, *, least: float = 0.3) -> tuple[float, float, float, float, float] | None:
    """Left, top, right, chin and eye line of the head in the photo, pixels; None without a face's landmarks."""
    points = subject.keypoints
    eyes, mouth, sides = points[[2, 5]], points[[9, 10]], points[[7, 8]]
    if min(eyes[:, 2].min(), mouth[:, 2].min()) < least:
        return None
    eye_line = float(eyes[:, 1].mean())
    drop = float(mouth[:, 1].mean()) - eye_line
    # from the side, the face's landmarks are close together: its height is a safer ruler than its width
    unit = max(drop, 0.5 * float(np.ptp(sides[:, 0])), 1.0)
    rows = np.nonzero(subject.mask.max(axis=1) > 0.5)[0]
    middle = float(np.concatenate([eyes, sides])[:, 0].mean())
    top = max(float(rows[0]) if len(rows) else 0.0, eye_line - 4.0 * unit)
    return middle - 2.0 * unit, top, middle + 2.0 * unit, eye_line + 2.1 * unit, eye_line


def mirrored_prior(
    vertices: FloatArray,
    normals: FloatArray,
    colors: FloatArray,
    known: BoolArray,
    clean: FloatArray,
    subject: Subject,
    camera: OrthographicCamera,
    head: BoolArray | None,
) -> FloatArray:
    """Prior colours (V, 3) for Eq. 14.

    The colour that the photo has at the same place (the back of a jacket looks like its front); on the head, whatever lies on the crown
    (hair, a hat, or a bald scalp), so that no face looks backwards.

    Parameters
    ----------
    colors, known
        Colours of the vertices that the photo saw for certain.
    clean : (H, W, 3)
        `clean_colors(subject)`.
    head : (V,) bool, optional
        Vertices of the head; guessed from the landmarks where None.
    """
    import cv2

    person = subject.mask > 0.5
    tall = float(np.ptp(np.nonzero(person)[0]) + 1)
    prior = sample_image(cv2.GaussianBlur(clean, (0, 0), max(0.8, 0.004 * tall)), camera.project(vertices))
    box = head_box(subject)
    if box is None:
        return prior
    left, top, right, chin, eye_line = box
    unit = (chin - eye_line) / 2.1
    pixels = camera.project(vertices)
    inside = (pixels[:, 0] > left) & (pixels[:, 0] < right) & (pixels[:, 1] < chin) & (pixels[:, 1] > top - 0.05 * tall)
    if head is not None:
        inside &= head
    middle = (left + right) / 2
    crown = inside & known & (pixels[:, 1] < top + 0.28 * (eye_line - top))
    cheeks = (
        inside & known & (np.abs(pixels[:, 0] - middle) < unit) & (pixels[:, 1] > eye_line + 0.3 * unit) & (pixels[:, 1] < eye_line + unit)
    )
    if crown.sum() < 5:
        return prior
    typical = np.median(colors[crown], axis=0)
    skin = np.median(colors[cheeks], axis=0) if cheeks.sum() >= 5 else typical
    hinge = float(np.percentile(vertices[inside, 2], 60))
    nape = eye_line + 1.3 * unit
    behind = inside & ~known & ((vertices[:, 2] < hinge) | (pixels[:, 1] < eye_line - 0.4 * (eye_line - top)))

    # Neck below the hair: skin where the front shows the mouth and the chin, else the mirrored collar.
    neck = np.nonzero(behind & (pixels[:, 1] >= nape) & (np.abs(pixels[:, 0] - middle) < 1.5 * unit))[0]
    prior[neck] = 0.92 * skin
    # The crown's texture, stretched down to the nape: strands, or the stripes of a hat.
    target = np.nonzero(behind & (pixels[:, 1] < nape))[0]
    if len(target):
        row = np.clip(pixels[target, 1], top, nape)
        source_row = top + (row - top) * 0.42 * (eye_line - top) / max(nape - top, 1.0)
        centers, halves = _row_extents(person, left, right)
        place, source = (np.clip(r.astype(int), 0, len(centers) - 1) for r in (row, source_row))
        across = (pixels[target, 0] - centers[place]) / np.maximum(halves[place], 1.0)
        column = centers[source] + np.clip(across, -0.85, 0.85) * halves[source]
        soft = cv2.GaussianBlur(clean, (0, 0), max(0.6, 0.0015 * tall))
        found = sample_image(soft, np.stack([column, source_row], axis=1))
        # a forehead is no hair
        bare = np.linalg.norm(found - skin, axis=1) < np.linalg.norm(found - typical, axis=1)
        prior[target] = np.where(bare[:, None], typical, found)
    return prior


def _row_extents(person: BoolArray, left: float, right: float) -> tuple[FloatArray, FloatArray]:
    """Middle and half width of the head in each row of the mask, between the columns `left` and `right`, pixels."""
    low, high = max(0, int(left)), min(person.shape[1], int(right) + 1)
    window = person[:, low:high]
    first = window.argmax(axis=1) + low
    last = high - window[:, ::-1].argmax(axis=1)
    empty = ~window.any(axis=1)
    first[empty], last[empty] = int((left + right) / 2), int((left + right) / 2) + 1
    return (first + last) / 2, (last - first) / 2


def sample_image(image: FloatArray | ByteArray, pixels: FloatArray) -> FloatArray:
    """Bicubic colours (N, C) float32 at pixel positions (N, 2) (centre of the first pixel at 0.5, 0.5); the border is carried on."""
    import cv2

    u = np.ascontiguousarray(pixels[:, 0] - 0.5, np.float32)[None]
    v = np.ascontiguousarray(pixels[:, 1] - 0.5, np.float32)[None]
    step = 30_000  # OpenCV's remap takes at most 32767 columns
    out = [
        cv2.remap(image, u[:, i : i + step], v[:, i : i + step], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)[0]
        for i in range(0, u.shape[1], step)
    ]
    return np.concatenate(out) if out else np.zeros((0, image.shape[2]), np.float32)

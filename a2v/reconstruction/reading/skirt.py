"""Find skirts, dresses and long coats with a small network that sees a chart of the legs.

`scripts/fit_skirts.py` trains it on the studio's people, who get drawn skirts and coats. Its card
is in a2v/weights/README.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.reconstruction.reading.hanging import BENT, hangs_between_legs, hips_bent
from a2v.reconstruction.reading.hem import (
    flares,
    line_between_legs,
    rest_height,
    skirt_hem,
)
from a2v.reconstruction.reading.legs_chart import ALONG, leg_joints, legs_chart
from a2v.sessions import WEIGHTS, open_session, read_metadata
from a2v.types import Body, Camera, FloatArray, Subject, Surface

FORMAT = "a2v-skirts/1"
FILE = WEIGHTS / "person_skirts.onnx"
_SURE = (0.45, 0.62)
"""Probabilities below and above which the network decides; between them the rules do."""
_FIRST = 0.1
"""Place on the legs, as in `ALONG`, above which cloth is not looked at: it is the trunk's."""


@dataclass(frozen=True)
class SkirtSeen:
    """What the network says about a photo.

    Attributes
    ----------
    probability : float
        That the person wears a skirt, a dress or a coat that hangs between the legs.
    hem : float
        Its lower end on the legs: 0 at the hip, 1 at the knee, 2 at the ankle.
    """

    probability: float
    hem: float


def find_skirt(
    surface: Surface, subject: Subject, body: Body, camera: Camera
) -> tuple[bool, tuple[float, float] | None]:
    """Decide whether there is a skirt, a dress or a long coat on a reconstructed `surface`.

    Standing people: the network decides if it is sure. Otherwise, and for people who sit or squat,
    of whom it has seen few, the rules do: `skirt_hem` and `hangs_between_legs`. A line between both
    legs down to the hem excludes a skirt, unless it flares.

    Returns
    -------
    found : bool
    hem : (float, float) or None
        Height of the hem at rest, meters, and of its lowest point. None if it is to be found where
        the surface steps back to the legs.
    """
    seen, stands = look_for_skirt(subject, body, camera), hips_bent(body) <= BENT
    if stands and seen.probability < _SURE[0]:
        return False, None
    hem = skirt_hem(subject, body, camera)
    hangs = hem is None and hangs_between_legs(surface, body, subject, camera)
    if not (hangs or hem is not None or (stands and seen.probability > _SURE[1])):
        return False, None
    end = hem[0] if hem is not None else rest_height(body, seen.hem)
    line = (stands or hem is not None) and line_between_legs(subject, body, camera, end)
    if line and not flares(subject, body, camera, end):  # of trousers, and no fold
        return False, None
    if hem is None and not hangs:
        hem = end, end
    return True, hem


def look_for_skirt(
    subject: Subject, body: Body, camera: Camera, *, weights: Path = FILE
) -> SkirtSeen:
    """Predict whether there is a skirt: the mean over the photo and its mirror image.

    Raises
    ------
    InputError
        The file is not a network of skirts.
    """
    chart = legs_chart(subject.image, subject.mask, leg_joints(body, camera))
    return skirt_in_chart(chart, weights=weights)


def skirt_in_chart(chart: FloatArray, *, weights: Path = FILE) -> SkirtSeen:
    """Predict the same from a chart (6, 96, 96) of `legs_chart`."""
    read_metadata(weights, (FORMAT,), "network of skirts")
    whole, rows = open_session(weights).run(
        ["whole", "rows"], {"chart": np.stack([chart, chart[:, :, ::-1]]).astype(np.float32)}
    )
    return SkirtSeen(float(whole.mean()), _end(rows.mean(axis=0)))


def _end(cloth: FloatArray) -> float:
    """Place in terms of `ALONG` down to which there is cloth, by its probability (n,) at n places:
    most cloth above it, and least below."""
    places = ALONG.reshape(len(cloth), -1).mean(axis=1)
    more = np.where(places > _FIRST, cloth - 0.5, 0.01)
    last = int(np.cumsum(more).argmax())
    if last + 1 == len(cloth):
        return float(places[last])
    share = np.clip(more[last] / max(more[last] - more[last + 1], 1e-9), 0.0, 1.0)
    return float(places[last] + share * (places[last + 1] - places[last]))

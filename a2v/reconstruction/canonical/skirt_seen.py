"""Find skirts, dresses and long coats with a small network that sees a chart of the legs.

`scripts/fit_skirts.py` trains it on the studio's people, who get drawn skirts and coats. Its card
is in a2v/weights/README.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.reconstruction.canonical.legs_chart import ALONG, leg_joints, legs_chart
from a2v.sessions import WEIGHTS, open_session, read_metadata
from a2v.types import Body, Camera, FloatArray, Subject

FORMAT = "a2v-skirts/1"
FILE = WEIGHTS / "person_skirts.onnx"


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
    hem = ALONG[0] + rows.mean(axis=0).sum() * (ALONG[-1] - ALONG[0]) / rows.shape[1]
    return SkirtSeen(float(whole.mean()), float(hem))

"""Update the outline of the fitted body while a user corrects a photo.

An update takes about a second after each change.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.kinematics.names import LANDMARK_INDEX, LIMB_BONES
from a2v.perception import Corrections
from pipelines.requests.video import photo_parameters
from pipelines.serve.talk import CORRECTIONS, ORIGINAL

if TYPE_CHECKING:
    from a2v.body import FitResult
    from a2v.types import FloatArray, Subject

ROUNDS = 1
"""Silhouette rounds of a quick fit, which starts from the previous fit."""
SIDE = 384
"""Longer side of the raster of an outline, in pixels."""
_FINE = 0.6
"""Largest distance between polygon and outline, in pixels of the raster."""


@dataclass(eq=False)
class Bench:
    """A photo that is being corrected.

    Attributes
    ----------
    base : Subject
        The subject without corrected landmarks and limbs.
    fit : FitResult
        The latest fit.
    """

    base: Subject
    fit: FitResult


_benches: dict[str, Bench] = {}
"""The photo that this process fitted last, by its folder and saved corrections."""


def saved(folder: Path) -> str | None:
    """Return the path of a photo's saved corrections, None if there are none."""
    path = folder / CORRECTIONS
    return str(path) if path.is_file() else None


def outline(task: Mapping[str, Any]) -> dict[str, object]:
    """Return the outline of the body with the "corrections" of a task.

    The first call for a photo runs the complete fit, which the store keeps for a later video.


    Returns
    -------
    dict
        "outline": polygons, "landmarks": without the task's corrections, (u, v,
        confidence), all in fractions of the photo; "sides" of the limbs in the fit, "camera",
        "limb_errors" and "second_photo" of the residuals, "seconds".
    """
    from a2v.body import FitSettings, fit_body
    from a2v.perception import corrected

    folder, begun = Path(task["folder"]), time.monotonic()
    wanted = Corrections.of(task["corrections"])
    path = saved(folder)
    key = f"{folder} {'' if path is None else Path(path).read_text(encoding='utf-8')}"
    bench = _benches.get(key)
    if bench is None:
        _benches.clear()
        bench = _benches[key] = _begin(folder, path, task["cache"])
    else:
        subject = corrected(bench.base, wanted)
        quick = fit_body(subject, settings=FitSettings(rounds=ROUNDS), initial=bench.fit)
        kept = {
            name: bench.fit.residuals[name]
            for name in ("limb_errors", "second_photo")
            if name in bench.fit.residuals
        }
        bench.fit = dataclasses.replace(quick, residuals={**quick.residuals, **kept})
    told = {
        name: bench.fit.residuals.get(name) for name in ("camera", "limb_errors", "second_photo")
    }
    landmarks = _in_photo(bench.base, bench.base.keypoints[:, :2])
    points = [
        [*place, round(float(sure), 3)]
        for place, sure in zip(landmarks, bench.base.keypoints[:, 2], strict=True)
    ]
    return {
        "outline": polygons(bench.base, bench.fit),
        "landmarks": points,
        "sides": _sides(bench.fit),
        **told,
        "seconds": round(time.monotonic() - begun, 2),
    }


def _begin(folder: Path, path: str | None, cache: str | None) -> Bench:
    """Return the complete fit with the saved corrections, and the subject.

    The subject lacks the corrections that `outline` applies.
    """
    from a2v.body import FitResult
    from a2v.types import Body, PhotoCamera, Subject
    from pipelines.engine.store import Store
    from pipelines.run import run

    store = Store(cache)
    parameters = photo_parameters(store, folder / ORIGINAL, corrections=path)
    fitted = run("photo_body", executor="serial", store=store, **parameters)
    own = parameters["corrections"]
    plain = parameters | {"corrections": dataclasses.replace(own, landmarks=(), limbs=())}
    base = run("subject", executor="serial", store=store, **plain).get("subject", Subject)
    residuals = fitted.nodes["photo_body"].measures
    fit = FitResult(
        fitted.get("photo_body", Body), fitted.get("photo_camera", PhotoCamera), residuals
    )
    return Bench(base, fit)


def polygons(subject: Subject, fit: FitResult) -> list[list[list[float]]]:
    """Return the outline of a fitted body as polygons in fractions of the photo."""
    import cv2

    from a2v.body.silhouette import rasterize

    height, width = subject.mask.shape
    step = max(height, width) / SIDE
    shape = (round(height / step), round(width / step))
    inside = rasterize(
        fit.camera.flatten(fit.body.vertices), fit.body.faces, fit.camera.flat, shape, step=step
    )["mask"]
    found, _ = cv2.findContours(inside.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    lines = [cv2.approxPolyDP(one, _FINE, True)[:, 0] for one in found if len(one) > 8]
    return [_in_photo(subject, (line + 0.5) * step) for line in lines]


def _in_photo(subject: Subject, points: FloatArray) -> list[list[float]]:
    """Convert pixels (n, 2) of a subject's image to fractions of the photo."""
    left, top, right, bottom = subject.crop
    height, width = subject.mask.shape
    scale = np.array([(right - left) / width, (bottom - top) / height])
    places = (points * scale + [left, top]) / np.array(subject.photo_size)
    return [[round(float(u), 4), round(float(v), 4)] for u, v in places]


def _sides(fit: FitResult) -> dict[str, str]:
    """Return for each limb whether its far end lies in "front" or "back" of its near end."""
    import torch

    from a2v.body import load_body_model

    model = load_body_model()
    with torch.no_grad():
        state = model.forward(
            *(
                torch.from_numpy(fit.body.parameters[name])
                for name in ("rotations", "shape", "translation")
            )
        )
        depth = model.landmarks(state)[:, 2].numpy()
    ends = {
        name: [depth[LANDMARK_INDEX[joint]] for joint in joints[:2]]
        for name, joints in LIMB_BONES.items()
    }
    return {name: "front" if far > near else "back" for name, (near, far) in ends.items()}

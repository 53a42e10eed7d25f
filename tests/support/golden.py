"""The golden panel: eight people, and what the pipeline makes of their photos in small.

`python scripts/make_golden.py` makes the stored figures anew. They guard photo to character as a
whole. Their tolerances let the back of a person be matched anew, which any flipped label causes.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image

from a2v.body.parts import PARTS
from a2v.lab.evaluation.moved.cases import MovedCase, open_moved_case
from a2v.lab.evaluation.moved.measures import (
    MovedSettings,
    TrueLook,
    color_scores,
    move,
    outer_faces,
)
from a2v.lab.evaluation.moved.panels import MOVED_PANELS
from a2v.reconstruction.palettes import lab_of
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.samples.ready import PHOTO
from a2v.types import Body, Character, FloatArray, PhotoCamera, Subject, Surface
from pipelines.engine.store import Store
from pipelines.requests.video import photo_parameters
from pipelines.run import run

FILE = Path(__file__).resolve().parents[1] / "reconstruction" / "golden.npz"
PHOTOS: Mapping[str, str] = {
    "sample": "",
    "ryota": "photos/PIFu_ryota.png",
    "tfjs_pose": "photos/tfjs_pose.jpg",
    "skier": "photos/mmpose_coco_000000000785.jpg",
}
"""Photographs by name; below the folder of real data."""
STUDIO: Mapping[str, int] = {"long_hair": 40000, "walk": 40007, "crossed": 40011, "feet": 40019}
"""Photos of the studio by name: their numbers in `MOVED_PANELS`."""
PEOPLE = (*PHOTOS, *STUDIO)
TOLERANCES: Mapping[str, float] = {
    "labels": 0.03,
    "visible": 5.0,
    "hidden": 8.0,
    "size": 0.005,
    "whole": 3.0,
    "head": 6.0,
    "other": 1.0,
}
"""Largest differences: of shares of labels, of mean colors of parts (CIELAB) where the photo shows
them and where not, of width, height and depth at rest (meters), the mean over the blocks of a
picture (of 255), and of the share of the surface with another part's color (%). Between two
processors the mean color of a visible part differs by up to 3.7."""
_SIDE = 64
_FEW = 40
"""Smallest number of vertices of a part whose mean color is compared."""


def figures_of(name: str, data: Path | None, store: Store, folder: Path) -> dict[str, np.ndarray]:
    """Make the character of a photo, and its figures. Photos of the studio are made in `folder`."""
    case = None
    photo = PHOTO if name == "sample" else Path()
    if name != "sample":
        assert data is not None
        if name in STUDIO:
            case = _case(name, data)
            photo = folder / f"{name}.png"
            Image.fromarray(case.image).save(photo)
        else:
            photo = data / PHOTOS[name]
    targets = ["subject", "photo_camera", "body", "character", "colored_surface"]
    made = run(targets, store=store, executor="serial", **photo_parameters(store, photo))
    surface = made.get("colored_surface", Surface)
    found = _figures(surface) | {"notes": np.array(json.dumps(list(made.notes)))}
    if case is not None:
        character = made.get("character", Character)
        found["other"] = np.array(
            _other(
                case,
                character,
                made.get("body", Body),
                made.get("photo_camera", PhotoCamera),
                made.get("subject", Subject),
            )
        )
    return found


def _case(name: str, data: Path) -> MovedCase:
    pins = {pin.index: pin for pin in MOVED_PANELS["development"]}
    return open_moved_case(pins[STUDIO[name]], data)


def _other(
    case: MovedCase, character: Character, body: Body, camera: PhotoCamera, subject: Subject
) -> float:
    settings = MovedSettings()
    moved = move(case, character, body, camera, subject, settings, 1)
    made, true = moved.surface(0), TrueLook.of(case, 0, settings)
    return color_scores(true, made, outer_faces(made), settings)["other"]


def _figures(surface: Surface) -> dict[str, np.ndarray]:
    assert surface.standing is not None
    assert surface.visible is not None
    parts, rest = np.asarray(surface.standing.parts), surface.standing.vertices
    lab = lab_of(surface.colors)
    shares = surface.provenance["synthesis"]
    head = parts == PARTS.index("head")
    return {
        "labels": np.array([shares[kind] for kind in shares]),
        "visible": _means(lab, parts, surface.visible),
        "hidden": _means(lab, parts, ~surface.visible),
        "size": np.ptp(rest, axis=0),
        "whole": _pictures(surface, np.ones(len(parts), bool), (0, 90, 180, 270)),
        "head": _pictures(surface, head, (0, 90, 180)),
    }


def _means(lab: FloatArray, parts: np.ndarray, chosen: np.ndarray) -> FloatArray:
    """Mean colors (P, 3) of the parts over the chosen vertices; NaN for parts with few."""
    result = np.full((len(PARTS), 3), np.nan)
    for part in range(len(PARTS)):
        own = chosen & (parts == part)
        if own.sum() >= _FEW:
            result[part] = lab[own].mean(axis=0)
    return result


def _pictures(surface: Surface, framed: np.ndarray, turns: tuple[int, ...]) -> np.ndarray:
    """Pictures (n, side, side, 3) of the character at rest around the framed vertices."""
    assert surface.standing is not None
    rest = surface.standing.vertices
    low, high = rest[framed].min(axis=0), rest[framed].max(axis=0)
    still = dataclasses.replace(surface, vertices=rest, face=None)
    return np.stack(
        [
            preview_surface(
                still,
                azimuth=float(turn),
                size=_SIDE,
                center=(low + high) / 2,
                extent=1.1 * float((high - low).max()),
                style=PreviewStyle(shaded=False),
            )
            for turn in turns
        ]
    )


def _blocks(pictures: np.ndarray) -> FloatArray:
    """Means (n, 4, 4, 3) of blocks of pictures: stripes of a hat may lie elsewhere."""
    count, side = len(pictures), _SIDE // 4
    return np.asarray(pictures.reshape(count, 4, side, 4, side, 3).astype(float).mean(axis=(2, 4)))


def differences(found: Mapping[str, np.ndarray], stored: Mapping[str, np.ndarray]) -> list[str]:
    """Return in words what differs by more than `TOLERANCES`."""
    wrong = []
    for name, most in TOLERANCES.items():
        if name not in stored:
            continue
        away = np.abs(np.asarray(found[name], float) - np.asarray(stored[name], float))
        if name in ("whole", "head"):
            away = np.abs(_blocks(found[name]) - _blocks(stored[name])).mean(axis=(1, 2, 3))
        elif name in ("visible", "hidden"):
            away = np.linalg.norm(away, axis=-1)
            away = away[np.isfinite(away)]
        if away.max(initial=0.0) > most:
            wrong.append(f"{name}: {away.max():.3f}, at most {most} expected")
    if str(found["notes"]) != str(stored["notes"]):
        wrong.append(f"notes: {found['notes']}, expected {stored['notes']}")
    return wrong


def stored_figures() -> dict[str, dict[str, np.ndarray]]:
    """Return the stored figures by person and name."""
    result: dict[str, dict[str, np.ndarray]] = {name: {} for name in PEOPLE}
    with np.load(FILE) as file:
        for key in file.files:
            person, _, name = key.partition(".")
            result[person][name] = file[key]
    return result

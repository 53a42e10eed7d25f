"""Estimate progress and remaining time of a job.

The estimate uses the updates of its nodes, and the time that they took on this machine earlier.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Mapping
from pathlib import Path

from a2v.errors import A2VError
from a2v.io import atomic_path, read_bytes
from pipelines.engine.progress import Update

STILL = (
    "subject",
    "photo_body",
    "surface",
    "body",
    "colored_surface",
    "character",
    "engine_character",
)
"""Nodes from a photo to a character, whose results are cached for the next video."""

PRIOR: Mapping[str, float] = {
    "subject": 3.0,
    "photo_body": 20.0,
    "surface": 15.0,
    "body": 20.0,
    "colored_surface": 10.0,
    "character": 6.0,
    "motion": 0.3,
    "poses": 0.3,
    "engine_character": 3.0,
    "glb": 0.5,
    "bvh": 0.2,
    "vertices": 0.15,
    "frame": 0.5,
    "video": 0.5,
    "clip": 0.5,
}
"""Seconds per node on two cores, used until a time is measured on this machine.

`vertices` is per frame, `frame` per image of `PIXELS` samples.
"""
PIXELS = 256 * 256 * 8
_NAMES: Mapping[str, str] = {
    "subject": "Finding the person",
    "photo_body": "Fitting a body",
    "surface": "Building the surface",
    "body": "Fitting the body closely",
    "colored_surface": "Coloring the unseen sides",
    "shaded_surface": "Coloring the unseen sides",
    "character": "Tying skin to bones",
    "motion": "Making the motion",
    "frame_settings": "Trying the renderer",
    "camera": "Placing the cameras",
    "pose": "Moving the bones",
    "props": "Moving the bones",
    "poses": "Moving the bones",
    "vertices": "Moving the skin",
    "frame": "Rendering",
    "video": "Encoding",
    "clip": "Encoding",
    "engine_character": "Writing the character",
    "glb": "Writing the character",
    "bvh": "Writing the motion",
}


class Clock:
    """Turns updates of nodes into progress and remaining time.

    Parameters
    ----------
    frames, pictures, samples : frames of motion, images of all views, samples per image
    known : whether the character is expected to be cached
    measured : seconds by node, as in `PRIOR`
    """

    def __init__(
        self,
        *,
        frames: int,
        pictures: int,
        samples: int,
        known: bool,
        measured: Mapping[str, float],
    ) -> None:
        self._units = {"vertices": float(frames), "frame": pictures * samples / PIXELS}
        each = {**PRIOR, **{name: seconds for name, seconds in measured.items() if name in PRIOR}}
        self._whole = {
            name: seconds * self._units.get(name, 1.0) * (not (known and name in STILL))
            for name, seconds in each.items()
        }
        self._left = dict(self._whole)
        self._begun: dict[str, tuple[float, int]] = {}
        self._first: dict[str, tuple[float, int]] = {}
        self._start = time.monotonic()
        self.best = 0.0

    def take(self, update: Update) -> dict[str, object]:
        """Return stage in words, completed fraction, and seconds left after an update."""
        now, name = time.monotonic(), update.node
        begun = self._begun.setdefault(name, (now, update.done))
        whole = self._whole.get(name, 0.0)
        if update.total and update.done >= update.total:
            self._left[name] = 0.0
        elif update.done > begun[1] + 1:  # the first unit includes loading and setup
            first = self._first.setdefault(name, (now, update.done))
            rate = (
                (now - first[0]) / (update.done - first[1])
                if update.done > first[1]
                else whole / update.total
            )
            self._left[name] = (update.total - update.done) * rate
        elif update.total == 1 and update.part > 0.05:
            self._left[name] = (now - begun[0]) / update.part * (1 - update.part)
        else:
            self._left[name] = max(whole - (now - begun[0]), 0.1 * whole)
        left = sum(self._left.values())
        spent = now - self._start
        self.best = max(self.best, spent / max(spent + left, 1e-6))
        stage = _NAMES.get(name, name)
        if update.total > 1:
            stage = f"{stage} {update.done} of {update.total}"
        return {"stage": stage, "share": round(self.best, 4), "left": round(left, 1)}

    def measured(self, seconds: Mapping[str, float]) -> dict[str, float]:
        """Convert seconds per node to seconds per unit."""
        return {
            name: value / max(self._units.get(name, 1.0), 1e-6)
            for name, value in seconds.items()
            if name in PRIOR
        }


class Times:
    """The measured times of the stages on this machine, in a file of `folder`."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "times.json"

    def read(self) -> dict[str, float]:
        """Return seconds per unit by node; empty without a readable file."""
        with contextlib.suppress(Exception):
            found = json.loads(read_bytes(self._path, limit=1 << 16))
            return {str(name): float(value) for name, value in found.items()}
        return {}

    def learn(self, seconds: Mapping[str, float]) -> None:
        """Mix new times into the file; on a full disk the earlier ones stay."""
        known = self.read()
        mixed = known | {
            name: (value + known.get(name, value)) / 2 for name, value in seconds.items()
        }
        with contextlib.suppress(A2VError), atomic_path(self._path) as temporary:
            temporary.write_text(
                json.dumps({name: round(value, 4) for name, value in mixed.items()}),
                encoding="utf-8",
            )

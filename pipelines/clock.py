"""Estimate progress and remaining time of a run.

The estimate uses the updates of its nodes, and the time that they took on this machine earlier.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping
from typing import Any

from pipelines.engine.progress import Steady, Update
from pipelines.stages import WORDS

STILL = (
    "subject",
    "photo_body",
    "surface",
    "body",
    "reading",
    "surface_with_hands",
    "face_draft",
    "color_draft",
    "surface_with_face",
    "colored_surface",
    "shaded_surface",
    "character",
    "engine_character",
)
"""Nodes from a photo to a character, whose results are cached for the next video."""

PRIOR: Mapping[str, float] = {
    "subject": 5.0,
    "photo_body": 5.0,
    "surface": 14.0,
    "body": 3.0,
    "reading": 1.0,
    "face_draft": 3.0,
    "color_draft": 7.0,
    "surface_with_face": 0.5,
    "colored_surface": 0.5,
    "shaded_surface": 3.0,
    "character": 0.2,
    "motion": 0.3,
    "recorded_motion": 0.3,
    "poses": 0.4,
    "engine_character": 1.6,
    "glb": 0.5,
    "bvh": 0.3,
    "camera": 3.0,
    "vertices": 0.04,
    "frame": 0.04,
    "photo_frame": 0.2,
    "video": 4.0,
    "clip": 1.0,
    "each_fit": 5.0,
    "joint_fit": 5.0,
    "each_surface": 14.0,
}
"""Seconds per call of a node on two cores, used until a time is measured on this machine.

`frame` is per image of `PIXELS` samples; those of `LONG_FILM` are for `FILM_FRAMES` frames.
"""
RARE = ("recorded_motion", "photo_frame", "each_fit", "joint_fit", "each_surface")
"""Nodes that most videos do not have."""
LONG_FILM = ("camera", "video", "clip")
FILM_FRAMES = 150
PIXELS = 256 * 256 * 8
CAUTION = 1.5
"""Factor of `PRIOR` before anything is measured: an estimate may fall, but it should not rise."""
CAUTION_SECONDS = 10.0
"""Seconds of measured work that weigh as much as `CAUTION`."""


def stage_of(update: Update) -> str:
    """Return the stage in words: ``"frames 3 of 12"``."""
    word = WORDS.get(update.node, update.node)
    return f"{word} {update.done} of {update.total}" if update.total > 1 else word


class Clock:
    """Turns updates of nodes into progress and remaining time.

    Parameters
    ----------
    frames, pictures, samples : frames of motion, images of all views, samples per image
    nodes : the nodes that will run; those of `PRIOR` that are not `RARE` if None
    known : whether the character is expected to be cached
    measured : seconds by node, as in `PRIOR`
    """

    def __init__(
        self,
        *,
        frames: int = 60,
        pictures: int = 240,
        samples: int = PIXELS,
        nodes: Collection[str] | None = None,
        known: bool = False,
        measured: Mapping[str, float] | None = None,
    ) -> None:
        self._calls = {"vertices": frames, "photo_frame": frames, "frame": pictures}
        self._size = dict.fromkeys(LONG_FILM, frames / FILM_FRAMES) | {"frame": samples / PIXELS}
        each = {**PRIOR, **{key: value for key, value in (measured or {}).items() if key in PRIOR}}
        usual = set(PRIOR) - set(RARE) if nodes is None else set(nodes)
        wanted = usual - set(STILL if known else ())
        self._each = {
            name: seconds * self._size.get(name, 1.0) * (name in wanted)
            for name, seconds in each.items()
        }
        self._left = {name: self._whole(name) for name in self._each}
        self._begun: dict[str, tuple[float, int]] = {}
        self._first: dict[str, tuple[float, int]] = {}
        self._done: dict[str, float] = {}
        self._seen: set[str] = set()  # whose time left is measured
        self._start = time.monotonic()
        self._steady = Steady()
        self.best = 0.0

    @classmethod
    def of(cls, nodes: Collection[str], parameters: Mapping[str, Any]) -> Clock:
        """Return the clock of a run of `nodes` with the graph's inputs `parameters`."""
        frames, render = int(parameters.get("frames") or 60), parameters.get("render")
        if render is None:
            return cls(frames=frames, nodes=nodes)
        pictures, samples = frames * len(render.views), render.size**2 * render.spp
        return cls(frames=frames, pictures=pictures, samples=samples, nodes=nodes)

    def _whole(self, name: str) -> float:
        return self._each.get(name, 0.0) * self._calls.get(name, 1)

    def take(self, update: Update) -> dict[str, object]:
        """Return stage in words, completed fraction, and seconds left after an update."""
        now, name = time.monotonic(), update.node
        if update.total > 1:
            self._calls[name] = update.total
        begun = self._begun.setdefault(name, (now, update.done))
        whole = self._whole(name)
        self._seen.add(name)
        if update.total and update.done >= update.total:
            self._left[name] = 0.0
            self._done.setdefault(name, now - begun[0])
        elif update.done > begun[1] + 1:  # the first unit includes loading and setup
            first = self._first.setdefault(name, (now, update.done))
            rate = (
                (now - first[0]) / (update.done - first[1])
                if update.done > first[1]
                else whole / max(update.total, 1) * self._slowness()
            )
            self._left[name] = max(update.total - update.done, 0) * rate
        elif update.total == 1 and update.part > 0.05:
            self._left[name] = (now - begun[0]) / update.part * (1 - update.part)
        else:
            self._left[name] = max(whole - (now - begun[0]) / self._slowness(), 0.1 * whole)
            self._seen.discard(name)
        expected = sum(left for key, left in self._left.items() if key not in self._seen)
        seen = sum(left for key, left in self._left.items() if key in self._seen)
        left = self._steady(seen + expected * self._slowness())
        spent = now - self._start
        self.best = max(self.best, spent / max(spent + left, 1e-6))
        return {"stage": stage_of(update), "share": round(self.best, 4), "left": round(left, 1)}

    def _slowness(self) -> float:
        """How much longer finished nodes took than expected; those that were cached do not
        count."""
        computed = {
            name: (spent, self._whole(name))
            for name, spent in self._done.items()
            if spent > 0.05 * self._whole(name) > 0
        }
        spent = sum(took for took, _ in computed.values())
        expected = sum(whole for _, whole in computed.values())
        return (spent + CAUTION * CAUTION_SECONDS) / (expected + CAUTION_SECONDS)

    def measured(self, seconds: Mapping[str, float]) -> dict[str, float]:
        """Convert seconds per node to those of `PRIOR`."""
        return {
            name: value / max(self._calls.get(name, 1) * self._size.get(name, 1.0), 1e-6)
            for name, value in seconds.items()
            if name in PRIOR
        }

"""A store that knows the ready person, so that every command has it without computing it."""

from __future__ import annotations

import dataclasses
import inspect
import os
from functools import cache
from pathlib import Path
from typing import Any

from a2v.samples import load_ready_person
from a2v.samples.ready import PHOTO
from a2v.types import Reconstruction, Subject
from pipelines.engine.graph import needed_for
from pipelines.engine.memo import refs_within
from pipelines.engine.store import Store
from pipelines.graph import video_graph
from pipelines.requests.video import photo_parameters
from tests.support.whole_run import alone

UNUSED = (
    "surface",
    "reading",
    "surface_with_hands",
    "face_draft",
    "color_draft",
    "surface_with_face",
    "color_with_face",
)
"""Outputs that only steps read whose results the store knows too."""


@cache
def ready_folder() -> Path:
    """Return the folder of a store that is filled, which all tests of a run share."""
    folder = Path(os.environ["A2V_CACHE"]) / "ready"
    with alone(folder.with_suffix(".lock")):
        if not (folder / "filled").exists():
            fill(folder)
            (folder / "filled").touch()
    return folder


def fill(folder: Path, photo: Path = PHOTO, subject: Subject | None = None) -> Store:
    """Write into the store what the pipeline makes of the sample photo at its defaults.

    The calls are remembered under their own keys, so that child processes find them too. With
    `subject` they are those of a `photo` that shows the same person elsewhere.
    """
    store, ready = Store(folder), load_ready_person()
    if subject is not None:
        ready = dataclasses.replace(ready, subject=subject)
    known: dict[str, Any] = dict(photo_parameters(store, photo))
    shape = Reconstruction(surface=ready.shaded_surface, backend="pifu")
    made = {**ready.outputs, **dict.fromkeys(UNUSED, shape)}
    refs = {name: store.put(value) for name, value in made.items()}
    for step in needed_for(video_graph(), ["character", "shaded_surface"]):
        given = {name: known[name] for name in inspect.signature(step.node.function).parameters}
        result = tuple(refs[name] for name in step.outputs)
        known |= dict(zip(step.outputs, result, strict=True))
        facts = {"notes": [], "measures": {}, "seconds": 0.0}
        store.remember(
            step.node.name,
            step.node.key(step.node.code(), (), given),
            result if len(result) > 1 else result[0],
            facts,
            given=refs_within(given),
        )
    return store

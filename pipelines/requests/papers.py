"""The way of the papers through the pipeline: `PAPERS` for ``a2v video --papers`` and Python."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path

from a2v.body import FitSettings
from a2v.reconstruction.backends import DEFAULT_BACKEND
from a2v.types import VIEWS
from pipelines.engine.refs import File
from pipelines.requests.video import Resolved, VideoRequest

PAPERS: Mapping[str, str] = {
    "model": "glmi-m",
    "retarget.raw": "true",
    "character": "fused",
    "hands.replace": "false",
    "face.expressions": "false",
    "color.synthesis": "false",
    "color.delight": "false",
    "deform.method": "arap",
    "deform.control": "1",
    "views": ",".join(VIEWS),
    "camera": "still",
}
"""Values of a `VideoRequest` by which a video is made as the papers make it: the motion by their
VAE with global and local movement (Eq. 11), without a clean-up of the feet; the surface in the
photo's pose, with its own hands and face, colored by Eq. 14 alone; control points of weight 1
(Eq. 20); four cameras in fixed places."""

CHECKPOINTS = {
    "pifuhd": "PIFuHD",
    "pifu_geometry": "PIFu",
    "pifu_color": "PIFu's colors",
    "pamir_geometry": "PaMIR",
    "pamir_texture": "PaMIR's colors",
}
"""The user's checkpoints that the backend `papers` takes, and the networks that they are of."""


def with_checkpoints(request: VideoRequest) -> VideoRequest:
    """Return the request with the backend `papers` if it names a checkpoint."""
    named = any(getattr(request.person, name) for name in CHECKPOINTS)
    if request.person.backend != DEFAULT_BACKEND or not named:
        return request
    return dataclasses.replace(
        request, person=dataclasses.replace(request.person, backend="papers")
    )


def parts_used(request: VideoRequest, resolved: Resolved) -> Iterator[str]:
    """Say in a line each which part of the papers' way is used, and what replaces one."""
    person, film = request.person, request.film
    model = resolved.parameters.get("model")
    if isinstance(model, File):
        shown = Path(model.path).stem.removeprefix("motion_").replace("_", "-")
        yield f"papers: motion of {shown}" + ("" if "glmi-m" in shown else ", not GLMI-M")
    else:
        yield "papers: motion of the file that is given, not of GLMI-M"
    given = [own for name, own in CHECKPOINTS.items() if getattr(person, name)]
    shape = {
        "pifu": "our networks of PIFu's kind, since no checkpoint is given",
        "papers": f"your checkpoints of {', '.join(given)}",
    }.get(person.backend, f"{person.backend}, without PIFu's networks")
    yield f"papers: surface of {shape}, {person.character}"
    own_body = person.fit.model != FitSettings.model
    yield "papers: body " + (
        f"{Path(person.fit.model).name}, carried over from Anny's fit"
        if own_body
        else "Anny, since no SMPL file is given (--fit.model)"
    )
    colors = "Eq. 14 alone" if not person.color.synthesis else "Eq. 14 with synthesis"
    moved = (
        f"Eq. 20 with control {film.deform.control:g}"
        if film.deform.method == "arap"
        else "linear blend skinning"
    )
    yield f"papers: colors by {colors}, frames by {moved}, views {film.views}"

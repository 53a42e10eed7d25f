"""The pose of exported characters: at rest, or as in the photo."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.animation import photographed_character
from a2v.errors import InputError
from a2v.types import Body, Character, PhotoCamera, Subject
from pipelines.engine.run import Outcome
from pipelines.options import option
from pipelines.rigs import RigOptions

REST = "rest"
PHOTO = "photo"
"""Values of --pose."""


@dataclass(frozen=True, kw_only=True)
class PoseOptions:
    """The pose in which a character is written."""

    pose: str = option(
        f"pose of the mesh: {REST}, arms away from the trunk, for animation; or {PHOTO}, as the "
        "person stands in the photo",
        default=REST,
        choices=(REST, PHOTO),
    )

    @property
    def targets(self) -> list[str]:
        """Return the outputs of the graph that the pose needs beside the character."""
        return [] if self.pose == REST else ["body", "photo_camera", "subject"]

    def check_rig(self, path: Path, rigging: RigOptions) -> None:
        """Check the options before a long computation.

        Raises
        ------
        InputError
            Another rig or a VRM, which have rest poses of their own.
        """
        if self.pose == PHOTO and (not rigging.plain or path.suffix.lower() == ".vrm"):
            raise InputError(
                f"--pose {PHOTO} is for the body's own bones; other rigs and .vrm have a rest pose "
                "of their own: leave --pose out, or --rig, --root-motion and --visemes"
            )

    def posed(self, outcome: Outcome, name: str) -> Character:
        """Return output `name`, a character at rest, in the pose."""
        character = outcome.get(name, Character)
        if self.pose == REST:
            return character
        return photographed_character(character, outcome.get("body", Body))

    def facts(self, outcome: Outcome) -> dict[str, object]:
        """Return what ``--json`` tells of the photo's camera; nothing for the pose at rest."""
        if self.pose == REST:
            return {}
        camera, subject = outcome.get("photo_camera", PhotoCamera), outcome.get("subject", Subject)
        return {"photo_camera": camera_facts(camera, subject)}


AT_REST = PoseOptions()
"""The default."""


def camera_facts(camera: PhotoCamera, subject: Subject) -> dict[str, object]:
    """Describe the photo's camera in pixels of the upright photo.

    A point of the world is seen by a pinhole camera at ``position`` (meters) that looks along -z,
    turned down by ``pitch`` (radians), at ``focal`` pixels and the ``center`` (u, v).

    Returns
    -------
    dict
        ``position``, ``pitch``, ``focal``, ``center`` and ``size``. A camera at a distance of 0 is
        orthographic: it has ``scale`` (pixels per meter) in place of ``focal``, and ``position`` is
        a point that it sees at ``center``.
    """
    left, top, right, _ = subject.crop
    zoom = (right - left) / subject.image.shape[1]
    center = np.asarray(camera.flat.project(np.asarray(camera.aim))) * zoom + (left, top)
    near = camera.distance / np.cos(camera.pitch)
    lens = {"focal": camera.scale * zoom * near} if near else {"scale": camera.scale * zoom}
    return {
        "position": [camera.aim[0], camera.height, camera.aim[2] + camera.distance],
        "pitch": camera.pitch,
        **lens,
        "center": center.tolist(),
        "size": list(subject.photo_size),
    }

"""The photos of the benchmark, and the truth behind them."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear, to_bytes
from a2v.geometry.vectors import unit
from a2v.io import sha256
from a2v.lab.evaluation.reconstruction.panels import CAMERAS, Pin
from a2v.lab.evaluation.reconstruction.settings import SPLIT
from a2v.lab.studio.guide_errors import GuideErrors
from a2v.lab.studio.settings import VERSION, StudioSettings
from a2v.lab.studio.studio import Studio, packed_normals
from a2v.record import Record
from a2v.types import ByteArray, FloatArray, IntArray, OrthographicCamera, PhotoCamera, Surface

_KEPT = f"{VERSION}b"
"""Version of stored cases; since b they contain their camera."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Case(Record):
    """A photo and the person in it.

    Attributes
    ----------
    name : str
        Of the avatar, ``<group>_<F|M>_<number>_<outfit>``.
    index : int
        Of the view in its split.
    image : (H, W, 3) uint8
    mask : (H, W) uint8
        255 inside.
    camera : OrthographicCamera
        Of the photo's pixels.
    surface : Surface
        The true mesh, colored with its texture in the photo's mean light (`lit_by`).
    normals : (V, 3)
        Unit normals of its vertices.
    outer : (n,) int
        Its faces that are visible from outside: scalps under wigs and mouths are not
        reconstructed.
    points, point_normals : (M, 3)
        Uniform by area on the outer surface, with unit normals.
    landmarks : (33, 3)
        BlazePose landmarks of a body model, meters; NaN if unknown.
    facts : mapping
        For the report: pose, yaw...
    """

    may_hold_nan: ClassVar[frozenset[str]] = frozenset({"landmarks"})

    name: str
    index: int
    image: ByteArray
    mask: ByteArray
    camera: OrthographicCamera
    surface: Surface
    normals: FloatArray
    outer: IntArray
    points: FloatArray
    point_normals: FloatArray
    landmarks: FloatArray = dataclasses.field(
        default_factory=lambda: np.full((33, 3), np.nan, np.float32)
    )
    facts: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    @property
    def photo_camera(self) -> PhotoCamera:
        """The camera of the photo (orthographic if it is not given); `PhotoCamera.raised` moves the
        surface back to the world."""
        made = self.surface.provenance
        if "camera_aim" not in made:
            return PhotoCamera(flat=self.camera)
        return PhotoCamera(
            flat=self.camera,
            aim=tuple(made["camera_aim"]),
            distance=made["camera_distance"],
            pitch=made["camera_pitch"],
            source="the truth",
        )


def open_studio(
    folder: str | os.PathLike[str], data: str | os.PathLike[str], panel: str = ""
) -> Studio:
    """Open the studio of the benchmark with its default settings, or those of a `panel`, in true
    meters (no error of a guide moves or scales the world).

    `folder` stores poses and guides, which are made if they are missing (some minutes). It is the
    folder of a data set, or any other.

    Raises
    ------
    InputError
        As of `Studio.open`.
    """
    exact = {item.name: 0.0 for item in dataclasses.fields(GuideErrors)}
    settings = StudioSettings(guide=GuideErrors(**exact))
    if panel in CAMERAS:
        distance, height = CAMERAS[panel]
        settings = dataclasses.replace(settings, distance=distance, height=height)
    return Studio.open(folder, data, settings)


def open_case(
    studio: Studio, pin: Pin, kept: str | os.PathLike[str] | None = None, *, turn: float = 0.0
) -> Case:
    """Make a pinned photo with its truth. With the folder `kept`, the case is stored there and read
    the next time.

    With a `turn`, degrees, it is another photo of that person, turned by this angle and posed again
    (`Studio.scene`).

    Raises
    ------
    InputError
        There is no such avatar, or it has no guide.
    """
    path = (
        None
        if kept is None
        else Path(kept)
        / f"{pin.index:06d}-{pin.avatar}{f'-{turn:.0f}' if turn else ''}-{_KEPT}.npz"
    )
    if path is not None and path.exists():
        return Case.load(path)
    scene = studio.scene(SPLIT, pin.index, avatar=pin.avatar, stance=pin.stance, turn=turn)
    shot = studio.shot(SPLIT, pin.index, scene)
    image, samples = shot.image, shot.samples
    case = Case(
        name=scene.avatar,
        index=pin.index,
        image=image,
        mask=shot.photo.mask,
        camera=scene.camera,
        surface=lit_by(scene.surface, shot.photo.gain.astype(np.float32)),
        normals=scene.normals,
        outer=shot.solid.outer,
        points=samples.points,
        point_normals=unit(packed_normals(samples.normals).astype(np.float32), least=1e-9),
        landmarks=scene.landmarks,
        facts={
            "pose": scene.pose,
            "yaw": round(scene.yaw, 1),
            "sha256": sha256(image.tobytes()),
        },
    )
    if path is not None:
        case.save(path)
    return case


def lit_by(surface: Surface, gain: FloatArray) -> Surface:
    """Multiply the colors (and texture) of a surface by a linear RGB gain (3,), as in even
    light."""
    colors = linear_to_srgb(srgb_to_linear(surface.colors) * gain)
    if surface.texture is None:
        return dataclasses.replace(surface, colors=colors)
    table = to_bytes(
        linear_to_srgb(srgb_to_linear(np.arange(256, dtype=np.float32) / 255)[:, None] * gain)
    )
    texture = np.stack(
        [table[surface.texture[..., channel], channel] for channel in range(3)], axis=-1
    )
    return dataclasses.replace(surface, colors=colors, texture=texture)

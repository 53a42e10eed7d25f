"""Keyword arguments of `pipelines.front`, by their names and types.

``scripts/make_keywords.py`` writes this file from the fields of the requests.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Literal

from typing_extensions import TypedDict

from a2v.animation.arap import DeformSettings
from a2v.animation.bind import BindSettings
from a2v.animation.expressions import BlinkSettings
from a2v.animation.retarget import RetargetSettings
from a2v.body.settings import FitSettings
from a2v.footage.settings import FollowSettings
from a2v.perception.person import PerceptionSettings
from a2v.reconstruction.body_prior.settings import SurfaceSettings
from a2v.reconstruction.coloring.settings import ColorSettings
from a2v.reconstruction.face.settings import FaceSettings
from a2v.reconstruction.hands import HandSettings
from a2v.reconstruction.implicit.surface import ImplicitSettings

Text = str | os.PathLike[str] | Sequence[str]
"""Text, a path, or names in place of text with commas."""


class PersonKeywords(TypedDict, total=False):
    """Options of `make_character`."""

    mask: Text | None
    keypoints: Text | None
    corrections: Text | None
    backend: Literal["pifu", "body-prior", "papers"]
    pifuhd: Text
    pifu_geometry: Text
    pifu_color: Text
    pamir_geometry: Text
    pamir_texture: Text
    pamir_refine: int
    perception: PerceptionSettings | Mapping[str, object]
    fit: FitSettings | Mapping[str, object]
    implicit: ImplicitSettings | Mapping[str, object]
    shape: SurfaceSettings | Mapping[str, object]
    hands: HandSettings | Mapping[str, object]
    face: FaceSettings | Mapping[str, object]
    character: Literal["canonical", "fused"]
    legs: Literal["trousers", "shorts", "skirt"]
    legs_color: Text
    color: ColorSettings | Mapping[str, object]
    without: Text
    bind: BindSettings | Mapping[str, object]
    triangles: int
    texture: int
    normal_map: int
    one_material: bool


class MotionKeywords(TypedDict, total=False):
    """Options of `make_motion`."""

    timeline: Text | None
    strict: bool
    seconds: float | None
    frames: int | None
    fps: float
    model: Text
    license: Literal["any", "free"]
    seed: int
    path: Text | None
    pace: float | None
    heading: float | None
    keyframes: Text | None
    start_pose: Text | None
    end_pose: Text | None
    hold: Text | None
    loop: bool
    in_place: bool
    mirror: bool
    speed: float
    from_photo: bool
    raw: bool
    look_at: Text
    no_blink: bool
    retarget: RetargetSettings | Mapping[str, object]
    blink: BlinkSettings | Mapping[str, object]
    motion: Text | None
    motion_bone_map: Text | None
    follow: FollowSettings | Mapping[str, object]


class FilmKeywords(TypedDict, total=False):
    """Options of `make_video`."""

    views: Text | None
    camera: Text
    background: Text
    look: Text
    size: int
    aspect: Text
    titles: bool
    spp: int
    denoise: bool
    variant: Text
    no_props: bool
    render_seed: int
    deform: DeformSettings | Mapping[str, object]


class FileKeywords(TypedDict, total=False):
    """Options of `Person.save`."""

    lods: Text
    compress: Literal["none", "meshopt", "draco"]
    author: Text
    license_url: Text
    vrm: Literal["1.0", "0.x"]
    rig: Literal[
        "anny", "mixamo", "vrm", "unreal", "unity", "rigify", "talkinghead", "godot", "smpl"
    ]
    root_motion: bool
    visemes: Literal["rig", "oculus", "vrchat"]
    pose: Literal["rest", "photo"]

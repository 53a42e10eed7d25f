"""The parts of a VRM 0.x file that are not glTF (https://github.com/vrm-c/vrm-specification,
0.0)."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from a2v.formats.gltf.springs import Capsule, Springs, secondary_animation
from a2v.types import Character
from a2v.version import __version__

PRESETS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "neutral": ("Neutral", "neutral"),
        "aa": ("A", "a"),
        "ih": ("I", "i"),
        "ou": ("U", "u"),
        "ee": ("E", "e"),
        "oh": ("O", "o"),
        "blink": ("Blink", "blink"),
        "blinkLeft": ("Blink_L", "blink_l"),
        "blinkRight": ("Blink_R", "blink_r"),
        "happy": ("Joy", "joy"),
        "angry": ("Angry", "angry"),
        "sad": ("Sorrow", "sorrow"),
        "relaxed": ("Fun", "fun"),
        "surprised": ("Surprised", "unknown"),
        "lookUp": ("LookUp", "lookup"),
        "lookDown": ("LookDown", "lookdown"),
        "lookLeft": ("LookLeft", "lookleft"),
        "lookRight": ("LookRight", "lookright"),
    }
)
"""Names and presets of 0.x by their names in 1.0."""

_MUSCLES: Mapping[str, float | bool] = MappingProxyType(
    {
        "armStretch": 0.05,
        "legStretch": 0.05,
        "upperArmTwist": 0.5,
        "lowerArmTwist": 0.5,
        "upperLegTwist": 0.5,
        "lowerLegTwist": 0.5,
        "feetSpacing": 0,
        "hasTranslationDoF": False,
    }
)
"""Unity's defaults for a humanoid."""

_PLAIN: Mapping[str, dict[str, object]] = MappingProxyType(
    {
        name: {}
        for name in (
            "floatProperties",
            "vectorProperties",
            "textureProperties",
            "keywordMap",
            "tagMap",
        )
    }
)
"""A material with only the properties of glTF."""

_THUMBS = {"ThumbMetacarpal": "ThumbProximal", "ThumbProximal": "ThumbIntermediate"}
"""Bones that have other names in 0.x."""


def turned_around(character: Character) -> Character:
    """Turn a character on bones with the world's axes to face -z, as avatars of VRM 0.x do; the
    bones keep their axes."""
    half = np.array([-1.0, 1.0, -1.0], np.float32)
    surface, body = character.surface, character.body
    face = (
        None
        if surface.face is None
        else dataclasses.replace(surface.face, offsets=surface.face.offsets * half)
    )
    transforms, rest = body.bone_transforms.copy(), body.rest_transforms.copy()
    transforms[:, :3, 3] *= half
    rest[:, :3, 3] *= half
    return dataclasses.replace(
        character,
        surface=dataclasses.replace(
            surface, vertices=surface.vertices * half, face=face, standing=None
        ),
        body=dataclasses.replace(
            body,
            vertices=body.vertices * half,
            bone_transforms=transforms,
            rest_transforms=rest,
            bone_tails=body.bone_tails * half,
        ),
    )


def turned_springs(springs: tuple[Springs, ...]) -> tuple[Springs, ...]:
    """Turn springs to face -z, as `turned_around` does with a character."""

    def turned(capsule: Capsule) -> Capsule:
        return dataclasses.replace(capsule, tail=capsule.tail * [-1, 1, -1])

    return tuple(
        dataclasses.replace(one, capsules=tuple(map(turned, one.capsules))) for one in springs
    )


def bone_name(name: str) -> str:
    """Convert a bone's name in 1.0 to its name in 0.x."""
    for newer, older in _THUMBS.items():
        if name.endswith(newer):
            return name.removesuffix(newer) + older
    return name


def extension(
    meta: Mapping[str, str],
    bones: Mapping[str, Mapping[str, int]],
    presets: Mapping[str, Mapping[str, float]],
    character: Character,
    materials: list[str],
    springs: tuple[Springs, ...],
) -> dict[str, Any]:
    """Return the extension ``VRM`` of a `turned_around` character.

    Parameters
    ----------
    meta : by "name", "author", "license_url" and "version"
    bones : by 1.0's names, with their "node"
    presets : strengths of ARKit's expressions by 1.0's names of presets
    character : Character
    materials : list of str
        Names, in the order of the file.
    springs : tuple of Springs
    """
    human = [
        {"bone": bone_name(name), "node": bone["node"], "useDefaultValues": True}
        for name, bone in bones.items()
    ]
    return {
        "exporterVersion": f"a2v {__version__}",
        "specVersion": "0.0",
        "meta": {
            "title": meta["name"],
            "version": meta["version"],
            "author": meta["author"],
            "contactInformation": "",
            "reference": "",
            "allowedUserName": "OnlyAuthor",
            "violentUssageName": "Disallow",
            "sexualUssageName": "Disallow",
            "commercialUssageName": "Disallow",
            "otherPermissionUrl": "",
            "licenseName": "Other",
            "otherLicenseUrl": meta["license_url"],
        },
        "humanoid": {"humanBones": human, **_MUSCLES},
        "firstPerson": _first_person(character, bones),
        "blendShapeMaster": {"blendShapeGroups": _groups(character, presets)},
        "secondaryAnimation": secondary_animation(springs),
        "materialProperties": [
            {"name": name, "renderQueue": 2000, "shader": "VRM_USE_GLTFSHADER", **_PLAIN}
            for name in materials
        ],
    }


def _groups(
    character: Character, presets: Mapping[str, Mapping[str, float]]
) -> list[dict[str, Any]]:
    """Return presets, then ARKit's expressions by capitalized names, as face trackers expect."""
    face = character.surface.face
    if face is None:
        return []
    wanted = [(*PRESETS[name], strengths) for name, strengths in presets.items()]
    wanted += [(name[:1].upper() + name[1:], "unknown", {name: 1.0}) for name in face.names]
    groups = []
    for name, preset, strengths in wanted:
        known = {shape: strength for shape, strength in strengths.items() if shape in face.names}
        binds = [
            {"mesh": 0, "index": face.names.index(shape), "weight": round(100 * strength, 3)}
            for shape, strength in known.items()
        ]
        groups.append(
            {
                "name": name,
                "presetName": preset,
                "binds": binds,
                "materialValues": [],
                "isBinary": False,
            }
        )
    return groups


def _first_person(character: Character, bones: Mapping[str, Mapping[str, int]]) -> dict[str, Any]:
    """Return the first-person settings: from the point between the eyes, which turn by up to 10
    degrees for a target 90 degrees aside.

    Offsets are in Unity's axes.
    """
    heads = character.body.bone_transforms[:, :3, 3].astype(np.float64)
    offset = np.array([0.0, 0.06, 0.0])
    if {"leftEye", "rightEye"} <= bones.keys():
        offset = (heads[bones["leftEye"]["node"]] + heads[bones["rightEye"]["node"]]) / 2 - heads[
            bones["head"]["node"]
        ]
    degrees = {"curve": [0, 0, 0, 1, 1, 1, 1, 0], "xRange": 90, "yRange": 10}
    return {
        "firstPersonBone": bones["head"]["node"],
        "firstPersonBoneOffset": {
            axis: round(float(value), 5)
            for axis, value in zip("xyz", offset * [1, 1, -1], strict=True)
        },
        "meshAnnotations": [{"mesh": 0, "firstPersonFlag": "Auto"}],
        "lookAtTypeName": "Bone",
        **{
            f"lookAt{way}": degrees
            for way in ("HorizontalInner", "HorizontalOuter", "VerticalDown", "VerticalUp")
        },
    }

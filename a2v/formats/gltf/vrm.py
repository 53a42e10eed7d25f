"""Write avatars as VRM 1.0 or 0.x and clips as VRM animations, both based on binary glTF
(https://github.com/vrm-c/vrm-specification)."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.characters import check_clips, parent_from_bone
from a2v.formats.gltf.document import Document
from a2v.formats.gltf.hair import hang_hair
from a2v.formats.gltf.skirt import hang_skirt
from a2v.formats.gltf.springs import Springs, spring_extension
from a2v.formats.gltf.vrm0 import extension as vrm0_extension
from a2v.formats.gltf.vrm0 import turned_around, turned_springs
from a2v.formats.gltf.writing import add_animation, add_bones, skinned_document
from a2v.types import Body, Character, FloatArray

_SIDED = (
    "UpperLeg",
    "LowerLeg",
    "Foot",
    "Toes",
    "Shoulder",
    "UpperArm",
    "LowerArm",
    "Hand",
    "Eye",
    "ThumbMetacarpal",
    "ThumbProximal",
    "ThumbDistal",
    *(
        f"{finger}{part}"
        for finger in ("Index", "Middle", "Ring", "Little")
        for part in ("Proximal", "Intermediate", "Distal")
    ),
)

VRM_BONES: frozenset[str] = frozenset(
    (
        "hips",
        "spine",
        "chest",
        "upperChest",
        "neck",
        "head",
        "jaw",
        *(side + name for side in ("left", "right") for name in _SIDED),
    )
)
"""VRM's names of a person's bones."""

VRM_REQUIRED: frozenset[str] = frozenset(
    (
        "hips",
        "spine",
        "head",
        *(
            side + name
            for side in ("left", "right")
            for name in _SIDED
            if name in _SIDED[:3] + _SIDED[5:8]
        ),
    )
)
"""The 15 required bones of an avatar."""


def _both(*stems: str, strength: float = 1.0) -> dict[str, float]:
    return {stem + side: strength for stem in stems for side in ("Left", "Right")}


EXPRESSIONS: Mapping[str, Mapping[str, float]] = {
    "neutral": {},
    "happy": {
        **_both("mouthSmile", strength=0.8),
        **_both("cheekSquint", strength=0.5),
        **_both("eyeSquint", strength=0.4),
    },
    "angry": {
        **_both("browDown"),
        **_both("mouthFrown", strength=0.4),
        **_both("noseSneer", strength=0.4),
        **_both("mouthPress", strength=0.3),
    },
    "sad": {
        "browInnerUp": 0.9,
        **_both("mouthFrown", strength=0.8),
        **_both("eyeSquint", strength=0.2),
    },
    "relaxed": {**_both("mouthSmile", strength=0.3), **_both("eyeBlink", strength=0.3)},
    "surprised": {
        "browInnerUp": 0.8,
        **_both("browOuterUp", strength=0.8),
        **_both("eyeWide", strength=0.8),
        "jawOpen": 0.35,
    },
    "aa": {"jawOpen": 0.6},
    "ih": {"jawOpen": 0.2, **_both("mouthStretch", strength=0.5)},
    "ou": {"jawOpen": 0.15, "mouthPucker": 0.8},
    "ee": {
        "jawOpen": 0.12,
        **_both("mouthSmile", strength=0.4),
        **_both("mouthStretch", strength=0.4),
    },
    "oh": {"jawOpen": 0.4, "mouthFunnel": 0.6},
    "blink": _both("eyeBlink"),
    "blinkLeft": {"eyeBlinkLeft": 1.0},
    "blinkRight": {"eyeBlinkRight": 1.0},
    "lookUp": _both("eyeLookUp"),
    "lookDown": _both("eyeLookDown"),
    "lookLeft": {"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0},
    "lookRight": {"eyeLookInLeft": 1.0, "eyeLookOutRight": 1.0},
}
"""VRM's presets as strengths of ARKit's expressions."""


_LIDS = {"eyeBlinkLeft": "blinkLeft", "eyeBlinkRight": "blinkRight"}
"""VRM's presets that are one of ARKit's expressions."""


EDITIONS: tuple[str, ...] = ("1.0", "0.x")
"""Editions of the format."""


@dataclass(frozen=True, kw_only=True)
class VrmMeta:
    """Meta data of an avatar. Permissions that are not given are the narrowest of the format.

    Attributes
    ----------
    name, author : str
    license_url : str
        URL of the license that the author grants.
    version : str
        Version of the avatar.
    edition : str
        Edition of the format: "1.0", or "0.x" for programs that read nothing newer (VSeeFace).
    """

    name: str
    author: str
    license_url: str
    version: str = "1"
    edition: str = "1.0"

    def __post_init__(self) -> None:
        if self.edition not in EDITIONS:
            raise InputError(
                f"unknown edition '{self.edition}' of VRM; choose from {', '.join(EDITIONS)}"
            )
        if not self.author.strip():
            raise InputError("a .vrm needs the name of its author; give it with --author")
        if not self.license_url.startswith(("https://", "http://")):
            given = f"'{self.license_url}'" if self.license_url else "missing"
            raise InputError(
                f"a .vrm needs the web address of its license, which is {given}; give it with "
                "--license-url, such as https://creativecommons.org/licenses/by/4.0/"
            )


def write_vrm(
    path: str | os.PathLike[str], character: Character, meta: VrmMeta, *, jpeg_quality: int = 92
) -> None:
    """Write an avatar as VRM: skinned glTF with humanoid bones, meta data, look-at by the eyes'
    bones and first person.

    A character with a face gets VRM's expressions, made of ARKit's (`EXPRESSIONS`), and its own
    expressions by their names. A skirt and long hair swing (`with_springs`). Clips are written to
    separate files by `write_vrma`. An avatar of VRM 0.x faces -z.

    Parameters
    ----------
    path : path
        Written atomically.
    character : Character
        On a rig of VRM's bone names in T pose (`a2v.animation.change_rig`), the soles on the
        ground, facing +z.
    meta : VrmMeta
    jpeg_quality : int
        Quality of the embedded texture, 1 to 100; 0 embeds PNG.

    Raises
    ------
    InputError
        The character lacks one of the required bones.
    """
    bones = _human_bones(character.body)
    character, springs = with_springs(character)
    if meta.edition == "0.x":
        character, springs = turned_around(character), turned_springs(springs)
    document = skinned_document(character, None, name=meta.name, jpeg_quality=jpeg_quality)
    if meta.edition == "0.x":
        materials = [material["name"] for material in document.json["materials"]]
        said = {
            "VRM": vrm0_extension(
                dataclasses.asdict(meta), bones, EXPRESSIONS, character, materials, springs
            )
        }
    else:
        said = {"VRMC_vrm": _extension(character, meta, bones)}
        if springs:
            said["VRMC_springBone"] = spring_extension(springs)
    document.json["extensionsUsed"] = list(said)
    document.json["extensions"] = said
    document.write(path)


def with_springs(character: Character) -> tuple[Character, tuple[Springs, ...]]:
    """Add chains of bones for a skirt and long hair to a character on VRM's rig."""
    character, skirt = hang_skirt(character)
    character, hair = hang_hair(character)
    return character, tuple(one for one in (skirt, hair) if one is not None)


def _extension(
    character: Character, meta: VrmMeta, bones: Mapping[str, Mapping[str, int]]
) -> dict[str, Any]:
    """Return VRMC_vrm of VRM 1.0."""
    extension: dict[str, Any] = {
        "specVersion": "1.0",
        "meta": {
            "name": meta.name,
            "version": meta.version,
            "authors": [meta.author],
            "licenseUrl": "https://vrm.dev/licenses/1.0/",
            "otherLicenseUrl": meta.license_url,
            "avatarPermission": "onlyAuthor",
            "commercialUsage": "personalNonProfit",
            "creditNotation": "required",
            "modification": "prohibited",
            "allowRedistribution": False,
        },
        "humanoid": {"humanBones": bones},
        "expressions": _expressions(character),
        "firstPerson": {
            "meshAnnotations": [{"node": len(character.body.bone_names), "type": "auto"}]
        },
    }
    if {"leftEye", "rightEye"} <= bones.keys():
        extension["lookAt"] = _look_at(character.body)
    return extension


def write_vrma(
    path: str | os.PathLike[str],
    body: Body,
    transforms: FloatArray,
    fps: float,
    *,
    name: str = "motion",
    strengths: Mapping[str, FloatArray] | None = None,
) -> None:
    """Write a clip as a VRM animation for any avatar.

    Parameters
    ----------
    path : path
        Written atomically.
    body : Body
        On a rig of VRM's bone names in T pose.
    transforms : (T, B, 4, 4) float
        World from bone, meters. The hips take all of the travel, since the format has no root.
    fps : float
    name : str
    strengths : by ARKit's names, (T,) each
        Strengths of expressions. Lids become VRM's own blinkLeft and blinkRight, the others custom
        expressions of these names.

    Raises
    ------
    InputError
        A required bone is missing, the transforms have the wrong shape or are not finite, or the
        number of strengths differs from the number of frames.
    """
    bones = _human_bones(body)
    moves, rate = check_clips({name: (transforms, fps)}, len(body.bone_names))[name]
    moves = moves.copy()
    others = [bone for bone, label in enumerate(body.bone_names) if label not in bones]
    moves[:, others] = body.bone_transforms[others]
    document = Document(name)
    local = parent_from_bone(body.bone_transforms.astype(np.float64)[None], body.bone_parents)[0]
    document.json["scenes"][0]["nodes"] = add_bones(document, body, local)
    animation = add_animation(document, name, moves, rate, body.bone_parents, local)
    hips = bones["hips"]["node"]
    animation["channels"] = [
        channel
        for channel in animation["channels"]
        if channel["target"]["node"] not in others
        and (channel["target"]["path"] == "rotation" or channel["target"]["node"] == hips)
    ]
    document.json["animations"] = [animation]
    extension: dict[str, Any] = {"specVersion": "1.0", "humanoid": {"humanBones": bones}}
    if strengths:
        extension["expressions"] = _add_strengths(document, animation, strengths, len(moves), rate)
    document.json["extensionsUsed"] = ["VRMC_vrm_animation"]
    document.json["extensions"] = {"VRMC_vrm_animation": extension}
    for empty in ("meshes", "materials"):
        del document.json[empty]
    document.write(path)


def _add_strengths(
    document: Document,
    animation: dict[str, Any],
    strengths: Mapping[str, FloatArray],
    frames: int,
    fps: float,
) -> dict[str, Any]:
    """Add strengths (frames,) in the form of the format: the translation of a node along x for each
    expression."""
    known: dict[str, dict[str, dict[str, int]]] = {}
    times = document.times(frames, fps)
    for expression, values in strengths.items():
        if np.shape(values) != (frames,):
            raise InputError(
                f"expression '{expression}' of shape {np.shape(values)}; expected ({frames},)"
            )
        node = document.node(name=expression)
        document.json["scenes"][0]["nodes"].append(node)
        path = np.stack([values, 0 * values, 0 * values], axis=1)
        document.channel(animation, times, (node, "translation"), path)
        kind = "preset" if expression in _LIDS else "custom"
        known.setdefault(kind, {})[_LIDS.get(expression, expression)] = {"node": node}
    return known


def _human_bones(body: Body) -> dict[str, dict[str, int]]:
    """Return VRM's bones with their nodes, which are in the order of the bones."""
    found = {name: {"node": node} for node, name in enumerate(body.bone_names) if name in VRM_BONES}
    if missing := sorted(VRM_REQUIRED - found.keys()):
        raise InputError(
            f"a VRM needs the bone {missing[0]}, which the rig '{body.model}' lacks; change the "
            "rig to vrm first"
        )
    return found


def _expressions(character: Character) -> dict[str, Any]:
    """Return VRM's expressions and, as custom ones, ARKit's. Without a face they are present but
    empty, because viewers need them to find the eyes."""
    face, node = character.surface.face, len(character.body.bone_names)
    if face is None:
        return {"preset": {}}

    def bound(strengths: Mapping[str, float]) -> list[dict[str, Any]]:
        known = {name: strength for name, strength in strengths.items() if name in face.names}
        return [
            {"node": node, "index": face.names.index(name), "weight": strength}
            for name, strength in known.items()
        ]

    preset = {
        name: {"morphTargetBinds": bound(strengths), "isBinary": False}
        for name, strengths in EXPRESSIONS.items()
    }
    for name in ("happy", "relaxed"):  # these already close the eyes
        preset[name]["overrideBlink"] = "blend"
    return {
        "preset": preset,
        "custom": {
            name: {"morphTargetBinds": bound({name: 1.0}), "isBinary": False} for name in face.names
        },
    }


def _look_at(body: Body) -> dict[str, Any]:
    """Return the look-at: the eyes turn by up to 10 degrees for a target 90 degrees aside, from the
    point between them."""
    place = {
        name: transform[:3, 3].astype(np.float64)
        for name, transform in zip(body.bone_names, body.bone_transforms, strict=True)
    }
    offset = (place["leftEye"] + place["rightEye"]) / 2 - place["head"]
    ranges = (
        "rangeMapHorizontalInner",
        "rangeMapHorizontalOuter",
        "rangeMapVerticalDown",
        "rangeMapVerticalUp",
    )
    return {
        "type": "bone",
        "offsetFromHeadBone": [round(float(value), 5) for value in offset],
        **{name: {"inputMaxValue": 90.0, "outputScale": 10.0} for name in ranges},
    }

"""Find canonical joints, such as the left elbow, by the names of joints across data sets, capture
systems and rigs.

The *canonical* names are those of `a2v.kinematics.HUMANACT12` (SMPL's order), plus ``head_top``,
``left_toes``, ``left_thumb`` and their right twins. The known names are those of SMPL, HumanAct12,
the papers' CMU and NTU skeletons, CMU's BVH files, Mixamo, 3ds Max Biped, MotionBuilder, Unreal,
Unity, Rigify, Auto-Rig Pro, Character Creator, Daz, Poser, VRoid, Valve, Kinect, OptiTrack, Xsens,
MikuMikuDance, DeepMotion, DeepMimic and Anny. What tools put before and after names is removed by
rule, also a word or number that most names of a skeleton share.
"""

from __future__ import annotations

import functools
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence

# Base names (side removed, lower case, only letters and digits). If a base name means two different
# joints in two systems ("shoulder", "foot", "hand", "leg", "arm", "hip"), `_resolve` decides by the
# other joints of the skeleton.
_PLAIN: dict[str, str] = {
    "upleg": "hip", "thigh": "hip", "upperleg": "hip", "upperleg01": "hip", "femur": "hip",
    "knee": "knee", "shin": "knee", "calf": "knee", "lowerleg": "knee", "lowerleg01": "knee", "tibia": "knee", "lowleg": "knee",
    "ankle": "ankle",
    "toe": "foot", "toebase": "foot", "toe0": "foot", "ball": "foot", "toes": "foot", "toe11": "foot",
    "toeend": "toes", "toebaseend": "toes", "toesend": "toes", "toe1": "toes", "toe0nub": "toes", "footend": "toes",
    "collar": "collar", "clavicle": "collar", "clav": "collar", "collarbone": "collar", "scapula": "collar",
    "upperarm": "shoulder", "uparm": "shoulder", "upperarm01": "shoulder", "shldr": "shoulder", "humerus": "shoulder", "uarm": "shoulder",
    "elbow": "elbow", "forearm": "elbow", "lowerarm": "elbow", "lowerarm01": "elbow", "lowarm": "elbow", "radius": "elbow", "farm": "elbow",
    "wrist": "wrist",
    "handindex1": "hand", "handmiddle1": "hand", "finger31": "hand", "fingerbase": "hand", "handend": "hand", "wristend": "hand",
    "thumb": "thumb", "handthumb1": "thumb", "finger11": "thumb", "thumb01": "thumb",
}  # fmt: skip
_CENTRAL: dict[str, str] = {
    "pelvis": "pelvis", "hips": "pelvis", "hip": "pelvis",
    "neck": "neck", "neck01": "neck", "neck1": "neck", "necklower": "neck", "necktwist01": "neck",
    "head": "head", "headtop": "head_top", "headend": "head_top", "headtopend": "head_top", "headnub": "head_top",
}  # fmt: skip
_ELSE_PELVIS = ("hipcenter", "spinebase", "lowertorso", "center", "root")
"""Names of the pelvis where no joint has a better one: a root often stands above the hips."""
_SPINE = re.compile(
    r"^(spine(\d*|navel|chest|mid|shoulder|center)|(chest|abdomen)(\d*|lower|upper)|upperchest|lowerback"
    r"|(upper)?torso|thorax|waist|upperback|back\d*|stomach|ab|shouldercenter|upperbody\d*|[lt]\d+)$"
)
_PREFIXES = re.compile(
    r"^(?:(mixamorig\d*|bip0?\d*|character\d*|valvebiped)[_ .]+"
    r"|cc_base_|rl_|def-|j_bip_|[mf]_avg_|c_)(?=.)",
    re.IGNORECASE,
)
_SUFFIXES = re.compile(r"(?:[_ .-](jnt|joint|bind|stretch|x|m|c)|(?<=[a-z])Bend)$", re.IGNORECASE)
_JAPANESE = {
    "センター": "center", "上半身": "spine", "上半身2": "spine2", "首": "neck", "頭": "head",
    "肩": "shoulder", "腕": "arm", "ひじ": "elbow", "肘": "elbow", "手首": "wrist",
    "足": "leg", "ひざ": "knee", "膝": "knee", "足首": "ankle", "つま先": "toe", "爪先": "toe",
}  # fmt: skip
"""MikuMikuDance's names, without the side."""
_TRUNK = ("left_hip", "right_hip", "left_shoulder", "right_shoulder")
_MOST = 0.75
"""Share of a skeleton's names that begin or end alike if that part says nothing about the joint."""

BLAZEPOSE: tuple[str, ...] = (
    "nose",
    *(f"{side}_eye{part}" for side in ("left", "right") for part in ("_inner", "", "_outer")),
    "left_ear",
    "right_ear",
    "mouth_left",
    "mouth_right",
    *(
        f"{side}_{joint}"
        for joint in (
            "shoulder",
            "elbow",
            "wrist",
            "pinky",
            "index",
            "thumb",
            "hip",
            "knee",
            "ankle",
            "heel",
            "foot_index",
        )
        for side in ("left", "right")
    ),
)
"""The 33 landmarks of a photo's person in mediapipe's order; left and right are the person's
own."""

LANDMARK_INDEX: dict[str, int] = {name: index for index, name in enumerate(BLAZEPOSE)}
"""Row of each landmark."""

MIRRORED_BLAZEPOSE: list[int] = [
    LANDMARK_INDEX[name.replace("left", "#").replace("right", "left").replace("#", "right")]
    for name in BLAZEPOSE
]
"""For each landmark, the row of its mirror image."""

LIMBS_BY_HEIGHT: dict[tuple[str, str], float] = {
    ("hip", "knee"): 0.23, ("knee", "ankle"): 0.24, ("shoulder", "hip"): 0.28, ("shoulder", "elbow"): 0.16, ("elbow", "wrist"): 0.14,
}  # fmt: skip
"""Lengths of the limbs as fractions of the standing height: Anny's default adult to a hundredth
(tests/body/test_terms.py compares)."""

LIMB_BONES: dict[str, tuple[str, ...]] = {
    f"{side}_{bone}": tuple(f"{side}_{joint}" for joint in joints)
    for side in ("left", "right")
    for bone, joints in {
        "upper_arm": ("shoulder", "elbow", "wrist", "pinky", "index", "thumb"),
        "lower_arm": ("elbow", "wrist", "pinky", "index", "thumb"),
        "upper_leg": ("hip", "knee", "ankle", "heel", "foot_index"),
        "lower_leg": ("knee", "ankle", "heel", "foot_index"),
    }.items()
}
"""Bones of the limbs: the landmarks at the near and the far end, and those beyond the far end."""

REQUIRED: tuple[str, ...] = (
    "pelvis", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
"""Canonical joints that a person's skeleton must have."""


@functools.lru_cache(maxsize=4096)
def split_side(name: str) -> tuple[str, str]:
    """Split a joint's name into its side ("left", "right" or "") and its lower-case base name
    without separators."""
    name = unicodedata.normalize("NFKC", name).rsplit(":", 1)[-1].rsplit("|", 1)[-1].strip()
    if name[:1] in ("左", "右"):
        return ("left" if name[0] == "左" else "right"), _plain_letters(name[1:])
    name = re.sub(r"^mixamorig\d*(?=[A-Z])", "", name)  # three.js allows no colon
    name = _SUFFIXES.sub("", _without(_PREFIXES, name))
    side = ""
    patterns = (
        (r"^(left|right)[_ .-]?(?=.)", True),
        (r"[_ .-](left|right)(?=$|[_ .-])", True),
        (r"^(l|r)[_ .-](?=.)", True),
        (r"[_ .-](l|r)(?=$|[_ .-])", True),
        (r"^([LRlr])(?=[A-Z])", False),
        (r"(?<=[a-z])(Left|Right)$", False),
        (r"(?<=[a-z0-9])([LR])$", False),
    )
    for pattern, any_case in patterns:
        if found := re.search(pattern, name, flags=re.IGNORECASE if any_case else 0):
            side = "left" if found.group(1).lower().startswith("l") else "right"
            name = name[: found.start()] + name[found.end() :]
            break
    else:
        if found := re.match(
            r"^(l|r)(femur|tibia|foot|toes|clavicle|humerus|radius|wrist|hand|thumb)$", name
        ):
            side, name = ("left" if found.group(1) == "l" else "right"), found.group(2)
    return side, _plain_letters(_without(_SUFFIXES, name))


def _without(part: re.Pattern[str], name: str) -> str:
    while (shorter := part.sub("", name)) != name:
        name = shorter
    return name


def _plain_letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", _JAPANESE.get(name, name).lower())


def without_numbers(names: Sequence[str]) -> list[str]:
    """Remove the numbers that most names end in, as in files of Sketchfab."""
    shorter = [re.sub(r"(?<=.)_\d+$", "", name) for name in names]
    changed = sum(a != b for a, b in zip(names, shorter, strict=True))
    return shorter if changed >= max(_MOST * len(names), 4) else list(names)


def _without_shared_words(names: Sequence[str]) -> list[str]:
    """Remove the words before and after the names that most of them have: those of a scene, a file
    or a tool."""
    names, least = list(names), max(_MOST * len(names), 4)
    for pattern in (r"[_ .-][A-Za-z0-9]+$", r"^[^_ .:|-]+[_ .:|-]+(?=.)"):
        while True:
            words = [found.group() for name in names if (found := re.search(pattern, name))]
            common, count = Counter(words).most_common(1)[0] if words else ("", 0)
            if count < least:
                break
            cut = str.removesuffix if pattern.endswith("$") else str.removeprefix
            names = [cut(name, common) or name for name in names]
    return names


def canonical_joints(names: Sequence[str], parents: Sequence[int] | None = None) -> dict[str, int]:
    """Find the canonical joints among `names`.

    Parameters
    ----------
    names : J str
        Names of joints or bones (a bone counts as the joint at its head).
    parents : J int or None
        Parents, to order the bones of the spine.

    Returns
    -------
    dict of str to int
        Index of each canonical joint that was found. Spine joints are ``spine1``, ``spine2``...
        from the pelvis up (joints between pelvis and neck).
    """
    names = without_numbers(names)
    found = _named_joints(names, parents)
    if missing := missing_joints(found):
        again = _named_joints(_without_shared_words(names), parents)
        if len(missing_joints(again)) < len(missing):
            return again
    return found


def _named_joints(names: Sequence[str], parents: Sequence[int] | None) -> dict[str, int]:
    parts = [split_side(name) for name in names]
    bases = {base for side, base in parts if side}
    plain = dict(_PLAIN)

    def has(*wanted: str) -> bool:
        return not bases.isdisjoint(wanted)

    upper_leg = has("upleg", "thigh", "upperleg", "upperleg01", "femur")
    if not upper_leg:
        plain["hip"] = "hip"
        plain["leg"] = "hip" if has("knee", "shin", "calf", "lowerleg", "lowleg") else "knee"
    else:
        plain["leg"] = "knee"
    if has("ankle"):
        plain.setdefault("foot", "foot")
    else:
        plain["foot"] = "ankle"
    if has("arm", "upperarm", "uparm", "uarm", "upperarm01", "shldr", "humerus"):
        plain["shoulder"] = "collar"
        plain["arm"] = "shoulder"
    else:
        plain["shoulder"] = "shoulder"
    plain["hand"] = "hand" if has("wrist") else "wrist"
    found: dict[str, int] = {}
    for numbered in (False, True):  # "shoulder_1" only if there is no "shoulder"
        for index, (side, base) in enumerate(parts):
            base = base.rstrip("0123456789") if numbered else base
            name = plain.get(base, "") if side else _CENTRAL.get(base, "")
            if name:
                found.setdefault(f"{side}_{name}" if side else name, index)
    if "pelvis" not in found:
        central = [base if not side else "" for side, base in parts]
        others = [base for base in _ELSE_PELVIS if base in central]
        trunk = _fork([found.get(name, -1) for name in _TRUNK], parents)
        if trunk >= 0:
            found["pelvis"] = trunk
        elif others:
            found["pelvis"] = central.index(others[0])
        elif "left_hip" in found:
            found["pelvis"] = 0
    spine = [
        index
        for index, (side, base) in enumerate(parts)
        if not side and _SPINE.match(base) and index != found.get("pelvis")
    ]
    if parents is not None:
        if not {"neck", "head"} & set(found):  # Rigify numbers the spine up to the head
            chest = _fork([found.get(name, -1) for name in _TRUNK[2:]], parents)
            above = [index for index in spine if index != chest and chest in _path(index, parents)]
            if chest >= 0 and above:
                above.sort(key=lambda index: len(_path(index, parents)))
                found["head"], found["neck"] = above[-1], above[0]
                spine = [index for index in spine if index not in above]
        depth = {index: len(_path(index, parents)) for index in spine}
        top = found.get("neck", found.get("head", found.get("left_shoulder")))
        if top is not None:
            on_path = set(_path(top, parents))
            spine = [index for index in spine if index in on_path] or spine
        spine.sort(key=depth.__getitem__)
    for place, index in enumerate(spine):
        found[f"spine{place + 1}"] = index
    return found


def missing_joints(found: dict[str, int]) -> list[str]:
    """Return the names of `REQUIRED` that are not in `found`."""
    return [name for name in REQUIRED if name not in found]


def _fork(joints: Sequence[int], parents: Sequence[int] | None) -> int:
    """Return the last bone that carries all of `joints`, or -1."""
    if parents is None or min(joints) < 0:
        return -1
    paths = [_path(int(parents[joint]), parents) for joint in joints]
    return next((bone for bone in paths[0] if all(bone in path for path in paths)), -1)


def _path(index: int, parents: Sequence[int]) -> list[int]:
    path = []
    while index >= 0:
        path.append(index)
        index = int(parents[index])
    return path

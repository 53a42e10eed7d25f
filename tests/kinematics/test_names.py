from __future__ import annotations

import pytest

from a2v.kinematics import CMU, HUMANACT12, NTU_VIBE
from a2v.kinematics.names import REQUIRED, canonical_joints


def test_every_canonical_joint_of_the_data_sets_is_found() -> None:
    for skeleton in (HUMANACT12, CMU, NTU_VIBE):
        found = canonical_joints(skeleton.joint_names, skeleton.parents.tolist())
        for name in REQUIRED:
            assert skeleton.joint_names[found[name]] == name


NAMES = {
    "mixamo, without colons": ["mixamorigHips", "mixamorigSpine", "mixamorigNeck", "mixamorigHead"]
    + [
        f"mixamorig{s}{n}"
        for s in ("Left", "Right")
        for n in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
    ],
    "mixamo": ["mixamorig:Hips", "mixamorig:Spine", "mixamorig:Neck", "mixamorig:Head"]
    + [
        f"mixamorig:{s}{n}"
        for s in ("Left", "Right")
        for n in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
    ],
    "unreal": ["pelvis", "spine_01", "neck_01", "head"]
    + [
        f"{n}_{s}"
        for s in "lr"
        for n in ("clavicle", "upperarm", "lowerarm", "hand", "thigh", "calf", "foot", "ball")
    ],
    "biped": ["Bip01 Pelvis", "Bip01 Spine", "Bip01 Neck", "Bip01 Head"]
    + [
        f"Bip01 {s} {n}"
        for s in "LR"
        for n in ("Clavicle", "UpperArm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "Toe0")
    ],
    "rigify": ["hips", "spine", "neck", "head"]
    + [
        f"{n}.{s}"
        for s in "LR"
        for n in ("shoulder", "upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toe")
    ],
    "poser": ["hip", "abdomen", "neck", "head"]
    + [
        f"{s}{n}"
        for s in ("l", "r")
        for n in ("Collar", "Shldr", "ForeArm", "Hand", "Thigh", "Shin", "Foot", "Toe")
    ],
}


@pytest.mark.parametrize("system", NAMES)
def test_names_of_other_systems(system: str) -> None:
    names = NAMES[system]
    found = canonical_joints(names)
    wanted = ["pelvis", "spine1", "neck", "head"]
    wanted += [
        f"{s}_{n}"
        for s in ("left", "right")
        for n in ("collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot")
    ]
    assert {name: names[found[name]] for name in wanted} == dict(zip(wanted, names, strict=True))

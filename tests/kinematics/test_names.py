from __future__ import annotations

import pytest

from a2v.animation.hands import finger_bones
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


def _names(center: str, left: str, *, sides: tuple[str, str] = ("L", "R")) -> list[str]:
    """Names of a scheme: those of the middle, then those of the sides, with "#" for the side."""
    return center.split(",") + [
        name.replace("#", side) for side in sides for name in left.split(",")
    ]


LONG = ("Left", "Right")
MIXAMO = _names(
    "Hips,Spine,Neck,Head",
    "#Shoulder,#Arm,#ForeArm,#Hand,#UpLeg,#Leg,#Foot,#ToeBase",
    sides=LONG,
)
UNREAL = _names(
    "pelvis,spine_01,neck_01,head",
    "clavicle_#,upperarm_#,lowerarm_#,hand_#,thigh_#,calf_#,foot_#,ball_#",
    sides=("l", "r"),
)

SCHEMES: dict[str, list[str]] = {
    "Mixamo, colon": [f"mixamorig:{name}" for name in MIXAMO],
    "Mixamo, underscore": [f"mixamorig_{name}" for name in MIXAMO],
    "Mixamo, another number": [f"mixamorig7:{name}" for name in MIXAMO],
    "Sketchfab of Mixamo": [f"mixamorig:{name}_{i:02d}" for i, name in enumerate(MIXAMO, 1)],
    "Sketchfab of Unreal": [f"{name}_{90 - i}" for i, name in enumerate(UNREAL)],
    "a name before every bone": [f"Alice_rig_{name}" for name in MIXAMO],
    "MotionBuilder, HumanIK": [f"Character1_{name}" for name in MIXAMO],
    "Perception Neuron": [f"Robot_{name}" for name in MIXAMO],
    "Unreal": UNREAL,
    "Unity humanoid": _names(
        "Hips,Spine,Neck,Head",
        "#Shoulder,#UpperArm,#LowerArm,#Hand,#UpperLeg,#LowerLeg,#Foot,#Toes",
        sides=LONG,
    ),
    "Character Creator": _names(
        "CC_Base_Hip,CC_Base_Waist,CC_Base_NeckTwist01,CC_Base_Head",
        ",".join(
            f"CC_Base_#_{n}"
            for n in ["Clavicle", "Upperarm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "ToeBase"]
        ),
    ),
    "Daz Genesis 8": _names(
        "hip,abdomenLower,neckLower,head",
        "#Collar,#ShldrBend,#ForearmBend,#Hand,#ThighBend,#Shin,#Foot,#Toe",
        sides=("l", "r"),
    ),
    "VRoid as GLB": _names(
        ",".join(f"J_Bip_C_{n}" for n in ("Hips", "Spine", "Neck", "Head")),
        ",".join(
            f"J_Bip_#_{n}"
            for n in ["Shoulder", "UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot", "ToeBase"]
        ),
    ),
    "Rigify, DEF": _names(
        "DEF-spine,DEF-spine.001,DEF-spine.004,DEF-spine.006",
        ",".join(
            f"DEF-{n}.#" for n in ["shoulder", "upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toe"]
        ),
    ),
    "Blender": _names(
        "hips,spine,neck,head",
        "shoulder.#,upper_arm.#,forearm.#,hand.#,thigh.#,shin.#,foot.#,toe.#",
    ),
    "Auto-Rig Pro": _names(
        "c_root.x,spine_01.x,neck.x,head.x",
        "shoulder.#,arm_stretch.#,forearm_stretch.#,hand.#,thigh_stretch.#,leg_stretch.#,foot.#,toes_01.#",
        sides=("l", "r"),
    ),
    "DeepMotion": _names(
        "hips_JNT,spine_JNT,neck_JNT,head_JNT",
        ",".join(
            f"#_{n}_JNT" for n in ["shoulder", "arm", "forearm", "hand", "upleg", "leg", "foot", "toebase"]
        ),
        sides=("l", "r"),
    ),
    "SMPL of Maya": _names(
        "m_avg_Pelvis,m_avg_Spine1,m_avg_Neck,m_avg_Head",
        ",".join(
            f"m_avg_#_{n}" for n in ["Collar", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Foot"]
        ),
    ),
    "Valve": _names(
        ",".join(f"ValveBiped.Bip01_{n}" for n in ("Pelvis", "Spine", "Neck1", "Head1")),
        ",".join(
            f"ValveBiped.Bip01_#_{n}"
            for n in ["Clavicle", "UpperArm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "Toe0"]
        ),
    ),
    "3ds Max Biped": _names(
        "Bip001 Pelvis,Bip001 Spine,Bip001 Neck,Bip001 Head",
        ",".join(
            f"Bip001 # {n}" for n in ["Clavicle", "UpperArm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "Toe0"]
        ),
    ),
    "Kinect 2": _names(
        "SpineBase,SpineMid,Neck,Head",
        "-,Shoulder#,Elbow#,Wrist#,Hip#,Knee#,Ankle#,Foot#",
        sides=LONG,
    ),
    "Azure Kinect": _names(
        "PELVIS,SPINE_NAVEL,NECK,HEAD",
        "CLAVICLE_#,SHOULDER_#,ELBOW_#,WRIST_#,HIP_#,KNEE_#,ANKLE_#,FOOT_#",
        sides=("LEFT", "RIGHT"),
    ),
    "OptiTrack": _names(
        "Skeleton_001_Hip,Skeleton_001_Ab,Skeleton_001_Neck,Skeleton_001_Head",
        ",".join(
            f"Skeleton_001_#{n}"
            for n in ["Shoulder", "UArm", "FArm", "Hand", "Thigh", "Shin", "Foot", "Toe"]
        ),
    ),
    "Xsens": _names(
        "Pelvis,L5,Neck,Head",
        "#Shoulder,#UpperArm,#ForeArm,#Hand,#UpperLeg,#LowerLeg,#Foot,#Toe",
        sides=LONG,
    ),
    "MikuMikuDance": _names(
        "センター,上半身,首,頭",
        "#肩,#腕,#ひじ,#手首,#足,#ひざ,#足首,#つま先",
        sides=("左", "右"),
    ),
    "Cascadeur": _names(
        "pelvis,stomach,neck,head",
        "clavicle_#,arm_#,forearm_#,hand_#,thigh_#,calf_#,foot_#,toe_#",
        sides=("l", "r"),
    ),
    "ARKit": _names(
        "hips_joint,spine_1_joint,neck_1_joint,head_joint",
        ",".join(
            f"#_{n}_joint"
            for n in ["shoulder_1", "arm", "forearm", "hand", "upLeg", "leg", "foot", "toes"]
        ),
        sides=("left", "right"),
    ),
    "Advanced Skeleton": _names(
        "Root_M,Spine1_M,Neck_M,Head_M",
        "Scapula_#,Shoulder_#,Elbow_#,Wrist_#,Hip_#,Knee_#,Ankle_#,Toes_#",
    ),
    "sides at the end without a sign": _names(
        "Hips,Spine,Neck,Head",
        "Clavicle#,UpperArm#,Forearm#,Hand#,Thigh#,Calf#,Foot#,Toe#",
    ),
}  # fmt: skip
"""Per scheme: pelvis, spine, neck, head, then of either side collar, shoulder, elbow, wrist, hip,
knee, ankle and foot ("-": the scheme has none)."""
LIMBS = ("collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot")
WANTED = ["pelvis", "spine1", "neck", "head"] + [
    f"{side}_{joint}" for side in ("left", "right") for joint in LIMBS
]
PARENTS = [-1, 0, 1, 2] + [
    parent for first in (4, 12) for parent in (1, first, first + 1, first + 2, 0, first + 4, first + 5, first + 6)
]  # fmt: skip


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("above", ["", "Root", "Armature", "Reference"])
def test_naming_schemes_of_common_tools(scheme: str, above: str) -> None:
    names, parents = list(SCHEMES[scheme]), list(PARENTS)
    if above:
        names, parents = [above, *names], [-1, *(parent + 1 for parent in parents)]
    found = canonical_joints(names, parents)
    expected = dict(zip(WANTED, SCHEMES[scheme], strict=True))
    assert {name: names[found[name]] for name in found if name in expected} == {
        name: own for name, own in expected.items() if own != "-"
    }
    assert "spine2" not in found


def test_numbers_alone_name_no_joint() -> None:
    """UniRig calls its bones by numbers."""
    assert canonical_joints([f"bone_{i}" for i in range(22)], [*PARENTS, 3, 3]) == {}


EXTRAS = {
    "Character Creator": ["CC_Base_L_UpperarmTwist01", "CC_Base_R_ThighTwist02", "RL_BoneRoot"],
    "Daz Genesis 8": ["lShldrTwist", "rThighTwist", "lForearmTwist", "pelvis", "lMetatarsals"],
    "Rigify, DEF": ["DEF-pelvis.L", "DEF-breast.R", "DEF-upper_arm.L.001", "DEF-thigh.R.001"],
    "MikuMikuDance": [
        "全ての親",
        "グルーブ",
        "左足ＩＫ",
        "右足D",
        "左ひざD",
        "左腕捩",
        "右手捩",
        "左親指１",
    ],
    "Auto-Rig Pro": ["arm_twist.l", "thigh_twist.r", "c_thumb1.l"],
    "Unreal": ["ik_foot_root", "ik_foot_l", "upperarm_twist_01_r", "root", "ik_hand_gun"],
}


@pytest.mark.parametrize("scheme", EXTRAS)
def test_twist_bones_and_helpers_take_no_joints_place(scheme: str) -> None:
    """They come first in the list here, below the skeleton's root."""
    extra, own = EXTRAS[scheme], SCHEMES[scheme]
    names = [own[0], *extra, *own[1:]]
    parents = [-1] + [0] * len(extra) + [p + len(extra) if p else 0 for p in PARENTS[1:]]
    found = canonical_joints(names, parents)
    assert {names[found[name]] for name in WANTED} == set(own)


def test_fingers_with_the_numbers_of_sketchfab() -> None:
    names = [f"{finger}_0{part}_l" for finger in ("thumb", "index") for part in (1, 2, 3)]
    assert finger_bones(names, "left") == finger_bones(
        [f"{name}_{20 + i}" for i, name in enumerate(names)], "left"
    )
    assert finger_bones(names, "left") == {"thumb": [0, 1, 2], "index": [3, 4, 5]}

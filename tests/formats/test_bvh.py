from __future__ import annotations

import dataclasses
import zipfile
from pathlib import Path

import numpy as np
import pytest

from a2v import InputError
from a2v.formats import read_motion
from a2v.formats.bvh import read_bvh, write_bvh
from a2v.kinematics import (
    CMU,
    HUMANACT12,
    NTU_VIBE,
    Skeleton,
    forward_kinematics,
    rotvec_to_rotmat,
    skeleton_of,
)
from a2v.kinematics.names import canonical_joints
from tests.support.motions import random_clip


@pytest.mark.parametrize("skeleton", [HUMANACT12, CMU, NTU_VIBE], ids=lambda s: s.name)
def test_round_trip_keeps_joints_and_turns(tmp_path: Path, skeleton: Skeleton) -> None:
    motion = random_clip(skeleton)
    write_bvh(tmp_path / "m.bvh", motion)
    back = read_bvh(tmp_path / "m.bvh", units="centimeters", up="y")
    assert back.skeleton == skeleton.name
    assert back.joint_names == motion.joint_names
    assert back.fps == motion.fps
    np.testing.assert_allclose(back.joints, motion.joints, atol=1e-4)
    np.testing.assert_allclose(
        rotvec_to_rotmat(back.rotations), rotvec_to_rotmat(motion.rotations), atol=1e-4
    )


def test_bones_that_change_length_survive(tmp_path: Path) -> None:
    motion = random_clip(CMU, stretch=0.05)
    write_bvh(tmp_path / "m.bvh", motion)
    np.testing.assert_allclose(
        read_bvh(tmp_path / "m.bvh", units="centimeters", up="y").joints, motion.joints, atol=1e-4
    )


def test_joints_alone_are_enough(tmp_path: Path) -> None:
    motion = random_clip(HUMANACT12)
    bare = dataclasses.replace(motion, rotations=np.zeros_like(motion.rotations))
    write_bvh(tmp_path / "m.bvh", bare)
    np.testing.assert_allclose(
        read_bvh(tmp_path / "m.bvh", units="centimeters", up="y").joints, motion.joints, atol=1e-4
    )


def tiny(
    order: str = "Zrotation Xrotation Yrotation",
    row: str | None = None,
    *,
    leg: float = 40.0,
    frames: str = "2",
) -> str:
    """A small person: pelvis, spine, head, arms and legs; only the left knee turns."""
    lines = [
        "HIERARCHY",
        "ROOT Hips",
        "{",
        "OFFSET 0 0 0",
        f"CHANNELS 6 Xposition Yposition Zposition {order}",
    ]
    values = ["0 90 0 0 0 0"]

    def joint(name: str, offset: str, *children: str) -> None:
        lines.extend([f"JOINT {name}", "{", f"OFFSET {offset}", f"CHANNELS 3 {order}"])
        values.append("10 20 30" if name == "LeftLeg" else "0 0 0")

    def end(offset: str, closing: int) -> None:
        lines.extend(["End Site", "{", f"OFFSET {offset}", "}"] + ["}"] * closing)

    joint("Spine", "0 20 0")
    joint("Head", "0 40 0")
    end("0 20 0", 1)
    for side, x in (("Left", 1), ("Right", -1)):
        joint(f"{side}Arm", f"{18 * x} 30 0")
        joint(f"{side}ForeArm", f"{28 * x} 0 0")
        joint(f"{side}Hand", f"{25 * x} 0 0")
        end(f"{8 * x} 0 0", 3)
    lines.append("}")
    for side, x in (("Left", 1), ("Right", -1)):
        joint(f"{side}UpLeg", f"{10 * x} 0 0")
        joint(f"{side}Leg", f"0 {-leg} 0")
        joint(f"{side}Foot", f"0 {-leg} 0")
        end("0 -5 12", 3)
    lines.extend(["}", "MOTION", f"Frames: {frames}", "Frame Time: 0.0333333"])
    data = row if row is not None else " ".join(values)
    return "\n".join([*lines, data, data]) + "\n"


def test_reads_text_and_guesses_centimeters() -> None:
    motion = read_bvh(tiny())
    assert motion.provenance["units"] == "centimeters"
    assert motion.provenance["up"] == "y"
    assert motion.fps == 30
    assert "LeftFoot_end" in motion.joint_names
    knee, ankle = (
        motion.joints[0, motion.joint_names.index(name)] for name in ("LeftLeg", "LeftFoot")
    )
    z, x, y = np.deg2rad([10, 20, 30])
    turn = (
        rotvec_to_rotmat(np.array([0, 0, z]))
        @ rotvec_to_rotmat(np.array([x, 0, 0]))
        @ rotvec_to_rotmat(np.array([0, y, 0]))
    )
    np.testing.assert_allclose(ankle - knee, turn @ [0, -0.4, 0], atol=1e-6)
    skeleton = skeleton_of("custom", motion.parents.tolist(), motion.joint_names)
    lengths = np.linalg.norm(
        motion.joints - motion.joints[:, np.maximum(motion.parents, 0)], axis=-1
    )
    np.testing.assert_allclose(
        forward_kinematics(motion.rotations, motion.root, lengths, skeleton),
        motion.joints,
        atol=1e-5,
    )


def test_order_of_channels_matters_and_is_read() -> None:
    swapped = tiny("Yrotation Xrotation Zrotation", row=None).replace("10 20 30", "30 20 10")
    motion = read_bvh(swapped)
    knee, ankle = (
        motion.joints[0, motion.joint_names.index(name)] for name in ("LeftLeg", "LeftFoot")
    )
    z, x, y = np.deg2rad([10, 20, 30])
    turn = (
        rotvec_to_rotmat(np.array([0, y, 0]))
        @ rotvec_to_rotmat(np.array([x, 0, 0]))
        @ rotvec_to_rotmat(np.array([0, 0, z]))
    )
    np.testing.assert_allclose(ankle - knee, turn @ [0, -0.4, 0], atol=1e-6)


def test_position_channels_of_other_joints_replace_offsets() -> None:
    text = tiny().replace(
        "JOINT LeftLeg\n{\nOFFSET 0 -40.0 0\nCHANNELS 3 ",
        "JOINT LeftLeg\n{\nOFFSET 0 -40.0 0\nCHANNELS 6 Xposition Yposition Zposition ",
    )
    motion = read_bvh(text.replace("10 20 30", "0 -44 0 10 20 30"))
    hip, knee = (
        motion.joints[0, motion.joint_names.index(name)] for name in ("LeftUpLeg", "LeftLeg")
    )
    np.testing.assert_allclose(knee - hip, [0, -0.44, 0], atol=1e-6)


def test_z_up_files_are_turned() -> None:
    lines = []
    for line in tiny().split("\n"):
        words = line.split()
        if words[:1] == ["OFFSET"]:
            x, y, z = map(float, words[1:])
            line = f"OFFSET {x} {-z} {y}"
        elif words and words[0] == "0" and len(words) > 6:
            line = " ".join(["0", "0", "90", *words[3:]])
        lines.append(line)
    motion = read_bvh("\n".join(lines).replace("10 20 30", "0 0 0"))
    assert motion.provenance["up"] == "z"
    straight = read_bvh(tiny().replace("10 20 30", "0 0 0"))
    np.testing.assert_allclose(motion.joints, straight.joints, atol=1e-6)


def test_units_can_be_given_or_are_guessed() -> None:
    assert read_bvh(tiny(), units="inches").joints[0, 0, 1] == pytest.approx(90 * 0.0254)
    meters = "\n".join(
        "OFFSET " + " ".join(str(float(w) / 100) for w in line.split()[1:])
        if line.startswith("OFFSET")
        else line
        for line in tiny().replace("0 90 0 0 0 0", "0 0.9 0 0 0 0").split("\n")
    )
    assert read_bvh(meters).provenance["units"] == "meters"


def line_of(text: str, needle: str) -> int:
    return next(i for i, line in enumerate(text.split("\n"), start=1) if needle in line)


def upside_down_leg(text: str) -> str:
    """The text of `tiny` without the shape of a person."""
    return text.replace("OFFSET 0 -40.0 0", "OFFSET 0 40.0 0")


def broken() -> dict[str, tuple[str, str, str]]:
    """Case: (text, part of the line that is at fault or its number, part of the message)."""
    good = tiny()
    n = len(good.rstrip("\n").split("\n"))
    row = good.split("\n")[n - 1]
    return {
        "empty": ("\n", "1", "empty"),
        "not a bvh": ("hello\nworld\n", "1", "HIERARCHY"),
        "truncated hierarchy": ("\n".join(good.split("\n")[:20]), "20", "truncated"),
        "no frames": (tiny(frames="0").rsplit(row, 2)[0], "Frame Time", "0 frames"),
        "cut in a row": (good[: -len(row) // 2], str(n), "truncated"),
        "nan": (good.replace("10 20 30", "nan 20 30", 1), str(n - 1), "NaN"),
        "nan offset": (good.replace("OFFSET 0 20 0", "OFFSET 0 nan 0", 1), "OFFSET 0 nan 0", "NaN"),
        "no number": (good.replace("10 20 30", "10 x 30", 1), str(n - 1), "'x' is no number"),
        "wrong channel count": (
            good.replace("CHANNELS 3", "CHANNELS 4", 1),
            "CHANNELS 4",
            "lists 3",
        ),
        "unknown channel": (
            good.replace("Zrotation", "Wrotation", 1),
            "Wrotation",
            "unknown channel 'Wrotation'",
        ),
        "numbers between commas": (
            good.replace("0 90 0 0 0 0", "0,90,0,0,0,0", 1),
            str(n - 1),
            "separated by spaces",
        ),
        "points and commas": (good.replace("10 20 30", "1,5 20.5 30", 1), str(n - 1), "'1,5'"),
        "wrapped and short": (good.replace("10 20 30", "10 20\n30", 1)[:-3], str(n - 1), "for"),
        "too many numbers": (good.replace("10 20 30", "10 20 30 40", 1), str(n - 1), "for"),
        "zero-length bone": (
            good.replace("JOINT LeftLeg\n{\nOFFSET 0 -40.0 0", "JOINT LeftLeg\n{\nOFFSET 0 0 0", 1),
            "JOINT LeftLeg",
            "zero length",
        ),
        "unknown joints": (
            upside_down_leg(good).replace("LeftLeg", "Blob").replace("LeftForeArm", "Blub"),
            "ROOT Hips",
            "unknown joints: no left knee, left elbow",
        ),
        "absurd offset": (
            good.replace("OFFSET 0 20 0", "OFFSET 0 2e9 0", 1),
            "OFFSET 0 2e9 0",
            "absurd",
        ),
        "absurd value": (good.replace("10 20 30", "1e12 20 30", 1), str(n - 1), "absurd"),
        "absurd bone": (
            good.replace("OFFSET 0 40 0", "OFFSET 0 40000 0", 1),
            "JOINT Head",
            "times as long as a limb",
        ),
        "absurd frames": (tiny(frames="999999999"), "Frame Time", "numbers"),
        "frame time": (good.replace("0.0333333", "0"), "Frame Time", "Frame Time"),
        "brace": (good.replace("}\nMOTION", "MOTION"), "MOTION", "missing"),
        "two roots": (
            good.replace("JOINT LeftUpLeg", "ROOT LeftUpLeg"),
            "ROOT LeftUpLeg",
            "second ROOT",
        ),
    }


@pytest.mark.parametrize("case", broken())
def test_broken_files_are_named_with_their_line(tmp_path: Path, case: str) -> None:
    text, where, what = broken()[case]
    path = tmp_path / "broken.bvh"
    path.write_text(text)
    line = int(where) if where.isdigit() else line_of(text, where)
    with pytest.raises(InputError) as caught:
        read_bvh(path)
    message = str(caught.value)
    assert message.startswith(f"{path}:{line}: "), message
    assert what in message
    assert "\n" not in message


TINY = tiny(leg=40.25).replace("10 20 30", "10.5 -20.25 30")
TOLERATED = {
    "decimal commas": (TINY.replace(".", ","), "commas"),
    "no space": (TINY.replace("10.5 -20.25", "10.5-20.25"), "minus"),
    "no space in an offset": (TINY.replace("OFFSET 0 -40.25", "OFFSET 0-40.25"), "minus"),
    "wrapped frames": (TINY.replace("10.5 -20.25", "10.5\n-20.25"), "wrapped"),
    "all frames in a line": (
        TINY.rstrip("\n").rsplit("\n", 1)[0] + " " + TINY.rstrip("\n").rsplit("\n", 1)[1] + "\n",
        "wrapped",
    ),
    "fewer frames announced": (TINY.replace("Frames: 2", "Frames: 1"), "announces 1 frames"),
    "more frames announced": (TINY.replace("Frames: 2", "Frames: 9"), "announces 9 frames"),
}


@pytest.mark.parametrize("case", TOLERATED)
def test_what_blender_reads_is_read_with_a_note(case: str) -> None:
    text, note = TOLERATED[case]
    right, motion = read_bvh(TINY), read_bvh(text)
    assert right.provenance["notes"] == []
    assert len(motion.provenance["notes"]) == 1
    assert note in motion.provenance["notes"][0]
    np.testing.assert_array_equal(motion.joints, right.joints)
    np.testing.assert_array_equal(motion.rotations, right.rotations)
    assert motion.fps == right.fps


def test_points_in_names_do_not_hide_decimal_commas() -> None:
    text, _ = TOLERATED["decimal commas"]
    renamed = text.replace("LeftArm", "LeftArm.001")
    np.testing.assert_array_equal(read_bvh(renamed).joints, read_bvh(TINY).joints)


def _below(text: str, root: str, offset: str, values: str) -> str:
    """The text with a root of six channels above its own."""
    head, tail = text.split("\nROOT Hips", 1)
    tail = tail.replace("}\nMOTION", "}\n}\nMOTION").replace("\n0 90 ", f"\n{values} 0 90 ")
    channels = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    return f"{head}\nROOT {root}\n{{\nOFFSET {offset}\n{channels}\nJOINT Hips{tail}"


@pytest.mark.parametrize("root", ["Reference", "Root", "Alice"])
def test_a_root_above_the_hips_becomes_their_path(root: str) -> None:
    straight = read_bvh(tiny())
    still = read_bvh(_below(tiny(), root, "0 0 0", "0 0 0 0 0 0"))
    assert still.joint_names == straight.joint_names
    assert still.provenance["units"] == "centimeters"
    assert root in still.provenance["notes"][0]
    np.testing.assert_allclose(still.joints, straight.joints, atol=1e-6)
    np.testing.assert_allclose(still.rotations, straight.rotations, atol=1e-6)
    moved = read_bvh(_below(tiny(), root, "0 0 0", "50 0 20 0 0 0"))
    np.testing.assert_allclose(
        moved.joints - straight.joints, [[[0.5, 0, 0.2]] * 20] * 2, atol=1e-6
    )
    assert (
        read_bvh(_below(tiny(), root, "0 0 0", "0 0 0 0 0 0"), person=False).joint_names[0] == root
    )


def test_a_handstand_stays_and_a_file_upside_down_is_turned() -> None:
    arms = {"18 30 0": "18 30 0", "28 0 0": "0 28 0", "-28 0 0": "0 28 0", "25 0 0": "0 40 0"}
    text = tiny()
    for old, new in {**arms, "-25 0 0": "0 40 0", "OFFSET 8 0 0": "OFFSET 0 8 0"}.items():
        text = text.replace(f"OFFSET {old}\n", f"OFFSET {new}\n")
    hands = read_bvh(text.replace("\n0 90 0 0 0 0", "\n0 124 0 180 0 0"))
    assert hands.provenance["up"] == "y"
    head, hip = (hands.joints[0, hands.joint_names.index(name), 1] for name in ("Head", "Hips"))
    assert head < hip
    turned = read_bvh(text.replace("\n0 90 0 0 0 0", "\n0 -90 0 180 0 0"))
    assert turned.provenance["up"] == "-y"
    assert turned.joints[0, turned.joint_names.index("Head"), 1] > 1.4


def test_an_upper_body_is_called_that() -> None:
    text = tiny()
    for name in ("UpLeg", "Leg", "Foot"):
        for side in ("Left", "Right"):
            text = text.replace(f"JOINT {side}{name}", f"JOINT Cable{side}{name}x")
    text = text.replace("OFFSET 0 -40.0 0", "OFFSET 0 4 0")
    with pytest.raises(InputError, match="upper body"):
        read_bvh(text)


STRANGERS = {
    "r01_locale_comma": "decimal commas",
    "r02_missing_space": "minus",
    "r09_reference_root": "Reference",
    "r11_deepmotion_jnt": "",
    "r12_character_creator": "",
    "r13_daz_genesis8": "",
    "r15_smpl_m_avg": "",
    "r16_rigify_def": "",
}


@pytest.mark.parametrize("name", STRANGERS)
def test_files_of_other_tools_are_the_same_walk(data_dir: Path, name: str) -> None:
    file = data_dir / "strangers" / f"{name}.bvh"
    if not file.is_file():
        pytest.skip(f"{file} is not present")
    motion = read_bvh(file)
    notes = motion.provenance["notes"]
    assert len(notes) == bool(STRANGERS[name])
    assert not notes or STRANGERS[name] in notes[0]
    assert motion.provenance["units"] == "centimeters"
    assert motion.provenance["up"] == "y"
    found = canonical_joints(motion.joint_names, motion.parents.tolist())
    first = {key: motion.joints[0, found[key], 1] for key in ("pelvis", "neck", "head")}
    assert first == pytest.approx({"pelvis": 0.965, "neck": 1.465, "head": 1.555}, abs=0.002)
    assert found["pelvis"] == 0


def test_the_strangers_handstand_and_upper_body(data_dir: Path) -> None:
    files = [data_dir / "strangers" / f"{n}.bvh" for n in ("r28_handstand", "r24_upper_body_only")]
    if not all(file.is_file() for file in files):
        pytest.skip(f"{files[0]} or {files[1].name} is not present")
    motion = read_bvh(files[0])
    head, hips = (motion.joints[:, motion.joint_names.index(name), 1] for name in ("Head", "Hips"))
    assert (head < hips - 0.4).all()
    with pytest.raises(InputError, match="upper body"):
        read_bvh(files[1])


def test_missing_file_and_folder_and_suffix(tmp_path: Path) -> None:
    for path, what in (
        (tmp_path / "no.bvh", "does not exist"),
        (tmp_path, "is a folder"),
        (tmp_path / "a.doc", "does not exist"),
        (Path(__file__), "unknown kind"),
    ):
        with pytest.raises(InputError, match=what):
            read_motion(path)


def test_any_skeleton_on_request(tmp_path: Path) -> None:
    text = tiny().replace("Left", "A").replace("Right", "B")
    assert "by their shape" in read_bvh(text).provenance["notes"][0]
    with pytest.raises(InputError, match="unknown joints"):
        read_bvh(upside_down_leg(text))
    assert "AUpLeg" in read_bvh(text, person=False).joint_names


def test_real_cmu_files(data_dir: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(data_dir / "cmu_bvh.zip") as archive:
        text = archive.read("cmu_bvh/02/02_01.bvh").decode()
    motion = read_bvh(text, fps=30)
    assert motion.provenance["units"] == "CMU units"
    assert motion.fps == 30
    assert abs(motion.frames - 86) <= 1
    assert motion.provenance["dropped_rest_frame"]
    head = motion.joints[:, motion.joint_names.index("Head"), 1]
    assert 1.2 < head.mean() < 1.6
    write_bvh(tmp_path / "m.bvh", motion)
    np.testing.assert_allclose(read_bvh(tmp_path / "m.bvh").joints, motion.joints, atol=1e-4)


def test_a_batch_has_no_bvh(tmp_path: Path) -> None:
    motion = random_clip(CMU)
    with pytest.raises(InputError, match="batch"):
        write_bvh(
            tmp_path / "b.bvh",
            dataclasses.replace(
                motion,
                joints=motion.joints[None],
                rotations=motion.rotations[None],
                root=motion.root[None],
            ),
        )

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
        "frames missing": (
            "\n".join(good.split("\n")[: n - 1]) + "\n",
            str(n - 1),
            "1 frames, fewer than the 2",
        ),
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
        "too many numbers": (good.replace("10 20 30", "10 20 30 40", 1), str(n - 1), "for"),
        "zero-length bone": (
            good.replace("JOINT LeftLeg\n{\nOFFSET 0 -40.0 0", "JOINT LeftLeg\n{\nOFFSET 0 0 0", 1),
            "JOINT LeftLeg",
            "zero length",
        ),
        "unknown joints": (
            good.replace("LeftLeg", "Blob").replace("LeftForeArm", "Blub"),
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


def test_missing_file_and_folder_and_suffix(tmp_path: Path) -> None:
    for path, what in (
        (tmp_path / "no.bvh", "does not exist"),
        (tmp_path, "unknown kind"),
        (tmp_path / "a.fbx", "unknown kind"),
    ):
        with pytest.raises(InputError, match=what):
            read_motion(path)


def test_any_skeleton_on_request(tmp_path: Path) -> None:
    text = tiny().replace("Left", "A").replace("Right", "B")
    with pytest.raises(InputError, match="unknown joints"):
        read_bvh(text)
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

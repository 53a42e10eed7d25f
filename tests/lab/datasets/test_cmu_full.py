"""CMU's whole data base: the curated rules and the layout of its files."""

from __future__ import annotations

import csv
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats.asf_amc import parse_asf, read_amc
from a2v.kinematics import CMU, bone_lengths
from a2v.lab.datasets.cmu_full import action_of, load_cmu_full

SIDE = """
  begin
  id {id1}
  name {s}hipjoint
  direction {x} -0.8 0.1
  length 2.4
  axis 0 0 0 XYZ
  end
  begin
  name {s}femur
  direction {x} -0.94 0
  length 7.5
  axis 0 0 {t} XYZ
  dof rx ry rz
  limits (-160 20)
  end
  begin
  name {s}tibia
  direction {x} -0.94 0
  length 7.6
  axis 0 0 {t} XYZ
  dof rx
  end
  begin
  name {s}foot
  direction 0 -0.3 0.95
  length 2.2
  axis -90 0 0 XYZ
  dof rx rz
  end
  begin
  name {s}clavicle
  direction {x} 0.3 0
  length 3.5
  axis 0 0 0 XYZ
  end
  begin
  name {s}humerus
  direction {y} 0 0
  length 5.2
  axis 180 30 90 XYZ
  dof rx ry rz
  end
  begin
  name {s}radius
  direction {y} 0 0
  length 3.3
  axis 180 30 90 XYZ
  dof rx
  end
  begin
  name {s}wrist
  direction {y} 0 0
  length 1.6
  axis 180 30 90 XYZ
  end
"""
ASF = (
    ":version 1.10\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n:root\n  order TX TY TZ RX RY "
    "RZ\n  axis XYZ\n  position 0 0 0\n  orientation 0 0 0\n:bonedata\n"
    + SIDE.format(id1=1, s="l", x=0.35, y=1, t=20)
    + SIDE.format(id1=2, s="r", x=-0.35, y=-1, t=-20)
    + "".join(
        f"  begin\n  name {name}\n  direction 0 1 0\n  length {length}\n  axis 0 0 0 XYZ\n  dof rx "
        "ry rz\n  end\n"
        for name, length in (
            ("lowerback", 2.0),
            ("upperback", 2.0),
            ("thorax", 2.0),
            ("lowerneck", 1.6),
            ("head", 1.6),
        )
    )
    + ":hierarchy\n  begin\n    root lhipjoint rhipjoint lowerback\n    lhipjoint lfemur\n    lfemur ltibia\n    ltibia lfoot\n    rhipjoint rfemur\n    rfemur rtibia\n    rtibia rfoot\n    lowerback upperback\n    upperback thorax\n    thorax lowerneck lclavicle rclavicle\n    lowerneck head\n    lclavicle lhumerus\n    lhumerus lradius\n    lradius lwrist\n    rclavicle rhumerus\n    rhumerus rradius\n    rradius rwrist\n  end\n"
)
MOVING = (
    "lfemur",
    "rfemur",
    "ltibia",
    "rtibia",
    "lfoot",
    "rfoot",
    "lhumerus",
    "rhumerus",
    "lradius",
    "rradius",
    "lowerback",
    "upperback",
    "thorax",
    "lowerneck",
    "head",
)
DOFS = {"ltibia": 1, "rtibia": 1, "lfoot": 2, "rfoot": 2, "lradius": 1, "rradius": 1}


def amc(frames: int, *, swing: float = 0.0) -> str:
    lines = ["#!OML:ASF made for a test", ":FULLY-SPECIFIED", ":DEGREES"]
    for frame in range(frames):
        lines += [str(frame + 1), f"root {0} {17.5} {0.05 * frame} 0 0 0"]
        for name in MOVING:
            angles = [swing * frame if name == "rfemur" else 0.0, *[0.0] * (DOFS.get(name, 3) - 1)]
            lines.append(" ".join([name, *map(str, angles)]))
    return "\n".join(lines)


def test_every_description_of_the_index_has_a_rule(data_dir: Path) -> None:
    archive = zipfile.ZipFile(data_dir / "cmu_mocap.zip")
    name = next(
        name for name in archive.namelist() if name.endswith("cmu_index_with_framerate.csv")
    )
    rows = [
        row
        for row in csv.reader(io.StringIO(archive.read(name).decode("latin-1")))
        if row[0].isdecimal()
    ]
    actions = [action_of(row[2]) for row in rows]
    assert len(rows) == 2435
    assert [row[2] for row, action in zip(rows, actions, strict=True) if action is None] == []
    used = [action for action in actions if action]
    assert len(used) > 2000
    assert {
        "Punch",
        "Kick",
        "Sit",
        "Wave",
        "Drink",
        "Cartwheel",
        "Backflip",
        "Yoga",
        "Laugh",
        "Talk",
        "Salsa",
        "Swim",
    } <= set(used)


@pytest.mark.parametrize(
    ("text", "action"),
    [
        ("walk and turn (repeated)", "Walk and turn around"),
        ("get up from chair", "Stand up"),
        ("putt", "Golf"),
        ("putting on a hat", "Dress"),
        ("mope", "Sad walk"),
        ("opening a box", "Open and close"),
        ("calibration", ""),
        ("never heard of", None),
    ],
)
def test_descriptions_mean_what_a_person_would_say(text: str, action: str | None) -> None:
    found = action_of(text)
    assert found == action or (
        text.startswith("walk and turn") and found and found.startswith("Walk")
    )


def test_amc_has_bones_of_the_skeletons_lengths_in_meters() -> None:
    motion = read_amc(amc(5), ASF)
    assert motion.frames == 5
    left, knee = motion.joint_names.index("lfemur"), motion.joint_names.index("ltibia")
    lengths = np.linalg.norm(motion.joints[:, knee] - motion.joints[:, left], axis=-1)
    wanted = 7.5 * np.linalg.norm([0.35, -0.94, 0]) * 0.0254 / 0.45
    np.testing.assert_allclose(lengths, wanted, rtol=1e-5)
    assert motion.joints[0, motion.joint_names.index("head_end"), 1] > motion.joints[0, left, 1]


def test_a_bone_turns_about_its_own_axes() -> None:
    still, swung = read_amc(amc(3), ASF), read_amc(amc(3, swing=30.0), ASF)
    knee = still.joint_names.index("rtibia")
    moved = swung.joints[2, knee] - still.joints[2, knee]
    assert abs(moved[2]) > 0.2  # about an axis to the side: to the front or to the back
    assert np.allclose(
        still.joints[:, still.joint_names.index("ltibia")],
        swung.joints[:, still.joint_names.index("ltibia")],
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("root 1 2", ":1: expected a bone"),
        ("", "different numbers"),
        ("root 0 0 0 0 0 nan", "different|finite"),
    ],
)
def test_damaged_amc_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_amc(text, ASF)
    with pytest.raises(InputError, match="sections"):
        parse_asf("nothing", "x.asf")


def test_both_layouts_become_one_data_set(data_dir: Path, tmp_path: Path) -> None:
    (tmp_path / "07").mkdir()
    (tmp_path / "07" / "07.asf").write_text(ASF)
    (tmp_path / "07" / "07_03.amc").write_text(amc(240))
    archive = zipfile.ZipFile(data_dir / "cmu_bvh.zip")
    for clip in ("02_01", "02_04", "09_01"):
        (tmp_path / f"{clip}.bvh").write_bytes(archive.read(f"cmu_bvh/{clip[:2]}/{clip}.bvh"))
    found = load_cmu_full(tmp_path, data_dir)
    assert found.clip_names == ("02_01", "02_04", "07_03", "09_01")
    assert found.fps == 30
    assert found.skeleton is CMU
    assert (
        dict(zip(found.clip_names, (found.actions[label] for label in found.labels), strict=True))[
            "09_01"
        ]
        == "Run"
    )
    amc_clip = found.joints[found.clip_names.index("07_03")]
    assert len(amc_clip) == 60  # 240 frames at 120 Hz
    lengths = bone_lengths(found.joints[0], CMU).mean(0) * found.frame.meters_per_unit
    assert 0.3 < lengths[CMU.joint_names.index("left_knee")] < 0.55
    (tmp_path / "07" / "07.asf").unlink()
    with pytest.raises(InputError, match="no skeleton"):
        load_cmu_full(tmp_path, data_dir)

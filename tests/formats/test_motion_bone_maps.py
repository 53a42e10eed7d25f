"""Tables by which users name the bones of motion files that are not understood."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats import read_bvh, read_motion
from a2v.formats.bone_map import OTHERS
from a2v.formats.bvh import write_bvh
from a2v.formats.registry import write_motion_map
from a2v.kinematics.names import REQUIRED
from a2v.types import Motion
from pipelines.cli import main
from tests.support.motions import person

OWN = person(frames=12)
KNOWN = {name: name for name in (*REQUIRED, *OTHERS)}


@pytest.fixture
def folded(tmp_path: Path) -> Path:
    """A BVH without names whose pose at rest is a straight line: all bones point up."""
    write_bvh(tmp_path / "named.bvh", OWN)
    lines, number, names = (tmp_path / "named.bvh").read_text().splitlines(), 0, {}
    for place, line in enumerate(lines):
        word, _, rest = line.strip().partition(" ")
        if word in ("ROOT", "JOINT"):
            names[rest], number = f"b{number}", number + 1
            lines[place] = line.replace(rest, names[rest])
        elif word == "OFFSET" and number > 1:
            size = float(np.linalg.norm([float(value) for value in rest.split()]))
            lines[place] = line[: line.index("OFFSET")] + f"OFFSET 0 {size:.6f} 0"
    path = tmp_path / "folded.bvh"
    path.write_text("\n".join(lines) + "\n")
    (tmp_path / "names.json").write_text(json.dumps(names))
    return path


def named(folded: Path) -> Path:
    """The table as a user corrects it."""
    names = json.loads((folded.parent / "names.json").read_text())
    own = {bone: joint for joint, bone in names.items() if joint in KNOWN}
    path = folded.parent / "map.txt"
    lines = []
    for line in path.read_text().splitlines():
        _, bar, bone = line.partition("|")
        lines.append(f"{own.get(bone.split()[-1], '-'):15}| {bone.strip()}" if bar else line)
    path.write_text("\n".join(lines))
    return path


def test_what_is_not_understood_is_named_by_a_table(folded: Path) -> None:
    with pytest.raises(InputError, match="--motion-bone-map FILE, which writes"):
        read_motion(folded)
    write_motion_map(folded, folded.parent / "map.txt")
    text = (folded.parent / "map.txt").read_text()
    bones = [line for line in text.splitlines() if "|" in line]
    assert len(bones) == len(read_bvh(folded, person=False).joint_names)
    made = read_motion(folded, bone_map=named(folded))
    assert {"left_wrist", "right_ankle", "head"} <= set(made.joint_names)
    assert made.frames == OWN.frames


def test_a_table_wins_over_names(tmp_path: Path) -> None:
    """Left and right of a file that calls them wrongly are exchanged."""
    write_bvh(tmp_path / "a.bvh", OWN)
    write_motion_map(tmp_path / "a.bvh", tmp_path / "map.txt")
    text = (tmp_path / "map.txt").read_text()
    lines = [line.partition("|") for line in text.splitlines()]
    turned = {"left": "right", "right": "left"}
    (tmp_path / "map.txt").write_text(
        "\n".join(
            f"{turned[joint.split('_')[0]]}_{joint.split('_', 1)[1]}|{bone}"
            if bar and joint.split("_")[0] in turned
            else f"{joint}{bar}{bone}"
            for joint, bar, bone in lines
        )
    )
    plain, turned_round = (
        read_motion(tmp_path / "a.bvh", bone_map=table) for table in (None, tmp_path / "map.txt")
    )

    def wrist(motion: Motion, side: str) -> np.ndarray:
        return np.asarray(motion.joints[:, motion.joint_names.index(f"{side}_wrist")])

    assert np.allclose(wrist(plain, "left"), wrist(turned_round, "right"), atol=1e-5)


def test_faults_of_tables_are_told(folded: Path) -> None:
    write_motion_map(folded, folded.parent / "map.txt")
    text = named(folded).read_text()
    for old, new, said in (
        ("left_knee ", "- ", "names no bone for left_knee"),
        ("left_knee ", "knee ", "unknown joint"),
        ("b3\n", "bone\n", "there is no bone"),
    ):
        (folded.parent / "bad.txt").write_text(text.replace(old, new, 1))
        with pytest.raises(InputError, match=said):
            read_motion(folded, bone_map=folded.parent / "bad.txt")
    OWN.save(folded.parent / "own.npz")
    with pytest.raises(InputError, match="needs no table"):
        read_motion(folded.parent / "own.npz", bone_map=folded.parent / "map.txt")


def test_the_commands_write_the_table_first(folded: Path, capsys: pytest.CaptureFixture) -> None:
    table = folded.parent / "map.txt"
    for first in (
        ["video", "--photo", "none.jpg", "--motion", str(folded)],
        ["retarget", "--character", "none.glb", "--motions", str(folded)],
    ):
        table.unlink(missing_ok=True)
        out = str(folded.parent / ("out.glb" if first[0] == "retarget" else "out"))
        assert main([*first, "--motion-bone-map", str(table), "--out", out]) == 0
        assert "correct the table and run again" in "".join(capsys.readouterr())
        assert "| b0" in table.read_text()
    assert main(["video", "--photo", "none.jpg", "--action", "Walk", "--motion-bone-map", "x",
                 "--out", str(folded.parent / "o")]) == 2  # fmt: skip

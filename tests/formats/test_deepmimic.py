from __future__ import annotations

from pathlib import Path

import pytest

from a2v import InputError
from a2v.formats import read_deepmimic, read_motion


def test_deepmimic_cartwheel_turns_over(cartwheel: Path) -> None:
    motion = read_motion(cartwheel)
    assert motion.fps == 60
    names = motion.joint_names
    height = motion.joints[:, names.index("head"), 1] - motion.joints[:, names.index("pelvis"), 1]
    assert height[0] > 0.5
    assert height.min() < -0.3
    left = motion.joints[0, names.index("left_hip")] - motion.joints[0, names.index("right_hip")]
    assert left[0] > 0.15  # faces +z


def test_broken_deepmimic(tmp_path: Path) -> None:
    path = tmp_path / "m.txt"
    for text, what in (
        ("{", "truncated"),
        ("{}", "no 'Frames'"),
        ('{"Frames": [[1, 2]]}', "frame 0 has 2 numbers; expected 44"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=what):
            read_deepmimic(path)

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from a2v import InputError, Motion
from a2v.formats import read_motion, write_motion
from a2v.formats.registry import (
    CHARACTER_FORMATS,
    MOTION_FORMATS,
    MotionFormat,
    readable_motions,
    suffixes_of,
    writer_of,
)
from a2v.kinematics import CMU
from a2v.rendering.page import PAGE_FORMATS
from a2v.rendering.stickfigure import DRAWN_FORMATS
from tests.support.motions import random_clip


def test_npz_round_trip(tmp_path: Path) -> None:
    motion = random_clip(CMU)
    motion.save(tmp_path / "m.npz")
    np.testing.assert_array_equal(read_motion(tmp_path / "m.npz").joints, motion.joints)


def batch_of(motion: Motion, count: int) -> Motion:
    return dataclasses.replace(
        motion,
        **{
            name: np.stack([getattr(motion, name)] * count)
            for name in ("joints", "rotations", "root")
        },
    )


def test_a_batch_becomes_numbered_files_where_a_file_holds_one_clip(tmp_path: Path) -> None:
    motion = random_clip(CMU)
    both = batch_of(motion, 2)
    assert write_motion(tmp_path / "m.npz", both) == [tmp_path / "m.npz"]
    assert read_motion(tmp_path / "m.npz").batch == (2,)
    written = write_motion(tmp_path / "m.bvh", both)
    assert [path.name for path in written] == ["m_000.bvh", "m_001.bvh"]
    np.testing.assert_allclose(read_motion(written[1]).joints, motion.joints, atol=1e-4)


def test_no_two_formats_share_a_suffix() -> None:
    for formats in ((*MOTION_FORMATS, *DRAWN_FORMATS), (*CHARACTER_FORMATS, *PAGE_FORMATS)):
        suffixes = [suffix for item in formats for suffix in item.suffixes]
        assert len(suffixes) == len(set(suffixes))
        assert all(suffix == suffix.lower() and suffix.startswith(".") for suffix in suffixes)


def test_an_entry_is_all_that_a_format_needs(tmp_path: Path) -> None:
    written: list[Path] = []
    formats = (
        *MOTION_FORMATS,
        MotionFormat(suffixes=(".abc",), write=lambda path, _: written.append(path)),
    )
    write_motion(tmp_path / "m.ABC", random_clip(CMU), formats)
    assert written == [tmp_path / "m.ABC"]
    assert suffixes_of(formats)[-1] == ".abc"
    with pytest.raises(InputError, match=r"ends in \.bvh, .* \.glb or \.abc"):
        writer_of("m.txt", formats)
    assert readable_motions() == (
        ".bvh, .npz, .npy, .pkl, .pt, .fbx, .glb, .vrma or DeepMimic's .txt"
    )

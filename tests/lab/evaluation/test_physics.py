from __future__ import annotations

import numpy as np
import pytest

from a2v import InputError, Motion
from a2v.lab.evaluation.physics import (
    bone_variation,
    foot_skating,
    foot_slide,
    ground_distance,
    jitter,
    physics_metrics,
)


def feet(speed: float, height: float, frames: int = 21, fps: float = 20.0) -> np.ndarray:
    t = np.arange(frames) / fps
    return np.stack([speed * t, np.full(frames, height), np.zeros(frames)], -1)[:, None]


def test_skating_needs_low_and_fast() -> None:
    assert foot_skating(feet(0.6, 0.02), 20.0) == 1.0
    assert foot_skating(feet(0.4, 0.02), 20.0) == 0.0
    assert foot_skating(feet(0.6, 0.06), 20.0) == 0.0
    assert foot_skating(feet(0.6, 0.06), 20.0, floor=0.05) == 1.0


def test_skating_does_not_depend_on_the_frame_rate() -> None:
    assert foot_skating(feet(0.6, 0.02, 61, 60.0), 60.0) == 1.0
    assert foot_skating(feet(0.4, 0.02, 61, 60.0), 60.0) == 0.0
    assert foot_slide(feet(0.6, 0.02, 61, 60.0), 60.0) == pytest.approx(30.0)


def test_ground_and_jitter_and_bones() -> None:
    points = np.zeros((4, 2, 3))
    points[:, 0, 1], points[:, 1, 1] = [-0.015, 0.0, 0.025, 0.004], 1
    depth, over = ground_distance(points)
    assert depth == pytest.approx(10 / 4)
    assert over == pytest.approx(20 / 4)
    t = np.arange(10) / 10
    cubic = np.stack([t**3, 0 * t, 0 * t], -1)[:, None]
    assert jitter(cubic, 10.0) == pytest.approx(6.0)
    bones = np.zeros((2, 2, 3))
    bones[:, 1, 0] = [0.9, 1.1]
    assert bone_variation(bones, np.array([-1, 0])) == pytest.approx(0.1)


def test_metrics_of_a_motion() -> None:
    joints = np.zeros((1, 5, 3, 3), np.float32)
    joints[..., 1, 1], joints[..., 2, 0] = 1, np.arange(5) * 0.05
    motion = Motion(
        joints=joints,
        rotations=np.zeros_like(joints),
        root=joints[..., 0, :],
        fps=20.0,
        parents=np.array([-1, 0, 0]),
        joint_names=("pelvis", "head", "left_foot"),
    )
    metrics = physics_metrics(motion, feet=(2,))
    assert metrics.skating == 1.0
    assert metrics.slide == pytest.approx(50.0, rel=1e-4)
    names = {
        "skating",
        "penetration",
        "floating",
        "slide",
        "contact_slide",
        "contact_fast",
        "jitter",
        "bone_variation",
    }
    assert set(metrics.as_dict()) == names
    assert metrics.contact_slide == pytest.approx(1.0, rel=1e-4)  # 5 cm per frame at 20 fps, m/s
    assert metrics.contact_fast == 1.0
    with pytest.raises(InputError, match="foot"):
        physics_metrics(
            Motion(
                **{
                    **{
                        f: getattr(motion, f)
                        for f in ("joints", "rotations", "root", "fps", "parents")
                    },
                    "joint_names": ("a", "b", "c"),
                }
            )
        )

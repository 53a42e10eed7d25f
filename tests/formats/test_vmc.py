"""Poses as messages of the VMC protocol."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.formats.vmc import to_unity, unity_name, vmc_bundle
from a2v.kinematics.so3 import rotvec_to_rotmat

osc = pytest.importorskip("pythonosc.osc_bundle")


def test_names_are_those_of_unity() -> None:
    assert [unity_name(name) for name in ("hips", "leftUpperArm", "rightThumbMetacarpal")] == [
        "Hips",
        "LeftUpperArm",
        "RightThumbProximal",
    ]
    assert unity_name("leftThumbProximal") == "LeftThumbIntermediate"


def test_x_points_to_the_other_side() -> None:
    """Mirrored along x: the same rotation of mirrored points."""
    vector, point = np.array([0.3, -0.5, 0.8]), np.array([0.2, 0.7, -0.4])
    turned = rotvec_to_rotmat(vector)
    x, y, z, w = to_unity(point, turned)[3:]
    theirs = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    flip = np.diag([-1.0, 1.0, 1.0])
    assert np.allclose(theirs @ (flip @ point), flip @ (turned @ point))
    assert to_unity(point, turned)[:3] == [-0.2, 0.7, -0.4]


def test_a_bundle_has_every_message() -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = [0.1, 0.9, 0.2]
    data = vmc_bundle({"root": np.eye(4), "hips": matrix}, time=1.5, strengths={"jawOpen": 0.25})
    bundle = osc.OscBundle(data)
    told = [
        (bundle.content(i).address, bundle.content(i).params) for i in range(bundle.num_contents)
    ]
    assert told[0] == ("/VMC/Ext/OK", [1])
    assert told[1] == ("/VMC/Ext/T", [1.5])
    assert told[2] == ("/VMC/Ext/Root/Pos", ["root", 0, 0, 0, 0, 0, 0, 1])
    address, values = told[3]
    assert (address, values[0]) == ("/VMC/Ext/Bone/Pos", "Hips")
    assert np.allclose(values[1:], [-0.1, 0.9, 0.2, 0, 0, 0, 1], atol=1e-6)
    assert told[4:] == [("/VMC/Ext/Blend/Val", ["jawOpen", 0.25]), ("/VMC/Ext/Blend/Apply", [])]

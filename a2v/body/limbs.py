"""Limbs as sets of landmarks."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from a2v.kinematics.names import LANDMARK_INDEX


def _places(*names: str) -> tuple[int, ...]:
    return tuple(LANDMARK_INDEX[name] for name in names)


TRUNK: tuple[int, ...] = _places("left_shoulder", "right_shoulder", "left_hip", "right_hip")
"""Landmarks of the trunk. Depths of limbs are relative to their mean."""

LIMBS: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        "trunk": TRUNK,
        "head": _places("nose", "left_ear", "right_ear"),
        **{
            f"{side}_arm": _places(*(f"{side}_{joint}" for joint in ("elbow", "wrist", "index")))
            for side in ("left", "right")
        },
        **{
            f"{side}_leg": _places(
                *(f"{side}_{joint}" for joint in ("knee", "ankle", "foot_index"))
            )
            for side in ("left", "right")
        },
    }
)
"""Indices of the BlazePose landmarks of each limb."""

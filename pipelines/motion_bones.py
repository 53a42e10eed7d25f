"""Values of the options of ``a2v motion`` that change bones and give first poses."""

from __future__ import annotations

import numpy as np

from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.kinematics import bone_lengths
from a2v.motion import MotionModel
from a2v.motion.applications import on_skeleton
from a2v.types import Motion


def bone_scale(text: float | str) -> float | dict[str, float]:
    """Parse the option --bone-scale: a number, or names with numbers.

    Raises
    ------
    InputError
        It is neither.
    """
    try:
        if not isinstance(text, str) or "=" not in text:
            return float(text)
        return {
            name.strip(): float(value)
            for name, value in (part.split("=") for part in text.split(","))
        }
    except ValueError:
        raise InputError(
            f"bone_scale is '{text}'; expected a number, or parts with numbers such as "
            "legs=1.3,arms=0.8"
        ) from None


def first_frames(path: str, frames: int | None) -> Motion:
    """Return the first `frames` poses of the first clip of a motion file; all of them for None.

    Raises
    ------
    InputError
        The file is unreadable, or has fewer frames.
    """
    motion = read_motion(path)
    if motion.batch:
        motion = motion[(0,) * len(motion.batch)]
    if frames is None:
        return motion
    if not 1 <= frames <= motion.frames:
        raise InputError(f"start_frames is {frames}; {path} has {motion.frames} frames")
    return motion.first(frames)


def own_bones(model: MotionModel, bones: str | None, scale: float | str) -> np.ndarray | None:
    """Return the bone lengths (J,) of the person in the file --bones, times --bone-scale.

    They are in native units. None without a file.
    """
    if bones is None:
        return None
    unit = model.card.meters_per_unit
    person = first_frames(bones, None)
    lengths = bone_lengths(
        on_skeleton(person, model.skeleton, model.bone_lengths * unit), model.skeleton
    )
    scaled: np.ndarray = (
        np.median(lengths, axis=0)
        / unit
        * (model.scaled_bones(bone_scale(scale)) / np.maximum(model.bone_lengths, 1e-9))
    )
    return scaled.astype(np.float32)

"""Options for the number and the bones of generated clips, and what reads their values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.formats.registry import readable_motions
from a2v.io import brief
from a2v.kinematics import bone_lengths
from a2v.motion import MotionModel
from a2v.motion.applications import on_skeleton
from a2v.types import FloatArray, Motion
from pipelines.options import option

MAX_FRAMES = 1_500_000
"""Maximum number of frames of all clips together, about a gigabyte."""
MAX_CLIPS = 10_000
"""Maximum number of clips, of any length: a flow makes a whole window for each."""
SEVERAL = """

With several clips an .npz holds all of them with a leading dimension, .bvh become numbered files, pictures and videos show
them beside each other."""  # noqa: E501
"""What follows the examples of commands with these options."""


@dataclass(frozen=True, kw_only=True)
class ClipOptions:
    """Options for the number of clips and the bones of the person."""

    count: int = option("number of clips", default=1)
    bone_scale: float | str = option(
        "factor for all bone lengths, or PART=FACTOR,... (arms, legs, torso, head, or a joint)",
        default=1.0,
        metavar="FACTOR",
    )
    bones: str | None = option(
        f"motion file ({readable_motions(', ')}); use its bone lengths",
        default=None,
        metavar="FILE",
    )

    @property
    def changed(self) -> str:
        """The option that changes bones; empty if none is given."""
        return "bones" if self.bones else "bone_scale" if self.bone_scale != 1.0 else ""

    def check(self, frames: int) -> None:
        """Refuse too many clips of `frames` frames.

        Raises
        ------
        InputError
            There are more than `MAX_CLIPS`, or they have more than `MAX_FRAMES` frames.
        """
        if self.count > MAX_CLIPS:
            raise InputError(f"count is {brief(self.count)}; expected at most {MAX_CLIPS:,} clips")
        if self.count * frames > MAX_FRAMES:
            raise InputError(
                f"{self.count} clips of {frames} frames; expected at most {MAX_FRAMES:,} frames in "
                "all"
            )

    def lengths(self, model: MotionModel) -> FloatArray:
        """Return the requested bone lengths (J,) float32 in native units.

        Raises
        ------
        InputError
            A factor is none, or the file cannot be used.
        """
        scaled = model.scaled_bones(_bone_scale(self.bone_scale))
        if self.bones is None:
            return scaled
        unit = model.card.meters_per_unit
        person = first_frames(self.bones, None)
        own = bone_lengths(
            on_skeleton(person, model.skeleton, model.bone_lengths * unit), model.skeleton
        )
        lengths: FloatArray = (
            np.median(own, axis=0) / unit * (scaled / np.maximum(model.bone_lengths, 1e-9))
        )
        return lengths.astype(np.float32)


def _bone_scale(text: float | str) -> float | dict[str, float]:
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

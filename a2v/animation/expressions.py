"""Apply expressions to a moving character, and choose when the person blinks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from a2v.animation.deform import blended_matrices
from a2v.errors import InputError
from a2v.geometry.steps import smoothstep
from a2v.types import Character, FloatArray

BLINK: tuple[str, str] = ("eyeBlinkLeft", "eyeBlinkRight")


@dataclass(frozen=True, kw_only=True)
class BlinkSettings:
    """When a person blinks.

    Attributes
    ----------
    rate : float
        Blinks per minute, on average; 0 for none. People at rest blink 10 to 20 times.
    closing : float
        Time that the lids take to close, seconds.
    closed : float
        Time that the lids stay closed, seconds.
    opening : float
        Time that the lids take to open, seconds.
    least : float
        Shortest time from one blink to the next, seconds.
    seed : int
        Seed of the times of the blinks.
    """

    rate: float = 15.0
    closing: float = 0.09
    closed: float = 0.04
    opening: float = 0.16
    least: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.rate <= 60:
            raise InputError(f"blink.rate is {self.rate}; expected 0 to 60 blinks per minute")
        if (
            not all(0 < length <= 2 for length in (self.closing, self.opening, self.least))
            or not 0 <= self.closed <= 2
        ):
            raise InputError(
                f"blink.closing is {self.closing}, closed {self.closed}, opening {self.opening}, "
                f"least {self.least}; expected more than 0 and at most 2 seconds (closed may be 0)"
            )
        if self.seed < 0:
            raise InputError(f"blink.seed is {self.seed}; expected 0 or more")


def blinks(frames: int, fps: float, settings: BlinkSettings = BlinkSettings()) -> FloatArray:
    """Return how far the lids are closed in each frame.

    The times between blinks are exponentially distributed above the shortest one, with the mean
    that `rate` gives. The first blink comes within the first two seconds. In each blink the lids
    are shut in at least one frame.

    Returns
    -------
    (frames,) float32
        0 open, 1 shut.
    """
    shut = np.zeros(frames, np.float32)
    if settings.rate == 0:
        return shut
    random = np.random.default_rng(settings.seed)
    mean = max(60 / settings.rate - settings.least, 0.05)
    times = np.arange(frames) / fps
    moment = float(random.uniform(0.4, 2.0))
    while moment < times[-1] + settings.opening:
        at = round(moment * fps) / fps
        falling = 1 - (at - times) / settings.closing
        rising = 1 - (times - at - settings.closed) / settings.opening
        lid = np.clip(np.minimum(falling, rising), 0, 1)
        shut = np.maximum(shut, smoothstep(lid, 0, 1)).astype(np.float32)
        moment += settings.least + float(random.exponential(mean))
    return shut


def blinking(
    frames: int, fps: float, settings: BlinkSettings = BlinkSettings()
) -> dict[str, FloatArray]:
    """`blinks` as strengths (frames,) of both lids' expressions; empty without blinks."""
    shut = blinks(frames, fps, settings)
    return dict.fromkeys(BLINK, shut) if shut.any() else {}


def express(
    character: Character,
    vertices: FloatArray,
    bone_transforms: FloatArray,
    strengths: Mapping[str, float],
) -> FloatArray:
    """Add expressions to posed vertices.

    Parameters
    ----------
    character : Character
    vertices : (V, 3)
        Vertices of one frame, meters, as `deform` or `ArapDeformer` returns them.
    bone_transforms : (B, 4, 4)
        Of the same frame.
    strengths : by ARKit's names, usually in [0, 1]

    Returns
    -------
    (V, 3)
        `vertices` unchanged if all strengths are zero or the character has no face.
    """
    face = character.surface.face
    if face is None or not any(strengths.values()):
        return vertices
    moved, offsets = face.mixed(strengths)
    turns = blended_matrices(character, bone_transforms)[moved, :, :3]
    result = vertices.copy()
    result[moved] += np.einsum("vab,vb->va", turns, offsets).astype(vertices.dtype)
    return result

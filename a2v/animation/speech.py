"""Move a mouth by the sound of speech: visemes from its energy, its noise and its formants.

Formants are the resonances of linear prediction (Markel and Gray 1976). Vowels are placed on the
chart of the first two; hisses are told by where their noise lies, and lips close in short gaps.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from a2v.animation.visemes import visemes
from a2v.errors import InputError
from a2v.types import FloatArray

VOWELS: Mapping[str, tuple[float, float]] = {
    "aa": (760.0, 1300.0),
    "E": (550.0, 1850.0),
    "I": (330.0, 2250.0),
    "O": (500.0, 900.0),
    "U": (340.0, 800.0),
}
"""First and second formant of vowels, Hz: about the middle of women's and men's in Peterson and
Barney (1952)."""
_WINDOW = 0.032
"""Length of the analyzed pieces, seconds."""
_ORDER = 12
"""Order of linear prediction, at `_LOW_RATE` samples per second."""
_LOW_RATE = 10_000
_SILENT = (-32.0, -18.0)
"""Lowest and highest level, relative to the loud parts, at which the mouth is closed, dB."""
_NOISE = 9.0
"""Level above the noise of the recording at which it is closed, between those two, dB."""
_LOUD = -12.0
"""Level, relative to the loud parts, at which it is fully open, dB."""
_HISS = 0.55
"""Share of the energy above 2.5 kHz of a hiss."""
_GAP = 0.14
"""Longest gap inside speech in which the lips close, seconds."""
_SMOOTH = 0.035
"""Standard deviation of the smoothing, seconds."""
_SHARP = 7.0
"""How much nearer vowels are preferred, per octave."""


def mouth_of_speech(
    sound: FloatArray, rate: float, *, frames: int, fps: float
) -> dict[str, FloatArray]:
    """Return strengths of ARKit's expressions (frames,) float32 in [0, 1] by name.

    Parameters
    ----------
    sound : (N,) float
        One channel in [-1, 1]; the mouth is at rest after its end.
    rate : float
        Samples per second, 8000 or more.
    frames : int
    fps : float
        Frames per second of the strengths.

    Raises
    ------
    InputError
        The sound is empty, or has a lower rate.
    """
    if not len(sound) or rate < 8000:
        raise InputError(
            f"a sound of {len(sound)} samples at {rate:g} Hz; expected 8000 Hz or more"
        )
    shares = viseme_shares(np.asarray(sound, np.float64), rate, frames=frames, fps=fps)
    made: dict[str, FloatArray] = {}
    for viseme, strength in shares.items():
        for name, factor in visemes("oculus")[f"viseme_{viseme}"].items():
            made[name] = made.get(name, np.zeros(frames)) + factor * strength
    return {name: np.clip(values, 0, 1).astype(np.float32) for name, values in made.items()}


def viseme_shares(
    sound: FloatArray, rate: float, *, frames: int, fps: float
) -> dict[str, FloatArray]:
    """Return how much of each viseme is shown in each frame, (frames,) in [0, 1] by name."""
    half = max(int(rate * _WINDOW / 2), 32)
    padded = np.concatenate([np.zeros(half), sound, np.zeros(half)])
    centers = np.round(np.arange(frames) / fps * rate).astype(int)
    within = centers < len(sound)
    window = np.hanning(2 * half)
    pieces = np.zeros((frames, 2 * half))
    for frame in np.flatnonzero(within):
        piece = padded[centers[frame] : centers[frame] + 2 * half]
        pieces[frame, : len(piece)] = piece
    pieces *= window
    level = 10 * np.log10((pieces**2).mean(axis=1) + 1e-12)
    loud = float(np.percentile(level[within], 95)) if within.any() else 0.0
    noise = float(np.percentile(level[within], 5)) if within.any() else loud
    silent = float(np.clip(noise + _NOISE - loud, *_SILENT))
    active = np.clip((level - loud - silent) / (_LOUD - silent), 0, 1) * (loud > -90)
    spectrum = np.abs(np.fft.rfft(pieces, axis=1)) ** 2
    hertz = np.fft.rfftfreq(2 * half, 1 / rate)
    total = spectrum.sum(axis=1) + 1e-12
    hiss = np.clip((spectrum[:, hertz > 2500].sum(axis=1) / total - _HISS) / 0.2, 0, 1)
    high = spectrum[:, hertz > 1500]
    center = (high * hertz[hertz > 1500]).sum(axis=1) / (high.sum(axis=1) + 1e-12)
    sharp = np.clip((center - 3600) / 1000, 0, 1)  # s lies higher than sh
    shares = {"SS": active * hiss * sharp, "CH": active * hiss * (1 - sharp)}
    voiced = active * (1 - hiss)
    vowels = np.zeros((frames, len(VOWELS)))
    for frame in np.flatnonzero(voiced > 0.02):
        vowels[frame] = _vowel(pieces[frame], rate)
    for place, name in enumerate(VOWELS):
        shares[name] = voiced * vowels[:, place]
    shares["PP"] = _closed(active, fps)
    reach = max(int(3 * _SMOOTH * fps), 1)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (_SMOOTH * fps)) ** 2)
    kernel /= kernel.sum()
    return {
        name: np.convolve(np.pad(values, reach, mode="edge"), kernel, mode="valid")
        for name, values in shares.items()
    }


def _closed(active: FloatArray, fps: float) -> FloatArray:
    """Return 1 in short gaps inside speech, in which the lips close."""
    quiet = active < 0.25
    made = np.zeros(len(active))
    frame = 0
    while frame < len(active):
        end = frame
        while end < len(active) and quiet[end]:
            end += 1
        inside = frame > 0 and end < len(active)
        if end > frame and inside and (end - frame) / fps <= _GAP:
            made[frame:end] = 1
        frame = max(end, frame + 1)
    return made


def _vowel(piece: FloatArray, rate: float) -> FloatArray:
    """Return the shares (V,) of `VOWELS` of a windowed piece."""
    from scipy.linalg import solve_toeplitz
    from scipy.signal import resample

    low = resample(piece, max(int(len(piece) * _LOW_RATE / rate), 4 * _ORDER))
    low = np.append(low[0], low[1:] - 0.95 * low[:-1])
    around = np.correlate(low, low, mode="full")[len(low) - 1 : len(low) + _ORDER]
    around[0] = around[0] * (1 + 1e-6) + 1e-12
    try:
        taps = solve_toeplitz(around[:-1], around[1:])
    except np.linalg.LinAlgError:
        return np.full(len(VOWELS), 1 / len(VOWELS))
    roots = np.roots(np.concatenate([[1.0], -taps]))
    roots = roots[roots.imag > 0]
    hertz = np.angle(roots) * _LOW_RATE / (2 * np.pi)
    width = -np.log(np.maximum(np.abs(roots), 1e-9)) * _LOW_RATE / np.pi
    found = np.sort(hertz[(hertz > 200) & (hertz < 3500) & (width < 500)])
    if len(found) < 2:
        return np.full(len(VOWELS), 1 / len(VOWELS))
    chart = np.log2(np.array([*VOWELS.values()]))
    away = np.linalg.norm(chart - np.log2(found[:2]), axis=1)
    shares = np.exp2(-_SHARP * away)
    return np.asarray(shares / shares.sum())

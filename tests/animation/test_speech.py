"""A mouth that moves by the sound of speech."""

from __future__ import annotations

import wave
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from a2v import Character
from a2v.animation.speech import VOWELS, mouth_of_speech, viseme_shares
from a2v.errors import InputError
from a2v.formats.audio import RATE, read_sound
from pipelines.commands.character import Animated, with_speech

FPS = 30.0
SECONDS = 0.6


def vowel(name: str, pitch: float = 120.0) -> np.ndarray:
    """Pulses of a voice through the two resonances of a vowel, and a third."""
    count = int(SECONDS * RATE)
    sound = np.zeros(count)
    sound[:: int(RATE / pitch)] = 1.0
    for hertz, width in ((VOWELS[name][0], 80), (VOWELS[name][1], 100), (2800.0, 160)):
        radius, angle = np.exp(-np.pi * width / RATE), 2 * np.pi * hertz / RATE
        sound = lfilter([1 - radius], [1, -2 * radius * np.cos(angle), radius**2], sound)
    return 0.5 * sound / np.abs(sound).max()


def hiss(low: float) -> np.ndarray:
    """Noise above a frequency."""
    noise = np.random.default_rng(0).normal(size=int(SECONDS * RATE))
    spectrum = np.fft.rfft(noise)
    hertz = np.fft.rfftfreq(len(noise), 1 / RATE)
    spectrum[(hertz < low) | (hertz > low + 2500)] = 0
    made = np.fft.irfft(spectrum, len(noise))
    return 0.3 * made / np.abs(made).max()


def test_vowels_and_hisses_are_told_apart() -> None:
    sounds = {name: vowel(name) for name in VOWELS} | {"SS": hiss(4800), "CH": hiss(2200)}
    quiet = np.zeros(int(0.3 * RATE))
    whole = np.concatenate([part for sound in sounds.values() for part in (sound, quiet)])
    frames = round(len(whole) / RATE * FPS)
    shares = viseme_shares(whole, RATE, frames=frames, fps=FPS)
    for place, name in enumerate(sounds):
        middle = round((place * (SECONDS + 0.3) + SECONDS / 2) * FPS)
        strongest = max(shares, key=lambda viseme: shares[viseme][middle])
        assert strongest == name, (name, {k: round(float(v[middle]), 2) for k, v in shares.items()})
        still = round((place * (SECONDS + 0.3) + SECONDS + 0.15) * FPS)
        assert sum(float(share[still]) for share in shares.values()) < 0.1


@pytest.mark.parametrize("pitch", [110.0, 220.0])
def test_open_vowels_open_the_jaw_and_round_ones_the_lips(pitch: float) -> None:
    frames = int(SECONDS * FPS)
    open_, round_ = (
        mouth_of_speech(vowel(name, pitch), RATE, frames=frames, fps=FPS) for name in ("aa", "U")
    )
    assert open_["jawOpen"][5:12].mean() > 1.7 * round_["jawOpen"][5:12].mean()
    assert (round_["mouthPucker"] + round_["mouthFunnel"])[5:12].mean() > 0.4
    for values in open_.values():
        assert values.dtype == np.float32
        assert ((values >= 0) & (values <= 1)).all()


def test_lips_close_in_short_gaps_only() -> None:
    sound, short = vowel("aa"), np.zeros(int(0.09 * RATE))
    whole = np.concatenate([sound, short, sound])
    frames = round(len(whole) / RATE * FPS)
    shares = viseme_shares(whole, RATE, frames=frames, fps=FPS)
    assert shares["PP"].argmax() == pytest.approx((SECONDS + 0.045) * FPS, abs=1.5)
    assert shares["PP"].max() > 0.4
    alone = viseme_shares(sound, RATE, frames=60, fps=FPS)
    assert alone["PP"].max() < 0.1


def test_the_noise_of_a_recording_keeps_the_mouth_closed() -> None:
    """Noise 26 dB below the voice, as of a tape: the mouth is closed between two vowels."""
    sound, quiet = vowel("aa"), np.zeros(int(0.8 * RATE))
    whole = np.concatenate([quiet, sound, quiet, sound])
    noise = np.random.default_rng(0).normal(size=len(whole))
    whole = whole + noise * 0.05 * float(np.sqrt(np.mean(sound**2)))
    made = mouth_of_speech(whole, RATE, frames=round(len(whole) / RATE * FPS), fps=FPS)["jawOpen"]
    between = slice(round(1.6 * FPS), round(2.0 * FPS))
    assert made[round(1.0 * FPS) : round(1.2 * FPS)].min() > 0.3
    assert made[between].max() < 0.03


def test_silence_and_the_time_after_the_sound_keep_the_mouth_at_rest() -> None:
    for sound in (np.zeros(RATE), vowel("aa")):
        made = mouth_of_speech(sound, RATE, frames=90, fps=FPS)
        assert all(values[40:].max() < 0.05 for values in made.values())
    with pytest.raises(InputError, match="expected 8000 Hz"):
        mouth_of_speech(np.zeros(0), RATE, frames=3, fps=FPS)


def test_sound_files_are_read_as_one_channel(tmp_path: Path) -> None:
    sound = vowel("aa")
    stereo = np.repeat(np.round(sound * 32767).astype("<i2")[:, None], 2, axis=1)
    with wave.open(str(tmp_path / "a.wav"), "wb") as stream:
        stream.setnchannels(2)
        stream.setsampwidth(2)
        stream.setframerate(RATE)
        stream.writeframes(stereo.tobytes())
    read = read_sound(tmp_path / "a.wav")
    assert len(read) == pytest.approx(len(sound), abs=100)
    assert np.corrcoef(read[: len(sound) - 100], sound[: len(sound) - 100])[0, 1] > 0.99
    (tmp_path / "b.wav").write_bytes(b"RIFF garbage")
    with pytest.raises(InputError, match="not a sound"):
        read_sound(tmp_path / "b.wav")


def test_a_character_speaks_in_its_clips(expressive: Character, character: Character) -> None:
    moves = np.repeat(expressive.body.bone_transforms[None], 30, axis=0)
    blinks = {"eyeBlinkLeft": np.ones(30, np.float32)}
    given = Animated(character=expressive, clips={"a": (moves, FPS)}, expressions={"a": blinks})
    made = with_speech(given, vowel("aa").astype(np.float32))
    assert made.expressions["a"]["jawOpen"][5:12].min() > 0.3
    assert made.expressions["a"]["jawOpen"][25:].max() < 0.05
    assert set(made.expressions["a"]) <= set(expressive.surface.face.names)
    mute = Animated(character=character, clips={"a": (moves, FPS)})
    assert "no face" in with_speech(mute, vowel("aa")).notes[0]

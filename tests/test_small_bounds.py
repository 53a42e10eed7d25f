"""Small inputs of strangers that cost much, or whose text reaches a terminal."""

from __future__ import annotations

import contextlib
import gc
import io
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import a2v
import a2v.io
from a2v.errors import A2VError, InputError
from a2v.footage.reading import open_reel
from a2v.io import say
from a2v.motion import MotionModel
from a2v.motion.prompts import Vocabulary
from a2v.motion.timeline import read_timeline
from a2v.motion.ways import GroundPath, read_path
from a2v.system import peak_memory
from pipelines.cli import main
from pipelines.serve.live_child import decoded
from tests.support.hostile import owes_a_sentence

RAW = "\x07\x1b\x9b\u202e\ud800"
"""BEL, ESC, a C1 control, an override of the direction, half a character."""


def unsafe(text: str) -> list[str]:
    return [letter for letter in RAW if letter in text]


def drawing(path: str) -> str:
    return f'<svg xmlns="http://www.w3.org/2000/svg"><path d="{path}"/></svg>'


@pytest.mark.parametrize(
    "path",
    ["M 0 0 " + "C 1 2 3 4 5 6 " * 60_000, "M 0 0 " + "L 1 2 3 4 " * 90_000, "M0 0" + "Q1 2 3 4" * 90_000],
    ids=["cubic", "lines", "quadratic"],
)  # fmt: skip
def test_a_drawing_of_many_curves_is_refused_soon(path: str, tmp_path: Path) -> None:
    """It took 40 s and more: every curve copied all points before it."""
    (tmp_path / "a.svg").write_text(drawing(path))

    def read() -> None:
        with pytest.raises(InputError, match="more than 10000 points"):
            read_path(str(tmp_path / "a.svg"))

    begun = time.process_time()
    owes_a_sentence(read)
    assert time.process_time() - begun < 4


def test_the_first_line_of_a_drawing_is_the_path(tmp_path: Path) -> None:
    (tmp_path / "a.svg").write_text(drawing("M 0 0 C 0 100 100 100 100 0 Z M 5 5 L 9 9"))
    points = read_path(str(tmp_path / "a.svg")).points
    assert len(points) == 18
    np.testing.assert_allclose(points[[0, 8, 16, 17]], [[0, 0], [0.5, 0.75], [1, 0], [0, 0]])


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_a_path_of_no_numbers_names_the_point(number: float) -> None:
    """It said "shape (2, 2)"."""
    with pytest.raises(InputError, match=r"point 2 of the path is (nan|inf),1; expected finite"):
        GroundPath(np.array([[0.0, 0.0], [number, 1.0]]))


def test_a_timeline_of_many_steps_is_refused_before_they_are_matched(tmp_path: Path) -> None:
    """It took 11 s and told 2,000 lines."""
    (tmp_path / "a.yaml").write_text("- {action: walk, frames: 1}\n" * 2001)
    begun = time.process_time()
    with pytest.raises(InputError, match="2001 steps; expected at most 200"):
        read_timeline(tmp_path / "a.yaml", Vocabulary.of(MotionModel.load("cmu-fine").card))
    assert time.process_time() - begun < 2


def huge(size: tuple[int, int]) -> bytes:
    """A small JPEG whose header states another size."""
    data = io.BytesIO()
    Image.new("L", (64, 64)).save(data, "jpeg")
    found = bytearray(data.getvalue())
    place = found.index(b"\xff\xc0") + 5
    found[place : place + 4] = size[1].to_bytes(2, "big") + size[0].to_bytes(2, "big")
    return bytes(found)


@pytest.mark.parametrize("size", [(65535, 65535), (20000, 20000), (1281, 64)])
def test_a_live_frame_with_a_huge_header_is_no_defect(size: tuple[int, int]) -> None:
    with pytest.raises(InputError, match=r"frame (is too large|has \d+ x \d+ pixels)"):
        decoded(huge(size))


def encoded(size: tuple[int, int], frames: int) -> list[bytes]:
    """Packets of a gray H.264 video with its parameters in the stream."""
    import av

    context: Any = av.CodecContext.create("libx264", "w")
    context.width, context.height = size
    context.pix_fmt, context.time_base = "yuv420p", Fraction(1, 10)
    context.options = {"preset": "ultrafast", "tune": "zerolatency", "threads": "1"}
    found = list[bytes]()
    frame = av.VideoFrame(*size, "yuv420p")
    for number in range(frames):
        frame.pts = number
        found += [bytes(packet) for packet in context.encode(frame)]
    return found + [bytes(packet) for packet in context.encode(None)]


@pytest.mark.parametrize("first", [5, 100])
def test_frames_over_8k_are_not_decoded(first: int, tmp_path: Path) -> None:
    """The video begins small; frames that follow are larger than 8K: they took 2.4 GB."""
    import av

    path = tmp_path / "a.ts"
    with av.open(str(path), "w", format="mpegts") as container:
        stream: Any = container.add_stream("h264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        packets = encoded((640, 480), first) + encoded((9600, 9600), 4)
        for number, data in enumerate(packets):
            packet = av.Packet(data)
            packet.stream, packet.pts, packet.dts = stream, number, number
            packet.time_base = Fraction(1, 10)
            container.mux(packet)
    gc.collect()
    with peak_memory() as peak:
        before = peak()
        with contextlib.suppress(InputError), open_reel(path) as reel:  # FFmpeg may see the size
            assert {shown.image.shape for shown in reel.frames(side=640)} == {(480, 640, 3)}
            assert reel.damaged
        assert peak() - before < 100 << 20


def test_messages_hold_no_control_characters() -> None:
    for kind in (A2VError, InputError):
        said = str(kind(f"no action is called '{RAW}'"))
        assert not unsafe(said)
        assert "\\x1b" in said
    with pytest.raises(InputError) as caught:
        a2v.make_motion(f"{RAW} qqqxyz")
    assert not unsafe(str(caught.value))


def test_what_is_told_holds_no_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    say(RAW)
    assert not unsafe(capsys.readouterr().err)


def test_words_of_a_prompt_and_of_a_timeline_reach_the_terminal_as_escapes(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """The lines "is taken for" wrote BEL, C1 and overrides of the direction as they came."""
    words = RAW.replace("\ud800", "").replace("\x1b", "")
    (tmp_path / "a.yaml").write_text(
        '- {action: "shuffle ' + "".join(f"\\u{ord(letter):04x}" for letter in words) + ' along"}\n'
    )
    for given in (f"--action=shuffle {words} along", f"--timeline={tmp_path / 'a.yaml'}"):
        words_of = ["motion", given, "--model=cmu-fine", "--seconds=1"]
        assert main([*words_of, f"--out={tmp_path / 'a.npz'}"]) == 0
        told = capsys.readouterr()
        assert "is taken for" in told.err
        assert not unsafe(told.err.replace("\r", "")), told.err
        assert not unsafe(told.out)


@pytest.mark.parametrize("photos", [range(10**9), [3], [b"me.jpg"]])
def test_photos_that_are_no_paths(photos: Any) -> None:
    """A range of a thousand millions was a MemoryError."""
    begun = time.process_time()
    with pytest.raises(InputError, match="expected the path"):
        a2v.make_character(photos=photos)
    assert time.process_time() - begun < 2


def test_a_file_whose_name_has_half_a_character_is_refused(tmp_path: Path) -> None:
    """The fuzzer found a traceback."""
    with pytest.raises(InputError, match="cannot write"):
        a2v.io.write_npz(tmp_path / "a\ud800.npz", {"a": np.zeros(1)})

"""Videos from outside: true times, upright pictures, and one sentence for anything else."""

from __future__ import annotations

import weakref

import av
import numpy as np
import pytest

from a2v.errors import InputError
from a2v.footage import reading
from a2v.footage.reading import is_video, open_reel
from tests.support.footage import SIZE, picture, turned, write_clip


def shown(path, **more):
    with open_reel(path) as reel:
        return list(reel.frames(**{"side": 960, **more}))


def test_times_are_the_files_own(clip):
    wanted = [0.05 * index + (0.02 if index % 3 == 1 else 0.0) for index in range(20)]
    assert np.allclose([frame.time for frame in shown(clip)], wanted, atol=2e-3)


def test_a_part_begins_at_zero(clip):
    frames = shown(clip, start=0.4, seconds=0.3)
    assert 0 <= frames[0].time < 0.06
    assert 0.2 < frames[-1].time < 0.3


def test_pictures_are_small(clip):
    assert shown(clip, side=256)[0].image.shape == (192, 256, 3)


def test_many_frames_a_second_are_thinned(tmp_path):
    path = write_clip(tmp_path / "fast.mp4", [picture(None)] * 60, fps=120)
    times = [frame.time for frame in shown(path)]
    assert 13 <= len(times) <= 17
    assert np.diff(times).min() > 0.015


def test_turned_pictures_stand_upright(tmp_path, clip):
    plain = shown(clip)[0].image
    image = shown(turned(clip, tmp_path / "phone.mp4"))[0].image
    assert image.shape == (SIZE[0], SIZE[1], 3)
    assert np.abs(np.rot90(plain, -1).astype(int) - image).mean() < 12


def test_damage_in_the_middle_is_left_out(tmp_path, clip):
    data = bytearray(clip.read_bytes())
    middle = data.find(b"mdat") + (len(data) - data.find(b"mdat")) // 3
    data[middle : middle + 2000] = bytes(2000)
    path = tmp_path / "damaged.mp4"
    path.write_bytes(data)
    assert 1 <= len(shown(path)) <= 20


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "not a video"),
        (b"hello" * 100, "not a video"),
        (b"#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\n/etc/passwd\n", "not a video"),
        (None, "does not exist"),
    ],
)
def test_what_is_no_video_is_said_in_one_sentence(tmp_path, content, says):
    path = tmp_path / "a.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=says) as error, open_reel(path):
        pass
    assert "\n" not in str(error.value)


def test_half_a_file_is_said(tmp_path, clip):
    path = tmp_path / "half.mp4"
    path.write_bytes(clip.read_bytes()[: clip.stat().st_size // 2])
    with pytest.raises(InputError, match=r"half\.mp4"), open_reel(path) as reel:
        assert not list(reel.frames(side=320))


def test_sizes_are_bounded(clip, monkeypatch, tmp_path):
    small = write_clip(tmp_path / "tiny.mp4", [np.zeros((32, 32, 3), np.uint8)] * 2)
    with pytest.raises(InputError, match="32 x 32"), open_reel(small):
        pass
    monkeypatch.setattr(reading, "MOST_PIXELS", 1000)
    with pytest.raises(InputError, match="320 x 240"), open_reel(clip):
        pass


def test_videos_are_told_by_their_names():
    assert is_video("a/B.MOV")
    assert not is_video("a.bvh")


def test_a_file_with_sound_alone_is_refused(tmp_path):
    path = tmp_path / "song.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=16000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 4096), np.float32), "fltp", "mono")
        frame.sample_rate = 16000
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.raises(InputError, match="no pictures, only sound"), open_reel(path):
        pass


@pytest.mark.parametrize("suffix", ["mkv", "mp4"])
def test_a_video_without_frames_is_refused(tmp_path, suffix):
    path = tmp_path / f"empty.{suffix}"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=15)
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        container.start_encoding()
    with pytest.raises(InputError, match="no frames"), open_reel(path):
        pass


def test_a_file_that_ends_early_gives_what_is_whole(tmp_path):
    images = [picture(100 + index) for index in range(30)]
    path = write_clip(tmp_path / "whole.mkv", images)
    cut = tmp_path / "cut.mkv"
    cut.write_bytes(path.read_bytes()[: int(0.6 * path.stat().st_size)])
    assert 5 <= len(shown(cut)) < 30


def test_frames_are_decoded_one_at_a_time(tmp_path):
    path = write_clip(tmp_path / "long.mp4", [picture(None)] * 40)
    held = []
    with open_reel(path) as reel:
        for frame in reel.frames(side=256):
            held.append(weakref.ref(frame.image))
            del frame
    assert sum(one() is not None for one in held) <= 1

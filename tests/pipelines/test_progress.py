"""What people see while a run computes: words, one line, and a time left that hardly rises."""

from __future__ import annotations

import csv
import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import pipelines.bar
from a2v.types import RenderSettings
from pipelines.bar import Bars
from pipelines.clock import Clock
from pipelines.engine.progress import MOST_RISE, Steady, Update, duration
from pipelines.graph import video_graph
from pipelines.inputs import RunOptions
from pipelines.stages import WORDS

RUN = Path(__file__).with_name("a_run.csv")
"""Updates of `make video` (150 frames in four views) on a machine with seven other programs."""


def recorded() -> list[tuple[float, Update]]:
    with open(RUN, encoding="utf-8", newline="") as stream:
        return [
            (
                float(row["seconds"]),
                Update(row["node"], int(row["done"]), int(row["total"]), float(row["part"])),
            )
            for row in csv.DictReader(stream)
        ]


def even(seconds: float) -> float:
    return seconds


def slower_in_the_middle(seconds: float) -> float:
    """Another program begins after five minutes and takes two thirds of the processor."""
    return seconds + 2 * max(seconds - 300, 0)


@pytest.mark.parametrize("speed", [0.5, 1.0, 8.0, 30.0])
@pytest.mark.parametrize("course", [even, slower_in_the_middle])
def test_the_time_left_never_rises_by_more_than_a_tenth(
    monkeypatch: pytest.MonkeyPatch, speed: float, course: Callable[[float], float]
) -> None:
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    settings = {"frames": 150, "render": RenderSettings(size=512, spp=8)}
    events = recorded()
    clock = Clock.of([update.node for _, update in events], settings)
    end, shortest, shares = course(events[-1][0]) / speed, float("inf"), [0.0]
    for seconds, update in events:
        now[0] = course(seconds) / speed
        said = clock.take(update)
        left = float(str(said["left"]))
        assert left <= MOST_RISE * shortest + 0.1, (now[0], update)
        shortest = min(shortest, left)
        shares.append(float(str(said["share"])))
        if speed == 8 and course is even and 0.1 * end < now[0] < 0.9 * end:  # two idle cores
            assert left == pytest.approx(end - now[0], rel=0.6)
    assert shares == sorted(shares)
    assert left < 3
    assert shares[-1] > 0.97


def test_an_estimate_follows_what_falls_and_hardly_what_rises() -> None:
    steady = Steady()
    assert [steady(value) for value in (100, 50, 80, 54, 20)] == pytest.approx(
        [100, 50, 55, 54, 20]
    )


def test_every_node_has_a_word() -> None:
    names = {
        step.node.name
        for recorded in (False, True)
        for several in (False, True)
        for step in video_graph(recorded=recorded, several=several)
    }
    assert names == set(WORDS)
    assert not [word for word in WORDS.values() if not re.fullmatch("[a-z]+", word)]


def test_times_are_words() -> None:
    assert [duration(seconds) for seconds in (3, 89, 120, 5399, 7200)] == [
        "3 s",
        "89 s",
        "2 min",
        "90 min",
        "2.0 h",
    ]


def test_without_a_terminal_lines_come_at_intervals_also_while_nothing_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("JPY_PARENT_PID", raising=False)
    monkeypatch.setattr(pipelines.bar, "LINE_SECONDS", 0.1)
    bars = Bars()
    time.sleep(0.4)
    bars(Update("face_draft", 0, 1))
    time.sleep(0.4)
    bars.expect(Clock(frames=12, pictures=12))
    bars(Update("frame", 2, 12))
    time.sleep(0.5)
    bars.close()
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].endswith("starting")
    assert "face" in lines
    assert re.search(r"^ *\d+ % frames 2 of 12, about \d+ (s|min) left$", lines[-1])
    assert 4 <= len(lines) <= 14
    time.sleep(0.2)
    assert capsys.readouterr().err == ""


def test_quiet_is_quiet_and_the_end_says_what_was_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    quiet = Bars(quiet=True)
    quiet(Update("frame", 1, 2))
    quiet.close()
    written = [tmp_path / "video.mp4", tmp_path / "character.glb"]
    RunOptions(quiet=True).tell_made(written, 3)
    assert capsys.readouterr().err == ""
    RunOptions().tell_made(written, 83)
    assert capsys.readouterr().err.splitlines() == [
        "made in 83 s: video.mp4, character.glb",
        f"in {tmp_path}",
    ]

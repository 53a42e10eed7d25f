"""Videos that several tests use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from a2v.footage import follow
from a2v.footage.fit import Moves
from a2v.footage.follow import Followed
from tests.support.footage import QUICK, picture, write_clip


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One second of the sample person, who moves right in uneven steps of time."""
    times = [0.05 * index + (0.02 if index % 3 == 1 else 0.0) for index in range(20)]
    return write_clip(
        tmp_path_factory.mktemp("clip") / "walk.mp4",
        [picture(110 + 100 * time) for time in times],
        times,
    )


@pytest.fixture(scope="session")
def found(clip: Path) -> tuple[Followed, Moves]:
    """The detections in the video, and the bodies before feet are planted."""
    kept: list[Moves] = []
    with pytest.MonkeyPatch.context() as patch:
        plain = follow._fitted

        def fitted(*given: Any) -> Moves:
            kept.append(plain(*given))
            return kept[-1]

        patch.setattr(follow, "_fitted", fitted)
        made = follow.follow_person(clip, QUICK)
    return made, kept[0]


@pytest.fixture(scope="session")
def followed(found: tuple[Followed, Moves]) -> Followed:
    """The detections in the video."""
    return found[0]

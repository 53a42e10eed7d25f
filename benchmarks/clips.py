"""Measure the clips of the library as the commands show them: ``python -m benchmarks.clips
[--seeds 4] [--out clips_standing.md]``.

The measures are those of the models (`a2v.lab.evaluation.standing`): slide of toes in contact,
float and penetration. Besides, for each clip: the fastest moment of any joint (a *statue* has none
over .3 m/s), the longest time at the end of five seconds without any joint over 5 mm/s (*frozen*),
the natural length, and the distance between seeds. Sorted by slide, the worst first.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.io import atomic_path
from a2v.lab.evaluation.physics import contact_speeds
from a2v.lab.evaluation.standing import FPS, SECONDS
from a2v.motion.acting import natural_seconds
from a2v.motion.clips import SOURCE, clip_library
from a2v.motion.medley import make_sourced
from a2v.motion.prompts import Step

STATUE = 0.3
"""Speed in meters per second that a person's joint reaches now and then."""
FROZEN = 0.005
"""Speed of joints below which a person is frozen, meters per second."""
FROZEN_SECONDS = 0.5
SHORT = 1.2
"""Shortest natural length that people can see, seconds."""


@dataclass(frozen=True)
class Row:
    """Measures of one clip: meters and seconds."""

    name: str
    slide: float
    fastest: float
    frozen: float
    seconds: float
    spread: float
    pace: float


def measured(name: str, seeds: int) -> Row:
    """Measure a clip of `SECONDS` with several seeds."""
    library = clip_library()
    step = Step(action=name, source=SOURCE)
    frames = round(SECONDS * FPS)
    made = [
        make_sourced([step], frames=frames, fps=FPS, seed=seed).joints.astype(np.float64)
        for seed in range(seeds)
    ]
    speeds = [np.linalg.norm(np.diff(clip, axis=0), axis=-1).max(axis=1) * FPS for clip in made]
    frozen = [
        float(len(speed) - 1 - (np.flatnonzero(speed > FROZEN).max(initial=-1))) / FPS
        for speed in speeds
    ]
    placed = np.stack([clip - clip[:1, :1] * [1, 0, 1] for clip in made])
    apart = [
        float(np.linalg.norm(placed[a] - placed[b], axis=-1).mean())
        for a in range(seeds)
        for b in range(a)
    ]
    feet = [library.skeleton.joint_names.index(f"ball_{side}") for side in "lr"]
    standing = np.concatenate([contact_speeds(clip[:, feet], FPS) for clip in made])
    air = library.clips[library.index(name)].air
    slide = float(np.median(standing)) if len(standing) and not air else 0.0
    way = made[0][-1, 0] - made[0][0, 0]
    return Row(
        name,
        slide,
        float(min(speed.max() for speed in speeds)),
        max(frozen),
        natural_seconds(Step(action=library.clips[library.index(name)].name, source=SOURCE)),
        float(np.median(apart)) if apart else 0.0,
        float(np.hypot(way[0], way[2])) / SECONDS,
    )


def main() -> None:
    """Print a summary, write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rows = sorted(
        (measured(name, given.seeds) for name in clip_library().actions),
        key=lambda row: -row.slide,
    )
    statues = [row.name for row in rows if row.fastest < STATUE]
    frozen = [row.name for row in rows if row.frozen > FROZEN_SECONDS]
    short = [row.name for row in rows if row.seconds < SHORT]
    alike = [row.name for row in rows if row.spread < 0.01]
    summary = (
        f"{len(rows)} clips: slide in contact median {100 * np.median([r.slide for r in rows]):.1f} "
        f"cm/s, worst {100 * rows[0].slide:.0f} ({rows[0].name}), over 40: "
        f"{sum(row.slide > 0.4 for row in rows)}; statues {len(statues)} ({', '.join(statues)}); "
        f"frozen for more than half a second at the end of 5 s: {len(frozen)} "
        f"({', '.join(frozen)}); shorter than 1.2 s: {len(short)} ({', '.join(short)}); seeds less "
        f"than 1 cm apart: {len(alike)} ({', '.join(alike)})."
    )
    print(summary)
    if given.out is not None:
        lines = [
            "| Clip | Slide cm/s | Fastest m/s | Frozen s | Length s | Seeds apart cm | Travels m/s |",
            "|---|---|---|---|---|---|---|",
            *(
                f"| {r.name} | {100 * r.slide:.0f} | {r.fastest:.2f} | {r.frozen:.1f} | "
                f"{r.seconds:.1f} | {100 * r.spread:.1f} | {r.pace:.2f} |"
                for r in rows
            ),
        ]
        with atomic_path(given.out) as temporary:
            temporary.write_text("\n".join([*lines, "", summary]) + "\n")


if __name__ == "__main__":
    main()

"""A simple reader of BVH files that uses nothing of the library."""

from __future__ import annotations

from pathlib import Path

import numpy as np


class Bvh:
    """Joints, channels and angles as the file has them."""

    def __init__(self, path: Path):
        head, _, body = path.read_text().partition("MOTION")
        self.names: list[str] = []
        self.channels: dict[str, list[str]] = {}
        for line in head.splitlines():
            words = line.split()
            if words and words[0] in ("ROOT", "JOINT"):
                self.names.append(words[1])
            elif words and words[0] == "CHANNELS":
                self.channels[self.names[-1]] = words[2:]
        self.table = np.array(
            [
                [float(word) for word in line.split()]
                for line in body.splitlines()[3:]
                if line.strip()
            ]
        )

    def _columns(self, name: str) -> np.ndarray:
        start = 0
        for joint in self.names:
            width = len(self.channels[joint])
            if joint == name:
                return self.table[:, start : start + width]
            start += width
        raise KeyError(name)

    def positions(self, name: str) -> np.ndarray:
        """(T, 3) in the file's units."""
        return self._columns(name)[
            :, [self.channels[name].index(f"{axis}position") for axis in "XYZ"]
        ]

    def rotations(self) -> dict[str, np.ndarray]:
        """Local rotation matrices (T, 3, 3) of every joint."""
        made = {}
        for name in self.names:
            total = np.tile(np.eye(3), (len(self.table), 1, 1))
            for channel, angles in zip(
                self.channels[name], np.deg2rad(self._columns(name)).T, strict=True
            ):
                if channel.endswith("rotation"):
                    a, b = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[channel[0]]
                    turn = np.tile(np.eye(3), (len(angles), 1, 1))
                    turn[:, a, a] = turn[:, b, b] = np.cos(angles)
                    turn[:, b, a] = np.sin(angles)
                    turn[:, a, b] = -np.sin(angles)
                    total = total @ turn
            made[name] = total
        return made

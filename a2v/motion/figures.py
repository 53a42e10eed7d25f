"""Actions that are named after the path that they walk.

The model learned them from windows of a few seconds. It walks curves, but it does not close the
figure as a whole. Such an action is therefore sampled along its path, as if the user had given that
path.
"""

from __future__ import annotations

import numpy as np

from a2v.motion.ways import GroundPath, way_along

FIGURE_EIGHT = "Walk a figure eight"
NATURAL_SECONDS = {FIGURE_EIGHT: 10.0}
"""Seconds of each of these actions if no length is given: the circles of the figure then have about
1.5 m."""

STEADY = {"Run": 3.5, "Jog": 3.36}
"""Speed of the recordings, meters per second, of actions whose recordings are shorter than a clip:
they last 1.3 s, so that clips of several windows stop in between (Run had .51 of that speed). They
are sampled along a straight path."""
STEADY_SPREAD = 0.1
"""Standard deviation of the logarithm of the speed of a seed relative to it."""

LEAST_RADIUS = 0.55
"""Meters. A tighter circle makes people step sideways."""
GREATEST_RADIUS = 4.0
"""Meters. A longer motion repeats the figure instead of enlarging it."""
_POINTS = 96
_HALVINGS = 12


def figure_eight(radius: float, *, rounds: int = 1) -> GroundPath:
    """Two circles that touch, walked in opposite directions, from the point where they meet.

    Parameters
    ----------
    radius : float
        Of each circle, meters.
    rounds : int
        Number of times that the whole figure is walked.

    Returns
    -------
    GroundPath
        It begins at the origin and leads ahead (+z); the first circle lies on the left (+x).
    """
    angle = np.linspace(0.0, 2 * np.pi, _POINTS + 1)[1:]
    left = np.stack([1 - np.cos(angle), np.sin(angle)], axis=-1)
    figure = np.concatenate([left, left * [-1, 1]])
    return GroundPath(radius * np.concatenate([np.zeros((1, 2)), np.tile(figure, (rounds, 1))]))


def natural_path(action: str, *, seconds: float, pace: float, fps: float) -> GroundPath | None:
    """Return the path of an action that is named after its path, with a length that takes
    `seconds`.

    Parameters
    ----------
    action : str
    seconds : float
        Length of the motion. The path takes this long or, at `LEAST_RADIUS`, longer.
    pace : float
        Meters per second on a straight line (`way_along` slows down in curves).
    fps : float
        Frame rate of the way.

    Returns
    -------
    GroundPath or None
        None for every other action.
    """
    if action != FIGURE_EIGHT:
        return None

    def took(radius: float, rounds: int) -> float:
        return len(way_along(figure_eight(radius, rounds=rounds), pace=pace, fps=fps).points) / fps

    seconds += 2 / fps  # whole frames at another rate; never shorter than requested
    rounds = 1
    while rounds < 8 and took(GREATEST_RADIUS, rounds) < seconds:
        rounds += 1
    low, high = LEAST_RADIUS, GREATEST_RADIUS
    if took(low, rounds) >= seconds:
        return figure_eight(low, rounds=rounds)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if took(middle, rounds) >= seconds else (middle, high)
    return figure_eight(high, rounds=rounds)

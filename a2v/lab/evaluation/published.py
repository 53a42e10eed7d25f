"""Published figures to stand beside ours: the journal paper's (its Tables 1, 2 and 4), and those of
later methods by ACTOR's protocol."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

PUBLISHED: Mapping[str, Mapping[str, tuple[float, float, float, float]]] = {
    "humanact12": {
        "Real motions": (0.092, 0.997, 6.853, 2.449),
        "CondGRU": (40.61, 0.08, 2.381, 2.341),
        "Two-stage GAN": (10.48, 0.421, 5.96, 2.805),
        "Act-MoCoGAN": (5.61, 0.793, 6.752, 1.055),
        "Dancing2Music": (3.832, 0.145, 6.523, 6.313),
        "LatentTransition": (3.553, 0.471, 6.58, 4.387),
        "plain": (3.299, 0.656, 6.742, 4.248),
        "lie": (2.458, 0.923, 7.032, 2.87),
        "glmi-m": (2.157, 0.835, 6.986, 3.633),
        "glmi-r": (2.349, 0.831, 7.001, 3.607),
    },
    "humanact12-fine": {
        "Real motions": (0.133, 0.991, 7.001, 2.666),
        "CondGRU": (33.91, 0.034, 3.779, 3.469),
        "Two-stage GAN": (6.956, 0.397, 6.151, 2.694),
        "Act-MoCoGAN": (2.468, 0.832, 6.891, 0.878),
        "Dancing2Music": (3.484, 0.029, 6.567, 6.406),
        "LatentTransition": (2.123, 0.397, 6.64, 4.59),
        "plain": (1.329, 0.56, 6.756, 4.487),
        "lie": (1, 0.776, 6.783, 3.508),
        "glmi-m": (0.739, 0.787, 6.783, 3.301),
        "glmi-r": (0.957, 0.767, 6.924, 3.303),
    },
    "cmu": {
        "Real motions": (0.064, 0.936, 6.13, 2.726),
        "CondGRU": (51.72, 0.093, 0.792, 0.752),
        "Two-stage GAN": (14.34, 0.179, 4.419, 1.623),
        "Act-MoCoGAN": (11.15, 0.445, 5.28, 1.516),
        "Dancing2Music": (6.882, 0.138, 4.772, 4.289),
        "LatentTransition": (12.85, 0.389, 5.856, 4.639),
        "plain": (2.994, 0.378, 5.791, 5.006),
        "lie": (2.885, 0.686, 6.509, 4.126),
        "glmi-m": (2.448, 0.665, 6.374, 4.093),
        "glmi-r": (2.519, 0.675, 6.484, 4.073),
    },
    # this is how LatentTransition's row is printed: it repeats Dancing2Music's of CMU
    "ntu_vibe": {
        "Real motions": (0.031, 0.999, 7.108, 2.194),
        "CondGRU": (28.31, 0.078, 3.663, 3.578),
        "Two-stage GAN": (13.86, 0.202, 5.328, 3.49),
        "Act-MoCoGAN": (2.723, 0.997, 6.92, 0.907),
        "Dancing2Music": (3.461, 0.075, 6.562, 6.556),
        "LatentTransition": (6.882, 0.138, 4.772, 4.289),
        "plain": (0.54, 0.832, 6.926, 3.443),
        "lie": (0.33, 0.949, 7.065, 2.052),
    },
}
"""FID, accuracy, diversity and multimodality by data set and row; 20 repeats of 3,000 clips,
generated actions are equally frequent. Those of CondGRU are as frequent as in the data: its
published loader takes the labels of real clips."""

PUBLISHED_ACTIONS: Mapping[str, Mapping[str, Mapping[str, tuple[float, float, float]]]] = {
    "cmu": {
        "Walk": {
            "Real motions": (0.148, 0.999, 2.618),
            "plain": (6.659, math.nan, 4.379),
            "lie": (5.392, math.nan, 4.200),
            "glmi-r": (2.096, math.nan, 3.471),
            "glmi-m": (1.183, math.nan, 3.059),
        },
        "Jump": {
            "Real motions": (0.135, 0.999, 2.711),
            "plain": (13.14, 0.226, 5.412),
            "lie": (7.233, 0.523, 5.398),
            "glmi-r": (3.796, 0.749, 4.662),
            "glmi-m": (4.443, 0.715, 4.747),
        },
    }
}
"""FID, accuracy and diversity of single actions (the journal's Table 4); 500 clips. NaN for figures
that are missing in our copy of the table. It has the accuracies .786 and .930 of Walk, but not
their rows."""

PUBLISHED_ACTOR: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "humanact12": {
        "Action2Motion": (0.338, 0.917),
        "ACTOR": (0.120, 0.955),
        "INR": (0.088, 0.973),
        "MDM": (0.100, 0.990),
        "MLD": (0.077, 0.964),
        "LMM": (0.065, 0.992),
    }
}
"""FID and accuracy by ACTOR's protocol (`--protocol actor`), as these methods' papers print them:
Petrovich et al. 2021, Cervantes et al. 2022, Tevet et al. 2023, Chen et al. 2023, Zhang et al.
2024. Real motions have an FID of .02 to .05 and an accuracy of .99 there."""


def published_action_table(dataset: str, actions: Iterable[str]) -> str:
    """The published rows of single actions side by side as Markdown; "" if the papers have no rows
    of one of the actions."""
    known = PUBLISHED_ACTIONS.get(dataset, {})
    chosen = [name for name in actions if name in known]
    if not chosen:
        return ""
    head = [
        f"{action} {metric}" for action in chosen for metric in ("FID↓", "Accuracy↑", "Diversity→")
    ]
    lines = [f"| Published | {' | '.join(head)} |", "|---" * (len(head) + 1) + "|"]
    for row in known[chosen[0]]:
        values = [value for action in chosen for value in known[action][row]]
        lines.append(
            f"| {row} | "
            f"{' | '.join('–' if math.isnan(value) else f'{value:.3f}' for value in values)} "
            "|"
        )
    return "\n".join(lines)


def published_table(dataset: str) -> str:
    """The rows of a data set as Markdown, "" if the papers have none."""
    rows = PUBLISHED.get(dataset, {})
    lines = ["| Published | FID↓ | Accuracy↑ | Diversity→ | MModality→ |", "|---|---|---|---|---|"]
    lines += [
        f"| {name} | {' | '.join(f'{value:.3f}' for value in values)} |"
        for name, values in rows.items()
    ]
    return "\n".join(lines) if rows else ""


def published_actor_table(dataset: str) -> str:
    """The rows by ACTOR's protocol as Markdown, "" if there are none of this data set."""
    rows = PUBLISHED_ACTOR.get(dataset, {})
    lines = ["| Published | FID↓ | Accuracy↑ |", "|---|---|---|"]
    lines += [f"| {name} | {fid:.3f} | {accuracy:.3f} |" for name, (fid, accuracy) in rows.items()]
    return "\n".join(lines) if rows else ""

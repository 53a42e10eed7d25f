"""Tables of the benchmark, and all data to reproduce them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from a2v.body.limbs import LIMBS
from a2v.lab.evaluation.metrics import confidence_interval
from a2v.lab.evaluation.reconstruction.methods import Outcome
from a2v.lab.evaluation.reconstruction.settings import (
    FIT_METRICS,
    METRICS,
    SPLIT,
    BenchmarkSettings,
)
from a2v.lab.studio.settings import VERSION
from a2v.lab.studio.studio import Studio
from a2v.lab.studio.variation import REPORT_IDENTITIES, VALIDATION_IDENTITIES
from a2v.version import __version__


def _cell(values: Sequence[float], decimals: int, interval: bool = True) -> str:
    mean, half = confidence_interval(np.asarray(values))
    return (
        f"{mean:.{decimals}f} ± {half:.{decimals}f}"
        if interval and len(values) > 1
        else f"{mean:.{decimals}f}"
    )


def method_table(outcomes: Sequence[Outcome], memory: Mapping[str, float]) -> str:
    """All metrics by method: mean ± half width of the 95 % interval over the photos; seconds by
    stage, and peak memory."""
    good = [outcome for outcome in outcomes if not outcome.failure]
    head = [label for label, _ in METRICS.values()]
    lines = [
        f"| Method | {' | '.join(head)} | Shape s | Color s | All s | Peak MiB |",
        "|---" * (len(head) + 5) + "|",
    ]
    for name in good[0].scores if good else ():
        cells = [
            _cell([outcome.scores[name][metric] for outcome in good], decimals)
            for metric, (_, decimals) in METRICS.items()
        ]
        stages = [
            np.mean([outcome.seconds[name][stage] for outcome in good])
            for stage in ("shape", "color")
        ]
        whole = np.mean([sum(outcome.seconds[name].values()) for outcome in good])
        peak = f"{memory[name]:.0f}" if name in memory else "–"
        lines.append(
            f"| {name} | {' | '.join(cells)} "
            f"| {stages[0]:.1f} | {stages[1]:.1f} | {whole:.1f} | {peak} |"
        )
    return "\n".join(lines)


def group_table(outcomes: Sequence[Outcome], method: str, by: str) -> str:
    """Means of one method by "identity" (people who are held out, MakeHuman's one by one; "others"
    wear the held-out outfit), "outfit" or "pose".
    """
    lines = [
        f"| {by} | photos | {' | '.join(label for label, _ in METRICS.values())} |",
        "|---" * (len(METRICS) + 2) + "|",
    ]
    for key, members in sorted(_grouped(outcomes, by).items()):
        cells = [
            _cell([o.scores[method][metric] for o in members], decimals, interval=False)
            for metric, (_, decimals) in METRICS.items()
        ]
        lines.append(f"| {key} | {len(members)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def fit_table(outcomes: Sequence[Outcome]) -> str:
    """Means of the fit by pose, and over all photos."""
    lines = [
        f"| pose | photos | {' | '.join(label for label, _ in FIT_METRICS.values())} |",
        "|---" * (len(FIT_METRICS) + 2) + "|",
    ]
    everybody = [outcome for outcome in outcomes if not outcome.failure]
    for key, members in [*sorted(_grouped(everybody, "pose").items()), ("all", everybody)]:
        cells = [
            _cell([o.fit[metric] for o in members], decimals, interval=False)
            for metric, (_, decimals) in FIT_METRICS.items()
        ]
        lines.append(f"| {key} | {len(members)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def calibration(outcomes: Sequence[Outcome]) -> str:
    """One sentence on the correlation of the expected errors of limbs in depth with the true
    ones."""
    from scipy.stats import spearmanr

    rows = [
        (limb, outcome.fit[f"expected_{limb}"], outcome.fit[f"depth_{limb}"])
        for outcome in outcomes
        if not outcome.failure
        for limb in LIMBS
        if f"expected_{limb}" in outcome.fit
    ]
    if len(rows) < 3:
        return "No expected errors of limbs."
    told = []
    for name, kept in (
        ("all limbs", rows),
        ("arms and legs alone", [row for row in rows if row[0].endswith(("arm", "leg"))]),
    ):
        expected, true = (np.array([row[place] for row in kept]) for place in (1, 2))
        told.append(
            f"{name}: rank correlation {spearmanr(expected, true)[0]:.2f}, "
            f"expected {expected.mean():.1f} cm, true {true.mean():.1f} cm"
        )
    return f"Expected against true errors in depth, {'; '.join(told)}."


def _grouped(outcomes: Sequence[Outcome], by: str) -> dict[str, list[Outcome]]:
    """Photos without failure by "identity", "outfit" or "pose"."""
    groups: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        if not outcome.failure:
            key = {
                "identity": outcome.identity,
                "outfit": outcome.outfit,
                "pose": str(outcome.facts.get("pose", "")),
            }[by]
            if by == "identity" and not (
                key.startswith("MakeHuman_") or key in (*VALIDATION_IDENTITIES, *REPORT_IDENTITIES)
            ):
                key = "others"
            groups.setdefault(key, []).append(outcome)
    return groups


def report(
    outcomes: Sequence[Outcome],
    memory: Mapping[str, float],
    settings: BenchmarkSettings,
    studio: Studio,
) -> dict[str, Any]:
    """All data to reproduce the tables, and the values of every photo, as JSON."""
    return {
        "protocol": dataclasses.asdict(settings) | {"split": SPLIT},
        "studio": {"version": VERSION, "settings": dataclasses.asdict(studio.settings)},
        "versions": {"a2v": __version__, "numpy": np.__version__},
        "peak_memory_mib": dict(memory),
        "failed": sum(bool(outcome.failure) for outcome in outcomes),
        "photos": [dataclasses.asdict(outcome) for outcome in outcomes],
    }

"""``report.json``: settings, times and memory of a result."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from a2v.io import sha256
from pipelines.answer import plain
from pipelines.engine.executors import cpu_count
from pipelines.engine.run import Outcome

PACKAGES = (
    "a2v",
    "numpy",
    "scipy",
    "torch",
    "onnxruntime",
    "mediapipe",
    "opencv-contrib-python",
    "anny",
    "open3d-cpu",
    "open3d",
    "pymeshlab",
    "mitsuba",
    "drjit",
    "mitsuba-oidn",
    "av",
    "pipefunc",
    "joblib",
)
"""Packages whose versions a result depends on."""


def make_report(
    outcome: Outcome,
    *,
    command: str,
    parameters: Mapping[str, Any],
    inputs: Mapping[str, str | os.PathLike[str]],
    outputs: Iterable[Path] = (),
) -> dict[str, Any]:
    """Return the report of a run as JSON.

    Parameters
    ----------
    outcome : Outcome
    command : str
    parameters : everything that was set, seeds included
    inputs : files that were read, by role (photo, motion model...)
    outputs : files that were written
    """
    nodes = {
        name: {
            "calls": stats.calls,
            "remembered": stats.cached,
            "seconds": round(stats.seconds, 3),
            "cpu_seconds": round(stats.cpu_seconds, 3),
            "span_seconds": round(max(stats.span[1] - stats.span[0], 0.0), 3),
            "peak_memory_mb": round(stats.peak_memory / 1e6, 1),
            "notes": stats.notes,
            "measures": stats.measures,
        }
        for name, stats in outcome.nodes.items()
    }
    return {
        "command": command,
        "seconds": round(outcome.seconds, 3),
        "peak_memory_mb": round(outcome.peak_memory / 1e6, 1),
        "parameters": plain(parameters),
        "inputs": {
            role: {"path": str(path), "sha256": sha256(path)} for role, path in inputs.items()
        },
        "outputs": {
            path.name: {"bytes": path.stat().st_size, "sha256": sha256(path)} for path in outputs
        },
        "nodes": nodes,
        "notes": list(outcome.notes),
        "versions": versions(),
        "machine": {"platform": platform.platform(), "cores": cpu_count()},
        "store": str(outcome.store.folder),
    }


def versions() -> dict[str, str]:
    """Return the versions of Python and of packages that matter, and the commit of a checkout."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    try:
        root = Path(__file__).resolve().parents[1]
        if (root / ".git").exists():
            found["commit"] = subprocess.run(
                ["git", "-C", str(root), "rev-parse", "HEAD"],
                capture_output=True,
                text=True,
                check=True,
            ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        pass
    return found


def table(outcome: Outcome) -> str:
    """Return the times and the memory of the nodes as text."""
    lines = [f"{'node':<12}{'calls':>6}{'remembered':>12}{'seconds':>9}{'cpu s':>8}{'peak MB':>9}"]
    for name, stats in outcome.nodes.items():
        lines.append(
            f"{name:<12}{stats.calls:>6}{stats.cached:>12}{stats.seconds:>9.2f}{stats.cpu_seconds:>8.2f}{stats.peak_memory / 1e6:>9.0f}"  # noqa: E501
        )
    lines.append(
        f"{'all':<12}{'':>6}{'':>12}{outcome.seconds:>9.2f}{sum(stats.cpu_seconds for stats in outcome.nodes.values()):>8.2f}{outcome.peak_memory / 1e6:>9.0f}"  # noqa: E501
    )
    return "\n".join(lines)

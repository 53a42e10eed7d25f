"""Packages of npm that tests need, in ignored folders."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def npm_folder(name: str, *packages: str) -> Path:
    """``build/<name>`` with the packages installed; the test is skipped without them."""
    folder = ROOT / "build" / name
    done_before = folder / f".{'-'.join(packages).replace('/', '-')}"
    if done_before.exists():
        return folder
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip(f"{', '.join(packages)}: npm is not installed")
    folder.mkdir(parents=True, exist_ok=True)
    command = [
        npm,
        "install",
        "--no-audit",
        "--no-fund",
        "--silent",
        "--prefix",
        str(folder),
        *packages,
    ]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    except subprocess.TimeoutExpired:
        pytest.skip(f"the npm registry gave no {', '.join(packages)} in time")
    if done.returncode:
        pytest.skip(f"the npm registry gave no {', '.join(packages)}: {done.stderr.strip()[-200:]}")
    done_before.touch()
    return folder

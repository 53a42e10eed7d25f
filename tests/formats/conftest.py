from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def python_with(*modules: str) -> str:
    """A Python with bpy and the named packages; the test is skipped without one.

    It is $A2V_BLENDER_PYTHON, this one, or that of build/bpy.
    """
    for python in (
        os.environ.get("A2V_BLENDER_PYTHON"),
        sys.executable,
        str(ROOT / "build" / "bpy" / "bin" / "python"),
    ):
        if python and Path(python).exists():
            done = subprocess.run(
                [python, "-c", f"import {', '.join(modules)}"],
                capture_output=True,
                timeout=120,
                check=False,
            )
            if done.returncode == 0:
                return python
    pytest.skip(
        f"no Python with {', '.join(modules)}; python3.11 -m venv build/bpy && build/bpy/bin/pip "
        "install bpy bpy-vrm-format, or set A2V_BLENDER_PYTHON"
    )


@pytest.fixture(scope="session")
def blender() -> str:
    """A Python with Blender."""
    return python_with("bpy")


@pytest.fixture(scope="session")
def vrm_addon() -> str:
    """A Python with Blender and its VRM add-on."""
    return python_with("bpy", "io_scene_vrm")

"""A working folder full of files that must never be executed."""

from __future__ import annotations

import sys
from pathlib import Path

PACKAGES = (
    "a2v",
    "pipelines",
    "export",
    "numpy",
    "scipy",
    "torch",
    "mitsuba",
    "drjit",
    "anny",
    "cv2",
    "mediapipe",
    "onnxruntime",
    "numba",
    "open3d",
    "distributed",
    "joblib",
    "pipefunc",
    "cloudpickle",
    "tqdm",
    "psutil",
    "yaml",
    "av",
    "PIL",
    "sitecustomize",
    "usercustomize",
)


def set_traps(folder: Path, marks: Path) -> None:
    """Fill `folder` with modules that write their names to `marks` on import.

    They have the names of modules of the standard library and of a2v.
    """
    folder.mkdir(parents=True, exist_ok=True)
    trap = f"open({str(marks)!r}, 'a').write(__name__ + chr(10))\n"
    for name in {*sys.stdlib_module_names, *PACKAGES}:
        (folder / f"{name}.py").write_text(trap)
    for name in ("a2v", "pipelines"):
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(trap)

"""`sample.py` runs with one model file in an environment with only numpy and onnxruntime."""

from __future__ import annotations

import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from a2v.motion import BUNDLED, MotionModel
from a2v.sessions import WEIGHTS
from a2v.types import Motion
from export import sample as sample_script


def needs(
    name: str, found: dict[str, importlib.metadata.Distribution] | None = None
) -> dict[str, importlib.metadata.Distribution]:
    """The installed distribution called `name` and those it requires without extras, by name."""
    found = {} if found is None else found
    if name not in found:
        found[name] = importlib.metadata.distribution(name)
        for line in found[name].requires or []:
            if "extra ==" not in line:
                needs(re.split(r"[^A-Za-z0-9._-]", line)[0].lower(), found)
    return found


@pytest.fixture(scope="module")
def empty(tmp_path_factory):
    """A virtual environment with only numpy and onnxruntime, and a folder to work in.

    The environment links to the installed files of these packages. The folder has script and model.
    """
    folder = tmp_path_factory.mktemp("empty")
    subprocess.run(
        [sys.executable, "-m", "venv", "--without-pip", "--symlinks", str(folder / "venv")],
        check=True,
    )
    python = folder / "venv" / "bin" / "python"
    where = "import sysconfig; print(sysconfig.get_paths()['purelib'])"
    packages = Path(
        subprocess.run(
            [python, "-I", "-c", where], capture_output=True, text=True, check=True
        ).stdout.strip()
    )
    assert not list(packages.iterdir())
    for distribution in [*needs("numpy").values(), *needs("onnxruntime").values()]:
        for top in {
            file.parts[0]
            for file in distribution.files or []
            if file.parts[0] not in ("..", "__pycache__")
        }:
            target = packages / top
            if not target.exists():
                target.symlink_to(distribution.locate_file(top))
    shutil.copy(sample_script.__file__, folder / "sample.py")
    shutil.copy(WEIGHTS / BUNDLED["humanact12"], folder / "model.onnx")
    return folder, python


def run(empty, *arguments, code=0):
    folder, python = empty
    clean = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "VIRTUAL", "A2V"))
    }
    result = subprocess.run(
        [python, *arguments], cwd=folder, env=clean, capture_output=True, text=True, timeout=120
    )
    assert result.returncode == code, result.stderr
    return result


def test_the_environment_is_empty(empty):
    code = "import importlib.util as u, json; print(json.dumps({n: u.find_spec(n) is not None for n in %r}))"
    names = ["torch", "scipy", "a2v", "export", "onnx", "matplotlib", "pip", "numpy", "onnxruntime"]
    found = json.loads(run(empty, "-c", code % names).stdout)
    assert found == {name: name in ("numpy", "onnxruntime") for name in names}


def test_usage_and_contents_are_printed(empty):
    assert "--action" in run(empty, "sample.py", "--help").stdout
    said = run(empty, "sample.py", "model.onnx").stdout
    assert "warm_up" in said
    assert "license" in said


def test_the_file_alone_makes_the_same_motions_as_the_library(empty):
    folder, _ = empty
    run(
        empty,
        "sample.py",
        "model.onnx",
        "--action",
        "walk,jump",
        "--frames",
        "130",
        "--count",
        "2",
        "--seed",
        "5",
        "--out",
        "m.npz",
    )
    made = Motion.load(folder / "m.npz")
    expected = MotionModel.load(folder / "model.onnx").sample(
        ["walk", "jump"], frames=130, count=2, seed=5
    )
    assert np.abs(made.joints - expected.joints).max() < 1e-4
    assert made.joint_names == expected.joint_names
    run(
        empty,
        "sample.py",
        "model.onnx",
        "--action",
        "sit",
        "--frames",
        "20",
        "--bone-scale",
        "1.2",
        "--out",
        "m.bvh",
    )
    from a2v.formats.bvh import read_bvh

    motion = read_bvh(folder / "m.bvh")
    expected = MotionModel.load(folder / "model.onnx").sample("sit", frames=20, bone_scale=1.2)
    order = [motion.joint_names.index(name) for name in expected.joint_names]
    assert (
        np.abs(
            (motion.joints[:, order] - motion.joints[0, order[0]])
            - (expected.joints - expected.joints[0, 0])
        ).max()
        < 1e-3
    )


def test_bad_input_is_one_line(empty):
    said = run(
        empty, "sample.py", "model.onnx", "--action", "wlak", "--out", "x.npz", code=2
    ).stderr
    assert "did you mean walk" in said
    assert said.count("\n") == 1

"""What moves between kernels and threads: ``python -m benchmarks.kernels [--actions 20]``.

The sample person is made from the photo, `--actions` actions are sampled and retargeted, and two
models are scored, in one child process for each setting, each with an empty store. Rows are the
largest distances from the first setting: joints of the photo's fit, of the fit to the surface, of
sampled and of retargeted motions (mm), mean color of the surface (of 255), and FID and accuracy.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import a2v
from a2v.animation import retarget
from a2v.io import read_npz, write_npz
from a2v.lab.datasets import load_dataset
from a2v.lab.evaluation.classifier import load_evaluator
from a2v.lab.evaluation.protocol import EvaluationSettings, evaluate
from a2v.lab.evaluation.sources import generator_of
from a2v.motion import MotionModel
from a2v.motion.catalog import catalog
from pipelines.engine.store import Store
from scripts.make_ready_person import made_now

SETTINGS: dict[str, dict[str, str]] = {
    "as it is, one thread": {},
    "PyTorch default": {"ATEN_CPU_CAPABILITY": "default"},
    "PyTorch AVX2": {"ATEN_CPU_CAPABILITY": "avx2"},
    "OpenBLAS Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "OpenBLAS Nehalem": {"OPENBLAS_CORETYPE": "Nehalem"},
    "numpy without AVX-512": {
        "NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL"
    },
    "2 threads": {"OMP_NUM_THREADS": "2"},
    "4 threads": {"OMP_NUM_THREADS": "4"},
}
CLIPS = EvaluationSettings(clips=600, repeats=2, physics_clips=0)


def measure(out: Path, data: Path, actions: int) -> None:
    """Write what this process makes."""
    made: dict[str, np.ndarray] = {}
    with tempfile.TemporaryDirectory() as folder:
        ready = made_now(Store(folder))
        made["fit to the photo, mm"] = 1000 * ready.photo_body.bone_transforms[:, :3, 3]
        made["fit to the surface, mm"] = 1000 * ready.body.bone_transforms[:, :3, 3]
        made["mean color, of 255"] = 255 * ready.colored_surface.colors.mean(axis=0)
        names = [entry.name for entry in catalog("any").entries]
        for name in names[:: max(len(names) // actions, 1)][:actions]:
            motion = a2v.make_motion(name, seconds=2, cache=folder).motion
            poses = retarget(motion, ready.character.body)
            made[f"sampled motions, mm/{name}"] = 1000 * motion.joints
            made[f"retargeted bones, mm/{name}"] = 1000 * poses[..., :3, 3]
    for model, classifier in (
        ("cmu", "action_recognition_model_mocap_new.tar"),
        ("humanact12-lie", "action_recognition_model_humanact12.tar"),
    ):
        dataset = load_dataset(model.partition("-")[0], data)
        generate = generator_of(MotionModel.load(model), dataset.length)
        rows = evaluate(
            {model: generate}, dataset, load_evaluator(data / "evaluators" / classifier), CLIPS
        )
        made[f"FID/{model}"] = np.array(rows[-1].values["fid"][0])
        made[f"accuracy/{model}"] = np.array(rows[-1].values["accuracy"][0])
    write_npz(out, {name: np.asarray(value, np.float64) for name, value in made.items()})


def main() -> None:
    """Run the settings and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--actions", type=int, default=20)
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child is not None:
        measure(options.child, options.data, options.actions)
        return
    first: dict[str, np.ndarray] = {}
    for setting, variables in SETTINGS.items():
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "made.npz"
            words = ["--child", out, "--data", options.data, "--actions", options.actions]
            subprocess.run(
                [sys.executable, "-m", "benchmarks.kernels", *map(str, words)],
                env=os.environ | {"OMP_NUM_THREADS": "1"} | variables,
                stdout=subprocess.DEVNULL,
                check=True,
            )
            made = dict(read_npz(out))
        if not first:
            first = made
            kinds = list(dict.fromkeys(name.partition("/")[0] for name in made))
            print(f"| setting | {' | '.join(kinds)} |\n|---|{'---|' * len(kinds)}")
        apart = dict.fromkeys(kinds, 0.0)
        for name, value in made.items():
            kind, other = name.partition("/")[0], first[name]
            gap = np.abs(value - other)
            if "mm" in kind:
                gap = np.linalg.norm(value - other, axis=-1)
            apart[kind] = max(apart[kind], float(gap.max()))
        print(f"| {setting} | {' | '.join(f'{apart[kind]:.3g}' for kind in kinds)} |", flush=True)


if __name__ == "__main__":
    main()

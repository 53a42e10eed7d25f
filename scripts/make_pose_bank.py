"""Make the bank of poses that a fit starts from, ``a2v/body/data/pose_bank_anny.npz``.

    python scripts/make_pose_bank.py --data ../shared/data --out a2v/body/data/pose_bank_anny.npz

Frames of the papers' CMU set, without their heading, become angles of Anny's rig by inverse
kinematics, as in `scripts/fit_pose_prior.py`. Only poses whose joints are far apart from each other
are kept (farthest points); a pose and its mirror image count as one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from fit_pose_prior import UNSEEN, inverse_kinematics

from a2v.body import load_body_model
from a2v.body.pose_bank import QUANTUM
from a2v.body.pose_space import pose_space
from a2v.io import sha256, write_npz
from a2v.lab.datasets import load_cmu


def without_heading(joints: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Joints (N, J, 3) turned about the vertical so that the hips' left is +x, moved to the pelvis,
    with a trunk of length 1."""
    place = {name: index for index, name in enumerate(names)}
    pelvis = joints[:, place["pelvis"]]
    across = joints[:, place["left_hip"]] - joints[:, place["right_hip"]]
    angle = np.arctan2(across[:, 2], across[:, 0])
    cosine, sine = np.cos(angle), np.sin(angle)
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    turn = np.stack(
        [
            np.stack(row, -1)
            for row in ((cosine, zero, sine), (zero, one, zero), (-sine, zero, cosine))
        ],
        axis=-2,
    )
    trunk = np.linalg.norm(joints[:, place["neck"]] - pelvis, axis=1)
    turned: np.ndarray = (
        np.einsum("nij,nkj->nki", turn, joints - pelvis[:, None]) / trunk[:, None, None]
    )
    return turned


def farthest(points: np.ndarray, mirrored: np.ndarray, count: int) -> np.ndarray:
    """Return indices (count,) of points (N, D), each the farthest from the earlier ones.

    Their mirror images (N, D) count as well.
    """
    nearest = np.full(len(points), np.inf)
    chosen = [0]
    while len(chosen) < count:
        last = chosen[-1]
        for other in (points[last], mirrored[last]):
            nearest = np.minimum(nearest, ((points - other) ** 2).sum(axis=1))
        chosen.append(int(nearest.argmax()))
    print(
        f"the farthest frame left is {np.sqrt(nearest.max() / (points.shape[1] / 3)):.3f} trunks a "
        "joint (rms) from the bank"
    )
    return np.array(chosen)


def main() -> None:
    """Make the file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--out", type=Path, default=Path("a2v/body/data/pose_bank_anny.npz"))
    parser.add_argument("--poses", type=int, default=2500)
    arguments = parser.parse_args()
    archive = arguments.data / "cmu_mocap.zip"
    dataset = load_cmu(archive)
    names = dataset.skeleton.joint_names
    joints = without_heading(
        np.concatenate([clip[::4] for clip in dataset.joints]).astype(np.float64), names
    )
    swap = [
        names.index(n.replace("left", "?").replace("right", "left").replace("?", "right"))
        for n in names
    ]
    mirrored = joints[:, swap] * [-1, 1, 1]
    chosen = farthest(
        joints.reshape(len(joints), -1), mirrored.reshape(len(joints), -1), arguments.poses
    )
    model = load_body_model("anny")
    space = pose_space(model)
    found = [
        inverse_kinematics(joints[chosen[start : start + 500]], names, model=model, space=space)
        for start in range(0, len(chosen), 500)
    ]
    angles, error, roots = (np.concatenate(values) for values in zip(*found, strict=True))
    good = error < 12.0
    print(
        f"{len(joints)} frames, {len(chosen)} chosen, {good.sum()} kept; bone directions agree to "
        f"{error[good].mean():.1f} degrees"
    )
    unseen = np.array([name.split("_", 1)[-1] in UNSEEN or name in UNSEEN for name in space.names])
    angles = np.where(unseen, space.natural, angles)[good]
    write_npz(
        arguments.out,
        {
            "angles": np.clip(np.rint(angles / QUANTUM), -127, 127).astype(np.int8),
            "roots": np.clip(np.rint(roots[good] / QUANTUM), -127, 127).astype(np.int8),
            "names": np.asarray(space.names),
            "source": np.asarray(
                "CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu), free for all uses; "
                f"sha256 of cmu_mocap.zip {sha256(archive)}"
            ),
        },
        compress=True,
    )


if __name__ == "__main__":
    main()

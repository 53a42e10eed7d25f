"""Fit the Gaussian mixture over body poses (Eq. 18) that `a2v.body.pose_prior` ships.

    python scripts/fit_pose_prior.py --data ../shared/data --out a2v/body/data/pose_prior_anny.npz

Frames of the papers' CMU set become angles of Anny's rig by inverse kinematics on bone directions,
batched in PyTorch; every pose is mirrored; joints that CMU's 20 joints do not show (twists, wrists,
ankles' roll) get the spread of everyday poses. The mixture is fitted by EM (scikit-learn).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch

from a2v.body import load_body_model
from a2v.body.anny import AnnyModel
from a2v.body.lbfgs import minimize
from a2v.body.pose_space import PoseSpace, pose_space
from a2v.body.terms import outside
from a2v.io import sha256, write_npz
from a2v.kinematics.so3 import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.lab.datasets import load_cmu

# (from, to) joints of CMU, (from, to) bones of Anny whose heads are these joints, weight (chosen by
# hand: feet and heads are shorter than limbs)
DIRECTIONS = [
    *(
        pair
        for side, letter in (("left", "L"), ("right", "R"))
        for pair in (
            (
                (f"{side}_hip", f"{side}_knee"),
                (f"upperleg01.{letter}", f"lowerleg01.{letter}"),
                1.0,
            ),
            ((f"{side}_knee", f"{side}_ankle"), (f"lowerleg01.{letter}", f"foot.{letter}"), 1.0),
            ((f"{side}_ankle", f"{side}_foot"), (f"foot.{letter}", f"toe3-1.{letter}"), 0.5),
            (
                (f"{side}_shoulder", f"{side}_elbow"),
                (f"upperarm01.{letter}", f"lowerarm01.{letter}"),
                1.0,
            ),
            ((f"{side}_elbow", f"{side}_wrist"), (f"lowerarm01.{letter}", f"wrist.{letter}"), 1.0),
        )
    ),
    (("right_hip", "left_hip"), ("upperleg01.R", "upperleg01.L"), 1.0),
    (("right_shoulder", "left_shoulder"), ("upperarm01.R", "upperarm01.L"), 1.0),
    (("pelvis", "neck"), ("root", "neck01"), 1.0),
    (("neck", "head"), ("neck01", "head"), 0.3),
]
UNSEEN = (
    "arm_twist",
    "forearm_twist",
    "wrist_bend",
    "wrist_deviate",
    "ankle_twist",
    "ankle_roll",
    "head_bend",
    "head_twist",
    "head_lean",
    "knee_twist",
    "collar_raise",
    "collar_push",
)


def inverse_kinematics(
    joints: np.ndarray,
    names: tuple[str, ...],
    *,
    model: AnnyModel,
    space: PoseSpace,
    steps: int = 120,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles of Anny's rig whose bones point like those of CMU's joints.

    Parameters
    ----------
    joints : (N, 20, 3)
    names : tuple of 20 str

    Returns
    -------
    angles : (N, D)
        Radians.
    error : (N,)
        Mean angle between the bones' directions, degrees.
    roots : (N, 3)
        Rotation vectors of the whole body.
    """
    place = {name: index for index, name in enumerate(names)}
    target = np.stack(
        [joints[:, place[last]] - joints[:, place[first]] for (first, last), _, _ in DIRECTIONS],
        axis=1,
    )
    target = torch.from_numpy(
        target / np.maximum(np.linalg.norm(target, axis=-1, keepdims=True), 1e-9)
    ).float()
    first = torch.tensor([model.bone(pair[0]) for _, pair, _ in DIRECTIONS])
    last = torch.tensor([model.bone(pair[1]) for _, pair, _ in DIRECTIONS])
    weight = torch.tensor([value for _, _, value in DIRECTIONS])
    heads = model.rest(torch.from_numpy(model.shape_default))[1]

    left = joints[:, place["left_hip"]] - joints[:, place["right_hip"]]
    up = joints[:, place["neck"]] - joints[:, place["pelvis"]]
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    left = left - up * (left * up).sum(axis=1, keepdims=True)
    left = left / np.maximum(np.linalg.norm(left, axis=1, keepdims=True), 1e-9)
    base = torch.from_numpy(
        rotmat_to_rotvec(np.stack([left, up, np.cross(left, up)], axis=-1))
    ).float()
    natural, spread, limits = (
        torch.from_numpy(value) for value in (space.natural, space.spread, space.limits)
    )
    root = torch.zeros(len(joints), 3, requires_grad=True)
    angles = natural.expand(len(joints), -1).clone().requires_grad_()

    def directions() -> torch.Tensor:
        rotmats = rotvec_to_rotmat(space.rotvecs(angles))
        root_rotmats = rotvec_to_rotmat(root) @ rotvec_to_rotmat(base)
        transforms = model.pose_bones(
            torch.cat([root_rotmats[:, None], rotmats[:, 1:]], dim=1), heads
        )
        vector = transforms[:, last, :3, 3] - transforms[:, first, :3, 3]
        return vector / vector.norm(dim=-1, keepdim=True)

    def loss() -> torch.Tensor:
        square = (weight * (directions() - target).square().sum(-1)).sum() / 0.05**2
        everyday = ((angles - natural) / (2 * spread)).square().sum()
        return square + 0.1 * everyday + outside(angles, limits, tolerance=0.05)

    minimize(loss, [root, angles], steps=steps, history=10)
    with torch.no_grad():
        cosine = (directions() * target).sum(-1).clamp(-1, 1)
        error = torch.rad2deg(torch.arccos(cosine)).mean(dim=1)
        turned = rotmat_to_rotvec(rotvec_to_rotmat(root) @ rotvec_to_rotmat(base))
    return angles.detach().numpy(), error.numpy(), turned.numpy()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--out", type=Path, default=Path("a2v/body/data/pose_prior_anny.npz"))
    parser.add_argument("--components", type=int, default=8)
    parser.add_argument(
        "--frames", type=int, default=6, help="at most this many frames of every clip"
    )
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    from sklearn.mixture import GaussianMixture

    rng = np.random.default_rng(arguments.seed)
    archive = arguments.data / "cmu_mocap.zip"
    dataset = load_cmu(archive)
    frames = np.concatenate(
        [
            clip[rng.choice(len(clip), size=min(len(clip), arguments.frames), replace=False)]
            for clip in dataset.joints
        ]
    )
    model = load_body_model("anny")
    space = pose_space(model)
    parts = [
        inverse_kinematics(
            frames[start : start + 500].astype(np.float64),
            dataset.skeleton.joint_names,
            model=model,
            space=space,
        )
        for start in range(0, len(frames), 500)
    ]
    angles, error, _ = (np.concatenate(values) for values in zip(*parts, strict=True))
    good = error < 12.0
    print(
        f"{len(frames)} frames; bone directions agree to {error.mean():.1f} degrees on average, "
        f"{np.percentile(error, 95):.1f} at the 95th percentile; kept {good.sum()}"
    )
    angles = angles[good]
    unseen = np.array([name.split("_", 1)[-1] in UNSEEN or name in UNSEEN for name in space.names])
    # What was not measured spreads like everyday poses; everything else gets the inverse
    # kinematics' own uncertainty.
    angles = angles + rng.normal(size=angles.shape) * np.where(unseen, space.spread, 0.06)
    angles = np.concatenate([angles, angles[:, space.mirror] * space.mirror_sign])
    order = rng.permutation(len(angles))
    held = order[: len(order) // 10]
    mixture = GaussianMixture(
        arguments.components,
        covariance_type="full",
        reg_covar=1e-3,
        max_iter=300,
        n_init=2,
        random_state=arguments.seed,
    )
    mixture.fit(angles[order[len(held) :]])
    print(
        f"log-likelihood per pose: training {mixture.score(angles[order[len(held) :]]):.2f}, held "
        f"out {mixture.score(angles[held]):.2f}; weights {np.round(mixture.weights_, 3)}"
    )
    write_npz(
        arguments.out,
        {
            "weights": mixture.weights_.astype(np.float32),
            "means": mixture.means_.astype(np.float32),
            "covariances": mixture.covariances_.astype(np.float32),
            "names": np.asarray(space.names),
            "source": np.asarray(
                "CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu), free for all uses; "
                f"sha256 of cmu_mocap.zip {sha256(archive)}; seed {arguments.seed}; {len(angles)} "
                "poses"
            ),
        },
        compress=True,
    )


if __name__ == "__main__":
    main()

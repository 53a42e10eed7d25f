# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Data and skeletons
#
# Motion data are joints over time in some frame and unit, on a tree of bones. This lecture shows
# them, and how rotations and positions belong together (Eq. 6). With the papers' data in a folder
# (`A2V_DATA`, else `../../shared/data`) the recorded clips are shown; without it, clips of the
# shipped model are used, so that every cell runs.

# %%
import os
import tempfile
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Video, display

from a2v import Motion
from a2v.formats.bvh import write_bvh
from a2v.kinematics import SKELETONS, bone_lengths, forward_kinematics, inverse_kinematics
from a2v.kinematics.so3 import hat, rotvec_to_rotmat
from a2v.lab.datasets import load_dataset
from a2v.lab.datasets.generated import generated_dataset
from a2v.motion import MotionModel
from a2v.rendering.stickfigure import (
    StickSettings,
    plot_path,
    plot_rows,
    project,
    save_stick_figures,
)

SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
DATA = Path(os.environ.get("A2V_DATA", "../../shared/data"))

# %% [markdown]
# ## A data set
# `load_dataset` reads the published archives without unpacking them and checks every clip. All data
# sets become the same type.

# %%
if DATA.is_dir():
    data = load_dataset("humanact12", DATA)
else:
    data = generated_dataset(MotionModel.load("humanact12"), clips=5 if SMALL else 40)
lengths = np.array([len(joints) for joints in data.joints])
print(
    f"{data.name}: {len(data)} clips of {len(set(data.subjects))} people, {data.fps:g} fps, "
    f"{len(data.actions)} actions"
)

figure, axes = plt.subplots(1, 2, figsize=(11, 3.2))
counts = np.bincount(data.labels, minlength=len(data.actions))
axes[0].barh(data.actions, counts, color="tab:blue")
axes[0].set(title="clips of each action")
axes[0].invert_yaxis()
axes[1].hist(lengths / data.fps, bins=30, color="tab:blue")
axes[1].axvline(data.length / data.fps, c="tab:red")
axes[1].set(title="length of the clips; red: what the papers generate", xlabel="s")
figure.tight_layout()

# %% [markdown]
# The actions are not equally frequent, and many clips are shorter than what is generated: such
# clips hold their last pose. Both matter when generated motions are compared with recorded ones
# (see the notebook on evaluation).
#
# ## Some clips
# Red is the person's left, blue the right; the shadow lies straight below the person.

# %%
shown = [int(np.flatnonzero(data.labels == label)[0]) for label in (1, 3, 6, 11)]
rows = plot_rows(
    [data.motion(i) for i in shown],
    titles=[data.actions[data.labels[i]] for i in shown],
    poses=8,
    settings=StickSettings(size=150),
)
display(rows)

# %%
walk = data.motion(shown[0])
display(plot_path(walk, title="the path of a walk"))
with tempfile.TemporaryDirectory() as folder:
    save_stick_figures(Path(folder) / "walk.mp4", walk)
    display(
        Video(
            str(Path(folder) / "walk.mp4"),
            embed=True,
            html_attributes="controls loop autoplay muted",
        )
    )

# %% [markdown]
# ## World and native frame
# a2v works in meters with y up and the person facing +z. The published files have other frames and
# units, which the published classifiers expect. `data.frame` is the conversion.

# %%
native = data.joints[shown[0]] * np.asarray(data.frame.signs, np.float32)
head, ankle = data.skeleton.index("head"), data.skeleton.index("left_ankle")
print(f"signs {data.frame.signs}, {data.frame.meters_per_unit:.3f} m a unit")
print(
    f"head above ankle: native {native[0, head, 1] - native[0, ankle, 1]:+.2f}, "
    f"world {walk.joints[0, head, 1] - walk.joints[0, ankle, 1]:+.2f} m"
)

# %% [markdown]
# ## A rotation is three numbers (Eq. 3 and 4)
# Rotations do not form a vector space: the sum of two rotation matrices is not a rotation. But each
# is the exponential of a skew-symmetric matrix, and those are three free numbers $\mathbf w$, which
# a network can output:
#
# $$\hat W = \begin{pmatrix} 0 & -w_3 & w_2 \\ w_3 & 0 & -w_1 \\ -w_2 & w_1 & 0 \end{pmatrix} \qquad
# R = \exp(\hat W) = I + \frac{\sin\lVert\mathbf w\rVert}{\lVert\mathbf w\rVert}\hat W +
# \frac{1-\cos\lVert\mathbf w\rVert}{\lVert\mathbf w\rVert^2}\hat W^2$$
#
# The direction of $\mathbf w$ is the axis, its length the angle. We check the closed form against
# the series $\sum_n \hat W^n/n!$ that it stands for. The picture shows why the angle of a network's
# output is bounded: vectors along one axis that differ by a whole turn are one rotation.

# %%
w = np.array([0.4, -1.1, 0.7])
angle, W = np.linalg.norm(w), hat(w)
closed = np.eye(3) + np.sin(angle) / angle * W + (1 - np.cos(angle)) / angle**2 * W @ W
series, term = np.eye(3), np.eye(3)
errors = []
for n in range(1, 18):
    term = term @ W / n
    series = series + term
    errors.append(np.abs(series - closed).max())
print(
    f"closed form against the library: {np.abs(closed - rotvec_to_rotmat(w)).max():.0e}; "
    f"R is a rotation: {np.abs(closed @ closed.T - np.eye(3)).max():.0e}"
)
turns = np.linspace(0, 4 * np.pi, 200)
figure, axes = plt.subplots(1, 2, figsize=(9, 2.6))
axes[0].semilogy(range(1, 18), errors, "o-")
axes[0].set(title="the series against the closed form", xlabel="terms")
axes[1].plot(turns / np.pi, rotvec_to_rotmat(turns[:, None] * w / angle)[:, :, 0])
axes[1].set(title="first column of R along one axis", xlabel="length of w / pi")
figure.tight_layout()

# %% [markdown]
# ## Skeletons
# A tree is covered by chains (Fig. 2 of the journal paper, Fig. 7 of the conference paper). A
# rotation vector at a joint turns the bone that ends there relative to the bone before it in its
# chain, and chains start from the identity; with all rotations zero the person stands in a T.

# %%
figure, axes = plt.subplots(1, 3, figsize=(13, 4.6))
for ax, (name, skeleton) in zip(axes, SKELETONS.items(), strict=True):
    zeros = np.zeros((skeleton.n_joints, 3))
    view = project(
        forward_kinematics(zeros, zeros[0], np.full(skeleton.n_joints, 0.25), skeleton), 12, 8
    )
    for number, chain in enumerate(skeleton.chains):
        ax.plot(*view[list(chain), :2].T, "o-", lw=3, ms=4, label=f"chain {number}")
    for joint, (x, y, _) in enumerate(view):
        ax.annotate(str(joint), (x, y), xytext=(3, 3), textcoords="offset points", fontsize=7)
    ax.set(title=f"{name}: {skeleton.n_joints} joints", aspect="equal")
    ax.axis("off")
    ax.legend(fontsize=6, loc="lower right")

# %% [markdown]
# ## Positions from rotations, and back (Eq. 6)
# Along chain $k$, joint $i$ is one bone farther than joint $i-1$, and that bone is turned by all
# previous rotations:
#
# $$\mathbf J_i^k = \Big[\prod_{j=0}^{i-1} \exp(\hat W_j^k)\Big]\,\mathbf d_i^k + \mathbf
# J_{i-1}^k$$
#
# where $\mathbf d_i^k$ is the bone at rest. This is the whole of forward kinematics, written out
# for one pose:


# %%
def eq6(rotations, root, lengths, skeleton):
    """Joints (J, 3) of rotation vectors (J, 3), the root's place and bone lengths (J,)."""
    joints = {0: np.asarray(root, float)}
    for chain in skeleton.chains:
        turned = np.eye(
            3
        )  # chains start from the identity: W_0 is left out, as in the published code
        for before, joint in pairwise(chain):
            turned = turned @ rotvec_to_rotmat(rotations[joint])  # the product in brackets
            joints[joint] = (
                turned @ (lengths[joint] * skeleton.rest_directions[joint]) + joints[before]
            )
    return np.stack([joints[index] for index in range(skeleton.n_joints)])


# %% [markdown]
# Forward kinematics takes rotations, the root's path and bone lengths to positions. The way back is
# not unique (a bone can be twisted about itself), so only one direction must agree: positions,
# rotations, positions.

# %%
skeleton = data.skeleton
rotations = inverse_kinematics(walk.joints.astype(np.float64), skeleton)
lengths_over_time = bone_lengths(walk.joints.astype(np.float64), skeleton)
again = forward_kinematics(rotations, walk.root.astype(np.float64), lengths_over_time, skeleton)
one = eq6(rotations[10], walk.root[10], lengths_over_time[10], skeleton)
print(f"the lines above and the library, frame 10: {np.abs(one - again[10]).max():.0e} m")
print(f"positions come back to {np.abs(again - walk.joints).max():.1e} m")
constant = forward_kinematics(
    rotations, walk.root.astype(np.float64), np.median(lengths_over_time, axis=0), skeleton
)
print(
    "with constant bone lengths they move by "
    f"{1000 * np.linalg.norm(constant - walk.joints, axis=-1).mean():.1f} mm on average"
)
variation = lengths_over_time[:, 1:].std(0) / lengths_over_time[:, 1:].mean(0)
print(
    f"in this clip the bones' lengths vary by {100 * variation.mean():.1f} % on average, "
    f"{100 * variation.max():.1f} % at most"
)

# %% [markdown]
# ## One rotation changed
# The same walk with the left shoulder's bone raised: everything attached to it follows, nothing
# else moves.

# %%
raised = rotations.copy()
raised[:, skeleton.index("left_elbow"), 2] += 1.2
joints = forward_kinematics(
    raised, walk.root.astype(np.float64), np.median(lengths_over_time, axis=0), skeleton
)
moved = np.linalg.norm(joints - constant, axis=-1).max(0) > 1e-9
print(
    "moved:", ", ".join(name for name, yes in zip(skeleton.joint_names, moved, strict=True) if yes)
)
waving = Motion(
    joints=joints.astype(np.float32), rotations=raised.astype(np.float32), root=walk.root,
    fps=walk.fps, parents=skeleton.parents, joint_names=skeleton.joint_names,
    skeleton=skeleton.name, action="walk",
)  # fmt: skip
display(
    plot_rows(
        [walk, waving],
        titles=["recorded", "left arm raised"],
        poses=8,
        settings=StickSettings(size=150),
    )
)

# %% [markdown]
# ## Why rotations
# The papers give a motion as three separate things: rotations, the root's path, and bone lengths
# that do not change. Why not joint positions alone? Average two poses, once their joints, once
# their rotation vectors, and measure the bones. Turn `mix`:

# %%
mix = 0.5
first, second = 5, min(40, len(walk.joints) - 1)
own = np.median(lengths_over_time, axis=0)
by_joints = (1 - mix) * constant[first] + mix * constant[second]
by_rotations = eq6(
    (1 - mix) * rotations[first] + mix * rotations[second], by_joints[0], own, skeleton
)
for name, pose in (("joints", by_joints), ("rotations", by_rotations)):
    change = bone_lengths(pose, skeleton)[1:] / own[1:] - 1
    print(
        f"mixed {name}: bones change by {100 * np.abs(change).mean():.2f} % on average, "
        f"{100 * np.abs(change).max():.1f} % at most"
    )

# %% [markdown]
# **Exercise 1.** Write $W_0$ into `eq6`: start `turned` from `rotvec_to_rotmat(rotations[0])`. How
# does the walk change with `rotations[:, 0] = (0, pi / 2, 0)`? **Exercise 2.** Change `own` to `1.3
# * own` in the last cell. Which of the two mixtures can use it?
#
# *Answers.* 1: the same poses, facing a quarter turn to the left, on the same path, so that the
# person walks sideways: the root's place is independent of the rotations. `--vae.root-rotation
# true` trains a network with it. 2: only the rotations': bone lengths are an input of Eq. 6, so any
# body can do any motion. Joint positions contain the body.
#
# ## Your own data
# A folder of BVH files with one subfolder per action is a data set too; `a2v data bvh --data
# FOLDER` checks it and `a2v train` takes it. Here two clips of the data above are written as BVH
# and read back.

# %%
with tempfile.TemporaryDirectory() as folder:
    for i in shown[:2]:
        path = Path(folder) / data.actions[data.labels[i]] / f"{data.clip_names[i]}.bvh"
        path.parent.mkdir()
        write_bvh(path, data.motion(i))
    own = load_dataset("bvh", folder)
print(
    f"{own.name}: {len(own)} clips, actions {', '.join(own.actions)}, "
    f"{own.skeleton.n_joints} joints, {own.fps:g} fps"
)

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
# # Generation and its applications
#
# A trained model turns noise and a label into motion. This lecture shows how, with and without the
# papers' integration of global and local movement (Eq. 11), and then the applications: transitions,
# directed motion, motions between two motions, futures of given poses, other bodies, long
# sequences, and files for other programs. It needs the shipped models only.

# %%
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Video, display

from a2v.kinematics import bone_lengths
from a2v.motion import MotionModel
from a2v.motion.applications import interpolate, matching_actions, outpaint, sample_each
from a2v.motion.direct import make_motion
from a2v.motion.direction import Direction, Hold, Keyframe
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.motion.ways import GroundPath
from a2v.rendering.stickfigure import StickSettings, plot_path, plot_rows, save_stick_figures

SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
LOOK = StickSettings(size=80 if SMALL else 150)
folder = Path(tempfile.mkdtemp(prefix="a2v-generation-"))
model = MotionModel.load("humanact12")
mocap = MotionModel.load("cmu")
for each in (model, mocap):
    print(
        f"{each.path.name}: {each.fps:g} fps, {each.skeleton.n_joints} joints, {each.card.license}"
    )
    print("  ", ", ".join(each.actions))


def play(motion, titles=None, name="clip.mp4"):
    """Show clips moving, beside each other."""
    save_stick_figures(folder / name, motion, titles=titles, settings=StickSettings(size=96))
    display(Video(str(folder / name), embed=True, html_attributes="controls loop autoplay muted"))


# %% [markdown]
# ## One action, many performances
# Two kinds of models are shipped. In the papers' VAE (`humanact12-glmi-m` and others) no real frame
# is there when motions are generated, so each latent vector comes from the prior (Eq. 10), from a
# standard normal draw $\epsilon_t$:
#
# $$\mathbf z_t = \mu_\psi(t) + \sigma_\psi(t) \odot \epsilon_t, \qquad
# \epsilon_t \sim \mathcal N(0, I), \qquad
# \hat{\mathbf p}_t = \mathrm{Generator}(\mathbf z_t, \hat{\mathbf p}_{t-1}, \mathbf a, c_t).$$
#
# The cell below runs the other kind, our flow (`humanact12`), which these equations do not
# describe: it has no loop over frames, but moves one noise vector to the code of a whole window in
# a few steps ([both models](../docs/motion_models.md#the-models)). The seed is the noise of either:
# the same seed gives the same motion on every machine. Each model is one ONNX graph. In this
# notebook `model` and `mocap` are flows; the cell on GLMI and the first rows of *Between two
# motions* run VAEs.

# %%
jumps = model.sample("jump", count=4, seed=3, frames=12 if SMALL else 60)
play(jumps)

# %% [markdown]
# ## With and without GLMI (Eq. 11)
# Without it, the generator outputs rotations and the root's position side by side, and nothing ties
# the one to the other. With it, the root's velocity is inferred from the local poses:
#
# $$\hat{\mathbf p}_t = \hat{\mathbf p}^o_t + \mathbf J_{0,t-1} + \hat{\mathbf V}_{0,t}, \qquad
# \hat{\mathbf V}_{0,t} =
# \mathrm{MLP}(\hat{\mathbf p}^o_t, \mathbf p^o_{t-1}, \mathbf h^o_t) \tag{11}$$
#
# The paths are of walks, seen from above. Without GLMI the root shakes from frame to frame; summed
# velocities are smooth. The number in each title is the root's mean acceleration over the ground.
# GLMI does *not* make feet stand: the printed number is the speed of the lower foot relative to the
# root's, and 0 would be a foot that holds. Feet are held afterwards (notebook 07).

# %%
NAMES = ("humanact12-lie", "humanact12-glmi-m", "humanact12-glmi-r")  # or "humanact12-plain"
walkers = {name: MotionModel.load(name) for name in NAMES}
figure, axes = plt.subplots(1, len(NAMES), figsize=(3.2 * len(NAMES), 2.8), squeeze=False)
for ax, (name, one) in zip(axes[0], walkers.items(), strict=True):
    clips = one.sample("walk", count=4 if SMALL else 12, seed=0)
    ground = clips.root[..., [0, 2]]
    shake = np.linalg.norm(np.diff(ground, n=2, axis=1), axis=-1).mean() * clips.fps**2
    feet = clips.joints[:, :, list(one.skeleton.feet)]
    lower = feet[..., 1].argmin(-1)[..., None]
    both = np.linalg.norm(np.diff(feet[..., [0, 2]], axis=1), axis=-1)
    speed = np.take_along_axis(both, lower[:, 1:], axis=2).mean()
    travel = np.linalg.norm(np.diff(ground, axis=1), axis=-1).mean()
    print(f"{name}: the lower foot moves at {speed / travel:.2f} of the root's speed")
    for path in ground:
        ax.plot(*path.T, lw=1)
    ax.set(title=f"{name}: {shake:.1f} m/s²", xlabel="x, m", ylabel="z, m", aspect="equal")
figure.tight_layout()

# %% [markdown]
# ## Every action once

# %%
each = sample_each(model, matching_actions(model, "*"), frames=12 if SMALL else 60, seed=5)
play(each, titles=list(model.actions))

# %% [markdown]
# Models of fine-grained actions have several labels of one kind. There,
# `matching_actions(model, "lift_dumbbell*")` returns all of them, and
# `a2v sample --model humanact12-fine --action 'lift_dumbbell*' --out kinds.png` shows them beside each other.
#
# ## Transitions
# In the VAE the label $\mathbf a$ changes at some frame and the recurrent states stay (journal,
# Sec. 5.1.4): `a2v motion --model humanact12-glmi-m --action sit,drink --out sit.mp4`. The cell
# runs the flow `cmu`, which has no recurrent states: a window with the new label continues the last
# frames of the window before.

# %%
two = mocap.sample(["Walk", "Dance"], frames=120, seed=2)
three = mocap.sample(["Walk", "Jump", "Dance"], frames=150, seed=2)
display(
    plot_rows([two, three], titles=["Walk, Dance", "Walk, Jump, Dance"], poses=10, settings=LOOK)
)

# %% [markdown]
# ## Directed motion
# Along a path over the ground (points, `.csv`, `.yaml` or `.svg`: `read_path`), through given
# poses, or with a hand held in place. The options of `a2v motion` are `--path`, `--keyframes`,
# `--start-pose`, `--end-pose`, `--heading` and `--hold`.

# %%
fine = MotionModel.load("cmu-fine")
path = GroundPath(np.array([[0, 0], [0, 2], [2, 2], [2, 4.0]]))
walked = make_motion(
    fine, [Step(action="Walk")], Take(frames=60, fps=12, seed=1), direction=Direction(path=path)
)
goal = fine.sample("Walk", frames=40, seed=5).joints[30]
goal = goal - goal[0] * (1, 0, 1) + (0.5, 0, 3)
keyed = Direction(
    keyframes=(Keyframe(time=3, joints=goal),),
    holds=(Hold(joint="left_wrist", start=1, end=2, at=(0.25, 0.3, 0.35), body=True),),
)
carried = make_motion(fine, [Step(action="Walk")], Take(frames=60, fps=12, seed=1), direction=keyed)
for motion, title in ((walked, "along a path"), (carried, "to a pose, a hand held")):
    display(plot_path(motion, poses=8, title=title, settings=LOOK))
print(
    f"the pose is missed by {100 * np.linalg.norm(carried.joints[36] - goal, axis=-1).max():.1f} cm"
)

# %% [markdown]
# ## Between two motions
# From the noise $\epsilon_1$ of one motion to that of another, $\epsilon_2$ (Sec. 5.1.3). On a
# straight line the middle would be shorter than any noise that the model has seen, so the way is
# the great circle. With the angle $\Omega$ between the two:
#
# $$\epsilon(s) = \frac{\sin((1-s)\,\Omega)}{\sin\Omega}\,\epsilon_1
# + \frac{\sin(s\,\Omega)}{\sin\Omega}\,\epsilon_2$$

# %%
first, second = np.random.default_rng(0).normal(size=(2, 1800))
omega = np.arccos(first @ second / np.linalg.norm(first) / np.linalg.norm(second))
s = np.linspace(0, 1, 41)[:, None]
straight = (1 - s) * first + s * second
circle = (np.sin((1 - s) * omega) * first + np.sin(s * omega) * second) / np.sin(omega)
plt.figure(figsize=(5, 2.2))
for way, name in ((straight, "straight line"), (circle, "great circle")):
    plt.plot(s, np.linalg.norm(way, axis=1), label=name)
plt.gca().set(xlabel="s", ylabel="length of the noise", ylim=(0, None))
plt.legend(fontsize=8)

# %% [markdown]
# Each row is a separate motion. GLMI-M has a noise vector for each frame. The papers interpolate
# that of the first frame alone (Fig. 13), which gives the first pose. The flow has one vector for
# the whole window. The printed numbers tell how far the first poses are from row to row:

# %%
for name in ("humanact12-glmi-m", "humanact12"):
    between = interpolate(
        MotionModel.load(name), "lift_dumbbell", seeds=(1, 4), rows=3 if SMALL else 5
    )
    shares = np.linspace(0, 1, len(between.joints))
    display(plot_rows(between, titles=[f"{share:.0%}" for share in shares], poses=7, settings=LOOK))
    first = between.joints[:, 0] - between.root[:, :1]
    steps = np.linalg.norm(np.diff(first, axis=0), axis=-1).mean(-1)
    print(f"{name}: first poses from row to row, cm:", np.round(100 * steps, 1))

# %% [markdown]
# With this pair GLMI-M goes smoothly, by one or two centimeters a row, but the whole way is short:
# the later frames have the same noise (the authors' code draws it anew for each row), so all rows
# lift with the same hand. The paper selects a pair that goes from the left hand to the right one,
# with both hands between them. Such pairs exist here too:
#
# ```
# a2v sample --model humanact12-glmi-m --action lift_dumbbell --interpolate 5 --seed 164 \
#     --to-seed 151 --out between.png
# ```
#
# The authors' fine-grained classifier names its five rows left hand, both hands, both hands, right
# hand, right hand. The flow changes the whole motion, but not smoothly: one hand, both hands with
# bent legs, both hands overhead. The kinds of lifting are far apart, and the way jumps from one to
# the next.

# %% [markdown]
# ## Futures of given poses
# The first poses are given, and the model continues them, differently for each noise (Sec. 5.1.5).
# They may come from a file of any person's skeleton (`a2v sample --start FILE`); the futures have
# the body of the start. The black line is the given part. The cell runs the flow `cmu`, which sees
# the last frames of the start; a VAE takes all of them.

# %%
start = mocap.sample("Walk", frames=14, seed=13)
futures = outpaint(mocap, start, "Walk", frames=60, count=3, seed=2)
assert np.abs(futures.joints[:, :14] - start.joints).max() < 1e-5
for i in range(3):
    display(plot_path(futures[i], poses=6, given=14, title=f"future {i + 1}", settings=LOOK))

# %% [markdown]
# ## Other bodies
# Bone lengths are an input of Eq. 6, so any bone can be longer or shorter (conference, Sec. 4.2.6).
# The cell runs the flow `cmu`. Bone lengths enter only its forward kinematics, and the path of the
# root is scaled by the length of the legs, so that longer legs take longer steps.

# %%
bodies = {"own": 1.0, "child": 0.65, "long legs": {"legs": 1.4}, "long arms": {"arms": 1.6}}
people = [
    mocap.sample("Walk", seed=9, frames=12 if SMALL else 60, bone_scale=scale)
    for scale in bodies.values()
]
display(plot_rows(people, titles=list(bodies), poses=7, settings=LOOK))
play(people, titles=list(bodies))

# %% [markdown]
# ## Long sequences
# Windows continue one another. A slope of the floor in each window would add up, so the floor is
# leveled. Bones cannot change at all.

# %%
long = mocap.sample("Walk", frames=600, count=8, seed=1)
speed = np.linalg.norm(np.diff(long.joints, axis=1), axis=-1).mean((0, 2)) * long.fps
low = long.joints[..., 1].min(-1).mean(0)
head = (long.joints[..., long.joint_names.index("head"), 1] - long.joints[..., 1].min(-1)).mean(0)
figure, axes = plt.subplots(1, 3, figsize=(12, 2.6))
time = np.arange(600) / long.fps
for ax, values, title in zip(
    axes,
    (speed, low, head),
    ("speed of the joints, m/s", "lowest joint, m", "head over the lowest joint, m"),
    strict=True,
):
    ax.plot(time[: len(values)], values)
    ax.set(title=title, xlabel="s", ylim=(0, None) if title != "lowest joint, m" else (-0.5, 0.5))
figure.tight_layout()
print(
    "bone lengths vary by "
    f"{np.ptp(bone_lengths(long.joints, mocap.skeleton)[..., 1:], axis=1).max():.0e} m"
)

# %% [markdown]
# ## Files
# `a2v motion` and `a2v sample` do all of this on the command line. `--native` writes the data set's own frame and
# unit, which the papers' classifiers expect.

# %%
commands = [
    ["motion", "--action", "Walk,Jump", "--frames", "90", "--out", folder / "walk-jump.bvh"],
    [
        "sample",
        "--model",
        "humanact12",
        "--action",
        "jump",
        "--count",
        "20",
        "--native",
        "--out",
        folder / "jumps.npz",
    ],
]
for command in commands:
    subprocess.run(
        [sys.executable, "-m", "pipelines", *map(str, command)],
        check=True,
        cwd="..",
        capture_output=True,
    )
    print(
        "a2v",
        " ".join(map(str, command[:-1])),
        f"{command[-1].name}: {command[-1].stat().st_size / 1e3:.0f} kB",
    )
with np.load(folder / "jumps.npz") as native:
    print(
        {name: native[name].shape for name in ("joints", "labels")},
        "y of head minus ankle:",
        round(float(native["joints"][0, 0, 15, 1] - native["joints"][0, 0, 7, 1]), 2),
    )

# %% [markdown]
# The same model file works without this project: `export/sample.py` needs numpy and onnxruntime
# only.

# %%
script = [
    "../export/sample.py",
    str(model.path),
    "--action",
    "throw",
    "--frames",
    "60",
    "--out",
    str(folder / "throw.bvh"),
]
print(
    subprocess.run([sys.executable, *script], check=True, capture_output=True, text=True)
    .stdout.strip()
    .split("/")[-1]
)

# %% [markdown]
# ## In the browser
# `a2v motion-page --out motions.html` writes one file that samples the model in the browser, without
# server or network: actions to search, seed, length and guidance to choose, played by sticks or by
# a character (`write_motion_page` of `a2v.motion.page`; [the page](../docs/motion_page.md)). A seed
# makes the same motion there as here.
#
# **Exercise 1.** In the cell on GLMI, add `"humanact12-plain"`. Which of its failures do the
# numbers not show? **Exercise 2.** Interpolate on the straight line instead: scale `circle` by the
# length of `straight`. Why are the motions in the middle more alike and slower?
#
# *Answers.* 1: bones that change their length; `bone_lengths(clips.joints, one.skeleton)` shows it.
# 2: shorter noise is a lower temperature. The VAE's $\mathbf z_t$ stays closer to the prior's mean,
# and the flow starts closer to the center of its noise; both give the typical motion.

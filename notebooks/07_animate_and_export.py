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
# # Animate and export
#
# A motion drives the character's bones, the surface follows as rigidly as it can (Eq. 20), hands
# and face get poses, and the result becomes files for other programs.

# %%
import dataclasses
import os
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from a2v import Surface
from a2v.animation import (
    ArapDeformer,
    DeformSettings,
    RetargetSettings,
    control_points,
    deform,
    retarget,
    rig_motion,
)
from a2v.formats.bvh import write_bvh
from a2v.formats.gltf import write_glb, write_morph_glb
from a2v.kinematics.resample import resample_motion
from a2v.motion import MotionModel
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.samples import load_ready_person

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
FRAMES = 6 if SMALL else 48
SIZE = 128 if SMALL else 320

character = load_ready_person().character
surface, body = character.surface, character.body

# %% [markdown]
# ## From joints to bones
# A motion is joints of some skeleton. Retargeting transfers the *directions* of its bones to the
# body's own bones, so that proportions stay the person's. Then it cleans the contacts: feet that
# stand neither slide nor sink. `raw=True` leaves that out. `read_motion("clip.bvh")` reads
# recorded motions.

# %%
generated = MotionModel.load("cmu").sample(["Walk"], frames=FRAMES, seed=0)
walk = resample_motion(generated, 24.0)
clean, raw = retarget(walk, body), retarget(walk, body, settings=RetargetSettings(raw=True))
ankle = body.bone_names.index("foot.L")
figure, axes = plt.subplots(1, 2, figsize=(10, 2.8))
seconds = np.arange(len(clean)) / walk.fps
for moves, name in ((raw, "raw"), (clean, "clean")):
    axes[0].plot(seconds, 100 * moves[:, ankle, 1, 3], label=name)
    axes[1].plot(moves[:, ankle, 2, 3], 100 * moves[:, ankle, 1, 3], label=name)
axes[0].set(xlabel="s", ylabel="cm", title="height of the left ankle")
axes[1].set(xlabel="z, m", ylabel="cm", title="its path from the side")
axes[0].legend()

# %% [markdown]
# ## As rigid as possible (Eq. 20)
# In a new pose the displacements of Eq. 19 (notebook 06) give every vertex a target $S^{*}$. Taken
# alone, the targets tear the surface wherever two neighbors have anchors on different bones.
# Blending bones (*skinning*) does not tear, but it thins elbows and knees. The papers keep the
# neighborhood $\mathcal N_i$ of each vertex as rigid as possible, while the targets pull:
#
# $$\mathcal L_{def}(R, \hat S) = \sum_i \sum_{j\in\mathcal N_i} k_{ij} \big\lVert
# (\hat S^i - \hat S^j) - R_i (S^i - S^j)\big\rVert_2 + \sum_l \lVert \hat S^l - S^{*,l}\rVert_2
# \tag{20}$$
#
# $R_i$ is a rotation per vertex. Rotations and vertices are found in turns. With squared norms and
# fixed rotations, the vertices solve one sparse linear system. Its matrix never changes, so it is
# factored once per character. Each frame starts from its own skinning, so frames can be computed in
# any order.

# %%
deformer = ArapDeformer(character, DeformSettings())
edges = np.unique(np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def stretch(vertices):
    """How much longer or shorter each vertex's edges got, on average: |log ratio|."""
    now, before = (
        np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        for points in (vertices, surface.vertices)
    )
    change = np.abs(np.log(np.maximum(now, 1e-9) / np.maximum(before, 1e-9)))
    total = np.bincount(edges.ravel(), np.repeat(change, 2), len(vertices))
    return total / np.maximum(np.bincount(edges.ravel(), minlength=len(vertices)), 1)


frame = len(clean) // 2
result = deformer.solve(clean[frame])
ways = {
    "skinning": deform(character, clean[frame]),
    "control points alone": control_points(character, clean[frame]),
    "ARAP": result.vertices,
}
figure, axes = plt.subplots(1, 4, figsize=(12, 3.4))
for ax, (name, vertices) in zip(axes, ways.items(), strict=False):
    error = stretch(vertices)
    heat = plt.get_cmap("magma")(np.clip(4 * error, 0, 1))[:, :3].astype(np.float32)
    picture = Surface(vertices=vertices.astype(np.float32), faces=surface.faces, colors=heat)
    ax.imshow(preview_surface(picture, azimuth=60, size=SIZE, style=PreviewStyle(shaded=False)))
    ax.set_title(f"{name}: {error.mean():.1%}", fontsize=9)
    ax.axis("off")
axes[3].plot(range(1, result.iterations + 1), result.energies, "o-")
axes[3].set(xlabel="iteration", title="energy of Eq. 20")
figure.tight_layout()

# %% [markdown]
# How strongly should targets pull against rigidity? The paper weighs them with 1. We weigh them
# with `control`. Too little, and the surface no longer reaches the pose; too much, and it tears as
# the targets do:

# %%
controls = (0.005, 0.05, 1.0, 20.0)
figure, axes = plt.subplots(1, len(controls), figsize=(11, 3.2))
for ax, control in zip(axes, controls, strict=True):
    pulled = ArapDeformer(character, DeformSettings(control=control, iterations=8)).solve(
        clean[frame]
    )
    error = stretch(pulled.vertices)
    gap = np.linalg.norm(pulled.vertices - ways["control points alone"], axis=1).mean()
    heat = plt.get_cmap("magma")(np.clip(4 * error, 0, 1))[:, :3].astype(np.float32)
    picture = Surface(vertices=pulled.vertices.astype(np.float32), faces=surface.faces, colors=heat)
    ax.imshow(preview_surface(picture, azimuth=60, size=SIZE, style=PreviewStyle(shaded=False)))
    ax.set_title(
        f"control {control:g}:\nstretch {error.mean():.1%}, {1000 * gap:.1f} mm off", fontsize=8
    )
    ax.axis("off")

# %% [markdown]
# ## Hands and face
# The motion models know wrists but no fingers, and no face. Two tables fill the gap. A hand pose is
# chosen by words of the action (`hands_of`). A face is a sum of *expressions* $\mathbf e_k$, each a
# displacement of the head's vertices, with strengths $s_k$ from 0 to 1 on the neutral face
# $\mathbf v_0$:
#
# $$\mathbf v = \mathbf v_0 + \sum_k s_k\, \mathbf e_k$$

# %%
from a2v.animation.expressions import express
from a2v.animation.hands import hands_of, pose_hands
from a2v.animation.rig import rig_of

print({action: hands_of(action) for action in ("Walk", "Boxing", "Wave", "Drink")})
wrist = body.bone_names.index("wrist.L")
rig, shown = rig_of(body), ("relaxed", "fist", "point", "flat")
figure, axes = plt.subplots(1, len(shown), figsize=(2.6 * len(shown), 2.8))
for ax, pose in zip(axes, shown, strict=True):
    fingers = pose_hands(clean[frame : frame + 1], rig, body.bone_names, [(pose, pose)])[0]
    picture = dataclasses.replace(surface, vertices=deform(character, fingers), face=None)
    close = {"center": fingers[wrist, :3, 3] - (0, 0.06, 0), "extent": 0.34}
    ax.imshow(preview_surface(picture, azimuth=90, size=SIZE, **close))
    ax.set_title(pose, fontsize=9)
    ax.axis("off")

# %%
faces = {
    "neutral": {},
    "smile": {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0},
    "eyes shut": {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0},
    "jaw open": {"jawOpen": 0.7},
}  # the names are ARKit's; change the strengths
rest = body.bone_transforms
head = body.bone_names.index("head")
if surface.face is not None:
    figure, axes = plt.subplots(1, len(faces), figsize=(2.6 * len(faces), 2.8))
    for ax, (name, strengths) in zip(axes, faces.items(), strict=True):
        vertices = express(character, surface.vertices, rest, strengths)
        picture = dataclasses.replace(surface, vertices=vertices, face=None)
        close = {"center": rest[head, :3, 3] + (0, 0.08, 0), "extent": 0.36}
        ax.imshow(preview_surface(picture, azimuth=0, size=SIZE, **close))
        ax.set_title(name, fontsize=9)
        ax.axis("off")
    print(f"{len(surface.face.names)} expressions: {', '.join(surface.face.names[:8])}...")

# %% [markdown]
# ## Files for other tools
# One glTF with several actions (Blender, Unity, Unreal, browsers), BVH, the exact vertices as morph
# targets, USD if `usd-core` is installed, and a page. On the command line:
# `a2v character --photo me.jpg --actions Walk,Jump --out me.glb`.

# %%
jump = resample_motion(MotionModel.load("cmu").sample(["Jump"], frames=FRAMES, seed=1), 24.0)
clips = {"Walk": (clean, walk.fps), "Jump": (retarget(jump, body), jump.fps)}
folder = Path(tempfile.mkdtemp())
write_glb(folder / "character.glb", character, clips)
write_bvh(folder / "walk.bvh", rig_motion(clean, body, walk.fps))
write_morph_glb(
    folder / "exact.glb", surface, np.stack([deformer(moves) for moves in clean[:5]]), walk.fps
)

from a2v.rendering import write_page

write_page(folder / "preview.html", folder / "character.glb", title="Walk and Jump")
try:
    from a2v.formats.usd import write_usd

    write_usd(folder / "character.usdz", character, clips)
except ImportError as error:
    print("no USD:", error)
for path in sorted(folder.iterdir()):
    print(f"{path.name:<16}{path.stat().st_size / 1e6:8.2f} MB")

# %% [markdown]
# What was written reads back:

# %%
from a2v.formats.bvh import read_bvh

again = read_bvh(folder / "walk.bvh")
ours = rig_motion(clean, body, walk.fps)
shared = [
    name for name in again.joint_names if name in ours.joint_names
]  # joints of no length are merged when a BVH is read
theirs, mine = (
    motion.joints[:, [motion.joint_names.index(name) for name in shared]]
    for motion in (again, ours)
)
print(
    f"walk.bvh: {again.frames} frames, {len(shared)} joints, "
    f"largest difference {np.abs(theirs - mine).max():.1e} m"
)

# %% [markdown]
# **Exercise 1.** Why does Eq. 20 need both of its sums? What is its minimum without the second?
# **Exercise 2.** Replace `clean` by `raw` in `write_bvh` and open both files: what do the feet do?
#
# *Answers.* 1: without the targets any rigid motion of the whole surface costs nothing, so the
# person stays in the photo's pose. Without the first sum every vertex lies at its target, which
# tears. 2: with `raw` they slide while they stand and sink below the floor, since directions alone
# do not know where the ground is.

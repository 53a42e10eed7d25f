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
# Motions go to the character's bones, the surface follows as rigidly as it can (Eq. 20), and the result goes to the tools that animators own.

# %%
import os
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from a2v import Character, Surface
from a2v.animation import ArapDeformer, DeformSettings, RetargetSettings, control_points, deform, retarget, rig_motion
from a2v.formats.bvh import write_bvh
from a2v.formats.gltf import write_glb, write_morph_glb
from a2v.kinematics.resample import resample_motion
from a2v.motion import MotionModel
from a2v.rendering.preview import PreviewStyle, preview_surface
from pipelines.engine.store import Store
from pipelines.requests.video import photo_parameters
from pipelines.run import run

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
FRAMES = 6 if SMALL else 48
SIZE = 128 if SMALL else 320

store = Store()
outcome = run("character", store=store, **photo_parameters(store, "../a2v/samples/person.jpg"))
character = outcome.get("character", Character)
surface, body = character.surface, character.body

# %% [markdown]
# ## From joints to bones
# A motion is joints of some skeleton. Retargeting takes their bone *directions* over to the body's own bones, then cleans the contacts: feet that stand
# neither slide nor sink. `raw=True` leaves that out. `read_motion("clip.bvh")` gives recorded motions instead of the model's.

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
# Skinning thins elbows and knees; moving every vertex with its anchor tears. ARAP keeps neighbourhoods rigid while it is pulled to the same control points.
# The factor is made once a character; every frame starts from its own skinning, so frames may be computed in any order.

# %%
deformer = ArapDeformer(character, DeformSettings())
edges = np.unique(np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def stretch(vertices):
    """How much longer or shorter each vertex's edges got, on average: |log ratio|."""
    now, before = (np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) for points in (vertices, surface.vertices))
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

# %% [markdown]
# ## Files for other tools
# One glTF with several actions (Blender, Unity, Unreal, browsers), BVH, the exact vertices as morph targets, USD where `usd-core` is installed, and a page.
# On the command line: `a2v character --photo me.jpg --actions Walk,Jump --out me.glb`.

# %%
jump = resample_motion(MotionModel.load("cmu").sample(["Jump"], frames=FRAMES, seed=1), 24.0)
clips = {"Walk": (clean, walk.fps), "Jump": (retarget(jump, body), jump.fps)}
folder = Path(tempfile.mkdtemp())
write_glb(folder / "character.glb", character, clips)
write_bvh(folder / "walk.bvh", rig_motion(clean, body, walk.fps))
write_morph_glb(folder / "exact.glb", surface, np.stack([deformer(moves) for moves in clean[:5]]), walk.fps)

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
shared = [name for name in again.joint_names if name in ours.joint_names]  # joints of no length are merged when a BVH is read
theirs, mine = (motion.joints[:, [motion.joint_names.index(name) for name in shared]] for motion in (again, ours))
print(f"walk.bvh: {again.frames} frames, {len(shared)} joints, largest difference {np.abs(theirs - mine).max():.1e} m")

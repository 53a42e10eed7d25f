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
# # From a photo and an action to a video
#
# Each stage once, with a picture after it. The stages are nodes of a graph (`a2v dag` draws it).
# `run(name, ...)` computes a node and all that it needs, and remembers the results, so that each
# cell only adds its own step. Change a parameter and run the cells again: only the nodes that
# depend on it are computed.
#
# The person of the sample photo, from perception to the character, is loaded
# (`a2v.samples.load_ready_person`: the pipeline's own results); `LIVE = True` below computes these
# stages too, from any photo. Motion, retargeting, vertices, frames and files are always computed.
#
# | stage | equation of the journal | lecture |
# |---|---|---|
# | photo to body | 15, 16, 18: joints and the pose prior | [06](06_fit_and_rig.ipynb) |
# | photo to surface and colors | 14: colors that nobody saw | [05](05_photo_to_person.ipynb) |
# | data and rotations | 3, 4, 6 | [01](01_data_and_skeletons.ipynb) |
# | training of the motion model | 9 to 13 | [02](02_training.ipynb) |
# | label to motion | 10, 11 | [03](03_generation_and_applications.ipynb) |
# | surface to character | 17, 19: fit to the surface, displacements | [06](06_fit_and_rig.ipynb) |
# | motion to vertices | 20: as rigid as possible | [07](07_animate_and_export.ipynb) |
# | vertices to frames | | [08](08_render.ipynb) |
# | how good is it | 21, 22, FID | [04](04_evaluation.ipynb) |
# | training data for the networks | | [09](09_studio.ipynb) |
# | many videos, other methods | | [10](10_batch_and_compare.ipynb) |
#
# [The method](../docs/method.md) tells it in one page.

# %%
import dataclasses
import os
import warnings

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import display

import a2v
from a2v import Character, Motion, PhotoCamera, Subject, Surface
from a2v.samples import load_ready_person
from a2v.types import Body
from pipelines.bar import Bars
from pipelines.engine.store import Store
from pipelines.nodes.values import Blob, Image, Poses
from pipelines.requests.video import video_parameters
from pipelines.run import run

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size

# %% [markdown]
# ## Parameters
# Any action of the model (`a2v actions`); another seed gives another performance. With
# `LIVE = True`, any photo of one person, seen whole and upright (about 30 s of processor time more
# per photo).

# %%
LIVE = False  # True: perception, fit, surface and character are computed from PHOTO
PHOTO = "../a2v/samples/person.jpg"
ACTION = "Walk"
SEED = 0
FRAMES = 4 if SMALL else 16
FILM = {"size": 64 if SMALL else 192, "spp": 1 if SMALL else 4, "views": ("front", "left")}

store = Store()  # the folder of remembered results: $A2V_CACHE, else ~/.cache/a2v
parameters = video_parameters(store, PHOTO, ACTION, frames=FRAMES, seed=SEED, **FILM)
# the graph begins at these results of the sample photo, if there are any
given = (
    {} if LIVE else {name: store.put(value) for name, value in load_ready_person().outputs.items()}
)


def compute(*names, wished=parameters):
    """Run what `names` need; bars show what is still to do."""
    bars = Bars()
    outcome = run(names, store=store, progress=bars, executor="serial", overrides=given, **wished)
    bars.close()
    for text in outcome.notes:
        print("note:", text)
    return outcome


# %% [markdown]
# ## The person in the photo
# Landmarks and a mask of the person. `subject.warnings` names problems, for instance feet outside
# of the photo. The joints that are found here are $\hat J_{c,i}$ of Eq. 16.

# %%
subject = compute("subject").get("subject", Subject)
seen = subject.keypoints[subject.keypoints[:, 2] > 0.5]
figure, axes = plt.subplots(1, 2, figsize=(8, 5))
axes[0].imshow(subject.image)
axes[0].scatter(seen[:, 0], seen[:, 1], s=12, c="tab:red")
axes[1].imshow(
    subject.image * subject.mask[..., None].astype(float) / 255 + (1 - subject.mask[..., None])
)
for ax, title in zip(axes, ("landmarks", "mask"), strict=True):
    ax.set_title(title)
    ax.axis("off")

# %% [markdown]
# ## A body in the photo's pose
# Shape $\beta$ and pose $\theta$ of the body model $\mathcal M(\beta, \theta)$ and the photo's
# camera are fitted to landmarks and silhouette. The dots are the body's vertices, seen by that
# camera.

# %%
fitted = compute("photo_body", "photo_camera")
body, camera = fitted.get("photo_body", Body), fitted.get("photo_camera", PhotoCamera)
pixels = camera.project(body.vertices)
plt.figure(figsize=(4, 5))
plt.imshow(subject.image)
plt.scatter(pixels[:, 0], pixels[:, 1], s=0.2, c="tab:cyan")
plt.title(
    f"{len(body.vertices)} vertices, {len(body.bone_names)} bones, "
    f"{np.ptp(body.vertices[:, 1]):.2f} m high"
)
plt.axis("off")
mask = subject.mask > 0.5
inside = np.floor(pixels).astype(int)
within = ((inside >= 0) & (inside < mask.shape[::-1])).all(axis=1)
on_person = mask[inside[within, 1], inside[within, 0]].sum() / len(inside)
print(f"{on_person:.1%} of the vertices lie on the mask")

# %% [markdown]
# ## The surface with the photo's colors
# Networks that see the photo and the fitted body return the person with clothes and hair. The
# unseen side is colored by the papers' convex objective (Eq. 14).

# %%
from a2v.rendering import Renderer, follow_cameras

surface = compute("colored_surface").get("colored_surface", Surface)
looks = dataclasses.replace(parameters["render"], views=a2v.VIEWS)  # the papers' four cameras
renderer = Renderer(surface, looks)
still = follow_cameras(surface.vertices[None], looks)
figure, axes = plt.subplots(1, 4, figsize=(12, 3.2))
for ax, (view, cameras) in zip(axes, still.items(), strict=True):
    ax.imshow(renderer.render(surface.vertices, cameras[0]))
    ax.set_title(view)
    ax.axis("off")
print(
    f"{len(surface.vertices)} vertices, {len(surface.faces)} faces, "
    f"{surface.visible.mean():.0%} of the vertices seen in the photo"
)

# %% [markdown]
# ## The action
# A network turns noise and the label into joints over time, run by onnxruntime. Notebook 03 shows
# its other uses.

# %%
from a2v.rendering.stickfigure import plot_rows

motion = compute("motion").get("motion", Motion)
display(plot_rows(motion, poses=min(8, motion.frames)))
a2v.show(motion, height=360)  # drag to turn it

# %% [markdown]
# ## The motion on the body's bones
# Retargeting transfers the joints to the character's rig and cleans the contacts: the feet neither
# slide nor sink.

# %%
moved = compute("character", "poses")
character, poses = moved.get("character", Character), moved.get("poses", Poses)
path = poses.bone_transforms[:, 0, :3, 3]
plt.figure(figsize=(4, 3))
plt.plot(path[:, 0], path[:, 2])
plt.gca().set(xlabel="x, m", ylabel="z, m", title="path of the pelvis over the ground")
plt.axis("equal")
print(
    f"{poses.bone_transforms.shape[0]} frames of {len(character.body.bone_names)} bones "
    f"at {poses.fps:g} fps"
)
a2v.show(
    character, {ACTION: (poses.bone_transforms, poses.fps)}, height=420, small=True
)  # drag to turn; a copy of few triangles

# %% [markdown]
# ## Frames
# The surface follows the bones as rigidly as it can (Eq. 20), and a path tracer renders it. Each
# frame of each view is a call of its own, so the command line renders them in several processes
# (here in one, `executor="serial"`). A finished frame is never rendered again.

# %%
frames = compute("frame")
grid = frames.values["frame"]
picks = np.linspace(0, len(grid) - 1, min(4, len(grid))).astype(int)
figure, axes = plt.subplots(
    grid.shape[1], len(picks), figsize=(2.4 * len(picks), 2.4 * grid.shape[1]), squeeze=False
)
for row, view in zip(range(grid.shape[1]), parameters["render"].views, strict=True):
    for column, t in enumerate(picks):
        axes[row, column].imshow(store.get(grid[t, row], Image).pixels)
        axes[row, column].set_title(f"{view}, frame {t}", fontsize=8)
        axes[row, column].axis("off")

# %% [markdown]
# ## The video, and files for other tools

# %%
result = compute("video", "glb", "bvh")
print(
    f"character.glb {len(result.get('glb', Blob).data) / 1e6:.1f} MB, "
    f"motion.bvh {len(result.get('bvh', Blob).data) / 1e3:.0f} kB"
)
a2v.show(bytes(result.get("video", Blob)), height=300)

# %% [markdown]
# ## Another action for the same person
# The character stays: only motion, frames and video are computed, as the printed nodes show.

# %%
short = FILM | {"views": ("left",)}
second = compute(
    "video",
    wished=video_parameters(store, PHOTO, "Jump", frames=max(FRAMES // 2, 4), seed=SEED, **short),
)
print({name: f"{stats.calls} ({stats.cached} remembered)" for name, stats in second.nodes.items()})
a2v.show(bytes(second.get("video", Blob)), height=300)

# %% [markdown]
# ## Choose yourself
# Action, seed and length as widgets (they need a running kernel). The button makes the motion and
# shows the remembered character in 3D; no frames are rendered.
#
# **Exercise.** Change `SEED`, then `FILM["size"]`, and run all cells: which nodes are computed
# again? *Answer.* The seed changes the motion and all that follows it, but not the character. The
# size changes the frames and the video alone. The printed counts of nodes show it.

# %%
import ipywidgets as widgets

from a2v.motion import MotionModel


def perform(action, seed, frames):
    """Show the person of the photo doing it."""
    chosen = video_parameters(store, PHOTO, action, frames=frames, seed=seed, **FILM)
    display(
        a2v.show(
            bytes(compute("glb", wished=chosen).get("glb", Blob)),
            title=f"{action}, seed {seed}",
        )
    )


_ = widgets.interact_manual(
    perform,
    action=widgets.Dropdown(
        options=MotionModel.load("cmu").actions, value=ACTION, description="action"
    ),
    seed=widgets.BoundedIntText(value=SEED, min=0, max=2**32 - 1, description="seed"),
    frames=widgets.IntSlider(value=FRAMES, min=4, max=240, description="frames"),
)

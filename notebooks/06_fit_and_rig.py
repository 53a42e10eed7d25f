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
# # Fit a body and rig the surface
#
# From the person in a photo to a character: a parametric body is fitted (Eq. 15 to 18), the reconstructed surface is bound to its bones
# (Eq. 19). `docs/body.md` and `docs/animation.md` tell the details.

# %%
import os
import warnings

import matplotlib.pyplot as plt
import numpy as np

from a2v import PhotoCamera, Subject, Surface
from a2v.body import PARTS, fit_body, load_body_model, make_body
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.types import Body
from pipelines.engine.store import Store
from pipelines.requests.video import photo_parameters
from pipelines.run import run

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
SIZE = 128 if SMALL else 320

# %% [markdown]
# ## The body model
# Anny's shape is a handful of numbers between 0 and 1 (and some local changes); every bone's frame is parallel to the world's at rest, so a rotation
# vector means the same for all of them. An SMPL file of your own comes through the same door: `load_body_model("SMPLX_NEUTRAL.npz")`.

# %%
model = load_body_model()
print(f"{model.name}: {len(model.weights)} vertices, {model.n_bones} bones, shape: {', '.join(model.shape_names[:6])}...")


def clay(body):
    """A body as an uncoloured surface."""
    return Surface(vertices=body.vertices, faces=body.faces, colors=np.full_like(body.vertices, 0.8))


wave = np.zeros((model.n_bones, 3), np.float32)
wave[model.bone("upperarm01.L")] = (0, 0, 1.9)
wave[model.bone("lowerarm01.L")] = (0, 0, 0.6)
bodies = {
    "default": make_body(model, grounded=True),
    "heavy": make_body(model, shape={"weight": 0.95, "muscle": 0.3}, grounded=True),
    "tall, male": make_body(model, shape={"gender": 0.0, "height": 0.65}, grounded=True),
    "waving": make_body(model, wave, grounded=True),
}
figure, axes = plt.subplots(1, len(bodies), figsize=(11, 3.2))
for ax, (name, one) in zip(axes, bodies.items(), strict=True):
    ax.imshow(preview_surface(clay(one), azimuth=20, size=SIZE, center=np.array([0, 1.05, 0]), extent=2.3, style=PreviewStyle(plain=True)))
    ax.set_title(f"{name}, {np.ptp(one.vertices[:, 1]):.2f} m", fontsize=9)
    ax.axis("off")

# %% [markdown]
# ## The fit to the photo
# Camera and orientation first, then joints with the priors, then the silhouette. The residuals say how well it went.

# %%
store = Store()
parameters = photo_parameters(store, "../a2v/samples/person.jpg")
outcome = run(["subject", "photo_body", "photo_camera", "colored_surface"], store=store, **parameters)
subject, body = outcome.get("subject", Subject), outcome.get("photo_body", Body)
camera, surface = outcome.get("photo_camera", PhotoCamera), outcome.get("colored_surface", Surface)
measures = outcome.nodes["photo_body"].measures
print({name: round(value, 4) for name, value in measures.items() if isinstance(value, float)})

corners = body.vertices[body.faces]
facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0
pixels = camera.project(body.vertices)
figure, axes = plt.subplots(1, 2, figsize=(8, 5))
for ax in axes:
    ax.imshow(subject.image)
    ax.axis("off")
axes[0].triplot(pixels[:, 0], pixels[:, 1], body.faces[facing], lw=0.15, c="tab:cyan")
heads = camera.project(body.bone_transforms[:, :3, 3])
for bone, parent in enumerate(body.bone_parents):
    if parent >= 0:
        axes[1].plot(*heads[[bone, parent]].T, c="tab:red", lw=1)
axes[0].set_title("skin")
axes[1].set_title("bones")

# %% [markdown]
# ## The fit to the surface (Eq. 15)
# With a reconstructed surface the papers' objective pulls the body onto it: two rounds of joints and pose prior, then the surface, both ways. The surface
# wears clothes, so a distance of about a centimetre is right.

# %%
from a2v.body import FitSettings

fitted = fit_body(subject, surface=surface, camera=camera, settings=FitSettings(rounds=2) if SMALL else None)
print({name: round(value, 4) for name, value in fitted.residuals.items() if isinstance(value, float)})
print("terms of the objective:", {name: round(value, 1) for name, value in fitted.residuals["loss"].items()})

# %% [markdown]
# ## Binding (Eq. 19)
# Every vertex of the surface gets an anchor on the body, a part, and the weights of at most four bones. Arms never bind to the trunk, even where they touch.

# %%
from a2v.animation import bind, deform

character = bind(surface, body)
palette = plt.get_cmap("tab20")(np.arange(len(PARTS)))[:, :3].astype(np.float32)
parts = Surface(vertices=surface.vertices, faces=surface.faces, colors=palette[character.parts])
elbow = model.bone("lowerarm01.L")
weight = np.where(character.bones == elbow, character.weights, 0).sum(axis=1)
heat = Surface(vertices=surface.vertices, faces=surface.faces, colors=plt.get_cmap("viridis")(weight)[:, :3].astype(np.float32))
figure, axes = plt.subplots(1, 4, figsize=(11, 3.6))
for ax, (thing, azimuth, title) in zip(
    axes, [(surface, 0, "surface"), (parts, 0, "parts"), (parts, 180, "parts, back"), (heat, 20, "weight of the left forearm")], strict=True
):
    ax.imshow(preview_surface(thing, azimuth=azimuth, size=SIZE))
    ax.set_title(title, fontsize=9)
    ax.axis("off")

# %% [markdown]
# In the pose of the photo nothing moves; that is what binding means:

# %%
still = deform(character, body.bone_transforms)
print(f"largest movement at the bind pose: {np.abs(still - surface.vertices).max():.1e} m")

# %% [markdown]
# ## A first pose
# Turn a bone of the fitted body, and the clothes follow.

# %%
turned = body.parameters["rotations"].copy()
turned[model.bone("upperarm01.L")] += (0, 0, 1.2)
turned[model.bone("lowerleg01.R")] += (0.9, 0, 0)
posed = make_body(model, turned, body.parameters["shape"], body.parameters["translation"])
moved = deform(character, posed.bone_transforms)
figure, axes = plt.subplots(1, 3, figsize=(9, 3.6))
for ax, azimuth in zip(axes, (0, 60, 180), strict=True):
    shown = Surface(vertices=moved, faces=surface.faces, colors=surface.colors, uv=surface.uv, texture=surface.texture)
    ax.imshow(preview_surface(shown, azimuth=azimuth, size=SIZE))
    ax.axis("off")

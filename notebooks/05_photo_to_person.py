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
# # One photo to a person in 3D
#
# Pixel-aligned implicit functions (PIFuHD's geometry, PIFu's colour), guided by a fitted body, and the unseen side's colours by Eq. 14.
# `docs/reconstruction.md` tells the details and the measurements.

# %%
import os
import warnings

import matplotlib.pyplot as plt
import numpy as np
import trimesh

from a2v import PhotoCamera, Subject
from a2v.body import flattened
from a2v.reconstruction import ImplicitSettings, body_prior_surface, implicit_surface
from a2v.reconstruction.colorings import color_by_network, color_by_photo, color_mirrored
from a2v.reconstruction.implicit import ImplicitModel
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.types import Body, Reconstruction
from pipelines.engine.store import Store
from pipelines.requests.video import photo_parameters
from pipelines.run import run

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
SIZE = 128 if SMALL else 320

# %% [markdown]
# ## The photo, the person in it, and the body that was fitted
# Keypoints and mask come from perception, the body from `fit_body`: it is the *guide*, since one photo says little about depth.

# %%
outcome = run(["subject", "photo_body", "photo_camera"], store=Store(), **photo_parameters(Store(), "../a2v/samples/person.jpg"))
subject, body = outcome.get("subject", Subject), outcome.get("photo_body", Body)
camera = outcome.get("photo_camera", PhotoCamera)
body, camera = flattened(body, camera), camera.flat  # as the photo's orthographic view would show the body
model = ImplicitModel.load()
person = model.see(subject, body, camera)
print({name: model.metadata[name] for name in ("format", "licence")})


def show(pictures, titles, **options):
    """Pictures in a row."""
    _, axes = plt.subplots(1, len(pictures), figsize=(2.3 * len(pictures), 2.6))
    for ax, picture, title in zip(axes, pictures, titles, strict=True):
        ax.imshow(picture, **options)
        ax.set_title(title, fontsize=9)
        ax.axis("off")


frame = person.frame
guide, maps = person.maps["guide"][0], person.maps["maps"][0]
inside = guide[8][..., None] > 0


def as_color(normals):
    """Unit normals (3, H, W) as colours."""
    return np.clip(normals.transpose(1, 2, 0) / 2 + 0.5, 0, 1)


show(
    [frame.image, frame.mask, np.where(inside, as_color(guide[:3]), 1), np.where(inside, as_color(guide[3:6]), 1)],
    ["photo", "mask", "guide, front", "guide, back"],
    cmap="gray",
)

# %% [markdown]
# ## The body map
# What stands behind the landmarks: of each pixel of a small square around the person, what place of the body it shows (x, y and z as colours), how
# deep the front lies there, and how far off that may be. The fit holds its body to 500 of these pixels (`docs/perception.md`).

# %%
found = subject.bodymap
there = found.inside
show(
    [
        np.where(there[..., None], np.clip(found.places / 2 + 0.5, 0, 1), 1),
        np.where(there, found.depths[..., 0], np.nan),
        np.where(there, found.depth_scales[..., 0], np.nan),
    ],
    ["place on the body", "depth, front", "expected error"],
    cmap="viridis",
)

# %% [markdown]
# ## What the first network sees
# Normals and depth of the front, and of the back that nobody saw, at a quarter of the frame's resolution; the fine level sharpens the normals from
# the photo at full resolution.

# %%
seen = guide[9][..., None] < 0
fine = person.maps["fine"][0]
sharp = seen.repeat(2, axis=0).repeat(2, axis=1)
show(
    [
        np.where(seen, as_color(maps[:3]), 1),
        np.where(seen, as_color(maps[3:6]), 1),
        np.where(sharp, as_color(fine[:3]), 1),
        np.where(sharp, as_color(fine[3:6]), 1),
    ],
    ["normals, front", "normals, back", "fine, front", "fine, back"],
)
show(
    [np.where(seen[..., 0], value, np.nan) for value in (maps[6], maps[7], maps[6] - guide[6], maps[6] - maps[7])],
    ["depth, front", "depth, back", "front - guide's", "thickness"],
    cmap="viridis",
)

# %% [markdown]
# ## The field
# A signed distance at any point of space: here a slice through the chest, seen from above (the photo's camera is at the top).

# %%
height = float(np.quantile(body.vertices[:, 1], 0.72))
across, deep = np.meshgrid(np.linspace(-0.45, 0.45, 160), np.linspace(0.3, -0.3, 107))
middle = person.middle
points = np.stack([across + body.vertices[:, 0].mean(), np.full_like(across, height), deep + middle], axis=-1).reshape(-1, 3)
values = person.distance(points).reshape(across.shape)
bare, _ = person.guide.at(points - np.array([0, 0, middle]))
plt.figure(figsize=(6, 3.4))
plt.imshow(np.clip(values, -0.1, 0.1), extent=(-0.45, 0.45, -0.3, 0.3), cmap="RdBu_r")
plt.colorbar(label="metres")
plt.contour(across, deep, values, [0.0], colors="k")
plt.contour(across, deep, bare.reshape(across.shape), [0.0], colors="tab:green", linewidths=0.8)
plt.title("field (black: its surface; green: the guide)", fontsize=9)
# %% [markdown]
# ## The surface, and its colours
# Marching cubes coarse to fine, one closed piece. Colours: the photo where it saw the surface, Eq. 14 elsewhere; beside it what the front mirrored and the
# network alone would give, and the `body-prior` backend.

# %%
surface = implicit_surface(
    subject, body, camera, settings=ImplicitSettings(resolution=200 if SMALL else 320, vertices=25_000 if SMALL else 36_000)
)
made = Reconstruction(surface=surface, backend="pifu", expected_colors=surface.colors)
pushed = Reconstruction(surface=body_prior_surface(subject, body, camera), backend="body-prior", from_body=True)
ours = color_by_photo(made, subject, body, camera)
looks = {
    "ours": ours,
    "network's colours": color_by_network(made, subject, body, camera),
    "front mirrored": color_mirrored(made, subject, body, camera),
    "body-prior": color_by_photo(pushed, subject, body, camera),
}
print({name: round(float(value), 4) for name, value in ours.provenance["eq14"].items()})
for azimuth, side in ((0, "front"), (180, "back")):
    show([preview_surface(one, azimuth=azimuth, size=SIZE) for one in looks.values()], [f"{name}, {side}" for name in looks])
show([preview_surface(ours, azimuth=turn, size=SIZE, style=PreviewStyle(plain=True)) for turn in (0, 90, 180, 270)], ["front", "left", "back", "right"])

# %% [markdown]
# Turn it with the mouse:

# %%
mesh = trimesh.Trimesh(ours.vertices, ours.faces, vertex_colors=(ours.colors * 255).astype(np.uint8), process=False)
trimesh.Scene(mesh).show(viewer="jupyter")

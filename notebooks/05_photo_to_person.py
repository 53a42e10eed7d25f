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
# A photo shows half of a person. This lecture follows how the other half is found: a function in
# space whose zero set is the surface, and a convex objective for the colors that nobody saw
# (Eq. 14). [Reconstruction](../docs/reconstruction.md) has the details and the measurements.

# %%
import dataclasses
import os
import warnings

import matplotlib.pyplot as plt
import numpy as np
import trimesh

from a2v.body import flattened
from a2v.geometry.simplify import simplify
from a2v.reconstruction import ImplicitSettings, implicit_surface
from a2v.reconstruction.coloring import ColorSettings
from a2v.reconstruction.colorings import color_by_network, color_by_photo, color_mirrored
from a2v.reconstruction.implicit import ImplicitModel
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.samples import load_ready_person
from a2v.types import Reconstruction

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
SIZE = 128 if SMALL else 240

# %% [markdown]
# ## The photo, the mask and the guide
# Keypoints and mask come from perception, the body from `fit_body` (notebook 06). Both are ready
# here; for a photo of your own, notebook 00 makes them. One photo says little about depth, so the
# body is the *guide* of all networks that follow.

# %%
ready = load_ready_person()
subject = ready.subject
# as the photo's orthographic view would show the body
body, camera = flattened(ready.photo_body, ready.photo_camera), ready.photo_camera.flat
model = ImplicitModel.load()
person = model.see(subject, body, camera)
print("weights:", model.metadata["format"])


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
    """Unit normals (3, H, W) as colors."""
    return np.clip(normals.transpose(1, 2, 0) / 2 + 0.5, 0, 1)


show(
    [
        frame.image,
        frame.mask,
        np.where(inside, as_color(guide[:3]), 1),
        np.where(inside, as_color(guide[3:6]), 1),
    ],
    ["photo", "mask", "guide, front", "guide, back"],
    cmap="gray",
)

# %% [markdown]
# ## The body map
# One network describes every pixel of a small square around the person: which place of the body it
# shows (x, y and z as colors), how deep the front lies there, and the expected error of that
# depth. The fit compares its body with 500 of these pixels ([perception](../docs/perception.md)).

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
# ## Normals and depths
# The first network predicts normals and depth of the front, and of the back that nobody saw, at a
# quarter of the frame's resolution. The second sharpens the normals at full resolution.

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
    [
        np.where(seen[..., 0], value, np.nan)
        for value in (maps[6], maps[7], maps[6] - guide[6], maps[6] - maps[7])
    ],
    ["depth, front", "depth, back", "front - guide's", "thickness"],
    cmap="viridis",
)

# %% [markdown]
# ## The pixel-aligned function
# A surface of unknown shape can be written as the zero set of a function $f$ of space. A
# *pixel-aligned* function (Saito et al., 2019) looks at the photo for each point $X$: the features
# $F$ of the pixel $\pi(X)$ that shows it, and its depth $z(X)$, go into a small network $g$:
#
# $$f(X) = g\big(F(\pi(X)),\, z(X)\big), \qquad \text{surface} = \{X : f(X) = 0\}.$$
#
# All points behind one pixel have the same features, so depth alone tells front from back. Ours is
# a signed distance, and its depth is measured from the guide. Here is a slice through the chest,
# seen from above; the photo's camera is at the top. Change `LEVEL` to cut elsewhere.

# %%
LEVEL = 0.72  # height of the slice as a share of the body's
height = LEVEL * float(body.vertices[:, 1].max())
across, deep = np.meshgrid(np.linspace(-0.45, 0.45, 160), np.linspace(0.3, -0.3, 107))
middle = person.middle
points = np.stack(
    [across + body.vertices[:, 0].mean(), np.full_like(across, height), deep + middle], axis=-1
).reshape(-1, 3)
values = person.distance(points).reshape(across.shape)
bare, _ = person.guide.at(points - np.array([0, 0, middle]))
plt.figure(figsize=(6, 3.4))
plt.imshow(np.clip(values, -0.1, 0.1), extent=(-0.45, 0.45, -0.3, 0.3), cmap="RdBu_r")
plt.colorbar(label="meters")
plt.contour(across, deep, values, [0.0], colors="k")
plt.contour(across, deep, bare.reshape(across.shape), [0.0], colors="tab:green", linewidths=0.8)
plt.title("field (black: its surface; green: the guide)", fontsize=9)
# %% [markdown]
# ## The surface and its colors
# Marching cubes turns the field into triangles, coarse to fine, one closed piece. The photo colors
# the side that it shows. Three ways to color the rest stand beside each other. The pipeline also
# continues cloth, hair and skin over the unseen side and removes the photo's shading (leave
# `settings` out). `body_prior_surface(subject, body, camera)` makes a surface without a network.

# %%
surface = implicit_surface(
    subject,
    body,
    camera,
    settings=ImplicitSettings(resolution=200, vertices=25_000),
)
made = Reconstruction(surface=surface, backend="pifu", expected_colors=surface.colors)
only_equation = ColorSettings(texture=0, synthesis=False, delight=False)
ours = color_by_photo(made, subject, body, camera, settings=only_equation)
looks = {
    "Eq. 14": ours,
    "network's colors": color_by_network(made, subject, body, camera),
    "front mirrored": color_mirrored(made, subject, body, camera),
}
print({name: round(float(value), 4) for name, value in ours.provenance["eq14"].items()})
for azimuth, side in ((0, "front"), (180, "back")):
    show(
        [preview_surface(one, azimuth=azimuth, size=SIZE) for one in looks.values()],
        [f"{name}, {side}" for name in looks],
    )
show(
    [
        preview_surface(ours, azimuth=turn, size=SIZE, style=PreviewStyle(plain=True))
        for turn in (0, 90, 180, 270)
    ],
    ["front", "left", "back", "right"],
)

# %% [markdown]
# ## Colors that nobody saw (Eq. 14)
# Let $O$ be the vertices that the photo does not show, $c^p_x$ a guessed color of vertex $x$ (a
# network's) and $\mathcal N_x$ its neighbors on the surface:
#
# $$\min_c \sum_{x \in O} \Big[\lVert c_x - c^p_x\rVert_2 + \lambda_{nn} \frac{1}{|\mathcal N_x|}
# \sum_{x' \in \mathcal N_x} \lVert c_x - c_{x'}\rVert_2\Big] \tag{14}$$
#
# The first term keeps the guess, the second makes neighbors agree, also across the border to what
# the photo shows. In a *transition band* along that border only the second term counts. The norms
# are not squared, which matters: on a line of 60 vertices, of which the photo shows the left
# third, a wrong guess bleeds into its neighbors with squares and stays alone, or vanishes, with
# norms.

# %%
from scipy.spatial import cKDTree

from a2v.reconstruction.coloring.equation14 import ColorProblem, color_objective, solve_colors

LAMBDA = 1.0
line = np.arange(60)
guess = np.repeat(np.where(line < 40, 0.3, 0.8)[:, None], 3, axis=1)
guess[28] = 1.0  # the wrong guess
known = np.where(line[:, None] < 20, 0.5, guess)
free = line >= 20
beside = np.stack([np.maximum(line - 1, 0), np.minimum(line + 1, 59)], axis=1)
problem = ColorProblem(prior=guess, neighbors=beside, free=free, band=line < 22, lambda_nn=LAMBDA)
norms = solve_colors(known, problem).colors
# the same with squares: one linear system
system, right = np.eye(60), known[:, 0].copy()
for x in line[free]:
    own = 0.0 if problem.band[x] else 1.0
    system[x] = 0
    system[x, x] = own
    right[x] = own * guess[x, 0]
    for other in beside[x]:
        # the pair counts at both of its ends
        system[x, x] += LAMBDA
        system[x, other] -= LAMBDA
squares = np.linalg.solve(system, right)
plt.figure(figsize=(7, 2.4))
plt.plot(line, known[:, 0], "k:", label="photo, then the guess alone (no second term)")
plt.plot(line, squares, label="squared norms")
plt.plot(line, norms[:, 0], label="Eq. 14")
plt.axvspan(20, 22, color="0.9")
plt.legend(fontsize=7, loc="lower right")
plt.gca().set(xlabel="vertex", ylabel="gray level", ylim=(0, 1.1))
print(
    "objective of Eq. 14:",
    round(color_objective(norms, problem), 3),
    "of the guess:",
    round(color_objective(known, problem), 3),
)

# %% [markdown]
# The same on the person: the network's colors are the guess, the photo's colors are fixed. Without
# the second term, colors jump at the border of what the photo shows. The printed number is the
# jump: the second term takes a third of it away. The two pictures hardly differ, because the guess
# is near the photo's colors here. By default the pipeline does not stop at this: it continues the
# cloth of the photo ([colors](../docs/color.md)).

# %%
guessed = looks["network's colors"]
neighbors = cKDTree(ours.vertices).query(ours.vertices, k=11)[1][:, 1:]  # ten, as in the paper
hidden = ~ours.visible
near = hidden[neighbors].mean(axis=1)
band = hidden & (near < 0.9)  # a neighbor is seen
given = np.where(hidden[:, None], guessed.colors, ours.colors)
versions = {"first term alone": given}
for strength in (1.0,):  # add 10.0 to see a stronger second term
    whole = ColorProblem(
        prior=given, neighbors=neighbors, free=hidden, band=band, lambda_nn=strength
    )
    solved = solve_colors(given, whole, max_iterations=50 if SMALL else 100, tolerance=1e-3)
    versions[f"lambda {strength:g}"] = solved.colors
chest = ours.vertices.mean(0) + np.array([0, 0.25, 0])
close = {"azimuth": 95, "center": chest, "extent": 0.9, "size": SIZE}
plain = dataclasses.replace(ours, uv=None, texture=None)
pictures = [
    preview_surface(
        dataclasses.replace(plain, colors=np.clip(colors, 0, 1).astype(np.float32)), **close
    )
    for colors in versions.values()
]
show(pictures, list(versions))
for name, colors in versions.items():
    step = np.linalg.norm(colors[band] - colors[neighbors[band]].mean(axis=1), axis=1).mean()
    print(f"{name}: {step:.3f} between a vertex of the band and the mean of its neighbors")

# %% [markdown]
# **Exercise 1.** In the line above, move the wrong guess into the transition band
# (`guess[20] = 1.0`). What remains of it, and why? **Exercise 2.** Let `LAMBDA` grow to 10, then to
# 30. What happens to the step at vertex 40, with squares and with norms?
#
# *Answers.* 1: nothing: in the band the first term does not count, so guesses there are not read.
# 2: with squares it gets softer and softer. With norms it costs `LAMBDA` times its height, and
# removing it means changing the 20 vertices to its right by that height. So it stays sharp up to
# `LAMBDA = 20` and then vanishes at once.
#
# ## To turn with the mouse

# %%
light = simplify(ours.vertices, ours.faces, 20_000)
colors = (ours.colors[light.kept] * 255).astype(np.uint8)
mesh = trimesh.Trimesh(ours.vertices[light.kept], light.faces, vertex_colors=colors, process=False)
trimesh.Scene(mesh).show(viewer="jupyter")

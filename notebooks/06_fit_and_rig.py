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
# From the person in a photo to a character: a parametric body is fitted (Eq. 15 to 18), and the
# reconstructed surface is bound to its bones (Eq. 19). [Body](../docs/body.md) and
# [animation](../docs/animation.md) have the details.

# %%
import os
import warnings

import matplotlib.pyplot as plt
import numpy as np

from a2v import Surface
from a2v.body import PARTS, FitSettings, fit_body, load_body_model, make_body
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.samples import load_ready_person

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
SIZE = 128 if SMALL else 320

# %% [markdown]
# ## The body model
# A body model is a function $\mathcal M(\beta, \theta)$ of a shape $\beta$ and a pose $\theta$,
# one rotation vector per bone. The papers use SMPL, we use Anny. Its shape is a few numbers between
# 0 and 1. At rest the axes of every bone are parallel to the world's, so a rotation vector means
# the same for all bones. `load_body_model("SMPLX_NEUTRAL.npz")` reads your own SMPL file.

# %%
model = load_body_model()
print(
    f"{model.name}: {len(model.weights)} vertices, {model.n_bones} bones, "
    f"shape: {', '.join(model.shape_names[:6])}..."
)


def clay(body):
    """A body as an uncolored surface."""
    return Surface(
        vertices=body.vertices, faces=body.faces, colors=np.full_like(body.vertices, 0.8)
    )


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
    ax.imshow(
        preview_surface(
            clay(one),
            azimuth=20,
            size=SIZE,
            center=np.array([0, 1.05, 0]),
            extent=2.3,
            style=PreviewStyle(plain=True),
        )
    )
    ax.set_title(f"{name}, {np.ptp(one.vertices[:, 1]):.2f} m", fontsize=9)
    ax.axis("off")

# %% [markdown]
# ## Three terms, one after the other
# **Joints (Eq. 16).** The photo's joints $\hat J_{c,i}$ attract those of the body, with the
# detector's confidence $\omega_i$:
#
# $$\mathcal L_{\text{joints}} = \sum_i \omega_i\, \rho\big(f(J(\beta)_i, \theta) - \hat
# J_{c,i}\big), \qquad \rho(e) = \frac{\sigma^2 e^2}{\sigma^2 + e^2} \tag{16}$$
#
# $\rho$ is the penalty of Geman and McClure: a square near zero, level far away, so that a joint
# that the detector got wrong does not pull the body along.
#
# **Surface (Eq. 17).** Every point of the reconstructed surface attracts the nearest point of the
# body:
#
# $$\mathcal L_{\text{surface}} = \sum_{i \in S} \min_{v \in \mathcal M(\beta, \theta)}
# \lVert S^i - v \rVert_2 \tag{17}$$
#
# **Pose prior (Eq. 18).** Poses that people rarely take cost more. A Gaussian mixture of recorded
# poses says how rare one is:
#
# $$\mathcal L_{\text{reg}} = -\log \sum_i g_i\, N(\theta; \mu_i, \Sigma_i) \tag{18}$$
#
# Here are the first and the last as curves: three values of $\sigma$, and the cost of bending one
# knee with everything else at the likeliest pose. The prior is of angles, so it knows that a knee
# does not bend forward.

# %%
import torch

from a2v.body.pose_prior import load_pose_prior
from a2v.body.terms import geman_mcclure, likely_pose

errors = torch.linspace(-0.3, 0.3, 121)
figure, axes = plt.subplots(1, 2, figsize=(9, 2.5))
for sigma in (0.03, 0.05, 0.1):
    axes[0].plot(errors, geman_mcclure(errors**2, sigma), label=f"sigma {sigma:g}")
axes[0].plot(errors, errors**2, "k:", label="square")
axes[0].set(xlabel="error, share of the height", title="Eq. 16: rho", ylim=(0, 0.012))
axes[0].legend(fontsize=7)
prior = load_pose_prior()
knee = prior.names.index("left_knee_bend")
poses = torch.from_numpy(np.tile(prior.means[prior.weights.argmax()], (121, 1))).double()
poses[:, knee] = torch.linspace(-1.0, 2.6, 121)
axes[1].plot(np.degrees(poses[:, knee]), likely_pose(poses, prior))
axes[1].set(xlabel="bend of the left knee, degrees", title="Eq. 18: cost of a pose")
figure.tight_layout()
print(f"{len(prior.weights)} Gaussians of {len(prior.names)} angles, from {prior.source}")

# %% [markdown]
# ## The fit to the photo
# The camera and the orientation come first, then the joints with the priors, then the silhouette.
# The residuals tell how well each fits.

# %%
ready = load_ready_person()  # the sample person at every stage; subject and surface are used here
subject, surface = ready.subject, ready.colored_surface
first = fit_body(subject, settings=FitSettings(rounds=1) if SMALL else None)
body, camera = first.body, first.camera
print(
    {name: round(value, 4) for name, value in first.residuals.items() if isinstance(value, float)}
)

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
# With a reconstructed surface, the papers' objective is the weighted sum of the three:
#
# $$\mathcal L(\beta, \theta) = \mathcal L_{\text{surface}} + \lambda_j \mathcal L_{\text{joints}}
# + \lambda_r \mathcal L_{\text{reg}} \tag{15}$$
#
# The first two rounds leave the surface out. As in the pipeline, the fit starts from the one to the
# photo. The surface wears clothes, so a distance of about a centimeter is right. Here the three
# terms are added one after the other. Each bar is a measure of one term: how far the landmarks are
# off, what Eq. 18 says of the pose, and how far the surface is from the body's nearest vertex.
# **Turn this:** the weights in `STAGES` (`joints_weight` is $\lambda_j$, `prior_weight`
# $\lambda_r$; 0 leaves a term out).

# %%
from scipy.spatial import cKDTree

STAGES = {
    "joints (16)": {"prior_weight": 0.0, "surface_weight": 0.0},
    "+ prior (18)": {"surface_weight": 0.0},
    "+ surface (17)": {},
}
fits = {"photo": first}
for name, weights in STAGES.items():
    chosen = FitSettings(rounds=1 if SMALL else 3, **weights)
    fits[name] = fit_body(subject, surface=surface, camera=camera, settings=chosen, initial=first)
measures = {"landmarks off, % of the height": [], "Eq. 18": [], "surface away, cm": []}
for one in fits.values():
    pose = torch.from_numpy(one.body.parameters["angles"].astype(float))[None]
    gaps = cKDTree(one.body.vertices).query(surface.vertices)[0]
    values = 100 * one.residuals["keypoint_mean"], likely_pose(pose, prior), 100 * gaps.mean()
    for own, value in zip(measures.values(), values, strict=True):
        own.append(float(value))
figure, axes = plt.subplots(1, 3, figsize=(11, 2.2))
for ax, (name, own) in zip(axes, measures.items(), strict=True):
    bars = ax.barh(list(fits), own, color="tab:blue")
    ax.bar_label(bars, fmt="%.2f", padding=2, fontsize=8)
    ax.set(title=name, xlim=(0, 1.2 * max(own)))
    ax.invert_yaxis()
figure.tight_layout()
result = fits["+ surface (17)"]
fitted = result.body
print("terms:", {name: round(value, 1) for name, value in result.residuals["loss"].items()})

# %% [markdown]
# Joints alone bring the landmarks closest and do not know of the surface. The prior makes the pose
# likelier, at little cost. With the surface the body comes nearer to it, and the landmarks pay:
# detectors and surface do not agree by some millimeters, and $\lambda_j$ decides between them. The
# bars differ by little, because every fit starts from the one to the photo, which is already near:
# this experiment shows in which direction a term pulls, not what it is worth from a bad start.

# %% [markdown]
# ## Binding (Eq. 19)
# Each vertex $S^j$ of the surface keeps its displacement from an anchor, the nearest vertex $i$ of
# the fitted body among those of the same body part:
#
# $$S^j = \mathcal M_i(\beta^*, \theta^*) + d_{i \to j} \tag{19}$$
#
# It also gets the weights of at most four bones. Parts matter where arms touch the trunk: without
# them the hand would be bound to the hip.

# %%
from a2v.animation import bind, deform

character = bind(surface, fitted)
displacements = surface.vertices - fitted.vertices[character.anchors]  # d of Eq. 19
print(f"displacements: {100 * np.linalg.norm(displacements, axis=1).mean():.2f} cm on average")
palette = plt.get_cmap("tab20")(np.arange(len(PARTS)))[:, :3].astype(np.float32)
parts = Surface(vertices=surface.vertices, faces=surface.faces, colors=palette[character.parts])
elbow = model.bone("lowerarm01.L")
weight = np.where(character.bones == elbow, character.weights, 0).sum(axis=1)
heat = Surface(
    vertices=surface.vertices,
    faces=surface.faces,
    colors=plt.get_cmap("viridis")(weight)[:, :3].astype(np.float32),
)
figure, axes = plt.subplots(1, 4, figsize=(11, 3.6))
for ax, (thing, azimuth, title) in zip(
    axes,
    [
        (surface, 0, "surface"),
        (parts, 0, "parts"),
        (parts, 180, "parts, back"),
        (heat, 20, "weight of the left forearm"),
    ],
    strict=True,
):
    ax.imshow(preview_surface(thing, azimuth=azimuth, size=SIZE))
    ax.set_title(title, fontsize=9)
    ax.axis("off")

# %% [markdown]
# In the pose of the photo nothing moves; that is what binding means:

# %%
still = deform(character, fitted.bone_transforms)
print(f"largest movement at the bind pose: {np.abs(still - surface.vertices).max():.1e} m")

# %% [markdown]
# ## A first pose
# Turn a bone of the fitted body, and the clothes follow. In the new pose Eq. 19 gives a target for
# each vertex; how the surface follows them without tearing is Eq. 20, notebook 07.

# %%
turned = fitted.parameters["rotations"].copy()
turned[model.bone("upperarm01.L")] += (0, 0, 1.2)
turned[model.bone("lowerleg01.R")] += (0.9, 0, 0)
posed = make_body(model, turned, fitted.parameters["shape"], fitted.parameters["translation"])
moved = deform(character, posed.bone_transforms)
figure, axes = plt.subplots(1, 3, figsize=(9, 3.6))
for ax, azimuth in zip(axes, (0, 60, 180), strict=True):
    shown = Surface(
        vertices=moved,
        faces=surface.faces,
        colors=surface.colors,
        uv=surface.uv,
        texture=surface.texture,
    )
    ax.imshow(preview_surface(shown, azimuth=azimuth, size=SIZE))
    ax.axis("off")

# %% [markdown]
# **Exercise 1.** Bind without body parts: take the nearest vertex of the whole body,
# `cKDTree(fitted.vertices).query(surface.vertices)[1]`. How many anchors lie in another part, and
# where? **Exercise 2.** Set `prior_weight` to 2 in the last of the `STAGES`, ten times the paper's
# $\lambda_r$. Which of the three measures changes?
#
# *Answers.* 1: compare `character.parts` with the parts of those anchors: most that differ lie
# where an arm hangs beside the trunk and between the legs, exactly the places that tear when the
# person moves. 2: hardly any: Eq. 18 falls from 22.7 to 21.6, the landmarks go from .48 to .50 %,
# and the surface stays at .98 cm. Joints and surface already say which pose it is. The prior is for
# what they do not show.

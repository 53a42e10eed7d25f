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
# # Render
#
# How light becomes a picture, and how a film of four views is made of it: Mitsuba 3 on the CPU,
# four cameras that follow, your own cameras, backgrounds, a person who steps out of the photo, and
# how steady the pictures are.

# %%
import os
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Video, display

from a2v import RenderSettings
from a2v.geometry.colors import linear_to_srgb
from a2v.rendering import CameraPath, Renderer, denoise, follow_cameras, read_cameras, write_video
from a2v.samples import load_ready_person
from pipelines.engine.store import Store
from pipelines.nodes.values import Image, Vertices
from pipelines.requests.video import VideoRequest, video_parameters
from pipelines.run import run

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
SIZE, FRAMES, SPP = (64, 4, 4) if SMALL else (128, 6, 4)

store, ready = Store(), load_ready_person()
character = ready.character
# the graph starts at these stages of the sample person; without `overrides` it makes them
given = {name: store.put(value) for name, value in ready.outputs.items()}
parameters = video_parameters(store, "../a2v/samples/person.jpg", "Jump", frames=FRAMES)
outcome = run("vertices", store=store, executor="serial", overrides=given, **parameters)
vertices = np.stack([store.get(ref, Vertices).vertices for ref in outcome.values["vertices"]])
print(f"{len(vertices)} frames of {vertices.shape[1]} vertices")


def shown(pictures, titles=()):
    """Pictures in a row."""
    _, axes = plt.subplots(1, len(pictures), figsize=(2.8 * len(pictures), 3), squeeze=False)
    for index, (ax, picture) in enumerate(zip(axes[0], pictures, strict=True)):
        ax.imshow(picture)
        ax.set_title(titles[index] if titles else "", fontsize=9)
        ax.axis("off")


# %% [markdown]
# ## The four views
# The papers place four cameras at half the character's height (Sec. 4.2.2). Here they have one
# distance for all and follow smoothly. A camera with focal length $f$ (pixels), rotation $R$ and
# place $\mathbf o$ shows a point $X$ at
#
# $$(u, v) = \Big(u_0 + f\,\frac{x}{z},\; v_0 - f\,\frac{y}{z}\Big), \qquad
# (x, y, z)^\top = R\,(X - \mathbf o).$$
#
# A renderer is set up once. Each picture depends only on its vertices, camera and settings, so
# frames can be rendered in any order and by many processes.

# %%
settings = RenderSettings(size=SIZE, spp=SPP)
cameras = follow_cameras(vertices, settings)
renderer = Renderer(character.surface, settings)
middle = len(vertices) // 2
shown([renderer.render(vertices[middle], path[middle]) for path in cameras.values()], list(cameras))

# %% [markdown]
# ## Noise
# The light $L$ that a surface point sends to the camera in direction $\omega_o$ is the integral of
# the light that arrives there, weighted with the reflectance $f_r$ (Kajiya's rendering equation,
# without emission):
#
# $$L(\mathbf x, \omega_o) = \int_{\Omega} f_r(\omega_i, \omega_o)\, L_i(\mathbf x, \omega_i)\,
# (\mathbf n \cdot \omega_i)\, d\omega_i
# \;\approx\; \frac1N \sum_{k=1}^N \frac{f_r\, L_i\, (\mathbf n \cdot \omega_k)}{p(\omega_k)}.$$
#
# A path tracer draws $N$ random directions (`spp`). With independent
# draws its error falls with $1/\sqrt N$: half the noise costs four times the time. Ours are spread
# evenly (*multijittered*), so the error falls faster. Still, we take few samples and let Open Image
# Denoise smooth the rest, which also sees albedo and normals.

# %%
layers = renderer.layers(vertices[middle], cameras["front"][middle])
shown(
    [
        linear_to_srgb(layers.color),
        linear_to_srgb(layers.albedo),
        0.5 + 0.5 * layers.normal,
        linear_to_srgb(denoise(layers)),
    ],
    [f"{SPP} samples", "albedo", "normals", "denoised"],
)

# %% [markdown]
# The error, measured as the difference from a picture with many samples, without denoiser:

# %%
samples = (1, 2, 4) if SMALL else (1, 4, 16)
view = vertices[middle], cameras["front"][middle]
reference = renderer.layers(*view, spp=32 if SMALL else 64, seed=99).color
noise = [
    float(np.sqrt(np.mean((renderer.layers(*view, spp=count).color - reference) ** 2)))
    for count in samples
]
plt.figure(figsize=(4, 2.4))
plt.loglog(samples, noise, "o-", label="measured")
plt.loglog(samples, noise[0] / np.sqrt(samples), "k:", label="1 / sqrt(N), independent")
plt.gca().set(xlabel="samples per pixel", ylabel="error, linear light")
plt.legend(fontsize=7)

# %% [markdown]
# ## Your own cameras
# A YAML file names them: around the character (`azimuth`, `elevation`, `turn`, `distance`,
# `follow`) or at a place (`origin`, `target`). On the command line:
# `a2v video ... --camera cameras.yaml --views front,hero`.

# %%
text = """
hero:   {azimuth: 35, elevation: 15, fov: 40}
high:   {azimuth: -50, elevation: 55}
tripod: {origin: [1.5, 0.4, 2.2], fov: 55}      # no target: it turns after the character
"""
file = Path(tempfile.mkdtemp()) / "cameras.yaml"
file.write_text(text)
own = read_cameras(file)
tracks = follow_cameras(
    vertices, RenderSettings(views=tuple(camera.name for camera in own)), cameras=own
)
shown([renderer.render(vertices[middle], track[middle]) for track in tracks.values()], list(tracks))

# %% [markdown]
# ## Backgrounds
# Above it was a stage. It can be a color, a picture, or nothing at all: then frames are PNGs with
# an alpha channel that contains the shadow.

# %%
checker = (
    ((np.indices((64, 64)) // 8).sum(0) % 2 * 60 + 150)
    .astype(np.uint8)[..., None]
    .repeat(3, axis=2)
)
checker[..., 2] = 120
pictures = []
for background in ("image", "transparent"):  # or a color, such as "#30506f"
    one = Renderer(
        character.surface,
        RenderSettings(size=SIZE, spp=SPP, background=background),
        backdrop=checker,
    )
    pictures.append(one.render(vertices[middle], cameras["left"][middle]))
shown(pictures, ["image", f"transparent: {pictures[-1].shape[2]} channels"])

# %% [markdown]
# ## A turntable
# `turntable` is a view like the others. Its camera goes once around while the character moves.

# %%
count = 4 if SMALL else 6
still = np.repeat(vertices[middle][None], count, axis=0)
around = follow_cameras(still, RenderSettings(views=("turntable",)))["turntable"]
frames = [renderer.render(cloud, camera) for cloud, camera in zip(still, around, strict=True)]
shown(frames)
clip = file.with_name("turntable.mp4")
write_video(clip, frames, 6.0)
display(
    Video(
        clip.read_bytes(),
        embed=True,
        mimetype="video/mp4",
        html_attributes="controls loop autoplay muted",
    )
)

# %% [markdown]
# ## Out of the photo
# With `background="photo"` the person is removed from the photo, the hole is filled, and the
# character is rendered into the photo's place by the photo's own camera. With `from_photo` the
# motion starts in the photo's pose: during the first .9 s every bone turns from its place in the
# photo to that of the motion, $R(t) = R_0 \exp\!\big(e(t) \log(R_0^\top R_1)\big)$ with an ease
# $e$ from 0 to 1 (Eq. 4 and its inverse).

# %%
wished = VideoRequest.of(
    photo="../a2v/samples/person.jpg", action="Walk", frames=4, fps=3.0,
    background="photo", from_photo=True, size=96 if SMALL else 128, spp=SPP,
).resolve(store)  # fmt: skip
stepped = run(
    "photo_frame", graph=wished.graph, store=store, executor="serial", overrides=given,
    **wished.parameters,
)  # fmt: skip
pictures = [store.get(ref, Image).pixels[..., :3] for ref in stepped.values["photo_frame"]]
shown(pictures, [f"{index / 3:.2f} s" for index in range(len(pictures))])

# %% [markdown]
# ## Flicker
# Every frame has the same seed, so what does not move does not change. Flicker is the standard
# deviation over time, in levels of 255, of pixels that show no movement.

# %%
fixed = CameraPath(name="fixed", azimuth=20, follow=False)
camera = follow_cameras(vertices, RenderSettings(views=("fixed",)), cameras=(fixed,))["fixed"][0]
short = vertices[-4:]
stack = np.stack([renderer.render(cloud, camera) for cloud in short]).astype(float)
steady = stack.std(axis=0).mean(axis=-1)
moving = np.stack([renderer.mask(cloud, camera) for cloud in short]).max(axis=0) > 0
plt.figure(figsize=(4, 3.4))
plt.imshow(steady, vmax=8, cmap="magma")
plt.colorbar(label="levels")
plt.axis("off")
print(
    f"beside the person: {steady[~moving].mean():.3f} levels on average (shadows included), "
    f"on the person: {steady[moving].mean():.1f}"
)

# %% [markdown]
# **Exercise 1.** How many samples per pixel halve the error of 16? **Exercise 2.** In the last
# cell, render frame $t$ with another seed: `denoise(renderer.layers(cloud, camera, seed=t))`. What
# does the flicker of the still background do, and why does the denoiser not help?
#
# *Answers.* 1: 64 independent ones, and fewer of ours (read it off the curve). 2: it rises from
# zero to the level of the noise. A denoiser removes noise within a picture. What remains differs
# from frame to frame, which the eye sees as boiling.

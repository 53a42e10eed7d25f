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
# Mitsuba 3 on the CPU: four cameras that follow, cameras of your own, backgrounds, a turntable, and how steady the pictures are.

# %%
import os
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Video, display

from a2v import Character, RenderSettings
from a2v.geometry.colors import linear_to_srgb
from a2v.rendering import CameraPath, Renderer, denoise, follow_cameras, read_cameras, write_video
from pipelines.engine.store import Store
from pipelines.nodes.values import Vertices
from pipelines.requests.video import video_parameters
from pipelines.run import run

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
SIZE, FRAMES, SPP = (64, 4, 4) if SMALL else (256, 32, 8)

store = Store()
parameters = video_parameters(store, "../a2v/samples/person.jpg", "Jump", frames=FRAMES)
outcome = run(["character", "vertices"], store=store, **parameters)
character = outcome.get("character", Character)
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
# At half the character's height, one distance for all, following smoothly. A renderer is set up once; each picture then depends on nothing but its vertices,
# camera and settings, so frames may be rendered in any order and by many processes.

# %%
settings = RenderSettings(size=SIZE, spp=SPP)
cameras = follow_cameras(vertices, settings)
renderer = Renderer(character.surface, settings)
middle = len(vertices) // 2
shown([renderer.render(vertices[middle], path[middle]) for path in cameras.values()], list(cameras))

# %% [markdown]
# ## Noise
# Few samples a pixel, then Open Image Denoise, which sees albedo and normals too.

# %%
layers = renderer.layers(vertices[middle], cameras["front"][middle])
shown(
    [linear_to_srgb(layers.color), linear_to_srgb(layers.albedo), 0.5 + 0.5 * layers.normal, linear_to_srgb(denoise(layers))],
    [f"{SPP} samples", "albedo", "normals", "denoised"],
)

# %% [markdown]
# ## Cameras of your own
# A YAML file names them: around the character (`azimuth`, `elevation`, `turn`, `distance`, `follow`) or at a place (`origin`, `target`).
# On the command line: `a2v video ... --camera cameras.yaml --views front,hero`.

# %%
text = """
hero:   {azimuth: 35, elevation: 15, fov: 40}
high:   {azimuth: -50, elevation: 55}
tripod: {origin: [1.5, 0.4, 2.2], fov: 55}      # no target: it turns after the character
"""
file = Path(tempfile.mkdtemp()) / "cameras.yaml"
file.write_text(text)
own = read_cameras(file)
tracks = follow_cameras(vertices, RenderSettings(views=tuple(camera.name for camera in own)), cameras=own)
shown([renderer.render(vertices[middle], track[middle]) for track in tracks.values()], list(tracks))

# %% [markdown]
# ## Backgrounds
# A colour, a picture, or nothing at all: then frames are PNGs with an alpha channel, the shadow in it.

# %%
checker = ((np.indices((64, 64)) // 8).sum(0) % 2 * 60 + 150).astype(np.uint8)[..., None].repeat(3, axis=2)
checker[..., 2] = 120
pictures = []
for background in ("stage", "#30506f", "image", "transparent"):
    one = Renderer(character.surface, RenderSettings(size=SIZE, spp=SPP, background=background), backdrop=checker)
    pictures.append(one.render(vertices[middle], cameras["left"][middle]))
shown(pictures, ["stage", "#30506f", "image", f"transparent: {pictures[-1].shape[2]} channels"])

# %% [markdown]
# ## A turntable
# `turntable` is a view like the others; it goes once around while the character moves. Of a single pose it makes the classical one.

# %%
count = 4 if SMALL else 24
still = np.repeat(vertices[middle][None], count, axis=0)
around = follow_cameras(still, RenderSettings(views=("turntable",)))["turntable"]
frames = [renderer.render(cloud, camera) for cloud, camera in zip(still, around, strict=True)]
shown(frames[:: count // 4])
clip = file.with_name("turntable.mp4")
write_video(clip, frames, 12.0)
display(Video(clip.read_bytes(), embed=True, mimetype="video/mp4", html_attributes="controls loop autoplay muted"))

# %% [markdown]
# ## How steady it is
# Same seed for every frame: what does not move does not change. Flicker is the standard deviation over time, in levels of 255, of pixels that show no movement.

# %%
fixed = CameraPath(name="fixed", azimuth=20, follow=False)
camera = follow_cameras(vertices, RenderSettings(views=("fixed",)), cameras=(fixed,))["fixed"][0]
short = vertices[middle : middle + 4] if len(vertices) > 6 else vertices
stack = np.stack([renderer.render(cloud, camera) for cloud in short]).astype(float)
steady = stack.std(axis=0).mean(axis=-1)
moving = np.stack([renderer.mask(cloud, camera) for cloud in short]).max(axis=0) > 0
plt.figure(figsize=(4, 3.4))
plt.imshow(steady, vmax=8, cmap="magma")
plt.colorbar(label="levels")
plt.axis("off")
print(
    f"where no one stands: {steady[~moving].mean():.3f} levels on average (shadows included), where someone does {steady[moving].mean():.1f}"
)

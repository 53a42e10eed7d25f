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
# # The papers' way beside the default
#
# One photo and one action go through the pipeline twice: as the two papers describe it, and as
# `a2v video` does it. The command for the first is
#
# ```
# a2v video --photo me.jpg --action walk --papers --out out/papers
# ```
#
# `--papers` is one name for a set of options (`PAPERS` below). Every one of them can be given
# beside it and then replaces its part.
#
# | stage | the papers | the default |
# |---|---|---|
# | label to motion | the VAE GLMI-M, frame by frame (Eq. 9 to 11) | a flow over whole windows |
# | clean-up of feet | none | contacts are held |
# | photo to surface | PIFuHD's shape in the photo's pose | the body's own mesh at rest, dressed |
# | unseen colors | Eq. 14 | cloth, hair and skin are continued |
# | hands and face | those of the surface | of the body model, with fingers and expressions |
# | binding | displacements (Eq. 19) | by construction |
# | frames | Eq. 20, control points of weight 1 | the same with weight 0.05 |
#
# PIFuHD's weights cannot be shipped: without `--pifuhd FILE` the surface is that of our own
# networks of PIFu's kind. The body is Anny, or yours with `--fit.model SMPL.npz`. The command
# prints which of them it uses.

# %%
import os
import warnings

import matplotlib.pyplot as plt
from IPython.display import display

from a2v import Character, Motion
from a2v.rendering.stickfigure import plot_rows
from a2v.samples import load_ready_person
from pipelines.engine.store import Store
from pipelines.nodes.values import Image
from pipelines.requests.papers import PAPERS, parts_used
from pipelines.requests.video import VideoRequest
from pipelines.run import run

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
PHOTO = "../a2v/samples/person.jpg"
ACTION = "walk"
FRAMES = 2 if SMALL else 3
VIEWS = ("front", "back")  # two of the papers' four, to be quick
FILM = {"size": 64 if SMALL else 176, "spp": 1 if SMALL else 2, "fps": 5.0, "frames": FRAMES}
FILM |= {"views": ",".join(VIEWS)}
COARSE = {"implicit.resolution": 200, "implicit.vertices": 25000, "color.texture": 0}
COARSE |= {"implicit.limits": False, "fit.rounds": 1}

store = Store()  # the folder of remembered results: $A2V_CACHE, else ~/.cache/a2v
asked = {
    "the papers": VideoRequest.of(photo=PHOTO, action=ACTION, **(PAPERS | COARSE | FILM)),
    "the default": VideoRequest.of(photo=PHOTO, action=ACTION, **FILM),
}
resolved = {way: request.resolve(store) for way, request in asked.items()}
for name, value in PAPERS.items():
    print(f"--{name.replace('_', '-')} {value}")
print(*parts_used(asked["the papers"], resolved["the papers"]), sep="\n")

# %% [markdown]
# ## What both share, and what is computed
# Person and body in the photo are the same for both, and are loaded
# (`a2v.samples.load_ready_person`). Of the default the whole character is loaded; the papers' one
# is computed here, on a coarse grid (`COARSE`), to be quick.

# %%
ready = load_ready_person().outputs
shared = ("subject", "photo_body", "photo_camera")
given = {
    "the papers": {name: store.put(ready[name]) for name in shared},
    "the default": {name: store.put(value) for name, value in ready.items()},
}


def compute(way, *names):
    """Run what `names` need, as one of the two ways does."""
    found = resolved[way]
    return run(names, store=store, executor="serial", overrides=given[way], **found.parameters)


characters = {way: compute(way, "character").get("character", Character) for way in asked}
for way, character in characters.items():
    surface = character.surface
    print(f"{way}: {len(surface.vertices)} vertices, {surface.visible.mean():.0%} of them seen")

# %% [markdown]
# ## What they do
# Both motions have the same action and seed. A VAE sees joints and no floor: on HumanAct12 the feet
# of GLMI-M skate in 10 % of the frames, those of recordings in 4 %
# ([table](../docs/results/motion_humanact12.md)).

# %%
motions = {way: compute(way, "motion").get("motion", Motion) for way in asked}
for way, motion in motions.items():
    print(way, resolved[way].parameters["model"].path.rpartition("/")[2])
    display(plot_rows(motion, poses=motion.frames))

# %% [markdown]
# ## The frames
# The upper two rows are the papers' way, from the front and from behind, the lower two the default.
# Eq. 14,
#
# $$\min_{c} \sum_{i \in O \setminus B} \lVert c_i - c^p_i\rVert_2 + \lambda_{nn} \sum_{i \in O}
# \sum_{j \in N(i)} \lVert c_i - c_j\rVert_2,$$
#
# keeps unseen colors $c_i$ near a guess $c^p_i$ and near their neighbors' (in the transition band
# $B$ near the neighbors' alone). It has no pattern to continue: the shirt's back is plain.

# %%
figure, axes = plt.subplots(4, FRAMES, figsize=(1.8 * FRAMES, 7.2), squeeze=False)
for index, way in enumerate(asked):
    grid = compute(way, "frame").values["frame"]
    views = resolved[way].parameters["render"].views
    for row, view in enumerate(VIEWS):
        for t in range(FRAMES):
            ax = axes[2 * index + row, t]
            ax.imshow(store.get(grid[t, views.index(view)], Image).pixels)
            ax.axis("off")
        axes[2 * index + row, 0].set_title(f"{way}, {view}", fontsize=8)

# %% [markdown]
# **Exercise 1.** Add `"color.synthesis": "true"` after `**PAPERS`. Which nodes are computed again,
# and what changes behind? **Exercise 2.** Take `--model cmu-glmi-m` in place of `glmi-m`. What do
# the first frames look like? (Notebook 07 shows what the weight of control points does.)
#
# *Answers.* 1: the colors and all that follows them, not the surface; the shirt's pattern goes on
# at the back. 2: the person is twisted, and straightens within the first half second. The first
# frame of the VAE follows a pose of zeros, which is no pose.

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
# # Training
#
# The two kinds of motion model, trained for a short while to show the parts: the papers' temporal VAE (Eq. 9 to 13) and the
# project's own flow over whole windows. A real training is `a2v train motion` or `a2v train flow` with the same settings and more
# iterations. Without the papers' data (`A2V_DATA`, else `../../shared/data`), clips of the shipped model stand in.

# %%
import dataclasses
import logging
import os
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import display

from a2v.lab.datasets import ClipSampler, load_dataset
from a2v.lab.datasets.generated import generated_dataset
from a2v.lab.motion.flow import FlowSettings
from a2v.lab.motion.flow_training import train_flow
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.training import TrainSettings, train
from a2v.lab.motion.vae import MotionVAE
from a2v.motion import MotionModel
from a2v.rendering.stickfigure import StickSettings, plot_rows
from export.flow import Sampling, export_flow
from export.motion import export_motion

warnings.simplefilter("ignore")  # of torch's exporter, about its own future
logging.getLogger("torch.onnx").setLevel(logging.ERROR)
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
DATA = Path(os.environ.get("A2V_DATA", "../../shared/data"))
folder = Path(tempfile.mkdtemp(prefix="a2v-training-"))

# %% [markdown]
# ## What is learned from
# Random windows of clips; the root starts at the origin, and a clip that is too short holds its last pose.

# %%
data = load_dataset("humanact12", DATA) if DATA.is_dir() else generated_dataset(MotionModel.load("humanact12"), clips=10)
keep = np.flatnonzero(np.isin(data.labels, [1, 3, 10]))  # walk, jump, boxing: enough for a demonstration
data = dataclasses.replace(data.subset([int(i) for i in keep]), length=16 if SMALL else data.length)
windows, labels, lengths = ClipSampler(data, data.length).batch(64, np.random.default_rng(0))
print(f"{data.name}: {len(data)} clips; a batch: windows {windows.shape}, labels {labels.shape}, bone lengths {lengths.shape}")

# %% [markdown]
# ## The temporal VAE
# At every frame a *prior* guesses the latent from the poses so far, a *posterior* is shown the pose to come, and the *generator*
# makes the pose; `glmi-m` decodes bone rotations and integrates the root's velocity. The loss (Eq. 12) weighs reconstruction, KL
# between posterior and prior, and the alignment of the trajectory.

# %%
vae = VAESettings(decoder="glmi-m")
network = MotionVAE(data.skeleton, len(data.actions), vae)
for name in ("posterior", "prior", "generator", "pose_decoder"):
    print(f"{name:13} {sum(p.numel() for p in getattr(network, name).parameters()):>8,} parameters")

# %%
settings = TrainSettings(
    iterations=4 if SMALL else 120, batch_size=8 if SMALL else 32, threads=1, device="cpu", learning_rate=1e-3, log_every=1 if SMALL else 5
)
rows = []
model = train(data, folder / "vae", vae=vae, settings=settings, on_log=lambda state, row: rows.append(dict(row)))
terms = [name for name in ("reconstruction", "kl", "alignment") if name in rows[0]]
figure, axes = plt.subplots(1, len(terms), figsize=(4 * len(terms), 2.8), squeeze=False)
for ax, name in zip(axes[0], terms, strict=True):
    ax.plot([row["iteration"] for row in rows], [row[name] for row in rows])
    ax.set(title=name, xlabel="iteration")
figure.tight_layout()
print(sorted(path.name for path in (folder / "vae").iterdir()))

# %% [markdown]
# Teacher forcing: a sequence is shown the recorded previous poses with the probability `teacher_forcing` (0.6), otherwise its own. Only the
# latter need a loop over frames. The run goes on where it stopped: the same call with the same settings reads `checkpoint.pt`.

# %%
again = train(data, folder / "vae", vae=vae, settings=settings)
same = all(np.array_equal(a.detach(), b.detach()) for a, b in zip(model.parameters(), again.parameters(), strict=True))
print("a finished run read back has the same weights:", same)

# %% [markdown]
# ## The flow
# A window becomes a short code (a linear one of bone directions and root path, in which feet count most), and a network learns the velocity that carries noise to codes along
# straight paths. There is no loop over frames at all.

# %%
flow_settings = FlowSettings(
    code_size=24 if SMALL else 96, context_size=16, width=64 if SMALL else 192, blocks=2, iterations=10 if SMALL else 600, batch_size=128,
    pool=300 if SMALL else 2000, threads=1, device="cpu", log_every=2 if SMALL else 20,
)  # fmt: skip
losses = []
flow = train_flow(data, folder / "flow", settings=flow_settings, on_log=lambda model, row: losses.append((row["iteration"], row["loss"])))
plt.figure(figsize=(5, 2.8))
plt.plot(*np.array(losses).T)
plt.gca().set(title="flow matching: error of the velocity", xlabel="iteration", ylim=(0, None))
# %% [markdown]
# ## One file for every use
# Both become a self-describing ONNX file: `MotionModel`, `a2v motion` and `export/sample.py` (numpy and onnxruntime only) read it.

# %%
export_motion(model, data, folder / "vae.onnx", license="a demonstration")
export_flow(flow, data, folder / "flow.onnx", license="a demonstration", sampling=Sampling(steps=2 if SMALL else 8, guidance=1.0))
for name in ("vae", "flow"):
    exported = MotionModel.load(folder / f"{name}.onnx")
    print(
        f"{name}.onnx: {exported.path.stat().st_size / 1e6:.1f} MB, {exported.card.decoder}, actions {', '.join(exported.actions)}"
    )

# %% [markdown]
# ## What they make after so little
# Above the shipped model, below the two of this page: the flow has the outlines of a person after a minute, the VAE needs many thousand
# iterations.

# %%
clips = [MotionModel.load("humanact12").sample("walk", seed=4)]
clips += [MotionModel.load(folder / f"{name}.onnx").sample("walk", seed=4) for name in ("flow", "vae")]
display(plot_rows(clips, titles=["shipped", "flow, this page", "VAE, this page"], poses=8, settings=StickSettings(size=150)))

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
# How a network learns to generate motion from a label. This lecture builds the papers' temporal
# variational auto-encoder term by term (Eq. 9 to 13), trains it for a short while with two kinds
# of prior, and then trains the project's default model, a flow over whole windows.
#
# A real training is `a2v train motion` or `a2v train flow` with the same settings and many more
# iterations. The papers' data are read from `A2V_DATA`, else from `../../shared/data`. Without
# them, clips of the shipped model are used.

# %%
import dataclasses
import os
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import torch
from IPython.display import display

from a2v.lab.datasets import ClipSampler, load_dataset
from a2v.lab.datasets.generated import generated_dataset
from a2v.lab.evaluation.monitor import generator_of_vae
from a2v.lab.motion.flow import FlowSettings
from a2v.lab.motion.flow_training import train_flow
from a2v.lab.motion.losses import vae_losses
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.training import TrainSettings, train
from a2v.lab.motion.vae import MotionVAE, shifted
from a2v.motion import MotionModel
from a2v.rendering.stickfigure import StickSettings, plot_rows
from export.flow import WindowGraph

warnings.simplefilter("ignore")  # of libraries, about their own future
SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
DATA = Path(os.environ.get("A2V_DATA", "../../shared/data"))
folder = Path(tempfile.mkdtemp(prefix="a2v-training-"))

# %% [markdown]
# ## The data
# A training sample is a random window of a clip. Its root starts at the origin. A clip that is
# shorter than the window holds its last pose. Windows have 30 frames here, half of the papers', so
# that the page runs in seconds.

# %%
if DATA.is_dir():
    data = load_dataset("humanact12", DATA)
else:
    data = generated_dataset(MotionModel.load("humanact12"), clips=10)
keep = np.flatnonzero(np.isin(data.labels, [1, 3, 10]))  # walk, jump, boxing
data = dataclasses.replace(data.subset([int(i) for i in keep]), length=16 if SMALL else 30)
sampler = ClipSampler(data, data.length)
windows, labels, lengths = sampler.batch(8 if SMALL else 24, np.random.default_rng(0))
print(f"{data.name}: {len(data)} clips; windows {windows.shape}, bone lengths {lengths.shape}")

# %% [markdown]
# ## Posterior and prior (Eq. 9 and 10)
# A network that predicts the next pose from the last one alone always gives the same motion. So
# each frame has a random vector $\mathbf z_t$. Two networks describe it, each an encoder and a
# GRU that outputs a mean and a standard deviation. The *posterior* sees the real pose
# $\mathbf p_t$, so it is available in training only:
#
# $$\mathbf h_t = \mathbf E_n(\mathbf p_t, \mathbf a, c_t), \quad
# (\mu_\phi(t), \sigma_\phi(t)) = \mathbf{GRU}_\phi(\mathbf h_t) \tag{9}$$
#
# The *prior* sees the pose before it:
#
# $$\mathbf h'_{t-1} = \mathbf E_n(\mathbf p_{t-1}, \mathbf a, c_t), \quad
# (\mu_\psi(t), \sigma_\psi(t)) = \mathbf{GRU}_\psi(\mathbf h'_{t-1}) \tag{10}$$
#
# $\mathbf a$ is the label, one-hot, and $c_t = t/T$ counts the time. Here are both, line by line:

# %%
torch.manual_seed(0)
network = MotionVAE(data.skeleton, len(data.actions), VAESettings(decoder="glmi-m"))
joints, bones = torch.from_numpy(windows), torch.from_numpy(lengths)
actions = torch.eye(len(data.actions))[torch.from_numpy(labels)]
batch, frames = joints.shape[:2]
counter = torch.arange(1, frames + 1) / frames  # c_t
condition = torch.cat(
    [actions[:, None].expand(-1, frames, -1), counter[None, :, None].expand(batch, -1, 1)], -1
)
with torch.no_grad():
    posterior = network.posterior(torch.cat([joints.flatten(2), condition], -1))  # Eq. 9
    prior = network.prior(torch.cat([shifted(joints).flatten(2), condition], -1))  # Eq. 10
(mean_q, logvar_q, _), (mean_p, logvar_p, _) = posterior, prior
print("means of the posterior, (batch, frame, dimension of z):", tuple(mean_q.shape))
for name in ("posterior", "prior", "generator", "pose_decoder"):
    size = sum(p.numel() for p in getattr(network, name).parameters())
    print(f"{name:13} {size:>8,} parameters")

# %% [markdown]
# ## The KL term
# In training $\mathbf z_t$ comes from the posterior. When motions are generated, it comes from
# the prior. So the two must agree, which their Kullback-Leibler divergence measures. For diagonal
# Gaussians it is
#
# $$D_{\mathrm{KL}}(q\,\Vert\,p) = \frac12 \sum_i \Big[ \frac{\sigma_{q,i}^2}{\sigma_{p,i}^2}
# + \frac{(\mu_{q,i}-\mu_{p,i})^2}{\sigma_{p,i}^2} - 1
# - \log\frac{\sigma_{q,i}^2}{\sigma_{p,i}^2} \Big].$$
#
# The picture shows what the two parts of it cost: a shifted mean, and a wrong spread.


# %%
def divergence(mean_q, logvar_q, mean_p, logvar_p):
    """The formula above, summed over the dimensions of z."""
    ratio = torch.exp(logvar_q - logvar_p)
    shift = (mean_q - mean_p) ** 2 / torch.exp(logvar_p)
    return 0.5 * (ratio + shift - 1 - torch.log(ratio)).sum(-1)


zero, line = torch.zeros(1), torch.linspace(-2, 2, 81)
figure, axes = plt.subplots(1, 2, figsize=(8, 2.4))
axes[0].plot(line, [float(divergence(x[None], zero, zero, zero)) for x in line])
axes[0].set(xlabel="mean of q, in standard deviations of p", title="shifted mean", ylabel="KL")
axes[1].plot(line.exp(), [float(divergence(zero, 2 * x[None], zero, zero)) for x in line])
axes[1].set(xlabel="standard deviation of q over that of p", title="wrong spread")
figure.tight_layout()

# %% [markdown]
# ## Global and local movement integration (Eq. 11)
# The generator, two GRU layers, turns condition, previous pose and $\mathbf z_t$ into rotations
# and a vector $\mathbf h^o_t$. Forward kinematics $\boldsymbol\Gamma$ (Eq. 6, notebook 01) turns
# the rotations into a pose whose root is at the origin. *GLMI* then infers the root's velocity
# from the two local poses, so that the person moves where the legs carry it:
#
# $$\hat{\mathbf p}^o_t = \boldsymbol\Gamma(\hat{\mathbf p}^t_{\text{Lie}}), \quad
# \hat{\mathbf V}_{0,t} = \mathrm{MLP}(\hat{\mathbf p}^o_t, \mathbf p^o_{t-1}, \mathbf h^o_t), \quad
# \hat{\mathbf p}_t = \hat{\mathbf p}^o_t + \mathbf J_{0,t-1} + \hat{\mathbf V}_{0,t} \tag{11}$$

# %%
noise = torch.randn(batch, frames, network.settings.latent_size)
with torch.no_grad():
    pose = network.decode(
        shifted(joints), condition, mean_q + torch.exp(0.5 * logvar_q) * noise, bones
    )
    previous_root = shifted(joints)[:, :, :1]  # J_{0,t-1}
    local = pose.joints - previous_root - pose.velocity[:, :, None]  # p^o_t, by Eq. 11 backwards
    print("roots of the local poses lie at the origin:", float(local[:, :, 0].abs().max()) < 1e-5)

# %% [markdown]
# ## The objective (Eq. 12 and 13)
#
# $$\mathcal L = \sum_t \Big[\mathcal L_{rec} + \lambda_{kl}\, D_{\mathrm{KL}}
# + \lambda_{align} \lVert \mathbf V_{0,t} - \hat{\mathbf V}_{0,t}\rVert_2 \Big], \qquad
# \mathcal L_{rec} = \sum_k \lVert \mathbf J_{k,t} - \hat{\mathbf J}_{k,t} \rVert_2 \tag{12, 13}$$
#
# The first term asks for the real pose, the second keeps the posterior close to the prior, and
# the third asks for the real velocity of the root. A larger $\lambda_{kl}$ gives more typical and
# less varied motions. The library has the same terms as means over batch and frames:

# %%
with torch.no_grad():
    result = network.reconstruct(joints, actions, bones, noise)
    by_hand = (
        (result.pose.joints - joints).norm(dim=-1).sum(-1).mean(),  # Eq. 13
        divergence(mean_q, logvar_q, mean_p, logvar_p).mean(),
        (result.pose.velocity - (joints - shifted(joints))[:, :, 0]).norm(dim=-1).mean(),
    )
    library = vae_losses(result, joints, reconstruction="norm")
for name, mine, theirs in zip(library._fields, by_hand, library, strict=True):
    print(f"{name:15} by hand {float(mine):.4f}, library {float(theirs):.4f}")

# %% [markdown]
# ## A training, with a learned and with a fixed prior
# The papers' first argument for Eq. 10 is that the spread of what may come next changes over
# time. The alternative is a *fixed* prior $\mathcal N(0, I)$ in every frame (Eq. 7). Both are
# trained here from the same seed. Change `DECODER` to `lie` to leave GLMI out; the third term is
# zero then.
#
# *Teacher forcing*: with the probability `teacher_forcing` a sequence sees the recorded previous
# poses, otherwise its own. Gradients flow through its own poses too.

# %%
DECODER = "glmi-m"
rows, models = {}, {}
settings = TrainSettings(
    iterations=4 if SMALL else 24, batch_size=8, threads=1, device="cpu",
    learning_rate=2e-3, schedule="cosine", log_every=1 if SMALL else 2,
)  # fmt: skip
for kind in ("learned", "fixed"):
    own = rows[kind] = []
    models[kind] = train(
        data, folder / kind, vae=VAESettings(decoder=DECODER, prior=kind), settings=settings,
        on_log=lambda state, row, own=own: own.append(dict(row)),
    )  # fmt: skip
figure, axes = plt.subplots(1, 3, figsize=(11, 2.6))
for ax, name in zip(axes, ("reconstruction", "kl", "alignment"), strict=True):
    for kind, own in rows.items():
        ax.plot(
            [row["iteration"] for row in own], [row[name] for row in own], label=f"{kind} prior"
        )
    ax.set(title=name, xlabel="iteration")
axes[0].legend()
axes[1].set_yscale("log")
figure.tight_layout()

# %% [markdown]
# A learned prior can follow the posterior. With the fixed prior, the posterior has to come to
# $\mathcal N(0, I)$ in every frame, so information about the pose costs more. In a training of
# seconds the two are still close. [The research notes](../docs/research/motion-vae.md) compare
# longer ones: after 200 iterations of 32 the learned prior has an FID of 5.4, the fixed one 8.6.
#
# Does the learned prior's spread change over time? This is its mean standard deviation for windows
# of each action, of the network that was just trained. After so few iterations it has moved by a
# few percent only, but it already depends on the action and on the frame.

# %%
with torch.no_grad():
    _, logvar, _ = models["learned"].prior(torch.cat([shifted(joints).flatten(2), condition], -1))
spread = torch.exp(0.5 * logvar).mean(-1).numpy()
plt.figure(figsize=(6, 2.4))
for label in np.unique(labels):
    plt.plot(spread[labels == label].mean(0), label=data.actions[label])
plt.axhline(1, c="gray", ls=":", label="fixed prior")
plt.gca().set(xlabel="frame", ylabel="mean of sigma", title="spread of the prior")
plt.legend(fontsize=7)
print("files of a run:", sorted(path.name for path in (folder / "learned").iterdir()))

# %% [markdown]
# ## The flow
# The default model has no loop over frames. A whole window becomes one code $x_1$ (linear, of bone
# directions and the root's path; feet count most). Noise $x_0$ and code are joined by a straight
# line, and a network learns the velocity along it:
#
# $$x_s = (1-s)\,x_0 + s\,x_1, \qquad
# \mathcal L = \mathbb E\,\lVert v_\theta(x_s, s, \mathbf a) - (x_1 - x_0) \rVert^2.$$
#
# Sampling follows $v_\theta$ from noise at $s=0$ to a code at $s=1$ in a few steps. In one
# dimension, with codes at $\pm1$, the paths of the exact velocity look like this:

# %%
start, steps = np.random.default_rng(1).normal(size=60), 40
paths = [start]
for s in np.arange(steps) / steps:
    x = paths[-1]
    # how likely each code is, given x_s: a Gaussian of width 1 - s around s times the code
    weight = 1 / (1 + np.exp(-2 * s * x / (1 - s) ** 2))
    target = 2 * weight - 1
    paths.append(x + (target - x) / (1 - s) / steps)
plt.figure(figsize=(6, 2.4))
plt.plot(np.linspace(0, 1, steps + 1), np.stack(paths), c="tab:blue", lw=0.6)
plt.gca().set(xlabel="s", ylabel="x", title="from noise to the codes -1 and 1")

# %%
flow_settings = FlowSettings(
    code_size=24 if SMALL else 32, context_size=16, width=64 if SMALL else 128, blocks=2,
    iterations=10 if SMALL else 400, batch_size=128, pool=300 if SMALL else 400, threads=1,
    learning_rate=4e-3, average=0.98, device="cpu", log_every=2 if SMALL else 25,
)  # fmt: skip
losses = []
flow = train_flow(
    data,
    folder / "flow",
    settings=flow_settings,
    on_log=lambda model, row: losses.append((row["iteration"], row["loss"])),
)
plt.figure(figsize=(5, 2.4))
plt.plot(*np.array(losses).T)
plt.gca().set(title="flow: error of the velocity", xlabel="iteration", ylim=(0, None))

# %% [markdown]
# ## One file for every use
# `a2v train flow` and `a2v train motion` write an ONNX file that describes itself. `MotionModel`,
# `a2v motion` and `export/sample.py` (numpy and onnxruntime only) read it. In Python,
# `export_flow(flow, data, "flow.onnx", license=...)` of `export.flow` writes it. Here the same
# graph is called in torch, which saves the seconds of tracing: noise, the label, the share of the
# window in motion, given frames (none) and bone lengths go in, joints in meters come out.

# %%
graph = WindowGraph(flow, data, steps=2 if SMALL else 8, guidance=1.0).eval()
given = torch.zeros(1, flow.codec.context_frames, data.skeleton.n_joints, 3)
noise = torch.randn(1, flow_settings.code_size, generator=torch.Generator().manual_seed(4))
walk, all_of_it = torch.tensor([1]), torch.ones(1)
with torch.no_grad():
    window, _ = graph(noise, walk, all_of_it, given, torch.zeros(1), bones[:1])
by_flow = dataclasses.replace(
    data.subset([0]), joints=(window[0].numpy() / data.frame.meters_per_unit,)
).motion(0)
drawn = generator_of_vae(models["learned"], data)(
    np.array([1]), data.clip_bone_lengths[:1], np.random.default_rng(4)
)
by_vae = dataclasses.replace(data.subset([0]), joints=(data.frame.flip(drawn[0]),)).motion(0)
shipped = MotionModel.load("humanact12")
print(f"{shipped.path.name}: {shipped.path.stat().st_size / 1e6:.1f} MB, {shipped.card.decoder}")
clips = [shipped.sample("walk", seed=4), by_flow, by_vae]
titles = ["shipped", "flow, this page", "VAE, this page"]
display(plot_rows(clips, titles=titles, poses=8, settings=StickSettings(size=150)))

# %% [markdown]
# The flow has the outlines of a person after seconds. The VAE needs thousands of iterations.
#
# **Exercise 1.** Set `kl_end=10.0` in `settings`. What do the KL and the reconstruction do, and
# what is $\mathbf z_t$ good for then? **Exercise 2.** Which term of Eq. 12 disappears with
# `DECODER = "lie"`, and which layer of the network?
#
# *Answers.* 1: the KL goes to zero: the posterior says nothing that the prior does not know
# (*posterior collapse*), the reconstruction stays worse, and all samples of an action are alike.
# The 24 iterations of this page show the KL only: it ends at .01 instead of .07, with the same
# reconstruction (.058, .056). After 240 it is .0001 instead of .14, and the reconstruction .022
# instead of .018.
# 2: the alignment term, since no velocity is inferred; the MLP of Eq. 11. The generator outputs
# the root's position itself then.

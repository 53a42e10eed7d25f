"""Find out which part of generated clips worsens FID and accuracy on single actions (Table 4).

    python scripts/diagnose_locomotion.py --data ../shared/data --actions Jump,Walk
    python scripts/diagnose_locomotion.py --data ../shared/data --run runs/cmu --actions Jump,Walk
    python scripts/diagnose_locomotion.py --data ../shared/data --dataset humanact12-fine \\
        --run runs/humanact12-fine-lie --actions alike --clips 2000

The first form exchanges parts of recorded and generated clips of a shipped model. With --run, a
training's checkpoint generates from latents of its prior, of its posterior on recordings, and of
the posterior's residuals of other recordings, exchanged every few frames. ``--actions alike`` takes
all actions, drawn alike, and compares with recordings as in the data. Results are in
docs/research/motion-vae.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from scipy.ndimage import uniform_filter1d

from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.datasets import ActionDataset, ClipSampler, load_dataset
from a2v.lab.evaluation.classifier import Evaluator, load_evaluator
from a2v.lab.evaluation.metrics import accuracy, fid, multimodality
from a2v.lab.evaluation.sources import generator_of
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.vae import MotionVAE
from a2v.motion import MotionModel
from a2v.types import FloatArray, IntArray
from pipelines.lab.evaluate import EVALUATORS

Score = Callable[[str, FloatArray], None]


def without_root(clips: FloatArray) -> FloatArray:
    """Clips (N, T, J, 3) with the root at the origin in every frame."""
    return clips - clips[:, :, :1]


def with_rise(clips: FloatArray, factor: float) -> FloatArray:
    """Clips whose root's height over the first frame's is `factor` times as large."""
    moved = clips.copy()
    moved[..., 1] += (factor - 1) * (clips[:, :, :1, 1] - clips[:, :1, :1, 1])
    return moved


def rise(clips: FloatArray, unit: float) -> float:
    """Mean over clips of the root's largest height over that of the first frame, meters."""
    return float((clips[:, :, 0, 1].max(1) - clips[:, 0, 0, 1]).mean() * unit)


def exchange_parts(real: FloatArray, made: FloatArray, score: Score) -> None:
    """Score recordings, generated clips, and clips made of parts of both."""
    roots = {"recorded": real[:, :, :1], "generated": made[:, :, :1]}
    score("recordings", real)
    score("generated", made)
    score("recorded poses, generated roots", without_root(real) + roots["generated"])
    score("generated poses, recorded roots", without_root(made) + roots["recorded"])
    score("recordings, the root's rise times .25", with_rise(real, 0.25))
    score("recordings, roots at the origin", without_root(real))
    score("generated, roots at the origin", without_root(made))
    score("generated, the root's rise times 3", with_rise(made, 3.0))
    score("generated, a mean over 5 frames", uniform_filter1d(made, 5, axis=1, mode="nearest"))


class Latents:
    """A decoder that runs on its own poses, for recorded windows (N, T, J, 3) with their actions
    (N,) and bone lengths (N, J)."""

    @torch.no_grad()
    def __init__(
        self, model: MotionVAE, own: ActionDataset, real: FloatArray, labels: IntArray,
        bones: FloatArray,
    ) -> None:  # fmt: skip
        self._model, self._frame = model, own.frame
        self._lengths = torch.from_numpy(bones)
        one_hot = torch.eye(model.n_actions)[torch.from_numpy(labels)]
        self._actions = one_hot[:, None].expand(-1, real.shape[1], -1)
        size = (*real.shape[:2], model.settings.latent_size)
        noise = torch.randn(size, generator=torch.Generator().manual_seed(0))
        self.noise: FloatArray = noise.numpy()
        free = torch.zeros(len(real), dtype=torch.bool)
        result = model.reconstruct(torch.from_numpy(real), one_hot, self._lengths, noise, free)
        latent = result.posterior_mean + torch.exp(0.5 * result.posterior_logvar) * noise
        self.posterior: FloatArray = own.frame.flip(result.pose.joints.numpy())
        residual = (latent - result.prior_mean) / torch.exp(0.5 * result.prior_logvar)
        self.residual: FloatArray = residual.numpy()

    @torch.no_grad()
    def made(self, draws: FloatArray) -> FloatArray:
        """Native clips from draws (N, T, Z) in units of the prior."""
        drawn = torch.from_numpy(np.asarray(draws, np.float32))
        pose = self._model.sample(self._actions, self._lengths, drawn)
        return self._frame.flip(pose.joints.numpy())


def exchange_latents(
    model: MotionVAE, own: ActionDataset, label: int, score: Score, clips: int
) -> None:
    """Score clips of one decoder from latents of different sources."""
    real, _, bones = ClipSampler(own, own.length).batch(clips, np.random.default_rng(1))
    latents = Latents(model, own, real, np.full(clips, label), bones)
    residual = latents.residual
    score("latents of the prior", latents.made(latents.noise))
    score("latents of the posterior", latents.posterior)
    others = np.random.default_rng(0)
    for frames in (1, 5, 25, 50):
        mixed = np.empty_like(residual)
        for start in range(0, own.length, frames):
            part = slice(start, start + frames)
            mixed[:, part] = residual[others.integers(0, clips, clips), part]
        score(f"residuals of another recording every {frames} frames", latents.made(mixed))


def compare_alike(
    model: MotionVAE, dataset: ActionDataset, evaluator: Evaluator, clips: int
) -> None:
    """Print the measures of recordings, and of one decoder's clips from latents of the posterior
    and of the prior, all with actions drawn alike, beside recordings as in the data."""
    batches = {
        balance: ClipSampler(dataset, dataset.length, balance=balance).batch(
            clips, np.random.default_rng([1, int(balance)])
        )
        for balance in (0.0, 1.0)
    }
    reference = evaluator(dataset.frame.flip(batches[0.0][0]))[0]
    real, labels, bones = batches[1.0]
    latents = Latents(model, dataset, real, labels, bones)
    print(f"{'source, actions alike':28s} FID  accuracy  multimodality")
    for name, native in (
        ("recordings", dataset.frame.flip(real)),
        ("latents of the posterior", latents.posterior),
        ("latents of the prior", latents.made(latents.noise)),
    ):
        features, found = evaluator((native - native[:, :1, :1]).astype(np.float32))
        spread = multimodality(features, labels, np.random.default_rng(2))
        print(
            f"{name:28s} {fid(reference, features):.2f}  {accuracy(found, labels):.3f}  "
            f"{spread:.2f}"
        )


def scorer(own: ActionDataset, evaluator: Evaluator, label: int, clips: int) -> Score:
    """Return a function that prints FID, accuracy and the root's rise of native clips."""
    sampler = ClipSampler(own, own.length)
    references = []
    for draw in range(3):
        windows, _, _ = sampler.batch(clips, np.random.default_rng([draw]))
        state = np.random.default_rng([9, draw])
        references.append(evaluator(own.frame.flip(windows), state="random", generator=state)[0])

    def score(name: str, clips: FloatArray) -> None:
        moved = (clips - clips[:, :1, :1]).astype(np.float32)
        features, found = evaluator(moved, state="random", generator=np.random.default_rng(3))
        value = np.mean([fid(reference, features) for reference in references])
        right = accuracy(found, np.full(len(found), label))
        height = rise(own.frame.flip(moved), own.frame.meters_per_unit)
        print(f"  {name:48s} FID {value:6.2f}  accuracy {right:.3f}  rise {height:.3f} m")

    return score


def load_trained(path: Path, dataset: ActionDataset) -> MotionVAE:
    """Return the model of a training's checkpoint. Only tensors and plain values are unpickled."""
    content = read_checkpoint(path, ("vae", "model"))
    model = MotionVAE(dataset.skeleton, len(dataset.actions), VAESettings(**content["vae"]))
    model.load_state_dict(content["model"])
    return model.eval()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--dataset", choices=EVALUATORS, default="cmu")
    parser.add_argument("--model", default="cmu-glmi-m", help="a shipped or exported model")
    parser.add_argument("--run", type=Path, help="folder of a training: its checkpoint.pt")
    parser.add_argument(
        "--actions", default="Jump,Walk", help="names separated by commas, or alike (with --run)"
    )
    parser.add_argument("--clips", type=int, default=500)
    arguments = parser.parse_args()
    dataset = load_dataset(arguments.dataset, arguments.data)
    evaluator = load_evaluator(arguments.data / "evaluators" / EVALUATORS[arguments.dataset])
    shipped = None if arguments.run else MotionModel.load(arguments.model)
    trained = load_trained(arguments.run / "checkpoint.pt", dataset) if arguments.run else None
    if arguments.actions == "alike":
        if trained is None:
            parser.error("--actions alike needs --run: an exported model has no posterior")
        compare_alike(trained, dataset, evaluator, arguments.clips)
        return
    for action in arguments.actions.split(","):
        label = dataset.actions.index(action)
        own = dataset.subset(np.flatnonzero(dataset.labels == label).tolist())
        score = scorer(own, evaluator, label, arguments.clips)
        print(action)
        if trained is not None:
            exchange_latents(trained, own, label, score, arguments.clips)
        if shipped is not None:
            real, _, _ = ClipSampler(own, own.length).batch(
                arguments.clips, np.random.default_rng(77)
            )
            chosen = np.random.default_rng(5).integers(0, len(own), arguments.clips)
            make = generator_of(shipped, own.length)
            labels = np.full(arguments.clips, label)
            made = make(labels, own.clip_bone_lengths[chosen], np.random.default_rng(6))
            exchange_parts(own.frame.flip(real), made, score)


if __name__ == "__main__":
    main()

"""Training of the window flow: resumable, on a CPU or CUDA."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from a2v.kinematics.ground import face_forward, first_heading
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.motion.flow import FlowModel, FlowNetwork, FlowSettings
from a2v.lab.motion.initial import carry_over, stored_codec
from a2v.lab.motion.windows import CodecSettings, WindowCodec
from a2v.lab.runs import RateSchedule, Run, Training, carry_on, identity
from a2v.motion.features import window_features

FILE = "flow.pt"


class Windows(NamedTuple):
    """Encoded windows with their conditions: codes (N, D), labels (N,), active shares (N,),
    context codes (N, C)."""

    codes: Tensor
    labels: Tensor
    active: Tensor
    context: Tensor


class WindowPool:
    """Encoded random windows with their conditions. They are drawn again from time to time."""

    def __init__(
        self,
        dataset: ActionDataset,
        codec: WindowCodec,
        *,
        balance: float = 0.0,
        forward: bool = False,
    ) -> None:
        self.dataset, self.codec, self.forward = dataset, codec, forward
        self.sampler = ClipSampler(dataset, dataset.length, balance=balance)
        self.counts = np.array([len(joints) for joints in dataset.joints])

    def draw(self, size: int, generator: np.random.Generator) -> Windows:
        """Draw `size` random windows."""
        clips = self.sampler.draw(size, generator)
        joints = self.sampler.windows(clips, generator)
        if self.forward:
            joints = face_forward(joints, first_heading(joints, self.dataset.skeleton))
        features = window_features(joints, self.dataset.skeleton)
        code = self.codec.window.encode(features.reshape(size, -1))
        context = self.codec.context.encode(
            features[:, : self.codec.context_frames].reshape(size, -1)
        )
        active = np.minimum(self.counts[clips] / self.dataset.length, 1).astype(np.float32)
        return Windows(
            *(torch.from_numpy(x) for x in (code, self.dataset.labels[clips], active, context))
        )


class FlowTraining(Training):
    """A flow's training in progress; every iteration draws from its own seed.

    Attributes
    ----------
    network, averaged : FlowNetwork
        The network in training, and the moving average of its weights.
    codec : WindowCodec
        Set once the training has begun or was resumed.
    """

    STORED = ("network", "averaged", "codec")
    codec: WindowCodec

    def __init__(self, dataset: ActionDataset, settings: FlowSettings) -> None:
        super().__init__()
        self.dataset, self.settings, self.device = dataset, settings, settings.claim()
        torch.manual_seed(settings.seed)
        self.network, self.averaged = (
            FlowNetwork(len(dataset.actions), settings, dataset.traits).to(self.device)
            for _ in range(2)
        )
        self.averaged.load_state_dict(self.network.state_dict())
        self.optimizer = torch.optim.AdamW(
            self.network.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        self.rate = RateSchedule(
            peak=settings.learning_rate, span=settings.iterations, floor=0.02, warm_up=500
        )
        self.features = 3 * dataset.skeleton.n_joints
        self.drawn: Windows | None = None

    def begin(self) -> None:
        """Fit the code, or start from the weights of another run."""
        chosen = self.settings
        sizes = CodecSettings(
            size=chosen.code_size,
            context_size=chosen.context_size,
            context_frames=chosen.context_frames,
            foot_place=chosen.foot_place,
            foot_step=chosen.foot_step,
            forward=chosen.face_forward,
        )
        self.codec = WindowCodec.fit(self.dataset, sizes, seed=chosen.seed)
        if chosen.initial:
            self.codec = carry_over(
                chosen.initial,
                self.network,
                self.codec,
                self.features,
                self.dataset.actions,
                self.dataset.traits,
            )
            self.averaged.load_state_dict(self.network.state_dict())

    def restore(self, content: Mapping[str, Any]) -> None:
        """See `Training`. The stored basis is used, because a new one could have eigenvectors of
        other signs."""
        self.network.load_state_dict(content["network"])
        self.averaged.load_state_dict(content["averaged"])
        self.codec = stored_codec(content, self.features)

    def content(self) -> dict[str, Any]:
        """Return the weights, their average, and the code."""
        return {
            "network": self.network.state_dict(),
            "averaged": self.averaged.state_dict(),
            "settings": dataclasses.asdict(self.settings),
            "dataset": self.dataset.name,
            "codec": {
                name: torch.from_numpy(array) for name, array in self.codec.to_arrays().items()
            },
        }

    @functools.cached_property
    def emphasis(self) -> Tensor:
        """Weight (D,) of each coefficient's error, 1 on average."""
        weight = torch.from_numpy(self.codec.window.scale).to(self.device) ** self.settings.emphasis
        return weight / weight.mean()

    @functools.cached_property
    def pool(self) -> WindowPool:
        """Return the source of windows."""
        return WindowPool(
            self.dataset,
            self.codec,
            balance=self.settings.balance,
            forward=self.settings.face_forward,
        )

    def step(self) -> dict[str, float]:
        """Run one iteration; returns its squared error as "loss"."""
        settings, iteration = self.settings, self.iteration
        refresh = max(1, settings.pool // 16)
        if iteration % refresh == 0 or self.drawn is None:
            drawn_at = (
                iteration - iteration % refresh
            )  # so that a resumed run uses the same pool as an uninterrupted one
            self.drawn = self.pool.draw(
                settings.pool, np.random.default_rng([settings.seed, drawn_at])
            )
        loss = self._loss(
            self.drawn, torch.Generator().manual_seed(settings.seed * 1_000_003 + iteration)
        )
        self.descend(loss)
        done = iteration + 1
        decay = min(settings.average, (1 + done) / (10 + done))
        with torch.no_grad():
            for mean, value in zip(
                self.averaged.parameters(), self.network.parameters(), strict=True
            ):
                mean.lerp_(value, 1 - decay)
        return {"loss": float(loss.detach())}

    def _loss(self, windows: Windows, draws: torch.Generator) -> Tensor:
        """Return the weighted squared error of the velocity at random points on the paths to a
        batch of `windows`."""
        settings, batch = self.settings, self.settings.batch_size
        chosen = torch.randint(0, len(windows.codes), (batch,), generator=draws)
        noise = torch.randn(batch, settings.code_size, generator=draws)
        # times from a logistic normal: the middle of the path is the hardest (Esser et al. 2024)
        moment = torch.sigmoid(torch.randn(batch, generator=draws))
        with_context = (torch.rand(batch, generator=draws) >= settings.context_dropout).float()
        without_action = torch.rand(batch, generator=draws) < settings.action_dropout
        known = torch.where(without_action, self.network.n_actions, windows.labels[chosen])
        target, noise, moment, with_context = (
            x.to(self.device) for x in (windows.codes[chosen], noise, moment, with_context)
        )
        active, context = (
            windows.active[chosen].to(self.device),
            windows.context[chosen].to(self.device),
        )
        point = (1 - moment[:, None]) * noise + moment[:, None] * target
        with torch.autocast(self.device.type, torch.bfloat16, enabled=settings.half):
            velocity = self.network(
                point,
                moment,
                self.network.condition(known.to(self.device), active, context, with_context),
            )
        loss: Tensor = (self.emphasis * (velocity.float() - (target - noise)) ** 2).mean()
        return loss


def train_flow(
    dataset: ActionDataset,
    folder: str | os.PathLike[str],
    *,
    settings: FlowSettings | None = None,
    on_log: Callable[[FlowModel, dict[str, float]], None] | None = None,
) -> FlowModel:
    """Train the flow in `folder`, or resume its training (``flow.pt`` every few minutes, at the end
    and on Ctrl-C).

    Parameters
    ----------
    dataset : ActionDataset
    folder : path
    settings : FlowSettings
    on_log : callable
        Called with the averaged model and the mean loss since the last call, every `log_every`
        iterations.

    Raises
    ------
    InputError
        The run in `folder` was made with other data or settings, the initial run has other sizes,
        actions or windows, the data has too few windows for the code, or training diverges.
    """
    settings = settings or FlowSettings()
    training = FlowTraining(dataset, settings)
    run = Run(
        Path(folder) / FILE, identity(settings, digest=dataset.sha256), settings.checkpoint_seconds
    )

    def show(row: dict[str, float]) -> None:
        if on_log is not None:
            on_log(FlowModel(training.averaged, training.codec), row)

    carry_on(training, run, settings, iterations=settings.iterations, on_log=show)
    return FlowModel(training.averaged.eval(), training.codec)

"""The papers' action classifier, which also gives the features of FID, diversity and
multimodality."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.io import sha256, shorten
from a2v.kinematics.ground import face_forward, first_heading, left_of
from a2v.lab.checkpoints import load_tensors
from a2v.lab.datasets import ActionDataset
from a2v.types import FloatArray, IntArray

State = Literal["zeros", "random"]


class ActionClassifier(nn.Module):
    """Two-layer GRU, a 30-dimensional tanh feature and a linear layer, as published with the
    papers.

    Parameters
    ----------
    input_size : int
        3 J.
    n_actions : int
    hidden_size, feature_size : int
    """

    def __init__(
        self, input_size: int, n_actions: int, *, hidden_size: int = 128, feature_size: int = 30
    ) -> None:
        super().__init__()
        self.recurrent = nn.GRU(input_size, hidden_size, num_layers=2, batch_first=True)
        self.linear1 = nn.Linear(hidden_size, feature_size)
        self.linear2 = nn.Linear(feature_size, n_actions)

    def forward(self, motions: Tensor, state: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """Return features (B, 30) and logits (B, A) of motions (B, T, 3 J).

        `state` (2, B, 128) is the GRU's first state, zeros by default. The published evaluation
        drew it from a normal distribution at every call.
        """
        output, _ = self.recurrent(motions, state)
        feature = torch.tanh(self.linear1(output[:, -1]))
        return feature, self.linear2(feature)


class Facing(NamedTuple):
    """Joints that define the heading, and their axes, by which a classifier turns its input to +z.

    Attributes
    ----------
    hips, shoulders : (left, right)
        Indices of joints.
    signs : 3 floats
        From the native axes to ours, see `a2v.lab.datasets.NativeFrame`.
    name : str
        Of the skeleton.
    """

    hips: tuple[int, int] | None
    shoulders: tuple[int, int] | None
    signs: tuple[float, float, float]
    name: str

    @classmethod
    def of(cls, dataset: ActionDataset) -> Facing:
        """Return the joints of a data set.

        Raises
        ------
        InputError
            Its skeleton does not name the joints of hips and shoulders.
        """
        skeleton = dataset.skeleton
        left_of(dataset.joints[0][:1], skeleton)
        return cls(skeleton.hips, skeleton.shoulders, dataset.frame.signs, skeleton.name)

    def turn(self, motions: FloatArray) -> FloatArray:
        """Motions (B, T, J, 3) in native axes, turned about the vertical."""
        signs = np.asarray(self.signs, motions.dtype)
        world = motions * signs
        turned: FloatArray = face_forward(world, first_heading(world, self)) * signs
        return turned


@dataclasses.dataclass(frozen=True)
class Evaluator:
    """A trained classifier with a description of its training.

    Attributes
    ----------
    network : ActionClassifier
    source : str
        File it came from.
    sha256 : str
        SHA-256 of that file.
    info : mapping
        Description by our own training (see `a2v.lab.evaluation.training`); empty for the
        authors'.
    """

    network: ActionClassifier
    source: str
    sha256: str
    info: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    @property
    def facing(self) -> Facing | None:
        """Its `Facing`, by which it turns motions before classification; None: no turn, like the
        authors' classifiers."""
        told = self.info.get("facing")
        return Facing(*told) if told else None

    @property
    def n_actions(self) -> int:
        """Number of actions A."""
        return self.network.linear2.out_features

    def demand_actions(self, dataset: ActionDataset) -> None:
        """Check that it was trained for the actions of `dataset`.

        Raises
        ------
        InputError
            It was trained for others.
        """
        if self.n_actions != len(dataset.actions):
            raise InputError(
                f"{self.source} was trained for {self.n_actions} actions; {dataset.name} has "
                f"{len(dataset.actions)}"
            )
        if self.info and list(self.info["actions"]) != list(dataset.actions):
            raise InputError(
                f"{self.source} was trained for other actions "
                f"({', '.join(self.info['actions'][:5])}...) than {dataset.name}"
            )

    @torch.no_grad()
    def __call__(
        self,
        motions: FloatArray,
        *,
        state: State = "zeros",
        generator: np.random.Generator | None = None,
    ) -> tuple[FloatArray, IntArray]:
        """Return features (B, 30) float64 and predicted labels (B,) of native-frame motions (B, T,
        J, 3).

        Parameters
        ----------
        motions : (B, T, J, 3) float
            Joints in the data set's native frame, first root at the origin.
        state : "zeros" (deterministic protocol) or "random" (the papers')
        generator : numpy Generator
            Needed for "random".

        Raises
        ------
        InputError
            The motions have another number of joints, or "random" has no generator.
        """
        network, facing = self.network, self.facing
        if motions.shape[-2] * 3 != network.recurrent.input_size:
            raise InputError(
                f"{self.source} expects {network.recurrent.input_size // 3} joints; "
                f"the motions have {motions.shape[-2]}"
            )
        turned = facing.turn if facing else np.asarray
        features, labels = [], []
        for start in range(0, len(motions), 512):
            batch = torch.from_numpy(
                np.ascontiguousarray(turned(motions[start : start + 512]), dtype=np.float32)
            ).flatten(2)
            first = None
            if state == "random":
                if generator is None:
                    raise InputError(
                        "the papers' protocol starts the classifier from random "
                        "states: give a generator"
                    )
                shape = (network.recurrent.num_layers, len(batch), network.recurrent.hidden_size)
                first = torch.from_numpy(generator.standard_normal(shape, dtype=np.float32))
            feature, logits = network(batch, first)
            features.append(feature.double().numpy())
            labels.append(logits.argmax(-1).numpy())
        return np.concatenate(features), np.concatenate(labels)


def load_evaluator(path: str | Path) -> Evaluator:
    """Load a classifier: the authors' ``*.tar`` or one that `train_classifier` saved.

    Only tensors are unpickled (``weights_only=True``).

    Raises
    ------
    InputError
        The file is missing or holds no such classifier.
    """
    try:
        content: Any = load_tensors(path)
        weights = content["model"]
        make = functools.partial(
            ActionClassifier,
            weights["recurrent.weight_ih_l0"].shape[1],
            weights["linear2.bias"].shape[0],
            hidden_size=weights["recurrent.weight_hh_l0"].shape[1],
            feature_size=weights["linear1.bias"].shape[0],
        )
        with torch.device(
            "meta"
        ):  # check sizes first: nothing is allocated before the file is known to contain as much
            if any(
                weights[name].shape != value.shape for name, value in make().state_dict().items()
            ):
                raise ValueError("its weights do not fit each other")
        network = make()
        network.load_state_dict(weights)
    except InputError:
        raise
    # torch raises many kinds of errors for a file that is not a checkpoint
    except Exception as error:
        raise InputError(f"{path} holds no action classifier ({shorten(error)})") from None
    return Evaluator(network.eval(), Path(path).name, sha256(path), content.get("a2v", {}))

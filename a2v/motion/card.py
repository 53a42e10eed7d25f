"""The description of an exported motion model: the metadata of its ONNX file, read and checked
once."""

from __future__ import annotations

import functools
import reprlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import shorten
from a2v.kinematics import Skeleton, skeleton_of
from a2v.sessions import WEIGHTS, open_session, read_metadata
from a2v.types import FloatArray

MAX_FRAMES = 10_000
"""Longest clip that is generated in one call."""

STEP_FORMAT = "a2v-motion/1"
"""Entry "format" of files that make clips frame by frame."""
WINDOW_FORMAT = "a2v-flow/1"
"""Entry "format" of files that make whole windows."""

STATE_NAMES = ("previous", "prior", "low", "high", "trajectory")
"""Recurrent inputs of a `STEP_FORMAT` graph: the previous pose (N, J, 3) and hidden states (N, H).
Its outputs are ``last_<name>``."""

_LARGEST_SIZE = 10_000
"""Largest size of noise vectors and states; shipped models have 384 and 128."""
_AGAIN = "export the model again with a2v"


@dataclass(frozen=True, kw_only=True)
class ModelCard:
    """The description that every exported motion model has.

    Attributes
    ----------
    dataset, dataset_digest : str
        Name and digest (`ActionDataset.digest`, "" if unknown) of the training data.
    decoder : str
        "flow", or the pose decoder of a VAE.
    license : str
        License of the weights.
    held_out : tuple of str
        Subjects that are not in the training data.
    actions : tuple of str
        In label order.
    fps : float
        Frame rate of the generated clips.
    frames : int
        Number of frames of the training clips.
    joint_names : tuple of J str
    skeleton : Skeleton
        The tree of its joints.
    rest_directions : (J, 3) float64
        Rest pose of the generated rotations, unit vectors.
    bone_lengths : (J,) float32
        Default bone lengths, native units.
    meters_per_unit : float
        Meters of one native unit.
    native_signs : tuple of 3 floats of +1 or -1
        Sign of each native axis; see `a2v.lab.datasets.NativeFrame`.
    latent_size : int
        Size Z of a noise vector.
    traits, descriptions : tuple of tuples of str
        By action: traits that it shares with others ("coarse:Walk"), and descriptions of its clips;
        empty if unknown.
    """

    dataset: str
    dataset_digest: str
    decoder: str
    license: str
    held_out: tuple[str, ...]
    actions: tuple[str, ...]
    fps: float
    frames: int
    joint_names: tuple[str, ...]
    skeleton: Skeleton
    rest_directions: FloatArray
    bone_lengths: FloatArray
    meters_per_unit: float
    native_signs: tuple[float, float, float]
    latent_size: int
    traits: tuple[tuple[str, ...], ...] = ()
    descriptions: tuple[tuple[str, ...], ...] = ()

    @functools.cached_property
    def rests_as_named(self) -> bool:
        """Whether the rest pose is that of `skeleton`. A custom skeleton was learned with its own
        rest pose."""
        return bool(np.allclose(self.rest_directions, self.skeleton.rest_directions, atol=1e-6))


@dataclass(frozen=True, kw_only=True)
class StepCard(ModelCard):
    """The card of a model that makes clips frame by frame (a VAE).

    Attributes
    ----------
    hidden_size : int
        Size H of a recurrent state.
    temperature : float
        Factor on the prior's standard deviation in the graph; 1 is Eq. 10 of the journal paper.
    """

    hidden_size: int
    temperature: float = 1.0


@dataclass(frozen=True, kw_only=True)
class WindowCard(ModelCard):
    """The card of a model that makes whole windows (a flow).

    Attributes
    ----------
    window_frames, context_frames : int
        Number of frames W of a window, and number of frames P that it may continue.
    active : tuple of arrays (n,) float64
        By action: fraction of a window in which each clip of the data moves, ascending, in [0, 1];
        empty if the data has no clip.
    headings : tuple of arrays (n,) float64
        By action: first headings of the data's windows, radians about +y from +z. Not empty for
        models whose windows all face +z.
    steerable : bool
        Whether the graph takes constraints (`a2v.motion.steer`).
    """

    window_frames: int
    context_frames: int
    active: tuple[FloatArray, ...]
    headings: tuple[FloatArray, ...] = ()
    steerable: bool = False


def read_card(path: Path) -> StepCard | WindowCard:
    """Read the card of an ONNX file.

    Raises
    ------
    InputError
        The file is not a motion model of a2v, or an entry is missing, of another type, or out of
        range. The message names file and entry.
    """
    if path.parent == WEIGHTS:  # tests check the graphs of the shipped ones
        return _shipped_card(path)
    check_graph(card := _parsed_card(path), path)
    return card


def _parsed_card(path: Path) -> StepCard | WindowCard:
    return parse_card(read_metadata(path, (STEP_FORMAT, WINDOW_FORMAT), "motion model"), path)


_shipped_card = functools.cache(_parsed_card)


def check_graph(card: StepCard | WindowCard, path: Path) -> None:
    """Check that the graph has the inputs and outputs of the card: names, types and sizes (except
    of clips and frames)."""
    joints = len(card.joint_names)
    body: dict[str, list[Any]] = {"bone_lengths": ["tensor(float)", 1, joints]}
    if isinstance(card, WindowCard):
        inputs = body | {
            "noise": ["tensor(float)", 1, card.latent_size],
            "actions": ["tensor(int64)", 1],
            "active": ["tensor(float)", 1],
            "context": ["tensor(float)", 1, card.context_frames, joints, 3],
            "has_context": ["tensor(float)", 1],
        }
        outputs = ["joints", "rotations", *(("basis", "mean") if card.steerable else ())]
    else:
        inputs = body | {
            "noise": ["tensor(float)", 2, card.latent_size],
            "actions": ["tensor(int64)", 2],
            "time": ["tensor(float)", 2],
            "previous": ["tensor(float)", 1, joints, 3],
            **{name: ["tensor(float)", 1, card.hidden_size] for name in STATE_NAMES[1:]},
        }
        outputs = ["joints", "rotations", *(f"last_{name}" for name in STATE_NAMES)]
    session = open_session(path)
    found = {item.name: [item.type, *item.shape] for item in session.get_inputs()}
    for name in sorted({*inputs, *found}):
        wanted, given = inputs.get(name), found.get(name)
        # the card's second number is the number of free sizes: clips, and frames
        if (
            wanted is None
            or given is None
            or given[0] != wanted[0]
            or given[1 + wanted[1] :] != wanted[2:]
            or len(given) <= wanted[1]
        ):
            raise InputError(
                f"{path}: its graph lacks the input '{shorten(name, 60)}' of its description; "
                f"{_AGAIN}"
            )
    if missing := set(outputs) - {item.name for item in session.get_outputs()}:
        raise InputError(f"{path}: its graph lacks the output '{min(missing)}'; {_AGAIN}")


def parse_card(metadata: Mapping[str, Any], path: Path) -> StepCard | WindowCard:
    """Parse the description of a file; `path` is for messages.

    Raises
    ------
    InputError
        See `read_card`.
    """
    entries = _Entries(metadata, path)
    common = _common(entries)
    if entries.text("format") == STEP_FORMAT:
        hidden = entries.integer("hidden_size", high=_LARGEST_SIZE)
        free = "temperature" in entries.entries
        factor = entries.number("temperature", low=1e-3, high=2) if free else StepCard.temperature
        return StepCard(**common, hidden_size=hidden, temperature=factor)
    window = entries.integer("window_frames")
    by_action = entries.items("active", length=len(common["actions"]))
    active = tuple(by_action.numbers(name, low=0, high=1) for name in by_action.entries)
    count = len(by_action.entries) if "headings" in entries.entries else 0
    turned = entries.items("headings", length=count) if count else _Entries({}, path)
    return WindowCard(
        **common,
        window_frames=window,
        context_frames=entries.integer("context_frames", high=max(window - 1, 1)),
        active=active,
        headings=tuple(turned.numbers(name, low=-3.2, high=3.2) for name in turned.entries),
        steerable=entries.flag("steerable"),
    )


def _texts_by_action(entries: _Entries, name: str, actions: int) -> tuple[tuple[str, ...], ...]:
    if not entries.entries.get(name):
        return ()
    by_action = entries.items(name, length=actions)
    return tuple(by_action.texts(item, least=0) for item in by_action.entries)


def _common(entries: _Entries) -> dict[str, Any]:
    """Read the fields that cards of all models have, those of `ModelCard`."""
    tree, actions = entries.part("skeleton"), entries.texts("actions")
    joints = tree.texts("joint_names")
    rest = tree.items("rest_directions", length=len(joints))
    parents = tree.indices("parents", length=len(joints))
    try:
        skeleton = skeleton_of(tree.text("name"), parents, joints)
    except InputError as error:
        raise InputError(f"{entries.path}: {error}; {_AGAIN}") from None
    return {
        "dataset": entries.text("dataset"),
        "dataset_digest": entries.text("dataset_digest")
        if "dataset_digest" in entries.entries
        else "",
        "decoder": entries.text("decoder"),
        "license": entries.text("licence"),  # the files spell this key in British English
        "held_out": entries.texts("held_out", least=0) if "held_out" in entries.entries else (),
        "actions": actions,
        "fps": entries.number("fps", low=0.1, high=1000),
        "frames": entries.integer("frames"),
        "joint_names": joints,
        "skeleton": skeleton,
        "rest_directions": np.array(
            [rest.numbers(name, length=3, low=-1.01, high=1.01) for name in rest.entries]
        ),
        "bone_lengths": entries.numbers("bone_lengths", length=len(joints), low=0, high=1e6).astype(
            np.float32
        ),
        "meters_per_unit": entries.number("metres_per_unit", low=1e-6, high=1e6),
        "native_signs": entries.signs("native_signs"),
        "latent_size": entries.integer("latent_size", high=_LARGEST_SIZE),
        "traits": _texts_by_action(entries, "traits", len(actions)),
        "descriptions": _texts_by_action(entries, "descriptions", len(actions)),
    }


@dataclass(frozen=True)
class _Entries:
    """Entries of a JSON object from outside, each checked when it is read. Errors name the file and
    the entry."""

    entries: Mapping[str, Any]
    path: Path

    def _checked(self, name: str, wanted: str, right: Callable[[Any], bool]) -> Any:
        if name not in self.entries:
            raise InputError(f"{self.path}: its description lacks '{name}', {wanted}; {_AGAIN}")
        value = self.entries[name]
        if not right(value):
            raise InputError(
                f"{self.path}: '{name}' in its description is {reprlib.repr(value)}; expected "
                f"{wanted}; {_AGAIN}"
            )
        return value

    def text(self, name: str) -> str:
        """Read a text."""
        return str(self._checked(name, "a text", lambda value: isinstance(value, str)))

    def number(self, name: str, *, low: float, high: float) -> float:
        """Read a number from `low` to `high`."""
        return float(
            self._checked(
                name,
                f"a number from {low:g} to {high:g}",
                lambda value: _is_number(value) and low <= value <= high,
            )
        )

    def integer(self, name: str, *, high: int = MAX_FRAMES) -> int:
        """Read a whole number from 1 to `high`."""
        return int(
            self._checked(
                name,
                f"a whole number from 1 to {high}",
                lambda value: _is_number(value) and 1 <= value <= high and value % 1 == 0,
            )
        )

    def flag(self, name: str) -> bool:
        """Read a truth value; false if it is missing."""
        return name in self.entries and bool(
            self._checked(name, "true or false", lambda value: isinstance(value, bool))
        )

    def texts(self, name: str, *, least: int = 1) -> tuple[str, ...]:
        """Read a list of at least `least` different texts."""

        def right(value: Any) -> bool:
            return (
                isinstance(value, list)
                and all(isinstance(item, str) for item in value)
                and len(set(value)) == len(value) >= least
            )

        return tuple(self._checked(name, "a list of different texts", right))

    def numbers(
        self, name: str, *, low: float, high: float, length: int | None = None
    ) -> FloatArray:
        """A list of numbers (n,) float64 from `low` to `high`, `length` of them if that is
        given."""

        def right(value: Any) -> bool:
            counted = isinstance(value, list) and length in (None, len(value))
            return counted and all(_is_number(item) and low <= item <= high for item in value)

        count = "a list of" if length is None else str(length)
        return np.array(
            self._checked(name, f"{count} numbers from {low:g} to {high:g}", right),
            dtype=np.float64,
        )

    def signs(self, name: str) -> tuple[float, float, float]:
        """Three signs, 1 or -1."""
        x, y, z = self._checked(name, "3 signs, 1 or -1", _are_signs)
        return float(x), float(y), float(z)

    def indices(self, name: str, *, length: int) -> list[int]:
        """A list of `length` whole numbers, -1 for none."""

        def right(value: Any) -> bool:
            return (
                isinstance(value, list)
                and len(value) == length
                and all(isinstance(item, int) and item >= -1 for item in value)
            )

        return list(self._checked(name, f"{length} whole numbers from -1", right))

    def part(self, name: str) -> _Entries:
        """The entries of an inner object."""
        return _Entries(
            self._checked(name, "an object", lambda value: isinstance(value, dict)), self.path
        )

    def items(self, name: str, *, length: int) -> _Entries:
        """The items of a list of `length` as entries ``name[0]``, ``name[1]``..."""
        items = self._checked(
            name,
            f"a list of {length}",
            lambda value: isinstance(value, list) and len(value) == length,
        )
        return _Entries({f"{name}[{index}]": item for index, item in enumerate(items)}, self.path)


def _are_signs(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 3
        and all(_is_number(item) and abs(item) == 1 for item in value)
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)

"""Find a person's joints in a skeleton: by names, else by shape. Arms that end early get ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.shape import LEAST, Shape, joints_by_shape
from a2v.types import FloatArray

UP_Z = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""Turns z up into y up: +y becomes -z."""
_ENDS = ("left_elbow", "left_wrist", "right_elbow", "right_wrist")
"""Joints that a person may lack; the rest moves."""


@dataclass(frozen=True)
class Understood:
    """A skeleton whose joints are known.

    Attributes
    ----------
    names : tuple of str
        Canonical names of the joints, ``other<n>`` of all other bones. The first B are the bones of
        the skeleton; added ones follow.
    parents : tuple of int
    heads : (B + added, 3) float64
        Heads at rest, in the axes of the given ones.
    notes : tuple of str
        What was found out, a sentence each.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    heads: FloatArray
    notes: tuple[str, ...]

    @property
    def joints(self) -> dict[str, int]:
        """Bone of each canonical joint."""
        return {name: bone for bone, name in enumerate(self.names) if not name.startswith("other")}


def understand(
    names: Sequence[str],
    parents: Sequence[int],
    heads: FloatArray,
    *,
    given: Mapping[str, int] | None = None,
) -> Understood | None:
    """Find the joints of a person.

    Parameters
    ----------
    names : B str
    parents : B ints
        -1 for roots; parents first.
    heads : (B, 3) float
        Heads at rest, any unit, y or z up.
    given : dict of canonical joint to bone, or None
        The joints, where the user names them.

    Returns
    -------
    Understood or None
        None if neither names nor the shape are a person's.
    """
    notes: list[str] = []
    found = dict(given) if given is not None else canonical_joints(names, list(parents))
    if given is None and set(missing_joints(found)) - set(_ENDS):
        shape = _by_shape(parents, heads)
        if shape.confidence < LEAST:
            return None
        found = shape.joints
        notes.append(_told(names, shape))
    missing = missing_joints(found)
    if set(missing) - set(_ENDS):
        return None
    labels = [f"other{bone}" for bone in range(len(names))]
    for name, bone in found.items():
        labels[bone] = name
    above, places = [*map(int, parents)], [*np.asarray(heads, np.float64)]
    if missing:
        sides = sorted({name.split("_")[0] for name in missing})
        notes.append(
            f"the {' and the '.join(sides)} arm ends early: what is missing was added without skin"
        )
    for name in (name for name in _ENDS if name in missing):
        side, joint = name.split("_")
        before = f"{side}_{'shoulder' if joint == 'elbow' else 'elbow'}"
        above.append(labels.index(before))
        places.append(places[above[-1]] + _beyond(side, joint, labels, places))
        labels.append(name)
    return Understood(tuple(labels), tuple(above), np.array(places), tuple(notes))


def _by_shape(parents: Sequence[int], heads: FloatArray) -> Shape:
    """Return the better shape of y up and z up."""
    upright = [joints_by_shape(parents, heads @ turn.T) for turn in (np.eye(3), UP_Z)]
    return max(upright, key=lambda shape: shape.confidence)


def _told(names: Sequence[str], shape: Shape) -> str:
    """Say what was found by shape."""

    def listed(*joints: str) -> str:
        bones = [names[shape.joints[joint]] for joint in joints if joint in shape.joints]
        return ", ".join(bone or "a nameless bone" for bone in bones)

    parts = [f"pelvis {listed('pelvis')}", f"head {listed('head')}"]
    for side in ("left", "right"):
        parts.append(
            f"{side} arm {listed(*(f'{side}_{j}' for j in ('shoulder', 'elbow', 'wrist')))}"
        )
        parts.append(f"{side} leg {listed(*(f'{side}_{j}' for j in ('hip', 'knee', 'ankle')))}")
    doubts = f"; {'; '.join(shape.doubts)}" if shape.doubts else ""
    return (
        f"the names of the bones say nothing; by their shape (confidence {shape.confidence:.2f}) "
        f"they are: {'; '.join(parts)}{doubts}"
    )


def _beyond(side: str, joint: str, labels: list[str], places: list[FloatArray]) -> FloatArray:
    """Return the way (3,) to a missing elbow or wrist: the other arm's, mirrored, else straight
    on."""
    other = "right" if side == "left" else "left"
    at = {name: places[bone] for bone, name in enumerate(labels)}
    before = "shoulder" if joint == "elbow" else "elbow"
    across = at["left_shoulder"] - at["right_shoulder"]
    across = across / max(float(np.linalg.norm(across)), 1e-9)
    if f"{other}_{joint}" in at:
        way = at[f"{other}_{joint}"] - at[f"{other}_{before}"]
        return np.asarray(way - 2 * (way @ across) * across)
    if joint == "wrist":
        return np.asarray(0.9 * (at[f"{side}_elbow"] - at[f"{side}_shoulder"]))
    size = float(np.linalg.norm(at[f"{side}_knee"] - at[f"{side}_hip"]))
    return np.asarray((1 if side == "left" else -1) * 0.7 * size * across)

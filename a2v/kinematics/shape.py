"""Find a person's joints in a skeleton by its shape alone, where names say nothing.

Two chains reach the ground, two reach out from the trunk, and one ends highest. Along a limb, all
choices of three joints are compared by a person's proportions and by the other side's.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from a2v.types import FloatArray

LEAST = 0.35
"""Smallest confidence with which a shape is used."""
_GROUND = 0.15
"""Height, as a share of the skeleton's, below which a chain reaches the ground."""
_LEG = (0.27, 0.26, 0.05)
"""Thigh, shin and the ankle's height, as shares of the skeleton's height."""
_ARM = (0.18, 0.16, 0.11)
"""Upper arm, forearm, and the distance of the shoulders from the middle."""
_SKULL = 0.07
"""Smallest distance of the top of the head from the head's bone, as a share of the height."""
_LONGEST = 14
"""Largest number of bones of a limb that are compared."""


@dataclass(frozen=True)
class Shape:
    """Joints found by shape.

    Attributes
    ----------
    joints : dict of str to int
        Bone of each canonical joint (`a2v.kinematics.names`).
    confidence : float
        From 0 to 1.
    doubts : tuple of str
        What was guessed, a phrase each.
    """

    joints: dict[str, int] = field(default_factory=dict)
    confidence: float = 0.0
    doubts: tuple[str, ...] = ()


def joints_by_shape(parents: Sequence[int], heads: FloatArray) -> Shape:
    """Find the joints of a person who stands in any pose near T or A.

    Parameters
    ----------
    parents : B ints
        -1 for roots; parents first.
    heads : (B, 3) float
        Heads of the bones at rest, any unit, y up.

    Returns
    -------
    Shape
        Of confidence 0 if it is no person.
    """
    tree = _Tree(list(map(int, parents)), np.asarray(heads, np.float64))
    best = Shape()
    if tree.size < 1e-9 or len(parents) < 9:
        return best
    for pelvis in tree.forks():
        found = _Person(tree, pelvis).found()
        if found.confidence > best.confidence:
            best = found
    return best


class _Tree:
    """A tree of bones, scaled to a height of 1 on the ground."""

    def __init__(self, parents: list[int], heads: FloatArray) -> None:
        self.parents = parents
        self.children: list[list[int]] = [[] for _ in parents]
        for bone, parent in enumerate(parents):
            if parent >= 0:
                self.children[parent].append(bone)
        used = self._skeleton(heads)
        low, high = heads[used, 1].min(), heads[used, 1].max()
        self.size = float(high - low)
        self.heads = (heads - [0, low, 0]) / max(self.size, 1e-9)
        self.lowest = self.heads[:, 1].copy()
        for bone in range(len(parents) - 1, -1, -1):
            for child in self.children[bone]:
                self.lowest[bone] = min(self.lowest[bone], self.lowest[child])

    def _skeleton(self, heads: FloatArray) -> list[int]:
        """Return the bones of the largest tree, without roots that have one child."""
        sizes = [1] * len(self.parents)
        for bone in range(len(self.parents) - 1, -1, -1):
            if self.parents[bone] >= 0:
                sizes[self.parents[bone]] += sizes[bone]
        tops = [bone for bone, parent in enumerate(self.parents) if parent < 0]
        top = max(tops, key=sizes.__getitem__)
        while len(self.children[top]) == 1:
            top = self.children[top][0]
        return self.below(top)

    def below(self, bone: int) -> list[int]:
        """Return a bone and all below it."""
        found = [bone]
        for one in found:
            found += self.children[one]
        return found

    def path(self, bone: int, top: int) -> list[int]:
        """Return the bones from below `top` to `bone`."""
        steps = []
        while bone not in (top, -1):
            steps.append(bone)
            bone = self.parents[bone]
        return steps[::-1]

    def length(self, path: Sequence[int]) -> float:
        """Return the length of a path of bones."""
        return float(_lengths(self.heads[list(path)]).sum())

    def forks(self) -> list[int]:
        """Return bones off the ground below which two chains or more reach the ground."""
        return [
            bone
            for bone, below in enumerate(self.children)
            if self.heads[bone, 1] > 0.2 and sum(self.lowest[one] < _GROUND for one in below) > 1
        ]


class _Person:
    """A person whose legs begin below the bone `pelvis`."""

    def __init__(self, tree: _Tree, pelvis: int) -> None:
        self.tree, self.pelvis = tree, pelvis
        self.middle = tree.heads[pelvis]
        self.doubts: list[str] = []

    def found(self) -> Shape:
        """Return the joints, or an empty shape."""
        legs = self._legs()
        if legs is None:
            return Shape()
        (first, second), legs_cost = legs
        across = self.tree.heads[first[0]] - self.tree.heads[second[0]]
        across[1] = 0
        self.across = across / max(float(np.linalg.norm(across)), 1e-9)
        arms = self._arms(
            {*self.tree.below(self._child(first[0])), *self.tree.below(self._child(second[0]))}
        )
        if arms is None:
            return Shape()
        chest, (one, other), arms_cost = arms
        if (self.tree.heads[one[0]] - self.tree.heads[other[0]]) @ self.across < 0:
            one, other = other, one
        left = self._first_is_left(first, second, one, other)
        sides = ("left", "right") if left else ("right", "left")
        joints = {"pelvis": self.pelvis}
        for side, leg, arm in zip(sides, (first, second), (one, other), strict=True):
            joints |= {
                f"{side}_{name}": bone
                for name, bone in zip(("hip", "knee", "ankle", "foot"), leg, strict=False)
            }
            joints |= {
                f"{side}_{name}": bone
                for name, bone in zip(("shoulder", "elbow", "wrist"), arm, strict=False)
            }
            collar = self.tree.path(arm[0], chest)[:-1]
            if collar:
                joints[f"{side}_collar"] = collar[-1]
        joints |= self._trunk(chest, {*self.tree.below(one[0]), *self.tree.below(other[0])})
        joints |= self._head(chest, one, other)
        cost = legs_cost + arms_cost + 0.1 * len(self.doubts)
        if "head" not in joints:
            cost += 1.5
        return Shape(joints, min(float(np.exp(-cost)), 1.0), tuple(self.doubts))

    def _child(self, bone: int) -> int:
        """Return the child of the pelvis above a bone."""
        return self.tree.path(bone, self.pelvis)[0]

    def _limbs(self, start: int, end: int, top: int) -> list[int]:
        return self.tree.path(end, top)[:_LONGEST]

    def _legs(self) -> tuple[tuple[tuple[int, ...], tuple[int, ...]], float] | None:
        """Return the two legs (hip, knee, ankle and perhaps ball), and their cost."""
        tree, options = self.tree, []
        for child in tree.children[self.pelvis]:
            if tree.lowest[child] >= _GROUND:
                continue
            best: list[tuple[float, tuple[int, ...]]] = []
            ends = [
                bone
                for bone in tree.below(child)
                if not tree.children[bone] and tree.heads[bone, 1] < _GROUND
            ]
            for end in sorted(ends, key=lambda bone: -len(tree.path(bone, self.pelvis)))[:4]:
                best += self._legs_along(tree.path(end, self.pelvis)[:_LONGEST])
            options += [(cost, leg, child) for cost, leg in sorted(best)[:12]]
        pairs = [
            (a[0] + b[0] + self._unlike(a[1], b[1]), a[1], b[1])
            for a, b in itertools.combinations(options, 2)
            if a[2] != b[2]
        ]
        if not pairs:
            return None
        cost, one, other = min(pairs)
        return (one, other), cost

    def _legs_along(self, path: list[int]) -> list[tuple[float, tuple[int, ...]]]:
        heads = self.tree.heads
        found = []
        for hip, knee, ankle in itertools.combinations(range(len(path)), 3):
            points = heads[[path[hip], path[knee], path[ankle]]]
            thigh, shin = np.linalg.norm(np.diff(points, axis=0), axis=1)
            if min(thigh, shin) < 0.06 or points[0, 1] < points[2, 1]:
                continue
            cost = 0.3 * abs(np.log(thigh / shin * _LEG[1] / _LEG[0]))
            cost += 0.15 * abs(np.log((thigh + shin) / (_LEG[0] + _LEG[1])))
            cost += 2.0 * max(points[2, 1] - 1.6 * _LEG[2], 0)
            beyond = path[ankle + 1 :]
            away = [float(np.hypot(*(heads[bone] - points[2])[[0, 2]])) for bone in beyond]
            flat = [bone for bone, far in zip(beyond, away, strict=True) if far > 0.03]
            cost += 0.5 * max((points[2, 1] - heads[beyond, 1].min() if beyond else 0) - 0.07, 0)
            # an ankle is the last joint before the foot goes level
            cost += 0.15 * sum(
                heads[bone, 1] < points[2, 1] - 0.02 for bone in path[knee + 1 : ankle]
            )
            if beyond and away[0] < 0.5 * abs(points[2, 1] - heads[beyond[0], 1]):
                cost += 0.15
            # a hip stands off the middle, and high
            off = float(np.hypot(*(points[0] - self.middle)[[0, 2]]))
            full = max(
                float(np.hypot(*(heads[bone] - self.middle)[[0, 2]])) for bone in path[: knee + 1]
            )
            cost += 0.4 * max(0.6 - off / max(full, 1e-6), 0) + 0.8 * abs(
                points[0, 1] - heads[path[: hip + 1], 1].min()
            )
            cost += 0.05 * hip * (off > 0.02) + 1.5 * max(self.middle[1] - points[0, 1] - 0.1, 0)
            found.append(
                (float(cost), tuple(path[k] for k in (hip, knee, ankle)) + tuple(flat[:1]))
            )
        return found

    def _unlike(self, one: Sequence[int], other: Sequence[int]) -> float:
        """Return how far two limbs are from mirror images by lengths and heights; limbs of too few
        joints count as equal."""
        heads = self.tree.heads
        count = min(len(one), len(other), 3)
        a, b = heads[list(one[:count])], heads[list(other[:count])]
        cost = float(np.abs(a[:, 1] - b[:, 1]).max())
        if count > 1:
            cost += 8 * max(float(np.abs(_lengths(a) - _lengths(b)).max()) - 0.01, 0)
        return cost

    def _arms(
        self, legs: set[int]
    ) -> tuple[int, tuple[tuple[int, ...], tuple[int, ...]], float] | None:
        """Return the bone that carries both arms, the arms, and their cost."""
        tree = self.tree
        best: tuple[float, int, tuple[int, ...], tuple[int, ...]] | None = None
        for chest in range(len(tree.parents)):
            if chest in legs or tree.heads[chest, 1] < self.middle[1] - 0.05:
                continue
            options = []
            for child in tree.children[chest]:
                if child in legs or self.pelvis in tree.below(child):
                    continue
                ends = [bone for bone in tree.below(child) if not tree.children[bone]]
                far = sorted(ends, key=lambda bone: -tree.length([chest, *tree.path(bone, chest)]))[
                    :2
                ]
                for end in far:
                    path = tree.path(end, chest)[:_LONGEST]
                    options += [(cost, arm, child) for cost, arm in self._arms_along(path)[:12]]
            for a, b in itertools.combinations(sorted(options)[:60], 2):
                if a[2] == b[2]:
                    continue
                sides = [(tree.heads[arm[1][-1]] - self.middle) @ self.across for arm in (a, b)]
                if sides[0] * sides[1] > 0:
                    continue
                cost = a[0] + b[0] + self._unlike(a[1], b[1]) + 0.25 * (6 - len(a[1]) - len(b[1]))
                if best is None or cost < best[0]:
                    best = (cost, chest, a[1], b[1])
        if best is None:
            return None
        cost, chest, one, other = best
        for arm in (one, other):
            if len(arm) < 3:
                self.doubts.append(
                    "an arm ends at the " + ("elbow" if len(arm) == 2 else "shoulder")
                )
        return chest, (one, other), cost

    def _arms_along(self, path: list[int]) -> list[tuple[float, tuple[int, ...]]]:
        """Return choices of (shoulder, elbow, wrist) along a path, best first; of (shoulder,
        elbow) and (shoulder,) for an arm that ends early."""
        heads, found = self.tree.heads[path], []
        sizes = [len(self.tree.children[bone]) for bone in path]
        # numbers of Python: arrays of three cost ten times the arithmetic
        apart = np.linalg.norm(heads[:, None] - heads[None], axis=-1).tolist()
        aside = np.abs((heads - self.middle) @ self.across).tolist()
        low = (heads[:, 1] < self.middle[1] + 0.12).tolist()
        after = np.append(np.cumsum(_lengths(heads)[::-1])[::-1], 0.0).tolist()
        for count in (3, 2, 1):
            for chosen in itertools.combinations(range(len(path)), count):
                parts = [apart[k][then] for k, then in itertools.pairwise(chosen)]
                off = aside[chosen[0]]
                if low[chosen[0]] or off < 0.02 or min(parts, default=1.0) < 0.05:
                    continue
                cost = 0.15 * abs(math.log(off / _ARM[2]))
                beyond = after[chosen[-1]]
                if count == 3:
                    cost += 0.3 * abs(math.log(parts[0] / parts[1] * _ARM[1] / _ARM[0]))
                    cost += 0.15 * abs(math.log(sum(parts) / (_ARM[0] + _ARM[1])))
                    cost += 3.0 * max(beyond - 0.14, 0) - 0.25 * (sizes[chosen[2]] >= 3)
                    cost += 0.25 * any(sizes[k] >= 3 for k in range(chosen[0], chosen[2]))
                    if path[chosen[2] + 1 :] and beyond < 0.01:
                        cost += 0.1
                elif count == 2:  # the hand is missing
                    cost += 0.3 * abs(math.log(parts[0] / _ARM[0])) + 1.0 * beyond
                else:  # the forearm is missing too
                    cost += 2.0 * max(beyond - 0.1, 0)
                # a collar bone begins near the middle, and the shoulder ends it
                cost += 0.1 * sum(one > 0.75 * off for one in aside[: chosen[0]])
                found.append((cost, tuple(path[k] for k in chosen)))
        return sorted(found)

    def _first_is_left(self, *limbs: Sequence[int]) -> bool:
        """Return whether the first leg is the left one, by the way that the feet, else the whole
        file, points."""
        heads = self.tree.heads
        forward = np.zeros(3)
        for leg in limbs[:2]:
            for bone in self.tree.below(leg[2]):
                forward += (heads[bone] - heads[leg[2]]) * (1, 0, 1)
        forward -= (forward @ self.across) * self.across
        if np.linalg.norm(forward) < 0.03:
            self.doubts.append("no toes say where it faces: taken as +z")
            forward = np.array([0.0, 0, 1])
        return bool(np.cross([0, 1.0, 0], forward) @ self.across > 0)

    def _trunk(self, chest: int, arms: set[int]) -> dict[str, int]:
        """Return the joints of the spine, from the pelvis up to the chest."""
        tree = self.tree
        above = {self.pelvis, *self._above(self.pelvis)}
        path = [bone for bone in (*self._above(chest)[::-1], chest) if bone not in above]
        return {
            f"spine{place + 1}": bone
            for place, bone in enumerate(path)
            if tree.heads[bone, 1] > self.middle[1] - 0.05
        }

    def _above(self, bone: int) -> list[int]:
        found = []
        while (bone := self.tree.parents[bone]) >= 0:
            found.append(bone)
        return found

    def _head(self, chest: int, *arms: Sequence[int]) -> dict[str, int]:
        """Return neck and head: the chain in the middle that ends highest."""
        tree = self.tree
        limbs = {tree.path(arm[0], chest)[0] for arm in arms}
        high = max(float(tree.heads[arm[0], 1]) for arm in arms)
        options = [
            (max(float(tree.heads[bone, 1]) for bone in tree.below(child)), child)
            for child in tree.children[chest]
            if child not in limbs
            and abs(float((tree.heads[child] - self.middle) @ self.across)) < 0.04
        ]
        options = [one for one in options if one[0] > high]
        if not options:
            return {}
        chain = [max(options)[1]]
        while tree.children[chain[-1]]:
            middle = [
                bone
                for bone in tree.children[chain[-1]]
                if abs(float((tree.heads[bone] - self.middle) @ self.across)) < 0.03
                and tree.heads[bone, 1] > tree.heads[chain[-1], 1]
            ]
            if (len(tree.children[chain[-1]]) > 1 and len(chain) > 1) or not middle:
                break
            chain.append(max(middle, key=lambda bone: (len(tree.below(bone)), tree.heads[bone, 1])))
        ends = len(chain) > 2 and not tree.children[chain[-1]]
        if ends and tree.length(chain[-2:]) > _SKULL:
            chain.pop()  # the top of the head
        return {"head": chain[-1], **({"neck": chain[0]} if len(chain) > 1 else {})}


def _lengths(points: FloatArray) -> FloatArray:
    """Return the distances (n - 1,) between successive points (n, 3)."""
    steps = points[1:] - points[:-1]
    return np.asarray(np.sqrt((steps * steps).sum(axis=1)))

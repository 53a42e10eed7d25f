"""Rigs of strangers made by chance: bones of known tools, renamed, reshaped and mutilated."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np

from a2v import Character
from a2v.animation import change_rig, load_rig
from a2v.animation.rig_spec import RIGS
from a2v.kinematics.names import REQUIRED, canonical_joints


@dataclass
class StrangeRig:
    """Bones with `parents`, `heads` (B, 3) and meaningless names; the joints that it truly has."""

    parents: list[int]
    heads: np.ndarray
    truth: dict[str, int]
    what: list[str] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        return [f"b{index}" for index in range(len(self.parents))]


def plain_rigs(character: Character) -> dict[str, StrangeRig]:
    """The rigs of other tools on one person, with their true joints by name."""
    found = {}
    for name in RIGS:
        body = character.body if name == "anny" else change_rig(character, load_rig(name)).character.body  # fmt: skip
        parents = body.bone_parents.tolist()
        truth = canonical_joints(body.bone_names, parents)
        truth = {joint: bone for joint, bone in truth.items() if joint in (*REQUIRED, "head")}
        found[name] = StrangeRig(
            parents, body.rest_transforms[:, :3, 3].astype(float), truth, [name]
        )
    return found


def strange(rig: StrangeRig, seed: int) -> StrangeRig:
    """Change proportions, add and remove bones, turn, and put the bones in another order."""
    rng = np.random.default_rng(seed)
    parents, heads, truth, what = [*rig.parents], rig.heads.copy(), dict(rig.truth), [*rig.what]

    def below(bone: int) -> list[int]:
        found = [bone]
        for one in found:
            found += [child for child, parent in enumerate(parents) if parent == one]
        return found

    # proportions: arms and legs longer or shorter, about their own first joints
    for limb, joints in (
        ("arm", ("shoulder", "elbow", "wrist")),
        ("leg", ("hip", "knee", "ankle")),
    ):
        factor = rng.uniform(0.75, 1.35)
        for side in ("left", "right"):
            for first, second in itertools.pairwise(joints):
                top, end = truth[f"{side}_{first}"], truth[f"{side}_{second}"]
                inner = set(below(top)) - set(below(end)) - {top}
                shift = (factor - 1) * (heads[end] - heads[top])
                for bone in inner:
                    share = (
                        (heads[bone] - heads[top])
                        @ shift
                        / max((factor - 1) * (shift @ (heads[end] - heads[top])), 1e-12)
                        if factor != 1
                        else 0
                    )
                    heads[bone] += np.clip(share * (factor - 1), 0, 1) * shift if factor > 1 else 0
                for bone in below(end):
                    heads[bone] += shift
        what.append(f"{limb}s x {factor:.2f}")
    heads += rng.normal(0, 0.004, heads.shape)

    def add(parent: int, place: np.ndarray, count: int, step: np.ndarray) -> None:
        for number in range(count):
            parents.append(parent)
            nonlocal heads
            heads = np.concatenate([heads, (place + number * step)[None]])
            parent = len(parents) - 1

    if rng.random() < 0.5:
        what.append("twist bones")
        for side in ("left", "right"):
            for first, second in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee")):
                a, b = heads[truth[f"{side}_{first}"]], heads[truth[f"{side}_{second}"]]
                add(truth[f"{side}_{first}"], (a + b) / 2, 1, np.zeros(3))
    if rng.random() < 0.4 and "head" in truth:
        what.append("hair")
        for way in (-0.08, 0.0, 0.08):
            add(
                truth["head"],
                heads[truth["head"]] + [way, 0.1, -0.08],
                4,
                np.array([0, -0.09, -0.02]),
            )
    if rng.random() < 0.4:
        what.append("skirt")
        for way in range(6):
            around = np.array([np.sin(way), 0, np.cos(way)]) * 0.16
            add(
                truth["pelvis"],
                heads[truth["pelvis"]] + around,
                3,
                np.array([0, -0.14, 0]) + 0.1 * around,
            )
    if rng.random() < 0.3:
        what.append("prop")
        add(
            truth["right_wrist"],
            heads[truth["right_wrist"]] + [0, -0.05, 0.05],
            2,
            np.array([0, 0.1, 0.5]),
        )
    keep = np.ones(len(parents), bool)
    if rng.random() < 0.4:
        what.append("no fingers")
        for side in ("left", "right"):
            keep[below(truth[f"{side}_wrist"])[1:]] = False
    if rng.random() < 0.3:
        what.append("no toes")
        for side in ("left", "right"):
            keep[below(truth[f"{side}_ankle"])[1:]] = False
    if rng.random() < 0.25:
        side = str(rng.choice(["left", "right"]))
        last = str(rng.choice(["wrist", "elbow"]))
        what.append(f"no {side} {last}")
        keep[below(truth[f"{side}_{last}"])] = False
        for joint in ("elbow", "wrist")[last == "wrist" :]:
            truth.pop(f"{side}_{joint}")
    heads = heads * rng.uniform(0.3, 3)
    # another order, parents first, perhaps below new roots
    order: list[int] = []
    rest = [int(bone) for bone in rng.permutation(len(parents)) if keep[bone]]
    while rest:
        ready = next(bone for bone in rest if parents[bone] < 0 or parents[bone] in order)
        order.append(ready)
        rest.remove(ready)
    new = {bone: place for place, bone in enumerate(order)}
    parents = [new.get(parents[bone], -1) for bone in order]
    heads, truth = heads[order], {joint: new[bone] for joint, bone in truth.items()}
    if rng.random() < 0.4:
        what.append("root above")
        top = parents.index(-1)
        heads = np.concatenate([[heads[top] * [1, 0, 1]], heads])
        parents = [-1, *(parent + 1 for parent in parents)]
        truth = {joint: bone + 1 for joint, bone in truth.items()}
    return StrangeRig(parents, heads, truth, what)

"""A tiny model of the SMPL family's file format, made out of Anny."""

from __future__ import annotations

import numpy as np
import torch

from a2v.body import load_body_model
from a2v.body.smpl import JOINTS

# Anny's bone whose head is each of SMPL's joints
BONES = {
    "pelvis": "root",
    "spine1": "spine04",
    "spine2": "spine03",
    "spine3": "spine02",
    "neck": "neck01",
    "head": "head",
    **{
        f"{side}_{joint}": f"{bone}.{side[0].upper()}"
        for side in ("left", "right")
        for joint, bone in {
            "hip": "upperleg01",
            "knee": "lowerleg01",
            "ankle": "foot",
            "foot": "toe1-1",
            "collar": "clavicle",
            "shoulder": "upperarm01",
            "elbow": "lowerarm01",
            "wrist": "wrist",
            "hand": "finger3-1",
        }.items()
    },
}
PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]


def smpl_arrays() -> dict[str, np.ndarray]:
    """Anny with SMPL's 24 joints, three shape directions and small pose corrections."""
    anny = load_body_model()
    names = JOINTS[24][1]
    bones = [anny.bone_names.index(BONES[name]) for name in names]
    default = torch.from_numpy(anny.shape_default)
    rest, heads = (value.numpy() for value in anny.rest(default))
    weights = np.zeros((len(rest), 24), np.float32)
    for bone in range(anny.n_bones):  # a bone's weights go to the nearest ancestor that SMPL has
        above = bone
        while above not in bones and above >= 0:
            above = int(anny.bone_parents[above])
        weights[:, bones.index(above) if above >= 0 else 0] += anny.weights[:, bone]
    regressor = np.zeros((24, len(rest)))
    for joint, bone in enumerate(
        bones
    ):  # weights of four vertices around it that give its place exactly, and near it elsewhere
        near = np.argsort(((rest - heads[bone]) ** 2).sum(axis=1))[:60]
        system = np.concatenate([rest[near].T, np.ones((1, 60))])
        regressor[joint, near] = np.linalg.lstsq(system, np.append(heads[bone], 1.0), rcond=None)[0]
    shapes = []
    for name, step in (("height", 0.15), ("weight", 0.2), ("muscle", 0.3)):
        values = anny.shape_default.copy()
        values[anny.shape_names.index(name)] += step
        shapes.append(anny.rest(torch.from_numpy(values))[0].numpy() - rest)
    random = np.random.default_rng(0)
    return {
        "v_template": rest.astype(np.float64),
        "shapedirs": np.stack(shapes, axis=-1),
        "posedirs": 1e-4 * random.standard_normal((len(rest), 3, 9 * 23)),
        "J_regressor": regressor,
        "weights": weights,
        "kintree_table": np.stack(
            [np.array(PARENTS).astype(np.uint32), np.arange(24, dtype=np.uint32)]
        ),
        "f": anny.faces.astype(np.uint32),
    }

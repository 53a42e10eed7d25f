"""Where the 33 BlazePose landmarks and the usual joint names lie on a body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import torch

    from a2v.body.model import AnnyModel

BLAZEPOSE: tuple[str, ...] = (
    "nose",
    *(f"{side}_eye{part}" for side in ("left", "right") for part in ("_inner", "", "_outer")),
    "left_ear",
    "right_ear",
    "mouth_left",
    "mouth_right",
    *(
        f"{side}_{joint}"
        for joint in ("shoulder", "elbow", "wrist", "pinky", "index", "thumb", "hip", "knee", "ankle", "heel", "foot_index")
        for side in ("left", "right")
    ),
)
"""Names of the landmarks in mediapipe's order (left and right are the person's)."""

JOINT_BONES: dict[str, str] = {
    "hips": "root",
    "spine": "spine04",
    "spine1": "spine03",
    "spine2": "spine02",
    "chest": "spine01",
    "neck": "neck01",
    "head": "head",
    **{
        f"{side}_{joint}": f"{bone}.{side[0].upper()}"
        for side in ("left", "right")
        for joint, bone in {
            "collar": "clavicle",
            "shoulder": "upperarm01",
            "elbow": "lowerarm01",
            "wrist": "wrist",
            "hand": "finger3-1",
            "hip": "upperleg01",
            "knee": "lowerleg01",
            "ankle": "foot",
            "toe": "toe1-1",
        }.items()
    },
}
"""Our joint names and the Anny bone whose head is that joint."""

# Landmarks that are joints: mediapipe's own targets lie inside of the limb, at the joint's middle.
_BONES = {
    "shoulder": "upperarm01",
    "elbow": "lowerarm01",
    "wrist": "wrist",
    "pinky": "finger5-1",
    "index": "finger2-1",
    "thumb": "finger1-2",
    "hip": "upperleg01",
    "knee": "lowerleg01",
    "ankle": "foot",
}

# Offsets from the left eye's centre (inner and outer corner) and from the nose (left corner of the mouth), metres at
# the default shape, measured on its front view; the nearest vertex of the face is taken.
_FACE = {"left_eye_inner": (-0.018, -0.002), "left_eye_outer": (0.018, 0.0), "mouth_left": (0.024, -0.031)}


def landmark_table(model: AnnyModel) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Landmarks as combinations of vertices and joints.

    Returns
    -------
    vertex_ids : (n,) int64
        The vertices that matter.
    of_vertices : (33, n) float32, of_bones : (33, B) float32
        Landmarks = ``of_vertices @ vertices[vertex_ids] + of_bones @ joints``.
    """
    import torch

    default = torch.from_numpy(model.shape_default)
    rest = model.rest(default)[0].numpy()
    dense = np.zeros((len(BLAZEPOSE), len(rest)))
    bones = np.zeros((len(BLAZEPOSE), model.n_bones), dtype=np.float32)
    skin = np.flatnonzero((model.weights[:, model.bone("head")] > 0.9) & _outer(model.faces, len(rest)))
    nose = rest[skin[rest[skin, 2].argmax()]]
    anchors = {name: _regressed(model, name, rest) for name in ("left_eye", "right_eye", "left_ear", "right_ear")}
    for row, name in enumerate(BLAZEPOSE):
        side, joint = name.split("_", 1) if name.startswith(("left", "right")) else ("", name)
        if joint in _BONES:
            bones[row, model.bone(f"{_BONES[joint]}.{side[0].upper()}")] = 1.0
        elif joint in ("heel", "foot_index"):
            dense[row, _foot(model, rest, side, joint)] = 1.0
        elif name in anchors:
            dense[row, skin[np.argsort(((rest[skin] - anchors[name]) ** 2).sum(axis=1))[:6]]] = 1.0
        elif name == "nose":
            dense[row, skin[rest[skin, 2].argmax()]] = 1.0
        else:
            mirror = -1.0 if "right" in name else 1.0
            anchor = nose if "mouth" in name else anchors[f"{side}_eye"]
            target = anchor[:2] + np.array(_FACE[name.replace("right", "left")]) * (mirror, 1.0)
            flat = ((rest[skin, :2] - target) ** 2).sum(axis=1)
            flat[rest[skin, 2] < anchor[2] - 0.05] = np.inf  # not the back of the head
            dense[row, skin[flat.argmin()]] = 1.0
    for row in range(len(BLAZEPOSE)):
        if dense[row].any():
            dense[row] /= dense[row].sum()
    used = np.flatnonzero(dense.any(axis=0))
    return torch.from_numpy(used), torch.from_numpy(dense[:, used].astype(np.float32)), torch.from_numpy(bones)


def _regressed(model: AnnyModel, name: str, vertices: np.ndarray) -> np.ndarray:
    """Position (3,) of a COCO keypoint by Anny's own regressor."""
    data = model.data
    index = [str(key) for key in data["keypoint_names"]].index(name)
    part = slice(int(data["keypoint_starts"][index]), int(data["keypoint_starts"][index + 1]))
    point: np.ndarray = data["keypoint_weights"][part] @ vertices[data["keypoint_vertices"][part]]
    return point


def _outer(faces: np.ndarray, count: int) -> np.ndarray:
    """Which vertices belong to the skin, not to eyeballs and tongue: the largest connected component."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    labels = connected_components(graph, directed=False)[1]
    outer: np.ndarray = labels == np.bincount(labels).argmax()
    return outer


def _foot(model: AnnyModel, rest: np.ndarray, side: str, joint: str) -> np.ndarray:
    """Vertices of the heel (rearmost of the foot) or of the big toe's tip."""
    letter = side[0].upper()
    foot = model.bone(f"foot.{letter}")
    if joint == "heel":
        own = np.flatnonzero(model.weights[:, foot] > 0.6)
        score = rest[own, 2] + 0.5 * np.abs(rest[own, 1] - (rest[own, 1].min() + 0.02))
        heel: np.ndarray = own[np.argsort(score)[:8]]
        return heel
    own = np.flatnonzero(model.weights[:, model.bone(f"toe1-2.{letter}")] > 0.5)
    toe: np.ndarray = own[np.argsort(-rest[own, 2])[:8]]
    return toe

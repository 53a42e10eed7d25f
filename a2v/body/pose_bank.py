"""A bank of recorded poses, and a search for those that resemble a photo's landmarks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.evidence import Evidence
from a2v.body.pose_space import pose_space
from a2v.body.silhouette import MaskField
from a2v.errors import InputError
from a2v.io import read_npz
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.kinematics.so3 import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.types import FloatArray, OrthographicCamera

SHIPPED = Path(__file__).parent / "data" / "pose_bank_anny.npz"
QUANTUM = np.pi / 127
"""Step of the quantized angles of the bank, radians."""

COMPARED: tuple[str, ...] = (
    "nose",
    *(
        f"{side}_{joint}"
        for side in ("left", "right")
        for joint in ("ear", "shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    ),
)
"""Landmarks by which poses are compared."""
_HEADINGS = 24


@dataclass(frozen=True, eq=False)
class PoseBank:
    """Poses, and their landmarks on a body of default shape.

    Attributes
    ----------
    angles : (N, D) float32
        Radians, of `PoseSpace`; mirror images included.
    roots : (N, 3, 3) float32
        Rotations of the whole body; it faces +z.
    points : (N, C, 3) float32
        The landmarks `COMPARED`, meters, from the middle of the hips.
    """

    angles: FloatArray
    roots: FloatArray
    points: FloatArray


@lru_cache(maxsize=1)
def load_pose_bank(model: AnnyModel) -> PoseBank:
    """Load the shipped bank and pose the model with it, which takes a second.

    Raises
    ------
    InputError
        The file cannot be read or is of another rig.
    """
    import torch

    arrays, space = read_npz(SHIPPED), pose_space(model)
    if tuple(str(name) for name in arrays["names"]) != space.names:
        raise InputError(
            f"{SHIPPED} is of another rig; make it again with scripts/make_pose_bank.py"
        )
    angles = np.clip(arrays["angles"] * QUANTUM, space.limits[:, 0], space.limits[:, 1]).astype(
        np.float32
    )
    roots = np.asarray(rotvec_to_rotmat((arrays["roots"] * QUANTUM).astype(np.float64)))
    angles = np.concatenate([angles, angles[:, space.mirror] * space.mirror_sign])
    flip = np.diag([-1.0, 1.0, 1.0])
    roots = np.concatenate([roots, flip @ roots @ flip]).astype(np.float32)
    index = [LANDMARK_INDEX[name] for name in COMPARED]
    points = []
    with torch.no_grad():
        shape = torch.from_numpy(model.shape_default)
        rest, heads = model.rest(shape, model.landmark_vertices)
        for start in range(0, len(angles), 1000):
            part = slice(start, start + 1000)
            rotmats = rotvec_to_rotmat(space.rotvecs(torch.from_numpy(angles[part])))
            rotmats[:, 0] = torch.from_numpy(roots[part])
            points.append(model.landmarks_at(rotmats, rest, heads).numpy()[:, index])
    placed = np.concatenate(points)
    hips = placed[:, [COMPARED.index("left_hip"), COMPARED.index("right_hip")]].mean(
        axis=1, keepdims=True
    )
    return PoseBank(angles, roots, placed - hips)


@dataclass(frozen=True)
class Likeness:
    """A pose of the bank that resembles a photo: its index, its orientation (rotation vector), and
    its error relative to the height."""

    number: int
    root: FloatArray
    misfit: float


def alike(bank: PoseBank, evidence: Evidence, *, count: int, apart: float = 0.12) -> list[Likeness]:
    """Find the `count` poses whose landmarks are most similar to the photo's, the best first.

    Each pose is turned about the vertical. The landmarks of any two results differ by at least
    `apart` meters on average. The detector's depths count too, robustly and with less weight.
    """
    index = [LANDMARK_INDEX[name] for name in COMPARED]
    weight = evidence.weights[index]
    if (weight > 0.1).sum() < 6:
        return []
    weight = weight / weight.sum()
    seen = (
        evidence.pixels[index] * [1.0, -1.0] / (evidence.height / TYPICAL_HEIGHT)
    )  # meters of a person of typical height
    known = (
        np.zeros(len(index))
        if evidence.points is None
        else np.isfinite(evidence.points[index, 2]) * weight
    )
    given = (
        np.zeros(len(index))
        if evidence.points is None
        else np.nan_to_num(evidence.points[index, 2])
    )
    seen = seen - weight @ seen
    given = given - (known @ given) / max(known.sum(), 1e-9)
    misfits = []
    angles = np.arange(_HEADINGS) * (2 * np.pi / _HEADINGS)
    for angle in angles:
        x = np.cos(angle) * bank.points[..., 0] + np.sin(angle) * bank.points[..., 2]
        z = np.cos(angle) * bank.points[..., 2] - np.sin(angle) * bank.points[..., 0]
        flat = np.stack([x, bank.points[..., 1]], axis=-1)
        flat = flat - np.einsum("c,nck->nk", weight, flat)[:, None]
        # people and detectors differ in size: 15 %
        scale = np.einsum("c,nck,ck->n", weight, flat, seen) / np.maximum(
            np.einsum("c,nck,nck->n", weight, flat, flat), 1e-9
        )
        gap = np.clip(scale, 0.85, 1.15)[:, None, None] * flat - seen
        deep = z - ((z @ known) / max(known.sum(), 1e-9))[:, None] - given
        square = (gap**2).sum(axis=-1)
        misfits.append(
            (0.15**2 * square / (0.15**2 + square)) @ weight
            + 0.1 * (0.2**2 * deep**2 / (0.2**2 + deep**2)) @ known
        )
    misfit = np.stack(misfits, axis=1)
    found: list[Likeness] = []
    places: list[FloatArray] = []
    for place in np.argsort(misfit, axis=None)[: 200 * count]:
        number, heading = np.unravel_index(place, misfit.shape)
        turn = np.asarray(rotvec_to_rotmat(np.array([0.0, angles[heading], 0.0])))
        points = bank.points[number] @ turn.T
        if all(np.linalg.norm(points - other, axis=1).mean() > apart for other in places):
            places.append(points)
            found.append(
                Likeness(
                    int(number),
                    np.asarray(rotmat_to_rotvec(turn @ bank.roots[number])),
                    float(misfit[number, heading]),
                )
            )
        if len(found) == count:
            break
    return found


_BONES = [
    *(
        (f"{side}_{first}", f"{side}_{last}")
        for side in ("left", "right")
        for first, last in (
            ("shoulder", "elbow"),
            ("elbow", "wrist"),
            ("hip", "knee"),
            ("knee", "ankle"),
            ("shoulder", "hip"),
            ("shoulder", "ear"),
        )
    ),
    ("left_shoulder", "right_shoulder"),
    ("left_hip", "right_hip"),
]
_BORDER = 0.1
"""Flesh, feet and hair around the landmarks, meters."""


@dataclass(frozen=True)
class Placed:
    """A pose of the bank that is aligned with a mask.

    It has its index, its orientation, and a camera in whose frame the middle of the hips is the
    origin.
    """

    number: int
    root: FloatArray
    camera: OrthographicCamera
    misfit: float


def alike_outline(
    bank: PoseBank, mask: MaskField, *, count: int, apart: float = 0.2
) -> list[Placed]:
    """Find the `count` poses whose bones lie in a mask and fill it best, the best first.

    Each pose is turned about the vertical. The landmarks of any two results differ by at least
    `apart` meters on average. The misfit is relative to the height.
    """
    rows, columns = np.nonzero(mask.inside)
    if len(rows) < 50:
        return []
    low, high = (
        np.array([columns.min(), rows.min()]) * mask.step,
        np.array([columns.max() + 1, rows.max() + 1]) * mask.step,
    )
    chosen = np.random.default_rng(0).choice(len(rows), 80)
    spots = (np.stack([columns, rows], axis=1)[chosen] + 0.5) * mask.step
    steps = np.linspace(0, 1, 5)[:, None]
    first, last = ([COMPARED.index(pair[end]) for pair in _BONES] for end in (0, 1))
    angles = np.arange(_HEADINGS) * (2 * np.pi / _HEADINGS)
    scores, frames = [], []
    for angle in angles:
        x = np.cos(angle) * bank.points[..., 0] + np.sin(angle) * bank.points[..., 2]
        flat = np.stack([x, -bank.points[..., 1]], axis=-1)
        least, most = flat.min(axis=1) - _BORDER, flat.max(axis=1) + _BORDER
        ratio = (high - low) / (most - least)
        scale = np.sqrt(ratio.prod(axis=1))  # pixels per meter
        shift = (high + low) / 2 - scale[:, None] * (most + least) / 2
        bones = (1 - steps) * flat[:, first, None] + steps * flat[:, last, None]
        pixels = scale[:, None, None] * bones.reshape(len(flat), -1, 2) + shift[:, None]
        cell = np.clip((pixels / mask.step).astype(int), 0, np.array(mask.inside.shape)[::-1] - 1)
        outside = np.maximum(mask.distance[cell[..., 1], cell[..., 0]], 0).mean(axis=1) / (
            TYPICAL_HEIGHT * scale
        )
        scores.append(outside + 0.05 * np.abs(np.log(ratio[:, 0] / ratio[:, 1])))
        frames.append((scale, shift, pixels))
    score = np.stack(scores, axis=1)
    filled = []
    for place in np.argsort(score, axis=None)[:3000]:
        number, heading = np.unravel_index(place, score.shape)
        scale, _, pixels = (values[number] for values in frames[heading])
        gap = np.linalg.norm(spots[:, None] - pixels[None], axis=-1).min(axis=1)
        filled.append(
            (
                score[number, heading] + float(np.sqrt((gap**2).mean())) / (TYPICAL_HEIGHT * scale),
                int(number),
                int(heading),
            )
        )
    found: list[Placed] = []
    places: list[FloatArray] = []
    for misfit, number, heading in sorted(filled):
        turn = np.asarray(rotvec_to_rotmat(np.array([0.0, angles[heading], 0.0])))
        points = bank.points[number] @ turn.T
        if all(np.linalg.norm(points - other, axis=1).mean() > apart for other in places):
            places.append(points)
            scale, shift, _ = (values[number] for values in frames[heading])
            camera = OrthographicCamera(
                scale=float(scale), center_u=float(shift[0]), center_v=float(shift[1])
            )
            found.append(
                Placed(
                    number,
                    np.asarray(rotmat_to_rotvec(turn @ bank.roots[number])),
                    camera,
                    float(misfit),
                )
            )
        if len(found) == count:
            break
    return found

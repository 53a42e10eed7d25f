"""Sew the hands of the body into the surface.

A field that is sampled every half centimeter gives mittens, whose fingers cannot move.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import numpy as np

from a2v.body.fingers import SIDES
from a2v.geometry.mesh import border_loops
from a2v.geometry.sewing import sew_in, single_rim
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.types import Body, BoolArray, FloatArray, IntArray, Reconstruction

_BEYOND = 0.012
"""Distance beyond the wrist at which the patch begins, meters along the hand."""
_GAP = 0.008
"""Distance between the patch and the end of the surface, meters: room for the strip between
them."""
_REACH = 0.3
"""Distance from the wrist beyond which nothing is cut, meters."""
_AROUND = 0.085
"""Largest distance of the rim of the hole from the wrist, meters: a larger hole takes away more
than a hand."""
_LEAST_RIM = 12
_FARTHEST = 0.08
"""If the surface is farther than this from the body's hand, it holds an object or the fit is wrong,
meters."""
_SHIFTED = 0.04
"""Largest distance between the wrists of surface and body, meters."""
_STRETCHED = (0.75, 1.3)
_FADE = 0.07
"""Length of the hand, meters, over which it changes from the wrist of the surface to the hand of
the body."""


@dataclass(frozen=True)
class HandSettings:
    """Settings of the hands.

    Attributes
    ----------
    replace : bool
        Sew in the hands of the fitted body, whose fingers move. Otherwise the hands of the surface
        stay.
    bend : bool
        Bend the fingers of the body as in the photo, or as in relaxed hands. Otherwise they are
        straight.
    """

    replace: bool = True
    bend: bool = True


def add_hands(
    person: Reconstruction, body: Body, *, settings: HandSettings = HandSettings()
) -> Reconstruction:
    """Replace the hands of a surface by those of the body.

    Each hand is cut off at the wrist. The hand of the body is moved and thickened there to fit,
    which fades out along the hand, and is sewn to the rim.

    Parameters
    ----------
    person : Reconstruction
    body : Body
        Anny, fitted to the surface.

    Returns
    -------
    Reconstruction
        `person` itself for another body model, or if its surface is the body already. A hand that
        touches or holds something cannot be cut off and stays unchanged;
        ``surface.provenance["hands"]`` lists the replaced ones.
    """
    if not settings.replace or person.from_body or body.model != "anny":
        return person
    done = []
    for side, letter in SIDES.items():
        changed = _sewn(person, body, letter)
        if changed is not None:
            person = changed
            done.append(side)
    surface = person.surface
    return dataclasses.replace(
        person,
        surface=dataclasses.replace(surface, provenance=dict(surface.provenance) | {"hands": done}),
    )


@dataclass(frozen=True, eq=False)
class HandPatch:
    """A hand of Anny.

    Attributes
    ----------
    vertices : (K,) int
        Vertices of the body in the patch.
    faces : (F, 3) int
        Into `vertices`.
    rim : (n,) int
        Into `vertices`, in order.
    out : (V,) float
        Distance of each vertex of the body beyond the wrist along the hand, meters, on the body at
        rest; -inf for vertices of other parts.
    """

    vertices: IntArray
    faces: IntArray
    rim: IntArray
    out: FloatArray


@functools.cache
def hand_patch(letter: str) -> HandPatch:
    """Return the hand of a side, ".L" or ".R". It is found once on Anny at rest, where no bent
    finger reaches back over the wrist."""
    import torch

    from a2v.body.registry import load_body_model

    model = load_body_model("anny")
    rest, heads = (
        part.numpy().astype(np.float64)
        for part in model.rest(torch.from_numpy(model.shape_default))
    )
    wrist, knuckle = (
        heads[model.bone_names.index(name + letter)] for name in ("wrist", "finger3-1")
    )
    bones = [
        bone
        for bone, name in enumerate(model.bone_names)
        if name.endswith(letter) and name.startswith(("wrist", "finger", "metacarpal"))
    ]
    out = np.where(
        model.weights[:, bones].sum(axis=1) > 0.2, (rest - wrist) @ unit(knuckle - wrist), -np.inf
    )
    faces = model.faces.astype(np.int64)
    chosen = single_rim(faces, (out > _BEYOND)[faces].all(axis=1))
    vertices = np.unique(faces[chosen])
    place = np.full(len(rest), -1)
    place[vertices] = np.arange(len(vertices))
    return HandPatch(vertices, place[faces[chosen]], place[border_loops(faces[chosen])[0]], out)


def _sewn(person: Reconstruction, body: Body, letter: str) -> Reconstruction | None:
    """The reconstruction with one hand of the body; None if that of the surface cannot be cut
    off."""
    patch, surface = hand_patch(letter), person.surface
    vertices, faces = surface.vertices.astype(np.float64), surface.faces.astype(np.int64)
    wrist = body.bone_transforms[body.bone_names.index(f"wrist{letter}"), :3, 3].astype(np.float64)
    covered = _covered(vertices, body, patch, wrist)
    if covered is None:
        return None
    staying = faces[single_rim(faces, ~covered[faces].any(axis=1))]
    loops = border_loops(staying)
    if (
        len(loops) != 1
        or len(loops[0]) < _LEAST_RIM
        or np.linalg.norm(vertices[loops[0]] - wrist, axis=1).max() > _AROUND
    ):
        return None
    placed = _fitted(body.vertices[patch.vertices].astype(np.float64), patch, vertices[loops[0]])
    if placed is None:
        return None
    every, made, kept = sew_in(vertices, staying, loops[0], placed, patch.faces, patch.rim)
    return _joined(person, every, made, kept, patch.vertices)


def _covered(
    vertices: FloatArray, body: Body, patch: HandPatch, wrist: FloatArray
) -> BoolArray | None:
    """Return which vertices (V,) of the surface belong to the hand; None if one of them is far from
    the body's hand.

    These are the vertices whose nearest vertex of the body belongs to the hand, beyond the start of
    the strip.
    """
    from scipy.spatial import cKDTree

    near = np.flatnonzero(np.linalg.norm(vertices - wrist, axis=1) < _REACH)
    covered = np.zeros(len(vertices), bool)
    away, nearest = cKDTree(body.vertices).query(vertices[near])
    covered[near] = patch.out[nearest] > _BEYOND - _GAP
    return None if (away[covered[near]] > _FARTHEST).any() else covered


def _fitted(hand: FloatArray, patch: HandPatch, hole: FloatArray) -> FloatArray | None:
    """The hand (K, 3) moved and thickened at its rim to fit the hole (n, 3); None if they are too
    far apart."""
    rim = hand[patch.rim]
    middle, normal = rim.mean(axis=0), np.linalg.svd(rim - rim.mean(axis=0))[2][2]
    across = np.eye(3) - np.outer(normal, normal)
    shift = across @ (hole.mean(axis=0) - middle)
    if np.linalg.norm(shift) > _SHIFTED:
        return None
    radii = [
        np.linalg.norm((ring - ring.mean(axis=0)) @ across, axis=1).mean() for ring in (hole, rim)
    ]
    stretch = np.clip(radii[0] / radii[1], *_STRETCHED) - 1
    share = 1 - smoothstep(patch.out[patch.vertices], _BEYOND, _BEYOND + _FADE)[:, None]
    return np.asarray(hand + share * (shift + stretch * (hand - middle) @ across))


def _joined(
    person: Reconstruction, vertices: FloatArray, faces: IntArray, kept: IntArray, twins: IntArray
) -> Reconstruction:
    """The reconstruction on a new mesh: first the `kept` vertices of the surface, then the vertices
    `twins` of the body in the color of the nearest old vertex."""
    from scipy.spatial import cKDTree

    surface = person.surface
    nearest = cKDTree(surface.vertices).query(vertices[len(kept) :])[1]
    source = np.concatenate([kept, nearest])
    before = (
        np.full(len(surface.vertices), -1, np.int32) if surface.twins is None else surface.twins
    )
    made = dataclasses.replace(
        surface,
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=surface.colors[source],
        twins=np.concatenate([before[kept], twins.astype(np.int32)]),
    )
    expected = person.expected_colors
    return dataclasses.replace(
        person, surface=made, expected_colors=None if expected is None else expected[source]
    )

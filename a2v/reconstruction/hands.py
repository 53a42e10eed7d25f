"""The body's hands sewn into the surface: a field that is asked every half a centimeter makes
mittens, of which no finger moves."""

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
"""The patch begins so far beyond the wrist, meters along the hand."""
_GAP = 0.008
"""The surface ends so far before it: room for the strip between the two."""
_REACH = 0.3
"""Nothing farther from the wrist, meters, is cut."""
_AROUND = 0.085
"""The hole's rim lies within so many meters of the wrist: a larger one would take more than a hand
away."""
_LEAST_RIM = 12
_FARTHEST = 0.08
"""Where the surface is farther from the body's hand, meters, it holds something, or the fit is
wrong."""
_SHIFTED = 0.04
"""Where the surface's wrist is farther off, meters, it is not the body's."""
_STRETCHED = (0.75, 1.3)
_FADE = 0.07
"""Along so much of the hand, meters, it turns from the surface's wrist into the body's own."""


@dataclass(frozen=True)
class HandSettings:
    """Which hands a surface has.

    Attributes
    ----------
    replace : bool
        Sew in the fitted body's hands, with fingers that move; without, hands are as the surface
        has them.
    bend : bool
        Bend the body's fingers as the photo shows them, or as relaxed hands have them; without,
        they are straight.
    """

    replace: bool = True
    bend: bool = True


def add_hands(
    person: Reconstruction, body: Body, *, settings: HandSettings = HandSettings()
) -> Reconstruction:
    """Replace the hands of a surface by the body's own.

    Each is cut off at the wrist; the body's is moved and thickened there to fit, which fades out
    along the hand, and is sewn to the rim.

    Parameters
    ----------
    person : Reconstruction
    body : Body
        Anny, fitted to the surface.

    Returns
    -------
    Reconstruction
        `person` itself for another body, and where its surface is the body already. A hand that
        cannot be cut off, since it touches or holds something, stays as it is;
        ``surface.provenance["hands"]`` says which are the body's.
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
        The body's, of the patch.
    faces : (F, 3) int
        Into `vertices`.
    rim : (n,) int
        Into `vertices`, in order.
    out : (V,) float
        How far each of the body's vertices is beyond the wrist along the hand, meters, on the body
        at rest; -inf for those that are not the hand's.
    """

    vertices: IntArray
    faces: IntArray
    rim: IntArray
    out: FloatArray


@functools.cache
def hand_patch(letter: str) -> HandPatch:
    """The hand of a side, ".L" or ".R", found once on Anny at rest, where no bent finger reaches
    back over the wrist."""
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
    """The reconstruction with one hand of the body's; None where that of the surface cannot be cut
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
    """Which vertices (V,) of the surface are the hand's: the nearest of the body is, beyond where
    the strip begins. None where one is far from it."""
    from scipy.spatial import cKDTree

    near = np.flatnonzero(np.linalg.norm(vertices - wrist, axis=1) < _REACH)
    covered = np.zeros(len(vertices), bool)
    away, nearest = cKDTree(body.vertices).query(vertices[near])
    covered[near] = patch.out[nearest] > _BEYOND - _GAP
    return None if (away[covered[near]] > _FARTHEST).any() else covered


def _fitted(hand: FloatArray, patch: HandPatch, hole: FloatArray) -> FloatArray | None:
    """The hand (K, 3) moved and thickened at its rim to fit the hole (n, 3); None where the two are
    too far apart."""
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
    """The reconstruction on a new mesh: first what is `kept` of the surface, then the body's
    vertices `twins`, colored as what was nearest."""
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

"""Map the face of the body to that of the photo and sew it into the surface, with its 52
expressions."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from a2v.body.face import (
    EYES,
    LEFT_EYEBALL,
    RIGHT_EYEBALL,
    TONGUE,
    actions_of,
    points_on_face,
    teeth,
)
from a2v.body.flat import flattened
from a2v.body.spots import moved_from_rest
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.face.bends import Bend, Placing
from a2v.reconstruction.face.facing import BEFORE, TURNED, behind_limb, is_averted, turned_away
from a2v.reconstruction.face.patch import Patch, face_patch
from a2v.reconstruction.face.places import placing_points
from a2v.reconstruction.face.settings import FaceSettings
from a2v.reconstruction.face.sewing import cut_and_sew
from a2v.types import Body, Camera, Face, FloatArray, IntArray, Reconstruction, Subject, Surface

_TEETH_SCALE = np.array([0.78, 0.92, 0.94])
"""Scale of the teeth of the model, which are too large for its mouth. Scaled, they are hidden by
closed lips and visible between open lips."""
_UPPER_UP = 0.0005
"""Distance by which the upper teeth move up, meters."""
_LOWER_DOWN = 0.002
"""Distance by which the lower teeth move down, meters."""
_CLOSED = 0.05
"""Strength of the closed mouth in the neutral face: at rest the lips of the model leave a gap of a
fraction of a millimeter, through which teeth are visible."""
_LID = 0.82
"""Strength of the blink of the model: at 1 its upper lids fall 3 to 4 mm below the lower ones."""
_SEEN_TURNED = 3.06
"""Angle, degrees, by which the model's face looks bent forward to the detector, if it is drawn from
the front."""
_EYE_REACH = (0.027, 0.036)
"""Distances from the middle of an eye up to which its expressions have full strength, and at which
they end, meters."""
_LEAST = 1e-5
"""Length below which offsets are dropped, meters."""


def add_face(
    person: Reconstruction,
    subject: Subject,
    body: Body,
    camera: Camera,
    *,
    settings: FaceSettings = FaceSettings(),
) -> Reconstruction:
    """Replace the face of a surface by that of the body.

    The front of the head of the fitted body is bent in the plane of the photo, so that the
    landmarks that the detector finds on it lie on those that it finds in the photo. In depth it
    follows the surface around it. The surface is cut open there and sewn to the rim of the patch.
    The expressions go through the same bend, so that lids and lips that touch on the body touch on
    the person.

    Parameters
    ----------
    person : Reconstruction
    subject : Subject
    body : Body
        Anny, fitted to the photo.
    camera : Camera

    Returns
    -------
    Reconstruction
        With ``surface.face``, or `person` itself if the photo shows no face from the front, or it
        cannot be sewn in; ``surface.provenance["face"]`` has the reason.
    """
    if not settings.expressions or body.model != "anny":
        return person
    laid = bend_face(person.surface, subject, body, camera, settings=settings)
    made = None if isinstance(laid, str) else _sewn(person, subject, body, laid)
    if made is not None:
        return made
    reason = laid if isinstance(laid, str) else "the surface around the face is too torn"
    surface = person.surface
    return dataclasses.replace(
        person,
        surface=dataclasses.replace(
            surface, provenance=dict(surface.provenance) | {"face": reason}
        ),
    )


def _unfit(subject: Subject, most: float) -> str:
    """Reason why the face of the photo cannot be used, if it may be turned away by `most` degrees;
    empty if it can."""
    if subject.face is None:
        return "no face is seen from the front"
    turned = turned_away(subject.face)
    return f"the face is turned away by {turned:.0f} degrees" if turned > most else ""


@dataclass(frozen=True, eq=False)
class BentFace:
    """The face of the body, mapped to that of the photo.

    Attributes
    ----------
    patch : Patch
    posed, bent : (13854, 3)
        Anny's vertices and teeth with the head turned as in the photo, before and after the bend,
        meters.
    turns : (13854, 3, 3)
        Rotation of each from rest.
    bend : callable
        From points (n, 3) to points (n, 3).
    averted : bool
        Whether the face is turned too far away to show its features (`is_averted`).
    """

    patch: Patch
    posed: FloatArray
    bent: FloatArray
    turns: FloatArray
    bend: Callable[[FloatArray], FloatArray]
    averted: bool

    def moved(self, name: str) -> FloatArray:
        """Displacements (13854, 3) of the bent vertices by the expression `name`, meters; 0 for
        those outside of it."""
        ids, shifts = actions_of()[name]
        whole = np.zeros_like(self.posed)
        far = self.posed[ids] + np.einsum(
            "vab,vb->va", self.turns[ids], shifts * _share(name, self.posed)[ids]
        )
        whole[ids] = self.bend(far) - self.bent[ids]
        return whole


def bend_face(
    surface: Surface,
    subject: Subject,
    body: Body,
    camera: Camera,
    *,
    settings: FaceSettings = FaceSettings(),
    most: float = TURNED,
) -> BentFace | str:
    """Lay the face of the body on that of the photo and on `surface`, bent in the flat frame of the
    camera. Returns the reason if this is not possible.

    A face that is turned away (`is_averted`) by up to `most` degrees keeps the features of
    the body: it is only moved, turned and scaled, because the photo shows little of the width of
    its far half.
    """
    reason = _unfit(subject, most)
    if reason:
        return reason
    patch = face_patch()
    posed, turns = _posed(body)
    assert subject.face is not None
    posed, turns = _facing(posed, turns, subject.face, camera)
    closing, shifts = actions_of()["mouthClose"]
    posed[closing] += _CLOSED * np.einsum("vab,vb->va", turns[closing], shifts)
    on_body = camera.flatten(points_on_face(posed))[:, :2]
    on_photo = camera.flat.unproject(subject.face[:, :2].astype(np.float64), 0.0)[:, :2]
    sources, targets = placing_points(on_body), placing_points(on_photo)
    flat: Bend | Placing = Bend(sources, targets, settings.smoothing)
    averted = settings.features != "photo" or is_averted(subject.face, body, camera)
    if averted:
        flat = Placing(sources, targets, camera.flatten(posed[patch.vertices]))
    seen = dataclasses.replace(surface, vertices=camera.flatten(surface.vertices))
    _follow_surface(flat, patch, camera.flatten(posed), flattened(body, camera), seen)

    def bend(points: FloatArray) -> FloatArray:
        return camera.raised(flat(camera.flatten(points)))

    return BentFace(patch, posed, bend(posed), turns, bend, averted)


def model_face(body: Body) -> BentFace:
    """The face of the body as it is."""
    posed, turns = _posed(body)
    closing, shifts = actions_of()["mouthClose"]
    posed[closing] += _CLOSED * np.einsum("vab,vb->va", turns[closing], shifts)
    return BentFace(face_patch(), posed, posed, turns, np.array, averted=False)


def _sewn(
    person: Reconstruction, subject: Subject, body: Body, laid: BentFace
) -> Reconstruction | None:
    patch, surface = laid.patch, person.surface
    assert subject.face is not None
    vertices, faces, kept, own = cut_and_sew(surface, laid.bent, body.faces.astype(np.int64), patch)
    if vertices is None:
        return None
    face = _expressions(laid, vertices, kept, own, subject.face)
    colors = np.concatenate([surface.colors[kept], np.full((len(own), 3), 0.5, np.float32)])
    expected = person.expected_colors
    if expected is not None:
        expected = np.concatenate([expected[kept], np.full((len(own), 3), np.nan, np.float32)])
    twins = (
        None
        if surface.twins is None
        else np.concatenate([surface.twins[kept], np.full(len(own), -1, np.int32)])
    )
    made = dataclasses.replace(
        surface,
        twins=twins,
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=colors,
        face=face,
        provenance=dict(surface.provenance) | {"face": "anny"},
    )
    return dataclasses.replace(person, surface=made, expected_colors=expected)


def _facing(
    posed: FloatArray, turns: FloatArray, landmarks: FloatArray, camera: Camera
) -> tuple[FloatArray, FloatArray]:
    """Turn the vertices (V, 3) and rotations (V, 3, 3) of the body like the head in the photo.
    Otherwise the deep teeth and tongue would be off to a side."""
    from scipy.spatial.transform import Rotation

    on_body = points_on_face(posed)
    middle = on_body.mean(axis=0)
    on_photo = landmarks.astype(np.float64) * [1, -1, 1] / camera.scale
    upright = Rotation.from_euler("x", -camera.looks_down(middle)).apply(
        on_photo - on_photo.mean(axis=0)
    )  # the detector sees the face along the ray
    found, _ = Rotation.align_vectors(upright, on_body - middle)
    turn = (Rotation.from_euler("x", -_SEEN_TURNED, degrees=True) * found).as_matrix()
    return middle + (posed - middle) @ turn.T, turn @ turns


def _posed(body: Body) -> tuple[FloatArray, FloatArray]:
    """Anny's vertices and teeth (13854, 3) in the pose of the body, and the rotation of each from
    rest (13854, 3, 3)."""
    turns = moved_from_rest(body)[..., :3]
    posed = body.vertices.astype(np.float64).copy()
    rows = teeth()
    near = np.argsort(np.linalg.norm(rows.around - rows.vertices.mean(axis=0), axis=1))[:900]
    near = near[near < TONGUE.start]
    plain = np.concatenate([rows.around[near], np.ones((len(near), 1))], axis=1)
    affine, *_ = np.linalg.lstsq(plain, posed[near], rcond=None)
    shrunk = (
        rows.vertices.mean(axis=0) + (rows.vertices - rows.vertices.mean(axis=0)) * _TEETH_SCALE
    )
    shrunk[:, 2] -= 0.003
    shrunk[:, 1] += np.where(np.arange(len(shrunk)) < len(shrunk) // 2, _UPPER_UP, -_LOWER_DOWN)
    placed = np.concatenate([shrunk, np.ones((len(shrunk), 1))], axis=1) @ affine
    posed[TONGUE] += turns[TONGUE] @ np.array(
        [0.0, -0.006, -0.008]
    )  # the tongue of the model is visible between its lips, and fills an open mouth
    return np.concatenate([posed, placed]), np.concatenate(
        [turns, np.tile(turns[near].mean(axis=0), (len(placed), 1, 1))]
    )


def _share(name: str, posed: FloatArray) -> FloatArray:
    """Weight (V, 1) of an expression on each vertex. Expressions of one eye fade out, because in
    the data they also pull at the nose and the other eye."""
    if not name.startswith("eye"):
        return np.ones((len(posed), 1))
    middle = posed[LEFT_EYEBALL if name.endswith("Left") else RIGHT_EYEBALL].mean(axis=0)
    share = np.clip(
        (_EYE_REACH[1] - np.linalg.norm(posed - middle, axis=1)) / (_EYE_REACH[1] - _EYE_REACH[0]),
        0,
        1,
    )[:, None]
    faded: FloatArray = smoothstep(share, 0, 1) * (_LID if name.startswith("eyeBlink") else 1.0)
    return faded


def _follow_surface(
    bend: Bend | Placing, patch: Patch, posed: FloatArray, body: Body, surface: Surface
) -> None:
    """Let the depths of the bend follow the surface: exactly at the rim of the patch, approximately
    inside it."""
    from a2v.geometry.rays import ray_scene

    skin = patch.vertices[(patch.kinds == 0) & (patch.vertices < EYES.start)]
    seen = np.intersect1d(skin, body.faces[patch.front])
    rim = patch.vertices[patch.rim]
    chosen = np.concatenate([rim, np.setdiff1d(seen, rim)[::12]])
    bent = bend(posed[chosen])
    rays = np.concatenate(
        [bent[:, :2], np.full((len(bent), 1), BEFORE), np.tile([0, 0, -1.0], (len(bent), 1))],
        axis=1,
    )
    depth = BEFORE - ray_scene(surface.vertices, surface.faces).cast_rays(rays.astype(np.float32))[
        "t_hit"
    ].numpy().astype(np.float64)
    shift = depth - bent[:, 2]
    good = np.isfinite(shift) & ~behind_limb(body, bent)
    if good.any():
        good &= np.abs(shift - np.median(shift[good])) < 0.02
    on_rim = np.arange(len(chosen)) < len(rim)
    bend.follow(bent[good, :2], shift[good], np.where(on_rim[good], 1e-6, 1e-3))


def _expressions(
    laid: BentFace, vertices: FloatArray, kept: IntArray, own: IntArray, landmarks: FloatArray
) -> Face:
    """Return all expressions on the new surface.

    The patch moves like the bent body, the surface around it like the nearest vertices of the bent
    body.
    """
    from scipy.spatial import cKDTree

    patch = laid.patch
    skin = np.arange(TONGUE.start)
    outside = np.setdiff1d(skin, patch.vertices)
    around = np.concatenate([outside, patch.vertices[patch.rim]])
    first = len(kept)
    close = np.flatnonzero(
        np.linalg.norm(vertices[:first] - vertices[first:].mean(axis=0), axis=1) < 0.3
    )
    reach, nearest = cKDTree(laid.bent[around]).query(vertices[close], k=4)
    share = 1 / np.maximum(reach, 1e-4)
    share /= share.sum(axis=1, keepdims=True)
    which = np.concatenate([close, first + np.arange(len(own))])

    def moved(name: str) -> FloatArray:
        whole = laid.moved(name)
        return np.concatenate(
            [(whole[around][nearest] * share[..., None]).sum(axis=1), whole[patch.vertices]]
        )

    twins = np.where(
        patch.vertices < EYES.stop, patch.vertices, patch.vertices[(patch.kinds == 2).argmax()]
    )
    return face_of(
        moved,
        which,
        (first + np.arange(len(own))).astype(np.int32),
        twins.astype(np.int32),
        patch.kinds.astype(np.uint8),
        landmarks,
    )


def face_of(
    moved: Callable[[str], FloatArray],
    which: IntArray,
    patch: IntArray,
    twins: IntArray,
    kinds: IntArray,
    landmarks: FloatArray,
) -> Face:
    """A `Face` whose expressions move the vertices `which` (n,), sorted, by `moved` (n, 3), a
    function of the name of the expression; the other arguments are attributes."""
    names, starts, vertices, offsets = [], [0], [], []
    for name in actions_of():
        shift = moved(name)
        real = np.linalg.norm(shift, axis=1) > _LEAST
        names.append(name)
        vertices.append(which[real])
        offsets.append(shift[real])
        starts.append(starts[-1] + int(real.sum()))
    return Face(
        names=tuple(names),
        starts=np.array(starts, np.int32),
        vertices=np.concatenate(vertices).astype(np.int32),
        offsets=np.concatenate(offsets).astype(np.float32),
        patch=patch,
        twins=twins,
        kinds=kinds,
        landmarks=landmarks.astype(np.float32),
    )

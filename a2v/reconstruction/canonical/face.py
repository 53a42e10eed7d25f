"""Fit the face of the body model to the landmarks of the photo on a canonical person, with all
expressions at rest."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.body.face import EYES, SKIN, points_on_face
from a2v.body.fingers import reskinned
from a2v.body.parts import PARTS
from a2v.body.registry import load_body_model
from a2v.body.spots import moved_from_rest
from a2v.geometry.mesh import cotangent_weights, factored, laplacian
from a2v.kinematics.skeleton import subtree
from a2v.reconstruction.canonical.topology import Topology
from a2v.reconstruction.face.build import (
    BentFace,
    bend_face,
    face_of,
    model_face,
)
from a2v.reconstruction.face.facing import turned_away
from a2v.reconstruction.face.settings import FaceSettings
from a2v.types import Body, BoolArray, Camera, Face, FloatArray, Subject, Surface

_AROUND = 0.09
"""Distance from the face up to which the head follows the bend of the face, meters on the body at
rest."""
_JAW = 0.03
"""Distance from the face within which the head below the eyes keeps its shape, meters."""
_BROW = 0.005
"""The same distance above the eyes, where hair begins, meters."""
SMALL = 44.0
"""Width in pixels below which a face keeps the features of the model: the errors of the landmarks
are larger than the differences between people."""
SMALL_FACE = (
    "the face is small in the photo: the character has the body model's own features in the "
    "photo's colors"
)
UNCLEAR_FACE = (
    "the face is unclear in the photo: the character has the body model's own features in the "
    "photo's colors"
)
PAINTED_FACE = (
    "the photo shows no face that can be used: the character has the body model's own face in the "
    "color of the person's skin"
)
PAINTED_HEAD = (
    "the photo does not show the head from the front: the character has the body model's own head "
    "in the colors of the person's skin and hair"
)
_MOST = 80.0
"""Angle from the camera, degrees, beyond which faces have no expressions."""
TURNED_FACE = (
    "the face is turned away in the photo: the character has the body model's own features in the "
    "photo's colors"
)
_BEHIND = 110.0
"""Angle of a head from the camera, degrees, beyond which it is seen from behind."""
_SHOWN = 0.6
"""Smallest share of the head's vertices on the person in the photo with which a head is shown."""
PAINTED = ("skin", "head")
"""Those of `FEATURES` with which the face is painted."""
_STIFF = 10.0
"""Smoothing of thin-plate splines, square meters, at which only an affine map remains."""


@dataclass(frozen=True, eq=False)
class Laid:
    """A face laid on the body.

    Attributes
    ----------
    reason : str
        "anny", or the reason why there is no face.
    bent : BentFace or None
    landmarks : (478, 3) or None
        Mediapipe's landmarks of the face in the photo, or where the face of the model would have
        them.
    small, averted : bool
        Whether the face in the photo is too small, or turned too far away, to determine its
        features.
    features : str
        One of `FEATURES`.
    """

    reason: str
    bent: BentFace | None = None
    landmarks: FloatArray | None = None
    small: bool = False
    averted: bool = False
    features: str = "photo"

    def applied(
        self, posed: FloatArray, rest: FloatArray, turns: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Anny's vertices and teeth (13854, 3), posed and at rest, with the face bent and the head
        following it."""
        if self.bent is None:
            return posed, rest
        own = self.bent.patch.vertices
        moved = np.zeros_like(posed)
        moved[own] = self.bent.bent[own] - posed[own]
        moved[: SKIN.stop] = _followed(rest[: SKIN.stop], moved[: SKIN.stop], own[own < SKIN.stop])
        return posed + moved, rest + np.linalg.solve(turns, moved[..., None])[..., 0]

    def turned(self, body: Body) -> Body:
        """The body with the head turned as in the photo.

        The fit turns the head by few landmarks, and a face on a head with another turn sits askew.
        """
        if self.bent is None:
            return body
        head = body.bone_names.index("head")
        vertex = int(np.argmax(body.weights[:, head]))
        turn = self.bent.turns[vertex] @ np.linalg.inv(moved_from_rest(body)[vertex, :, :3])
        center = body.bone_transforms[head, :3, 3].astype(np.float64)
        moved = np.eye(4)
        moved[:3, :3], moved[:3, 3] = turn, center - turn @ center
        transforms = body.bone_transforms.astype(np.float64)
        below = subtree(body.bone_parents, head)
        transforms[below] = moved @ transforms[below]
        return reskinned(body, transforms)

    def covered(self, mesh: Topology) -> BoolArray:
        """Return which vertices (V,) of the mesh belong to the face."""
        own = np.zeros(mesh.first + 136, np.float64)
        if self.bent is not None:
            own[self.bent.patch.vertices] = 1.0
        return np.asarray(mesh.spread(own) > 0.99)

    def around(self, mesh: Topology, rest: FloatArray) -> BoolArray:
        """Return which vertices (V,) of the mesh, at `rest` (V, 3), keep the shape that the face
        gives them: those of the face, and of the jaw and the cheeks beside it."""
        from scipy.spatial import cKDTree

        own = self.covered(mesh)
        if not own.any():
            return own
        eyes = rest[EYES].mean(axis=0)
        reach = np.where(rest[:, 1] < eyes[1], _JAW, _BROW)
        return np.asarray(own | (cKDTree(rest[own & mesh.skin]).query(rest, workers=1)[0] < reach))


NO_FACE = Laid("no face was requested")


def lay_face(
    surface: Surface, subject: Subject, body: Body, camera: Camera, settings: FaceSettings
) -> Laid:
    """Lay the face of the body on that of the photo. A small face, and one that is turned away,
    keeps the features of the model: it is only moved, turned and scaled."""
    if settings.features in PAINTED:
        return _of_model(body, camera, settings.features, "no face was requested")
    small = subject.face is not None and face_width(subject.face) < SMALL
    if small:
        settings = dataclasses.replace(settings, smoothing=_STIFF)
    bent = bend_face(surface, subject, body, camera, settings=settings, most=_MOST)
    if isinstance(bent, str):
        return _of_model(
            body, camera, "head" if head_unseen(subject, body, camera) else "skin", bent
        )
    return Laid("anny", bent, subject.face, small, bent.averted, settings.features)


def _of_model(body: Body, camera: Camera, features: str, reason: str) -> Laid:
    """The face of the model as it is, to be painted."""
    bent = model_face(body)
    points = points_on_face(bent.posed)
    landmarks = np.column_stack([camera.project(points), camera.scale * points[:, 2]])
    return Laid(reason, bent, landmarks.astype(np.float32), features=features)


def head_unseen(subject: Subject, body: Body, camera: Camera) -> bool:
    """Return whether the photo does not show the head from the front or a side: it is seen from
    behind, or cut off by the border, or hidden."""
    points = points_on_face(body.vertices)
    flat = camera.flatten(points)
    places = np.concatenate([camera.flat.project(flat), camera.flat.scale * flat[:, 2:]], axis=1)
    if turned_away(places) > _BEHIND:
        return True
    head = body.vertices[body.parts == PARTS.index("head")].astype(np.float64)
    column, row = np.floor(camera.project(head)).astype(np.int64).T
    height, width = subject.mask.shape
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    shown = subject.mask[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)] > 0.5
    return bool((inside & shown).mean() < _SHOWN)


def face_note(surface: Surface) -> str:
    """Return the note for the user about the face of a canonical character; empty for none."""
    found = surface.provenance
    painted = {"skin": PAINTED_FACE, "head": PAINTED_HEAD, "model": UNCLEAR_FACE}
    if found.get("features") in painted:
        return painted[found["features"]]
    return SMALL_FACE if found.get("small_face") else TURNED_FACE * bool(found.get("turned_face"))


def face_width(landmarks: FloatArray) -> float:
    """Width of a face, pixels, from one ear's root to the other's, by mediapipe's landmarks (478,
    3)."""
    return float(np.linalg.norm((landmarks[454] - landmarks[234])[:2]))


def face_on(mesh: Topology, laid: Laid) -> Face | None:
    """The expressions on the mesh, as offsets at rest."""
    if laid.bent is None:
        return None
    bent, every = laid.bent, np.arange(len(mesh.twin))
    back = np.linalg.inv(bent.turns)
    kinds = np.full(mesh.first + 136, 255, np.int64)
    kinds[bent.patch.vertices] = bent.patch.kinds
    patch = np.flatnonzero(laid.covered(mesh))
    whole = np.concatenate([kinds, kinds[np.minimum(mesh.nearest[len(kinds) :], len(kinds) - 1)]])

    def moved(name: str) -> FloatArray:
        return mesh.spread(np.einsum("vab,vb->va", back, bent.moved(name)))

    assert laid.landmarks is not None
    return face_of(
        moved,
        every,
        patch.astype(np.int32),
        mesh.nearest[patch].astype(np.int32),
        whole[patch].astype(np.uint8),
        laid.landmarks,
    )


def _followed(rest: FloatArray, moved: FloatArray, own: np.ndarray) -> FloatArray:
    """Shifts (n, 3) of the skin: those given on the `own` vertices, 0 far from them, and harmonic
    between."""
    from scipy.sparse import diags
    from scipy.spatial import cKDTree

    faces = load_body_model("anny").faces.astype(np.int64)
    faces = faces[faces.max(axis=1) < len(rest)]
    reach = cKDTree(rest[own]).query(rest, workers=1)[0]
    held = np.where(reach < 1e-9, 1e6, np.where(reach > _AROUND, 1e6, 0.0))
    system = laplacian(cotangent_weights(rest, faces)) + diags(held + 1e-9)
    pulled = held[:, None] * np.where(reach[:, None] < 1e-9, moved, 0.0)
    return np.asarray(factored(system).solve(pulled))

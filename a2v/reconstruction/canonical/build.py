"""Build the canonical person of a reconstruction: the mesh of the body at rest, displaced to the
dressed surface, with the face, hands and feet of the model."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from a2v.body.face import EYES, SKIN, teeth
from a2v.body.parts import PARTS, on_parts
from a2v.body.spots import moved_from_rest, rest_vertices
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.canonical.binding import four_weights, posed_by
from a2v.reconstruction.canonical.ears import ears, ears_covered, flat_ears
from a2v.reconstruction.canonical.face import NO_FACE, Laid, face_on, lay_face
from a2v.reconstruction.canonical.hair import hair_faces, make_hair, under_hair
from a2v.reconstruction.canonical.hanging import in_skirt
from a2v.reconstruction.canonical.layers import Layer, with_layer
from a2v.reconstruction.canonical.observe import PersonView, observe, ray_normals
from a2v.reconstruction.canonical.settings import CharacterSettings
from a2v.reconstruction.canonical.several import Sight, face_of, merged
from a2v.reconstruction.canonical.shape import RestMesh, solve_offsets
from a2v.reconstruction.canonical.skirt import (
    BELOW,
    Skirt,
    covered,
    make_skirt,
    skirt_faces,
)
from a2v.reconstruction.canonical.strands import HairlessPerson
from a2v.reconstruction.canonical.topology import Topology, topology
from a2v.reconstruction.canonical.wear import (
    flat_soles,
    in_shoes,
    in_tips,
    thin_under_skirt,
    without_anatomy,
)
from a2v.reconstruction.face.settings import FaceSettings
from a2v.reconstruction.reading import HairSeen
from a2v.types import Body, BoolArray, FloatArray, IntArray, Reconstruction, Standing, Surface

DEFAULT = CharacterSettings()
HANDS = tuple(name for name in PARTS if name.endswith("hand"))
FEET = tuple(name for name in PARTS if name.endswith("foot"))
_BENT = (0.55, 0.95)
"""Determinants of the skinning, which shrinks the body in the creases of bent joints. Displacements
have the weight `_CREASED` up to the first value, and their full weight from the second on."""
_CREASED = 0.05
"""Weight of displacements in creases."""
_DOWN = -0.4
"""Largest y of the normal of a foot's sole. Below the sole is the ground, or something unseen."""
_EXPECTED = 0.03
"""Largest distance from a vertex of the character, with a similar normal, at which a color that the
backend expects is used, meters."""


def canonical_person(
    sight: Sight,
    *,
    settings: CharacterSettings = DEFAULT,
    face: FaceSettings | None = None,
    others: Sequence[Sight] = (),
) -> Reconstruction:
    """Build the person on the mesh of the body.

    1. Rays from the refined mesh of the body along its normals meet the reconstructed surface. A
       hit counts if it is of the same part as the vertex and nothing else touches there.
    2. One sparse solve gives the displacement of every vertex: near the observed one, else near
       that of the mirrored side or the usual one of the part.
    3. The displacements are applied to the body at rest, so that nothing of the photo's pose
       remains.

    Parameters
    ----------
    sight : Sight
        The photo, with Anny fitted to the surface that was reconstructed from it.
    others : sequence of Sight
        Further photos of the same person, in any order; all bodies have the same shape.

    Returns
    -------
    Reconstruction
        The surface is in the pose of the photo; ``surface.standing`` is the same surface at rest.
    """
    mesh, person = topology(), sight.person
    given, legs = sight, settings.legs
    if legs == "skirt":
        sight = in_skirt(sight)
        legs = "trousers" if sight is given else legs  # the photo shows a skirt, or legs
    reading = sight.reading
    bare = reading.bare_feet
    sights, shown, laid, poses, shod, covers = _shod(
        [sight, *others], face or FaceSettings(), bare=bare
    )
    body, at_rest = sights[0].body, mesh.refined(without_anatomy(sights[shown].body, shod))
    parts = body.parts[mesh.nearest].astype(np.int64)
    rest = RestMesh(vertices=at_rest, faces=mesh.faces, parts=parts, twin=mesh.twin)
    skirt, lowest = _skirt(sight, body, without_anatomy(body, shod))
    hidden = np.zeros(len(parts), bool) if skirt is None else covered(skirt, at_rest, parts, lowest)
    long = None if laid.features == "head" else sights[0].reading.hair
    if long is not None:
        hidden |= under_hair(at_rest, parts, ray_normals(at_rest, mesh.faces))
    asked = ~hidden & _dressed(body, rest, laid, bare=bare, ears_shown=covers is False)
    vertices = _displaced(sights, poses, rest, asked, settings, long)
    vertices = vertices if bare else flat_soles(vertices, parts)
    if skirt is not None:
        vertices = thin_under_skirt(vertices, body, hidden, skirt.hem)
    standing, faces = _with_layers(
        standing_of(vertices, mesh, body),
        skirt,
        None if long is None else _hair(sight, body, long, vertices),
    )
    found = {
        "character": "canonical",
        "face": laid.reason,
        "bare_feet": bare,
        "covered_ears": covers,
        "small_face": laid.small,
        "turned_face": laid.averted,
        "features": laid.features,
        "legs": legs,
        "legs_color": settings.legs_color,
    } | ({"photos": len(sights), "face_photo": shown} if others else {})
    surface = Surface(
        vertices=posed_vertices(standing, body),
        faces=faces.astype(np.int32),
        colors=np.full(standing.vertices.shape, 0.6, np.float32),
        face=face_on(mesh, laid),
        standing=standing,
        provenance=dict(person.surface.provenance) | found,
    )
    return dataclasses.replace(
        person, surface=surface, expected_colors=_expected(person, surface), from_body=False
    )


def _dressed(body: Body, rest: RestMesh, laid: Laid, *, bare: bool, ears_shown: bool) -> BoolArray:
    """Return which vertices (V,) cloth or hair may displace: not the face, hands, `bare` feet, tips
    of shoes, and ears that the photo shows."""
    mesh, parts = topology(), rest.parts
    own = mesh.skin & ~on_parts(parts, *HANDS) & ~laid.around(mesh, rest.vertices)
    own &= ~(on_parts(parts, "head") & (laid.features == "head"))
    own &= ~(on_parts(parts, *FEET) if bare else in_tips(body, rest.vertices, parts))
    return np.asarray(own & ~(mesh.spread(ears().astype(np.float64)) > 0) if ears_shown else own)


def _skirt(sight: Sight, body: Body, rest: FloatArray) -> tuple[Skirt | None, float]:
    """The skirt on a body at `rest` (V, 3), None without one, and the height, meters, down to which
    legs under it have no clothes."""
    hem = sight.reading.hem
    if not sight.reading.hangs:
        return None, 0.0
    skirt = make_skirt(sight, body, rest)
    if skirt is None:
        return None, 0.0
    return skirt, skirt.hem if hem is None else float(hem[1]) - BELOW


def _hair(sight: Sight, body: Body, seen: HairSeen, rest: FloatArray) -> Layer:
    """The layer of long hair on a person whose vertices at rest are `rest` (V, 3)."""
    mesh = topology()
    bald = standing_of(rest, mesh, body)
    person = HairlessPerson(
        rest=rest,
        posed=posed_vertices(bald, body).astype(np.float64),
        faces=mesh.faces[mesh.skin[mesh.faces].all(axis=1)],
        parts=np.asarray(bald.parts, np.int64),
    )
    return make_hair(person, body, seen, sight.camera)


def _with_layers(
    standing: Standing, skirt: Skirt | None, hair: Layer | None
) -> tuple[Standing, IntArray]:
    """Append the layers to a standing person, and return the faces (F, 3) of all."""
    faces = [topology().faces]
    if skirt is not None:
        faces.append(len(standing.vertices) + skirt_faces(len(skirt.vertices)))
        standing = with_layer(standing, skirt, "torso")
    if hair is not None:
        faces.append(len(standing.vertices) + hair_faces())
        standing = with_layer(standing, hair, "head")
    return standing, np.concatenate(faces)


def _displaced(
    sights: Sequence[Sight],
    poses: Sequence[FloatArray],
    rest: RestMesh,
    asked: BoolArray,
    settings: CharacterSettings,
    long: HairSeen | None,
) -> FloatArray:
    """Displace the vertices (V, 3) at rest that are selected in `asked` (V,) by the observations of
    the photos. On the trunk, `long` hair gives no displacement."""
    normals = ray_normals(rest.vertices, rest.faces)
    sole = on_parts(rest.parts, *FEET) & (normals[:, 1] < _DOWN)
    observed, weight = _observed(sights, poses, rest, asked, near=settings.near)
    if long is not None:
        posed = topology().refined(poses[0])
        trunk = on_parts(rest.parts, "torso", "neck")
        weight = weight * ~(trunk & long.at(sights[0].camera.project(posed)))
    offset = solve_offsets(
        rest, observed, weight * ~sole, fixed=~asked, smoothing=settings.smoothing
    )
    return np.asarray(rest.vertices + offset[:, None] * normals)


def _shod(
    given: Sequence[Sight], face: FaceSettings, *, bare: bool
) -> tuple[list[Sight], int, Laid, list[FloatArray], FloatArray, bool | None]:
    """Put face and shoes on the body, and lay covered ears flat; `bare` feet get no shoes.

    Returns
    -------
    The sights with the head turned as in the photo that shows the face best, the index of that
    photo, its face on the body, Anny's vertices and teeth (13854, 3) with this face and shoes in
    the pose of every photo and at rest, and whether hair covers the ears (`ears_covered`).
    """
    sights, shown = list(given), face_of([sight.subject for sight in given])
    faced = sights[shown]
    laid = (
        lay_face(faced.person.surface, faced.subject, faced.body, faced.camera, face)
        if face.expressions
        else NO_FACE
    )
    sights[shown] = dataclasses.replace(faced, body=laid.turned(faced.body), given=None)
    posed, rest = with_teeth(sights[shown].body)
    turns = blended_turns(sights[shown].body)
    posed, rest = laid.applied(posed, rest, turns)
    covers = ears_covered(sights[shown].subject, posed, sights[shown].camera)
    shod = in_shoes(sights[shown].body, flat_ears(rest) if covers else rest, bare=bare)
    own = posed + np.einsum("vab,vb->va", turns, shod - rest)
    return (
        sights,
        shown,
        laid,
        [
            own if number == shown else _carried(sight.body, shod)
            for number, sight in enumerate(sights)
        ],
        shod,
        covers,
    )


def _observed(
    sights: Sequence[Sight],
    poses: Sequence[FloatArray],
    rest: RestMesh,
    asked: BoolArray,
    *,
    near: float,
) -> tuple[FloatArray, FloatArray]:
    """Return displacements (V,), meters, and their weights (V,), observed in the photos.

    `poses` are Anny's vertices and teeth (13854, 3) in the pose of each photo.
    """
    mesh, seen, certain = topology(), [], []
    for sight, pose in zip(sights, poses, strict=True):
        skin = mesh.refined(without_anatomy(sight.body, pose))
        bent = mesh.spread(np.linalg.det(blended_turns(sight.body)))
        view = PersonView(sight.camera, sight.reading.taken)
        seen.append(observe(sight.person.surface, rest, skin, asked, near=near, view=view))
        certain.append(seen[-1].weight * (_CREASED + (1 - _CREASED) * smoothstep(bent, *_BENT)))
    return merged(seen, certain) if len(seen) > 1 else (seen[0].offset, certain[0])


def _carried(body: Body, shod: FloatArray) -> FloatArray:
    """Pose Anny's vertices and teeth (13854, 3) like a body, from those at rest (13854, 3) with
    shoes and a face."""
    posed, rest = with_teeth(body)
    return np.asarray(posed + np.einsum("vab,vb->va", blended_turns(body), shod - rest))


def standing_of(vertices: FloatArray, mesh: Topology, body: Body) -> Standing:
    """Bind the mesh, with its vertices at rest (V, 3), meters, to the bones of a body."""
    weights, bones = four_weights(mesh, body)
    return Standing(
        vertices=vertices.astype(np.float32),
        weights=weights,
        bones=bones,
        anchors=mesh.nearest.astype(np.int32),
        parts=body.parts[mesh.nearest].astype(np.int8),
    )


def with_teeth(body: Body) -> tuple[FloatArray, FloatArray]:
    """Anny's vertices with teeth (13854, 3) in the pose of a body and at rest."""
    rest = rest_vertices(body)
    rows = teeth()
    near = np.argsort(np.linalg.norm(rows.around - rows.vertices.mean(axis=0), axis=1))[:900]
    near = near[near < SKIN.stop]
    plain = np.concatenate([rows.around[near], np.ones((len(near), 1))], axis=1)
    every = np.concatenate([rows.vertices, np.ones((len(rows.vertices), 1))], axis=1)
    placed = [
        every @ np.linalg.lstsq(plain, np.asarray(points, np.float64)[near], rcond=None)[0]
        for points in (body.vertices, rest)
    ]
    return np.concatenate([body.vertices, placed[0]]).astype(np.float64), np.concatenate(
        [rest, placed[1]]
    )


def blended_turns(body: Body) -> FloatArray:
    """Return the blended rotations from rest (13854, 3, 3) of Anny's vertices and teeth."""
    turns = moved_from_rest(body)[..., :3]
    mouth = topology().nearest[EYES.stop]
    return np.concatenate([turns, np.tile(turns[mouth], (len(teeth().vertices), 1, 1))])


def posed_vertices(standing: Standing, body: Body) -> FloatArray:
    """Skin a standing surface in the pose of its body: vertices (V, 3) float32."""
    posed = posed_by(standing.weights, standing.bones, body, standing.vertices)
    return posed.astype(np.float32)


def _expected(person: Reconstruction, made: Surface) -> FloatArray | None:
    """Return the backend's expected colors (V, 3) at the vertices of the character; NaN for
    vertices far from its surface, and for long hair: at the nape it expects skin and clothes."""
    from scipy.spatial import cKDTree

    if person.expected_colors is None:
        return None
    away, nearest = cKDTree(person.surface.vertices).query(made.vertices, workers=1)
    normals = [
        vertex_normals(surface.vertices, np.asarray(surface.faces, np.int64))
        for surface in (person.surface, made)
    ]
    good: BoolArray = (away < _EXPECTED) & ((normals[0][nearest] * normals[1]).sum(axis=1) > 0.3)
    assert made.standing is not None
    layer = np.arange(len(good)) >= len(topology().twin)
    good &= ~(layer & on_parts(np.asarray(made.standing.parts), "head"))  # long hair
    return np.where(good[:, None], person.expected_colors[nearest], np.nan).astype(np.float32)

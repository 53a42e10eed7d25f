"""Color a canonical person on the texture layout of the model."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from a2v.body.face import teeth
from a2v.body.head_chart import PARTS as HEAD
from a2v.body.head_chart import chart_places, head_cells, sample_chart
from a2v.body.parts import PARTS, on_parts
from a2v.body.registry import default_rest
from a2v.body.spots import rest_vertices, spots_of
from a2v.geometry.rays import texels
from a2v.reconstruction.canonical.build import posed_vertices
from a2v.reconstruction.canonical.ears import ears
from a2v.reconstruction.canonical.face import PAINTED
from a2v.reconstruction.canonical.hair import SHARE as HAIR_SHARE
from a2v.reconstruction.canonical.hair import hair_layout, hair_twins, strand_numbers, under_hair
from a2v.reconstruction.canonical.neutral import with_neutral_face
from a2v.reconstruction.canonical.observe import ray_normals
from a2v.reconstruction.canonical.several import Sight
from a2v.reconstruction.canonical.skirt import SHARE as SKIRT_SHARE
from a2v.reconstruction.canonical.skirt import shown_around, skirt_layout, skirt_twins
from a2v.reconstruction.canonical.topology import topology
from a2v.reconstruction.coloring import ColorEvidence, ColorSettings, Painting, finished
from a2v.reconstruction.coloring.atlas import Atlas, padded_layout
from a2v.reconstruction.coloring.canvas import BodyLayers, Canvas, CanvasHead, part_agreement
from a2v.reconstruction.coloring.other_photos import OtherPhoto
from a2v.reconstruction.reading import Reading
from a2v.types import (
    Body,
    BoolArray,
    Camera,
    FloatArray,
    Progress,
    Reconstruction,
    Subject,
    Surface,
)

_FOLDED = 0.008
"""Distance from what the head chart shows beyond which a vertex lies in a fold, meters."""
_UNDER = 0.025
"""Distance of skin from the layer of long hair up to which the layer covers it, meters."""


def canvas_of(
    surface: Surface,
    subject: Subject,
    camera: Camera,
    reading: Reading,
    settings: ColorSettings,
) -> Canvas:
    """The canvas of a canonical person's surface in the pose of the photo and the flat frame of
    `camera`."""
    assert surface.standing is not None
    parts = np.asarray(surface.standing.parts, np.int64)
    own = len(topology().twin)
    layer = np.arange(len(parts)) >= own
    strands = layer & (parts == PARTS.index("head"))
    hanging, hairy = int((layer & ~strands).sum()), bool(strands.any())
    layers = BodyLayers(layer & ~strands, strands if hairy else None)
    twins = [topology().twin, own + skirt_twins(hanging)]
    if hairy:
        twins.append(own + hanging + hair_twins())
    around = np.arange(len(parts))
    if hanging:
        around[layers.loose] = own + shown_around(surface.vertices[layers.loose].astype(float))
    return Canvas(
        rest=surface.standing.vertices.astype(np.float64),
        parts=parts,
        twin=np.concatenate(twins),
        atlas=layout(settings.texture, hanging, hairy=hairy),
        agreement=part_agreement(surface, layers, subject, camera.flat, reading, settings.off),
        hands=reading.hands,
        gloved=reading.gloves is not None,
        bare=reading.bare_forearms,
        loose=layers.loose,
        around=around,
        strands=np.where(strands, strand_numbers(len(parts)), -1) if hairy else None,
    )


def _head(surface: Surface, body: Body) -> CanvasHead:
    """The head of a person whose body under the clothes is `body`."""
    from scipy.spatial import cKDTree

    assert surface.standing is not None
    mesh, parts = topology(), np.asarray(surface.standing.parts, np.int64)
    own = len(mesh.twin)
    outermost, covered, free = np.zeros((3, len(parts)), bool)
    outermost[:own] = mesh.skin & on_parts(parts[:own], *HEAD) & _head_places()[1]
    strands = parts[own:] == PARTS.index("head")
    if strands.any():
        rest = surface.standing.vertices.astype(np.float64)
        low = under_hair(rest[:own], parts[:own], ray_normals(rest[:own], mesh.faces))
        away = cKDTree(rest[own:][strands]).query(
            rest[:own], distance_upper_bound=_UNDER, workers=1
        )[0]
        covered[:own] = low & np.isfinite(away)
    places = np.zeros((len(parts), 2))
    places[:own] = _head_places()[0]
    if surface.provenance.get("covered_ears") is False:
        free[:own] = mesh.spread(ears().astype(np.float64)) > 0
    return CanvasHead(places, outermost, covered, free, rest_vertices(body))


@functools.cache
def _head_places() -> tuple[FloatArray, BoolArray]:
    """Places (V, 2) in the head chart of the vertices of `topology`, and which the chart shows."""
    default, cells = default_rest(), head_cells()
    rest = topology().refined(np.concatenate([default, teeth().vertices]))
    places = chart_places(rest)
    shown = sample_chart(cells.spread(default), places)
    return places, np.linalg.norm(shown - rest, axis=1) < _FOLDED


def canonical_painting(
    person: Reconstruction, sights: Sequence[Sight], settings: ColorSettings
) -> Painting:
    """Begin the coloring of a canonical person, which stands as in the first of `sights`, by one or
    several photos."""
    assert person.surface.standing is not None
    face = int(person.surface.provenance.get("face_photo", 0))
    seen = [
        _in_pose_of(person.surface, sight, first=number == 0) for number, sight in enumerate(sights)
    ]
    canvases = [
        canvas_of(own, sight.subject, sight.camera, sight.reading, settings)
        for own, sight in zip(seen, sights, strict=True)
    ]
    others = tuple(
        OtherPhoto.of(
            seen[number],
            sight.subject,
            sight.camera.flat,
            canvases[number],
            delight=settings.delight,
        )
        for number, sight in enumerate(sights)
        if number != face
    )
    main = sights[face]
    evidence = ColorEvidence(
        prior=person.expected_colors,
        spots=spots_of(person.surface.standing.anchors, main.body),
        canvas=dataclasses.replace(canvases[face], head=_head(seen[face], main.body)),
        others=others,
    )
    return Painting.of(seen[face], main.subject, main.camera.flat, evidence, settings)


def color_canonical(
    person: Reconstruction,
    sights: Sequence[Sight],
    *,
    settings: ColorSettings,
    progress: Progress | None = None,
) -> Surface:
    """Color the surface of a canonical person, which stands as in the first of `sights`."""
    painting = canonical_painting(person, sights, settings)
    return as_person(person, painting, finished(painting, progress=progress))


def as_person(person: Reconstruction, painting: Painting, colored: Surface) -> Surface:
    """Return a colored surface in the frame of the first photo, with a painted face if the photo
    has none that can be used."""
    made = dataclasses.replace(colored, vertices=person.surface.vertices)
    features = made.provenance.get("features")
    if made.face is None or features not in PAINTED:
        return made
    assert painting.spots is not None
    return with_neutral_face(made, painting.spots, whole=features == "head")


def _in_pose_of(surface: Surface, sight: Sight, *, first: bool) -> Surface:
    """Move the surface to the pose of a photo, in the flat frame of its camera; it already has the
    pose of the `first` one."""
    assert surface.standing is not None
    vertices = surface.vertices if first else posed_vertices(surface.standing, sight.body)
    return dataclasses.replace(surface, vertices=sight.camera.flatten(vertices))


def layout(size: int, hanging: int = 0, *, hairy: bool = False) -> Atlas:
    """MakeHuman's texture layout on `size` texels per side, above the strips of a skirt with
    `hanging` vertices (0: no strip) and, if `hairy`, of long hair."""
    return _layout(size, hanging, hairy)  # the cache tells apart how a call is written


@functools.lru_cache(maxsize=2)
def _layout(size: int, hanging: int, hairy: bool) -> Atlas:
    uv, strips, height = topology().uv, [], 0.0
    if hanging:
        strips, height = [skirt_layout(hanging)], SKIRT_SHARE
    if hairy:
        strips.append(hair_layout() + np.array([0.0, height], np.float32))
        height += HAIR_SHARE
    if strips:
        uv = np.concatenate([body_layout(uv, height), *strips])
    face, barycentric = texels(uv.astype(np.float64) * size, size)
    return Atlas(uv, size, face, barycentric, float(size))


def load_layout(size: int = ColorSettings.texture) -> None:
    """Compute ahead what the textures of `size` texels per side of most canonical people share:
    the layout without skirt and long hair, which takes half a second."""
    padded_layout(layout(size))


def body_layout(uv: FloatArray, share: float) -> FloatArray:
    """Texture coordinates (f, 3, 2) of the body above strips of the height `share`."""
    return np.asarray(uv * (1 - share) + [0.0, share], np.float32)

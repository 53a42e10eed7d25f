"""Color a surface from the photo: visible places by projection, others by Eq. 14, in one
texture."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from a2v.body.parts import on_parts
from a2v.body.spots import Spots
from a2v.errors import InputError
from a2v.geometry.mesh import vertex_normals
from a2v.reconstruction.atlas import make_atlas
from a2v.reconstruction.backs import Continuation, Seen, continue_photo, find_twins, seen_before
from a2v.reconstruction.backs.seen import HANDS
from a2v.reconstruction.bake import PaddedAtlas, bake, padded_layout
from a2v.reconstruction.canvas import Canvas
from a2v.reconstruction.color_prior import mirrored_prior, seen_face, skin_like, skin_of_hands
from a2v.reconstruction.colored import ColoredMesh
from a2v.reconstruction.equation14 import ColorProblem, ColorSolution, solve_colors
from a2v.reconstruction.face.colors import face_paint
from a2v.reconstruction.face.drawing import drawn_over
from a2v.reconstruction.merged import OtherPhoto, on_vertices
from a2v.reconstruction.nearest import nearest_known, nearest_vertices
from a2v.reconstruction.other_half import HEAD, lent_to
from a2v.reconstruction.projection import PhotoProjection
from a2v.reconstruction.shading import photo_without_shading
from a2v.reconstruction.tones import (
    bare_arms,
    combed,
    even_tones,
    given_or_close,
    without_strangers,
)
from a2v.types import (
    BoolArray,
    FloatArray,
    IntArray,
    OrthographicCamera,
    Progress,
    Subject,
    Surface,
)


@dataclass(frozen=True)
class ColorSettings:
    """Settings of the coloring.

    Attributes
    ----------
    lambda_nn : float
        Weight of the neighbors in Eq. 14.
    neighbors : int
        Neighbors of a vertex in Eq. 14 (the paper's 10).
    tolerance : float
        Relative residual at which Eq. 14 counts as solved.
    band : float
        Width of the transition band behind the silhouette, meters: second term of Eq. 14 only.
    texture : int
        Width and height of the texture, texels; 0 for vertex colors only.
    synthesis : bool
        Continue visible cloth, hair and skin over the unseen side (`a2v.reconstruction.backs`);
        otherwise continue the colors of the nearest vertices only (Eq. 14).
    delight : bool
        Remove the shading of the photo from its colors (`a2v.reconstruction.shading`), so that they
        can be lit again.
    """

    lambda_nn: float = 1.0
    neighbors: int = 10
    tolerance: float = 3e-3
    band: float = 0.015
    texture: int = 2048
    synthesis: bool = True
    delight: bool = True

    def __post_init__(self) -> None:
        if not (np.isfinite(self.lambda_nn) and self.lambda_nn > 0):
            raise InputError(f"lambda_nn is {self.lambda_nn}; expected a positive number")
        if not 1 <= self.neighbors <= 64:
            raise InputError(f"neighbors is {self.neighbors}; expected 1 to 64")
        if not 0 < self.tolerance < 1:
            raise InputError(f"tolerance is {self.tolerance}; expected a number between 0 and 1")
        if self.texture and not 256 <= self.texture <= 4096:
            raise InputError(f"texture is {self.texture}; expected 0, or 256 to 4096 texels")
        if not 0 <= self.band <= 0.2:
            raise InputError(f"band is {self.band}; expected 0 to 0.2 meters")


@dataclass(frozen=True, eq=False)
class ColorEvidence:
    """What is known of a surface with V vertices in addition to the photo.

    Attributes
    ----------
    prior : (V, 3), optional
        c^p of Eq. 14, sRGB in [0, 1], predicted by a network; NaN if unknown. Default: the mirrored
        front, with hair on the back of the head.
    spots : Spots, optional
        Place of each vertex on the body (`a2v.body.nearest_spots`). Default: the head is found by
        the landmarks, and nothing is continued.
    canvas : Canvas, optional
        For a canonical person: its texture layout, and the part of each pixel. Default: charts are
        cut from the surface, and every pixel belongs to the surface that it shows.
    others : sequence of OtherPhoto
        Further photos of a canonical person.
    """

    prior: FloatArray | None = None
    spots: Spots | None = None
    canvas: Canvas | None = None
    others: Sequence[OtherPhoto] = ()


@dataclass(frozen=True, eq=False)
class _Shown:
    """Visibility of V vertices in the photos.

    Attributes
    ----------
    trust : (V,)
        In the main photo, from 0 to 1.
    known : (V,) bool
        Vertices that at least one photo shows well.
    main : (V,) bool
        Vertices that the main photo shows well.
    mouth : (V,) bool
        The inside of the mouth, which has given colors and is no evidence for the cheeks.
    """

    trust: FloatArray
    known: BoolArray
    main: BoolArray
    mouth: BoolArray


def color_surface(
    surface: Surface,
    subject: Subject,
    camera: OrthographicCamera,
    *,
    evidence: ColorEvidence | None = None,
    settings: ColorSettings | None = None,
    progress: Progress | None = None,
) -> Surface:
    """Color `surface` from the photo (Sec. 4.2.1 and Eq. 14 of the journal paper).

    Parameters
    ----------
    surface : Surface
        Of any backend, in the frame of `camera`.
    subject : Subject
    camera : OrthographicCamera
        Of `subject.image`.
    evidence : ColorEvidence, optional
        What is known in addition to the photo.

    Returns
    -------
    Surface
        With `colors` (albedo, in light as bright as the photo's), `visible`, and `uv` and `texture`
        unless ``settings.texture`` is 0. `provenance["eq14"]` reports iterations, residual and
        objective.

    Raises
    ------
    InputError
        Arrays of the wrong shape, or a surface that the camera does not see.
    """
    settings, evidence = settings or ColorSettings(), evidence or ColorEvidence()
    prior, spots, canvas, others = evidence.prior, evidence.spots, evidence.canvas, evidence.others
    report = progress or (lambda done, total: None)
    vertices = np.asarray(surface.vertices, np.float64)
    faces = np.asarray(surface.faces, np.int64)
    _check_given(len(vertices), prior, spots, settings)
    normals = vertex_normals(surface.vertices, faces)
    photo = PhotoProjection(surface, subject, camera)
    seen = photo.unoccluded(vertices) & (normals[:, 2] > 0)
    trust = photo.trust(vertices, normals)
    if canvas is not None:
        photo.canvas = canvas
        trust = trust * canvas.agrees(camera.project(vertices), canvas.owners)
    known = (trust > 0.5) & seen
    if not known.any():
        raise InputError(
            "the surface is not visible to the photo's camera; "
            "do surface, camera and photo belong together?"
        )
    photo.known = known
    report(1, 4)
    # it makes the charts of the texture, while this thread makes the colors
    beside = ThreadPoolExecutor(1)
    atlas = (
        beside.submit(_atlas, vertices, faces, camera, canvas, settings.texture)
        if settings.texture
        else None
    )
    beside.shutdown(wait=False)
    apart = vertices if canvas is None else canvas.rest  # at rest nothing touches

    colors = photo.patch_colors(vertices, faces)
    if settings.delight:
        photo.clean = photo_without_shading(
            photo.clean, camera, vertices, faces, normals, colors=colors, seen=known
        )
        colors = photo.patch_colors(vertices, faces)
    if surface.face is not None and surface.provenance.get("turned_face"):
        photo.clean, surface = drawn_over(photo.clean, surface, camera)
        colors = photo.patch_colors(vertices, faces)
    paint, mouth = face_paint(surface, photo.clean), np.zeros(len(known), bool)
    if paint is not None:
        known[paint.inner], colors[paint.inner], mouth[paint.inner] = True, paint.colors, True
    mesh, main = ColoredMesh(vertices, faces, normals, colors), known
    expected, reach = _expected(photo, mesh, known=known & ~mouth, prior=prior, head=_head(spots))
    if others:
        others = tuple(
            other.beside(known, colors, faces, None if surface.face is None else surface.face.patch)
            for other in others
        )
        known, colors = on_vertices(trust, known, colors, others)
        seen, photo.known = seen | known, known
    near = nearest_vertices(apart, settings.neighbors)
    lent = np.zeros(len(known), bool)
    if canvas is not None:
        expected = without_strangers(expected, colors, canvas, camera.project(vertices), known)
        hidden = on_parts(canvas.parts, *HANDS) & ~known
        if canvas.hands is not None:
            expected[hidden] = canvas.hands
        reach, _ = nearest_known(apart, known)
        lent = lent_to(canvas, known)
        expected[lent] = colors[canvas.twin[lent]]
    continued = None
    if settings.synthesis and spots is not None:
        mesh = dataclasses.replace(
            mesh, colors=np.where(known[:, None], colors, np.clip(expected, 0, 1))
        )
        continued = _continued(
            photo, mesh, _Shown(trust, known, main, mouth), spots=spots, neighbors=near
        )
    # the band: grazing places of the photo, and places just behind the silhouette
    band = ~known & ((seen & (normals[:, 2] > 0.0)) | (reach < settings.band))
    fixed = colors
    if continued is not None:
        expected, near, band = continued.expected, continued.neighbors, band | continued.doubtful
        fixed = np.where(continued.labels[:, None] > 0, expected, colors)
    problem = ColorProblem(
        prior=np.clip(expected, 0, 1),
        neighbors=near,
        free=~known,
        band=band,
        lambda_nn=settings.lambda_nn,
    )
    solution = solve_colors(
        np.where(known[:, None], fixed, expected), problem, tolerance=settings.tolerance
    )
    base = np.where(known[:, None], colors, solution.colors)
    if canvas is not None and continued is not None:
        if canvas.gloved:
            base[hidden] = canvas.hands
        bare = on_parts(canvas.parts, *HEAD, *(() if canvas.gloved else HANDS))
        told = known | lent
        hat, outer = continued.patterned, known & ~mouth
        base = even_tones(base, outer, told, labels=continued.labels, bare=bare, patterned=hat)
        base = combed(base, known, canvas, continued.labels, mouth)
    final = np.clip(base if continued is None else base + continued.on_vertices(), 0, 1)
    report(2, 4)

    mesh = dataclasses.replace(mesh, colors=np.clip(base, 0, 1))
    uv, texture = (
        bake(mesh, photo, paint, continued, atlas.result(), others)
        if atlas is not None
        else (None, None)
    )
    report(4, 4)
    provenance = dict(surface.provenance) | {"eq14": _report(solution, ~known, band, settings)}
    if continued is not None:
        provenance["synthesis"] = dict(continued.report())
    if others:
        provenance["exposures"] = [
            [round(float(value), 3) for value in other.gain] for other in others
        ]
    return dataclasses.replace(
        surface,
        colors=final.astype(np.float32),
        uv=uv,
        texture=texture,
        visible=seen,
        provenance=provenance,
    )


def _expected(
    photo: PhotoProjection,
    mesh: ColoredMesh,
    *,
    known: BoolArray,
    prior: FloatArray | None,
    head: BoolArray | None,
) -> tuple[FloatArray, FloatArray]:
    """Expected colors (V, 3) of the unseen side, and the distance (V,), meters, of each vertex from
    the nearest `known` (V,) one."""
    expected = mirrored_prior(
        mesh, known=known, clean=photo.clean, subject=photo.subject, camera=photo.camera, head=head
    )
    reach, nearest = nearest_known(mesh.vertices, known)
    if prior is not None:
        # near visible places the photo is better than any network: its color there, or nearby
        close = np.where(
            (photo.unoccluded(mesh.vertices) & (mesh.normals[:, 2] > -0.2))[:, None],
            mesh.colors,
            mesh.colors[nearest],
        )
        expected = given_or_close(prior, close=close, otherwise=expected, reach=reach)
    return expected, reach


def _continued(
    photo: PhotoProjection, mesh: ColoredMesh, shown: _Shown, *, spots: Spots, neighbors: IntArray
) -> Continuation:
    """Continue the photo over the unseen side; the mesh has the colors of the photo at known
    vertices, and expected ones at the others."""
    pixels, known = photo.camera.project(mesh.vertices), shown.known
    face, _ = seen_face(photo.subject, pixels, mesh.colors, known=shown.main, head=_head(spots))
    outer = shown.main & ~shown.mouth
    _, skin = seen_face(photo.subject, pixels, mesh.colors, known=outer, head=_head(spots))
    if skin is None or not skin_like(skin):  # the back of a head, or hair over the cheeks
        hands = skin_of_hands(mesh.colors[known & on_parts(spots.parts, *HANDS)])
        skin = skin if hands is None else hands
    # at grazing angles colors are mixed with those of the background and of what is in front
    square = known & (shown.trust > 0.9)
    seen = Seen(
        vertices=mesh.vertices,
        colors=mesh.colors,
        known=known,
        parts=spots.parts,
        front=seen_before(pixels, outer, spots.parts),
        twin=find_twins(spots, known=known, clear=square, neighbors=neighbors),
        scalp=spots.scalp,
        bare=spots.bare if photo.canvas is None else spots.bare | bare_arms(photo.canvas, known),
        neighbors=neighbors,
        skin=skin,
        face=face | shown.mouth,
        rest=None if photo.canvas is None else photo.canvas.rest,
        cloth=None if photo.canvas is None else photo.canvas.loose,
        strands=None if photo.canvas is None else photo.canvas.hairy,
    )
    return continue_photo(seen, mesh.faces, mesh.normals, photo.clean, photo.camera)


def _report(
    solution: ColorSolution, free: BoolArray, band: BoolArray, settings: ColorSettings
) -> dict[str, float]:
    """The report of Eq. 14 for `provenance["eq14"]`."""
    return {
        "iterations": solution.iterations,
        "residual": solution.residual,
        "objective": solution.objective,
        "free": int(free.sum()),
        "band": int(band.sum()),
        "lambda_nn": settings.lambda_nn,
    }


def _check_given(
    count: int, prior: FloatArray | None, spots: Spots | None, settings: ColorSettings
) -> None:
    """Check that the arguments fit a surface of `count` vertices."""
    if count <= settings.neighbors:
        raise InputError(
            f"the surface has {count} vertices; expected more than {settings.neighbors}"
        )
    if prior is not None and np.shape(prior) != (count, 3):
        raise InputError(f"prior has shape {np.shape(prior)}; expected ({count}, 3)")
    if spots is not None and len(spots.parts) != count:
        raise InputError(
            f"spots has {len(spots.parts)} points; expected {count}, one for each vertex"
        )


def _head(spots: Spots | None) -> BoolArray | None:
    """Return which vertices (V,) belong to head and neck; None if the spots are not known."""
    return None if spots is None else on_parts(spots.parts, "head", "neck")


def _atlas(
    vertices: FloatArray,
    faces: IntArray,
    camera: OrthographicCamera,
    canvas: Canvas | None,
    size: int,
) -> PaddedAtlas:
    """The layout of the texture."""
    if canvas is not None:
        return padded_layout(canvas.atlas)
    return PaddedAtlas.of(make_atlas(vertices, faces, size=size, density=1.5 * camera.scale))

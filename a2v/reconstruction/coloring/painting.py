"""The state of a surface while it is being colored."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from a2v.body.parts import on_parts
from a2v.body.spots import Spots
from a2v.errors import InputError
from a2v.geometry.mesh import vertex_normals
from a2v.reconstruction.backs import BackEvidence, Continuation, Materials
from a2v.reconstruction.backs.seen import HANDS
from a2v.reconstruction.coloring.canvas import Canvas
from a2v.reconstruction.coloring.nearest import nearest_vertices
from a2v.reconstruction.coloring.other_photos import OtherPhoto
from a2v.reconstruction.coloring.projection import PhotoProjection
from a2v.reconstruction.coloring.settings import ColorSettings
from a2v.reconstruction.face.colors import FacePaint
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera, Subject, Surface


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
class HeadCover:
    """What a network says lies on head and neck.

    Attributes
    ----------
    told : (V,) bool
        Vertices of which it says so.
    covered : (V,) bool
        Those with hair, a hat or cloth instead of skin.
    """

    told: BoolArray
    covered: BoolArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Painting:
    """A surface of V vertices and F faces while it is being colored. Each step returns a new one.

    Attributes
    ----------
    surface : Surface
        In the flat frame of the photo's camera.
    settings : ColorSettings
    photo : PhotoProjection
        Its clean colors; the steps before the continuation change them.
    spots, prior : optional
        Of `ColorEvidence`.
    others : sequence of OtherPhoto
        Further photos, from `add_other_photos` on in the exposure of the main one.
    vertices, normals : (V, 3) float64
        Meters; unit.
    faces : (F, 3) int64
    neighbors : (V, N) int
        Nearest vertices at rest; from `continue_materials` on, of the same material.
    trust : (V,)
        In the main photo, from 0 to 1.
    seen : (V,) bool
        Vertices with nothing in front of them in a photo.
    known : (V,) bool
        Vertices that at least one photo shows well.
    main : (V,) bool
        Vertices that the main photo shows well.
    mouth : (V,) bool
        The inside of the mouth, which has given colors and is no evidence for the cheeks.
    colors : (V, 3)
        sRGB: of the photos at `known` vertices; from `solve` on of all.
    expected : (V, 3)
        Expected colors of the others.
    paint : FacePaint, optional
        Colors of the face that the photo does not show.
    kept : (V,), optional
        Share of the trust in the photo that is left: the photo may show hair in front of a cheek.
    head_cover : HeadCover, optional
    evidence : BackEvidence, optional
        What labels and continuation use; None: nothing is continued.
    materials : Materials, optional
    continued : Continuation, optional
    report : mapping
        For the provenance of the surface.
    uv, texture : optional
        Of `a2v.types.Surface`.
    """

    surface: Surface
    settings: ColorSettings
    photo: PhotoProjection
    spots: Spots | None
    prior: FloatArray | None
    others: Sequence[OtherPhoto]
    vertices: FloatArray
    faces: IntArray
    normals: FloatArray
    neighbors: IntArray
    trust: FloatArray
    seen: BoolArray
    known: BoolArray
    main: BoolArray
    mouth: BoolArray
    colors: FloatArray
    expected: FloatArray
    paint: FacePaint | None = None
    kept: FloatArray | None = None
    head_cover: HeadCover | None = None
    evidence: BackEvidence | None = None
    materials: Materials | None = None
    continued: Continuation | None = None
    report: Mapping[str, Any] = field(default_factory=dict)
    uv: FloatArray | None = None
    texture: np.ndarray | None = None

    @classmethod
    def of(
        cls,
        surface: Surface,
        subject: Subject,
        camera: OrthographicCamera,
        evidence: ColorEvidence,
        settings: ColorSettings,
    ) -> Painting:
        """Project the photo on a surface; see `a2v.reconstruction.color_surface`.

        Raises
        ------
        InputError
            The surface is too small, or the camera does not see it.
        """
        vertices = np.asarray(surface.vertices, np.float64)
        faces = np.asarray(surface.faces, np.int64)
        if len(vertices) <= settings.neighbors:
            raise InputError(
                f"the surface has {len(vertices)} vertices; expected more than {settings.neighbors}"
            )
        canvas, nowhere = evidence.canvas, np.zeros(len(vertices), bool)
        normals = vertex_normals(surface.vertices, faces)
        photo = PhotoProjection(surface, subject, camera, canvas)
        seen = photo.unoccluded(vertices) & (normals[:, 2] > 0)
        trust = photo.trust(vertices, normals, None if canvas is None else canvas.owners)
        known = (trust > 0.5) & seen
        if not known.any():
            raise InputError(
                "the surface is not visible to the photo's camera; "
                "do surface, camera and photo belong together?"
            )
        colors = photo.patch_colors(vertices, faces)
        apart = vertices if canvas is None else canvas.rest  # at rest nothing touches
        return cls(
            surface=surface,
            settings=settings,
            photo=photo,
            spots=evidence.spots,
            prior=evidence.prior,
            others=evidence.others,
            vertices=vertices,
            faces=faces,
            normals=normals,
            neighbors=nearest_vertices(apart, settings.neighbors),
            trust=trust,
            seen=seen,
            known=known,
            main=known,
            mouth=nowhere,
            colors=colors,
            expected=colors,
        )

    @property
    def canvas(self) -> Canvas | None:
        """The canvas of a canonical person; None for others."""
        return self.photo.canvas

    @property
    def pixels(self) -> FloatArray:
        """Places (V, 2) of the vertices in the main photo."""
        return self.photo.camera.project(self.vertices)

    @property
    def head(self) -> BoolArray | None:
        """Which vertices (V,) belong to head and neck; None if the spots are not known."""
        return None if self.spots is None else on_parts(self.spots.parts, "head", "neck")

    def on(self, *names: str) -> BoolArray:
        """Return which vertices (V,) of a canonical person lie on the parts of these names."""
        assert self.canvas is not None
        return on_parts(self.canvas.parts, *names)

    @property
    def hidden_hands(self) -> BoolArray:
        """Which vertices (V,) of a canonical person's hands no photo shows."""
        return self.on(*HANDS) & ~self.known

    def reprojected(self, clean: FloatArray) -> Painting:
        """Project the photo in other colors (H, W, 3)."""
        photo = self.photo.in_colors(clean)
        colors = photo.patch_colors(self.vertices, self.faces)
        return dataclasses.replace(self, photo=photo, colors=colors)

    def finished(self) -> Surface:
        """Return the colored surface."""
        base = self.colors
        final = base if self.continued is None else base + self.continued.on_vertices()
        exposures = [[round(float(value), 3) for value in other.gain] for other in self.others]
        report = dict(self.report) | ({"exposures": exposures} if exposures else {})
        return dataclasses.replace(
            self.surface,
            colors=np.clip(final, 0, 1).astype(np.float32),
            uv=self.uv,
            texture=self.texture,
            visible=self.seen,
            provenance=dict(self.surface.provenance) | report,
        )


class ColoringStep(Protocol):
    """A step of the coloring: a function that makes a new painting."""

    __name__: str

    def __call__(self, painting: Painting, /) -> Painting:
        """Return the painting after the step."""
        ...

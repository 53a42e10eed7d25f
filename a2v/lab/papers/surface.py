"""A person's surface from the papers' own networks and the user's checkpoints."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from a2v.body import load_body_model
from a2v.digest import Digest
from a2v.errors import InputError
from a2v.geometry.visibility import person_box, silhouette_iou
from a2v.lab.papers.body_refinement import Pixels, RefinementSettings, refine_body
from a2v.lab.papers.converted import Converted
from a2v.lab.papers.pamir_person import PamirPerson
from a2v.reconstruction.extraction import ExtractionSettings, extract_surface
from a2v.reconstruction.implicit.inputs import Frame, make_frame
from a2v.sessions import file_digest
from a2v.types import (
    Body,
    FloatArray,
    OrthographicCamera,
    Progress,
    Reconstruction,
    Subject,
    Surface,
)

OfPoints = Callable[[FloatArray], FloatArray]
MARGIN = 0.06
"""Margin in meters around the box of body and mask in which the surface is searched."""
STEEPNESS = 0.06
"""Distance in meters for an occupancy that is one half lower; see `_distance`."""


@dataclass(frozen=True)
class PapersSettings:
    """The checkpoints, and settings of the extraction of a surface.

    With `pifuhd` the shape is PIFuHD's, else that of `pifu_geometry`. With `pifu_color`, which
    needs `pifu_geometry`, unseen colors are PIFu's; without it, the front is mirrored. PaMIR cannot
    be combined with the others.

    Attributes
    ----------
    pifuhd, pifu_geometry, pifu_color, pamir_geometry, pamir_texture : str
        Files; "" for none.
    smpl : str
        SMPL's file, with which the body was fitted: PaMIR needs it.
    pamir_refine : int
        Steps in which PaMIR's field refines the pose of the body that its networks see; 0 for none.
    pixels : int
        Side of the input picture of PIFu and PIFuHD's coarse level; that of the fine level is twice
        as large.
    resolution : int
        Cells of the finest grid over the person's longer side.
    vertices : int
        Target number of vertices, at least 25,000.
    digest : str
        Required digest of the files; "" for any.
    """

    pifuhd: str = ""
    pifu_geometry: str = ""
    pifu_color: str = ""
    pamir_geometry: str = ""
    pamir_texture: str = ""
    smpl: str = ""
    pamir_refine: int = 0
    pixels: int = 512
    resolution: int = 256
    vertices: int = 36_000
    digest: str = ""

    def __post_init__(self) -> None:
        self.extraction  # noqa: B018  checks resolution and vertices
        if self.pixels < 64 or self.pixels % 32:
            raise InputError(f"pixels is {self.pixels}; expected a multiple of 32 from 64 on")
        if self.pamir_refine < 0:
            raise InputError(f"pamir_refine is {self.pamir_refine}; expected 0 or more steps")

    @property
    def extraction(self) -> ExtractionSettings:
        """The settings of `extract_surface`."""
        return ExtractionSettings(resolution=self.resolution, vertices=self.vertices, snap=0)

    def files_digest(self) -> Digest:
        """SHA-256 over the files.

        Raises
        ------
        InputError
            No file is given, one does not exist, the colors' file is given alone, or PaMIR's is
            not.
        """
        from pathlib import Path

        if not self.pifuhd and not self.pifu_geometry and not self.pamir_geometry:
            raise InputError(
                "the backend 'papers' needs --pifuhd FILE, --pifu-geometry FILE or "
                "--pamir-geometry FILE, your own checkpoints; "
                "see docs/reconstruction.md"
            )
        for color, shape in (("pifu_color", "pifu_geometry"), ("pamir_texture", "pamir_geometry")):
            if getattr(self, color) and not getattr(self, shape):
                names = [name.replace("_", "-") for name in (color, shape)]
                raise InputError(
                    f"--{names[0]} needs --{names[1]} FILE too: colors use the geometry's features"
                )
        if self.pamir_geometry and (self.pifuhd or self.pifu_geometry):
            raise InputError(
                "--pamir-geometry excludes --pifuhd and --pifu-geometry; compare the methods "
                "with --methods of a2v compare"
            )
        if self.pamir_geometry and not self.smpl:
            raise InputError(
                "--pamir-geometry also needs your SMPL file; give --fit.model SMPL.npz"
            )
        files = (
            self.pifuhd,
            self.pifu_geometry,
            self.pifu_color,
            self.pamir_geometry,
            self.pamir_texture,
            self.smpl,
        )
        for name in files:
            if name and not Path(name).is_file():
                raise InputError(f"{name} does not exist; give the checkpoint's file")
        return Digest.of(*(file_digest(Path(name)) if name else "-" for name in files))

    def pinned(self) -> PapersSettings:
        """The same settings with the digest of their files, by which results are remembered; see
        `files_digest` for the errors."""
        return dataclasses.replace(self, digest=self.files_digest())

    def reconstruct(
        self,
        subject: Subject,
        body: Body,
        camera: OrthographicCamera,
        *,
        progress: Progress | None = None,
    ) -> Reconstruction:
        """Reconstruct the person's surface with these checkpoints; see `papers_surface`."""
        shape, expected = papers_surface(subject, body, camera, settings=self, progress=progress)
        return Reconstruction(surface=shape, backend="papers", expected_colors=expected)


def papers_surface(
    subject: Subject,
    body: Body,
    camera: OrthographicCamera,
    *,
    settings: PapersSettings,
    progress: Progress | None = None,
) -> tuple[Surface, FloatArray | None]:
    """Reconstruct the person by PIFuHD or PIFu. The fitted body only gives the person's place.

    Parameters
    ----------
    subject, body, camera
        See `a2v.reconstruction.implicit_surface`.
    settings : PapersSettings
    progress : Progress, optional

    Returns
    -------
    surface : Surface
        One watertight piece.
    colors : (V, 3) float32 or None
        PIFu's colors (c^p of Eq. 14), if its checkpoint is given.

    Raises
    ------
    InputError
        A checkpoint is missing or of another network, the mask is empty, or the networks find no
        surface.
    """
    digest = settings.files_digest()
    if settings.digest not in ("", digest):
        raise InputError(
            f"the checkpoints have the digest {digest}, not {settings.digest}; they "
            "were changed meanwhile"
        )
    bounds = person_box(body.vertices, subject.mask > 0.5, camera)
    name, occupancy, colors_of = _networks(subject, body, camera, settings)
    box = np.stack([bounds[0] - MARGIN, bounds[1] + MARGIN])
    vertices, faces = extract_surface(
        lambda points: _distance(occupancy(points)),
        box,
        settings=settings.extraction,
        progress=progress,
    )
    colors = None if colors_of is None else colors_of(vertices)
    provenance = {
        "backend": "papers",
        "digest": digest,
        "geometry": name,
        "silhouette_iou": silhouette_iou(vertices, faces, camera, subject.mask),
    }
    shown = np.full((len(vertices), 3), 0.5, np.float32) if colors is None else colors
    surface = Surface(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=shown,
        provenance=provenance,
    )
    return surface, colors


def _networks(
    subject: Subject, body: Body, camera: OrthographicCamera, settings: PapersSettings
) -> tuple[str, OfPoints, OfPoints | None]:
    """Return the chosen network's name, its probability (N,) that points, meters, lie in the
    person, and colors (N, 3) of points, if available."""
    if settings.pamir_geometry:
        seen = PamirPerson(
            subject,
            body,
            camera,
            geometry=settings.pamir_geometry,
            texture=settings.pamir_texture,
            smpl=settings.smpl,
        )
        if settings.pamir_refine:
            pixels = Pixels(subject.keypoints[:, :2], subject.keypoints[:, 2], camera, seen.scale)
            chosen = RefinementSettings(iterations=settings.pamir_refine)
            model = load_body_model(settings.smpl)
            refined = refine_body(model, body, seen.field_of, pixels=pixels, settings=chosen)
            seen.field_of(refined.body.vertices)
        return "pamir", seen.occupancy, seen.colors if settings.pamir_texture else None
    place = _Placement(subject, camera, float(np.mean(body.vertices[:, 2])), settings.pixels)
    colors = partial(_colors, place, settings) if settings.pifu_color else None
    return "pifuhd" if settings.pifuhd else "pifu", _occupancy(place, settings), colors


class _Placement:
    """Position of the networks' cube [-1, 1]: the square around the person, as deep as it is wide,
    around the body's mean depth."""

    def __init__(
        self, subject: Subject, camera: OrthographicCamera, depth: float, pixels: int
    ) -> None:
        self._subject, self._camera, self._depth, self.pixels = subject, camera, depth, pixels

    def image(self, pixels: int) -> FloatArray:
        """The masked picture (1, 3, pixels, pixels) in [-1, 1], 0 outside of the person."""
        frame = self._frame(pixels)
        values = (frame.image.astype(np.float32) / 127.5 - 1) * frame.mask[..., None]
        return np.ascontiguousarray(values.transpose(2, 0, 1)[None], np.float32)

    def points(self, points: FloatArray) -> FloatArray:
        """Map points (N, 3), meters, to the cube: x right, y down, z to the camera."""
        camera = self._frame(self.pixels).camera
        places = camera.project(points) / (self.pixels / 2) - 1
        depth = (points[:, 2] - self._depth) * camera.scale / (self.pixels / 2)
        return np.asarray(np.concatenate([places, depth[:, None]], axis=1), np.float32)

    def _frame(self, pixels: int) -> Frame:
        if getattr(self, "_kept", (0, None))[0] != pixels:
            self._kept = (
                pixels,
                make_frame(self._subject.image, self._subject.mask, self._camera, pixels),
            )
        return self._kept[1]


def _occupancy(place: _Placement, settings: PapersSettings) -> OfPoints:
    """Return the probability that points, meters, lie in the person, by the chosen network."""
    if settings.pifuhd:
        network = Converted("pifuhd", settings.pifuhd, settings.pixels)
        image = {"image": place.image(settings.pixels)}
        sides = {side: network.run(side, **image) for side in ("front", "back")}
        coarse = network.run("coarse", **image, **sides)
        maps = {
            "coarse": coarse,
            "fine": network.run("fine", image=place.image(2 * settings.pixels), **sides),
        }
    else:
        network = Converted("geometry", settings.pifu_geometry, settings.pixels)
        maps = {"features": network.run("features", image=place.image(settings.pixels))}
    return lambda points: network.at(place.points(points), **maps)


def _colors(place: _Placement, settings: PapersSettings, vertices: FloatArray) -> FloatArray:
    """Return PIFu's colors (V, 3) of vertices (V, 3)."""
    image = place.image(settings.pixels)
    geometry = Converted("geometry", settings.pifu_geometry, settings.pixels).run(
        "features", image=image
    )
    network = Converted("color", settings.pifu_color, settings.pixels)
    features = np.concatenate([geometry, network.run("features", image=image)], axis=1)
    if features.shape[1] != network.features:
        raise InputError(
            f"{settings.pifu_color}: the layers for points need {network.features} features; "
            f"together with {settings.pifu_geometry} it has {features.shape[1]}: "
            "the two do not belong together"
        )
    return np.clip(network.at(place.points(vertices), features=features), 0, 1).astype(np.float32)


def _distance(occupancy: FloatArray) -> FloatArray:
    """Turn occupancy into a field for `extract_surface` that is negative inside.

    Saturated occupancies give values far from zero, so that no cell is refined for them.
    """
    return STEEPNESS * (0.5 - occupancy)

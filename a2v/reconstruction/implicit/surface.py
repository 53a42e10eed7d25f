"""The `pifu` backend: surface and colors that the networks predict from a photo."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from a2v.body import bend_fingers
from a2v.errors import InputError
from a2v.geometry.images import sample_image, trace_contours
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.visibility import person_box, silhouette_iou, visible_vertices
from a2v.reconstruction.body_prior.settings import SurfaceSettings
from a2v.reconstruction.body_prior.surface import dress
from a2v.reconstruction.extraction import ExtractionSettings, extract_surface
from a2v.reconstruction.implicit.guide_depths import moved_body
from a2v.reconstruction.implicit.inputs import mask_distance
from a2v.reconstruction.implicit.limits import BAND, ShellLimits
from a2v.reconstruction.implicit.model import ImplicitModel, ImplicitPerson
from a2v.reconstruction.relief import follow_normals
from a2v.reconstruction.remeshing import without_crossings
from a2v.types import Body, FloatArray, IntArray, OrthographicCamera, Progress, Subject, Surface

MARGIN = 0.08
"""Clothes and hair reach at most this far beyond the body and the mask, meters."""
COARSER = 0.8
"""Cell size of the grid on which the body is dressed, relative to the surface's. It is good enough
for a shell and saves a second."""
RIM = 0.004
"""Distance to the mask's contour, meters, below which the surface is not smoothed. This keeps the
silhouette."""


@dataclass(frozen=True)
class ImplicitSettings:
    """Settings of the surface from the networks' field.

    Attributes
    ----------
    weights : str
        Folder with custom ONNX files; "" for the shipped ones.
    resolution : int
        Number of cells of the finest grid over the person's longer side.
    vertices : int
        Target number of vertices, at least 25,000.
    smoothing : int
        Rounds of Taubin smoothing of the finished mesh, except at its rim; 0 for none. It removes
        faint lines at the cells of the networks' maps.
    relief : float
        Stiffness of `follow_normals`, which bends the surface to the predicted normals; 0 to leave
        it out.
    limits : bool
        Keep the surface within a shell around the dressed body (`ShellLimits`). It prevents slabs,
        and completes occluded limbs.
    threads : int
        Number of threads of onnxruntime; 0 for its default.
    digest : str
        `ImplicitModel.digest` that the files must have; "" for any.
    """

    weights: str = ""
    resolution: int = 320
    vertices: int = 36_000
    smoothing: int = 8
    relief: float = 0.03
    limits: bool = True
    threads: int = 0
    digest: str = ""

    def __post_init__(self) -> None:
        self.extraction  # noqa: B018  checks resolution and vertices
        if not (0 <= self.smoothing <= 50 and self.relief >= 0):
            raise InputError(
                f"smoothing={self.smoothing}, relief={self.relief}; expected 0 to 50 rounds, and "
                "no negative stiffness"
            )

    @property
    def extraction(self) -> ExtractionSettings:
        """The settings of `extract_surface`."""
        return ExtractionSettings(resolution=self.resolution, vertices=self.vertices)


def implicit_surface(
    subject: Subject,
    body: Body,
    camera: OrthographicCamera,
    *,
    settings: ImplicitSettings | None = None,
    progress: Progress | None = None,
) -> Surface:
    """Reconstruct the person by pixel-aligned implicit functions (Sec. 4.1 of the journal paper).

    Parameters
    ----------
    subject : Subject
    body : Body
        Fitted to the photo, in the frame of `camera`: guides the networks.
    camera : OrthographicCamera
        Of `subject.image`.
    settings : ImplicitSettings, optional
    progress : Progress, optional

    Returns
    -------
    Surface
        One watertight piece with at least 25,000 vertices; `colors` are predicted by the networks
        (c^p of Eq. 14); pass them to `color_surface` as its prior. `provenance` holds
        `silhouette_iou`.

    Raises
    ------
    InputError
        An empty mask, a body outside of the photo, or no surface found.
    """
    settings = settings or ImplicitSettings()
    model = ImplicitModel.load(settings.weights or None, threads=settings.threads)
    if settings.digest not in ("", model.digest):
        raise InputError(
            f"the reconstruction model in {model.folder} has the digest {model.digest}, not "
            f"{settings.digest}"
        )
    # The worker solves for the fingers while the networks run. Then it computes the networks at
    # the rim while the shell is built.
    with ThreadPoolExecutor(1) as beside:
        fingers = beside.submit(bend_fingers, body, subject, camera) if settings.limits else None
        person = model.see(subject, body, camera)
        low, high = person_box(body.vertices, person.frame.mask > 0.5, person.frame.camera)
        bounds = np.stack([low - MARGIN, high + MARGIN])
        rim = beside.submit(rim_levels, person, bounds)
        limits = _limits(person, subject, fingers.result(), camera, settings) if fingers else None
        levels = rim.result()
    vertices, faces = _shape(person, bounds, levels, limits, settings, progress)
    colors = person.colors(vertices, vertex_normals(vertices, faces))
    return Surface(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=np.clip(colors, 0, 1).astype(np.float32),
        provenance={
            "backend": "pifu",
            "model_digest": model.digest,
            "level": float(np.median(levels)),
            "silhouette_iou": silhouette_iou(vertices, faces, camera, subject.mask),
        },
    )


def _limits(
    person: ImplicitPerson,
    subject: Subject,
    body: Body,
    camera: OrthographicCamera,
    settings: ImplicitSettings,
) -> ShellLimits:
    """Return the shell around the dressed body, with the maps' depths and the photo's fingers."""
    placed = moved_body(person, body)
    cells = SurfaceSettings(resolution=max(200, round(COARSER * settings.resolution)))
    return ShellLimits.of(person, dress(subject, placed, camera, settings=cells, reach=BAND))


def _shape(
    person: ImplicitPerson,
    bounds: FloatArray,
    levels: FloatArray,
    limits: ShellLimits | None,
    settings: ImplicitSettings,
    progress: Progress | None,
) -> tuple[FloatArray, IntArray]:
    """Extract vertices (V, 3) and faces (F, 3) of the person's field at `levels` (H, W) within the
    mask.

    The surface is smoothed and gets the relief of the maps.
    """
    outline = mask_distance(person.frame.mask, person.frame.camera.scale)

    def field(points: FloatArray) -> FloatArray:
        pixels = person.frame.camera.project(points)
        near = person.distance(points) - sample_image(levels, pixels, linear=True)
        if limits is not None:
            near = limits.keep(points, near)
        return np.maximum(near, sample_image(outline, pixels, linear=True))

    vertices, faces = extract_surface(
        field, bounds, settings=settings.extraction, progress=progress
    )
    inside = -sample_image(outline, person.frame.camera.project(vertices), linear=True) / RIM
    inside = np.clip(inside, 0, 1)
    smooth = smooth_surface(vertices, faces, inside, settings.smoothing)
    if settings.relief:
        smooth = follow_normals(
            smooth,
            faces,
            *expected_normals(person, smooth, faces, inside),
            stiffness=settings.relief,
        )
    return without_crossings(smooth, vertices, faces), faces


def smooth_surface(
    vertices: FloatArray, faces: IntArray, share: FloatArray, rounds: int
) -> FloatArray:
    """Smooth vertices (V, 3) by Taubin smoothing, which does not shrink, weighted by `share` (V,)
    from 0 to 1."""
    if not rounds:
        return vertices
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    meshes.apply_coord_taubin_smoothing(stepsmoothnum=rounds)
    smooth: FloatArray = np.asarray(meshes.current_mesh().vertex_matrix())
    return vertices + share[:, None] * (smooth - vertices)


def expected_normals(
    person: ImplicitPerson, vertices: FloatArray, faces: IntArray, inside: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the normals (V, 3) of the vertices in the networks' maps of front and back, and their
    trust (V,), 0 to 1.

    A vertex that is visible from neither side keeps its own normal, with trust 0. `inside` (V,) is
    0 at the mask's contour.
    """
    own = vertex_normals(vertices, faces)
    maps = person.maps["maps"][0]
    pixels = person.frame.camera.project(vertices) * (maps.shape[-1] / person.frame.size)
    normals, trust = own.copy(), np.zeros(len(vertices))
    for side, channels in ((1.0, slice(0, 3)), (-1.0, slice(3, 6))):
        seen = visible_vertices(vertices * np.array([side, 1.0, side]), faces)
        told = sample_image(
            np.ascontiguousarray(maps[channels].transpose(1, 2, 0)), pixels[seen], linear=True
        )
        length = np.linalg.norm(told, axis=1)
        told = told / np.maximum(length, 1e-6)[:, None]
        agreement = (told * own[seen]).sum(axis=1)
        normals[seen] = told
        trust[seen] = inside[seen] * np.clip((agreement - 0.5) / 0.3, 0, 1) * (length > 0.3)
    normals[trust == 0] = own[trust == 0]
    return normals, trust


def rim_levels(
    person: ImplicitPerson,
    bounds: FloatArray,
    *,
    count: int = 1500,
    step: float = 0.01,
    largest: float = 0.02,
    reach: float = 0.03,
) -> FloatArray:
    """Return the level of the field at which its silhouette meets the mask's contour, per pixel of
    the frame (H, W).

    Levels are in meters, at most `largest` from 0. A network that is unsure of the depth is also
    unsure of the rim: its zero level lies some millimeters inside or outside the person. Within
    `reach` of the contour the level corrects this offset, smoothed along the contour; elsewhere it
    is the median.
    """
    from scipy.ndimage import distance_transform_edt, gaussian_filter1d

    loops = trace_contours(person.frame.mask)
    every = max(1, sum(len(loop) for loop in loops) // count)
    loops = [loop[::every] for loop in loops]
    depths = np.arange(bounds[0, 2], bounds[1, 2], step)
    chosen = np.concatenate(loops)
    points = person.frame.camera.unproject(
        np.repeat(chosen, len(depths), axis=0), np.tile(depths, len(chosen))
    )
    missing = np.clip(
        person.distance(points.astype(np.float32)).reshape(len(chosen), -1).min(axis=1),
        -largest,
        largest,
    )
    everywhere = float(np.median(missing))
    smooth = [
        gaussian_filter1d(part, 2.0, mode="wrap")
        for part in np.split(missing, np.cumsum([len(loop) for loop in loops])[:-1])
    ]
    height, width = person.frame.mask.shape
    columns, rows = (
        np.clip(chosen[:, axis].astype(int), 0, size - 1)
        for axis, size in ((0, width), (1, height))
    )
    rim = np.full((height, width), np.nan, np.float32)
    rim[rows, columns] = np.concatenate(smooth)
    away, (row, column) = distance_transform_edt(np.isnan(rim), return_indices=True)
    share = np.exp(-((away / person.frame.camera.scale / reach) ** 2))
    levels: FloatArray = (everywhere + share * (rim[row, column] - everywhere)).astype(np.float32)
    return levels

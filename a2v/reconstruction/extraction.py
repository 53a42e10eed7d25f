"""A closed, even mesh from a signed distance field: coarse-to-fine evaluation, marching cubes and
clean-up.

All backends use it. The field is evaluated only near its surface (as in an octree, on nested
regular grids). Distant points keep the sign of the coarser level, so the result equals that of a
dense evaluation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.geometry.mesh import keep_pieces, signed_volumes, vertex_normals
from a2v.geometry.volume import Grid
from a2v.reconstruction.remeshing import LEAST_VERTICES, even_out, without_crossings
from a2v.types import BoolArray, FloatArray, IntArray, Progress

Field = Callable[[FloatArray], FloatArray]
"""``points (N, 3) float32, meters -> (N,)``: signed distance, meters, negative inside; it may be
cut off far from the surface."""


@dataclass(frozen=True)
class ExtractionSettings:
    """Settings of the extraction of a mesh.

    Attributes
    ----------
    resolution : int
        Cells of the finest grid over the longer side of the bounds, 200 to 640; 256 gives about 7
        mm for a person.
    vertices : int
        Vertices to aim at, at least 25,000.
    slack : float
        A cell is refined if a corner is nearer to the surface than `slack` times half the cell's
        diagonal. 1 is right for a true distance; a learned field that overstates distances needs
        more. The field must not be cut off below that of the coarsest cell.
    pieces : float
        Pieces with less than this share of the largest one's volume are dropped; 1 keeps the
        largest alone.
    smoothing : int
        Rounds of Taubin smoothing, which does not shrink; 0 for none.
    snap : int
        Rounds in which the vertices of the finished mesh are moved to the zero level by the field
        itself: fingers are thinner than two cells, and a grid makes them thinner still. Each takes
        `vertices` more evaluations.
    chunk : int
        Points a call of the field gets at most.
    """

    resolution: int = 256
    vertices: int = 36_000
    slack: float = 1.1
    pieces: float = 1.0
    smoothing: int = 4
    snap: int = 2
    chunk: int = 65_536

    def __post_init__(self) -> None:
        if not 200 <= self.resolution <= 640:
            raise InputError(f"resolution is {self.resolution}; expected 200 to 640 cells")
        if not LEAST_VERTICES <= self.vertices <= 200_000:
            raise InputError(f"vertices is {self.vertices}; expected {LEAST_VERTICES} to 200000")
        if not 0.5 <= self.slack <= 4:
            raise InputError(f"slack is {self.slack}; expected 0.5 to 4")
        if not 0 < self.pieces <= 1:
            raise InputError(
                f"pieces is {self.pieces}; expected a share of the largest piece's volume, above 0 "
                "and at most 1"
            )
        if not (0 <= self.smoothing <= 50 and 0 <= self.snap <= 10 and self.chunk >= 1):
            raise InputError(
                f"smoothing={self.smoothing}, snap={self.snap}, chunk={self.chunk}; expected 0 to "
                "50, 0 to 10, and at least 1"
            )

    @property
    def levels(self) -> int:
        """Number of times that the coarsest grid, of 48 to 95 cells, is halved."""
        return int(np.log2(self.resolution / 48))


@dataclass(frozen=True)
class SampledField:
    """A field on a regular grid.

    Attributes
    ----------
    values : (nx, ny, nz) float32
        Meters, negative inside. They are exact at every corner of a cell that the surface crosses,
        and elsewhere have the right sign.
    grid : Grid
    evaluations : int
        Number of evaluated points; a dense evaluation takes ``values.size``.
    """

    values: FloatArray
    grid: Grid
    evaluations: int


def extract_surface(
    field: Field,
    bounds: FloatArray,
    *,
    settings: ExtractionSettings | None = None,
    progress: Progress | None = None,
) -> tuple[FloatArray, IntArray]:
    """Extract the zero level of a field as a closed mesh: `sample_field`, `mesh_grid`, then
    `snap_to_level`.

    Parameters
    ----------
    field : Field
    bounds : (2, 3)
        Least and largest corners of the box to search, meters. A surface that leaves the box is
        closed at its border.
    settings : ExtractionSettings, optional
    progress : Progress, optional

    Returns
    -------
    vertices : (V, 3) float64, meters
    faces : (F, 3) int64, counter-clockwise seen from outside. Watertight, one piece unless `pieces`
    allows more.

    Raises
    ------
    InputError
        The bounds are not a box, the field is not finite, or it has no surface in the box.
    """
    settings = settings or ExtractionSettings()
    total = settings.levels + 2
    sampled = sample_field(
        field,
        bounds,
        settings=settings,
        progress=None if progress is None else lambda done, _: progress(done, total),
    )
    vertices, faces = mesh_grid(
        sampled.values,
        sampled.grid,
        settings.vertices,
        pieces=settings.pieces,
        smoothing=settings.smoothing,
    )
    vertices = snap_to_level(
        vertices, faces, field, 0.5 * sampled.grid.cell, rounds=settings.snap, chunk=settings.chunk
    )
    if progress is not None:
        progress(total, total)
    return vertices, faces


def sample_field(
    field: Field,
    bounds: FloatArray,
    *,
    settings: ExtractionSettings | None = None,
    progress: Progress | None = None,
) -> SampledField:
    """Evaluate a field from coarse to fine, only near its surface.

    A cell is refined if its corners differ in sign. On all but the finest level it is also refined
    if a corner is so near to the surface that the surface could cross the cell unnoticed
    (`ExtractionSettings.slack`). If the surface leads into a cell that was not evaluated, this cell
    is evaluated, too. So thin parts are followed, and fields that are not true distances work.

    For parameters and errors see `extract_surface`.
    """
    settings = settings or ExtractionSettings()
    box = np.asarray(bounds, np.float64)
    if box.shape != (2, 3) or not np.isfinite(box).all() or not (box[1] > box[0]).all():
        raise InputError(
            f"bounds are {np.array2string(box, separator=', ')}; expected the least and the "
            "largest corner of a box, meters"
        )
    levels = settings.levels
    cell = float((box[1] - box[0]).max()) / settings.resolution
    step = cell * 2**levels
    # one coarse cell more on every side, so that the surface closes within the grid
    cells = np.ceil((box[1] - box[0]) / step - 1e-9).astype(np.int64) + 2
    origin = box.mean(axis=0) - 0.5 * step * cells
    values = np.zeros(cells + 1, np.float32)
    known = np.zeros(values.shape, bool)
    evaluations = 0
    for level in range(levels + 1):
        if level:
            # at the finest level only cells that the surface crosses: the others are reached from
            # these
            near = (
                _crossed(values)
                if level == levels
                else _near_cells(values, settings.slack * 0.5 * np.sqrt(3.0) * step)
            )
            step /= 2
            values, known = _halved(values), _halved_known(known)
            wanted = np.repeat(np.repeat(np.repeat(near, 2, 0), 2, 1), 2, 2)
            nodes = _nodes_of(wanted) & ~known
        else:
            nodes = np.ones(values.shape, bool)
        while nodes.any():
            evaluations += int(nodes.sum())
            values[nodes] = _evaluate(field, origin + step * np.argwhere(nodes), settings.chunk)
            known |= nodes
            nodes = _nodes_of(_crossed(values)) & ~known
        if progress is not None:
            progress(level + 1, levels + 1)
    outermost = np.ones(values.shape, bool)
    outermost[1:-1, 1:-1, 1:-1] = False
    values[outermost] = np.maximum(values[outermost], np.float32(0.5 * cell))
    shape = values.shape
    return SampledField(values, Grid(origin, cell, (shape[0], shape[1], shape[2])), evaluations)


def _evaluate(field: Field, points: FloatArray, chunk: int) -> FloatArray:
    """Return values (N,) float32 at points (N, 3)."""
    out = np.empty(len(points), np.float32)
    for start in range(0, len(points), chunk):
        part = points[start : start + chunk].astype(np.float32)
        found = np.asarray(field(part))
        if found.shape != (len(part),):
            raise InputError(
                f"the field returned shape {found.shape} for {len(part)} points; expected "
                f"({len(part)},)"
            )
        out[start : start + chunk] = found
    if not np.isfinite(out).all():
        raise InputError(
            "the field is NaN or infinite at some points; expected signed distances in meters"
        )
    return out


def _corners(nodes: np.ndarray) -> list[np.ndarray]:
    """The eight views of a node array (n + 1) that are the corners of its cells (n)."""
    low, high = slice(None, -1), slice(1, None)
    return [nodes[x, y, z] for x in (low, high) for y in (low, high) for z in (low, high)]


def _crossed(values: FloatArray) -> BoolArray:
    """Return which cells have corners of both signs."""
    inside = _corners(values < 0)
    return np.asarray(np.logical_or.reduce(inside) & ~np.logical_and.reduce(inside))


def _near_cells(values: FloatArray, reach: float) -> BoolArray:
    """Return which cells the surface may cross: those with corners of both signs, or with one
    nearer than `reach` meters."""
    return np.asarray(_crossed(values) | np.logical_or.reduce(_corners(np.abs(values) < reach)))


def _nodes_of(cells: BoolArray) -> BoolArray:
    """Return which nodes (n + 1) are corners of marked cells (n)."""
    nodes = np.zeros(tuple(size + 1 for size in cells.shape), bool)
    for corner in _corners(nodes):
        corner |= cells
    return nodes


def _halved(values: FloatArray) -> FloatArray:
    """Return values on a grid of half the spacing: the old nodes, and trilinear means between them,
    which keep their sign."""
    for axis in range(3):
        ahead = np.moveaxis(values, axis, 0)
        fine = np.empty((2 * len(ahead) - 1, *ahead.shape[1:]), np.float32)
        fine[::2] = ahead
        fine[1::2] = 0.5 * (ahead[:-1] + ahead[1:])
        values = np.moveaxis(fine, 0, axis)
    return np.ascontiguousarray(values)


def _halved_known(known: BoolArray) -> BoolArray:
    fine = np.zeros(tuple(2 * size - 1 for size in known.shape), bool)
    fine[::2, ::2, ::2] = known
    return fine


def mesh_grid(
    values: FloatArray, grid: Grid, vertices: int, *, pieces: float = 1.0, smoothing: int = 4
) -> tuple[FloatArray, IntArray]:
    """Extract the zero level of sampled values as a closed mesh with even triangles.

    Parameters
    ----------
    values : (nx, ny, nz)
        Meters, negative inside; not negative on the outermost nodes.
    grid : Grid
    vertices : int
        Target number of vertices, met within some percent; at least 25,000.
    pieces, smoothing
        As in `ExtractionSettings`.

    Returns
    -------
    vertices : (V, 3) float64, meters; faces : (F, 3) int64
        Watertight, facing outward. Only the largest piece and other large pieces are kept.
        Bubbles are filled.

    Raises
    ------
    InputError
        No value is negative.
    """
    from skimage.measure import marching_cubes

    limit = np.float32(0.02 * grid.cell)  # a vertex on a node would make triangles of zero area
    kept = np.asarray(values, np.float32)
    kept = np.where(np.abs(kept) < limit, np.where(kept < 0, -limit, limit), kept)
    if not (kept < 0).any():
        raise InputError(
            "the field has no surface in the bounds: it is positive everywhere; do field, bounds "
            "and photo belong together?"
        )
    points, faces, _, _ = marching_cubes(kept, 0.0, gradient_direction="ascent")
    points, faces = grid.origin + points.astype(np.float64) * grid.cell, faces.astype(np.int64)
    if signed_volumes(points, faces, np.zeros(len(faces), np.int64))[0] < 0:
        faces = faces[:, ::-1]
    return even_out(*keep_pieces(points, faces, pieces), vertices, smoothing=smoothing)


def snap_to_level(
    vertices: FloatArray,
    faces: IntArray,
    field: Field,
    reach: float,
    *,
    rounds: int = 2,
    chunk: int = 65_536,
) -> FloatArray:
    """Move vertices (V, 3) along their normals by the field's value, at most `reach` meters per
    round.

    Vertices whose faces would cross others stay.
    """
    placed = np.asarray(vertices, np.float64)
    for _ in range(rounds):
        placed = placed - np.clip(_evaluate(field, placed, chunk), -reach, reach)[
            :, None
        ] * vertex_normals(placed, faces)
    return without_crossings(placed, vertices, faces)

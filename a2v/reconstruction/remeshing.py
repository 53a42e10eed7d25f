"""Even triangles for a closed mesh, and removal of self-intersections (pymeshlab)."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.errors import A2VError
from a2v.geometry.mesh import is_closed, keep_pieces, piece_of_faces
from a2v.types import BoolArray, FloatArray, IntArray

LEAST_VERTICES = 25_000
"""Smallest number of vertices of a person's surface. With fewer, hands and faces would
disappear."""
_SPARE = 1.02
"""Smallest target relative to `LEAST_VERTICES`: cutting out self-intersections takes a few vertices
away, and a surface with fewer than the least is subdivided to four times as many."""


def even_out(
    vertices: FloatArray, faces: IntArray, target: int, *, smoothing: int = 4
) -> tuple[FloatArray, IntArray]:
    """Remesh a closed mesh to about `target` vertices in even triangles.

    The steps are decimation by quadrics, flips and tangential smoothing. Small surfaces are
    subdivided (Loop) first.

    Parameters
    ----------
    vertices : (V, 3) meters, faces : (F, 3)
        Closed and facing outward, for example from marching cubes.
    target : int
    smoothing : int
        Rounds of Taubin smoothing before the decimation; half as many follow it.

    Returns
    -------
    vertices, faces
        Closed, with the same number of pieces, and free of self-intersections if they can be cut
        out and patched.

    Raises
    ------
    A2VError
        No step of the clean-up leaves a closed mesh (not seen yet).
    """
    import pymeshlab
    import trimesh

    meshes: Any = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    if not is_closed(
        vertices, faces
    ):  # in ambiguous cells marching cubes may leave a hole (seen once in 60 grids of white noise)
        _close(meshes)
        vertices, faces = keep_pieces(*_current(meshes))
        meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    pieces = _count_pieces(vertices, faces)
    target = max(target, round(_SPARE * LEAST_VERTICES))
    states = [(np.asarray(vertices), np.asarray(faces)), *_clean_up(meshes, target, smoothing)]
    if pieces == 1:
        states[-1] = keep_pieces(*states[-1])  # remove the pieces that were cut off
    for found in reversed(states):
        if is_closed(*found) and _count_pieces(*found) == pieces:
            while len(found[0]) < LEAST_VERTICES:
                found = trimesh.remesh.subdivide(*found)
            return found[0], found[1]
    raise A2VError(
        f"no closed mesh of {pieces} pieces is left after the clean-up; give another resolution"
    )


def _clean_up(meshes: Any, target: int, smoothing: int) -> list[tuple[FloatArray, IntArray]]:
    """Smooth, decimate to `target` vertices, even out and untangle pymeshlab's current mesh;
    returns the mesh after each step."""
    import pymeshlab

    def smooth(rounds: int) -> None:
        if rounds:
            meshes.apply_coord_taubin_smoothing(stepsmoothnum=rounds)

    smooth(smoothing)
    states = [_current(meshes)]
    while meshes.current_mesh().vertex_number() < 1.05 * target:
        meshes.meshing_surface_subdivision_loop(
            iterations=1, threshold=pymeshlab.PercentageValue(0)
        )
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=2 * target,
        preservetopology=True,
        preservenormal=True,
        qualitythr=0.5,
        planarquadric=True,
        optimalplacement=True,
    )
    states.append(_current(meshes))
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=2, splitflag=False, collapseflag=False, featuredeg=60.0, checksurfdist=False
    )
    smooth(smoothing // 2)
    meshes.meshing_remove_unreferenced_vertices()
    states.append(_current(meshes))
    _cut_self_intersections(meshes)
    return [*states, _current(meshes)]


def _current(meshes: Any) -> tuple[FloatArray, IntArray]:
    """Vertices (V, 3) float64 and faces (F, 3) int64 of pymeshlab's current mesh."""
    mesh = meshes.current_mesh()
    return np.asarray(mesh.vertex_matrix()), np.asarray(mesh.face_matrix(), np.int64)


def _count_pieces(vertices: FloatArray, faces: IntArray) -> int:
    return int(piece_of_faces(len(vertices), faces).max()) + 1


def without_crossings(placed: FloatArray, vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the moved vertices `placed` (V, 3), with vertices (V, 3) of crossing faces moved
    back."""
    placed = placed.copy()
    for _ in range(8):
        crossing = self_intersections(placed, faces)
        if not crossing.any():
            return placed
        stay = np.zeros(len(placed), bool)
        stay[faces[crossing]] = True
        stay[faces[stay[faces].any(axis=1)]] = True  # and the ring around them
        placed[stay] = vertices[stay]
    return np.asarray(vertices, np.float64)


def self_intersections(vertices: FloatArray, faces: IntArray) -> BoolArray:
    """Return whether each face (F,) intersects a face that is not its neighbor."""
    import pymeshlab

    meshes: Any = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    meshes.compute_selection_by_self_intersections_per_face()
    return np.asarray(meshes.current_mesh().face_selection_array(), bool)


def _cut_self_intersections(meshes: Any, rounds: int = 4) -> None:
    """Delete intersecting faces with a growing ring around them, and close the holes."""
    for turn in range(rounds):
        meshes.compute_selection_by_self_intersections_per_face()
        if meshes.current_mesh().selected_face_number() == 0:
            return
        for _ in range(turn + 1):
            meshes.apply_selection_dilatation()
        meshes.meshing_remove_selected_vertices_and_faces()
        _close(meshes)


def _close(meshes: Any) -> None:
    meshes.meshing_repair_non_manifold_edges()
    meshes.meshing_repair_non_manifold_vertices()
    meshes.meshing_close_holes(maxholesize=300, newfaceselected=False)
    meshes.meshing_remove_unreferenced_vertices()

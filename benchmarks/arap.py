"""Measure Eq. 20: speed compared with Open3D's ARAP, distortion compared with skinning.

python -m benchmarks.arap [--vertices 30000] [--out table.md]

The table also has the control points alone. Times are CPU seconds of all threads, so that other
work on the machine does not count; set OMP_NUM_THREADS=1. The clips are DeepMimic's in
``$A2V_DATA/motions`` (default ``../shared/data``).
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from a2v.animation import ArapDeformer, bind, control_points, deform, retarget
from a2v.animation.arap import ArapResult, ArapSolver
from a2v.body import load_body_model, make_body
from a2v.formats import read_motion
from a2v.geometry.mesh import vertex_normals
from a2v.io import atomic_path
from a2v.types import Body, Character, FloatArray, IntArray, Surface

MOTIONS = ("cartwheel", "kick", "dance_a")
FRAMES_EACH = 6


def clothed(body: Body, vertices: int) -> Surface:
    """Return a closed skin 8 mm over the body, remeshed evenly to about `vertices` vertices."""
    import pymeshlab

    points = body.vertices.astype(np.float64)
    points += 0.008 * vertex_normals(points, body.faces.astype(np.int64))
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, body.faces))
    meshes.generate_surface_reconstruction_screened_poisson(depth=8, preclean=True)
    area = meshes.get_geometric_measures()["surface_area"]
    edge = np.sqrt(2 * area / vertices / np.sqrt(3)) * 1.03
    meshes.meshing_isotropic_explicit_remeshing(
        targetlen=pymeshlab.PureValue(float(edge)), iterations=4
    )
    meshes.meshing_remove_connected_component_by_face_number(mincomponentsize=5000)
    meshes.meshing_repair_non_manifold_edges()
    meshes.meshing_remove_unreferenced_vertices()
    mesh = meshes.current_mesh()
    points = mesh.vertex_matrix().astype(np.float32)
    return Surface(
        vertices=points, faces=mesh.face_matrix().astype(np.int32), colors=np.full_like(points, 0.5)
    )


def distortion(vertices: FloatArray, rest: FloatArray, faces: IntArray) -> tuple[float, float]:
    """Mean |log area ratio| and mean |log edge-length ratio| over faces and edges."""

    def areas(points: FloatArray) -> FloatArray:
        corners = points[faces].astype(np.float64)
        return np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )  # type: ignore[no-any-return]

    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    now, before = (
        np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (vertices, rest)
    )
    ratio = np.maximum(areas(vertices), 1e-12) / np.maximum(areas(rest), 1e-12)
    return float(np.abs(np.log(ratio)).mean()), float(
        np.abs(np.log(np.maximum(now, 1e-9) / np.maximum(before, 1e-9))).mean()
    )


def poses(body: Body, data: Path) -> list[FloatArray]:
    """Return the bone transforms (B, 4, 4) of frames distributed over the motions."""
    out: list[FloatArray] = []
    for name in MOTIONS:
        transforms = retarget(
            read_motion(data / "motions" / f"humanoid3d_{name}.txt", fps=20), body
        )
        out += [transforms[t] for t in np.linspace(2, len(transforms) - 1, FRAMES_EACH).astype(int)]
    return out


def open3d_seconds(character: Character, targets: FloatArray, iterations: int) -> float:
    """Return the CPU seconds of a solve of Open3D with every tenth vertex as a hard constraint."""
    import open3d

    surface = character.surface
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(surface.vertices.astype(np.float64)),
        open3d.utility.Vector3iVector(surface.faces),
    )
    ids = np.arange(0, len(surface.vertices), 10)
    start = time.process_time()
    mesh.deform_as_rigid_as_possible(
        open3d.utility.IntVector(ids.tolist()),
        open3d.utility.Vector3dVector(targets[ids]),
        max_iter=iterations,
    )
    return time.process_time() - start


def main() -> int:
    """Run and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--vertices", type=int, default=30_000)
    parser.add_argument("--out", type=Path, default=None, help="also write the table there")
    options = parser.parse_args()
    data = Path(os.environ.get("A2V_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    model = load_body_model()
    turns = np.zeros((model.n_bones, 3), np.float32)
    turns[model.bone("upperarm01.L"), 2], turns[model.bone("upperarm01.R"), 2] = -0.4, 0.4
    body = make_body(model, turns, grounded=True)
    surface = clothed(body, options.vertices)

    def timed(work: Callable[[], object]) -> tuple[object, float]:
        start = time.process_time()
        return work(), time.process_time() - start

    character, bind_seconds = timed(lambda: bind(surface, body))
    assert isinstance(character, Character)
    deformer, factor_seconds = timed(lambda: ArapDeformer(character))
    assert isinstance(deformer, ArapDeformer)
    rows: dict[str, list[tuple[float, float, float]]] = {
        "skinning": [],
        "control points alone": [],
        "ARAP (Eq. 20)": [],
    }
    iterations: list[int] = []
    falls: list[float] = []
    frames = poses(body, data)
    works: dict[str, Callable[[FloatArray], FloatArray]] = {
        "skinning": lambda p: deform(character, p),
        "control points alone": lambda p: control_points(character, p),
        "ARAP (Eq. 20)": lambda p: record(deformer.solve(p)),
    }

    def record(result: ArapResult) -> FloatArray:
        iterations.append(result.iterations)
        falls.append(result.energies[-1] / result.energies[0])
        return result.vertices

    for name, work in works.items():
        work(frames[0])  # warm-up
        posed = [timed(lambda pose=pose, work=work: work(pose)) for pose in frames]
        rows[name] = [
            (*distortion(np.asarray(v), surface.vertices, surface.faces), seconds)
            for v, seconds in posed
        ]
    targets = control_points(character, frames[3])
    count = int(np.median(iterations))
    theirs = min(open3d_seconds(character, targets, count) for _ in range(3))
    hard = np.zeros(len(surface.vertices))
    hard[::10] = 1e6
    solver = ArapSolver(surface.vertices, surface.faces.astype(np.int64), hard)
    same = min(
        timed(lambda: solver.solve(targets, start=targets, iterations=count, tolerance=-1.0))[1]
        for _ in range(3)
    )
    lines = [
        f"{len(surface.vertices):,} vertices, {len(surface.faces):,} faces, {len(frames)} frames "
        f"of {', '.join(MOTIONS)}; "
        f"bind {bind_seconds:.1f} s, factor {factor_seconds:.2f} s (once a character); median "
        f"{count} iterations, "
        f"energy {np.mean(falls):.2f} of the first iteration's",
        "",
        "| method | area distortion | edge-length error | CPU seconds a frame |",
        "|---|---|---|---|",
    ]
    for name, values in rows.items():
        area, edge, seconds = np.mean(values, axis=0)
        lines.append(f"| {name} | {100 * area:.2f} % | {100 * edge:.2f} % | {seconds:.3f} |")
    own = float(np.mean([row[2] for row in rows["ARAP (Eq. 20)"]]))
    lines += [
        "",
        f"Open3D's deform_as_rigid_as_possible, the same mesh, every tenth vertex fixed, {count} "
        f"iterations: {theirs:.2f} CPU s a frame; ours with the "
        f"same constraints and iterations {same:.3f} s ({theirs / same:.0f} times faster), Eq. 20 "
        f"as a whole {theirs / own:.0f} times faster.",
    ]
    table = "\n".join(lines)
    print(table)
    if options.out is not None:
        with atomic_path(options.out) as temporary:
            temporary.write_text(table + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

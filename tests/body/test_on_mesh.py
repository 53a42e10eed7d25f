"""Our body fitted to meshes without bones, and their skins."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v import Body, InputError
from a2v.body import load_body_model, make_body
from a2v.body.on_mesh import HEIGHT, fit_mesh
from a2v.formats.gltf.document import Document
from a2v.formats.gltf.mesh import add_mesh
from a2v.formats.gltf.people import read_person
from a2v.geometry.mesh import vertex_normals
from a2v.kinematics.names import REQUIRED, canonical_joints
from a2v.types import FloatArray, Surface
from pipelines.mesh_rig import rig_mesh
from tests.support.glb import validate

UNIT = 100.0
"""Units of the mesh per meter."""
PLACE = np.array([250.0, -40.0, 30.0])


def person(arms: float) -> Body:
    """Somebody else than the model's default, with the arms raised by an angle in degrees."""
    model = load_body_model()
    rotations = np.zeros((model.n_bones, 3), np.float32)
    rotations[model.bone("upperarm01.L"), 2] = np.deg2rad(arms)
    rotations[model.bone("upperarm01.R"), 2] = -np.deg2rad(arms)
    rng = np.random.default_rng(3)
    low, high = model.shape_bounds.T
    shape = model.shape_default + 0.15 * (high - low) * rng.normal(size=len(low))
    return make_body(model, rotations, np.clip(shape, low, high).astype(np.float32), grounded=True)


def dressed(body: Body) -> FloatArray:
    """The skin under clothes of a centimeter, in the units of a mesh, turned to the back."""
    normals = vertex_normals(body.vertices, body.faces)
    skin = body.vertices.astype(np.float64) + 0.01 * normals
    return UNIT * skin * (-1, 1, -1) + PLACE


@pytest.mark.parametrize("arms", [0.0, 40.0], ids=["A", "T"])
def test_joints_of_a_mesh_are_found(arms: float) -> None:
    body = person(arms)
    fit = fit_mesh(load_body_model(), dressed(body))
    tall = float(np.ptp(body.vertices[:, 1]))
    assert fit.unit == pytest.approx(HEIGHT / (UNIT * tall), rel=0.05)
    bones = canonical_joints(body.bone_names, body.bone_parents.tolist())
    heads = UNIT * body.bone_transforms[:, :3, 3].astype(np.float64) * (-1, 1, -1) + PLACE
    wanted = fit.unit * (heads @ fit.turn.T) + fit.shift
    found = fit.body.bone_transforms[:, :3, 3]
    errors = {
        name: float(np.linalg.norm(found[bones[name]] - wanted[bones[name]])) for name in REQUIRED
    }
    assert max(errors.values()) < 0.06, errors
    assert np.mean([*errors.values()]) < 0.025


@pytest.mark.parametrize("kind", ["ball", "box", "crouch", "flat"])
def test_what_is_no_person_in_t_or_a_pose_is_refused(kind: str) -> None:
    rng = np.random.default_rng(0)
    if kind == "ball":
        points = rng.normal(size=(3000, 3))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    elif kind == "box":
        points = rng.uniform(-1, 1, (3000, 3)) * (0.3, 1, 0.3)
    elif kind == "flat":
        points = np.zeros((300, 3))
    else:
        model = load_body_model()
        rotations = np.zeros((model.n_bones, 3), np.float32)
        for side in "LR":
            rotations[model.bone(f"upperleg01.{side}"), 0] = -1.9
            rotations[model.bone(f"lowerleg01.{side}"), 0] = 2.2
        points = make_body(model, rotations).vertices.astype(np.float64)
    with pytest.raises(InputError, match=r"does not fit the mesh|no height"):
        fit_mesh(load_body_model(), points)


def test_a_mesh_gets_bones_and_keeps_its_place(tmp_path: Path, validator: Path) -> None:
    body = person(0.0)
    document = Document("mesh")
    colors = np.full(body.vertices.shape, 0.5, np.float32)
    surface = Surface(vertices=body.vertices, faces=body.faces, colors=colors)
    (mesh,) = add_mesh(document, surface, "mesh", 92)
    node = document.node(name="mesh", mesh=mesh, scale=[2, 2, 2], translation=[1, 0, 0])
    document.json["scenes"][0]["nodes"] = [node]
    document.write(tmp_path / "mesh.glb")
    rig_mesh(tmp_path / "mesh.glb", tmp_path / "rigged.glb", name=Path("mesh.glb"))
    report = validate(tmp_path / "rigged.glb", validator)
    assert report["errors"] == 0, report["messages"]
    made = read_person(tmp_path / "rigged.glb")
    assert set(made.body.bone_names) == set(body.bone_names)
    middle = np.median(made.body.vertices, axis=0)
    assert middle[0] == pytest.approx(1.0, abs=0.02)
    assert float(np.ptp(made.body.vertices[:, 1])) == pytest.approx(
        2 * float(np.ptp(body.vertices[:, 1])), rel=1e-4
    )
    np.testing.assert_allclose(made.body.weights.sum(axis=1), 1, atol=1e-5)

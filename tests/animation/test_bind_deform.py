from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from a2v import Body, Character, InputError, Surface
from a2v.animation import ArapDeformer, DeformSettings, bind, control_points, deform, retarget
from a2v.animation.arap import ArapSolver
from a2v.body import PARTS, load_body_model, make_body
from a2v.formats import read_motion
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.polar import nearest_rotations, rotations_of
from a2v.kinematics import rotvec_to_rotmat


@pytest.fixture(scope="module")
def pose(character: Character, cartwheel: Path) -> np.ndarray:
    """The cartwheel upside down, (B, 4, 4)."""
    return retarget(read_motion(cartwheel, fps=20), character.body)[25]


def rigid(transforms: np.ndarray, rotvec: np.ndarray, shift: np.ndarray) -> np.ndarray:
    move = np.eye(4)
    move[:3, :3], move[:3, 3] = rotvec_to_rotmat(rotvec), shift
    return move @ transforms


# ---- binding


def test_skin_binds_to_its_own_body(character: Character) -> None:
    body = character.body
    own = np.arange(len(body.vertices))
    gap = np.linalg.norm(body.vertices[character.anchors] - body.vertices[own], axis=1)
    assert np.quantile(gap, 0.95) < 0.012
    assert (character.parts == body.parts).mean() > 0.97
    np.testing.assert_allclose(character.weights.sum(1), 1, atol=1e-6)
    assert (np.diff(character.weights, axis=1) <= 1e-7).all()
    dense = np.zeros_like(body.weights)
    np.put_along_axis(dense, character.bones.astype(np.int64), character.weights, axis=1)
    assert np.abs(dense - body.weights).sum(1).mean() < 0.35


@pytest.fixture(scope="module")
def touching() -> Body:
    """Arms hang down and touch the thighs and the trunk."""
    model = load_body_model()
    turns = np.zeros((model.n_bones, 3), np.float32)
    turns[model.bone("upperarm01.L"), 2], turns[model.bone("upperarm01.R"), 2] = -0.62, 0.62
    return make_body(model, turns, grounded=True)


def test_arms_that_touch_the_torso_do_not_bind_to_it(touching: Body) -> None:
    body = touching
    arm = np.isin(
        body.parts,
        [PARTS.index(n) for n in ("left_lower_arm", "left_hand", "right_lower_arm", "right_hand")],
    )
    trunk = np.isin(body.parts, [PARTS.index(n) for n in ("torso", "left_thigh", "right_thigh")])
    gap = np.linalg.norm(
        body.vertices[arm][:, None, ::3] - body.vertices[trunk][None, ::7, ::3], axis=-1
    ).min()
    assert gap < 0.03  # they do touch
    vertices = body.vertices + 0.01 * vertex_normals(
        body.vertices.astype(np.float64), body.faces.astype(np.int64)
    )
    surface = Surface(
        vertices=vertices.astype(np.float32),
        faces=body.faces,
        colors=np.full_like(vertices, 0.5, dtype=np.float32),
    )
    bound = bind(surface, body)
    assert not np.isin(
        bound.parts[arm], [PARTS.index(n) for n in ("torso", "left_thigh", "right_thigh")]
    ).any()
    assert (
        np.isin(
            bound.parts[trunk],
            [
                PARTS.index(n)
                for n in ("left_hand", "right_hand", "left_lower_arm", "right_lower_arm")
            ],
        )
    ).mean() < 1e-3
    names = np.array(body.bone_names)
    of_arm = np.array(
        [
            n.startswith(
                ("upperarm", "lowerarm", "wrist", "finger", "metacarpal", "shoulder", "clavicle")
            )
            for n in names
        ]
    )
    on_other = np.where(of_arm[bound.bones], 0, bound.weights).sum(1)[arm]
    assert on_other.max() < 0.02


def test_known_parts_win(surface: Surface, body: Body) -> None:
    parts = np.full(len(surface.vertices), -1)
    some = np.flatnonzero(body.parts == PARTS.index("torso"))[:50]
    parts[some] = PARTS.index("neck")
    assert (bind(surface, body, parts=parts).parts[some] == PARTS.index("neck")).all()


def test_hair_follows_the_head_and_a_skirt_both_legs(body: Body) -> None:
    import trimesh

    head = body.vertices[body.parts == PARTS.index("head")]
    hair = trimesh.creation.icosphere(3, 0.16)
    hair.apply_translation(head.mean(0) + np.array([0, 0.03, -0.05]))
    knees = [body.bone_transforms[body.bone_names.index(f"lowerleg01.{s}"), :3, 3] for s in "LR"]
    skirt = trimesh.creation.cylinder(0.3, 0.4, sections=64)
    skirt.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    skirt = skirt.subdivide().subdivide()
    skirt.apply_translation(np.mean(knees, axis=0) + np.array([0, 0.2, 0]))
    names = np.array(body.bone_names)
    for mesh, wanted in (
        (hair, ("head", "neck", "eye")),
        (skirt, ("upperleg", "lowerleg", "pelvis", "root", "spine05")),
    ):
        n = len(mesh.vertices)
        surface = Surface(
            vertices=mesh.vertices.astype(np.float32),
            faces=mesh.faces.astype(np.int32),
            colors=np.zeros((n, 3), np.float32),
        )
        bound = bind(surface, body)
        right = np.array([name.startswith(wanted) for name in names])
        assert np.where(right[bound.bones], bound.weights, 0).sum(1).mean() > 0.85, wanted
    left = np.array([name.endswith(".L") for name in names])
    share = np.where(left[bound.bones], bound.weights, 0).sum(1)
    side = skirt.vertices[:, 0] - np.mean(knees, axis=0)[0]
    assert share[side > 0.15].mean() > 0.7
    assert share[side < -0.15].mean() < 0.3
    edge = skirt.edges_unique
    short = np.linalg.norm(skirt.vertices[edge[:, 0]] - skirt.vertices[edge[:, 1]], axis=1) < 0.04
    assert (
        np.abs(share[edge[:, 0]] - share[edge[:, 1]])[short].max() < 0.5
    )  # no tear down the middle


def test_far_or_empty_surface(surface: Surface, body: Body) -> None:
    with pytest.raises(InputError, match="away from the body"):
        bind(dataclasses.replace(surface, vertices=surface.vertices + np.float32(5)), body)
    with pytest.raises(InputError, match="empty"):
        bind(dataclasses.replace(surface, faces=surface.faces[:0]), body)


# ---- skinning


def test_bind_pose_is_the_identity(character: Character) -> None:
    bind_pose = character.body.bone_transforms
    np.testing.assert_allclose(deform(character, bind_pose), character.surface.vertices, atol=1e-6)
    np.testing.assert_allclose(
        control_points(character, bind_pose), character.surface.vertices, atol=1e-6
    )


def test_rigid_motion_in_rigid_motion_out(character: Character) -> None:
    rotvec, shift = np.array([0.4, -1.1, 0.7]), np.array([0.3, -0.2, 1.0])
    moved = rigid(character.body.bone_transforms.astype(np.float64), rotvec, shift)
    wanted = character.surface.vertices @ rotvec_to_rotmat(rotvec).T + shift
    np.testing.assert_allclose(deform(character, moved), wanted, atol=1e-5)
    np.testing.assert_allclose(ArapDeformer(character)(moved), wanted, atol=1e-5)


def test_wrong_transforms(character: Character) -> None:
    with pytest.raises(InputError, match="expected"):
        deform(character, np.zeros((3, 4, 4)))
    with pytest.raises(InputError, match="NaN"):
        deform(character, character.body.bone_transforms * np.nan)


# ---- Eq. 20


def grid(n: int = 9, m: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """Flat mesh of equilateral triangles: all cotangent weights positive."""
    y, x = np.mgrid[:m, :n]
    vertices = np.stack([x + 0.5 * (y % 2), np.sqrt(0.75) * y, 0.0 * x], -1).reshape(-1, 3)
    faces = []
    for r in range(m - 1):
        for c in range(n - 1):
            a, b, d, e = r * n + c, r * n + c + 1, (r + 1) * n + c, (r + 1) * n + c + 1
            faces += [[a, b, d], [b, e, d]] if r % 2 == 0 else [[a, e, d], [a, b, e]]
    return vertices, np.array(faces)


def test_triangle_that_is_turned_stays_itself() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0.3, 0.8, 0]])
    turn = rotvec_to_rotmat(np.array([0.2, 0.5, 2.5]))
    solver = ArapSolver(vertices, np.array([[0, 1, 2]]), np.array([1e4, 1e4, 0]))
    result = solver.solve(
        np.vstack([(vertices @ turn.T)[:2], [[9.0, 9, 9]]]), iterations=2000, tolerance=-1.0
    )
    edges = [
        np.linalg.norm(result.vertices[i] - result.vertices[j]) for i, j in ((0, 1), (1, 2), (2, 0))
    ]
    np.testing.assert_allclose(
        edges,
        [np.linalg.norm(vertices[i] - vertices[j]) for i, j in ((0, 1), (1, 2), (2, 0))],
        atol=1e-3,
    )


def test_stretched_triangle_has_the_known_answer() -> None:
    # All three corners are pulled softly to a triangle twice as large. By symmetry it scales by s
    # about its center, with the minimum of 2 k 3 (s - 1)^2 L^2 + c 3 r^2 (2 - s)^2; k = cot(60)/2,
    # r^2 = L^2 / 3.
    angle = np.deg2rad([90, 210, 330])
    vertices = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    k, c, length2 = 1 / np.sqrt(3) / 2, 0.7, 3.0
    solver = ArapSolver(vertices, np.array([[0, 1, 2]]), np.full(3, c))
    result = solver.solve(2 * vertices, iterations=500, tolerance=-1.0)
    stiff, pull = 6 * k * length2, 3 * c
    scale = (stiff + 2 * pull) / (stiff + pull)
    np.testing.assert_allclose(result.vertices, scale * vertices, atol=1e-6)
    assert result.energies[-1] == pytest.approx(
        stiff * (scale - 1) ** 2 + pull * (2 - scale) ** 2, rel=1e-6
    )


def test_bar_follows_a_moved_end_without_shearing() -> None:
    import trimesh

    bar = trimesh.creation.box((0.2, 0.2, 1.0))
    while len(bar.vertices) < 600:
        bar = bar.subdivide()
    v, f = np.array(bar.vertices), np.array(bar.faces)
    low, high = v[:, 2] < -0.45, v[:, 2] > 0.45
    turn = rotvec_to_rotmat(np.array([0, np.pi / 2, 0]))
    targets = v.copy()
    targets[high] = (v[high] - [0, 0, 0.4]) @ turn.T + [0.25, 0, 0.2]
    control = np.where(low | high, 1e4, 0.0)
    result = ArapSolver(v, f, control).solve(targets, iterations=300, tolerance=1e-7)
    np.testing.assert_allclose(result.vertices[low | high], targets[low | high], atol=1e-3)
    edges = bar.edges_unique
    now, before = (
        np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1) for x in (result.vertices, v)
    )
    assert (
        np.abs(now / before - 1).mean() < 0.08
    )  # A linear blend of the positions of both ends shears far more.
    t = np.clip((v[:, 2:] + 0.45) / 0.9, 0, 1)
    blend = (1 - t) * v + t * ((v - [0, 0, 0.4]) @ turn.T + [0.25, 0, 0.2])
    assert (
        np.abs(now / before - 1).mean()
        < 0.6
        * np.abs(
            np.linalg.norm(blend[edges[:, 0]] - blend[edges[:, 1]], axis=1) / before - 1
        ).mean()
    )


def test_energy_never_grows() -> None:
    v, f = grid()
    random = np.random.default_rng(0)
    targets = v + random.normal(0, 0.4, v.shape)
    energies = np.array(
        ArapSolver(v, f, np.full(len(v), 0.2))
        .solve(targets, iterations=40, tolerance=-1.0)
        .energies
    )
    assert len(energies) == 40
    assert (np.diff(energies) <= 1e-9 * energies[:-1]).all()
    assert energies[-1] < 0.97 * energies[0]


def test_agrees_with_open3d() -> None:
    # A closed mesh of acute triangles, since Open3D weights border edges twice as much as usual.
    import open3d
    import trimesh

    ball = trimesh.creation.icosphere(2)
    v, f = np.array(ball.vertices) * [1, 1, 1.6], np.array(ball.faces)
    low, high = np.flatnonzero(v[:, 2] < -1.2), np.flatnonzero(v[:, 2] > 1.2)
    ids = np.concatenate([low, high])
    positions = np.concatenate(
        [v[low], v[high] @ rotvec_to_rotmat(np.array([0.6, 0.5, 0.3])).T + [0.3, 0, 0.2]]
    )
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(v), open3d.utility.Vector3iVector(f)
    )
    theirs = mesh.deform_as_rigid_as_possible(
        open3d.utility.IntVector(ids.tolist()),
        open3d.utility.Vector3dVector(positions),
        max_iter=1500,
    )
    control, targets = np.zeros(len(v)), v.copy()
    control[ids], targets[ids] = 1e7, positions
    ours = ArapSolver(v, f, control).solve(targets, start=v, iterations=1500, tolerance=-1.0)
    moved = np.linalg.norm(np.asarray(theirs.vertices) - v, axis=1)
    assert moved.max() > 0.5
    np.testing.assert_allclose(ours.vertices, np.asarray(theirs.vertices), atol=5e-4)


def test_frames_do_not_depend_on_each_other(character: Character, pose: np.ndarray) -> None:
    one, other = ArapDeformer(character), ArapDeformer(character)
    one(character.body.bone_transforms)
    one(rigid(pose, np.array([2.0, 1, 0]), np.zeros(3)))
    np.testing.assert_array_equal(one(pose), other(pose))


def test_arap_distorts_less_than_skinning_and_control_points(
    character: Character, pose: np.ndarray
) -> None:
    edges = np.unique(
        np.sort(character.surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0
    )

    def stretch(vertices: np.ndarray) -> float:
        now, before = (
            np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
            for x in (vertices, character.surface.vertices)
        )
        return float(np.abs(np.log(np.maximum(now, 1e-9) / np.maximum(before, 1e-9))).mean())

    deformer = ArapDeformer(character)
    result = deformer.solve(pose)
    assert result.iterations <= deformer.settings.iterations
    assert (
        stretch(result.vertices)
        < stretch(deform(character, pose))
        < stretch(control_points(character, pose))
    )
    assert np.linalg.norm(result.vertices - deform(character, pose), axis=1).mean() < 0.01


def test_rotations_agree_with_the_decomposition() -> None:
    random = np.random.default_rng(1)
    wanted = rotvec_to_rotmat(random.normal(0, 2, (500, 3)))
    size = random.normal(0, 1, (500, 3, 3))
    spd = size @ np.swapaxes(size, 1, 2) + 0.1 * np.eye(3)
    spd[:100, :, 2] = spd[:100, 2, :] = 0  # flat neighborhoods
    matrices = wanted @ spd
    near = wanted @ rotvec_to_rotmat(random.normal(0, 0.2, (500, 3)))
    best = np.einsum("nab,nab->n", nearest_rotations(matrices), matrices)
    for start, tolerance in ((near, 1e-3), (np.tile(np.eye(3), (500, 1, 1)), 0.1)):
        found = rotations_of(matrices, start, steps=60)
        np.testing.assert_allclose(
            found @ np.swapaxes(found, 1, 2), np.tile(np.eye(3), (500, 1, 1)), atol=1e-9
        )
        np.testing.assert_allclose(np.linalg.det(found), 1, atol=1e-9)
        np.testing.assert_allclose(np.einsum("nab,nab->n", found, matrices), best, rtol=tolerance)


def test_bad_control() -> None:
    with pytest.raises(InputError, match="positive"):
        DeformSettings(control=0.0)
    v, f = grid(3, 3)
    with pytest.raises(InputError, match="not all zero"):
        ArapSolver(v, f, np.zeros(9))

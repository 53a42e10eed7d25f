"""Models of the SMPL family, tested on a tiny model in their file format made from Anny."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from a2v import InputError, Surface
from a2v.animation import bind, deform, retarget
from a2v.body import (
    JOINT_BONES,
    PARTS,
    BodyModel,
    FitSettings,
    SmplModel,
    carry_over,
    fit_body,
    load_body_model,
    make_body,
)
from a2v.body.fit import unknowns_of
from a2v.body.smpl import JOINTS
from a2v.kinematics import HUMANACT12, inverse_kinematics
from a2v.kinematics.names import BLAZEPOSE
from a2v.types import Body, Motion
from tests.support.bodies import random_body, subject_of
from tests.support.smpl import BONES, smpl_arrays


@pytest.fixture(scope="module")
def content() -> dict[str, np.ndarray]:
    return smpl_arrays()


@pytest.fixture(scope="module")
def file(content: dict[str, np.ndarray], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("smpl") / "SMPL_TINY.npz"
    np.savez(
        path, **content, part2num=np.array({"pelvis": 0}, dtype=object)
    )  # SMPL-X's files also hold pickles, which are never opened
    return path


@pytest.fixture(scope="module")
def model(file: Path) -> SmplModel:
    loaded = load_body_model(str(file))
    assert isinstance(loaded, SmplModel)
    return loaded


def test_it_is_a_body_model(model: SmplModel) -> None:
    assert isinstance(model, BodyModel)
    assert (model.name, model.n_bones, model.n_shape) == ("smpl", 24, 3)
    assert set(np.unique(model.parts)) == set(range(len(PARTS)))
    left = model.parts == PARTS.index("left_hand")
    assert model._template.numpy()[left, 0].min() > 0.1  # the person's left is +x


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_bones_and_skin_move_together(model: SmplModel, dtype: torch.dtype) -> None:
    random = torch.Generator().manual_seed(0)
    angles = 0.3 * torch.randn(2, 24, 3, generator=random, dtype=dtype)
    betas, move = (
        torch.randn(2, 3, generator=random, dtype=dtype),
        torch.tensor([0.1, 0.2, 0.3], dtype=dtype),
    )
    state = model.forward(angles, betas, move)
    assert state.vertices.dtype == state.transforms.dtype == dtype
    # Rotate a point of the head's flesh by the head's bone only, as weights of one do.
    rigid = np.flatnonzero(model.weights[:, 15] > 0.9999)[::50]
    local = state.rest_vertices[:, rigid] - state.rest_heads[:, 15:16]
    posed = (state.transforms[:, 15, :3, :3] @ local.mT).mT + state.transforms[:, 15:16, :3, 3]
    assert (
        float((posed - state.vertices[:, rigid]).abs().max()) < 5e-3
    )  # except for the small pose corrections
    some = torch.tensor([5, 7, 1000])
    torch.testing.assert_close(
        model.forward(angles, betas, move, vertex_ids=some).vertices, state.vertices[:, some]
    )
    torch.testing.assert_close(
        model.forward(angles, betas).transforms[..., :3, 3] + move, state.transforms[..., :3, 3]
    )
    # the convention: world_j = world_parent @ translate(head_j - head_parent) @ rotate(rotvec_j)
    rest, parent = state.rest_heads, model.bone_parents[18]
    step = state.transforms[:, parent, :3, :3] @ (rest[:, 18] - rest[:, parent])[..., None]
    torch.testing.assert_close(
        state.transforms[:, 18, :3, 3],
        state.transforms[:, parent, :3, 3] + step[..., 0],
        atol=1e-5,
        rtol=0,
    )


def test_landmarks_lie_where_annys_do(model: SmplModel) -> None:
    anny = load_body_model()
    zero = torch.zeros(24, 3)
    ours = model.landmarks(model.forward(zero, torch.zeros(3))).numpy()
    theirs = anny.landmarks(
        anny.forward(torch.zeros(anny.n_bones, 3), torch.from_numpy(anny.shape_default))
    ).numpy()
    distance = np.linalg.norm(ours - theirs, axis=1)
    assert (
        distance[
            [BLAZEPOSE.index(f"left_{name}") for name in ("shoulder", "hip", "knee", "wrist")]
        ].max()
        < 0.005
    )
    assert distance.max() < 0.09  # fingers have no joints of their own
    assert ours[BLAZEPOSE.index("left_ear"), 0] > 0.03
    assert ours[BLAZEPOSE.index("nose"), 2] > ours[BLAZEPOSE.index("left_ear"), 2] + 0.05


@pytest.fixture(scope="module")
def carried(model: SmplModel) -> tuple[Body, Body, float]:
    source = random_body(3, spread=0.5)
    return (source, *carry_over(model, source))


def test_a_fit_is_carried_over(carried: tuple[Body, Body, float]) -> None:
    source, body, distance = carried
    assert body.model == "smpl"
    assert distance < 0.012
    joints = ("left_elbow", "right_wrist", "left_knee", "right_ankle")
    want = source.bone_transforms[
        [source.bone_names.index(JOINT_BONES[joint]) for joint in joints], :3, 3
    ]
    errors = np.linalg.norm(
        body.bone_transforms[[body.bone_names.index(joint) for joint in joints], :3, 3] - want,
        axis=1,
    )
    assert errors.max() < 0.05  # three shape directions do not include lengths of limbs
    assert errors.mean() < 0.03


def test_a_person_of_smpl_is_bound_and_walks(carried: tuple[Body, Body, float]) -> None:
    _, body, _ = carried
    surface = Surface(
        vertices=body.vertices, faces=body.faces, colors=np.full_like(body.vertices, 0.5)
    )
    character = bind(surface, body)
    np.testing.assert_allclose(deform(character, body.bone_transforms), surface.vertices, atol=1e-5)
    joints = np.repeat(load_rest(), 8, axis=0)
    motion = Motion(
        joints=joints,
        rotations=inverse_kinematics(joints, HUMANACT12).astype(np.float32),
        root=joints[:, 0],
        fps=20.0,
        parents=HUMANACT12.parents,
        joint_names=HUMANACT12.joint_names,
        skeleton="humanact12",
    )
    moved = retarget(motion, body)
    assert moved.shape == (8, 24, 4, 4)
    lifted = (
        moved[:, body.bone_names.index("left_wrist"), 1, 3]
        - moved[:, body.bone_names.index("left_shoulder"), 1, 3]
    )
    assert (lifted > 0.3).all()  # the arm is raised as in the photo


def load_rest() -> np.ndarray:
    """Return HumanAct12's joints of a person who raises the left arm, (1, 24, 3)."""
    anny = load_body_model()
    turns = np.zeros((anny.n_bones, 3), np.float32)
    turns[anny.bone("upperarm01.L"), 2] = 2.0
    body = make_body(anny, turns, grounded=True)
    own = {name.lower(): name for name in HUMANACT12.joint_names}
    assert len(own) == 24
    names = [BONES[ours] for ours in JOINTS[24][1]]
    return body.bone_transforms[[body.bone_names.index(name) for name in names], :3, 3][None]


def test_fit_body_gives_the_users_model(file: Path) -> None:
    subject, _ = subject_of(random_body(1))
    result = fit_body(subject, settings=FitSettings(model=str(file), rounds=2))
    assert result.body.model == "smpl"
    assert result.residuals["carried_over"] < 0.02


def test_a_fit_of_the_users_model_is_fitted_to_a_surface(file: Path) -> None:
    person = random_body(1)
    subject, _ = subject_of(person)
    settings = FitSettings(model=str(file), rounds=1, steps=3, starts=0)
    first = fit_body(subject, settings=settings)
    surface = Surface(
        vertices=person.vertices, faces=person.faces, colors=np.full_like(person.vertices, 0.5)
    )
    again = fit_body(
        subject, settings=settings, surface=surface, camera=first.camera, initial=first
    )
    assert again.body.model == "smpl"
    # the second fit starts from the angles of the first one, which SMPL's body keeps
    assert np.abs(unknowns_of(first).angles.detach() - unknowns_of(again).angles.detach()).max() < 1


def test_files_that_are_no_models_are_named(tmp_path: Path, content: dict[str, np.ndarray]) -> None:
    def saved(**changed: np.ndarray) -> str:
        np.savez(tmp_path / "m.npz", **{**content, **changed})
        return str(tmp_path / "m.npz")

    (tmp_path / "m.pkl").write_bytes(b"cos\nsystem\n(S'true'\ntR.")
    (tmp_path / "t.npz").write_bytes(b"PK\x03\x04 not really")
    np.savez(tmp_path / "few.npz", f=content["f"])
    for path, words in (
        (str(tmp_path / "m.pkl"), "pickle"),
        (str(tmp_path / "t.npz"), r"not a readable \.npz"),
        (str(tmp_path / "none.npz"), "does not exist"),
        (str(tmp_path / "few.npz"), "no array v_template"),
        ("smpl", "unknown body model 'smpl'"),
    ):
        with pytest.raises(InputError, match=words):
            load_body_model(path)
    bad = content["f"].copy()
    bad[0, 0] = 10**6
    tree = content["kintree_table"].copy()
    tree[0, 3] = 9
    broken = content["v_template"].copy()
    broken[0, 0] = np.nan
    for changed, words in (
        ({"f": bad}, "has indices of vertices"),
        ({"kintree_table": tree}, "parents before children"),
        ({"kintree_table": tree[:, :20]}, "20 joints"),
        ({"v_template": broken}, "v_template"),
        ({"weights": content["weights"][:, :5]}, "weights has shape"),
        ({"posedirs": content["posedirs"][..., :9]}, "posedirs has shape"),
    ):
        with pytest.raises(InputError, match=words):
            load_body_model(saved(**changed))

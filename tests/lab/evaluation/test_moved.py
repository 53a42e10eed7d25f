"""The benchmark of moved people: the people, the transfer of poses, and the measures."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from a2v.animation import deform, skin_of
from a2v.body import load_body_model, make_body
from a2v.body.face import EYES, teeth
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.evaluation.moved.carry import carried
from a2v.lab.evaluation.moved.cases import POSES, T_POSE, MovedCase, open_moved_case
from a2v.lab.evaluation.moved.limbs import TruthPose, limb_turns
from a2v.lab.evaluation.moved.measures import (
    HIP_JOINTS,
    MovedSettings,
    compare_moved,
    move,
    of_other_parts,
    outer_faces,
    scale_at_hips,
    torn_share,
)
from a2v.lab.evaluation.moved.panels import MOVED_PANELS
from a2v.lab.evaluation.moved.sheets import moved_rows
from a2v.lab.evaluation.moved.tables import MovedOutcome, moved_table, photo_table
from a2v.lab.studio.makehuman.hm08 import (
    RIG_BONES,
    RIG_PARENTS,
    rig_bone,
    rig_transforms,
    shape_body,
)
from a2v.lab.studio.makehuman.named import NAMED_PEOPLE
from a2v.lab.studio.ordinary import ORDINARY, arm_reaching, draw_ordinary
from a2v.lab.studio.stand import prepare_avatar
from a2v.lab.studio.variation import REPORT_IDENTITIES, VALIDATION_IDENTITIES, split_of
from a2v.reconstruction.canonical.build import with_teeth
from a2v.reconstruction.canonical.topology import topology
from a2v.types import Body, OrthographicCamera, PhotoCamera, Surface
from pipelines.cli import main
from tests.support.bodies import subject_of

AVATAR = "Hispanic_M_3_Casual"
QUICK = MovedSettings(points=2000, colored=500, size=64)


def test_photos_are_pinned_and_nobody_in_them_is_trained_on() -> None:
    assert {name: len(pins) for name, pins in MOVED_PANELS.items()} == {
        "development": 20,
        "final": 20,
        "aside": 8,
    }
    every = [pin for pins in MOVED_PANELS.values() for pin in pins]
    assert len({pin.index for pin in every}) == len(every)
    assert {split_of(pin.avatar) for pin in every if pin.avatar not in NAMED_PEOPLE} == {
        "validation"
    }
    people = {
        name: {pin.avatar.rpartition("_")[0] for pin in pins if pin.avatar not in NAMED_PEOPLE}
        for name, pins in MOVED_PANELS.items()
    }
    validation, report = set(VALIDATION_IDENTITIES), set(REPORT_IDENTITIES)
    assert people.pop("aside") <= validation | report
    assert people == {"development": validation, "final": report}
    looks = [pin.avatar for pin in every if pin.avatar in NAMED_PEOPLE]
    assert len(set(looks)) == len(looks)
    assert {pin.stance for pin in every} == set(ORDINARY)


@pytest.fixture(scope="module")
def rest_body() -> Body:
    """The body at rest, of the shape that `shape_body` gives by default."""
    model = load_body_model("anny")
    return make_body(model, np.zeros((len(model.bone_names), 3), np.float32), model.shape_default)


def test_carried_joints_are_the_truths_where_the_body_is_the_truth(rest_body: Body) -> None:
    """A body with the true skeleton takes exactly every pose of the ground truth."""
    shaped, generator = shape_body({}), np.random.default_rng(0)
    rest = rig_transforms(shaped.heads).astype(np.float64)
    turns = np.tile(np.eye(3), (len(RIG_BONES), 1, 1))
    heads = shaped.heads.copy()
    for bone, parent in enumerate(RIG_PARENTS.tolist()):
        own = rotvec_to_rotmat(generator.normal(0, 0.5, 3))
        turns[bone] = own if parent < 0 else turns[parent] @ own
        if parent >= 0:
            heads[bone] = heads[parent] + turns[parent] @ (rest[bone, :3, 3] - rest[parent, :3, 3])
    made = carried(rest_body, RIG_BONES, shaped.heads, turns[None])[0]
    own = {
        rig_bone(name): made[bone, :3, 3]
        for bone, name in reversed(list(enumerate(rest_body.bone_names)))
    }
    # limbs, seen from their first joint: what lies above, of several bones in one, is placed by the
    # body
    for side in ("Left", "Right"):
        for start, *others in (("Arm", "ForeArm", "Hand"), ("UpLeg", "Leg", "Foot")):
            first, mine = RIG_BONES.index(side + start), own[side + start]
            for name in others:
                np.testing.assert_allclose(
                    own[side + name] - mine,
                    heads[RIG_BONES.index(side + name)] - heads[first],
                    atol=2e-4,
                )


@pytest.mark.parametrize("inward", [0.0, 0.03])
def test_other_places_of_hip_joints_do_not_move_the_feet(rest_body: Body, inward: float) -> None:
    """A rig with other hip joints in the same body leaves the character on the truth."""
    character, still = skin_of(rest_body), np.tile(np.eye(3), (1, len(RIG_BONES), 1, 1))
    heads = shape_body({}).heads.copy()
    true = deform(character, carried(rest_body, RIG_BONES, heads, still)[0])
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        heads[RIG_BONES.index(f"{side}UpLeg"), 0] -= sign * inward
    truth = TruthPose(RIG_BONES, heads, still[0], true, character.surface.faces.astype(np.int64))
    turns = limb_turns(character, truth, 1.0, (np.eye(3), np.zeros(3)), points=1500)
    feet = np.flatnonzero(true[:, 1] < true[:, 1].min() + 0.1)
    away = [
        np.abs(
            deform(character, carried(rest_body, RIG_BONES, heads, still, corrections)[0]) - true
        )[feet, 0].mean()
        for corrections in (None, turns)
    ]
    assert (away[0] > 0.02) == (inward > 0)
    assert away[1] < 0.004
    hands = [RIG_BONES.index(f"{side}Hand") for side in ("Left", "Right")]
    np.testing.assert_array_equal(turns[hands], np.tile(np.eye(3), (2, 1, 1)))


def test_torn_area_is_of_long_stretched_triangles() -> None:
    made = np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [1, 0, 0], [1.1, 0, 0], [1, 0.1, 0]])
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    assert torn_share(made, made, faces) == 0  # a large triangle that was made so is not torn
    stretched = made.copy()
    stretched[1, 0] = 0.05
    share = 0.5 * 0.05 * 0.01
    assert torn_share(made, stretched, faces) == pytest.approx(share / (share + 0.005))
    stretched[1, 0] = 0.039
    assert torn_share(made, stretched, faces) == 0


def test_colors_of_other_parts_are_those_that_the_truth_has_elsewhere() -> None:
    """A hand's color on the belly counts; the belly's own, or a shade that occurs nowhere, does
    not."""
    generator = np.random.default_rng(0)
    belly, hand = (
        generator.uniform(0, 0.2, (400, 3)),
        generator.uniform(0, 0.1, (200, 3)) + np.array([0.6, 0, 0]),
    )
    cloth, skin, odd = [30.0, 20.0, -40.0], [60.0, 20.0, 20.0], [90.0, -60.0, 60.0]
    truth = np.concatenate([np.tile(cloth, (400, 1)), np.tile(skin, (200, 1))])
    mine = belly[:90]
    colors = np.concatenate(
        [np.tile(cloth, (30, 1)), np.tile(skin, (30, 1)), np.tile(odd, (30, 1))]
    )
    wrong = of_other_parts(mine, colors, np.concatenate([belly, hand]), truth)
    assert wrong.tolist() == [False] * 30 + [True] * 30 + [False] * 30


def test_the_mouth_from_within_is_no_part_of_what_is_seen(rest_body: Body) -> None:
    mesh = topology()
    vertices = mesh.refined(with_teeth(rest_body)[1])
    seen = np.zeros(len(mesh.faces), bool)
    seen[
        outer_faces(
            Surface(
                vertices=vertices.astype(np.float32),
                faces=mesh.faces.astype(np.int32),
                colors=np.zeros(vertices.shape, np.float32),
            )
        )
    ] = True
    of_teeth = ((mesh.faces >= EYES.stop) & (mesh.faces < mesh.first + len(teeth().vertices))).all(
        axis=1
    )
    assert of_teeth.sum() > 100
    assert seen[of_teeth].mean() < 0.05
    assert seen[mesh.skin[mesh.faces].all(axis=1)].mean() > 0.9


@pytest.fixture(scope="module")
def case(data_dir: Path) -> MovedCase:
    if not (data_dir / "avatars" / f"{AVATAR}.glb").is_file():
        pytest.skip(f"real data not present: {data_dir / 'avatars'} has no {AVATAR}")
    return open_moved_case(
        next(pin for pin in MOVED_PANELS["development"] if pin.avatar == AVATAR), data_dir
    )


def test_hands_reach_where_they_should(data_dir: Path) -> None:
    if not (data_dir / "avatars" / f"{AVATAR}.glb").is_file():
        pytest.skip(f"real data not present: {data_dir / 'avatars'} has no {AVATAR}")
    avatar = prepare_avatar(str(data_dir / "avatars" / f"{AVATAR}.glb")).avatar
    target = np.array([0.05, 1.2, 0.3])
    for side in ("Left", "Right"):
        pose = arm_reaching(avatar, side, target, np.array([0.0, -1.0, 0.0]))
        wrist = avatar.bone_transforms(pose)[avatar.bone_names.index(f"{side}Hand"), :3, 3]
        assert np.linalg.norm(wrist - target) < 0.02  # the collar bone moves with the arm
    for name in ORDINARY:
        first, again = (draw_ordinary(name, avatar, np.random.default_rng(3)) for _ in range(2))
        assert first[1] == again[1]
        assert all(
            np.isfinite(first[0][bone]).all() and np.array_equal(first[0][bone], again[0][bone])
            for bone in first[0]
        )


def test_the_truth_stands_on_the_ground_in_every_pose(case: MovedCase) -> None:
    assert case.vertices.shape == (len(POSES), len(case.surface.vertices), 3)
    np.testing.assert_allclose(case.vertices[:, :, 1].min(axis=1), 0, atol=1e-5)
    np.testing.assert_allclose(
        case.turns[0], np.tile(np.eye(3), (len(case.bones), 1, 1)), atol=1e-5
    )
    assert np.ptp(case.vertices[0][:, 0]) > 1.3  # T
    assert (
        min(np.abs(case.vertices[pose] - case.vertices[0]).max() for pose in range(1, len(POSES)))
        > 0.3
    )


def test_a_bare_body_is_measured_and_drawn(case: MovedCase, rest_body: Body) -> None:
    """The bare body of another person is within centimeters of the truth and not torn."""
    first = dataclasses.replace(case, vertices=case.vertices[:2], turns=case.turns[:2])
    character = skin_of(rest_body)
    subject, camera = subject_of(rest_body)  # its crop is its whole photo
    tall = np.ptp(case.vertices[0][:, 1]) / np.ptp(rest_body.vertices[:, 1])
    camera = dataclasses.replace(
        camera, scale=float(case.hips_scale * tall)
    )  # as a fit to this photo would have it
    moved = move(first, character, rest_body, camera, subject, QUICK)
    scores = compare_moved(first, moved, QUICK)
    assert list(scores) == list(POSES[:2])
    assert max(values["torn"] for values in scores.values()) == 0
    assert max(values["chamfer"] for values in scores.values()) < 3.0
    assert 0 <= scores[T_POSE]["other"] < 100
    rows = moved_rows(first, moved, size=48)
    assert rows.shape == (96, 48 * 5, 3)
    outcome = MovedOutcome(case.name, case.index, case.stance, "body", scores, len(rest_body.faces))
    assert "| body | 1 of 1 |" in moved_table([outcome])
    assert case.name in photo_table(
        [outcome, MovedOutcome("nobody", 1, "sides", "body", failure="no person")]
    )


def test_the_size_is_measured_at_the_depth_of_the_hips(rest_body: Body) -> None:
    """A body behind the point that defines the camera's scale appears smaller."""
    flat = OrthographicCamera(scale=500.0, center_u=0.0, center_v=0.0)
    joints = [rest_body.bone_names.index(name) for name in HIP_JOINTS]
    hips = rest_body.bone_transforms[joints, :3, 3].mean(axis=0)
    assert scale_at_hips(flat, rest_body) == pytest.approx(500.0)
    for behind in (0.0, 0.3):
        aim = (0.0, 1.0, float(hips[2]) + behind)
        camera = PhotoCamera(flat=flat, aim=aim, distance=3.0)
        assert scale_at_hips(camera, rest_body) == pytest.approx(500.0 * 3.0 / (3.0 + behind))


def test_wrong_options_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = ["evaluate", "moved", "--data", str(tmp_path), "--out", str(tmp_path / "table.md")]
    assert main([*common, "--only", "7"]) == 2
    assert "photo '7' is not in the panel development" in capsys.readouterr().err
    assert main([*common, "--photos", "1"]) == 2
    assert "there is no avatar" in capsys.readouterr().err

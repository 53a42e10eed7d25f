"""The reconstruction benchmark: metrics of copies with known errors, the frame, and one photo."""

from __future__ import annotations

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from scipy.ndimage import gaussian_filter

from a2v.body.limbs import LIMBS
from a2v.errors import InputError
from a2v.lab.evaluation.reconstruction import (
    FIT_METRICS,
    METRICS,
    PANELS,
    BenchmarkSettings,
    Case,
    Measured,
    Method,
    Outcome,
    Result,
    Truth,
    calibration,
    evaluate_case,
    fit_table,
    group_table,
    image_scores,
    lit_by,
    mask_in_photo,
    method_table,
    picture_rows,
    stack_rows,
    surface_maps,
    to_true_frame,
)
from a2v.lab.evaluation.reconstruction.alignment import Scan, aligned_distances
from a2v.lab.evaluation.reconstruction.measures import detail_share, shifted_psnr
from a2v.lab.studio.avatar_files import list_avatars, load_avatar
from a2v.lab.studio.avatars import a_pose
from a2v.lab.studio.makehuman.named import NAMED_PEOPLE
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.stances import STANCES
from a2v.lab.studio.variation import REPORT_IDENTITIES, split_of
from a2v.reconstruction.colorings import COLORINGS
from a2v.types import OrthographicCamera, PhotoCamera, Reconstruction, Subject, Surface
from pipelines.cli import main

SIZE = 400
SETTINGS = BenchmarkSettings(size=200, points=20_000)
CAMERA = OrthographicCamera(scale=200.0, center_u=SIZE / 2, center_v=SIZE / 2)


def make_case(
    mesh: trimesh.Trimesh, colors: np.ndarray | None = None, name: str = "Test_F_1_Casual"
) -> Case:
    """A mesh without a background, in the frame of CAMERA."""
    vertices = np.asarray(mesh.vertices, np.float32)
    points, face = trimesh.sample.sample_surface(mesh, 8192, seed=1)
    return Case(
        name=name,
        index=0,
        image=np.full((SIZE, SIZE, 3), 128, np.uint8),
        mask=np.zeros((SIZE, SIZE), np.uint8),
        camera=CAMERA,
        surface=Surface(
            vertices=vertices,
            faces=np.asarray(mesh.faces, np.int32),
            colors=np.full((len(vertices), 3), 0.5, np.float32)
            if colors is None
            else colors.astype(np.float32),
        ),
        normals=np.asarray(mesh.vertex_normals, np.float32),
        outer=np.arange(len(mesh.faces)),
        points=np.asarray(points, np.float32),
        point_normals=np.asarray(mesh.face_normals[face], np.float32),
    )


def subject_of(
    case: Case, crop: tuple[int, int, int, int] = (0, 0, SIZE, SIZE), zoom: float = 1.0
) -> Subject:
    width, height = round(zoom * (crop[2] - crop[0])), round(zoom * (crop[3] - crop[1]))
    return Subject(
        image=np.zeros((height, width, 3), np.uint8),
        mask=np.ones((height, width), np.float32),
        keypoints=np.zeros((33, 3), np.float32),
        keypoints_3d=np.full((33, 3), np.nan, np.float32),
        crop=crop,
        photo_size=(SIZE, SIZE),
    )


@pytest.fixture(scope="module")
def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(5, 0.5)


@pytest.fixture(scope="module")
def wide() -> trimesh.Trimesh:
    return trimesh.creation.box((0.9, 1.4, 0.3)).subdivide_to_size(0.05)


def test_the_truth_itself_is_perfect(wide: trimesh.Trimesh) -> None:
    case = make_case(wide)
    truth = Truth(case, SETTINGS)
    placed = truth.place(case.surface, CAMERA, subject_of(case))
    shape, colors = truth.compare_shape(placed), truth.compare_colors(placed)
    assert shape["chamfer"] < 1e-4
    assert shape["p2s"] < 1e-4
    assert shape["iou"] == 1
    assert shape["normals"] > 0.98  # smoothed over the edges alike
    assert shape["normals_nearest"] > 0.99
    assert shape["chamfer_world"] < 1e-4
    assert colors == {
        "psnr_front": 100,
        "ssim_front": pytest.approx(1),
        "psnr_back": 100,
        "ssim_back": pytest.approx(1),
        "psnr_back_aside": 100,
        "detail_back": 1,
    }


def test_a_pattern_that_has_moved_a_little_is_no_error_with_shifts() -> None:
    rng = np.random.default_rng(0)
    true = rng.random((60, 50, 3))
    region = np.zeros((60, 50), bool)
    region[8:50, 8:42] = True
    moved = np.roll(true, (2, -3), axis=(0, 1))
    assert shifted_psnr(moved, true, region, block=12, reach=3) == 100
    assert shifted_psnr(moved, true, region, block=12, reach=2) < 12
    plain = -10 * np.log10(((moved - true)[region] ** 2).mean())
    assert shifted_psnr(moved, true, region, block=12, reach=0) == pytest.approx(plain)
    other = rng.random((60, 50, 3))  # shifts do not make another pattern alike
    assert shifted_psnr(other, true, region, block=12, reach=3) < 10


def test_a_near_camera_counts_in_the_world_alone(wide: trimesh.Trimesh) -> None:
    near = PhotoCamera(flat=CAMERA, distance=1.5, pitch=0.2)
    flat = wide.copy()
    flat.vertices = near.flatten(np.asarray(wide.vertices))
    case = make_case(flat)
    made = {
        "camera_aim": list(near.aim),
        "camera_distance": near.distance,
        "camera_pitch": near.pitch,
    }
    case = dataclasses.replace(case, surface=dataclasses.replace(case.surface, provenance=made))
    truth = Truth(case, SETTINGS)
    world = dataclasses.replace(case.surface, vertices=np.asarray(wide.vertices, np.float32))
    right, wrong = (
        truth.compare_shape(truth.place(surface, camera, subject_of(case)))
        for surface, camera in ((world, near), (case.surface, CAMERA))
    )
    assert max(right["chamfer"], wrong["chamfer"]) < 0.01  # both are what the photo shows
    assert right["chamfer_world"] < 0.05
    assert wrong["chamfer_world"] > 1.0


def test_a_thicker_copy_is_off_by_what_was_added(ball: trimesh.Trimesh) -> None:
    case = make_case(ball)
    truth = Truth(case, SETTINGS)
    thicker = dataclasses.replace(
        case.surface, vertices=case.surface.vertices * np.float32(1.02)
    )  # 1 cm all around
    placed = truth.place(thicker, CAMERA, subject_of(case))
    assert placed.shift == pytest.approx(
        -0.014, abs=0.002
    )  # the fronts are laid on each other where both are: a slope of 45 degrees is 1.4 cm nearer
    shape = truth.compare_shape(placed)
    assert 0.8 < shape["chamfer"] < 1.3
    assert shape["iou"] == pytest.approx(1 / 1.02**2, abs=0.01)
    assert shape["normals"] > 0.99
    placed = dataclasses.replace(placed, surface=thicker)
    assert truth.compare_shape(placed)["p2s"] == pytest.approx(1.0, abs=0.01)
    assert truth.compare_shape(placed)["chamfer"] == pytest.approx(1.0, abs=0.01)


def test_a_copy_moved_sideways(wide: trimesh.Trimesh) -> None:
    case = make_case(wide)
    truth = Truth(case, SETTINGS)
    moved = dataclasses.replace(
        case.surface, vertices=case.surface.vertices + np.array([0.02, 0, 0], np.float32)
    )
    shape = truth.compare_shape(truth.place(moved, CAMERA, subject_of(case)))
    assert shape["iou"] == pytest.approx(0.88 / 0.92, abs=0.01)
    # the flanks (0.42 + ... of the area) are 2 cm off, what slid over front and back is off by its
    # distance to the edge
    flanks = 2 * 1.4 * 0.3 / wide.area
    assert shape["p2s"] == pytest.approx(100 * 0.02 * flanks, rel=0.35)
    assert shape["normals"] > 0.95


def test_depth_does_not_count_and_flips_do(wide: trimesh.Trimesh) -> None:
    case = make_case(wide)
    truth = Truth(case, SETTINGS)
    away = dataclasses.replace(
        case.surface, vertices=case.surface.vertices + np.array([0, 0, 0.7], np.float32)
    )
    placed = truth.place(away, CAMERA, subject_of(case))
    assert placed.shift == pytest.approx(-0.7, abs=1e-4)
    assert truth.compare_shape(placed)["chamfer"] < 1e-3
    tilted = case.surface.vertices @ trimesh.transformations.rotation_matrix(
        np.radians(30), [1, 0, 0]
    )[:3, :3].T.astype(np.float32)
    shape = truth.compare_shape(
        truth.place(dataclasses.replace(case.surface, vertices=tilted), CAMERA, subject_of(case))
    )
    assert shape["normals"] == pytest.approx(np.cos(np.radians(30)), abs=0.04)


@pytest.mark.parametrize("size", [1.0, 1.7])
def test_size_and_place_are_the_photos(wide: trimesh.Trimesh, size: float) -> None:
    """A prediction in another camera's meters and another crop's resolution matches the truth."""
    case = make_case(wide)
    crop, zoom = (50, 20, 350, 390), 1.5
    own = OrthographicCamera(
        scale=CAMERA.scale * zoom / size,
        center_u=(CAMERA.center_u - 50) * zoom,
        center_v=(CAMERA.center_v - 20) * zoom,
    )
    moved = dataclasses.replace(
        own, center_u=own.center_u - own.scale * 0.3
    )  # its origin lies elsewhere too
    theirs = (case.surface.vertices * size + np.array([0.3, 0, 0.5])).astype(np.float32)
    back = to_true_frame(
        theirs.astype(np.float64), moved, subject_of(case, crop, zoom), true=CAMERA
    )
    np.testing.assert_allclose(back[:, :2], case.surface.vertices[:, :2], atol=2e-6)
    truth = Truth(case, SETTINGS)
    placed = truth.place(
        dataclasses.replace(case.surface, vertices=theirs), moved, subject_of(case, crop, zoom)
    )
    assert truth.compare_shape(placed)["chamfer"] < 1e-3


def test_colors_front_and_back(wide: trimesh.Trimesh) -> None:
    front = np.asarray(wide.vertices)[:, 2] > 0
    colors = np.where(front[:, None], [0.8, 0.2, 0.2], [0.2, 0.2, 0.8])
    case = make_case(wide, colors)
    truth = Truth(case, SETTINGS)
    red = dataclasses.replace(
        case.surface, colors=np.tile(np.float32([0.8, 0.2, 0.2]), (len(front), 1))
    )
    scores = truth.compare_colors(truth.place(red, CAMERA, subject_of(case)))
    assert scores["psnr_front"] > 40
    assert scores["psnr_back"] == pytest.approx(-10 * np.log10(2 * 0.36 / 3), abs=0.2)


def test_image_scores_are_of_the_region() -> None:
    first = np.random.default_rng(0).random((64, 64, 3)).astype(np.float32)
    second = first.copy()
    second[:, :32] += 0.1
    left = np.zeros((64, 64), bool)
    left[:, :32] = True
    assert image_scores(first, second, left)[0] == pytest.approx(20, abs=1e-3)
    assert image_scores(first, second, ~left)[0] == 100
    assert image_scores(first, second, left)[1] < 1


def test_maps_show_both_sides_on_the_same_pixels(ball: trimesh.Trimesh) -> None:
    case = make_case(ball.copy().apply_translation([0.3, 0.2, 0.1]))
    front, back = (
        surface_maps(case.surface, case.normals, CAMERA, (SIZE, SIZE), size=200, side=side)
        for side in (1, -1)
    )
    assert (front.mask == back.mask).all()
    row, column = np.argwhere(front.mask).mean(axis=0)
    np.testing.assert_allclose((column + 0.5) * 2, CAMERA.center_u + 0.3 * CAMERA.scale, atol=1)
    np.testing.assert_allclose((row + 0.5) * 2, CAMERA.center_v - 0.2 * CAMERA.scale, atol=1)
    middle = round(row), round(column)
    assert front.depth[middle] == pytest.approx(0.6, abs=0.002)
    assert back.depth[middle] == pytest.approx(-0.4, abs=0.002)
    assert front.normals[middle][2] > 0.99
    assert back.normals[middle][2] < -0.99


def test_light_multiplies_in_linear_light(wide: trimesh.Trimesh) -> None:
    surface = make_case(wide).surface
    textured = dataclasses.replace(
        surface,
        uv=np.zeros((len(surface.faces), 3, 2), np.float32),
        texture=np.full((4, 4, 3), 128, np.uint8),
    )
    lit = lit_by(textured, np.array([1.0, 0.5, 4.0], np.float32))
    assert (lit.texture[0, 0] == [128, 92, 239]).all()
    np.testing.assert_allclose(lit.colors[0], np.array([0.5, 0.3608, 0.9339]), atol=2e-3)


def test_mirrored_coloring_shows_the_photo_on_both_sides(wide: trimesh.Trimesh) -> None:
    case = make_case(wide)
    image = np.zeros((SIZE, SIZE, 3), np.uint8)
    image[:, : SIZE // 2], image[:, SIZE // 2 :] = (200, 30, 30), (30, 30, 200)
    maps = surface_maps(case.surface, case.normals, CAMERA, (SIZE, SIZE), size=SIZE, side=1)
    subject = dataclasses.replace(subject_of(case), image=image, mask=maps.mask.astype(np.float32))
    made = Reconstruction(surface=case.surface, backend="none")
    colored = COLORINGS["mirrored"](made, subject, None, CAMERA)
    for side in (1, -1):
        seen = surface_maps(colored, case.normals, CAMERA, (SIZE, SIZE), size=SIZE, side=side)
        inner = seen.mask & (np.abs(np.arange(SIZE) - SIZE / 2) > 8)[None]
        assert np.abs(seen.colors[inner] - image[inner] / 255).max() < 0.02
    with pytest.raises(InputError, match="network"):
        COLORINGS["network"](made, subject, None, CAMERA)


def test_mask_of_a_crop_that_reaches_out_of_the_photo() -> None:
    mask = np.zeros((60, 90), np.float32)
    mask[12:18, 24:60] = 1
    subject = dataclasses.replace(
        subject_of(make_case(trimesh.creation.box())),
        image=np.zeros((60, 90, 3), np.uint8),
        mask=mask,
        crop=(-10, 20, 20, 40),
        photo_size=(50, 50),
    )
    whole = mask_in_photo(subject)
    assert whole.shape == (50, 50)
    expected = np.zeros((50, 50), bool)
    expected[24:26, 0:10] = (
        True  # a third of the crop's pixels: rows 4 to 6 from 20, columns 8 to 20 from -10
    )
    assert np.array_equal(whole > 0.5, expected)


def test_methods_have_names() -> None:
    assert Method.parse("body-prior") == Method("body-prior", "ours")
    assert Method.parse("body-prior:mirrored").name == "body-prior:mirrored"
    assert Method.parse("body-prior:ours").name == "body-prior"
    with pytest.raises(InputError, match="backend 'nerf'"):
        Method.parse("nerf")
    with pytest.raises(InputError, match="coloring 'best'"):
        Method.parse("body-prior:best")
    with pytest.raises(InputError, match="views"):
        BenchmarkSettings(views=0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--methods", "nerf"], "unknown backend 'nerf'"),
        (["--methods", "body-prior:best"], "unknown coloring 'best'"),
        (["--methods", "body-prior", "--size", "1"], "size from 64 to 2048"),
        (["--methods", "body-prior"], "no .glb files"),
    ],
)
def test_command_tells_what_is_wrong(tmp_path, capsys, options: list[str], message: str) -> None:
    common = [
        "evaluate",
        "reconstruction",
        "--data",
        str(tmp_path),
        "--studio",
        str(tmp_path / "studio"),
    ]
    assert main([*common, "--out", str(tmp_path / "table.md"), *options]) == 2
    assert message in capsys.readouterr().err
    assert main([*common, "--out", str(tmp_path / "table.txt")]) == 2


def test_photos_are_pinned() -> None:
    assert {name: len(pins) for name, pins in PANELS.items()} == {
        "studio": 20,
        "development": 18,
        "report": 21,
        "final": 40,
        "phone": 14,
        "distant": 8,
    }
    assert BenchmarkSettings().views >= 40  # nobody measures a part by accident
    every = [pin for pins in PANELS.values() for pin in pins]
    assert len({pin.index for pin in every}) == len(every)  # finished photos are kept by number
    assert {split_of(pin.avatar) for pin in every if pin.avatar not in NAMED_PEOPLE} == {
        "validation"
    }
    people = {
        name: {
            pin.avatar.rpartition("_")[0] for pin in PANELS[name] if pin.avatar not in NAMED_PEOPLE
        }
        for name in PANELS
    }
    assert people["report"] == people["final"] == set(REPORT_IDENTITIES)  # on whom nothing is tried
    assert not people["report"] & (people["development"] | people["studio"])
    for name in ("development", "report", "final"):
        assert {pin.stance for pin in PANELS[name]} == set(STANCES)
    with pytest.raises(InputError, match="panel 'mine'; choose from studio"):
        BenchmarkSettings(panel="mine")


def test_final_photos_are_new_and_half_of_them_in_action() -> None:
    pins = PANELS["final"]
    assert min(pin.index for pin in pins) > max(
        pin.index for name in ("studio", "development", "report") for pin in PANELS[name]
    )
    assert sum(pin.stance == "standing" for pin in pins) == 20
    of_makehuman = [pin.avatar for pin in pins if pin.avatar in NAMED_PEOPLE]
    assert len(of_makehuman) == 20
    assert set(of_makehuman) == {f"makehuman-{number}" for number in range(1, 11)}
    avatars = [pin.avatar for pin in pins if pin.avatar not in NAMED_PEOPLE]
    assert len(set(avatars)) == len(avatars)


def test_alignment_takes_a_turn_off_and_slabs_count(wide: trimesh.Trimesh) -> None:
    case = make_case(wide)
    truth = Truth(case, SETTINGS)
    turn = trimesh.transformations.rotation_matrix(np.radians(12), [1, 0.3, 0])[:3, :3].astype(
        np.float32
    )
    turned = dataclasses.replace(
        case.surface, vertices=case.surface.vertices @ turn.T + np.array([0.03, 0, 0], np.float32)
    )
    shape = truth.compare_shape(truth.place(turned, CAMERA, subject_of(case)))
    assert shape["chamfer"] > 2
    assert shape["chamfer_aligned"] < 0.1
    assert shape["p2s_aligned"] < 0.1
    deep = case.surface.vertices.copy()
    deep[:, 2] *= np.where(deep[:, 1] < 0, 2.0, 1.0)  # the lower half is a slab
    slab = truth.compare_shape(
        truth.place(dataclasses.replace(case.surface, vertices=deep), CAMERA, subject_of(case))
    )
    assert slab["thick"] == pytest.approx(50, abs=3)
    assert slab["slabs"] == slab["slabs_slack"] == pytest.approx(50, abs=3)
    plain = truth.compare_shape(truth.place(case.surface, CAMERA, subject_of(case)))
    assert plain["thick"] == plain["slabs"] == 0


def test_what_stands_apart_is_no_slab(wide: trimesh.Trimesh) -> None:
    before, behind = (wide.copy().apply_translation([0, 0, z]) for z in (0.4, 0.0))
    truth = Truth(make_case(wide), SETTINGS)
    apart = make_case(trimesh.util.concatenate([before, behind])).surface
    shape = truth.compare_shape(
        dataclasses.replace(truth.place(apart, CAMERA, subject_of(make_case(wide))), surface=apart)
    )
    assert shape["thick"] > 95
    assert shape["slabs"] == shape["slabs_slack"] == 0


def test_the_rim_of_what_is_turned_is_a_slab_only_without_slack() -> None:
    flat = trimesh.creation.cylinder(0.15, 0.6, sections=64).apply_scale([1, 0.6, 1])
    flat.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    truth = Truth(make_case(flat), SETTINGS)
    aside = make_case(flat.copy().apply_translation([0.008, 0, 0])).surface
    shape = truth.compare_shape(
        dataclasses.replace(truth.place(aside, CAMERA, subject_of(make_case(flat))), surface=aside)
    )
    assert 1 < shape["slabs"] < 10
    assert shape["slabs_slack"] == 0


def test_detail_of_a_blurred_back_is_less() -> None:
    sharp = np.random.default_rng(0).random((64, 64, 3)).astype(np.float32)
    soft = gaussian_filter(sharp, (2, 2, 0))
    region = np.ones((64, 64), bool)
    assert detail_share(sharp, sharp, region) == pytest.approx(1)
    assert detail_share(soft, sharp, region) < 0.05
    assert detail_share(sharp, soft, region) > 20


def test_calibration_is_a_rank_correlation() -> None:
    def photo(index: int, expected: float, true: float) -> Outcome:
        fit = {
            f"{kind}_{limb}": value
            for limb in LIMBS
            for kind, value in (("expected", expected), ("depth", true))
        }
        return Outcome("A_F_1_B", index, fit=fit)

    good, bad = ([photo(i, i, sign * i) for i in range(1, 5)] for sign in (1, -1))
    assert "all limbs: rank correlation 1.00" in calibration(good)
    assert "arms and legs alone: rank correlation -1.00" in calibration(bad)
    assert calibration([outcome("A_F_1_B", 1.0)]) == "No expected errors of limbs."


def outcome(
    name: str, value: float, methods: tuple[str, ...] = ("body-prior",), index: int = 0
) -> Outcome:
    seconds = {"perception": 1.0, "fit": 2.0, "shape": 3.0, "color": 4.0}
    return Outcome(
        name,
        index,
        {"yaw": 3.0},
        {m: dict.fromkeys(METRICS, value) for m in methods},
        dict.fromkeys(methods, seconds),
        {method: {} for method in methods},
        dict.fromkeys(FIT_METRICS, value),
    )


def test_tables() -> None:
    outcomes = [
        outcome("Asian_F_2_Busi", 1.0),
        outcome("Other_F_9_Medi", 3.0),
        Outcome("White_M_3_Busi", 4, failure="nobody"),
    ]
    table = method_table(outcomes, {"body-prior": 900.0})
    assert "2.00 ± 1.39" in table
    assert "| 3.0 | 4.0 | 10.0 | 900 |" in table
    by_person = group_table(outcomes, "body-prior", "identity")
    assert "| Asian_F_2 | 1 | 1.00" in by_person
    assert "| others | 1 | 3.00" in by_person
    assert "| all | 2 | 2.00" in fit_table(outcomes)
    assert "| Medi | 1 | 3.00" in group_table(outcomes, "body-prior", "outfit")
    outcomes = [
        outcome(f"MakeHuman_M_{number}_casualsuit05", float(number)) for number in (2, 2, 6)
    ]
    assert "| MakeHuman_M_2 | 2 | 2.00" in group_table(outcomes, "body-prior", "identity")
    assert "| casualsuit05 | 3 | 3.33" in group_table(outcomes, "body-prior", "outfit")


def test_measured_photos_are_kept(tmp_path, wide: trimesh.Trimesh) -> None:
    ours, mirrored = Method("body-prior"), Method("body-prior", "mirrored")
    studio = SimpleNamespace(settings=StudioSettings())
    kept = Measured(tmp_path, studio, SETTINGS)
    assert kept.load(7, [ours]) is None
    case = dataclasses.replace(make_case(wide), index=7)
    for method, value in ((ours, 1.0), (mirrored, 2.0)):
        kept.save(
            Result(
                case,
                outcome(case.name, value, (method.name,), 7),
                {method.name: case.surface},
                subject_of(case),
            ),
            [method],
        )
        found = Measured(tmp_path, studio, SETTINGS).load(7, [ours, mirrored])
        assert found.scores[method.name]["p2s"] == value
    assert set(found.scores) == {ours.name, mirrored.name}
    assert found.facts == {"yaw": 3.0}
    assert set(kept.load(7, [mirrored]).scores) == {mirrored.name}
    sheet = kept.sheet(7, [ours, mirrored])
    assert sheet.shape[0] == 3 * 200
    assert sheet.std() > 10
    # more photos are the same protocol, other points or another studio are not
    assert (
        Measured(tmp_path, studio, dataclasses.replace(SETTINGS, views=3)).load(7, [ours])
        is not None
    )
    assert (
        Measured(tmp_path, studio, dataclasses.replace(SETTINGS, points=500)).load(7, [ours])
        is None
    )
    assert (
        Measured(tmp_path, SimpleNamespace(settings=StudioSettings(fill=0.8)), SETTINGS).load(
            7, [ours]
        )
        is None
    )
    kept.save(Result(case, Outcome(case.name, 8, failure="nobody")), [ours])
    assert kept.load(8, [ours]) is None


@pytest.mark.slow
def test_a_photo_through_the_real_path(data_dir) -> None:
    """A posed avatar, photographed orthographically in even light before gray: perception, fit,
    body-prior, metrics, sheet."""
    avatar = load_avatar(list_avatars(data_dir / "avatars")[0])
    surface = avatar.surface(a_pose())
    middle = (surface.vertices.min(axis=0) + surface.vertices.max(axis=0)) / 2
    surface = dataclasses.replace(surface, vertices=surface.vertices - middle)
    size = 640
    camera = OrthographicCamera(
        scale=0.9 * size / float(np.ptp(surface.vertices[:, 1])),
        center_u=size / 2,
        center_v=size / 2,
    )
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    normals = np.asarray(mesh.vertex_normals, np.float32)
    seen = surface_maps(surface, normals, camera, (size, size), size=size, side=1)
    image = seen.colors * (0.5 + 0.5 * np.clip(seen.normals @ [0.3, 0.5, 0.8], 0, 1))[..., None]
    points, face = trimesh.sample.sample_surface(mesh, 4096, seed=1)
    case = Case(
        name=avatar.name,
        index=0,
        image=np.where(seen.mask[..., None], 255 * image, 150).astype(np.uint8),
        mask=255 * seen.mask.astype(np.uint8),
        camera=camera,
        surface=surface,
        normals=normals,
        outer=np.arange(len(surface.faces)),
        points=np.asarray(points, np.float32),
        point_normals=np.asarray(mesh.face_normals[face], np.float32),
    )
    methods = [Method.parse("body-prior"), Method.parse("body-prior:mirrored")]
    settings = BenchmarkSettings(size=256, points=10_000, true_mask=True)
    result = evaluate_case(case, methods, settings)
    outcome = result.outcome
    assert outcome.failure == ""
    ours, mirrored = (outcome.scores[method.name] for method in methods)
    assert set(ours) == set(METRICS)
    assert ours["iou"] > 0.95
    assert ours["chamfer"] < 4
    assert ours["chamfer"] == mirrored["chamfer"]
    assert ours["normals"] > 0.8
    assert ours["psnr_front"] > 15
    assert ours["psnr_back"] > mirrored["psnr_back"]
    assert set(outcome.seconds["body-prior"]) == {"perception", "fit", "shape", "color"}
    rows = picture_rows(result, size=96)
    assert list(rows) == ["truth", *(method.name for method in methods)]
    assert all(
        row.shape[0] == 96 and 96 < row.shape[1] <= 8 * 96 and row.std() > 20
        for row in rows.values()
    )
    assert stack_rows([rows["truth"], rows["truth"][:, :200]]).shape == (
        2 * 96,
        rows["truth"].shape[1],
        3,
    )
    json.dumps(dataclasses.asdict(outcome))
    nobody = dataclasses.replace(case, image=np.full_like(case.image, 128))
    assert "no person" in evaluate_case(nobody, methods, BenchmarkSettings()).outcome.failure
    elsewhere = dataclasses.replace(case, mask=np.roll(case.mask, size // 3, axis=1))
    assert (
        "did not find the person"
        in evaluate_case(elsewhere, methods, BenchmarkSettings()).outcome.failure
    )


def test_alignment_with_size_reaches_a_truth_of_another_size() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    true = mesh.vertices * [0.25, 0.9, 0.15]
    true[:, 0] *= 1 + 0.4 * true[:, 1]  # shoulders are wider than feet
    faces = np.asarray(mesh.faces, np.int32)
    turn = trimesh.transformations.rotation_matrix(np.radians(6), [1, 0, 0])[:3, :3]
    own = true @ turn.T / 1.12 + [0.1, 0.9, -0.2]
    scans = [
        Scan.of(vertices.astype(np.float32), faces, vertices.astype(np.float32))
        for vertices in (own, true)
    ]
    chamfer, p2s = aligned_distances(*scans, sized=True)
    assert max(chamfer, p2s) < 0.002
    assert aligned_distances(*scans)[0] > 0.01  # a rigid motion does not change the size

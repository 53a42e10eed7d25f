"""The body-prior backend on a body in a jacket, hair and a skirt."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest
import trimesh
from scipy import ndimage

from a2v.body import PARTS, load_body_model, make_body, nearest_spots
from a2v.errors import InputError
from a2v.geometry.visibility import depth_map, silhouette_iou
from a2v.geometry.volume import Grid, signed_distance
from a2v.reconstruction import (
    ColorEvidence,
    ColorSettings,
    SurfaceSettings,
    body_prior_surface,
    color_surface,
    surface_sheet,
)
from a2v.reconstruction.body_prior.volume import Skin, add_lobes
from a2v.types import Surface
from tests.support.photographs import HAIR, JACKET, SIZE, SKIN


@pytest.fixture(scope="module")
def surface(scene) -> Surface:
    subject, body, camera = scene
    return body_prior_surface(
        subject, body, camera, settings=SurfaceSettings(resolution=300, vertices=26_000)
    )


@pytest.fixture(scope="module")
def colored(scene, surface: Surface) -> Surface:
    subject, _, camera = scene
    return color_surface(surface, subject, camera, settings=ColorSettings(texture=1024))


def test_closed_single_and_fine(surface: Surface) -> None:
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert len(surface.vertices) >= 25_000
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert 0.03 < mesh.volume < 0.2
    assert mesh.area_faces.min() >= 0
    assert np.percentile(mesh.edges_unique_length, 99.9) < 0.04


def test_silhouette(scene, surface: Surface) -> None:
    subject, body, camera = scene
    bare = silhouette_iou(body.vertices, body.faces, camera, subject.mask)
    pushed = silhouette_iou(surface.vertices, surface.faces, camera, subject.mask)
    assert bare < 0.9
    assert pushed >= 0.97
    assert surface.provenance["silhouette_iou"] == pytest.approx(pushed, abs=0.002)


def test_hands_feet_and_face_survive(scene, surface: Surface) -> None:
    _, body, _ = scene
    from scipy.spatial import cKDTree

    tree = cKDTree(surface.vertices)
    for name, limit in (
        ("left_hand", 0.012),
        ("right_hand", 0.012),
        ("left_foot", 0.015),
        ("right_foot", 0.015),
    ):
        distance, _ = tree.query(body.vertices[body.parts == PARTS.index(name)])
        assert np.percentile(distance, 90) < limit, name
    head = body.vertices[body.parts == PARTS.index("head")]
    face = head[
        (head[:, 2] > np.percentile(head[:, 2], 80)) & (head[:, 1] < np.percentile(head[:, 1], 60))
    ]
    assert np.median(tree.query(face)[0]) < 0.008


def test_skirt_has_thickness(scene, surface: Surface) -> None:
    _, body, _ = scene
    tall = float(np.ptp(body.vertices[:, 1]))
    between = (np.abs(surface.vertices[:, 0]) < 0.02) & (
        np.abs(surface.vertices[:, 1] / tall - 0.36) < 0.02
    )
    assert between.any()
    assert np.ptp(surface.vertices[between, 2]) > 0.1  # as thick as the legs that it hangs from


@pytest.mark.parametrize(("apart", "pieces"), [(0.3, 2), (0.02, 1)])
def test_what_is_between_two_legs_belongs_to_either(apart: float, pieces: int) -> None:
    rods = [
        trimesh.creation.capsule(0.5, 0.04, count=[32, 32]).apply_translation([x, z, -0.25])
        for x, z in ((0.06, apart / 2), (-0.06, -apart / 2))
    ]
    both = trimesh.util.concatenate(rods).apply_transform(
        trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
    )
    vertices, faces = np.asarray(both.vertices), np.asarray(both.faces)
    grid = Grid(np.array([-0.2, -0.4, -0.3]), 0.006, (67, 134, 101))
    x, y = np.meshgrid(grid.axis(0), grid.axis(1), indexing="ij")
    mask_distance = np.maximum(np.abs(x) - 0.1, np.abs(y) - 0.2).astype(
        np.float32
    )  # a cloth over both
    nobody = np.zeros(len(vertices), np.int64)  # no legs: what is between them is no skirt
    field, cloth = add_lobes(
        signed_distance(vertices, faces, grid),
        Skin(vertices, faces, nobody),
        grid,
        mask_distance,
        SurfaceSettings(),
    )
    assert not cloth.any()
    labels, count = ndimage.label(field < 0)
    assert (np.bincount(labels.ravel())[1:] > 100).sum() == pieces
    assert count >= pieces
    assert (field[33, 60:75].min(axis=-1) < 0).all()  # the cloth is there


def test_front_shows_the_photo(scene, colored: Surface) -> None:
    subject, _, camera = scene
    assert colored.uv is not None
    assert colored.texture is not None
    assert colored.texture.shape == (1024, 1024, 3)
    pixels = camera.project(colored.vertices).astype(int)
    seen = colored.visible & (
        subject.mask[pixels[:, 1].clip(0, SIZE[1] - 1), pixels[:, 0].clip(0, SIZE[0] - 1)] > 0.5
    )
    inner = (
        cv2.distanceTransform((subject.mask > 0.5).astype(np.uint8), cv2.DIST_L2, 5)[
            pixels[:, 1].clip(0, SIZE[1] - 1), pixels[:, 0].clip(0, SIZE[0] - 1)
        ]
        > 5
    )
    photo = (
        subject.image[pixels[:, 1].clip(0, SIZE[1] - 1), pixels[:, 0].clip(0, SIZE[0] - 1)] / 255
    )
    error = np.abs(colored.colors - photo).max(axis=1)[seen & inner]
    assert np.median(error) < 0.01
    assert seen.sum() > 5000


def test_background_does_not_bleed(colored: Surface) -> None:
    for color in (colored.colors, colored.texture.reshape(-1, 3) / 255):
        assert (color[:, 1] - color[:, [0, 2]].max(axis=1)).max() < 0.1


def test_no_face_on_the_back_of_the_head(scene, colored: Surface) -> None:
    _subject, body, _camera = scene
    tall = float(np.ptp(body.vertices[:, 1]))
    v = colored.vertices
    head = (v[:, 1] > 0.915 * tall) & (np.abs(v[:, 0]) < 0.12)
    back = head & (v[:, 2] < np.percentile(v[head, 2], 30))
    hair = np.linalg.norm(colored.colors - HAIR, axis=1) < np.linalg.norm(
        colored.colors - SKIN, axis=1
    )
    assert hair[back].mean() > 0.95
    front = head & (v[:, 2] > np.percentile(v[head, 2], 90)) & (v[:, 1] < 0.94 * tall)
    assert hair[front].mean() < 0.1


def test_back_of_the_clothes_and_hands(scene, colored: Surface) -> None:
    _, body, _ = scene
    tall = float(np.ptp(body.vertices[:, 1]))
    v = colored.vertices
    back = (
        (v[:, 2] < np.percentile(v[:, 2], 15))
        & (np.abs(v[:, 0]) < 0.08)
        & (v[:, 1] > 0.6 * tall)
        & (v[:, 1] < 0.78 * tall)
    )
    assert back.sum() > 50
    assert np.abs(colored.colors[back] - JACKET).max(axis=1).mean() < 0.08
    assert not colored.visible[back].any()
    assert colored.provenance["eq14"]["residual"] <= ColorSettings().tolerance


def painted(scene, surface: Surface, change) -> Surface:
    """The surface, colored from the scene's photo after `change`.

    `change` takes the image, heights and half widths, both fractions of the body's height.
    """
    subject, body, camera = scene
    tall = float(np.ptp(body.vertices[:, 1]))
    image = subject.image.copy()
    heights = (camera.center_v - (np.arange(SIZE[1]) + 0.5))[:, None] / camera.scale / tall
    widths = np.abs(np.arange(SIZE[0]) + 0.5 - camera.center_u)[None] / camera.scale / tall
    change(image, heights, widths)
    spots = nearest_spots(surface.vertices, body)
    mask = np.maximum(subject.mask, np.linalg.norm(image / 255.0 - HAIR, axis=-1) < 0.05).astype(
        np.float32
    )
    changed = dataclasses.replace(subject, image=image, mask=mask)
    return color_surface(
        surface,
        changed,
        camera,
        evidence=ColorEvidence(spots=spots),
        settings=ColorSettings(texture=0, tolerance=0.1, delight=False),
    )


def test_neckline_and_tie_stay_on_the_front(scene, surface: Surface) -> None:
    tall = float(np.ptp(scene[1].vertices[:, 1]))

    def dress(image: np.ndarray, heights: np.ndarray, widths: np.ndarray) -> None:
        image[(heights < 0.84) & (heights > 0.76) & (widths < 0.5 * (heights - 0.76))] = (
            np.multiply(SKIN, 255)
        )
        image[(heights < 0.80) & (heights > 0.72) & (widths < 0.012)] = (250, 230, 20)

    v = (dressed := painted(scene, surface, dress)).vertices
    strip = (np.abs(v[:, 0]) < 0.06) & (v[:, 1] > 0.73 * tall) & (v[:, 1] < 0.80 * tall)
    front, back = (
        strip & (v[:, 2] * sign > np.percentile(v[strip, 2] * sign, 70)) for sign in (1, -1)
    )
    assert np.abs(dressed.colors[front] - JACKET).max(axis=1).mean() > 0.15
    assert np.abs(dressed.colors[back] - JACKET).max(axis=1).mean() < 0.1


@pytest.mark.parametrize("turned", [0.0, 0.5])
def test_long_hair_hangs_down_the_nape(scene, surface: Surface, turned: float) -> None:
    subject, body, camera = scene
    tall = float(np.ptp(body.vertices[:, 1]))

    def grow(image: np.ndarray, heights: np.ndarray, widths: np.ndarray) -> None:
        image[(heights > 0.80) & (heights < 0.9) & (widths > 0.022) & (widths < 0.075)] = (
            np.multiply(HAIR, 255)
        )

    towards = subject.keypoints_3d.copy()
    towards[[7, 8]], towards[0] = 0.0, (np.sin(turned), 0, np.cos(turned))
    looks = (dataclasses.replace(subject, keypoints_3d=towards), body, camera)
    v = surface.vertices
    nape = (np.abs(v[:, 0]) < 0.03) & (v[:, 1] > 0.85 * tall) & (v[:, 1] < 0.88 * tall)
    nape &= v[:, 2] < np.percentile(v[nape, 2], 30)
    short, long = (
        painted(looks, surface, change).colors[nape] for change in (lambda *_: None, grow)
    )
    hair, skin = np.array(HAIR), 0.92 * np.array(SKIN)
    assert (
        np.linalg.norm(short - skin, axis=1) < np.linalg.norm(short - hair, axis=1)
    ).mean() > 0.8
    assert (np.linalg.norm(long - hair, axis=1) < np.linalg.norm(long - skin, axis=1)).mean() > 0.8


def test_a_prior_is_followed_on_the_unseen_side(scene, surface: Surface) -> None:
    subject, _, camera = scene
    prior = np.full((len(surface.vertices), 3), np.nan)
    back = surface.vertices[:, 2] < np.percentile(surface.vertices[:, 2], 10)
    prior[back] = (0.9, 0.8, 0.1)
    painted = color_surface(
        surface,
        subject,
        camera,
        evidence=ColorEvidence(prior=prior),
        settings=ColorSettings(texture=0, tolerance=0.1, delight=False),
    )
    assert painted.texture is None
    assert np.abs(painted.colors[back] - (0.9, 0.8, 0.1)).max(axis=1).mean() < 0.1


def test_sheet_shows_something(colored: Surface) -> None:
    sheet = surface_sheet(colored, size=96)
    assert sheet.shape == (192, 576, 3)
    assert sheet.std() > 20


def test_bad_input(scene, surface: Surface) -> None:
    subject, body, camera = scene
    empty = dataclasses.replace(subject, mask=np.zeros_like(subject.mask))
    with pytest.raises(InputError, match="empty"):
        body_prior_surface(empty, body, camera)
    elsewhere = dataclasses.replace(camera, center_u=camera.center_u + 400)
    with pytest.raises(InputError, match="overlap"):
        body_prior_surface(subject, body, elsewhere)
    with pytest.raises(InputError, match="prior has shape"):
        color_surface(surface, subject, camera, evidence=ColorEvidence(prior=np.zeros((3, 3))))
    with pytest.raises(InputError, match="spots has 3 points"):
        color_surface(
            surface,
            subject,
            camera,
            evidence=ColorEvidence(spots=nearest_spots(surface.vertices[:3], body)),
        )
    with pytest.raises(InputError, match="vertices"):
        SurfaceSettings(vertices=10)
    with pytest.raises(InputError, match="lambda_nn"):
        ColorSettings(lambda_nn=-1)


def test_wide_sleeves_do_not_grow_together_with_the_trunk(scene) -> None:
    # arms hang beside the trunk, and the photo's cloth closes the gap between them
    subject, _, camera = scene
    model = load_body_model("anny")
    turns = np.zeros((model.n_bones, 3), np.float32)
    turns[model.bone("upperarm01.L"), 2], turns[model.bone("upperarm01.R"), 2] = -0.5, 0.5
    body = make_body(model, turns, grounded=True)
    bare = np.isfinite(depth_map(body.vertices, body.faces, camera, SIZE)).astype(np.uint8)
    rows = (camera.center_v - (np.arange(SIZE[1]) + 0.5)) / camera.scale
    closed = cv2.morphologyEx(
        bare, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (61, 61))
    )
    mask = np.where(((rows > 1.0) & (rows < 1.4))[:, None], closed, bare).astype(np.float32)
    assert mask.sum() > bare.sum() + 500
    loose = body_prior_surface(dataclasses.replace(subject, mask=mask), body, camera)
    mesh = trimesh.Trimesh(loose.vertices, loose.faces, process=False)
    assert mesh.is_watertight
    assert loose.provenance["silhouette_iou"] > 0.95
    elbow = body.bone_transforms[body.bone_names.index("lowerarm01.L"), :3, 3]
    cut = mesh.section(plane_origin=[0, elbow[1] + 0.05, 0], plane_normal=[0, 1, 0])
    assert len(cut.discrete) >= 3  # two arms and a trunk

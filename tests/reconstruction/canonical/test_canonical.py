"""The canonical character: its mesh, its observations, and no trace of the photo's pose."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2v.animation import deform, standing_character
from a2v.body.fingers import reskinned
from a2v.body.parts import PARTS, on_parts
from a2v.errors import InputError
from a2v.geometry.mesh import is_closed, vertex_areas
from a2v.geometry.rays import RayScene
from a2v.kinematics.skeleton import subtree
from a2v.reconstruction.canonical import (
    CharacterSettings,
    Sight,
    canonical_person,
    is_canonical,
)
from a2v.reconstruction.canonical.coloring import layout
from a2v.reconstruction.canonical.face import face_width
from a2v.reconstruction.canonical.shape import RestMesh, solve_offsets
from a2v.reconstruction.canonical.skirt import skirt_faces
from a2v.reconstruction.canonical.topology import topology
from a2v.reconstruction.canonical.wear import in_tips
from a2v.reconstruction.coloring.borders import Borders
from a2v.reconstruction.coloring.canvas import _only_within, _Palettes, strangers
from a2v.reconstruction.reading import Reading
from a2v.reconstruction.reading.arms import (
    arms_by_landmarks,
    bare_hands,
    gloves,
    tone_of_hands,
)
from a2v.reconstruction.reading.hanging import hangs_between_legs
from a2v.reconstruction.reading.surroundings import like_surroundings
from a2v.types import Body, BoolArray, Reconstruction
from tests.support.faces import CAMERA, photographed
from tests.support.sights import with_skirt
from tests.support.subjects import blank_subject
from tests.support.surfaces import coated

COAT = 0.02


@pytest.fixture(scope="module")
def dressed(body: Body) -> Reconstruction:
    return coated(body, cell=0.012, coat=COAT)


@pytest.fixture(scope="module")
def person(dressed: Reconstruction, body: Body) -> Reconstruction:
    return canonical_person(with_skirt(Sight(photographed(body), body, CAMERA, dressed), False))


def test_the_mesh_is_whole_even_and_symmetric() -> None:
    mesh = topology()
    assert is_closed(mesh.refined(_default()), mesh.faces)
    assert 20_000 < len(mesh.twin) < 50_000
    assert np.isfinite(mesh.uv).all()
    assert mesh.uv.min() >= 0
    assert mesh.uv.max() <= 1
    assert (mesh.twin[mesh.twin] == np.arange(len(mesh.twin))).mean() > 0.95
    points = mesh.refined(_default())
    edges = np.linalg.norm(points[mesh.faces[:, 0]] - points[mesh.faces[:, 1]], axis=1)
    assert np.quantile(edges, 0.99) < 0.02


def _default() -> np.ndarray:
    import torch

    from a2v.body.face import teeth
    from a2v.body.registry import load_body_model

    model = load_body_model("anny")
    return np.concatenate(
        [model.rest(torch.from_numpy(model.shape_default))[0].numpy(), teeth().vertices]
    )


def test_a_coat_of_known_thickness_is_found(
    person: Reconstruction, body: Body, dressed: Reconstruction
) -> None:
    from scipy.spatial import cKDTree

    surface = person.surface
    assert surface.standing is not None
    trunk = on_parts(
        surface.standing.parts, "torso", "left_thigh", "right_thigh", "left_shin", "right_shin"
    )
    away = cKDTree(dressed.surface.vertices).query(surface.vertices[trunk])[0]
    assert np.median(away) < 0.008  # cells of 12 mm
    skin = cKDTree(body.vertices).query(surface.vertices[trunk])[0]
    assert abs(np.median(skin) - COAT) < 0.008


def test_hands_are_the_bodys_own(person: Reconstruction, body: Body) -> None:
    standing, mesh = person.surface.standing, topology()
    assert standing is not None
    own = np.flatnonzero(on_parts(standing.parts[: mesh.first], "left_hand"))
    fingers = own[
        body.weights[own][
            :, [i for i, name in enumerate(body.bone_names) if name.startswith("finger")]
        ].sum(axis=1)
        > 0.5
    ]
    assert np.abs(person.surface.vertices[fingers] - body.vertices[fingers]).max() < 0.004


def test_it_stands_on_the_ground_and_moves_by_its_bones(person: Reconstruction, body: Body) -> None:
    character = standing_character(person.surface, body)
    assert abs(float(character.surface.vertices[:, 1].min())) < 1e-5
    assert np.allclose(character.weights.sum(axis=1), 1, atol=1e-5)
    back = deform(character, body.bone_transforms)
    assert (
        np.abs(back - person.surface.vertices).max() < 0.03
    )  # only the head is turned by its landmarks
    feet = on_parts(character.parts, "left_foot", "right_foot")
    assert np.abs(back - person.surface.vertices)[feet].max() < 1e-4


def test_the_face_has_all_expressions_and_lies_on_the_photos(person: Reconstruction) -> None:
    face = person.surface.face
    assert face is not None
    assert len(face.names) == 52
    assert set(np.unique(face.kinds)) == {0, 1, 2, 3, 4}
    moved, offsets = face.mixed({"jawOpen": 1.0})
    assert 0.01 < np.linalg.norm(offsets, axis=1).max() < 0.06
    assert len(moved) < len(person.surface.vertices) / 2


def test_a_character_and_what_it_is_of_survive_the_disk(
    person: Reconstruction, tmp_path: object
) -> None:
    path = f"{tmp_path}/person.npz"
    person.save(path)
    again = Reconstruction.load(path)
    assert again.surface.standing is not None
    assert person.surface.standing is not None
    assert np.array_equal(again.surface.standing.vertices, person.surface.standing.vertices)


def test_soles_are_flat_and_toes_are_closed(person: Reconstruction) -> None:
    standing, mesh = person.surface.standing, topology()
    assert standing is not None
    foot = on_parts(standing.parts, "left_foot") & mesh.skin
    low = standing.vertices[foot, 1].min()
    sole = foot & (standing.vertices[:, 1] < low + 0.012)
    areas = vertex_areas(standing.vertices.astype(np.float64), mesh.faces)
    assert np.ptp(standing.vertices[sole, 1]) < 0.012
    assert areas[sole].sum() > 0.15 * areas[foot].sum()


def test_a_shoes_tip_is_one(person: Reconstruction, body: Body) -> None:
    """Seen from above there are no gaps between toes."""
    from scipy.spatial import Delaunay

    standing, mesh = person.surface.standing, topology()
    assert standing is not None
    vertices = standing.vertices.astype(np.float64)
    tip = in_tips(body, vertices, standing.parts) & (vertices[:, 0] > 0)
    flat = vertices[tip][:, [0, 2]]
    grid = np.stack(
        np.meshgrid(
            *(
                np.arange(low, high, 0.002)
                for low, high in zip(flat.min(axis=0), flat.max(axis=0), strict=True)
            )
        ),
        axis=-1,
    ).reshape(-1, 2)
    grid = grid[Delaunay(flat).find_simplex(grid) >= 0]
    above = np.stack(
        [grid[:, 0], np.full(len(grid), 0.2) + vertices[tip, 1].min(), grid[:, 1]], axis=1
    )
    own = mesh.faces[tip[mesh.faces].any(axis=1)]
    hits = RayScene(standing.vertices, own).cast(
        above.astype(np.float32), np.tile(np.float32([0, -1, 0]), (len(above), 1))
    )
    assert hits.hit.mean() > 0.995  # .98 between toes


def test_hands_of_which_nothing_is_seen_are_bare_and_gloves_are_gloves() -> None:
    image = np.full((400, 400, 3), 40, np.uint8)
    face = np.zeros((478, 3), np.float32)
    face[:, :2] = (200, 60)
    image[20:100, 150:250] = (210, 160, 130)
    arms = np.zeros((len(PARTS), 200, 200), bool)
    arms[PARTS.index("left_hand"), 120:140, 50:70] = True
    hands = np.zeros((2, 21, 4), np.float32)
    hands[0, :, 3] = 1
    bare = bare_hands(dataclasses.replace(blank_subject(400, face=face), image=image), arms)
    assert bare is not None
    assert bare[20:40, 90:110].all()
    assert not bare[150:].any()
    covered = dataclasses.replace(blank_subject(400, face=face, hands=hands), image=image)
    assert bare_hands(covered, arms) is None
    assert bare_hands(dataclasses.replace(blank_subject(400), image=image), arms) is None


GLOVE, TONE, ROOM = (30, 34, 44), (210, 160, 130), (150, 170, 190)


def _gloved(
    left: tuple[int, int, int], right: tuple[int, int, int], *, at: int = 60, other: int = 180
) -> tuple[BoolArray | None, BoolArray]:
    """`gloves` of a picture of 200 pixels per meter with hands in two colors; the trunk begins at
    the columns 100 to 160, the hands at `at` and `other`. Also the pixels (h, w) of the left hand."""
    image = np.full((400, 400, 3), ROOM, np.uint8)
    face = np.zeros((478, 3), np.float32)
    face[:, :2] = (260, 60)
    image[20:100, 210:310] = TONE
    shown = np.full((200, 200), -1)
    shown[60:150, 100:160] = PARTS.index("torso")
    arms = np.zeros((len(PARTS), 200, 200), bool)
    for name, column, color in (("left", at, left), ("right", other, right)):
        place = np.s_[120:130, column : column + 10]
        shown[place], arms[PARTS.index(f"{name}_hand")][place] = PARTS.index(f"{name}_hand"), True
        image[240:260, 2 * column : 2 * column + 20] = color
    subject = dataclasses.replace(
        blank_subject(400, face=face), image=image, mask=np.ones((400, 400), np.float32)
    )
    return gloves(subject, arms, shown, 200.0), arms[PARTS.index("left_hand")]


def test_hands_without_any_skin_wear_gloves() -> None:
    worn, hand = _gloved(GLOVE, GLOVE)
    assert worn is not None
    assert worn[hand].all()
    assert worn.mean() < 0.01


def test_bare_hands_wear_no_gloves() -> None:
    shadow = (120, 80, 62)  # skin
    assert _gloved(TONE, TONE)[0] is None
    assert _gloved(shadow, shadow)[0] is None
    assert _gloved(GLOVE, TONE)[0] is None  # of two hands one is bare


def test_a_hand_beside_the_trunk_shows_no_glove() -> None:
    assert _gloved(GLOVE, GLOVE, at=89, other=161)[0] is None


def test_gloves_give_the_only_pixels_and_the_tone_of_both_hands() -> None:
    worn, hand = _gloved(GLOVE, GLOVE)
    assert worn is not None
    arms = np.zeros((len(PARTS), *worn.shape), bool)
    arms[PARTS.index("left_hand")] = hand
    reading = Reading(
        shown=np.full(worn.shape, -1, np.int8),
        found_arms=np.zeros(worn.shape, np.uint8),
        better=np.zeros(len(PARTS), bool),
        taken=np.zeros_like(worn),
        gloves=worn,
    )
    within = _only_within(reading, arms, PARTS.index("right_hand"))
    assert within is not None
    np.testing.assert_array_equal(within, worn)
    assert _only_within(reading, arms, PARTS.index("torso")) is None
    image = np.full((400, 400, 3), ROOM, np.uint8)
    image[240:260, 120:140] = GLOVE
    tone = tone_of_hands(image, reading.like_hands, arms)
    assert tone is not None
    np.testing.assert_allclose(tone * 255, GLOVE, atol=1)


def test_an_arm_that_is_fitted_wrongly_is_where_its_landmarks_are(body: Body) -> None:
    subject = blank_subject(2048)
    joints = [
        body.bone_transforms[body.bone_names.index(f"{bone}.L"), :3, 3]
        for bone in ("upperarm01", "lowerarm01", "wrist")
    ]
    keypoints = np.array(subject.keypoints)
    keypoints[[11, 13, 15], :2] = CAMERA.project(np.stack(joints))
    keypoints[[17, 19], :2] = keypoints[15, :2] + [0, 40]
    keypoints[:, 2] = 1
    lower = PARTS.index("left_lower_arm")
    at_body = arms_by_landmarks(
        dataclasses.replace(subject, keypoints=keypoints), body, CAMERA, (1024, 1024), 2
    )
    assert not at_body[1][lower]
    keypoints[15, :2] = CAMERA.project(joints[0]) + np.array([-300, 300])
    crossed, better = arms_by_landmarks(
        dataclasses.replace(subject, keypoints=keypoints), body, CAMERA, (1024, 1024), 2
    )
    assert better[lower]
    column, row = (keypoints[15, :2] / 2).astype(int)
    assert crossed[lower, row, column]


def test_unknown_displacements_are_the_twins() -> None:
    mesh = topology()
    rest = mesh.refined(_default())
    parts = np.zeros(len(rest), np.int64)
    left = mesh.skin & (rest[:, 0] > 0.02)
    offset = np.where(left, 0.03, 0.0)
    found = solve_offsets(
        RestMesh(rest, mesh.faces, parts, mesh.twin),
        offset,
        left.astype(float),
        fixed=~mesh.skin,
        smoothing=0.007,
    )
    right = mesh.skin & (rest[:, 0] < -0.05)
    assert np.abs(found[right] - 0.03).mean() < 0.003


def test_borders_are_drawn_within_triangles() -> None:
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    colors = np.array([[1.0, 0, 0], [0, 0, 1.0], [1.0, 0, 0], [0, 0, 1.0]])
    borders = Borders(
        np.array([[1.0, 0], [0, 1.0], [1.0, 0], [0, 1.0]], np.float32),
        np.stack([colors[[0] * 4], colors[[1] * 4]]).astype(np.float32),
    )
    share = np.linspace(0, 1, 21)
    weight = np.stack([1 - share, share, np.zeros(21)], axis=1)[..., None]
    drawn = borders.colors(np.tile(faces[0], (21, 1)), weight)
    mixed = (drawn[:, 0] > 0.01) & (drawn[:, 2] > 0.01)
    assert mixed.sum() <= 2
    assert drawn[0, 0] == pytest.approx(1)
    assert drawn[-1, 2] == pytest.approx(1)


def test_other_bodies_and_kinds_are_fused(body: Body) -> None:
    assert is_canonical(body, CharacterSettings())
    assert not is_canonical(body, CharacterSettings(kind="fused"))
    assert not is_canonical(dataclasses.replace(body, model="smpl"), CharacterSettings())
    with pytest.raises(InputError, match="canonical or fused"):
        CharacterSettings(kind="both")  # type: ignore[arg-type]


def test_the_width_of_a_face_is_in_pixels(body: Body) -> None:
    face = photographed(body).face
    assert face is not None
    assert 100 < face_width(face) < 300


def test_cloth_between_the_legs_is_found(dressed: Reconstruction, body: Body) -> None:
    heads = body.bone_transforms[:, :3, 3]
    legs = heads[
        [
            body.bone_names.index(f"{bone}{side}")
            for bone in ("upperleg01", "lowerleg01", "foot")
            for side in (".L", ".R")
        ]
    ]
    skirt = coated(body, cell=0.02, coat=0.01, ball=((legs[2] + legs[3]) / 2, 0.3))
    subject = photographed(body)
    assert hangs_between_legs(skirt.surface, body, subject, CAMERA)
    assert not hangs_between_legs(dressed.surface, body, subject, CAMERA)
    image = np.full_like(subject.image, 200)
    between = int(CAMERA.project(legs.mean(axis=0))[0])
    image[:, between - 22 : between + 22] = 0
    other = dataclasses.replace(
        subject, image=image
    )  # what is visible between white legs is black: the background
    assert not hangs_between_legs(skirt.surface, body, other, CAMERA)


def test_the_seat_of_a_seated_persons_trousers_is_no_skirt(body: Body) -> None:
    """With thighs raised by 80 degrees, a filling between them but not the shins is no skirt."""
    turned, transforms = (
        Rotation.from_euler("x", -80, degrees=True).as_matrix(),
        body.bone_transforms.astype(np.float64).copy(),
    )
    shins = np.concatenate(
        [
            subtree(body.bone_parents, body.bone_names.index(f"lowerleg01{side}"))
            for side in (".L", ".R")
        ]
    )
    for side in (".L", ".R"):
        leg = subtree(body.bone_parents, body.bone_names.index(f"upperleg01{side}"))
        hip = transforms[body.bone_names.index(f"upperleg01{side}"), :3, 3].copy()
        knee = transforms[body.bone_names.index(f"lowerleg01{side}"), :3, 3].copy()
        transforms[leg, :3, :3], transforms[leg, :3, 3] = (
            turned @ transforms[leg, :3, :3],
            hip + (transforms[leg, :3, 3] - hip) @ turned.T,
        )
        moved = hip + turned @ (knee - hip)
        own = np.intersect1d(leg, shins)  # they hang
        transforms[own, :3, :3], transforms[own, :3, 3] = (
            turned.T @ transforms[own, :3, :3],
            moved + (transforms[own, :3, 3] - moved) @ turned,
        )
    seated = reskinned(body, transforms)
    knees = transforms[
        [body.bone_names.index(f"lowerleg01{side}") for side in (".L", ".R")], :3, 3
    ].mean(axis=0)
    hips = transforms[
        [body.bone_names.index(f"upperleg01{side}") for side in (".L", ".R")], :3, 3
    ].mean(axis=0)
    seat = coated(seated, cell=0.02, coat=0.01, ball=((hips + knees) / 2, 0.13))
    subject = photographed(seated)
    assert not hangs_between_legs(seat.surface, seated, subject, CAMERA)
    skirt = coated(seated, cell=0.02, coat=0.01, ball=(knees - [0, 0.15, 0], 0.3))
    assert hangs_between_legs(skirt.surface, seated, subject, CAMERA)


def test_a_skirt_is_a_layer_of_its_own_that_ends_at_its_hem(body: Body) -> None:
    knees = body.bone_transforms[
        [body.bone_names.index(f"lowerleg01{side}") for side in (".L", ".R")], :3, 3
    ].mean(axis=0)
    skirt = coated(body, cell=0.02, coat=0.01, ball=(knees + np.array([0, 0.12, 0]), 0.26))
    made = canonical_person(with_skirt(Sight(photographed(body), body, CAMERA, skirt), True))
    mesh, standing = topology(), made.surface.standing
    assert standing is not None
    count = len(standing.vertices) - len(mesh.twin)
    assert is_closed(standing.vertices[len(mesh.twin) :], skirt_faces(count))
    assert is_closed(made.surface.vertices, made.surface.faces)
    hem = made.surface.vertices[len(mesh.twin) :, 1].min()
    assert knees[1] - 0.14 - 0.06 < hem < knees[1] - 0.02
    sides = body.rest_transforms[
        [body.bone_names.index(f"upperleg01{side}") for side in (".L", ".R")], 0, 3
    ]
    assert np.ptp(standing.vertices[len(mesh.twin) :, 0]) > np.ptp(sides) + 0.15
    uv = layout(512, count).uv
    assert uv.min() >= 0
    assert uv.max() <= 1
    assert len(uv) == len(made.surface.faces)
    strip = uv[len(mesh.faces) :, :, 1].max()
    assert strip < uv[: len(mesh.faces), :, 1].min()


def test_background_between_two_legs_is_not_the_persons() -> None:
    """Two red legs in front of a black wall, with a mask that includes the gap between them."""
    subject = blank_subject(400)
    image, mask = np.zeros((400, 400, 3), np.uint8), np.zeros((400, 400), np.float32)
    shown = np.full((400, 400), -1)
    for leg in (slice(120, 180), slice(220, 280)):
        image[100:400, leg], shown[100:400, leg] = (200, 40, 40), PARTS.index("left_thigh")
    mask[100:400, 120:280] = 1
    taken = like_surroundings(
        dataclasses.replace(subject, image=image, mask=mask), shown, scale=300.0
    )
    assert taken[150:380, 185:215].mean() > 0.95
    assert not taken[150:380, 130:170].any()
    image[100:400, 180:220] = (200, 40, 40)
    assert not like_surroundings(
        dataclasses.replace(subject, image=image, mask=mask), shown, scale=300.0
    ).any()


def test_distant_colors_of_the_background_prove_nothing() -> None:
    """The gap between two legs is gray: like neither the red legs nor the black wall. A dark gap is
    the wall's, although the legs are far from it in color."""
    subject = blank_subject(400)
    shown, mask = np.full((400, 400), -1), np.zeros((400, 400), np.float32)
    mask[100:400, 120:280] = 1
    for gap, share in ((120, 0.0), (12, 1.0)):
        image = np.zeros((400, 400, 3), np.uint8)
        image[100:400, 180:220] = gap
        for leg in (slice(120, 180), slice(220, 280)):
            image[100:400, leg], shown[100:400, leg] = (200, 40, 40), PARTS.index("left_thigh")
        taken = like_surroundings(
            dataclasses.replace(subject, image=image, mask=mask), shown, scale=300.0
        )
        assert taken[150:380, 185:215].mean() == pytest.approx(share, abs=0.05)


def test_a_neckline_is_the_trunks_and_a_hands_color_on_it_is_not() -> None:
    """A trunk of blue cloth with a neckline of skin, and a hand in front of it.

    The fit shows only the lower half of the hand.
    """
    shown = np.full((200, 200), -1)
    shown[:40, 60:140], shown[40:, 20:180] = PARTS.index("head"), PARTS.index("torso")
    shown[150:170, 80:140] = PARTS.index("left_hand")
    image = np.full((200, 200, 3), 30, np.uint8)
    image[shown == PARTS.index("torso")] = (40, 60, 160)
    skin = (210, 160, 130)
    image[:40, 60:140] = image[40:60, 85:115] = image[140:170, 80:140] = skin
    palettes = _Palettes(image, shown, strangers(), scale=200.0)
    torso = PARTS.index("torso")
    asked = np.zeros((200, 200), bool)
    asked[140:150, 85:135] = True
    assert palettes.of_others(torso, asked).all()
    asked[:], asked[120:135, 85:135] = False, True
    assert not palettes.of_others(torso, asked).any()
    assert not palettes.asked[torso, PARTS.index("head")]


def test_trousers_whose_surface_is_filled_between_the_legs_get_no_skirt(body: Body) -> None:
    knees = body.bone_transforms[
        [body.bone_names.index(f"lowerleg01{side}") for side in (".L", ".R")], :3, 3
    ].mean(axis=0)
    filled = coated(body, cell=0.02, coat=0.01, ball=(knees + np.array([0, 0.12, 0]), 0.26))
    plain = photographed(body)
    image = np.full_like(plain.image, 120)
    between = int(CAMERA.project(knees[None])[0, 0])
    image[:, between - 8 : between + 8] = 60  # the shadow where the legs touch
    lined = dataclasses.replace(plain, image=image)
    assert hangs_between_legs(filled.surface, body, lined, CAMERA)
    counts = []
    for subject in (plain, lined):
        made = canonical_person(Sight(subject, body, CAMERA, filled))
        assert made.surface.standing is not None
        counts.append(len(made.surface.standing.vertices))
    assert counts[1] == len(topology().twin) < counts[0]

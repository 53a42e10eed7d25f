"""Compare a moved character with the true person in the same poses: shape, torn area, colors of
other parts, pictures from four sides."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.animation import deform
from a2v.geometry.colors import linear_to_srgb
from a2v.geometry.rays import RayScene
from a2v.lab.evaluation.moved.carry import carried
from a2v.lab.evaluation.moved.cases import POSES, T_POSE, MovedCase
from a2v.lab.evaluation.moved.limbs import TruthPose, limb_turns
from a2v.lab.evaluation.moved.pictures import (
    Picture,
    head_differences,
    heads_of,
    picture_scores,
    pictures_of,
)
from a2v.lab.evaluation.reconstruction.alignment import Scan, align
from a2v.lab.evaluation.reconstruction.maps import camera_of_crop
from a2v.lab.evaluation.reconstruction.measures import sample_surface
from a2v.lab.studio.solid import OPEN_RAYS, open_faces
from a2v.lab.studio.texture import texture_at
from a2v.types import (
    Body,
    BoolArray,
    Camera,
    Character,
    FloatArray,
    IntArray,
    Subject,
    Surface,
)

PROTOCOL = 3
"""Version of the cases and the measures. 2: sizes at the hips. 3: limbs registered to the truth in
the T-pose."""
LONG_EDGE = 0.04
"""A triangle is torn if an edge is longer than this, meters, and stretched by more than
`STRETCH`."""
STRETCH = 3.0
"""Smallest ratio between the length of a torn edge and its length on the undeformed character."""
OWN_REACH = 0.06
"""Distance around a place of the character within which colors of the truth belong to the place,
meters."""
OTHER_REACH = 0.12
"""Distance beyond which colors of the truth belong to another part, meters."""
OWN_COLOR = 20.0
"""A place has the color of another part if its color is farther than this from all colors that
belong to the place, CIELAB units (lightness counts half), ..."""
OTHER_COLOR = 10.0
"""... and nearer than this to a color of the other part, in the same units."""
HIP_JOINTS = ("upperleg01.L", "upperleg01.R")
"""Bones of Anny whose heads are the hip joints."""


@dataclass(frozen=True)
class MovedSettings:
    """The protocol.

    Attributes
    ----------
    points : int
        Number of points on the character, and on the truth, for distances.
    colored : int
        Number of points on the character for colors of other parts.
    size : int
        Rays along each side of the square pictures.
    seed : int
        Seed of the choice of points.
    """

    points: int = 20_000
    colored: int = 6_000
    size: int = 320
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Moved:
    """A character in the poses of the truth.

    Attributes
    ----------
    character : Character
    made : (V, 3) float64
        Vertices in the pose in which the character was made, meters of the truth.
    vertices : (T, V, 3) float64
        In each of `POSES`, aligned with the truth, meters.
    """

    character: Character
    made: FloatArray
    vertices: FloatArray

    def surface(self, pose: int) -> Surface:
        """The surface of the character in a pose."""
        return dataclasses.replace(
            self.character.surface, vertices=self.vertices[pose].astype(np.float32), face=None
        )


def move(
    case: MovedCase,
    character: Character,
    body: Body,
    camera: Camera,
    subject: Subject,
    settings: MovedSettings,
    count: int = len(POSES),
) -> Moved:
    """Put a character into the poses of a case by skinning, and align each with the truth (rigid,
    ICP). In the T-pose the limbs are registered to the truth (`limb_turns`).

    The character is scaled so that a meter at the hips of the fitted body has as many pixels in the
    photo as a meter at the hips of the truth. What is left is the error of the character's own
    proportions and of the fitted distance; see `_same_size`.

    Parameters
    ----------
    body, camera
        Fitted to the photo, in the pixels of `subject`.
    count : int
        Number of poses, the first ones of `POSES`.
    """
    zoom = camera_of_crop(case.camera, subject).scale / case.camera.scale
    scale = scale_at_hips(camera, body) / (zoom * case.hips_scale)
    faces = character.surface.faces.astype(np.int64)

    def placed(transforms: FloatArray, pose: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        return _placed(case, pose, scale * deform(character, transforms), faces, settings)

    first = carried(character.body, case.bones, case.heads, case.turns[:1])[0]
    outer = case.surface.faces[case.outer].astype(np.int64)
    truth = TruthPose(case.bones, case.heads, case.turns[0], case.vertices[0], outer)
    limbs = limb_turns(character, truth, scale, placed(first, 0)[1:], seed=settings.seed)
    poses = carried(character.body, case.bones, case.heads, case.turns[:count], limbs)
    vertices = [placed(transforms, pose)[0] for pose, transforms in enumerate(poses)]
    made = scale * character.surface.vertices.astype(np.float64)
    return Moved(character, made, np.stack(vertices))


def _placed(
    case: MovedCase, pose: int, own: FloatArray, faces: IntArray, settings: MovedSettings
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Align a character (V, 3), meters, with the truth in a pose: its vertices, and the rotation
    (3, 3) and the shift (3,) that were applied."""
    vertices, true = own.astype(np.float64), case.vertices[pose].astype(np.float64)
    ends = [points(axis=0) for points in (vertices.min, vertices.max, true.min, true.max)]
    start = (ends[2] + ends[3] - ends[0] - ends[1]) / 2
    vertices = vertices + start
    outer = case.surface.faces[case.outer]
    mine = Scan.of(vertices, faces, _points(vertices, faces, settings))
    theirs = Scan(RayScene(case.vertices[pose], outer), true[outer], _points(true, outer, settings))
    rotation, shift, _ = align(mine, theirs)
    return vertices @ rotation.T + shift, rotation, rotation @ start + shift


def scale_at_hips(camera: Camera, body: Body) -> float:
    """Pixels per meter of horizontal lengths at the hip joints of a body, as a camera sees them."""
    joints = [body.bone_names.index(name) for name in HIP_JOINTS]
    middle = body.bone_transforms[joints, :3, 3].astype(np.float64).mean(axis=0)
    ends = camera.project(middle + np.array([[-0.005, 0.0, 0.0], [0.005, 0.0, 0.0]]))
    return float(np.linalg.norm(ends[1] - ends[0]) / 0.01)


def _points(vertices: FloatArray, faces: IntArray, settings: MovedSettings) -> FloatArray:
    plain = Surface(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=np.zeros(vertices.shape, np.float32),
    )
    return sample_surface(plain, settings.points, seed=settings.seed)[0]


def compare_moved(
    case: MovedCase, moved: Moved, settings: MovedSettings
) -> dict[str, dict[str, float]]:
    """Scores by pose, the first ones of `POSES`: Chamfer distance and 99 % quantile of the
    distances (cm), torn area (%), PSNR (dB) and SSIM, means of four sides. In T-pose also the share
    of the surface with another part's color (%), the differences of the head's colors, and the
    scores of `_same_size`.
    """
    values = {}
    for pose, name in enumerate(POSES[: len(moved.vertices)]):
        true = TrueLook.of(case, pose, settings)
        values[name] = _distances(case, moved, pose, settings)
        values[name]["torn"] = 100 * torn_share(
            moved.made, moved.vertices[pose], moved.character.surface.faces
        )
        values[name] |= picture_scores(
            true.vertices, true.pictures, moved.surface(pose), settings.size
        )
        if name == T_POSE:
            made = moved.surface(pose)
            values[name]["other"] = _other_colors(true, made, outer_faces(made), settings)
            values[name] |= head_differences(true.vertices, true.heads, made, settings.size)
            values[name] |= _same_size(case, moved, pose, settings)
    return values


def _same_size(
    case: MovedCase, moved: Moved, pose: int, settings: MovedSettings
) -> dict[str, float]:
    """Distances (cm) after an alignment that also scales the character, and its size relative to
    the truth before it (%). One photo does not determine the distance of the camera, and so
    neither the exact proportion of hips, head and feet nor the size."""
    faces, outer = moved.character.surface.faces.astype(np.int64), case.surface.faces[case.outer]
    true = case.vertices[pose].astype(np.float64)
    mine, theirs = _points(moved.vertices[pose], faces, settings), _points(true, outer, settings)
    truth = Scan(RayScene(case.vertices[pose], outer), true[outer], theirs)
    rotation, shift, size = align(Scan.of(moved.vertices[pose], faces, mine), truth, sized=True)
    placed = size * moved.vertices[pose] @ rotation.T + shift
    found = _distances_between(placed, faces, case.vertices[pose], outer, settings)
    return {f"sized_{name}": value for name, value in found.items()} | {"size": 100 / size}


def _distances(
    case: MovedCase, moved: Moved, pose: int, settings: MovedSettings
) -> dict[str, float]:
    return _distances_between(
        moved.vertices[pose],
        moved.character.surface.faces.astype(np.int64),
        case.vertices[pose],
        case.surface.faces[case.outer],
        settings,
    )


def _distances_between(
    own: FloatArray,
    own_faces: IntArray,
    true: FloatArray,
    true_faces: IntArray,
    settings: MovedSettings,
) -> dict[str, float]:
    mine, theirs = _points(own, own_faces, settings), _points(true, true_faces, settings)
    forth = RayScene(true, true_faces).closest(mine).distance
    back = RayScene(own, own_faces).closest(theirs).distance
    return {
        "chamfer": 50 * float(forth.mean() + back.mean()),
        "within": 100 * float(np.quantile(np.concatenate([forth, back]), 0.99)),
    }


def torn_share(made: FloatArray, posed: FloatArray, faces: IntArray) -> float:
    """Share of the area of `posed` (V, 3) in torn triangles (`LONG_EDGE`, `STRETCH`); `made` (V, 3)
    is where the character was made."""
    long = _edges(posed, faces)
    torn = ((long > LONG_EDGE) & (long > STRETCH * np.maximum(_edges(made, faces), 1e-9))).any(
        axis=1
    )
    corners = posed[faces]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return float(areas[torn].sum() / max(float(areas.sum()), 1e-12))


def _edges(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Lengths (F, 3) of the edges of the faces."""
    corners = vertices[faces]
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2))


@dataclass(frozen=True, eq=False)
class TrueLook:
    """What the true person looks like in a pose.

    Attributes
    ----------
    vertices : (V, 3)
        Around which pictures are framed, meters.
    points, colors : (N, 3)
        Places on its surface, meters, and their colors, CIELAB.
    pictures : sequence of colors (size, size, 3) and mask (size, size) bool
        From each of `SIDES`.
    """

    vertices: FloatArray
    points: FloatArray
    colors: FloatArray
    pictures: Sequence[Picture]
    _surface: Surface
    _size: int

    @classmethod
    def of(cls, case: MovedCase, pose: int, settings: MovedSettings) -> TrueLook:
        """Look at the person of a case."""
        vertices = case.vertices[pose]
        true = dataclasses.replace(case.surface, vertices=vertices)
        points, colors = colored_points(true, case.outer, settings.points, settings.seed + 1)
        pictures = pictures_of(true, settings.size)
        return cls(vertices, points, colors, pictures, true, settings.size)

    @functools.cached_property
    def heads(self) -> Sequence[Picture]:
        """Pictures of its head from each of `HEAD_TURNS`; of use in T-pose."""
        return heads_of(self._surface, self._size)


def color_scores(
    true: TrueLook, made: Surface, outer: IntArray, settings: MovedSettings
) -> dict[str, float]:
    """Other part's color (%), difference of the head, PSNR (dB) and SSIM of a character in the pose
    of the truth; `outer` (n,) are its faces that are visible from outside (`outer_faces`)."""
    other = _other_colors(true, made, outer, settings)
    head = head_differences(true.vertices, true.heads, made, settings.size)["head"]
    scores = picture_scores(true.vertices, true.pictures, made, settings.size)
    return {"other": other, "head": head, **scores}


def _other_colors(true: TrueLook, made: Surface, outer: IntArray, settings: MovedSettings) -> float:
    """Share (%) of the visible surface of the character with the color of another part; the inside
    of the mouth is left out of character and truth."""
    mine, colors = colored_points(made, outer, settings.colored, settings.seed)
    return 100 * float(of_other_parts(mine, colors, true.points, true.colors).mean())


def outer_faces(surface: Surface) -> IntArray:
    """Indices (n,) of the faces that are visible from outside, by the same rule as for the truth:
    the inside of the mouth is left out."""
    faces = surface.faces.astype(np.int64)
    return np.flatnonzero(open_faces(surface.vertices, faces, rays=OPEN_RAYS))


def of_other_parts(
    points: FloatArray, colors: FloatArray, true_points: FloatArray, true_colors: FloatArray
) -> BoolArray:
    """Return which of `points` (N, 3), meters, with `colors` (N, 3), CIELAB, have a color that the
    truth (M, 3) has only elsewhere.

    See `OWN_COLOR`. Colors that no part has (shading, highlights) do not count.
    """
    from scipy.spatial import cKDTree

    weight = np.array([0.5, 1.0, 1.0])
    own, truth = colors * weight, true_colors * weight
    tree = cKDTree(true_points)
    wrong = np.zeros(len(points), bool)
    near = tree.query_ball_point(points, OWN_REACH)
    nearest = tree.query(points)[1]
    for index, members in enumerate(near):
        members = members or [nearest[index]]
        wrong[index] = float(np.linalg.norm(truth[members] - own[index], axis=1).min()) > OWN_COLOR
    asked = np.flatnonzero(wrong)
    for index, alike in zip(
        asked, cKDTree(truth).query_ball_point(own[asked], OTHER_COLOR), strict=True
    ):
        wrong[index] = bool(alike) and bool(
            (np.linalg.norm(true_points[alike] - points[index], axis=1) > OTHER_REACH).any()
        )
    return wrong


def colored_points(
    surface: Surface, chosen: IntArray, count: int, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Points (count, 3) uniform by area on the `chosen` faces (n,) of a surface, and their colors
    (count, 3), CIELAB."""
    import cv2
    import trimesh

    mesh = trimesh.Trimesh(surface.vertices, surface.faces[chosen], process=False)
    points, face = trimesh.sample.sample_surface(mesh, count, seed=seed)
    weights = trimesh.triangles.points_to_barycentric(mesh.triangles[face], points)
    weights = np.nan_to_num(weights, nan=1 / 3)
    if surface.texture is None:
        colors = np.einsum("nk,nkc->nc", weights, surface.colors[surface.faces[chosen[face]]])
    else:
        colors = linear_to_srgb(
            texture_at(surface, chosen[face], weights[:, 1:].astype(np.float32))
        )
    lab = cv2.cvtColor(np.ascontiguousarray(colors[None], np.float32), cv2.COLOR_RGB2LAB)[0]
    return np.asarray(points, np.float64), np.asarray(lab, np.float64)

"""The guide: an imitation of the body that `a2v.body.fit_body` would find in a photo, made of a
bound body and the errors of real fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.skin import outer_skin
from a2v.geometry.rays import RayScene
from a2v.io import write_npz
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.avatars import Avatar, a_pose, linear_blend
from a2v.lab.studio.posing import avatar_body
from a2v.lab.studio.variation import Build, split_of, stretch
from a2v.record import Record
from a2v.types import Body, FloatArray, IntArray, OrthographicCamera, Subject, Surface

if TYPE_CHECKING:
    from a2v.body import FitSettings


@dataclass(frozen=True, kw_only=True)
class Guide(Record):
    """A body's outer skin bound to the avatars' rig.

    Attributes
    ----------
    vertices : (G, 3) float32
        In the T-pose of the rig, meters.
    faces : (F, 3) int32
    weights : (G, 4) float32, bones : (G, 4) int32
        Skinning weights, and their bones, indices into `bone_names`.
    bone_names : tuple of str
    heads : (B, 3) float32
        Heads of the bones in the T-pose.
    parts : (G,) int8
        Index into `a2v.body.PARTS`.
    landmarks : (33, 3) float32
        The body's BlazePose landmarks in the T-pose, meters.
    landmark_bones : (33,) int32
        Bone of each landmark, an index into `bone_names`.
    """

    vertices: FloatArray
    faces: IntArray
    weights: FloatArray
    bones: IntArray
    bone_names: tuple[str, ...]
    heads: FloatArray
    parts: IntArray
    landmarks: FloatArray
    landmark_bones: IntArray

    def __post_init__(self) -> None:
        sizes = {"B": len(self.bone_names)}
        for name, shape in {
            "vertices": ("G", 3),
            "faces": ("F", 3),
            "weights": ("G", 4),
            "bones": ("G", 4),
            "heads": ("B", 3),
            "parts": ("G",),
            "landmarks": (33, 3),
            "landmark_bones": (33,),
        }.items():
            self._check(name, shape, sizes)

    def posed(self, avatar: Avatar, build: Build, transforms: FloatArray) -> FloatArray:
        """Pose the guide on the rig of another avatar with a build; returns vertices (G, 3)
        float32.

        `avatar` is the avatar without the build. `transforms` (B, 4, 4) are world from bone, of the
        avatar with the build.
        """
        return self._carried(self.vertices, self.weights, self.bones, avatar, build, transforms)

    def posed_landmarks(self, avatar: Avatar, build: Build, transforms: FloatArray) -> FloatArray:
        """Return landmarks (33, 3) float32 in that pose; see `posed`."""
        return self._carried(
            self.landmarks,
            np.ones((33, 1)),
            self.landmark_bones[:, None],
            avatar,
            build,
            transforms,
        )

    def _carried(
        self,
        points: FloatArray,
        weights: FloatArray,
        bones: IntArray,
        avatar: Avatar,
        build: Build,
        transforms: FloatArray,
    ) -> FloatArray:
        number = {name: index for index, name in enumerate(avatar.bone_names)}
        own = np.array([number[name] for name in self.bone_names])[bones]
        maps, moved = stretch(build, avatar)
        local = points[:, None] - self.heads[bones].astype(np.float64)
        rest = np.einsum(
            "vk,vki->vi", weights, np.einsum("vkij,vkj->vki", maps[own], local) + moved[own]
        )
        at_rest = avatar.rest_transforms.astype(np.float64)
        at_rest[:, :3, 3] = moved
        return linear_blend(
            rest, weights, own, transforms.astype(np.float64) @ np.linalg.inv(at_rest)
        )


def fit_guide(avatar: Avatar, settings: FitSettings | None = None) -> Guide:
    """Fit the default body to an avatar's surface in A-pose (`a2v.body.fit_body`), and bind its
    outer skin to the avatar's rig.

    It takes about 15 seconds with the default `settings` of the fit.
    """
    from a2v.animation.bind import bind
    from a2v.body import fit_body

    pose = a_pose(arms=45.0)
    body = avatar_body(avatar, pose)
    surface = Surface(
        vertices=body.vertices,
        faces=avatar.faces,
        colors=np.full((len(body.vertices), 3), 0.5, np.float32),
    )
    subject, camera = _subject(body.vertices, avatar, body.bone_transforms)
    fitted = fit_body(subject, surface=surface, camera=camera, settings=settings).body
    vertices, faces, parts = outer_skin(fitted)
    skin = Surface(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=np.full((len(vertices), 3), 0.5, np.float32),
    )
    bound = bind(skin, body, parts=parts)
    moves = body.bone_transforms.astype(np.float64) @ np.linalg.inv(
        body.rest_transforms.astype(np.float64)
    )
    blended = np.einsum("vk,vkij->vij", bound.weights, moves[bound.bones])
    rest = np.linalg.solve(blended[:, :3, :3], (vertices - blended[:, :3, 3])[..., None])[..., 0]
    landmarks, carriers = _landmarks(fitted, avatar)
    landmarks = np.einsum(
        "kij,kj->ki", np.linalg.inv(moves[carriers]), np.c_[landmarks, np.ones(len(landmarks))]
    )[:, :3]
    used = np.array(
        [index for index, name in enumerate(avatar.bone_names) if not name.endswith("_end")]
    )
    place = np.full(len(avatar.bone_names), -1)
    place[used] = np.arange(len(used))
    bones = place[bound.bones]
    weights = np.where(bones >= 0, bound.weights, 0)
    return Guide(
        vertices=rest.astype(np.float32),
        faces=faces.astype(np.int32),
        weights=(weights / weights.sum(axis=1, keepdims=True)).astype(np.float32),
        bones=np.maximum(bones, 0).astype(np.int32),
        bone_names=tuple(avatar.bone_names[index] for index in used),
        heads=avatar.rest_transforms[used, :3, 3],
        parts=np.asarray(parts, np.int8),
        landmarks=landmarks.astype(np.float32),
        landmark_bones=place[carriers].astype(np.int32),
        provenance={"avatar": avatar.name},
    )


CARRIERS = {
    "shoulder": "Arm",
    "elbow": "ForeArm",
    "wrist": "Hand",
    "pinky": "Hand",
    "index": "Hand",
    "thumb": "Hand",
    "hip": "UpLeg",
    "knee": "Leg",
    "ankle": "Foot",
    "heel": "Foot",
    "foot_index": "ToeBase",
}
"""Bones of the avatars (without their side) that carry landmarks; the head carries the others."""


def _landmarks(body: Body, avatar: Avatar) -> tuple[FloatArray, IntArray]:
    """Return BlazePose landmarks (33, 3) of a fitted body, and the avatar's bones (33,) that carry
    them."""
    import torch

    from a2v.body import load_body_model
    from a2v.kinematics.names import BLAZEPOSE

    model = load_body_model()
    vertices = torch.from_numpy(body.vertices)[model.landmark_vertices]
    points = model.landmarks_of(vertices, torch.from_numpy(body.bone_transforms[:, :3, 3])).numpy()
    bones = []
    for name in BLAZEPOSE:
        side, _, joint = name.partition("_")
        bones.append(f"{side.title()}{CARRIERS[joint]}" if joint in CARRIERS else "Head")
    return points, np.array([avatar.bone_names.index(bone) for bone in bones])


_KEYPOINTS = {
    "shoulder": "Arm",
    "elbow": "ForeArm",
    "wrist": "Hand",
    "knee": "Leg",
    "ankle": "Foot",
    "eye": "Eye",
}


def _subject(
    vertices: FloatArray, avatar: Avatar, transforms: FloatArray, size: int = 640
) -> tuple[Subject, OrthographicCamera]:
    """Return the subject that perception would give for an avatar seen from +z: its mask, and its
    joints as keypoints."""
    from a2v.kinematics.names import BLAZEPOSE

    low, high = vertices.min(axis=0), vertices.max(axis=0)
    scale = 0.9 * size / float((high - low)[:2].max())
    middle = (low + high) / 2
    camera = OrthographicCamera(
        scale=scale,
        center_u=size / 2 - scale * float(middle[0]),
        center_v=size / 2 + scale * float(middle[1]),
    )
    pixels = np.stack(np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5), axis=-1).reshape(
        -1, 2
    )
    origins = camera.unproject(pixels, float(high[2]) + 1)
    mask = (
        RayScene(vertices, avatar.faces)
        .occluded(origins, np.array([0, 0, -1.0]))
        .reshape(size, size)
    )
    keypoints = np.zeros((len(BLAZEPOSE), 3), np.float32)
    places = np.full((len(BLAZEPOSE), 3), np.nan, np.float32)
    hips = transforms[avatar.bone_names.index("Hips"), :3, 3]
    for side in ("Left", "Right"):
        for ours, bone in _KEYPOINTS.items():
            point = transforms[avatar.bone_names.index(f"{side}{bone}"), :3, 3]
            index = BLAZEPOSE.index(f"{side.lower()}_{ours}")
            keypoints[index, :2], keypoints[index, 2] = camera.project(point), 0.9
            places[index] = point - hips
    subject = Subject(
        image=np.zeros((size, size, 3), np.uint8),
        mask=mask.astype(np.float32),
        keypoints=keypoints,
        keypoints_3d=places,
        crop=(0, 0, size, size),
        photo_size=(size, size),
    )
    return subject, camera


def guide_key(avatar: str) -> str:
    """Return the name of an avatar's guide: its sex and outfit, as in ``F_Busi``.

    A fit follows the silhouette, which is that of the clothes.
    """
    _, sex, _, outfit = avatar.rsplit("_", 3)
    return f"{sex}_{outfit}"


def stack_guides(guides: Mapping[str, Guide]) -> dict[str, np.ndarray]:
    """Return arrays of one ``.npz`` for several guides (``F_Busi.vertices``...) and their common
    ``faces``."""
    arrays: dict[str, np.ndarray] = {}
    for key, guide in guides.items():
        arrays |= {
            f"{key}.{name}": array for name, array in guide.to_arrays().items() if name != "faces"
        }
    first = next(iter(guides.values()))
    return {**arrays, "faces": first.faces, "parts": first.parts}


def unstack_guides(arrays: Mapping[str, np.ndarray]) -> dict[str, Guide]:
    """Return the guides in arrays of `stack_guides`."""
    keys: Sequence[str] = sorted({name.split(".")[0] for name in arrays if "." in name})
    return {
        key: Guide.from_arrays(
            {
                "faces": arrays["faces"],
                **{n[len(key) + 1 :]: a for n, a in arrays.items() if n.startswith(f"{key}.")},
            }
        )
        for key in keys
    }


def prepare_guides(paths: Sequence[Path], folder: Path) -> None:
    """Make ``guide.npz`` in a data set's folder, the guides of all avatars in `paths`, unless it
    exists; it takes minutes."""
    if not (folder / "guide.npz").exists():
        write_npz(folder / "guide.npz", stack_guides(_fit_guides(paths, folder)))


def _fit_guides(paths: Sequence[Path], folder: Path) -> dict[str, Guide]:
    """Fit a guide for each sex and outfit, on the first avatar of the training split with it (else
    of any split)."""
    chosen: dict[str, Path] = {}
    for path in sorted(paths, key=lambda path: (split_of(path.stem) != "training", path.name)):
        chosen.setdefault(guide_key(path.stem), path)
    guides = {}
    for key, path in sorted(chosen.items()):
        part = folder / "guides" / f"{key}.npz"
        if not part.exists():
            fit_guide(load_avatar(path)).save(part)
        guides[key] = Guide.load(part)
    return guides

"""The fast studio: training views of the reconstruction by ray casting, some a second on one core.

`Studio.open(...)` prepares poses and guides in the data set's folder; `Studio.view(split, index)` makes one `View` from (seed, split, index)
alone; `write_views` fills the folder, resuming where it stopped.
"""

from __future__ import annotations

import dataclasses
import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.rays import Hits, RayScene, SideView, facing, pixel_rays, scattered, side_view, signed_distance_and_normals
from a2v.geometry.visibility import vertex_normals
from a2v.io import atomic_path, read_npz, write_npz
from a2v.kinematics import rotvec_to_rotmat
from a2v.processes import start_fork_server
from a2v.studio.avatars import AVATAR_PARTS, Avatar, list_avatars, load_avatar
from a2v.studio.guide import Guide, GuideErrors, disturb, fit_guide, girth_errors, guide_key, stack_guides, unstack_guides
from a2v.studio.lighting import Light, Shadows, background, cast_shadows, develop, highlights, irradiance
from a2v.studio.posing import PoseLibrary, action_poses, joint_noise, natural_pose, open_pose
from a2v.studio.solid import PhotoFrame, Solid, caps, open_faces, smooth_normals, weld
from a2v.studio.variation import SPLITS, Build, Wardrobe, find_clothes, rebuild, recolor, split_of
from a2v.studio.view import GUIDE_SIZE, MAP_SIZE, PHOTO_SIZE, View, encode_pictures, view_path
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, OrthographicCamera, Progress, Surface
from a2v.version import __version__

VERSION = 1
"""Of what a seed gives: raise it when views change, so that a folder never mixes two kinds."""


@dataclass(frozen=True, kw_only=True)
class StudioSettings:
    """What the fast studio draws. Shares are of all views.

    Attributes
    ----------
    seed : int
        Of the data set.
    actions, open : float
        Shares of poses from recorded actions, and of T- and A-poses; the rest stand naturally.
    facing : float
        Share of people who roughly face the camera; the others are turned anyhow.
    yaw : float
        Standard deviation of the turn of those who face it, degrees.
    distance : tuple of 2 float
        Nearest and farthest camera, metres.
    height : tuple of 2 float
        Lowest and highest camera, metres over the floor.
    fill : float
        Longer side of the person's box as a fraction of the photo.
    points, surface_points : int
        Samples in space, and on the surface.
    near, far : float
        Standard deviations of the samples around the surface, metres.
    near_share, far_share : float
        Shares of the two; the rest is uniform in the person's box with a margin of 10 cm.
    same_avatar : int
        Successive views that show one avatar (reading it is a part of the cost).
    guide : GuideErrors
    """

    seed: int = 0
    actions: float = 0.3
    open: float = 0.1
    facing: float = 0.85
    yaw: float = 20.0
    distance: tuple[float, ...] = (2.5, 12.0)
    height: tuple[float, ...] = (0.8, 1.9)
    fill: float = 0.9
    points: int = 16384
    surface_points: int = 8192
    near: float = 0.015
    far: float = 0.05
    near_share: float = 0.5
    far_share: float = 0.35
    same_avatar: int = 4
    guide: GuideErrors = field(default_factory=GuideErrors)

    def __post_init__(self) -> None:
        if min(self.actions, self.open, self.facing) < 0 or max(self.actions + self.open, self.facing) > 1:
            raise InputError("shares of poses and of people who face the camera must be from 0 to 1 together")
        if min(self.near_share, self.far_share) < 0 or self.near_share + self.far_share > 1:
            raise InputError("near_share and far_share must be from 0 to 1 together")
        for name, least in (("distance", 1.5), ("height", 0.0)):
            pair = getattr(self, name)
            if len(pair) != 2 or not least <= pair[0] <= pair[1]:
                raise InputError(f"{name} is {pair}; expected two metres, the smaller one first and at least {least}")
        if not 0.1 <= self.fill <= 1 or min(self.points, self.surface_points, self.same_avatar) < 1:
            raise InputError("fill must be from 0.1 to 1, and points, surface_points and same_avatar at least 1")


@dataclass(frozen=True, eq=False)
class Layers:
    """What an avatar's faces are, (F,) bool each, and faces (C, 3) that close the wall: see `Solid`."""

    outer: BoolArray
    wall: BoolArray
    layered: BoolArray
    shell: BoolArray
    closing: IntArray


@dataclass(frozen=True, eq=False)
class _Prepared:
    """What does not depend on the view; `places` are `weld`'s."""

    avatar: Avatar
    places: IntArray
    layers: Layers


@dataclass(frozen=True, eq=False)
class Scene:
    """A person and the guide in the photo's frame.

    Attributes
    ----------
    surface : Surface
        The person, textured (albedo), metres.
    parts : (V,) int
        Body part of each vertex.
    normals : (V, 3) float32
    layers : Layers
    guide : (G, 3) float32
        Vertices of the guide.
    landmarks : (33, 3) float32
        The person's BlazePose landmarks as a body model has them (no error of the guide moves them).
    camera : OrthographicCamera
    yaw : float
        Degrees.
    avatar : str
    pose : str
        What the person does.
    """

    surface: Surface
    parts: IntArray
    normals: FloatArray
    layers: Layers
    guide: FloatArray
    landmarks: FloatArray
    camera: OrthographicCamera
    yaw: float
    avatar: str
    pose: str

    def solid(self) -> Solid:
        """The person as a solid."""
        layers = self.layers
        return Solid(self.surface.vertices, self.surface.faces, layers.wall, layers.outer, layers.layered, layers.shell, layers.closing)


class Studio:
    """Makes views.

    Parameters
    ----------
    avatars : folder of ``.glb`` files
    library : PoseLibrary
    guides : mapping of key (`guide_key`) to Guide
    settings : StudioSettings
    """

    def __init__(self, avatars: str | os.PathLike[str], library: PoseLibrary, guides: Mapping[str, Guide], settings: StudioSettings):
        """See the class."""
        paths = list_avatars(avatars)
        self.paths = {split: [path for path in paths if split_of(path.stem) == split] for split in SPLITS}
        self.library, self.guides, self.settings = library, guides, settings
        self._layers: dict[str, Layers] = {}

    @classmethod
    def open(cls, folder: str | os.PathLike[str], data: str | os.PathLike[str], settings: StudioSettings) -> Studio:
        """The studio of a data set's folder: its pose library and guides are made there at the first time (minutes), then read.

        Parameters
        ----------
        folder : path
            Of the data set.
        data : path
            Folder with ``avatars/`` and the motion data.

        Raises
        ------
        InputError
            No avatars or no motions.
        """
        folder, avatars = Path(folder), Path(data) / "avatars"
        paths = list_avatars(avatars)
        if not (folder / "poses.npz").exists():
            action_poses(load_avatar(paths[0]), str(data), seed=settings.seed).save(folder / "poses.npz")
        if not (folder / "guide.npz").exists():
            write_npz(folder / "guide.npz", stack_guides(_fit_guides(paths, folder)))
        return cls(avatars, PoseLibrary.load(folder / "poses.npz"), unstack_guides(read_npz(folder / "guide.npz")), settings)

    def _path(self, split: str, index: int) -> Path:
        """Every avatar of the split once, in an order of its own for each round."""
        paths = self.paths[split]
        if not paths:
            raise InputError(f"no avatar belongs to the split '{split}'; see a2v.reconstruction.synthetic.VALIDATION_IDENTITIES")
        block = index // self.settings.same_avatar
        order = np.random.default_rng([self.settings.seed, SPLITS.index(split), block // len(paths), 1]).permutation(len(paths))
        return paths[int(order[block % len(paths)])]

    def avatar_of(self, split: str, index: int) -> str:
        """Name of the avatar of a view."""
        return self._path(split, index).stem

    def _prepare(self, path: Path) -> _Prepared:
        avatar = _load(str(path))
        if path.stem not in self._layers:
            self._layers[path.stem] = find_layers(avatar)
        return _Prepared(avatar, _places(str(path)), self._layers[path.stem])

    def scene(self, split: str, index: int) -> Scene:
        """The person and the guide of a view; the same numbers give the same scene."""
        settings = self.settings
        generator = np.random.default_rng([settings.seed, SPLITS.index(split), index])
        prepared = self._prepare(self._path(split, index))
        plain = prepared.avatar
        build = Build.draw(generator)
        avatar = rebuild(plain, build)
        texture = recolor(plain.texture, _clothes(str(self._path(split, index))), generator)
        pose, name = self._pose(generator)
        yaw = generator.normal(0, settings.yaw) if generator.random() < settings.facing else generator.uniform(-180, 180)
        turn = np.asarray(rotvec_to_rotmat(np.array([0.0, np.radians(yaw), 0.0])))
        transforms = _turned(avatar.bone_transforms(pose), turn)
        person = avatar.skin(transforms)
        shift = np.array([0.0, -float(person[:, 1].min()), 0.0])
        low, high = person.min(axis=0) + shift, person.max(axis=0) + shift
        # near cameras are as likely as far ones in terms of the perspective that they give
        nearest, farthest = settings.distance
        distance = 1 / generator.uniform(1 / farthest, 1 / nearest)
        frame = PhotoFrame.looking((low + high) / 2, distance, float(generator.uniform(settings.height[0], settings.height[1])))
        view = frame.axes[2]
        errors = settings.guide
        guide = self._guide(plain.name)
        wrong = disturb(avatar, transforms, view, errors, generator)
        # a fit that turns a bone moves the body until the joints lie on the photo's again
        aligned = [avatar.bone_names.index(name) for name in _ALIGNED]
        gap = (wrong - transforms)[aligned, :3, 3].mean(axis=0)
        wrong[:, :3, 3] -= gap - (gap @ view) * view
        posed = guide.posed(plain, build.thicker(girth_errors(errors, generator)), wrong)
        seen, held = frame.warp(person + shift), frame.warp(posed + shift)
        held[:, :2] += errors.shift * generator.standard_normal(2)
        landmarks = frame.warp(guide.posed_landmarks(plain, build, transforms) + shift)
        # the photo's square around the person, and the guide's idea of the metre
        least, most = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
        origin = np.append((least + most) / 2, held[:, 2].mean())
        factor = float(np.exp(errors.scale * generator.standard_normal()))
        scale = settings.fill * PHOTO_SIZE / float((most - least).max()) / factor
        vertices = (factor * (seen - origin)).astype(np.float32)
        surface = Surface(
            vertices=vertices, faces=plain.faces, colors=dataclasses.replace(plain, texture=texture).vertex_colors(), uv=plain.uv, texture=texture,
            provenance={"avatar": plain.name, "pose": name},
        )  # fmt: skip
        return Scene(
            surface=surface,
            parts=plain.parts,
            normals=smooth_normals(vertices, plain.faces, prepared.places),
            layers=prepared.layers,
            guide=(factor * (held - origin)).astype(np.float32),
            landmarks=(factor * (landmarks - origin)).astype(np.float32),
            camera=OrthographicCamera(scale=scale, center_u=PHOTO_SIZE / 2, center_v=PHOTO_SIZE / 2),
            yaw=float((yaw + 180) % 360 - 180),
            avatar=plain.name,
            pose=name,
        )

    def truth(self, split: str, index: int) -> Surface:
        """The person of a view as a textured mesh (albedo) in the photo's frame: what reconstructions are compared with."""
        return self.scene(split, index).surface

    def view(self, split: str, index: int) -> View:
        """View `index` of a split; the same settings, split and index give the same view."""
        settings = self.settings
        scene = self.scene(split, index)
        generator = np.random.default_rng([settings.seed, SPLITS.index(split), index, 2])
        surface, camera = scene.surface, scene.camera
        rays = RayScene(surface.vertices, surface.faces)
        fore = side_view(rays, surface.vertices, surface.faces, scene.normals, camera, PHOTO_SIZE, MAP_SIZE, 1)
        rear = side_view(rays, surface.vertices, surface.faces, scene.normals, camera, PHOTO_SIZE, MAP_SIZE, -1)
        light = Light.draw(generator)
        shadows, gain = _light_up(rays, scene, fore, light, generator)
        image, mask, quality = _photograph(rays, scene, fore, light, shadows, gain, generator)
        guide_faces = self._guide(scene.avatar).faces
        guide_normals = vertex_normals(scene.guide, guide_faces).astype(np.float32)
        guide_rays = RayScene(scene.guide, guide_faces)
        guide_maps = [
            side_view(guide_rays, scene.guide, guide_faces, guide_normals, camera, PHOTO_SIZE, GUIDE_SIZE, side) for side in (1, -1)
        ]
        corners = scene.parts[surface.faces[fore.hits.face[fore.hits.hit]]]
        weights = np.concatenate(
            [1 - fore.hits.barycentric[fore.hits.hit].sum(axis=1, keepdims=True), fore.hits.barycentric[fore.hits.hit]], 1
        )
        parts = np.full(MAP_SIZE * MAP_SIZE, -1, np.int8)
        parts[fore.hits.hit] = np.take_along_axis(corners, weights.argmax(axis=1)[:, None], 1)[:, 0]
        maps = {
            "mask": mask,
            "normals_front": _packed(fore.normals), "normals_back": _packed(rear.normals),
            "depth_front": fore.depth, "depth_back": rear.depth,
            "parts_front": parts.reshape(MAP_SIZE, MAP_SIZE),
            "guide_normals_front": _packed(guide_maps[0].normals), "guide_normals_back": _packed(guide_maps[1].normals),
            "guide_depth_front": guide_maps[0].depth, "guide_depth_back": guide_maps[1].depth,
        }  # fmt: skip
        solid = scene.solid()
        on = _surface_samples(scene, solid, rays, gain, settings.surface_points, generator)
        points = _space_samples(scene, solid, settings, generator)
        both = np.concatenate([points, on.points])
        guide_distance, guide_at = signed_distance_and_normals(scene.guide, guide_faces, guide_normals, guide_rays, both)
        here = slice(len(points)), slice(len(points), None)  # in space, and on the surface
        return View(
            encoded=encode_pictures(image, quality, maps),
            camera=camera,
            points=points,
            distance=solid.signed_distance(points).astype(np.float16),
            guide_distance=guide_distance[here[0]].astype(np.float16),
            guide_normals=_packed(guide_at[here[0]]),
            surface_points=on.points,
            surface_normals=_packed(on.normals),
            surface_colors=on.colors,
            surface_visible=on.visible,
            surface_parts=on.parts,
            surface_guide_distance=guide_distance[here[1]].astype(np.float16),
            surface_guide_normals=_packed(guide_at[here[1]]),
            guide_vertices=scene.guide,
            avatar=scene.avatar,
            gain=gain.astype(np.float32),
            yaw=scene.yaw,
            seed=settings.seed,
            index=index,
            split=split,
            provenance={"version": VERSION, "pose": scene.pose},
        )

    def _guide(self, avatar: str) -> Guide:
        key = guide_key(avatar)
        if key not in self.guides:
            raise InputError(
                f"there is no guide '{key}' for avatar {avatar}; remove guide.npz from the data set's folder to make them anew"
            )
        return self.guides[key]

    def _pose(self, generator: np.random.Generator) -> tuple[dict[str, FloatArray], str]:
        kind = generator.random()
        if kind < self.settings.actions:
            index = int(generator.integers(len(self.library.actions)))
            return joint_noise(self.library.pose(index), generator), self.library.actions[index]
        if kind < self.settings.actions + self.settings.open:
            return joint_noise(open_pose(generator), generator), "open"
        return joint_noise(natural_pose(generator), generator), "natural"


_ALIGNED = ("Head", *(f"{side}{bone}" for side in ("Left", "Right") for bone in ("Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot")))


@lru_cache(maxsize=2)
def _load(path: str) -> Avatar:
    return load_avatar(path)


@lru_cache(maxsize=2)
def _clothes(path: str) -> Wardrobe:
    return find_clothes(_load(path))


@lru_cache(maxsize=2)
def _places(path: str) -> IntArray:
    avatar = _load(path)
    return weld(avatar.skin(avatar.rest_transforms))


def find_layers(avatar: Avatar) -> Layers:
    """Sort an avatar's faces; the mouth's pocket is no wall of the solid, so that it counts as filled."""
    rest = avatar.skin(avatar.rest_transforms)
    wig = np.isin(
        avatar.mesh_ids, [index for index, name in enumerate(avatar.mesh_names) if "wig" in name.lower() or "hair" in name.lower()]
    )
    outer = open_faces(rest, avatar.faces, rays=24)
    bare = outer
    if wig.any():
        bare = np.ones(len(wig), bool)
        bare[~wig] = open_faces(rest, avatar.faces[~wig], rays=24)
    head = avatar.parts[avatar.faces].max(axis=1) == AVATAR_PARTS.index("head")
    wall = bare | ~head | wig
    return Layers(outer, wall, (head | wig) & bool(wig.any()), wig, caps(avatar.faces[wall & ~wig], weld(rest)))


def _fit_guides(paths: Sequence[Path], folder: Path) -> dict[str, Guide]:
    """A guide for each sex and outfit, on the first avatar of the training split that has them (of any split where none has)."""
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


def _turned(transforms: FloatArray, turn: FloatArray) -> FloatArray:
    whole = np.eye(4)
    whole[:3, :3] = turn
    return np.asarray(whole @ transforms)


def _packed(normals: FloatArray) -> IntArray:
    return np.asarray(np.rint(127 * np.clip(normals, -1, 1)), np.int8)


def _light_up(rays: RayScene, scene: Scene, fore: SideView, light: Light, generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Smoothed shadows (512, 512, 1 + lamps) of what the photo sees, and the factor (3,) that develops its mean irradiance well."""
    import cv2

    hit = fore.hits.hit
    grid = (np.arange(MAP_SIZE) + 0.5) * PHOTO_SIZE / MAP_SIZE
    pixels = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)[hit]
    points = np.asarray(scene.camera.unproject(pixels, fore.depth.ravel()[hit]), np.float32)
    normals = fore.normals.reshape(-1, 3)[hit]
    found = cast_shadows(rays, points, normals, light, generator)
    shares = np.zeros((MAP_SIZE * MAP_SIZE, 1 + len(light.lamps)), np.float32)
    shares[hit, 0] = found.ambient
    shares[hit, 1:] = found.lamps.T
    weight = hit.astype(np.float32).reshape(MAP_SIZE, MAP_SIZE)
    smooth = np.empty((MAP_SIZE, MAP_SIZE, shares.shape[1]), np.float32)
    for channel in range(shares.shape[1]):
        sigma = 2.2 if channel == 0 else 1.4
        layer = cv2.GaussianBlur(shares[:, channel].reshape(weight.shape), (0, 0), sigma)
        smooth[..., channel] = layer / np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma), 1e-4)
    seen = smooth.reshape(-1, smooth.shape[2])[hit]
    mean = irradiance(light, normals, Shadows(seen[:, 0], seen[:, 1:].T)).mean(axis=0)
    exposure = float(np.clip(np.exp(generator.normal(-0.12, 0.25)), 0.45, 1.5)) / float(mean.mean())
    balance = np.exp(generator.normal(0, 0.05) * np.array([1.0, 0.0, -1.0]))
    # a camera takes most of the light's own cast out
    cast = (mean / mean.mean()) ** -generator.uniform(0.3, 1.0)
    gain: FloatArray = mean * exposure * balance * cast
    return smooth, gain


def _photograph(
    rays: RayScene, scene: Scene, fore: SideView, light: Light, shadows: FloatArray, gain: FloatArray, generator: np.random.Generator
) -> tuple[ByteArray, ByteArray, int]:
    """The photo, its mask (uint8) and the quality of its JPEG."""
    import cv2

    surface, camera, size = scene.surface, scene.camera, PHOTO_SIZE
    far = float(surface.vertices[:, 2].max()) + 1
    corner = camera.project(surface.vertices)
    low, high = np.floor(corner.min(axis=0)).astype(int) - 2, np.ceil(corner.max(axis=0)).astype(int) + 2
    low, high = np.clip(low, 0, size), np.clip(high, 0, size)
    columns, rows = np.arange(low[0], high[0]), np.arange(low[1], high[1])
    pixels = np.stack(np.meshgrid(columns + 0.5, rows + 0.5), axis=-1).reshape(-1, 2)
    down = np.array([0, 0, -1], np.float32)
    shape = (len(rows), len(columns))
    # rays are needed only close to what the maps show
    step = size // MAP_SIZE
    near = cv2.dilate(fore.hits.hit.reshape(MAP_SIZE, MAP_SIZE).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    index = np.flatnonzero(near[rows[:, None] // step, columns[None] // step].ravel())
    first = scattered(rays.cast(pixel_rays(camera, pixels[index], far), down), index, len(pixels))
    # the factor from irradiance over pi to the photo's numbers: so that the mean over the person is `gain`
    seen = _shade(scene, light, shadows, first, pixels)
    factor = gain / np.maximum(seen.irradiance.mean(axis=0), 1e-9)
    color = np.zeros((len(pixels), 3), np.float32)
    color[first.hit] = seen.color * factor
    coverage = first.hit.astype(np.float32)
    # pixels at the silhouette and at jumps of depth are averages of four rays
    depth = np.where(first.hit, first.distance, far + 9).reshape(shape).astype(np.float32)
    jump = cv2.dilate(depth, np.ones((3, 3))) - cv2.erode(depth, np.ones((3, 3))) > 0.02
    edge = np.flatnonzero(jump.ravel())
    offsets = np.array([[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]])
    fine_pixels = (pixels[edge][:, None] + offsets).reshape(-1, 2)
    fine = rays.cast(pixel_rays(camera, fine_pixels, far), down)
    fine_color = np.zeros((len(fine_pixels), 3), np.float32)
    fine_color[fine.hit] = _shade(scene, light, shadows, fine, fine_pixels).color * factor
    count = fine.hit.reshape(-1, 4).sum(axis=1)
    coverage[edge] = count / 4
    color[edge] = fine_color.reshape(-1, 4, 3).sum(axis=1) / np.maximum(count, 1)[:, None]
    feet = float(high[1])
    picture = background(size, feet, generator) * (gain / gain.mean())
    window = picture[low[1] : high[1], low[0] : high[0]]
    alpha = coverage.reshape(*shape, 1)
    window[:] = alpha * color.reshape(*shape, 3) + (1 - alpha) * window
    mask = np.zeros((size, size), np.uint8)
    mask[low[1] : high[1], low[0] : high[0]] = np.rint(255 * coverage).reshape(shape)
    image, quality = develop(picture, generator)
    return image, mask, quality


@dataclass(frozen=True, eq=False)
class _Shaded:
    color: FloatArray
    irradiance: FloatArray


def _shade(scene: Scene, light: Light, shadows: FloatArray, hits: Hits, pixels: FloatArray) -> _Shaded:
    """Linear colours (n, 3) of the hits (texture times light, plus highlights), and the irradiance over pi alone."""
    surface = scene.surface
    normals = facing(hits.interpolate(scene.normals, surface.faces), 1)
    at = (pixels[hits.hit] * (MAP_SIZE / PHOTO_SIZE) - 0.5).astype(np.float32)
    found = _sampled(shadows, at)
    reach = Shadows(found[:, 0], found[:, 1:].T)
    light_on = irradiance(light, normals, reach)
    albedo = texture_at(surface, hits.face[hits.hit], hits.barycentric[hits.hit])
    return _Shaded((albedo * light_on + highlights(light, normals, reach)).astype(np.float32), light_on)


def _sampled(image: np.ndarray, at: FloatArray) -> FloatArray:
    """Values (n, C) of an image (H, W, C) at columns and rows (n, 2), bilinear."""
    import cv2

    width = 4096  # OpenCV's maps are images: at most 32767 a side
    rows = -(-len(at) // width)
    padded = np.zeros((rows * width, 2), np.float32)
    padded[: len(at)] = at
    found = cv2.remap(image, padded.reshape(rows, width, 2), None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found).reshape(rows * width, -1)[: len(at)]


_LINEAR = srgb_to_linear(np.arange(256) / 255)


def texture_at(surface: Surface, faces: IntArray, barycentric: FloatArray) -> FloatArray:
    """The texture, linear light (n, 3) float32, at barycentric coordinates (n, 2) of faces (n,), bilinear.

    Raises
    ------
    InputError
        The surface has no texture.
    """
    if surface.uv is None or surface.texture is None:
        raise InputError("the surface has no texture")
    height, width = surface.texture.shape[:2]
    corners = surface.uv[faces]
    u, v = barycentric[:, :1], barycentric[:, 1:]
    place = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    at = np.stack([place[:, 0] * width - 0.5, (1 - place[:, 1]) * height - 0.5], axis=1)
    return np.asarray(_LINEAR[_sampled(surface.texture, at.astype(np.float32))])


@dataclass(frozen=True, eq=False)
class _OnSurface:
    points: FloatArray
    normals: FloatArray
    colors: ByteArray
    visible: BoolArray
    parts: IntArray


def _surface_samples(
    scene: Scene, solid: Solid, rays: RayScene, gain: FloatArray, count: int, generator: np.random.Generator
) -> _OnSurface:
    """Points uniform by area on the outer surface."""
    surface = scene.surface
    face, uv = _uniform(surface.vertices, surface.faces, solid.outer, count, generator)
    hits = Hits(np.ones(len(face), bool), np.zeros(len(face)), face, uv)
    points, normals = hits.interpolate(surface.vertices, surface.faces), hits.interpolate(scene.normals, surface.faces)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    albedo = texture_at(surface, face, uv)
    visible = ~rays.occluded(points + 1.5e-3 * normals, np.array([0, 0, 1], np.float32))
    return _OnSurface(
        points,
        normals,
        np.rint(255 * linear_to_srgb(albedo * gain)).astype(np.uint8),
        visible,
        scene.parts[surface.faces[face, 0]].astype(np.int8),
    )


def _uniform(
    vertices: FloatArray, faces: IntArray, chosen: IntArray, count: int, generator: np.random.Generator
) -> tuple[IntArray, FloatArray]:
    """Faces (n,) and barycentric coordinates (n, 2) of points uniform by area on the chosen faces."""
    corner = vertices[faces[chosen]].astype(np.float64)
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    total = np.cumsum(area)
    face = chosen[np.minimum(np.searchsorted(total, generator.random(count) * total[-1]), len(chosen) - 1)]
    uv = generator.random((count, 2))
    uv = np.where(uv.sum(axis=1, keepdims=True) > 1, 1 - uv, uv)
    return face, uv.astype(np.float32)


def _space_samples(scene: Scene, solid: Solid, settings: StudioSettings, generator: np.random.Generator) -> FloatArray:
    """Points (N, 3) float32 near the surface and in the person's box, in random order."""
    vertices = scene.surface.vertices
    near, far = round(settings.near_share * settings.points), round(settings.far_share * settings.points)
    face, uv = _uniform(vertices, scene.surface.faces, solid.outer, near + far, generator)
    on = Hits(np.ones(len(face), bool), np.zeros(len(face)), face, uv).interpolate(vertices, scene.surface.faces)
    spread = np.concatenate([np.full(near, settings.near), np.full(far, settings.far)])
    on = on + spread[:, None] * generator.standard_normal((near + far, 3))
    low, high = vertices.min(axis=0) - 0.1, vertices.max(axis=0) + 0.1
    box = generator.uniform(low, high, (settings.points - near - far, 3))
    return np.asarray(generator.permutation(np.concatenate([on, box])), np.float32)


# -------------------------------------------------------------------------------------------------------------- data sets

_OPEN: dict[str, Studio] = {}


def _start(folder: str, data: str, settings: StudioSettings) -> None:
    import cv2

    cv2.setNumThreads(1)
    _OPEN[folder] = Studio.open(folder, data, settings)


def _write(folder: str, split: str, index: int) -> int:
    _OPEN[folder].view(split, index).save(view_path(folder, split, index))
    return index


def write_views(
    folder: str | os.PathLike[str],
    data: str | os.PathLike[str],
    counts: Mapping[str, int],
    *,
    settings: StudioSettings | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> float:
    """Fill a data set's folder with views; those that are there already are kept.

    Parameters
    ----------
    folder : path
        ``views/<split>/000123.npz`` each, ``index.json``, ``guide.npz``, ``poses.npz``.
    data : path
        Folder with ``avatars/`` and the motion data.
    counts : mapping of split to int
        Views in all of each split.
    settings : StudioSettings
    workers : int
        Processes, each on one core.
    progress : Progress, optional
        Over new views; at the first time the guides of the folder are made before.

    Returns
    -------
    float
        Views a second, 0 where there was nothing left to do.

    Raises
    ------
    InputError
        An unknown split, bad numbers, or a folder that other settings made.
    """
    settings = settings or StudioSettings()
    folder = Path(folder)
    if unknown := [split for split in counts if split not in SPLITS]:
        raise InputError(f"unknown split '{unknown[0]}'; choose from {', '.join(SPLITS)}")
    if workers < 1 or min(counts.values(), default=0) < 0:
        raise InputError("workers must be at least 1, and numbers of views at least 0")
    _write_index(folder, settings)
    studio = Studio.open(folder, data, settings)
    todo = [(split, index) for split, count in counts.items() for index in range(count) if not view_path(folder, split, index).exists()]
    started = time.perf_counter()
    for done, _ in enumerate(_results(studio, folder, Path(data), settings, todo, workers), 1):
        if progress:
            progress(done, len(todo))
    return len(todo) / (time.perf_counter() - started) if todo else 0.0


def _results(
    studio: Studio, folder: Path, data: Path, settings: StudioSettings, todo: Sequence[tuple[str, int]], workers: int
) -> Iterator[int]:
    if workers == 1:
        _OPEN[str(folder)] = studio
        for split, index in todo:
            yield _write(str(folder), split, index)
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    # blocks of one avatar stay together; forkserver, since open3d holds threads
    start_fork_server()
    context = multiprocessing.get_context("forkserver")
    chunk = settings.same_avatar
    with ProcessPoolExecutor(workers, mp_context=context, initializer=_start, initargs=(str(folder), str(data), settings)) as pool:
        try:
            yield from pool.map(_write, [str(folder)] * len(todo), *zip(*todo, strict=True), chunksize=chunk)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _write_index(folder: Path, settings: StudioSettings) -> None:
    """Write ``index.json``, or check that the folder was made by the same settings."""
    plain = json.loads(json.dumps(dataclasses.asdict(settings)))
    path = folder / "index.json"
    if path.exists():
        from a2v.studio.view import read_index

        found = read_index(folder)
        if found.get("settings") != plain or found.get("version") != VERSION:
            raise InputError(f"{folder} was made by other settings or another version (see its index.json); choose another --out")
        return
    content = {
        "version": VERSION,
        "a2v": __version__,
        "settings": plain,
        "validation": "variation.VALIDATION_IDENTITIES and VALIDATION_OUTFITS",
    }
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1))

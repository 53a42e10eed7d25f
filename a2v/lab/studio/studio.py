"""The fast studio: training views of the reconstruction by ray casting, some per second on one
core.

`Studio.open(...)` prepares poses and guides in the data set's folder. `Studio.view(split, index)`
makes one `View` that depends only on (seed, split, index).
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import RayScene, SideView, side_view, signed_distance_and_normals
from a2v.io import read_npz
from a2v.lab.studio.avatar_files import list_avatars, load_avatar
from a2v.lab.studio.guide import Guide, guide_key, prepare_guides, unstack_guides
from a2v.lab.studio.makehuman.dressing import Dresser, dress
from a2v.lab.studio.makehuman.named import NAMED_PEOPLE, named_person
from a2v.lab.studio.makehuman.people import Wardrobes
from a2v.lab.studio.pose_source import PoseSource
from a2v.lab.studio.posing import Pose, PoseLibrary, action_poses
from a2v.lab.studio.quick.bank import PoseBank, open_bank
from a2v.lab.studio.quick.poses import draw_pose
from a2v.lab.studio.quick.settings import QuickSettings
from a2v.lab.studio.samples import sample_space
from a2v.lab.studio.scene import Dressed, FaceKinds, Scene, draw_scene, sort_faces
from a2v.lab.studio.settings import VERSION, StudioSettings
from a2v.lab.studio.shot import Shot, photograph
from a2v.lab.studio.stand import prepare_avatar
from a2v.lab.studio.streams import Stream
from a2v.lab.studio.things.backgrounds import Backgrounds
from a2v.lab.studio.things.clutter import Clutter
from a2v.lab.studio.variation import SPLITS, split_of
from a2v.lab.studio.view import GUIDE_SIZE, MAP_SIZE, PHOTO_SIZE, View, encode_pictures
from a2v.types import FloatArray, IntArray, Surface


class Studio:
    """Makes views.

    Parameters
    ----------
    avatars : folder of ``.glb`` files
    library : PoseLibrary
    guides : mapping of key (`guide_key`) to Guide
    settings : StudioSettings
    dresser : Dresser, optional
        Makes the people of MakeHuman, if the settings include some.
    data : path, optional
        Folder with MakeHuman's archive, for people with a name (`NAMED_PEOPLE`).
    bank : PoseBank, optional
        Poses of ``settings.varied``.
    """

    def __init__(
        self,
        avatars: str | os.PathLike[str],
        library: PoseLibrary,
        guides: Mapping[str, Guide],
        settings: StudioSettings,
        dresser: Dresser | None = None,
        data: str | os.PathLike[str] | None = None,
        bank: PoseBank | None = None,
    ):
        """See the class.

        Raises
        ------
        InputError
            No avatars.
        """
        paths = list_avatars(avatars)
        self.paths = {
            split: [path for path in paths if split_of(path.stem) == split] for split in SPLITS
        }
        self.library, self.guides, self.settings = library, guides, settings
        self._faces: dict[str, FaceKinds] = {}
        self._dresser, self._data, self._bank = dresser, data, bank
        self._photographs = Backgrounds(settings.backgrounds) if settings.photographs else None
        self._wardrobes: Wardrobes | None = None
        self._last: tuple[str, Dressed] | None = None

    @classmethod
    def open(
        cls, folder: str | os.PathLike[str], data: str | os.PathLike[str], settings: StudioSettings
    ) -> Studio:
        """Open the studio of a data set's folder.

        Its pose library and guides are made there at the first call (minutes), and later read.

        Parameters
        ----------
        folder : path
            Folder of the data set.
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
            action_poses(load_avatar(paths[0]), str(data), seed=settings.seed).save(
                folder / "poses.npz"
            )
        prepare_guides(paths, folder)
        dresser = None if settings.people == "avatars" else Dresser(data, settings.seed)
        bank = open_bank(folder, data) if settings.varied else None
        guides = unstack_guides(read_npz(folder / "guide.npz"))
        return cls(
            avatars, PoseLibrary.load(folder / "poses.npz"), guides, settings, dresser, data, bank
        )

    def _path(self, split: str, index: int) -> Path:
        """Return the path of a view's avatar: every avatar of the split once per round, in another
        order for each round."""
        paths = self.paths[split]
        if not paths:
            raise InputError(
                f"no avatar belongs to the split '{split}'; see "
                "a2v.lab.studio.variation.VALIDATION_IDENTITIES"
            )
        block = index // self.settings.same_avatar
        order = np.random.default_rng(
            [self.settings.seed, SPLITS.index(split), block // len(paths), Stream.ORDER]
        ).permutation(len(paths))
        return paths[int(order[block % len(paths)])]

    def avatar_of(self, split: str, index: int) -> str:
        """Return the name of the avatar of a view.

        Raises
        ------
        InputError
            No avatar belongs to the split.
        """
        dresser = self._dresser_of(index)
        return (
            dresser.person(split, index // self.settings.same_avatar).name
            if dresser
            else self._path(split, index).stem
        )

    def _dresser_of(self, index: int) -> Dresser | None:
        """Return the dresser of a view's person; None for the avatars. For "both" every other block
        of views has a dresser."""
        block = index // self.settings.same_avatar
        return self._dresser if self.settings.people != "both" or block % 2 else None

    def scene(
        self, split: str, index: int, *, avatar: str = "", stance: str = "", turn: float = 0.0
    ) -> Scene:
        """Make the scene of a view: the person and the guide. The same arguments give the same
        scene.

        Parameters
        ----------
        avatar : str
            Name of the person. Default: chosen by the index and the number of avatars. For
            MakeHuman's people it is one of `NAMED_PEOPLE`.
        stance : str
            Class of `STANCES` from which the pose is drawn.
        turn : float
            For another photo of the same person in the same clothes: the turn since the first
            photo, degrees (positive to the person's left). Pose and camera are drawn again. 0 for
            the first photo.

        Raises
        ------
        InputError
            The split has no avatar, the name is unknown, the avatar's file is broken, it has no
            guide, or MakeHuman's archive is missing.
        """
        generator = np.random.default_rng([self.settings.seed, SPLITS.index(split), index])
        poses = PoseSource(self.library, varied=self._varied(split), stance=stance)
        draw = partial(draw_scene, settings=self.settings, generator=generator)
        if turn:
            draw = partial(
                draw,
                again=(
                    turn,
                    np.random.default_rng([*self._seed_of(split, index, turn), Stream.AGAIN]),
                ),
            )
        if self.settings.surrounds:
            chance = np.random.default_rng(
                [self.settings.seed, SPLITS.index(split), index, Stream.THINGS]
            )
            draw = partial(draw, clutter=self._clutter(chance), chance=chance)
        if avatar in NAMED_PEOPLE:
            return draw(self._named_person(avatar), poses)
        if not avatar and (dresser := self._dresser_of(index)):
            made = dresser.dressed(split, index // self.settings.same_avatar)
            return draw(made, dataclasses.replace(poses, frames=dresser.frames))
        path = self._named(avatar) if avatar else self._path(split, index)
        prepared = prepare_avatar(str(path))
        if path.stem not in self._faces:
            self._faces[path.stem] = sort_faces(prepared.avatar)
        return draw(Dressed(prepared, self._faces[path.stem], self._guide(path.stem)), poses)

    def _seed_of(self, split: str, index: int, turn: float) -> list[int]:
        """Return the first numbers of the seed of a view, or of another photo of its person."""
        first = [self.settings.seed, SPLITS.index(split), index]
        return [*first, 1 + round(turn) % 360] if turn else first

    def _clutter(self, generator: np.random.Generator) -> Clutter:
        """Draw the objects around a person, by the settings' shares."""
        settings = self.settings
        return Clutter.draw(
            generator,
            things=settings.things,
            furniture=settings.furniture,
            photographs=settings.photographs,
            backgrounds=self._photographs,
        )

    def _named_person(self, name: str) -> Dressed:
        """Return one of `NAMED_PEOPLE`; the last one is cached."""
        if self._last is None or self._last[0] != name:
            if self._data is None:
                raise InputError(
                    f"{name} is one of MakeHuman's people; give the folder that holds their archive"
                )
            self._wardrobes = self._wardrobes or Wardrobes(self._data)
            self._last = name, dress(named_person(name), self._wardrobes)
        return self._last[1]

    def _varied(self, split: str) -> Callable[[np.random.Generator], Pose] | None:
        """Return a function that draws poses of the bank; None without a bank."""
        if self._bank is None:
            return None
        return partial(draw_pose, self._bank, split, QuickSettings(natural=0.0, open=0.0))

    def _named(self, avatar: str) -> Path:
        for path in (path for paths in self.paths.values() for path in paths):
            if path.stem == avatar:
                return path
        raise InputError(
            f"there is no avatar {avatar}.glb; give the data's folder with all of its avatars"
        )

    def truth(self, split: str, index: int) -> Surface:
        """Return the person of a view as a textured mesh (albedo) in the photo's frame: the ground
        truth of reconstructions."""
        return self.scene(split, index).surface

    def shot(self, split: str, index: int, scene: Scene) -> Shot:
        """Make the photo of a scene, with samples of the person's surface.

        Photo and samples are those of `view`, in a tenth of the time.
        """
        return self._shot(split, index, scene, self._chance(split, index, scene))

    def _shot(self, split: str, index: int, scene: Scene, generator: np.random.Generator) -> Shot:
        backdrop = np.random.default_rng(
            [self.settings.seed, SPLITS.index(split), index, Stream.BACKDROP]
        )
        return photograph(scene, self.settings.surface_points, generator, backdrop)

    def _chance(self, split: str, index: int, scene: Scene) -> np.random.Generator:
        """Return the generator of a scene's photo."""
        return np.random.default_rng([*self._seed_of(split, index, scene.turn), Stream.PHOTO])

    def view(self, split: str, index: int, scene: Scene | None = None) -> View:
        """Make view `index` of a split; the same settings, split and index give the same view.

        `scene` is the view's scene, if it has been made already.

        Raises
        ------
        InputError
            See `scene`.
        """
        scene = scene or self.scene(split, index)
        generator = self._chance(split, index, scene)
        shot = self._shot(split, index, scene, generator)
        photo, fore, on, solid = shot.photo, shot.fore, shot.samples, shot.solid
        rear = side_view(shot.rays, scene.normals, scene.camera, PHOTO_SIZE, MAP_SIZE, -1)
        guide = scene.guide, scene.guide_faces
        guide_normals = vertex_normals(*guide).astype(np.float32)
        guide_rays = RayScene(*guide)
        maps: dict[str, np.ndarray] = {"mask": photo.mask, "parts_front": _see_parts(scene, fore)}
        if scene.shown is not None or "cut" in scene.around:
            maps["things"] = photo.things
        for start, pair in (
            ("", (fore, rear)),
            ("guide_", _see_both_sides(guide_rays, guide_normals, scene, GUIDE_SIZE)),
        ):
            for side, seen in zip(("front", "back"), pair, strict=True):
                maps |= {
                    f"{start}normals_{side}": packed_normals(seen.normals),
                    f"{start}depth_{side}": seen.depth,
                }
        points = sample_space(scene, solid, self.settings, generator)
        both = np.concatenate([points, on.points])
        guide_distance, guide_at = signed_distance_and_normals(
            *guide, guide_normals, guide_rays, both
        )
        here, there = slice(len(points)), slice(len(points), None)  # in space, and on the surface
        return View(
            encoded=encode_pictures(photo.image, photo.quality, maps),
            camera=scene.camera,
            points=points,
            distance=solid.signed_distance(points).astype(np.float16),
            guide_distance=guide_distance[here].astype(np.float16),
            guide_normals=packed_normals(guide_at[here]),
            surface_points=on.points,
            surface_normals=packed_normals(on.normals),
            surface_colors=on.colors,
            surface_visible=on.visible,
            surface_parts=on.parts,
            surface_guide_distance=guide_distance[there].astype(np.float16),
            surface_guide_normals=packed_normals(guide_at[there]),
            guide_vertices=scene.guide,
            avatar=scene.avatar,
            gain=photo.gain.astype(np.float32),
            yaw=scene.yaw,
            seed=self.settings.seed,
            index=index,
            split=split,
            provenance={"version": VERSION, "pose": scene.pose}
            | ({"around": dict(scene.around)} if scene.around else {}),
        )

    def _guide(self, avatar: str) -> Guide:
        key = guide_key(avatar)
        if key not in self.guides:
            raise InputError(
                f"there is no guide '{key}' for avatar {avatar}; remove guide.npz from the data "
                "set's folder to make them again"
            )
        return self.guides[key]


def _see_both_sides(
    rays: RayScene, normals: FloatArray, scene: Scene, size: int
) -> tuple[SideView, SideView]:
    """Render a mesh from the front and, through it, its back, `size` pixels a side."""
    fore, rear = (
        side_view(rays, normals, scene.camera, PHOTO_SIZE, size, side) for side in (1, -1)
    )
    return fore, rear


def _see_parts(scene: Scene, fore: SideView) -> IntArray:
    """Return the body part (512, 512) int8 of the nearest corner of each pixel's hit; -1
    outside."""
    hit = fore.hits.hit
    corners = scene.parts[scene.surface.faces[fore.hits.face[hit]]]
    weights = np.concatenate(
        [1 - fore.hits.barycentric[hit].sum(axis=1, keepdims=True), fore.hits.barycentric[hit]], 1
    )
    parts = np.full(MAP_SIZE * MAP_SIZE, -1, np.int8)
    parts[hit] = np.take_along_axis(corners, weights.argmax(axis=1)[:, None], 1)[:, 0]
    return parts.reshape(MAP_SIZE, MAP_SIZE)


def packed_normals(normals: FloatArray) -> IntArray:
    """Return unit normals as int8, where 127 is 1."""
    return np.asarray(np.rint(127 * np.clip(normals, -1, 1)), np.int8)

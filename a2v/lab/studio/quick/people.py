"""The quick studio, which chooses the person of each view and makes shards that depend only on
(seed, split, number)."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path

import numpy as np

from a2v.body.places import canonical_places
from a2v.errors import InputError
from a2v.io import read_npz
from a2v.lab.studio.avatar_files import list_avatars
from a2v.lab.studio.guide import Guide, guide_key, prepare_guides, unstack_guides
from a2v.lab.studio.makehuman.dressing import Dresser
from a2v.lab.studio.quick.bank import PoseBank, open_bank
from a2v.lab.studio.quick.photo import places_of, quick_view, softened
from a2v.lab.studio.quick.poses import draw_pose
from a2v.lab.studio.quick.settings import BLOCK, OUTFIT, SHARD, QuickSettings
from a2v.lab.studio.quick.views import QuickShard, QuickView
from a2v.lab.studio.stand import Outfit, PreparedAvatar, draw_outfit, prepare_avatar
from a2v.lab.studio.streams import Stream
from a2v.lab.studio.things.backgrounds import Backgrounds
from a2v.lab.studio.things.clutter import Clutter, CutOut
from a2v.lab.studio.variation import SPLITS, split_of
from a2v.types import FloatArray, Progress

HELD_OUT: tuple[str, ...] = ("Asian_M_1", "Black_M_1", "White_F_1")
"""Avatars of the studio's training split that quick views show only in the validation split. The
studio's own validation and report people are in neither: they are for the figures of methods
that use the network."""
TRIES = 20
CROWD = 64
"""Number of successive blocks with the same other people."""


def prepare_folder(
    folder: str | os.PathLike[str], data: str | os.PathLike[str], progress: Progress | None = None
) -> None:
    """Make a folder's bank of poses and guides, unless they exist; it takes a quarter of an hour.

    Parameters
    ----------
    folder, data : path
        See `QuickStudio.open`.
    progress : Progress, optional
        Counts the clips of the bank.

    Raises
    ------
    InputError
        No avatars or motions.
    """
    open_bank(folder, data, progress)
    prepare_guides(list_avatars(Path(data) / "avatars"), Path(folder))


class QuickStudio:
    """Makes quick views.

    Parameters
    ----------
    paths : sequence of path
        Files of avatars; those of the studio's validation split are left out.
    bank : PoseBank
    guides : mapping of key (`guide_key`) to Guide
    settings : QuickSettings
    dresser : Dresser, optional
        Makes the people of MakeHuman, if the settings include some.

    Raises
    ------
    InputError
        The settings include MakeHuman's people but there is no dresser, or their folder of
        backgrounds has no picture.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        bank: PoseBank,
        guides: Mapping[str, Guide],
        settings: QuickSettings,
        dresser: Dresser | None = None,
    ) -> None:
        """See the class."""
        if dresser is None and settings.people != "avatars":
            raise InputError(
                f"people is '{settings.people}', but the archive of MakeHuman is missing; set "
                "people to avatars"
            )
        own = [path for path in paths if split_of(path.stem) == "training"]
        self.paths = {
            split: [path for path in own if quick_split_of(path.stem) == split] for split in SPLITS
        }
        self.bank, self.guides, self.settings, self.dresser = bank, guides, settings, dresser
        self._photographs = Backgrounds(settings.backgrounds) if settings.photographs else None
        self._crowd: tuple[tuple[str, int], list[CutOut]] | None = None

    @classmethod
    def open(
        cls, folder: str | os.PathLike[str], data: str | os.PathLike[str], settings: QuickSettings
    ) -> QuickStudio:
        """Open the quick studio of a folder, which `prepare_folder` prepares first.

        Parameters
        ----------
        folder : path
            Folder of the views.
        data : path
            Folder with ``avatars/``, the motion data and, unless people is "avatars", MakeHuman's
            archive.

        Raises
        ------
        InputError
            No avatars, motions or archive.
        """
        prepare_folder(folder, data)
        dresser = None if settings.people == "avatars" else Dresser(data, settings.seed)
        bank, guides = open_bank(folder, data), unstack_guides(read_npz(Path(folder) / "guide.npz"))
        return cls(list_avatars(Path(data) / "avatars"), bank, guides, settings, dresser)

    def shard(self, split: str, number: int) -> QuickShard:
        """Make shard `number` of a split, 64 views of four people.

        The same settings, split and number give the same shard.

        Raises
        ------
        InputError
            The split has no people, or an avatar's file or guide is missing or broken.
        """
        blocks = range(SHARD // BLOCK * number, SHARD // BLOCK * (number + 1))
        return QuickShard.of([view for block in blocks for view in self.block(split, block)])

    def block(self, split: str, number: int, *, outfits: int = BLOCK // OUTFIT) -> list[QuickView]:
        """Make the 16 views of one person, in a new outfit every four. For "both" every other block
        shows an avatar."""
        settings = self.settings
        generator = np.random.default_rng(
            [settings.seed, SPLITS.index(split), number, Stream.QUICK_BLOCK]
        )
        prepared, guide = self._person(split, number, generator)
        places = places_of(prepared, guide, canonical_places())
        others = self._passers_by(split, number // CROWD) if settings.others else []
        views: list[QuickView] = []
        for _ in range(outfits):
            outfit = draw_outfit(prepared, generator)
            outfit = dataclasses.replace(outfit, texture=softened(outfit.texture))
            views += [
                self._view(split, outfit, guide, places, others, generator) for _ in range(OUTFIT)
            ]
        return views

    def _passers_by(self, split: str, number: int) -> list[CutOut]:
        """Return the other people of a group of blocks: four of the split, each in four views
        without objects. The last ones are cached."""
        if self._crowd is None or self._crowd[0] != (split, number):
            plain = dataclasses.replace(
                self.settings,
                cut=0.0,
                shift=0.0,
                things=0.0,
                furniture=0.0,
                others=0.0,
                photographs=0.0,
            )
            studio = copy(self)
            studio.settings = plain
            blocks = [10**6 + 4 * number + at for at in range(4)]
            cut = [
                CutOut.of(view.image, view.mask)
                for block in blocks
                for view in studio.block(split, block, outfits=1)
            ]
            self._crowd = (split, number), cut
        return self._crowd[1]

    def _view(
        self,
        split: str,
        outfit: Outfit,
        guide: Guide,
        places: FloatArray,
        others: Sequence[CutOut],
        generator: np.random.Generator,
    ) -> QuickView:
        """Draw a view that shows enough of the person."""
        settings = self.settings
        for _ in range(TRIES):
            pose = draw_pose(self.bank, split, settings, generator)
            clutter = Clutter.draw(
                generator,
                things=settings.things,
                furniture=settings.furniture,
                others=settings.others,
                people=others,
                photographs=settings.photographs,
                backgrounds=self._photographs,
            )
            made = quick_view(
                outfit, guide, places, pose | clutter.grip, settings, generator, clutter
            )
            if made is not None:
                return made
        raise InputError(
            f"{outfit.avatar.name} is hardly visible in {TRIES} pictures; remove the avatar's "
            "file if it is broken"
        )

    def _person(
        self, split: str, number: int, generator: np.random.Generator
    ) -> tuple[PreparedAvatar, Guide]:
        """Return the person of a block, and the guide."""
        if self.dresser is not None and (self.settings.people == "makehuman" or number % 2):
            made = self.dresser.dressed(split, number)
            return made.prepared, made.guide
        paths = self.paths[split]
        if not paths:
            raise InputError(
                f"no avatar belongs to the quick views' split '{split}'; see "
                "a2v.lab.studio.quick.people.HELD_OUT"
            )
        path = paths[int(generator.integers(len(paths)))]
        key = guide_key(path.stem)
        if key not in self.guides:
            raise InputError(
                f"there is no guide '{key}' for avatar {path.stem}; remove guide.npz from the "
                "views' folder to make them again"
            )
        return prepare_avatar(str(path)), self.guides[key]


def quick_split_of(avatar: str) -> str:
    """Return the quick views' split, one of `SPLITS`, of an avatar of the studio's training
    split."""
    return "validation" if avatar.rpartition("_")[0] in HELD_OUT else "training"

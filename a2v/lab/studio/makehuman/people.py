"""Persons to photograph: a shape of Anny's, a skin, hair, clothes, shoes and sometimes a hat."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from a2v.body import load_body_model
from a2v.errors import InputError
from a2v.lab.studio.makehuman.assets import Archive, Item
from a2v.lab.studio.streams import Stream
from a2v.lab.studio.variation import SPLITS
from a2v.types import ByteArray

ARCHIVE = "makehuman_cc0.zip"
HELD_OUT: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "skins": ("young_asian_female", "middleage_african_male", "old_caucasian_male"),
        "clothes": ("female_elegantsuit01", "male_casualsuit05", "male_casualsuit06"),
        "hair": ("braid01", "short02", "afro01"),
    }
)
"""Items that nobody in the training split wears, and everybody in the validation split."""
ODD_SKINS = ("default", "toon01", "special_suit")
ODD_CLOTHES = ("male_worksuit01",)
"""Clothes with a texture that is painted for another layout than their mesh's."""
HATS = ("fedora", "fedora_cocked")
WOMENS_HAIR = ("afro01", "bob01", "bob02", "braid01", "long01", "ponytail01", "short03")
UNDER_HATS = ("short03", "short04")
HAIR_COLORS = (
    (22, 18, 16),
    (44, 30, 22),
    (82, 54, 34),
    (128, 88, 52),
    (196, 158, 104),
    (132, 62, 30),
)
GREY_HAIR = ((150, 146, 142), (222, 218, 212))
EYE_COLORS = ((70, 44, 24), (92, 66, 40), (70, 100, 120), (86, 106, 74), (40, 28, 20))


@dataclass(frozen=True)
class Person:
    """A drawn person: a shape by Anny's parameters, and the names of the items ("" for none)."""

    name: str
    shape: Mapping[str, float]
    skin: str
    hair: str
    outfit: str
    shoes: str
    hat: str
    hair_color: tuple[float, float, float]
    eye_color: tuple[float, float, float]


class Wardrobes:
    """The items of an archive of MakeHuman's, by kind and split.

    Raises
    ------
    InputError
        The archive is missing or broken, or has no items for a split.
    """

    def __init__(self, data: str | os.PathLike[str]) -> None:
        """`data` is the folder of the archive."""
        self.archive = Archive(Path(data) / ARCHIVE)
        self._clothes = {
            name: path
            for name, path in self.archive.under("clothes", ".mhclo").items()
            if name not in ODD_CLOTHES
        }
        self._hair = self.archive.under("hair", ".mhclo")
        self._skins = {
            name: path
            for name, path in self.archive.under("skins", ".mhmat").items()
            if not any(odd in name for odd in ODD_SKINS)
        }
        self._items: dict[str, Item] = {}

    def names(self, kind: str, split: str, *, sex: str = "") -> tuple[str, ...]:
        """Return the names of items of a kind ("skins", "clothes", "hair", "shoes", "hats") for a
        split, of one `sex` ("female", "male") if given."""
        known = {"skins": self._skins, "hair": self._hair}.get(kind, self._clothes)
        held = HELD_OUT.get(kind, ())
        found = []
        for name in sorted(known):
            other = "shoes" if name.startswith("shoes") else "hats" if name in HATS else "clothes"
            if known is self._clothes and other != kind:
                continue
            if held and (name in held) != (split == "validation"):
                continue
            if (
                sex
                and kind == "hair"
                and (name in WOMENS_HAIR) != (sex == "female")
                and name not in ("afro01", "short03")
            ):
                continue
            if sex and kind in ("skins", "clothes") and not re.search(rf"(^|_){sex}\d*(_|$)", name):
                continue
            found.append(name)
        return tuple(found)

    def item(self, name: str) -> Item:
        """Return an item of clothing; its file is read only once."""
        if name not in self._items:
            path = self._hair.get(name) or self._clothes.get(name)
            if path is None:
                raise InputError(f"{self.archive.path} has no '{name}' to wear")
            self._items[name] = self.archive.item(path)
        return self._items[name]

    def skin(self, name: str) -> ByteArray:
        """Return the texture (H, W, 3) of a skin."""
        return np.ascontiguousarray(self.archive.texture(self._skins[name])[..., :3])


def draw_shape(generator: np.random.Generator, sex: str, age: float) -> dict[str, float]:
    """Draw Anny's shape parameters for a sex ("female", "male") and age (1/3 is a child of about
    ten, 2/3 a young adult, 1 old)."""
    shape = {
        "gender": float(
            generator.uniform(0.85, 1) if sex == "female" else generator.uniform(0, 0.15)
        ),
        "age": age,
        "muscle": float(generator.uniform(0.2, 0.85)),
        "weight": float(np.clip(generator.normal(0.52, 0.18), 0.15, 0.98)),
        "height": float(np.clip(generator.normal(0.42, 0.12), 0.12, 0.72)),
        "proportions": float(generator.uniform(0.3, 0.9)),
    }
    return shape | {
        name: float(np.clip(generator.normal(0, 0.15), -0.4, 0.4))
        for name in load_body_model().shape_names[len(shape) :]
    }


def draw_person(wardrobes: Wardrobes, split: str, number: int, seed: int) -> Person:
    """Draw a person of a split; the same numbers give the same person."""
    generator = np.random.default_rng([seed, SPLITS.index(split), number, Stream.PERSON])

    def choose(names: Sequence[str]) -> str:
        return str(names[int(generator.integers(len(names)))]) if names else ""

    sex = str(generator.choice(["female", "male"]))
    age = float(
        generator.choice(
            [generator.uniform(0.6, 0.97), generator.uniform(0.36, 0.6)], p=[0.85, 0.15]
        )
    )
    shape = draw_shape(generator, sex, age)
    span = "young" if age < 0.76 else "middleage" if age < 0.88 else "old"
    skins = wardrobes.names("skins", split, sex=sex)
    skin = choose([name for name in skins if name.startswith(span)] or skins)
    outfit, shoes = (
        choose(wardrobes.names("clothes", split, sex=sex)),
        choose(wardrobes.names("shoes", split)),
    )
    hat = choose(wardrobes.names("hats", split)) if generator.random() < 0.1 else ""
    hair = wardrobes.names("hair", split, sex=sex)
    hair = tuple(name for name in hair if not hat or name in UNDER_HATS)
    bald = generator.random() < (0.1 if sex == "male" else 0.01)
    gray = age > 0.85 and generator.random() < 0.6
    shades = HAIR_COLORS + GREY_HAIR
    color = shades[
        int(
            generator.integers(6, 8)
            if gray
            else generator.choice(6, p=[0.3, 0.25, 0.2, 0.12, 0.08, 0.05])
        )
    ]
    eyes = EYE_COLORS[int(generator.integers(len(EYE_COLORS)))]
    tint = tuple(float(value * generator.uniform(0.85, 1.15)) for value in color)
    kind = outfit.split("_", 1)[-1] or "bare"
    return Person(
        name=f"MakeHuman_{sex[0].upper()}_{number:06d}_{kind}",
        shape=shape,
        skin=skin,
        hair="" if bald else choose(hair),
        outfit=outfit,
        shoes=shoes,
        hat=hat,
        hair_color=(tint[0], tint[1], tint[2]),
        eye_color=(float(eyes[0]), float(eyes[1]), float(eyes[2])),
    )

"""Named people: each is fixed by its clothes and a number, so that no other change of the archive
or the folder affects it.

They wear clothes that are not in training data (`a2v.lab.studio.makehuman.people.HELD_OUT`). The
benchmark photographs them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from a2v.errors import InputError
from a2v.lab.studio.makehuman.people import EYE_COLORS, GREY_HAIR, HAIR_COLORS, Person, draw_shape

_AGES = {"young": (0.6, 0.75), "middleage": (0.77, 0.87), "old": (0.89, 0.97)}
"""Range of Anny's age by the first word of a skin's name; 2/3 is a young adult, 1 is old."""


@dataclass(frozen=True)
class NamedPerson:
    """Clothes of a named person; shape and colors depend only on `number`."""

    number: int
    skin: str
    outfit: str
    hair: str
    shoes: str


def _read(text: str, *, name: str = "makehuman", first: int = 1) -> Mapping[str, NamedPerson]:
    """Parse people by name from ``skin outfit hair shoes, ...``; the first one has the number
    `first`."""
    rows = enumerate((row.split() for row in text.split(", ")), first)
    return MappingProxyType(
        {f"{name}-{number}": NamedPerson(number, *worn) for number, worn in rows}
    )


_MAKEHUMAN = _read(
    "young_asian_female female_elegantsuit01 braid01 shoes01, middleage_african_male "
    "male_casualsuit05 short02 shoes02, "
    "old_caucasian_male male_casualsuit06 short02 shoes03, young_asian_female female_elegantsuit01 "
    "afro01 shoes04, "
    "middleage_african_male male_casualsuit06 afro01 shoes05, old_caucasian_male male_casualsuit05 "
    "short02 shoes06, "
    "young_asian_female female_elegantsuit01 braid01 shoes02, middleage_african_male "
    "male_casualsuit06 short02 shoes01, "
    "old_caucasian_male male_casualsuit05 afro01 shoes04, young_asian_female female_elegantsuit01 "
    "afro01 shoes06, "
    "middleage_african_male male_casualsuit05 afro01 shoes03, young_asian_female "
    "female_elegantsuit01 braid01 shoes04, "
    "old_caucasian_male male_casualsuit06 short02 shoes01, middleage_african_male "
    "male_casualsuit06 short02 shoes05, "
    "young_asian_female female_elegantsuit01 afro01 shoes02, old_caucasian_male male_casualsuit05 "
    "short02 shoes05, "
    "middleage_african_male male_casualsuit05 short02 shoes04, young_asian_female "
    "female_elegantsuit01 braid01 shoes06, "
    "old_caucasian_male male_casualsuit06 afro01 shoes02, middleage_african_male male_casualsuit06 "
    "afro01 shoes03, "
    "young_asian_female female_elegantsuit01 afro01 shoes01"
)

_PHONE = _read(
    "middleage_african_male male_casualsuit05 afro01 shoes03, old_caucasian_male male_casualsuit06 "
    "afro01 shoes05, "
    "young_asian_female female_elegantsuit01 braid01 shoes03, middleage_african_male "
    "male_casualsuit06 short02 shoes04, "
    "old_caucasian_male male_casualsuit05 short02 shoes01, young_asian_female female_elegantsuit01 "
    "afro01 shoes05, "
    "middleage_african_male male_casualsuit05 short02 shoes06, old_caucasian_male "
    "male_casualsuit06 short02 shoes02, "
    "young_asian_female female_elegantsuit01 afro01 shoes01, middleage_african_male "
    "male_casualsuit06 short02 shoes03, "
    "old_caucasian_male male_casualsuit05 afro01 shoes06, young_asian_female female_elegantsuit01 "
    "braid01 shoes04, "
    "middleage_african_male male_casualsuit05 afro01 shoes02, old_caucasian_male male_casualsuit06 "
    "afro01 shoes01",
    name="phone",
    first=11,
)

NAMED_PEOPLE: Mapping[str, NamedPerson] = MappingProxyType({**_MAKEHUMAN, **_PHONE})
"""The people by name."""


def named_person(name: str) -> Person:
    """Return the person of a name.

    Raises
    ------
    InputError
        The name is unknown.
    """
    if name not in NAMED_PEOPLE:
        raise InputError(
            f"none of MakeHuman's people has the name '{name}'; choose from "
            f"{', '.join(NAMED_PEOPLE)}"
        )
    person = NAMED_PEOPLE[name]
    generator = np.random.default_rng([person.number, 30_000])
    span, _, sex = person.skin.split("_")
    shape = draw_shape(generator, sex, float(generator.uniform(*_AGES[span])))
    colors = GREY_HAIR if span == "old" else HAIR_COLORS
    tint = np.array(colors[int(generator.integers(len(colors)))]) * generator.uniform(0.85, 1.15, 3)
    eyes = EYE_COLORS[int(generator.integers(len(EYE_COLORS)))]
    return Person(
        name=f"MakeHuman_{sex[0].upper()}_{person.number}_{person.outfit.split('_', 1)[1]}",
        shape=shape,
        skin=person.skin,
        hair=person.hair,
        outfit=person.outfit,
        shoes=person.shoes,
        hat="",
        hair_color=(float(tint[0]), float(tint[1]), float(tint[2])),
        eye_color=(float(eyes[0]), float(eyes[1]), float(eyes[2])),
    )

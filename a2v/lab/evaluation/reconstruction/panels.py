"""The pinned photos of the benchmark. More avatars in the data folder do not change them.

`studio` has 20 photos in the style of the studio, as in the first tables. `development` has people
in action, used during development; `report` has other people, for final figures. `final` has the
people of `report` in other photos, and people of MakeHuman in skins, clothes and hair that are in
no training data, half of them in action; it was made after the design, to be measured once. `phone`
has more people of MakeHuman, seen by near cameras. `distant` has the standing people of `phone` in
other poses, seen from so far away that the photos are orthographic. Each photo is drawn from its
number alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

_STUDIO = (
    "Asian_F_2_Casual 12, Black_F_3_Milit 8, Hispanic_M_3_Casual 80, MENA_F_1_Busi 100, "
    "NHPI_M_1_Casual 4, White_M_3_Casual 116, Asian_M_3_Medi 92, Asian_F_2_Milit 88, "
    "Black_F_3_Busi 64, Hispanic_M_3_Medi 24, MENA_F_1_Milit 96, NHPI_M_1_Milit 84, "
    "White_M_3_Busi 108, Black_F_2_Medi 40, Asian_F_2_Busi 36, Black_F_3_Casual 44, "
    "Hispanic_M_3_Util 104, MENA_F_1_Casual 68, NHPI_M_1_Busi 52, White_M_3_Milit 32"
)
_DEVELOPMENT = (
    "Asian_F_2_Casual 10000 run, Black_F_3_Milit 10001 sit, Hispanic_M_3_Casual 10002 squat, "
    "MENA_F_1_Busi 10003 kick, NHPI_M_1_Casual 10004 stoop, White_M_3_Busi 10005 profile, "
    "Asian_F_2_Milit 10006 spread, Black_F_3_Casual 10007 standing, "
    "Hispanic_M_3_Util 10008 run, MENA_F_1_Casual 10009 sit, NHPI_M_1_Medi 10010 squat, "
    "White_M_3_Casual 10011 kick, Asian_M_3_Medi 10012 stoop, Black_F_3_Busi 10013 profile, "
    "Hispanic_M_3_Medi 10014 spread, MENA_F_1_Milit 10015 standing, NHPI_M_1_Busi 10016 sit, "
    "White_M_3_Milit 10017 run"
)
_REPORT = (
    "X_AIAN_F_1_Busi 20000 run, X_AIAN_M_1_Casual 20001 sit, X_MENA_F_1_Util 20002 squat, "
    "X_NHPI_F_1_Casual 20003 kick, X_NHPI_F_2_Busi 20004 stoop, X_NHPI_F_3_Util 20005 profile, "
    "X_NHPI_M_1_Casual 20006 spread, X_AIAN_F_1_Casual 20007 standing, "
    "X_AIAN_M_1_Util 20008 run, X_MENA_F_1_Busi 20009 sit, X_NHPI_F_1_Util 20010 squat, "
    "X_NHPI_F_2_Casual 20011 kick, X_NHPI_F_3_Busi 20012 stoop, X_NHPI_M_1_Util 20013 profile, "
    "X_AIAN_F_1_Util 20014 spread, X_AIAN_M_1_Busi 20015 standing, "
    "X_MENA_F_1_Casual 20016 run, X_NHPI_F_1_Busi 20017 sit, X_NHPI_F_2_Util 20018 squat, "
    "X_NHPI_F_3_Casual 20019 standing, X_NHPI_M_1_Busi 20020 stoop"
)
_FINAL = (
    "X_AIAN_F_1_Casual 30000 run, makehuman-1 30001 standing, X_AIAN_M_1_Busi 30002 standing, "
    "makehuman-2 30003 sit, X_MENA_F_1_Util 30004 kick, makehuman-3 30005 standing, "
    "X_NHPI_F_1_Casual 30006 standing, makehuman-4 30007 stoop, X_NHPI_F_2_Busi 30008 squat, "
    "makehuman-5 30009 standing, X_NHPI_F_3_Util 30010 standing, makehuman-6 30011 profile, "
    "X_NHPI_M_1_Casual 30012 sit, makehuman-7 30013 standing, X_AIAN_F_1_Busi 30014 standing, "
    "makehuman-8 30015 spread, X_AIAN_M_1_Util 30016 stoop, makehuman-9 30017 standing, "
    "X_MENA_F_1_Casual 30018 standing, makehuman-10 30019 run, X_NHPI_F_1_Busi 30020 profile, "
    "makehuman-1 30021 kick, X_NHPI_F_2_Util 30022 standing, makehuman-2 30023 standing, "
    "X_NHPI_F_3_Casual 30024 spread, makehuman-3 30025 squat, X_NHPI_M_1_Busi 30026 standing, "
    "makehuman-4 30027 standing, X_AIAN_F_1_Util 30028 kick, makehuman-5 30029 sit, "
    "X_AIAN_M_1_Casual 30030 standing, makehuman-6 30031 standing, "
    "X_MENA_F_1_Busi 30032 squat, makehuman-7 30033 stoop, X_NHPI_F_1_Util 30034 standing, "
    "makehuman-8 30035 standing, X_NHPI_F_2_Casual 30036 run, makehuman-9 30037 profile, "
    "X_NHPI_F_3_Busi 30038 standing, makehuman-10 30039 standing"
)

_PHONE = (
    "phone-11 50000 standing, phone-19 50008 kick, phone-12 50001 standing, "
    "phone-20 50009 run, phone-13 50002 standing, phone-21 50010 sit, phone-14 50003 standing, "
    "phone-22 50011 squat, phone-15 50004 standing, phone-23 50012 spread, "
    "phone-16 50005 standing, phone-24 50013 run, phone-17 50006 standing, "
    "phone-18 50007 standing"
)

_DISTANT = ", ".join(f"phone-{11 + number} {51000 + number} standing" for number in range(8))


@dataclass(frozen=True)
class Pin:
    """One photo: the person (an avatar, or one of
    `a2v.lab.studio.makehuman.named.NAMED_PEOPLE`), the number from which it is drawn, and the
    stance ("" for the poses of the studio).
    """

    avatar: str
    index: int
    stance: str = ""


def read_pins(text: str) -> tuple[Pin, ...]:
    """Parse pins from ``avatar number [stance], ...``."""
    rows = [row.split() for row in text.split(", ")]
    return tuple(Pin(avatar, int(number), *stance) for avatar, number, *stance in rows)


PANELS: Mapping[str, tuple[Pin, ...]] = MappingProxyType(
    {
        "studio": read_pins(_STUDIO),
        "development": read_pins(_DEVELOPMENT),
        "report": read_pins(_REPORT),
        "final": read_pins(_FINAL),
        "phone": read_pins(_PHONE),
        "distant": read_pins(_DISTANT),
    }
)
"""The lists of photos by name."""

CAMERAS: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = MappingProxyType(
    {"phone": ((1.5, 4.0), (1.2, 1.7)), "distant": ((500.0, 1000.0), (1.2, 1.7))}
)
"""Ranges of the distance and the height of the cameras of a panel, meters, if they differ from
those of the studio (`StudioSettings`)."""

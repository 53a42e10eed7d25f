"""The photos of the benchmark, pinned one by one: more avatars in the data's folder change none of them.

`studio` are 20 photos of the studio's own kind, as the first tables had them. `development` are people in action on whom changes may be
tried; `report` are other people, never tried on, for figures that are final. Each photo is drawn from its number alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

_STUDIO = (
    "Asian_F_2_Casual 12, Black_F_3_Milit 8, Hispanic_M_3_Casual 80, MENA_F_1_Busi 100, NHPI_M_1_Casual 4, White_M_3_Casual 116, "
    "Asian_M_3_Medi 92, Asian_F_2_Milit 88, Black_F_3_Busi 64, Hispanic_M_3_Medi 24, MENA_F_1_Milit 96, NHPI_M_1_Milit 84, "
    "White_M_3_Busi 108, Black_F_2_Medi 40, Asian_F_2_Busi 36, Black_F_3_Casual 44, Hispanic_M_3_Util 104, MENA_F_1_Casual 68, "
    "NHPI_M_1_Busi 52, White_M_3_Milit 32"
)
_DEVELOPMENT = (
    "Asian_F_2_Casual 10000 run, Black_F_3_Milit 10001 sit, Hispanic_M_3_Casual 10002 squat, MENA_F_1_Busi 10003 kick, "
    "NHPI_M_1_Casual 10004 stoop, White_M_3_Busi 10005 profile, Asian_F_2_Milit 10006 spread, Black_F_3_Casual 10007 standing, "
    "Hispanic_M_3_Util 10008 run, MENA_F_1_Casual 10009 sit, NHPI_M_1_Medi 10010 squat, White_M_3_Casual 10011 kick, "
    "Asian_M_3_Medi 10012 stoop, Black_F_3_Busi 10013 profile, Hispanic_M_3_Medi 10014 spread, MENA_F_1_Milit 10015 standing, "
    "NHPI_M_1_Busi 10016 sit, White_M_3_Milit 10017 run"
)
_REPORT = (
    "X_AIAN_F_1_Busi 20000 run, X_AIAN_M_1_Casual 20001 sit, X_MENA_F_1_Util 20002 squat, X_NHPI_F_1_Casual 20003 kick, "
    "X_NHPI_F_2_Busi 20004 stoop, X_NHPI_F_3_Util 20005 profile, X_NHPI_M_1_Casual 20006 spread, X_AIAN_F_1_Casual 20007 standing, "
    "X_AIAN_M_1_Util 20008 run, X_MENA_F_1_Busi 20009 sit, X_NHPI_F_1_Util 20010 squat, X_NHPI_F_2_Casual 20011 kick, "
    "X_NHPI_F_3_Busi 20012 stoop, X_NHPI_M_1_Util 20013 profile, X_AIAN_F_1_Util 20014 spread, X_AIAN_M_1_Busi 20015 standing, "
    "X_MENA_F_1_Casual 20016 run, X_NHPI_F_1_Busi 20017 sit, X_NHPI_F_2_Util 20018 squat, X_NHPI_F_3_Casual 20019 standing, "
    "X_NHPI_M_1_Busi 20020 stoop"
)


@dataclass(frozen=True)
class Pin:
    """One photo: whom it shows, its number (what is drawn), and the class of its pose ("" for the studio's own poses)."""

    avatar: str
    index: int
    stance: str = ""


def _read(text: str) -> tuple[Pin, ...]:
    """Pins from ``avatar number [stance], ...``."""
    rows = [row.split() for row in text.split(", ")]
    return tuple(Pin(avatar, int(number), *stance) for avatar, number, *stance in rows)


PANELS: Mapping[str, tuple[Pin, ...]] = MappingProxyType(
    {"studio": _read(_STUDIO), "development": _read(_DEVELOPMENT), "report": _read(_REPORT)}
)
"""The lists of photos by name."""

"""The pinned photos of the benchmark: the person, the number from which everything else is drawn,
and the stance.

None of these people is in any training data. `development` is used during development; `final` has
other people, measured at the end. `aside` has people whose heads are turned to a side.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from a2v.lab.evaluation.reconstruction.panels import Pin, read_pins

_DEVELOPMENT = (
    "Asian_F_2_Casual 40000 sides, makehuman-11 40001 crossed, Hispanic_M_3_Casual 40002 hips, "
    "MENA_F_1_Busi 40003 face, White_M_3_Milit 40004 squat, NHPI_M_1_Casual 40005 pockets, "
    "Black_F_3_Casual 40006 feet_crossed, makehuman-12 40007 walk, Asian_F_2_Busi 40008 phone, "
    "White_M_3_Busi 40009 sit, MENA_F_1_Casual 40010 bag, Hispanic_M_3_Util 40011 crossed, "
    "makehuman-13 40012 hips, Black_F_3_Busi 40013 feet_together, NHPI_M_1_Busi 40014 walk, "
    "Asian_F_2_Util 40015 face, makehuman-14 40016 sides, White_M_3_Casual 40017 pockets, "
    "MENA_F_1_Util 40018 sit, makehuman-15 40019 feet_crossed"
)
_FINAL = (
    "X_AIAN_F_1_Casual 50000 crossed, makehuman-16 50001 hips, X_AIAN_M_1_Busi 50002 pockets, "
    "X_MENA_F_1_Util 50003 feet_crossed, X_NHPI_F_1_Casual 50004 face, makehuman-17 50005 sit, "
    "X_NHPI_F_2_Busi 50006 walk, X_NHPI_F_3_Util 50007 sides, X_NHPI_M_1_Casual 50008 phone, "
    "makehuman-18 50009 face, X_AIAN_F_1_Busi 50010 bag, X_AIAN_M_1_Casual 50011 squat, "
    "X_MENA_F_1_Casual 50012 hips, makehuman-19 50013 crossed, "
    "X_NHPI_F_1_Busi 50014 feet_together, X_NHPI_F_2_Casual 50015 sit, "
    "makehuman-20 50016 phone, X_NHPI_F_3_Casual 50017 pockets, X_NHPI_M_1_Util 50018 walk, "
    "makehuman-21 50019 feet_crossed"
)
_ASIDE = (
    "White_M_3_Casual 64000 aside, Asian_F_2_Busi 64001 aside, Black_F_3_Busi 64002 aside, "
    "Hispanic_M_3_Util 64003 aside, X_NHPI_M_1_Util 64004 aside, X_MENA_F_1_Busi 64005 aside, "
    "X_AIAN_M_1_Util 64006 aside, MENA_F_1_Casual 64007 aside"
)

MOVED_PANELS: Mapping[str, tuple[Pin, ...]] = MappingProxyType(
    {
        "development": read_pins(_DEVELOPMENT),
        "final": read_pins(_FINAL),
        "aside": read_pins(_ASIDE),
    }
)
"""The lists of photos by name; the `stance` of a pin is one of
`a2v.lab.studio.ordinary.ORDINARY`."""

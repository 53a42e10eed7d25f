"""Carrying a motion over to a body's rig: retargeting, binding (Eq. 19) and deformation (Eq. 20)."""

from a2v.animation.arap import ArapDeformer, ArapResult, DeformSettings
from a2v.animation.bind import BindSettings, bind
from a2v.animation.contacts import ContactSettings
from a2v.animation.deform import control_points, deform
from a2v.animation.retarget import RetargetSettings, retarget
from a2v.animation.rig import rig_motion

__all__ = [
    "ArapDeformer",
    "ArapResult",
    "BindSettings",
    "ContactSettings",
    "DeformSettings",
    "RetargetSettings",
    "bind",
    "control_points",
    "deform",
    "retarget",
    "rig_motion",
]

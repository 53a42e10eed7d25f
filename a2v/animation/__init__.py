"""Apply a motion to a body's rig: retargeting, binding (Eq. 19) and deformation (Eq. 20)."""

from a2v.animation.arap import ArapDeformer, ArapResult, DeformSettings
from a2v.animation.bind import BindSettings, bind, skin_of
from a2v.animation.canonical import photographed_character, standing_body, standing_character
from a2v.animation.change_rig import RigChange, change_rig
from a2v.animation.contacts import ContactSettings
from a2v.animation.deform import control_points, deform
from a2v.animation.engine import EngineSettings, engine_ready
from a2v.animation.expressions import BlinkSettings, blinking, blinks, express
from a2v.animation.footing import FootingSettings
from a2v.animation.life import LifeSettings
from a2v.animation.retarget import RetargetSettings, retarget
from a2v.animation.rig import rig_motion
from a2v.animation.rig_spec import RIGS, load_rig
from a2v.animation.root_motion import prepare_rig, put_rig_in_place

__all__ = [
    "RIGS",
    "ArapDeformer",
    "ArapResult",
    "BindSettings",
    "BlinkSettings",
    "ContactSettings",
    "DeformSettings",
    "EngineSettings",
    "FootingSettings",
    "LifeSettings",
    "RetargetSettings",
    "RigChange",
    "bind",
    "blinking",
    "blinks",
    "change_rig",
    "control_points",
    "deform",
    "engine_ready",
    "express",
    "load_rig",
    "photographed_character",
    "prepare_rig",
    "put_rig_in_place",
    "retarget",
    "rig_motion",
    "skin_of",
    "standing_body",
    "standing_character",
]

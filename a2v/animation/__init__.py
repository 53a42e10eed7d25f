"""Motion files, retargeting to a body's rig, binding, deformation (Eq. 19 and 20) and export to animators' tools."""

from a2v.animation.arap import ArapDeformer, ArapResult, DeformSettings
from a2v.animation.bind import BindSettings, bind
from a2v.animation.bvh import read_bvh, write_bvh
from a2v.animation.contacts import ContactSettings
from a2v.animation.deform import control_points, deform
from a2v.animation.export import write_glb, write_morph_glb, write_obj, write_ply
from a2v.animation.motionfile import read_deepmimic, read_motion
from a2v.animation.names import canonical_joints
from a2v.animation.quality import RetargetQuality, measure_retargeting
from a2v.animation.resample import resample_motion
from a2v.animation.retarget import RetargetSettings, retarget
from a2v.animation.rig import rig_motion
from a2v.animation.usd import write_usd

__all__ = [
    "ArapDeformer",
    "ArapResult",
    "BindSettings",
    "ContactSettings",
    "DeformSettings",
    "RetargetQuality",
    "RetargetSettings",
    "bind",
    "canonical_joints",
    "control_points",
    "deform",
    "measure_retargeting",
    "read_bvh",
    "read_deepmimic",
    "read_motion",
    "resample_motion",
    "retarget",
    "rig_motion",
    "write_bvh",
    "write_glb",
    "write_morph_glb",
    "write_obj",
    "write_ply",
    "write_usd",
]

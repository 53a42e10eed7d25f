"""Motion files, retargeting to a body's rig, binding, deformation (Eq. 19 and 20) and export to animators' tools."""

from a2v.animation.bvh import read_bvh, write_bvh
from a2v.animation.motionfile import read_deepmimic, read_motion
from a2v.animation.names import canonical_joints
from a2v.animation.resample import resample_motion

__all__ = ["canonical_joints", "read_bvh", "read_deepmimic", "read_motion", "resample_motion", "write_bvh"]

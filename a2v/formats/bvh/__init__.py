"""BVH files: read any person's skeleton to a `Motion`, write a `Motion` with exact joint
positions."""

from a2v.formats.bvh.reading import read_bvh, read_bvh_bones
from a2v.formats.bvh.writing import write_bvh, write_rig_bvh
from a2v.formats.conventions import UNITS

__all__ = ["UNITS", "read_bvh", "read_bvh_bones", "write_bvh", "write_rig_bvh"]

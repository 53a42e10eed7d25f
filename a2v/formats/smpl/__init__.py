"""Motions as rotations or joints of SMPL's skeleton: read those of many tools, write AMASS's."""

from a2v.formats.smpl.reading import read_smpl_motion
from a2v.formats.smpl.skeleton import NAMES, OFFSETS, PARENTS, PELVIS
from a2v.formats.smpl.writing import write_smpl_motion

__all__ = ["NAMES", "OFFSETS", "PARENTS", "PELVIS", "read_smpl_motion", "write_smpl_motion"]

"""Read and write motions (BVH, DeepMimic, our ``.npz``) and characters (glTF, OBJ, PLY, USD, FBX);
`registry` finds a format by its suffix."""

from a2v.formats.bvh import read_bvh, write_bvh, write_rig_bvh
from a2v.formats.characters import Clips
from a2v.formats.deepmimic import read_deepmimic
from a2v.formats.gltf import write_glb, write_morph_glb
from a2v.formats.obj_ply import write_obj, write_ply
from a2v.formats.registry import read_motion, write_character, write_motion
from a2v.formats.usd import write_usd

__all__ = [
    "Clips",
    "read_bvh",
    "read_deepmimic",
    "read_motion",
    "write_bvh",
    "write_character",
    "write_glb",
    "write_morph_glb",
    "write_motion",
    "write_obj",
    "write_ply",
    "write_rig_bvh",
    "write_usd",
]

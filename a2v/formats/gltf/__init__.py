"""Binary glTF 2.0: characters written with a skin or with morph targets, and a bounded reader of
skinned people."""

from a2v.formats.gltf.compression import compress_glb, demand_compression
from a2v.formats.gltf.reading import Gltf, read_glb
from a2v.formats.gltf.vrm import VrmMeta, write_vrm, write_vrma
from a2v.formats.gltf.writing import write_glb, write_morph_glb

__all__ = [
    "Gltf",
    "VrmMeta",
    "compress_glb",
    "demand_compression",
    "read_glb",
    "write_glb",
    "write_morph_glb",
    "write_vrm",
    "write_vrma",
]

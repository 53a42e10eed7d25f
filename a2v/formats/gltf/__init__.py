"""Binary glTF 2.0: characters written with a skin or with morph targets, and a bounded reader of skinned people."""

from a2v.formats.gltf.reading import Gltf, read_glb
from a2v.formats.gltf.writing import write_glb, write_morph_glb

__all__ = ["Gltf", "read_glb", "write_glb", "write_morph_glb"]

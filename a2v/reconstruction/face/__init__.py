"""A face that moves: the front of the body model's head, fitted to the face in the photo and sewn
into the surface."""

from a2v.reconstruction.face.build import FaceSettings, add_face

__all__ = ["FaceSettings", "add_face"]

"""A face that moves: the front of the body model's head, fitted to the face in the photo and sewn
into the surface."""

from a2v.reconstruction.face.build import add_face
from a2v.reconstruction.face.settings import FaceSettings

__all__ = ["FaceSettings", "add_face"]

"""A face that moves: the body model's own front of the head, laid where the photo shows the face,
sewn into the surface."""

from a2v.reconstruction.face.build import FaceSettings, add_face

__all__ = ["FaceSettings", "add_face"]

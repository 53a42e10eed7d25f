"""Body models (Anny by default), their parts and landmarks, pose priors, and the fit of a body to a
person.

Everything heavy (torch, anny) is imported when first used.
"""

from a2v.body.anny import AnnyModel
from a2v.body.carry import carry_over
from a2v.body.confidence import doubts, summary
from a2v.body.fingers import bend_fingers
from a2v.body.fit import FitResult, fit_body
from a2v.body.flat import flattened
from a2v.body.landmarks import JOINT_BONES
from a2v.body.parts import PART_NEIGHBORS, PARTS, part_of_bone
from a2v.body.registry import MODELS, load_body_model
from a2v.body.settings import FitSettings
from a2v.body.skinning import BodyModel, BodyState, make_body
from a2v.body.smpl import SmplModel
from a2v.body.spots import Spots, nearest_spots

__all__ = [
    "JOINT_BONES",
    "MODELS",
    "PARTS",
    "PART_NEIGHBORS",
    "AnnyModel",
    "BodyModel",
    "BodyState",
    "FitResult",
    "FitSettings",
    "SmplModel",
    "Spots",
    "bend_fingers",
    "carry_over",
    "doubts",
    "fit_body",
    "flattened",
    "load_body_model",
    "make_body",
    "nearest_spots",
    "part_of_bone",
    "summary",
]

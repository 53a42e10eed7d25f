"""Body models (Anny by default), their parts and landmarks, pose priors, and the fit of a body to a person.

Everything heavy (torch, anny) is imported when first used.
"""

from a2v.body.fit import FitResult, FitSettings, fit_body
from a2v.body.landmarks import BLAZEPOSE, JOINT_BONES
from a2v.body.model import MODELS, AnnyModel, BodyModel, BodyState, load_body_model, make_body
from a2v.body.parts import PART_NEIGHBORS, PARTS, nearest_parts, part_of_bone
from a2v.body.smpl import SmplModel, carry_over

__all__ = [
    "BLAZEPOSE",
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
    "carry_over",
    "fit_body",
    "load_body_model",
    "make_body",
    "nearest_parts",
    "part_of_bone",
]

"""The Gaussian prior of the body's shape."""

from __future__ import annotations

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.types import FloatArray

# Spreads of the phenotypes, chosen by hand like the table in `pose_space`: age and height are
# hardly visible in a photo.
_SHAPE_SPREAD = {
    "gender": 0.4,
    "age": 0.05,
    "muscle": 0.25,
    "weight": 0.2,
    "height": 0.05,
    "proportions": 0.25,
}
_GENDER_OF_A_PHOTO = 0.35
"""Mean of Anny's gender for a photo. Clothes hide the chest, a silhouette shows too little of it,
and a wrong chest is visible on men."""
_GENDER_SPREAD_OF_A_PHOTO = 0.2
"""Its standard deviation."""


def shape_prior(model: AnnyModel, *, of_photo: bool) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation (S,) of the shape parameters.

    `of_photo` : for a fit to a photo without a surface, which hardly shows the chest.
    """
    mean, deviations = model.shape_default.astype(np.float64), dict(_SHAPE_SPREAD)
    if of_photo:
        mean[model.shape_names.index("gender")] = _GENDER_OF_A_PHOTO
        deviations["gender"] = _GENDER_SPREAD_OF_A_PHOTO
    spread = [deviations.get(name, 0.5 if "circ" in name else 0.4) for name in model.shape_names]
    return mean, np.array(spread)

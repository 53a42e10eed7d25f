"""The reconstruction benchmark: photos of people with known shape and colors are put through the
pipeline and compared with the truth.

Photos come from the validation split of the synthetic studio: identities and an outfit that are in
no training data. Everything is compared in the frame of the photo, in which the photo is the
orthographic front view of the true (warped) mesh.

One photo shows neither the size of a person nor the distance. Predicted points are projected by the
predicted camera to pixels, and from there to the meters of the true camera (x, y and z by the same
factor). z is shifted so that the medians of the front depths agree where both are visible.

`settings` is the protocol, `panels` pins the photos, and `cases` are photos with their truth.
`maps` renders a surface in the frame of the photo, and `measures` compares. `methods` runs backends
and colorings on a case, `kept` stores finished photos, `pictures` and `tables` show the results.
"""

from a2v.lab.evaluation.reconstruction.cases import Case, lit_by, open_case, open_studio
from a2v.lab.evaluation.reconstruction.kept import Measured
from a2v.lab.evaluation.reconstruction.maps import Maps, mask_in_photo, surface_maps, to_true_frame
from a2v.lab.evaluation.reconstruction.measures import Placed, Truth, image_scores
from a2v.lab.evaluation.reconstruction.methods import (
    Method,
    Outcome,
    Result,
    evaluate_case,
    peak_memory,
)
from a2v.lab.evaluation.reconstruction.panels import PANELS, Pin
from a2v.lab.evaluation.reconstruction.pictures import picture_rows, stack_rows
from a2v.lab.evaluation.reconstruction.settings import (
    FIT_METRICS,
    METRICS,
    SPLIT,
    BenchmarkSettings,
)
from a2v.lab.evaluation.reconstruction.tables import (
    calibration,
    fit_table,
    group_table,
    method_table,
    report,
)

__all__ = [
    "FIT_METRICS",
    "METRICS",
    "PANELS",
    "SPLIT",
    "BenchmarkSettings",
    "Case",
    "Maps",
    "Measured",
    "Method",
    "Outcome",
    "Pin",
    "Placed",
    "Result",
    "Truth",
    "calibration",
    "evaluate_case",
    "fit_table",
    "group_table",
    "image_scores",
    "lit_by",
    "mask_in_photo",
    "method_table",
    "open_case",
    "open_studio",
    "peak_memory",
    "picture_rows",
    "report",
    "stack_rows",
    "surface_maps",
    "to_true_frame",
]

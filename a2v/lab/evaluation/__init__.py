"""Evaluation of results.

Motions: `protocol` runs the papers' protocol with `metrics` of the features of a `classifier`
(`training` trains our own, `monitor` scores a model during training), `physics` measures
plausibility, `survey` and `survey_answers` are user studies. Retargeting: `retargeting`. The person
from a photo: `reconstruction`.
"""

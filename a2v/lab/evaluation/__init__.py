"""How good results are.

Motions: `protocol` runs the papers' protocol with `metrics` of the features of a `classifier`
(`training` makes one of our own, `monitor` looks at a model in training), `physics` measures
plausibility, `survey` and `survey_answers` ask people. Retargeting: `retargeting`. The person from
a photo: `reconstruction`.
"""

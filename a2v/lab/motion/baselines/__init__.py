"""The systems that the papers compare with (Sec. 5.1.1), implemented from the descriptions in the
papers; `a2v.lab.motion.baselines.training` trains them.

None is shipped: they are here so that every row of the papers' tables can be measured again.
"""

NAMES = ("condgru", "two-stage-gan", "act-mocogan", "dancing2music", "latent-transition")
"""Names of the systems, in the order of the papers' tables."""

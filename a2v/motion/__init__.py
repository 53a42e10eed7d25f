"""action2motion: from an action's name to 3D human motion.

`MotionModel` samples exported networks with onnxruntime; `a2v.motion.networks`, `a2v.motion.losses` and
`a2v.motion.training` (which need torch) hold the temporal VAE.
"""

from a2v.motion.sampler import BUNDLED, MotionModel

__all__ = ["BUNDLED", "MotionModel"]

"""action2motion: from an action's name to 3D human motion.

`MotionModel` samples exported networks with onnxruntime; `a2v.lab.motion.vae`,
`a2v.lab.motion.flow` and `a2v.lab.motion.training` (which need torch) hold the networks and their
training.
"""

from a2v.motion.model import MotionModel
from a2v.motion.names import BUNDLED

__all__ = ["BUNDLED", "MotionModel"]

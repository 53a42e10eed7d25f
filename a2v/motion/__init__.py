"""action2motion: from an action's name to 3D human motion.

`MotionModel` samples exported networks with onnxruntime; `a2v.motion.vae`, `a2v.motion.flow` and `a2v.motion.training`
(which need torch) hold the networks and their training.
"""

from a2v.motion.model import BUNDLED, MotionModel

__all__ = ["BUNDLED", "MotionModel"]

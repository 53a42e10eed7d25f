"""Nothing is reported to anybody: onnxruntime reads this variable when it is imported, and would
look up a host and leave an identity.

The package imports this first, so it is set whenever a2v is imported before onnxruntime; who has
set the variable has decided.
"""

import os

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")

"""Switch off onnxruntime's telemetry, which would look up a host and store an identifier.

onnxruntime reads this variable at import. The package imports this module first, so the variable is
set if a2v is imported before onnxruntime. A value that the user has set is kept.
"""

import os

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")

"""Remarks of mediapipe's C++ do not reach the user; errors do."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from a2v.perception.detector import silenced
from a2v.processes import python_command

REMARKS = (
    "INFO: Created TensorFlow Lite XNNPACK delegate for CPU.\n",
    "WARNING: All log messages before absl::InitializeLog() is called are written to STDERR\n",
    "W0000 00:00:1732390000.000000 1 inference_feedback_manager.cc:114] Feedback manager requires "
    "a model with a single signature inference.\n",
    "I0000 00:00:1732390000.000000 1 gl_context_egl.cc:85] Successfully initialized EGL.\n",
)
ERRORS = (
    "E0000 00:00:1732390000.000000 1 calculator_graph.cc:853] UNKNOWN: no such file\n",
    "ERROR: out of memory\n",
    "Killed by something\n",
)


def test_remarks_are_kept_off_stderr_and_errors_are_not(capfd: pytest.CaptureFixture[str]) -> None:
    with silenced():
        for line in (*REMARKS, *ERRORS):
            os.write(2, line.encode())
    assert capfd.readouterr().err == "".join(ERRORS)
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "after\n"


def fail_aloud() -> None:
    with silenced():
        os.write(2, ERRORS[0].encode())
        raise ValueError("odd")


def test_what_was_said_before_an_exception_is_not_lost(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError, match="odd"):
        fail_aloud()
    assert capfd.readouterr().err == ERRORS[0]


def test_mediapipe_says_nothing() -> None:
    """The models are opened in a new process; its threads print at any time."""
    code = (
        "import numpy as np, time\n"
        "from a2v.perception.detector import Detector\n"
        "with Detector() as found:\n"
        "    found.one(np.zeros((64, 64, 3), np.uint8))\n"
        "time.sleep(0.5)\n"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stderr == ""


def test_mediapipe_is_imported_without_matplotlib_which_stays_whole() -> None:
    code = (
        "import sys\n"
        "from a2v.perception.mediapipe import load_mediapipe\n"
        "solutions = load_mediapipe().solutions\n"
        "assert 'matplotlib' not in sys.modules and 'matplotlib.pyplot' not in sys.modules\n"
        "plot = solutions.drawing_utils.plt.figure\n"
        "import matplotlib.pyplot\n"
        "assert plot is matplotlib.pyplot.figure\n"
        "assert load_mediapipe().solutions is solutions\n"
    )
    subprocess.run(python_command(code), check=True, capture_output=True)

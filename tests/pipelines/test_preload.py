"""Tests of the imports beside the first node."""

import subprocess

import pytest

from a2v.processes import python_command
from pipelines.preload import NEXT, preload


def test_one_core_imports_nothing(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert preload() is None


def test_every_module_is_imported_and_the_program_ends():
    code = (
        "import os, sys\n"
        "os.environ['OMP_NUM_THREADS'] = '2'\n"
        "from pipelines.preload import NEXT, preload\n"
        "preload().join()\n"
        "print([name for name in NEXT if name not in sys.modules])\n"
    )
    told = subprocess.run(python_command(code), capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"


@pytest.mark.parametrize("name", ["pymeshlab", "mediapipe"])
def test_libraries_that_must_not_be_loaded_in_a_thread(name):
    assert name not in NEXT

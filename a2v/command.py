"""The program ``a2v``, and where the pipeline behind it lies: `a2v.pipelines` of a wheel,
`pipelines` of a checkout."""

from __future__ import annotations

import importlib
import importlib.util
from types import ModuleType


def load_pipelines(module: str) -> ModuleType:
    """A module of the pipeline by its name below it, such as ``"cli"``; imported when it is asked
    for, as the library knows no pipeline."""
    beneath = importlib.util.find_spec("a2v.pipelines")
    return importlib.import_module(f"{'a2v.pipelines' if beneath else 'pipelines'}.{module}")


def main() -> int:
    """Run the command line; returns the exit code."""
    code: int = load_pipelines("cli").main()
    return code

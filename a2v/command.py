"""The program ``a2v``, and the location of the pipeline: `a2v.pipelines` in a wheel, `pipelines` in
a checkout."""

from __future__ import annotations

import importlib
import importlib.util
from types import ModuleType


def load_pipelines(module: str) -> ModuleType:
    """Import a module of the pipeline by its name below the package, such as ``"cli"``.

    It is imported only here, because the library does not depend on the pipeline.
    """
    beneath = importlib.util.find_spec("a2v.pipelines")
    return importlib.import_module(f"{'a2v.pipelines' if beneath else 'pipelines'}.{module}")


def main() -> int:
    """Run the command line; returns the exit code."""
    code: int = load_pipelines("cli").main()
    return code

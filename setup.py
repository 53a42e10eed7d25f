"""What pyproject.toml cannot say: in a wheel, `pipelines` and `export` lie beneath `a2v`.

In the repository they stand at the top, where they are found at once. In site-packages those two
names could belong to anybody, so the wheel holds `a2v.pipelines` and `a2v.export`, and the imports
of the built copies are rewritten. Editable installs stay as the repository is.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

BENEATH = ("pipelines", "export")
IMPORT = re.compile(rf"^([ \t]*(?:from|import)[ \t]+)(?=(?:{'|'.join(BENEATH)})\b)", re.MULTILINE)
"""The start of an import of one of them; what follows stays."""


class BuildBeneath(build_py):
    """Build as always, then move the packages `BENEATH` below `a2v` and import them from there."""

    def run(self) -> None:
        """Build into the folder of the wheel."""
        super().run()
        if self.editable_mode:
            return
        library = Path(self.build_lib)
        for name in BENEATH:
            shutil.rmtree(library / "a2v" / name, ignore_errors=True)
            shutil.move(library / name, library / "a2v" / name)
        for path in (library / "a2v").rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            path.write_text(IMPORT.sub(r"\1a2v.", text), encoding="utf-8")


setup(cmdclass={"build_py": BuildBeneath})

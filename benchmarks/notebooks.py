"""Processor time of each notebook, executed with an empty store and one thread.

The time includes the start of the kernel, imports and all processes that the notebook starts:

    python benchmarks/notebooks.py                    # all, at the size of the stored outputs
    python benchmarks/notebooks.py --only 05 08       # some
    python benchmarks/notebooks.py --small            # at the size that the tests use
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

_SUBREAPER = 36
"""Linux' PR_SET_CHILD_SUBREAPER: orphans become children of this process, so their time counts."""
FOLDER = Path(__file__).resolve().parents[1] / "notebooks"


def seconds_of(source: Path, *, small: bool) -> float:
    """Execute a notebook in a process of its own; return the processor time of its family, s."""
    surroundings = {name: value for name, value in os.environ.items() if name != "A2V_SMALL"}
    surroundings |= {"A2V_SMALL": "1"} if small else {}
    with tempfile.TemporaryDirectory(prefix="a2v-notebook-") as folder:
        out = Path(folder) / "executed.ipynb"
        command = ["jupytext", "--to", "ipynb", "--execute", "--run-path", str(FOLDER)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [sys.executable, "-m", *command, "--output", str(out), str(source)],
            env={**surroundings, "A2V_CACHE": f"{folder}/store", "OMP_NUM_THREADS": "1"},
            check=True,
            stdout=subprocess.DEVNULL,
        )
        with contextlib.suppress(ChildProcessError):  # those that their parents did not wait for
            while True:
                os.wait()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", default=[], help="numbers of notebooks")
    parser.add_argument("--small", action="store_true", help="at the size that the tests use")
    options = parser.parse_args()
    if ctypes.CDLL(None).prctl(_SUBREAPER, 1):
        raise OSError("this process cannot adopt orphans; the benchmark needs Linux")
    print("| notebook | processor time, s |\n|---|---|", flush=True)
    for source in sorted(FOLDER.glob("[0-9]*.py")):
        if not options.only or source.stem.split("_")[0] in options.only:
            spent = seconds_of(source, small=options.small)
            print(f"| {source.stem} | {spent:.0f} |", flush=True)


if __name__ == "__main__":
    main()

"""Import the libraries of later nodes on the second core while the first node runs."""

from __future__ import annotations

import contextlib
import importlib
import threading

from a2v.system import thread_count

NEXT = (
    "torch",
    "a2v.geometry.rays",
    "scipy.optimize",
    "scipy.sparse.linalg",
    "scipy.interpolate",
    "cholespy",
    "trimesh",
    "skimage.color",
    "skimage.measure",
)
"""Modules that the nodes after `subject` import, in the order in which they need them.

pymeshlab is left out: loaded in a thread beside mediapipe, it corrupts the heap, and the program
aborts at its end.
"""


def preload() -> threading.Thread | None:
    """Start to import `NEXT` in a thread, and return it; None where there is one core.

    The detectors of the first node run in native code, so the interpreter is free for the imports
    meanwhile. A node that needs one of the modules earlier waits for its import as usual. The
    thread stops after the current module when the program ends.
    """
    if thread_count() < 2:
        return None
    thread = threading.Thread(target=_import_all, name="preload")
    thread.start()
    return thread


def _import_all() -> None:
    """Import `NEXT`, open3d included; a failure is left to the node that needs the module."""
    for name in NEXT:
        if not threading.main_thread().is_alive():
            return
        with contextlib.suppress(Exception):
            module = importlib.import_module(name)
            if name == "a2v.geometry.rays":
                module.load_open3d()

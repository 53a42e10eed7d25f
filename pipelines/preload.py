"""Import the libraries of the fit on the second core while the person is found."""

from __future__ import annotations

import contextlib
import importlib
import threading

from a2v.system import thread_count

NEXT = ("torch", "scipy.optimize")
"""Modules that the nodes after `subject` import, in the order in which they are needed.

pymeshlab is not among them: if it is loaded in a thread beside mediapipe, it corrupts the heap, and
the program aborts at its end.
"""


def preload() -> threading.Thread | None:
    """Start to import `NEXT` in a thread, and return the thread; None if there is only one core.

    The detectors of the first node run in native code, so the interpreter is free for the imports
    meanwhile. A node that needs one of the modules earlier waits for its import. The thread stops
    after the current module when the program ends.
    """
    if thread_count() < 2:
        return None
    thread = threading.Thread(target=_import_all, name="preload")
    thread.start()
    return thread


def _import_all() -> None:
    """Import `NEXT`; the node that needs a module reports its failure."""
    for name in NEXT:
        if not threading.main_thread().is_alive():
            return
        with contextlib.suppress(Exception):
            importlib.import_module(name)

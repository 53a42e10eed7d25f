"""The Mitsuba variant that works on this machine, found without risk to the process.

Dr.Jit loads LLVM at run time and *aborts the whole process* with versions that it cannot use (15
and 16, which Debian 12 offers first). So a child process tries a tiny render first, and this
process uses LLVM only if the child survived.
"""

from __future__ import annotations

import functools
import os
import re
import subprocess
from importlib import metadata
from typing import Any

from a2v.io import user_cache_folder
from a2v.processes import python_command
from a2v.system import core_count

LLVM_VARIANT = "llvm_ad_rgb"
FALLBACK_VARIANT = "scalar_rgb"
PROBE_SECONDS = 120.0

_PROBE = """
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
scene = mi.load_dict({"type": "scene", "shape": {"type": "rectangle"}, "light": {"type": "constant"}, "sensor": {"type": "perspective",
    "to_world": mi.ScalarTransform4f().translate([0, 0, -3]), "film": {"type": "hdrfilm", "width": 4, "height": 4}}})
image = mi.render(scene, integrator=mi.load_dict({"type": "direct"}), spp=1)
assert float(image.array[0]) >= 0
print("a2v: llvm works")
"""  # noqa: E501


def llvm_candidates() -> tuple[str | None, ...]:
    """Return paths to try as ``DRJIT_LIBLLVM_PATH``, best first; None: the library that the system
    finds.

    If the user set a path, it is the only candidate. Otherwise the library of the wheel
    `karellen-llvm-core` comes first, then the system's.
    """
    if chosen := os.environ.get("DRJIT_LIBLLVM_PATH"):
        return (chosen,)
    found: list[str | None] = []
    try:
        files = metadata.files("karellen-llvm-core") or []
    except metadata.PackageNotFoundError:
        files = []
    for file in files:
        if re.fullmatch(r"libLLVM\.so\.[\d.]+|libLLVM\.dylib|LLVM-C\.dll", file.name):
            path = os.path.realpath(file.locate())
            if os.path.exists(path) and path not in found:  # noqa: PTH110 - a string is what the variable takes
                found.append(path)
    return (*found, None)


def probe_llvm(library: str | None) -> bool:
    """Return whether a child process can render with `llvm_ad_rgb` and this LLVM library (None: the
    system's)."""
    environment = {
        **os.environ,
        **_kernel_cache(),
        **({"DRJIT_LIBLLVM_PATH": library} if library else {}),
    }
    try:
        child = subprocess.run(
            python_command(_PROBE),
            env=environment,
            capture_output=True,
            text=True,
            timeout=PROBE_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return child.returncode == 0 and "a2v: llvm works" in child.stdout


def _kernel_cache() -> dict[str, str]:
    """Return the environment that keeps Dr.Jit's machine code with the user's own files, never in a
    shared store."""
    folder = user_cache_folder()
    return (
        {}
        if folder is None or "DRJIT_CACHE_DIR" in os.environ
        else {"DRJIT_CACHE_DIR": str(folder / "drjit")}
    )


@functools.cache
def _working_llvm() -> tuple[bool, str | None]:
    """Return whether LLVM works, and with which library; tried once per process."""
    for library in llvm_candidates():
        if probe_llvm(library):
            return True, library
    return False, None


def choose_variant() -> tuple[str, str | None]:
    """Return the fastest Mitsuba variant that works here, and a note for the user (None: no note).

    The first call in a process takes one to a few seconds (a child process renders a 4 x 4
    picture); later calls are free. If LLVM works, ``DRJIT_LIBLLVM_PATH`` is set for this process
    and its children.
    """
    works, library = _working_llvm()
    if not works:
        return FALLBACK_VARIANT, (
            "LLVM cannot be used by Mitsuba here, so frames are rendered with "
            f"'{FALLBACK_VARIANT}' (several times slower); "
            "install karellen-llvm-core or LLVM 17 or newer, or point DRJIT_LIBLLVM_PATH at its "
            "library"
        )
    if library is not None:
        os.environ["DRJIT_LIBLLVM_PATH"] = library
    return LLVM_VARIANT, None


def activate(variant: str = "auto", threads: int = 0) -> Any:
    """Import Mitsuba, select `variant` ("auto": `choose_variant`) and the number of threads (0: all
    cores).

    Mitsuba's variant and thread pool belong to the process; calling this again switches them.

    Returns
    -------
    The module `mitsuba`.
    """
    if variant == "auto":
        variant, _ = choose_variant()
    elif (
        variant.startswith("llvm")
        and "DRJIT_LIBLLVM_PATH" not in os.environ
        and (paths := llvm_candidates())[0]
    ):
        os.environ["DRJIT_LIBLLVM_PATH"] = str(paths[0])
    os.environ.update(_kernel_cache())
    import drjit
    import mitsuba

    if mitsuba.variant() != variant:
        mitsuba.set_variant(variant)
        mitsuba.set_log_level(
            mitsuba.LogLevel.Error
        )  # it warns at every render that 8 samples are rounded up to 9
    wanted = threads or core_count()
    if drjit.thread_count() != wanted:
        drjit.set_thread_count(wanted)
    return mitsuba

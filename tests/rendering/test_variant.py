from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from a2v.rendering import choose_variant, variant


@pytest.fixture
def forgotten(monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]
    """Run as a process that has not probed yet, and leave no trace of it."""
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", os.environ.get("DRJIT_LIBLLVM_PATH", ""))
    variant._working_llvm.cache_clear()
    yield
    variant._working_llvm.cache_clear()


def test_a_probe_that_dies_falls_back_and_says_so(
    forgotten: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    calls = tmp_path / "calls"
    # what LLVM 15 does to the process that loads it
    monkeypatch.setattr(
        variant, "_PROBE", f"import os; open({str(calls)!r}, 'a').write('x'); os.abort()"
    )
    name, message = choose_variant()
    assert name == "scalar_rgb"
    assert message is not None
    assert "DRJIT_LIBLLVM_PATH" in message
    assert "\n" not in message
    probes = len(calls.read_text())
    choose_variant()
    assert len(calls.read_text()) == probes  # tried once per process


def test_a_library_that_is_none_is_survived(
    forgotten: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    fake = tmp_path / "libLLVM.so"
    fake.write_bytes(b"no library")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(fake))
    assert variant.llvm_candidates() == (str(fake),)  # the user's choice is kept
    assert choose_variant()[0] == "scalar_rgb"


def test_a_probe_that_hangs_is_given_up(forgotten: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(variant, "_PROBE", "import time; time.sleep(60)")
    monkeypatch.setattr(variant, "PROBE_SECONDS", 0.5)
    assert choose_variant()[0] == "scalar_rgb"


def test_llvm_works_with_the_wheel(forgotten: None) -> None:
    pytest.importorskip("mitsuba")
    if sys.platform != "linux":
        pytest.skip("the wheel of LLVM is for Linux")
    assert choose_variant() == ("llvm_ad_rgb", None)
    assert "libLLVM" in os.environ["DRJIT_LIBLLVM_PATH"]

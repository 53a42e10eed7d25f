"""``a2v doctor``: what works, what is missing, and advice."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from pipelines import checks
from pipelines.cli import main

ROOT = Path(__file__).resolve().parents[1]


def test_a_machine_that_works_says_so(capsys, tmp_path):
    assert main(["doctor", "--json", "--cache", str(tmp_path / "store")]) == 0
    told = json.loads(capsys.readouterr().out)
    found = {check["name"]: check for check in told["checks"]}
    assert told["works"]
    assert not [check for check in told["checks"] if check["status"] == "fails"]
    assert all(
        check["advice"] for check in told["checks"] if check["status"] in ("slow", "optional")
    )
    assert str(tmp_path / "store") in found["store"]["about"]
    assert {
        "renderer",
        "denoiser",
        "encoders",
        "memory",
        "person",
        "body",
        "weights",
        "browser",
        "usd",
    } <= set(found)


def test_what_fails_is_told_with_advice(capsys, monkeypatch, tmp_path):
    for name in (
        "check_person",
        "check_body",
        "check_renderer",
        "check_denoiser",
        "check_encoders",
    ):
        monkeypatch.setattr(checks, name, checks.check_memory)  # quick
    (tmp_path / "file").touch()
    monkeypatch.setattr("a2v.sessions.WEIGHTS", tmp_path)
    assert main(["doctor", "--cache", str(tmp_path / "file")]) == 2
    lines = capsys.readouterr().out.splitlines()
    (store,) = [index for index, line in enumerate(lines) if line.startswith("fails    store")]
    assert "--cache" in lines[store + 1]
    assert [line for line in lines if line.startswith("fails    weights")]
    assert "weights, store: needed for every video; repair it first" in lines[-1]


def test_little_memory_and_a_full_disk_are_told(monkeypatch, tmp_path):
    monkeypatch.setattr(checks, "MEMORY_NEEDED", 10**18)
    monkeypatch.setattr(checks, "DISK_NEEDED", 10**18)
    assert checks.check_memory().status == "slow"
    assert checks.check_store(str(tmp_path / "s")).status == "slow"


def test_every_extra_is_looked_for():
    tomllib = pytest.importorskip("tomllib")
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    assert set(checks.EXTRAS) == set(declared) - {"dev"}


def test_libraries_of_the_system_that_are_missing_are_named_with_their_packages(monkeypatch):
    """A tool installed by uv or pipx has no setup.sh: the doctor's advice is the same."""
    script = (ROOT / "scripts" / "setup.sh").read_text()
    named = dict(re.findall(r"^(?:libraries=')?(lib\S+\.so\.\d+) ([\w.-]+)'?$", script, re.M))
    assert named == checks.LIBRARIES
    monkeypatch.setattr(checks.sys, "platform", "linux")
    monkeypatch.setattr(checks, "LIBRARIES", {"libnone.so.7": "libnone7"})
    told = checks.check_libraries()
    assert (told.status, told.name) == ("fails", "libraries")
    assert "libnone.so.7" in told.about
    assert "apt-get install --no-install-recommends libnone7" in told.advice
    monkeypatch.setattr(checks.sys, "platform", "darwin")
    assert checks.check_libraries().status == "works"

"""Every pinned version has its hashes, and pip checks them."""

from __future__ import annotations

import base64
import hashlib
import re
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def lines(name: str) -> list[str]:
    text = (ROOT / name).read_text(encoding="utf-8").replace("\\\n", " ")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def test_every_pin_has_its_hashes():
    locked = dict(line.split("    ", 1) for line in lines("constraints.lock"))
    assert [pin.strip() for pin in locked] == lines("constraints.txt")
    for pin, hashes in locked.items():
        assert re.fullmatch(r"(\s*--hash=sha256:[0-9a-f]{64})+\s*", hashes), pin


def wheel(folder: Path) -> Path:
    """A wheel of a package with nothing inside."""
    path = folder / "tiny-1.0-py3-none-any.whl"
    files = {
        "tiny.py": b"",
        "tiny-1.0.dist-info/METADATA": b"Metadata-Version: 2.1\nName: tiny\nVersion: 1.0\n",
        "tiny-1.0.dist-info/WHEEL": b"Wheel-Version: 1.0\nGenerator: a2v\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    rows = [
        f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip('=')},{len(data)}"
        for name, data in files.items()
    ]
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
        archive.writestr(
            "tiny-1.0.dist-info/RECORD", "\n".join([*rows, "tiny-1.0.dist-info/RECORD,,", ""])
        )
    return path


def test_pip_refuses_another_file_of_the_same_version(tmp_path):
    """Names with constraints that have hashes."""
    digest = hashlib.sha256(wheel(tmp_path).read_bytes()).hexdigest()
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--disable-pip-version-check",
        "--no-index",
        "--find-links",
        tmp_path,
        "-q",
        "--target",
        tmp_path / "there",
    ]
    for given, code in ((digest, 0), ("0" * 64, 1)):
        (tmp_path / "pins.lock").write_text(f"tiny==1.0 \\\n    --hash=sha256:{given}\n")
        words = [*command, "--upgrade", "-c", tmp_path / "pins.lock", "tiny"]
        done = subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=120)
        assert done.returncode == code, done.stderr
    assert "DO NOT MATCH THE HASHES" in done.stderr

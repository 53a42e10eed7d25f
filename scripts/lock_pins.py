"""Write the hashes of all files of every pinned version to constraints.lock.

python scripts/lock_pins.py --uv /path/to/uv          # asks the package index; uv 0.13

The pins are those of constraints.txt; pip and uv verify the hashes. The CPU builds of torch are not
on PyPI: give their wheels with --wheel. Those of other Python versions get no hash
(scripts/setup.sh).
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from a2v.io import atomic_path, sha256

ROOT = Path(__file__).resolve().parent.parent
PINS, LOCK = ROOT / "constraints.txt", ROOT / "constraints.lock"
HEAD = """# constraints.txt with the hashes of every file of each version: pip install -c constraints.lock, or uv pip install -c constraints.lock.
# Made by scripts/lock_pins.py; change a version in constraints.txt and run it again.
"""
_PIN = re.compile(r"([\w.-]+)==([\w.+!-]+)(?:; (.*))?")


def pins() -> list[tuple[str, str, str]]:
    """Name, version and marker of every pin."""
    lines = [
        line.strip()
        for line in PINS.read_text(encoding="utf-8").splitlines()
        if line.strip() and not line.startswith("#")
    ]
    found = [_PIN.fullmatch(line) for line in lines]
    assert all(found), "a line of constraints.txt is no pin"
    return [(match[1], match[2], match[3] or "") for match in found if match]


def hashes(
    uv: str, chosen: list[tuple[str, str, str]], python: str
) -> dict[tuple[str, str], list[str]]:
    """The hashes of all files of versions, as uv finds them in the index, for versions of Python
    from `python` on."""
    with tempfile.TemporaryDirectory() as folder:
        given, made = Path(folder) / "pins.in", Path(folder) / "pins.out"
        given.write_text(
            "".join(f"{name}=={version}\n" for name, version, _ in chosen), encoding="utf-8"
        )
        command = [
            uv,
            "pip",
            "compile",
            given,
            "-o",
            made,
            "--no-deps",
            "--generate-hashes",
            "--no-header",
            "--no-annotate",
            "-q",
        ]
        command += ["--universal", "--python-version", python, "--system-certs", "--no-config"]
        subprocess.run([str(word) for word in command], check=True, cwd=folder)
        text = made.read_text(encoding="utf-8").replace("\\\n", " ")
    found = {}
    for line in text.splitlines():
        name, version = line.split(";")[0].split()[0].split("==")
        found[name, version] = sorted(re.findall(r"--hash=(sha256:[0-9a-f]{64})", line))
    return found


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--uv", default="uv")
    parser.add_argument(
        "--wheel",
        type=Path,
        action="append",
        default=[],
        help="a wheel that the index does not have",
    )
    options = parser.parse_args()
    known = pins()
    old = [pin for pin in known if pin[2] == 'python_version < "3.11"']
    found = hashes(options.uv, [pin for pin in known if pin not in old], "3.11") | hashes(
        options.uv, old, "3.10"
    )
    for wheel in options.wheel:
        name, version = wheel.name.split("-")[:2]
        found[name, version.split("+")[0]].append(f"sha256:{sha256(wheel)}")
    if missing := [
        f"{name}=={version}" for name, version, _ in known if not found.get((name, version))
    ]:
        sys.exit(f"no hashes for {', '.join(missing)}")
    with atomic_path(LOCK) as temporary, open(temporary, "w", encoding="utf-8") as stream:
        stream.write(HEAD)
        for name, version, marker in known:
            files = "".join(f" \\\n    --hash={one}" for one in found[name, version])
            stream.write(f"{name}=={version}{f'; {marker}' if marker else ''}{files}\n")
    print(
        f"{LOCK}: {len(known)} pins, "
        f"{sum(len(found[name, version]) for name, version, _ in known)} files"
    )


if __name__ == "__main__":
    main()

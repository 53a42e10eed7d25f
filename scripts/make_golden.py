"""Make the golden panel's figures, ``tests/reconstruction/golden.npz``, or compare with them.

    python scripts/make_golden.py              # writes the file
    python scripts/make_golden.py --compare    # says what differs from it

Only numbers and pictures of 64 pixels are stored. It needs the folder of real data.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np

from a2v.io import write_npz
from pipelines.engine.store import Store
from tests.support.golden import FILE, PEOPLE, differences, figures_of, stored_figures

ROOT = Path(__file__).resolve().parent.parent


def main() -> None:
    """Make the figures of every person."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--compare", action="store_true", help="compare with the stored figures")
    parser.add_argument("--cache", help="folder of the store (default: the common one)")
    given = parser.parse_args()
    data = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data"))
    stored, made = stored_figures() if given.compare else {}, dict[str, np.ndarray]()
    with tempfile.TemporaryDirectory() as folder:
        for name in PEOPLE:
            found = figures_of(name, data, Store(given.cache), Path(folder))
            made |= {f"{name}.{key}": value for key, value in found.items()}
            wrong = differences(found, stored[name]) if given.compare else []
            print(f"{name}: {'; '.join(wrong) or 'made' if wrong or not stored else 'as stored'}")
    if not given.compare:
        write_npz(FILE, made, compress=True)
        print(f"{FILE}: {FILE.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()

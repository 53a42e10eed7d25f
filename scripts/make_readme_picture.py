"""``docs/images/walk.webp``, the README's moving picture, out of a video that this project
rendered.

a2v video --photo a2v/samples/person.jpg --action Walk --out out/walk
python scripts/make_readme_picture.py out/walk/video.mp4 [--width 1000] [--out
docs/images/walk.webp]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from a2v.rendering import probe_video, read_video, write_webp

ROOT = Path(__file__).resolve().parent.parent
MAX_BYTES = 3_000_000


def main() -> int:
    """Shrink, write, and lower the quality until it fits."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("video", type=Path)
    parser.add_argument("--width", type=int, default=1000)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images" / "walk.webp")
    given = parser.parse_args()
    info = probe_video(given.video)
    size = (given.width, round(info.height * given.width / info.width))
    frames = [
        np.asarray(Image.fromarray(frame).resize(size, Image.Resampling.LANCZOS))
        for frame in read_video(given.video)
    ]
    for quality in range(75, 20, -10):
        write_webp(given.out, frames, info.fps, quality=quality)
        if given.out.stat().st_size <= MAX_BYTES:
            print(
                f"{given.out}: {len(frames)} frames, {given.out.stat().st_size / 1e6:.2f} MB at "
                f"quality {quality}"
            )
            return 0
    print(
        f"{given.out} is larger than {MAX_BYTES / 1e6:g} MB; give a smaller --width",
        file=sys.stderr,
    )
    return 2


if __name__ == "__main__":
    sys.exit(main())

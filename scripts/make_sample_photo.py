"""Make ``a2v/samples/person.jpg``, the photo that a2v ships: a rendered person.

python scripts/make_sample_photo.py [--avatar NHPI_M_1_Casual] [--out FILE.jpg] [--sheet NAME ...]

No picture of a real person is needed. It uses the avatars of ``$A2V_DATA/avatars`` (default:
``../shared/data`` beside the repository). The same script makes the same picture, up to the
renderer's rounding. `--sheet` makes a contact sheet of several avatars instead.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.avatars import a_pose
from a2v.lab.studio.portrait import Portrait, PortraitSettings, take_portrait
from a2v.rendering import contact_sheet

ROOT = Path(__file__).resolve().parent.parent
MAX_BYTES = 300_000


def take(avatar: Path, settings: PortraitSettings) -> Portrait:
    return take_portrait(
        load_avatar(avatar).surface(a_pose(arms=38.0, feet=6.0, fingers=9.0)), settings
    )


def write_jpeg(path: Path, image: np.ndarray) -> int:
    """Write the picture at the best quality that stays under `MAX_BYTES`; returns the quality."""
    for quality in range(95, 40, -3):
        with atomic_path(path) as temporary:
            Image.fromarray(image).save(
                temporary, quality=quality, optimize=True, subsampling=0 if quality > 85 else 2
            )
        if path.stat().st_size <= MAX_BYTES:
            return quality
    raise InputError(f"{path} cannot be made smaller than {MAX_BYTES} bytes")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "--avatar", default="NHPI_M_1_Casual", help="file name in $A2V_DATA/avatars, without .glb"
    )
    parser.add_argument("--out", type=Path, default=ROOT / "a2v" / "samples" / "person.jpg")
    parser.add_argument(
        "--sheet",
        nargs="+",
        metavar="NAME",
        help="several avatars on one contact sheet, 384 px each",
    )
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--spp", type=int, default=128)
    given = parser.parse_args(arguments)
    folder = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data")) / "avatars"
    try:
        if not folder.is_dir():
            raise InputError(
                f"{folder} does not exist; set A2V_DATA to the folder of data whose 'avatars' "
                "holds the .glb files"
            )
        if given.sheet:
            settings = PortraitSettings(size=384, spp=min(given.spp, 32))
            pictures = [take(folder / f"{name}.glb", settings).image for name in given.sheet]
            write_jpeg(given.out, contact_sheet(pictures, labels=given.sheet))
        else:
            photo = take(
                folder / f"{given.avatar}.glb", PortraitSettings(size=given.size, spp=given.spp)
            )
            quality = write_jpeg(given.out, photo.image)
            print(
                f"quality {quality}, {given.out.stat().st_size} bytes, the person covers "
                f"{photo.mask.mean():.1%}"
            )
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())

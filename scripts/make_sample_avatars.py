"""Make sample avatars that anybody may ship (CC0), of people who do not exist.

They are dressed from MakeHuman's free wardrobe, photographed, and made into characters. The script
needs ``makehuman_cc0.zip`` in ``$A2V_DATA`` (default: ``../shared/data`` beside the repository).
Each person is drawn by a number and a seed; the photo is rendered by the studio, and everything
after that is what `a2v character` does with any photo.

python scripts/make_sample_avatars.py --out avatars makes ten GLBs for TalkingHead, and a sheet;
--formats glb,vrm,fbx,usdz more formats; --numbers 3,7 --photos-only only the photos of two people.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from tqdm import tqdm

import a2v
from a2v.animation.rig_spec import OWN_RIG
from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.lab.studio.avatars import a_pose
from a2v.lab.studio.makehuman.dressing import dress
from a2v.lab.studio.makehuman.people import Person, Wardrobes, draw_person
from a2v.lab.studio.portrait import PortraitSettings, take_portrait
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.types import Character, Surface

ROOT = Path(__file__).resolve().parent.parent
SEED = 2026
SPLIT = "training"
CC0 = "https://creativecommons.org/publicdomain/zero/1.0/"
RIGS = {"glb": "talkinghead", "fbx": "mixamo"}
"""Rig of each format; the others have the default."""


def photograph(person: Person, wardrobes: Wardrobes, path: Path, *, size: int, spp: int) -> None:
    """Write the photo of a person who stands with the arms a little away from the body."""
    surface = dress(person, wardrobes).prepared.avatar.surface(
        a_pose(arms=38.0, feet=6.0, fingers=9.0)
    )
    photo = take_portrait(surface, PortraitSettings(size=size, spp=spp))
    with atomic_path(path) as temporary:
        Image.fromarray(photo.image).save(temporary, quality=92)


def make(
    photo: Path, out: Path, formats: list[str], *, triangles: int, texture: int
) -> tuple[Character, dict[str, int]]:
    """Write the character of a photo in each format; the character, and sizes in bytes by file
    name."""
    person = a2v.make_character(photo, triangles=triangles, texture=texture)
    sizes = {}
    for suffix in formats:
        target = out / f"{photo.stem}.{suffix}"
        if suffix == "vrm":
            person.save(target, author="a2v", license_url=CC0)
        elif suffix == "glb":
            person.save(target, rig=RIGS[suffix], compress="meshopt")
        else:
            person.save(target, rig=RIGS.get(suffix, OWN_RIG))
        sizes[target.name] = target.stat().st_size
    return person.character, sizes


def look(surface: Surface, photo: Path, size: int = 300) -> np.ndarray:
    """The photo beside the character from front, left, back and right."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    seen = {"center": (low + high) / 2, "extent": 1.08 * float((high - low).max()), "size": size}
    style = PreviewStyle(shaded=False)
    sides = [
        preview_surface(surface, azimuth=turn, **seen, style=style)
        for turn in (0.0, 90.0, 180.0, 270.0)
    ]
    first = np.asarray(Image.open(photo).convert("RGB").resize((size, size)))
    return np.concatenate([first, *sides], axis=1)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--numbers", default="0,1,2,3,4,5,6,7,8,9", help="which people, by number")
    parser.add_argument(
        "--formats", default="glb", help="suffixes of `a2v character --out`, with commas"
    )
    parser.add_argument("--triangles", type=int, default=12_000)
    parser.add_argument("--texture", type=int, default=1024, help="pixels")
    parser.add_argument(
        "--size", type=int, default=1024, help="width and height of the photos, pixels"
    )
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel of the photos")
    parser.add_argument("--photos-only", action="store_true", help="take the photos, and stop")
    given = parser.parse_args(arguments)
    data = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data"))
    try:
        wardrobes = Wardrobes(data)
        given.out.mkdir(parents=True, exist_ok=True)
        sizes: dict[str, int] = {}
        rows = []
        for number in tqdm([int(word) for word in given.numbers.split(",")], unit="person"):
            photo = given.out / f"avatar_{number:02d}.jpg"
            if not photo.exists():
                person = draw_person(wardrobes, SPLIT, number, SEED)
                photograph(person, wardrobes, photo, size=given.size, spp=given.spp)
            if given.photos_only:
                continue
            character, made = make(
                photo,
                given.out,
                given.formats.split(","),
                triangles=given.triangles,
                texture=given.texture,
            )
            sizes |= made
            rows.append(look(character.surface, photo))
        if rows:
            with atomic_path(given.out / "sheet.jpg") as temporary:
                Image.fromarray(np.concatenate(rows)).save(temporary, quality=85)
            facts = {"seed": SEED, "split": SPLIT, "licence": CC0, "bytes": sizes}
            with atomic_path(given.out / "avatars.json") as temporary:
                temporary.write_text(json.dumps(facts, indent=1) + "\n")
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())

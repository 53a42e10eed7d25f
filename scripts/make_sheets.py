"""Draw contact sheets into an ignored folder: each photo beside its character from all sides, and
in motion.

    python scripts/make_sheets.py [NAME ...] [--out sheets] [--action Walk] [--frames 4] [--size
    320] [--docs] python scripts/make_sheets.py [NAME ...] --faces       heads instead: expressions
    from before and turned, and how far the landmarks are off;
                                                           --docs: all of them small, into
                                                           docs/images/faces.jpg

NAME is a photo's file name without suffix, or an avatar's; by default the sample, the photos of
``$A2V_DATA/photos`` and six avatars of ``$A2V_DATA/avatars`` photographed here. `--docs` also
writes the sample's sheet to ``docs/images/sample_sheet.jpg``.
"""

from __future__ import annotations

import argparse
import dataclasses
import io
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from a2v.animation import deform, load_rig
from a2v.animation.rest_pose import rest_transforms
from a2v.body.face import face_landmarks
from a2v.formats.gltf.vrm import EXPRESSIONS
from a2v.io import atomic_path
from a2v.perception.face import look_closely
from a2v.reconstruction import surface_sheet
from a2v.reconstruction.face.places import BROWS, LEFT_EYE, LIPS, RIGHT_EYE
from a2v.rendering import Framing, Renderer, contact_sheet, follow_cameras
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.types import Character, PhotoCamera, RenderSettings, Subject, Surface
from pipelines.bar import Bars
from pipelines.engine.store import Store
from pipelines.nodes.values import Poses
from pipelines.requests.video import video_parameters
from pipelines.run import run

ROOT = Path(__file__).resolve().parent.parent
AVATARS = (
    "AIAN_F_1_Casual",
    "Asian_M_2_Busi",
    "Black_F_3_Milit",
    "Hispanic_M_3_Casual",
    "MENA_F_1_Busi",
    "White_M_3_Casual",
)
FACES: dict[str, dict[str, float]] = {
    "neutral": {},
    "blink": {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0},
    "smile": {
        "mouthSmileLeft": 1.0,
        "mouthSmileRight": 1.0,
        "cheekSquintLeft": 0.5,
        "cheekSquintRight": 0.5,
    },
    "open jaw": {"jawOpen": 1.0},
    **{vowel: EXPRESSIONS[vowel] for vowel in ("aa", "ih", "ou", "ee", "oh")},
}
"""Drawn expressions; vowels have the strengths of VRM's presets."""
PLACED = {"eyes": (*RIGHT_EYE, *LEFT_EYE), "brows": BROWS, "lips": LIPS}
"""Landmarks that are measured."""


def sources(data: Path) -> dict[str, Path]:
    """Photos and avatars by name; avatars end in .glb."""
    photos = [ROOT / "a2v" / "samples" / "person.jpg"]
    photos += sorted(
        path for path in (data / "photos").glob("*.*g") if not path.stem.endswith("_mask")
    )
    return {
        path.stem: path
        for path in [*photos, *(data / "avatars" / f"{name}.glb" for name in AVATARS)]
        if path.exists()
    }


def photographed(avatar: Path, folder: Path) -> Path:
    """A photo of an avatar, made here."""
    from a2v.lab.studio.avatar_files import load_avatar
    from a2v.lab.studio.avatars import a_pose
    from a2v.lab.studio.portrait import PortraitSettings, take_portrait

    path = folder / f"{avatar.stem}_photo.png"
    if not path.exists():
        picture = take_portrait(
            load_avatar(avatar).surface(a_pose(arms=38.0, feet=6.0, fingers=9.0)),
            PortraitSettings(size=1024, spp=64),
        ).image
        with atomic_path(path) as temporary:
            Image.fromarray(picture).save(temporary)
    return path


def sheet(photo: Path, *, model: str, action: str, frames: int, seed: int, size: int) -> np.ndarray:
    """Draw the photo's crop, the surface from all sides, the character in T-pose, frames of the
    action in four views, and the notes for the user."""
    store = Store()
    parameters = video_parameters(
        store, photo, action, model=model, seconds=2.0 * (frames - 1) + 0.1, seed=seed
    )
    bars = Bars()
    outcome = run(
        ["subject", "colored_surface", "poses", "character"],
        store=store,
        progress=bars,
        **parameters,
    )
    bars.close()
    for text in outcome.notes:
        print(f"{photo.stem}: {text}", file=sys.stderr)
    still = surface_sheet(outcome.get("colored_surface", Surface))
    subject, character = outcome.get("subject", Subject), outcome.get("character", Character)
    transforms = outcome.get("poses", Poses).bone_transforms
    # only what is shown is rendered
    shown = [
        deform(character, transforms[t])
        for t in np.linspace(0, len(transforms) - 1, frames).astype(int)
    ]
    settings = RenderSettings(size=size)
    tracks = follow_cameras(
        np.stack([[points.min(0), points.max(0)] for points in shown]),
        settings,
        framing=Framing(smoothing=0.0),
    )
    renderer = Renderer(character.surface, settings)
    picks = [
        renderer.render(points, camera)
        for view in settings.views
        for points, camera in zip(shown, tracks[view], strict=True)
    ]
    actions = contact_sheet(picks, cols=2 * frames)  # two views a row
    crop = Image.fromarray(subject.image)
    crop = crop.resize(
        (round(crop.width * still.shape[0] / crop.height), still.shape[0]), Image.Resampling.LANCZOS
    )
    above = np.hstack([np.asarray(crop), still])
    below = Image.fromarray(actions)
    below = below.resize(
        (above.shape[1], round(below.height * above.shape[1] / below.width)),
        Image.Resampling.LANCZOS,
    )
    told = Image.new("RGB", (above.shape[1], 16 * len(outcome.notes)), "white")
    for row, text in enumerate(outcome.notes):
        ImageDraw.Draw(told).text((6, 16 * row + 2), text, fill="black")
    return np.vstack(
        [above, t_pose_row(character, above.shape[1]), np.asarray(below), np.asarray(told)]
    )


def t_pose_row(character: Character, width: int) -> np.ndarray:
    """Draw the character in T-pose from the front, the side, behind and above, (H, width, 3): parts
    that touch in the photo must be separate."""
    vertices = deform(character, rest_transforms(character.body, load_rig("vrm")))
    moved = dataclasses.replace(character.surface, vertices=vertices, face=None)
    sides = [
        preview_surface(moved, azimuth=turn, elevation=up, size=width // 4)
        for turn, up in ((0, 0), (90, 0), (180, 0), (30, 55))
    ]
    row = np.hstack(sides)
    return np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0)), constant_values=235)


def face_sheet(photo: Path, *, size: int) -> np.ndarray:
    """Draw the photo's face, and its expressions from the front and turned by 45 degrees. Print the
    errors of landmarks, pixels of a face of 512."""
    bars = Bars()
    outcome = run(
        ["subject", "photo_camera", "colored_surface"],
        store=Store(),
        progress=bars,
        **video_parameters(Store(), photo, "Walk"),
    )
    bars.close()
    surface, subject = outcome.get("colored_surface", Surface), outcome.get("subject", Subject)
    if surface.face is None or subject.face is None:
        print(f"{photo.stem}: {surface.provenance.get('face')}")
        return np.full((size, 6 * size, 3), 235, np.uint8)
    middle = surface.vertices[surface.face.patch].mean(axis=0).astype(np.float64) + np.array(
        [0, 0.01, -0.03]
    )
    extent = 1.5 * float(np.ptp(surface.vertices[surface.face.patch][:, 1]))
    camera = outcome.get("photo_camera", PhotoCamera)
    (u, v), half = camera.project(middle[None])[0], camera.scale * extent / 2
    box = [round(x) for x in (u - half, v - half, u + half, v + half)]
    rows = [
        [
            np.asarray(
                Image.fromarray(subject.image)
                .crop(box)
                .resize((size, size), Image.Resampling.LANCZOS)
            )
        ]
        for _ in range(2)
    ]
    for strengths in FACES.values():
        moved, offsets = surface.face.mixed(strengths)
        vertices = surface.vertices.copy()
        vertices[moved] += offsets.astype(np.float32)
        shown = dataclasses.replace(surface, vertices=vertices, face=None)
        for row, azimuth in zip(rows, (0.0, 45.0), strict=True):
            row.append(
                preview_surface(shown, azimuth=azimuth, size=size, center=middle, extent=extent)
            )
    _measure(photo.stem, surface, subject, camera, middle, extent)
    return np.vstack([np.hstack(row) for row in rows])


def _measure(
    name: str,
    surface: Surface,
    subject: Subject,
    camera: PhotoCamera,
    middle: np.ndarray,
    extent: float,
) -> None:
    """Compare the landmarks of the surface, and those detected in its neutral picture, with those
    detected in the photo. For comparison it also measures the error of the detector itself: the
    same photo in other squares.
    """
    face, landmarks = surface.face, subject.face
    assert face is not None
    assert landmarks is not None
    corners, weights = face_landmarks()
    place = np.full(int(corners.max()) + 1, -1)
    own = (face.kinds == 0) & (face.twins <= corners.max())
    place[face.twins[own]] = face.patch[own]
    lying = camera.project(
        np.einsum("kc,kcd->kd", weights, surface.vertices[place[corners]].astype(np.float64))
    )
    _tell(name, "placed", lying, landmarks[:, :2], (place[corners] >= 0).all(axis=1))
    size, half, at = 768, camera.scale * extent / 2, camera.project(middle[None])[0]
    picture = preview_surface(
        dataclasses.replace(surface, face=None),
        size=size,
        center=middle,
        extent=extent,
        style=PreviewStyle(shaded=False),
    )
    found = look_closely(picture, np.full(2, size / 2), size / 2)
    again = look_closely(subject.image, at + 0.04 * half, 0.97 * half)
    for how, seen in (
        (
            "detected again on the character",
            None if found is None else (found[:, :2] - size / 2) * 2 * half / size + at,
        ),
        ("detected again on the photo", None if again is None else again[:, :2]),
    ):
        if seen is None:
            print(f"{name}, {how}: no face is seen")
        else:
            _tell(name, how, seen, landmarks[:, :2], np.ones(len(seen), bool))


def _tell(name: str, how: str, seen: np.ndarray, asked: np.ndarray, known: np.ndarray) -> None:
    """Print the distances of landmarks (478, 2) from their targets, in pixels of a face of 512."""
    away = 512 / float(np.ptp(asked[:, 1])) * np.linalg.norm(seen - asked, axis=1)
    parts = {part: away[[index for index in ids if known[index]]] for part, ids in PLACED.items()}
    said = (
        f"{part} {np.median(own):.1f} ({own.max():.1f})" for part, own in parts.items() if len(own)
    )
    print(f"{name}, {how}: off by {', '.join(said)} px, median (most), of a face of 512")


def _write_for_docs(picture: Image.Image, largest: tuple[int, int], name: str) -> None:
    """Write a small copy of a sheet beside the documentation's pictures."""
    picture.thumbnail(largest, Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    picture.convert("RGB").save(buffer, "jpeg", quality=80, optimize=True)
    with atomic_path(ROOT / "docs" / "images" / name) as temporary:
        temporary.write_bytes(buffer.getvalue())


def main() -> int:
    """Write the sheets; print their paths."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--out", type=Path, default=ROOT / "sheets")
    parser.add_argument("--model", default="cmu")
    parser.add_argument("--action", default="Walk")
    parser.add_argument("--frames", type=int, default=5, help="frames shown, two seconds apart")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=int, default=320)
    parser.add_argument("--faces", action="store_true", help="heads instead")
    parser.add_argument("--docs", action="store_true")
    given = parser.parse_args()
    known = sources(Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data")))
    if unknown := [name for name in given.names if name not in known]:
        print(f"unknown {unknown[0]}; choose from {', '.join(known)}", file=sys.stderr)
        return 2
    faces: list[np.ndarray] = []
    for name in given.names or known:
        path = known[name]
        photo = photographed(path, given.out) if path.suffix == ".glb" else path
        if given.faces:
            target = given.out / f"{name}_face.png"
            made = face_sheet(photo, size=given.size)
            with atomic_path(target) as temporary:
                Image.fromarray(made).save(temporary)
            print(target, flush=True)
            faces += [made] if len(np.unique(made)) > 1 else []  # one color: no face was seen
            continue
        picture = Image.fromarray(
            sheet(
                photo,
                model=given.model,
                action=given.action,
                frames=given.frames,
                seed=given.seed,
                size=given.size,
            )
        )
        target = given.out / (
            f"{name}.png" if given.action == "Walk" else f"{name}_{given.action.lower()}.png"
        )
        with atomic_path(target) as temporary:
            picture.save(temporary)
        print(target)
        if given.docs and name == "person":
            _write_for_docs(picture, (1600, 2400), "sample_sheet.jpg")
    if faces and given.docs:
        _write_for_docs(Image.fromarray(np.vstack(faces)), (1000, 6000), "faces.jpg")
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())

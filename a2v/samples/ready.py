"""The person of the sample photo, made beforehand, so that a lesson can start at any stage.

``ready_person.npz`` holds what the stages from the photo to the colored surface return at their
defaults. Coordinates and colors are rounded. What follows from the photo or from the body model is
left out and computed again: the image, the bodies' skin, the mesh with its texture layout, and the
skinning weights. `scripts/make_ready_person.py` makes the file.
"""

from __future__ import annotations

import dataclasses
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import PIL.Image

from a2v.animation import standing_character
from a2v.body import load_body_model, make_body
from a2v.body.fingers import reskinned
from a2v.errors import InputError
from a2v.io import read_bytes, read_npz, write_npz
from a2v.perception import decode_photo
from a2v.reconstruction.canonical.build import posed_vertices, standing_of
from a2v.reconstruction.canonical.topology import topology
from a2v.record import Record
from a2v.types import (
    Body,
    ByteArray,
    Character,
    Face,
    FloatArray,
    PhotoCamera,
    Subject,
    Surface,
)

PHOTO = Path(__file__).with_name("person.jpg")
"""The sample photo."""
FILE = Path(__file__).with_name("ready_person.npz")
STEP = 1e-5
"""Step to which vertices are rounded, meters. One edge in a thousand is under 0.05 mm long."""
FACE_STEP = 2e-5
"""Step to which the offsets of expressions are rounded, meters."""
QUALITY = {"colored_surface": 90, "shaded_surface": 80}
"""Quality of the textures as WebP."""

Arrays = dict[str, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class ReadyPerson:
    """The results of the stages for one photo, by the names of the pipeline's outputs.

    Attributes
    ----------
    subject : Subject
        The person in the photo.
    photo_body : Body
        Fitted to the photo alone.
    photo_camera : PhotoCamera
    body : Body
        Fitted to the reconstructed surface as well, with bent fingers.
    colored_surface : Surface
        Canonical: in the pose of the photo, with a `Standing`.
    shaded_surface : Surface
        The same with the photo's shading in its colors.
    """

    subject: Subject
    photo_body: Body
    photo_camera: PhotoCamera
    body: Body
    colored_surface: Surface
    shaded_surface: Surface

    @property
    def character(self) -> Character:
        """The colored surface bound to the body, both at rest."""
        return standing_character(self.colored_surface, self.body)

    @property
    def outputs(self) -> Mapping[str, Record]:
        """All stages with the character, by the names of the pipeline's outputs."""
        own = {item.name: getattr(self, item.name) for item in dataclasses.fields(self)}
        return own | {"character": self.character}

    def save(self, path: str | Path) -> None:
        """Write the person of the sample photo in the form that `load_ready_person` reads."""
        write_npz(path, _packed(self), compress=True)


def load_ready_person() -> ReadyPerson:
    """Load the person of the sample photo without running perception, fit and reconstruction.

    It takes 3 s of processor time, mainly for the body model.

    Returns
    -------
    ReadyPerson
        What the pipeline makes of ``a2v/samples/person.jpg`` at its defaults; see `STEP`,
        `FACE_STEP` and `QUALITY` for the differences.
    """
    stored = read_npz(FILE)
    body = _unpack_body(_below(stored, "body"))
    shape = _unpack_shape(_below(stored, "surface"), body)
    return ReadyPerson(
        subject=_unpack_subject(_below(stored, "subject")),
        photo_body=_unpack_body(_below(stored, "photo_body")),
        photo_camera=PhotoCamera.from_arrays(_below(stored, "photo_camera")),
        body=body,
        **{name: _unpack_colors(_below(stored, name), shape) for name in QUALITY},
    )


def _packed(person: ReadyPerson) -> Arrays:
    parts: dict[str, Arrays] = {
        "subject": _pack_subject(person.subject),
        "photo_body": _pack_body(person.photo_body),
        "photo_camera": person.photo_camera.to_arrays(),
        "body": _pack_body(person.body),
        "surface": _pack_shape(person.colored_surface, person.body),
        **{name: _pack_colors(getattr(person, name), QUALITY[name]) for name in QUALITY},
    }
    return {f"{part}.{name}": array for part, own in parts.items() for name, array in own.items()}


def _below(stored: Mapping[str, np.ndarray], part: str) -> Arrays:
    """Return the arrays whose names begin with `part` and a point, without that."""
    return {
        name.removeprefix(f"{part}."): array
        for name, array in stored.items()
        if name.startswith(f"{part}.")
    }


# --- the subject: without the pixels of the photo


def _pack_subject(subject: Subject) -> Arrays:
    arrays = dataclasses.replace(subject, image=np.zeros_like(subject.image)).to_arrays()
    coarse = {
        name: array.astype(np.float16)
        for name, array in arrays.items()
        if name.startswith("bodymap.") and array.ndim > 1 and array.dtype == np.float32
    }
    return arrays | coarse | {"mask": _bytes_of(subject.mask)}


def _unpack_subject(stored: Arrays) -> Subject:
    exact = {
        name: array.astype(np.float32) if array.dtype == np.float16 else array
        for name, array in stored.items()
    }
    subject = Subject.from_arrays(exact | {"mask": _from_bytes(stored["mask"])})
    left, top, right, bottom = subject.crop
    photo = decode_photo(read_bytes(PHOTO))
    return dataclasses.replace(
        subject, image=np.ascontiguousarray(photo[top:bottom, left:right, :3])
    )


# --- bodies: parameters, and the bones that bent fingers have moved


def _pack_body(body: Body) -> Arrays:
    kept = dataclasses.replace(body, vertices=np.zeros_like(body.vertices)).to_arrays()
    return {
        name: array
        for name, array in kept.items()
        if name.partition(".")[0] in ("parameters", "bone_transforms", "provenance")
    }


def _unpack_body(stored: Arrays) -> Body:
    parameters = _below(stored, "parameters")
    straight = make_body(
        load_body_model(), parameters["rotations"], parameters["shape"], parameters["translation"]
    )
    bent = reskinned(straight, stored["bone_transforms"].astype(np.float64))
    provenance = json.loads(str(stored["provenance"]))
    return dataclasses.replace(bent, parameters=parameters, provenance=provenance)


# --- surfaces: their shape once, and the colors of each


def _pack_shape(surface: Surface, body: Body) -> Arrays:
    standing, face = surface.standing, surface.face
    if (
        standing is None
        or face is None
        or surface.visible is None
        or len(standing.vertices) != len(topology().nearest)
    ):
        raise InputError("a ready person is canonical, with a face and without a skirt")
    rounded = dataclasses.replace(
        standing, vertices=_from_steps(_steps(standing.vertices, STEP), STEP)
    )
    shift = surface.vertices - posed_vertices(rounded, body)
    return {
        "standing": _steps(standing.vertices, STEP),
        "shift": _steps(shift, STEP),
        "visible": np.packbits(surface.visible),
        **{f"face.{name}": array for name, array in face.to_arrays().items()},
        "face.vertices": np.diff(face.vertices, prepend=np.int32(0)),
        "face.offsets": _steps(face.offsets, FACE_STEP),
    }


def _unpack_shape(stored: Arrays, body: Body) -> Surface:
    mesh = topology()
    standing = standing_of(_from_steps(stored["standing"], STEP), mesh, body)
    face = Face.from_arrays(
        _below(stored, "face")
        | {
            "vertices": np.cumsum(stored["face.vertices"], dtype=np.int32),
            "offsets": _from_steps(stored["face.offsets"], FACE_STEP),
        }
    )
    count = len(standing.vertices)
    return Surface(
        vertices=posed_vertices(standing, body) + _from_steps(stored["shift"], STEP),
        faces=mesh.faces.astype(np.int32),
        colors=np.zeros((count, 3), np.float32),
        visible=np.unpackbits(stored["visible"], count=count).astype(bool),
        face=face,
        standing=standing,
    )


def _pack_colors(surface: Surface, quality: int) -> Arrays:
    if surface.texture is None:
        raise InputError("a ready person has a texture")
    buffer = io.BytesIO()
    PIL.Image.fromarray(surface.texture).save(buffer, "webp", quality=quality, method=6)
    return {
        "colors": _bytes_of(surface.colors),
        "texture": np.frombuffer(buffer.getvalue(), np.uint8),
        "provenance": surface.to_arrays()["provenance"],
    }


def _unpack_colors(stored: Arrays, shape: Surface) -> Surface:
    picture = PIL.Image.open(io.BytesIO(stored["texture"].tobytes()))
    return dataclasses.replace(
        shape,
        colors=_from_bytes(stored["colors"]),
        uv=topology().uv,
        texture=np.array(picture.convert("RGB")),  # Mitsuba refuses arrays that are read-only
        provenance=json.loads(str(stored["provenance"])),
    )


# --- numbers


def _steps(values: FloatArray, step: float) -> np.ndarray:
    """Round meters (n, 3) to steps; return them coordinate by coordinate, as the bytes (4, 3, n) of
    whole numbers, which compresses best."""
    whole = np.round(values.T / step).astype("<i4")
    return np.moveaxis(whole[..., None].view(np.uint8), -1, 0).copy()


def _from_steps(steps: np.ndarray, step: float) -> FloatArray:
    whole = np.moveaxis(steps, 0, -1).copy().view("<i4")[..., 0]
    return np.ascontiguousarray(whole.T * step, np.float32)


def _bytes_of(shares: FloatArray) -> ByteArray:
    """Round shares in [0, 1] to 255 levels."""
    return np.asarray(np.round(255 * shares), np.uint8)


def _from_bytes(levels: ByteArray) -> FloatArray:
    return levels.astype(np.float32) / np.float32(255)

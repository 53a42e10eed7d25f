"""Run the shipped networks on one person: maps once, then distances and colors of any points, by
onnxruntime."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.body.skin import outer_skin
from a2v.digest import Digest
from a2v.errors import InputError
from a2v.reconstruction.implicit.inputs import (
    FRAME,
    GUIDE,
    Frame,
    GuideMesh,
    guide_input,
    make_frame,
    mask_distance,
    photo_input,
    place_of,
)
from a2v.sessions import WEIGHTS, file_digest, open_session, read_metadata
from a2v.types import Body, FloatArray, OrthographicCamera, Subject

FORMAT = "a2v-person/1"
MAPS_FILE = "person_maps.onnx"
"""The network of maps."""
FIELD_FILE = "person_field.onnx"
"""The network of the field."""
COLORS_FILE = "person_colors.onnx"
"""The network of colors."""
FILES = (MAPS_FILE, FIELD_FILE, COLORS_FILE)
CHUNK = 65_536
"""Number of points per call; bounds memory."""


@dataclass(frozen=True)
class ImplicitModel:
    """The three ONNX files of a pixel-aligned reconstruction.

    Attributes
    ----------
    folder : Path
    metadata : mapping
        Metadata of the files.
    threads : int
        Number of threads of onnxruntime; 0 for its default.
    """

    folder: Path
    metadata: Mapping[str, Any]
    threads: int = 0

    @classmethod
    def load(
        cls, folder: str | os.PathLike[str] | None = None, *, threads: int = 0
    ) -> ImplicitModel:
        """Open the shipped model, or a model in a folder written by ``export/reconstruction.py``.

        Raises
        ------
        InputError
            A file is missing or not an a2v model.
        """
        where = Path(folder) if folder is not None else WEIGHTS
        for name in FILES:
            if not (where / name).is_file():
                raise InputError(
                    f"{where / name} does not exist; give a folder with {', '.join(FILES)}"
                )
        return cls(
            where,
            read_metadata(where / MAPS_FILE, (FORMAT,), "reconstruction model", threads),
            threads,
        )

    @property
    def digest(self) -> Digest:
        """Digest of all files."""
        return Digest.of(*(file_digest(self.folder / name) for name in FILES))

    def see(self, subject: Subject, body: Body, camera: OrthographicCamera) -> ImplicitPerson:
        """Compute the maps of the person in a photo, with the fitted body in the frame of `camera`
        as guide."""
        frame = make_frame(subject.image, subject.mask, camera)
        vertices, faces, _ = outer_skin(body)
        return self.see_frame(frame, vertices, faces)

    def see_frame(self, frame: Frame, vertices: FloatArray, faces: Any) -> ImplicitPerson:
        """Compute the maps of a frame with a guide mesh: vertices (V, 3), faces (F, 3), meters, in
        the frame of its camera."""
        import cv2

        middle = float(np.mean(vertices[:, 2]))
        guide = GuideMesh(np.asarray(vertices, np.float64) - [0, 0, middle], faces)
        small = cv2.resize(frame.mask, (GUIDE, GUIDE), interpolation=cv2.INTER_AREA)
        distance = mask_distance(small, frame.camera.scale * GUIDE / frame.size)
        channels = guide_input(guide.maps(frame.camera, frame.size), distance)
        photo = photo_input(frame.image, frame.mask, FRAME)
        half = photo_input(frame.image, frame.mask, FRAME // 2)
        given = {"photo": photo[None], "photo_half": half[None], "guide": channels[None]}
        names = ["features", "maps", "fine", "color_features"]
        found = open_session(self.folder / MAPS_FILE, self.threads).run(names, given)
        return ImplicitPerson(
            self, frame, guide, middle, dict(zip(names, found, strict=True)) | given
        )


@dataclass(frozen=True)
class ImplicitPerson:
    """One person with the networks' maps.

    Attributes
    ----------
    model : ImplicitModel
    frame : Frame
    guide : GuideMesh
        The fitted body, moved so that its mean z is 0.
    middle : float
        Mean z of the body in the frame of the camera, meters.
    maps : mapping of str to array
        Inputs and outputs of the network of maps; ``maps["maps"]`` (1, 8, 256, 256) holds normals
        and depths.
    """

    model: ImplicitModel
    frame: Frame
    guide: GuideMesh
    middle: float
    maps: Mapping[str, FloatArray]

    def distance(self, points: FloatArray) -> FloatArray:
        """Signed distance (N,) float32 to the person's surface at points (N, 3), meters, negative
        inside."""
        return self._run(
            FIELD_FILE, "distance", ("features", "maps", "fine", "guide"), points, None
        )

    def colors(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Expected sRGB colors (N, 3) in [0, 1] of surface points (N, 3) with unit normals (N,
        3)."""
        return self._run(
            COLORS_FILE,
            "colors",
            ("color_features", "maps", "photo_half", "guide"),
            points,
            normals,
        )

    def _run(
        self,
        file: str,
        output: str,
        maps: tuple[str, ...],
        points: FloatArray,
        normals: FloatArray | None,
    ) -> FloatArray:
        session = open_session(self.model.folder / file, self.model.threads)
        fixed = {name: self.maps[name] for name in maps}
        results = []
        for start in range(0, len(points), CHUNK):
            part = np.asarray(points[start : start + CHUNK], np.float32) - np.array(
                [0, 0, self.middle], np.float32
            )
            distance, facing = self.guide.at(part)
            asked = {
                "place": place_of(part, self.frame.camera, self.frame.size),
                "depth": part[:, 2],
                "guide_distance": distance,
                "guide_normals": facing,
            }
            if normals is not None:
                asked["normals"] = np.asarray(normals[start : start + CHUNK], np.float32)
            results.append(
                session.run(
                    [output], fixed | {name: values[None] for name, values in asked.items()}
                )[0][0]
            )
        return np.concatenate(results)

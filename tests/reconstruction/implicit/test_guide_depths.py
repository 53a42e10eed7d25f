"""The body is moved to the depth of the maps."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from a2v.body.skin import outer_skin
from a2v.reconstruction.implicit.guide_depths import moved_body, spread_over_mesh
from a2v.reconstruction.implicit.inputs import FRAME, Frame, GuideMesh, make_frame
from a2v.types import Body, OrthographicCamera, Subject


def seen(subject: Subject, body: Body, camera: OrthographicCamera, shift: float) -> SimpleNamespace:
    """Return a person whose maps show the body's left side `shift` meters nearer."""
    frame: Frame = make_frame(subject.image, subject.mask, camera)
    vertices, faces, _ = outer_skin(body)
    guide = GuideMesh(vertices - [0, 0, vertices[:, 2].mean()], faces)
    held = guide.maps(frame.camera, FRAME)
    depths = np.nan_to_num(np.stack([held.depth_front, held.depth_back]))
    columns = np.arange(depths.shape[-1])[None, None]
    middle = frame.camera.project(vertices.mean(axis=0)[None])[0, 0] * depths.shape[-1] / FRAME
    depths = depths + np.where(columns > middle, shift, 0)
    maps = np.concatenate([np.zeros((6, *depths.shape[1:])), depths])[None].astype(np.float32)
    return SimpleNamespace(frame=frame, guide=guide, maps={"maps": maps})


@pytest.mark.parametrize(("shift", "share"), [(0.02, (0.4, 1.05)), (0.3, (0.0, 0.2))])
def test_the_maps_move_the_body_but_not_against_all_sense(
    scene: tuple[Subject, Body, OrthographicCamera], shift: float, share: tuple[float, float]
) -> None:
    subject, body, camera = scene
    moved = moved_body(seen(subject, body, camera, shift), body)  # type: ignore[arg-type]
    gained = (moved.vertices - body.vertices)[:, 2] / shift
    assert np.array_equal(moved.vertices[:, :2], body.vertices[:, :2])
    arms = [np.median(gained[side * body.vertices[:, 0] > 0.25]) for side in (1, -1)]
    assert share[0] < arms[0] < share[1]
    assert abs(arms[1]) < 0.2


def test_values_spread_over_the_mesh_and_not_through_the_air() -> None:
    one, two = trimesh.creation.icosphere(3, 0.1), trimesh.creation.icosphere(3, 0.1)
    two.apply_translation([0.21, 0, 0])
    both = trimesh.util.concatenate([one, two])
    count = len(both.vertices)
    trust = np.zeros((2, count))
    trust[0, :20] = 1
    spread = spread_over_mesh(np.full((2, count), 0.1), trust, np.asarray(both.faces))
    assert spread[: len(one.vertices)].mean() == pytest.approx(0.1, abs=0.02)
    assert np.abs(spread[len(one.vertices) :]).max() < 1e-6

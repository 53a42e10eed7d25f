"""Views with a thing in front of the person, as the networks are trained on them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from a2v.io import write_npz
from a2v.lab.studio.view import View, encode_pictures, view_path
from a2v.lab.surface.batches import ViewReader, make_example
from a2v.lab.surface.framed import framed
from a2v.reconstruction.implicit.inputs import FILL, FRAME, frame_box, place_of
from tests.support.ellipsoid import CAMERA, ellipsoid

EDGE = 640
"""Row from which a table hides everything below."""


def surrounded(view: View, rows: int) -> View:
    """The ellipsoid behind a table."""
    mask, things = view.mask.copy(), np.zeros_like(view.mask)
    mask[rows:], things[rows:] = 0, 255
    maps = {name: getattr(view, name) for name in view.encoded if name not in ("image", "mask")}
    return dataclasses.replace(
        view, encoded=encode_pictures(view.image, 98, maps | {"mask": mask, "things": things})
    )


def test_a_whole_person_stays_as_it_is(view: View) -> None:
    same = framed(surrounded(view, FRAME), ellipsoid(0.9).faces)
    assert same.camera.scale == pytest.approx(CAMERA.scale, rel=0.005)
    assert np.abs(same.image.astype(int) - view.image).mean() < 2
    both = np.isfinite(same.depth_front) & np.isfinite(view.depth_front)
    assert both.sum() > 0.99 * np.isfinite(view.depth_front).sum()
    assert np.abs(same.depth_front - view.depth_front)[both].mean() < 0.002
    assert len(same.points) > 0.98 * len(view.points)


def test_what_a_table_hides_is_not_asked_for(view: View) -> None:
    hidden = surrounded(view, EDGE)
    assert hidden.hidden[EDGE // 2 :][np.isfinite(view.depth_front)[EDGE // 2 :]].all()
    assert not hidden.hidden[: EDGE // 2].any()
    seen = framed(hidden, ellipsoid(0.9).faces)
    assert not seen.surrounded
    u, v, side = frame_box(seen.mask / 255)
    assert (u, v, side) == pytest.approx(
        (FRAME / 2, FRAME / 2, FRAME), abs=4
    )  # the visible part fills the frame
    low, high = frame_box(hidden.mask / 255, 1)[1:], seen.camera.scale / CAMERA.scale
    assert high == pytest.approx(FILL * FRAME / low[1], rel=0.01)
    table = (
        np.floor(
            float(
                seen.camera.project(CAMERA.unproject(np.array([[512.0, EDGE]]), np.zeros(1)))[0, 1]
            )
        )
        / 2
    )
    assert np.isnan(seen.depth_front[int(table) + 2 :].astype(np.float32)).all()
    assert not seen.normals_back[int(table) + 2 :].any()
    assert np.isfinite(
        seen.guide_depth_front[int(table / 2) + 4].astype(np.float32)
    ).any()  # the guide is whole
    for points, given in ((seen.points, view.points), (seen.surface_points, view.surface_points)):
        assert 0.4 * len(given) < len(points) < 0.8 * len(given)
        assert (np.abs(place_of(points, seen.camera, FRAME)) <= 1).all()
    assert (CAMERA.project(seen.surface_points)[:, 1] < EDGE + 2).all()
    inside = np.linalg.norm(seen.points / [0.25, 0.85, 0.16], axis=1) < 1
    assert ((seen.distance < 0) == inside)[
        np.abs(seen.distance.astype(np.float32)) > 0.01
    ].all()  # distances go with their points
    pixels = np.floor(seen.camera.project(seen.surface_points[seen.surface_visible]) / 2).astype(
        int
    )
    z = seen.depth_front[pixels[:, 1].clip(0, 511), pixels[:, 0]].astype(np.float32)
    assert np.nanmedian(np.abs(z - seen.surface_points[seen.surface_visible][:, 2])) < 0.005


def test_the_reader_frames_what_may_be_hidden(view: View, tmp_path: Path) -> None:
    write_npz(tmp_path / "guide.npz", {"faces": ellipsoid(0.9).faces})
    for index, one in enumerate((view, surrounded(view, EDGE))):
        write_npz(view_path(tmp_path, "training", index), one.to_arrays())
    read = ViewReader()
    plain, behind = (read(view_path(tmp_path, "training", index)) for index in range(2))
    assert plain.view.camera == CAMERA
    assert behind.view.camera.scale > 1.2 * CAMERA.scale
    example = make_example(behind, np.random.default_rng(0), 200, colors=True, augment=False)
    lowest = np.nonzero((example.photo[3] > 0.5).any(axis=1))[0].max()
    rows = (example.points["place"][:, 1] + 1) / 2 * 512
    assert 0.4 * lowest < np.median(rows) < rows.max() < lowest + 2

"""Checkpoints with a known field give its surface at the place of photo and depth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.geometry.mesh import is_closed
from a2v.lab.papers import PapersSettings, papers_surface
from a2v.lab.papers.models import DEPTH_FACTOR, PIFuGeometry
from a2v.reconstruction.backends import reconstruct
from a2v.reconstruction.coloring import ColorSettings
from a2v.reconstruction.colorings import color_by_photo
from a2v.reconstruction.implicit.inputs import make_frame
from tests.support.checkpoints import pifu_color, saved, slab

FRONT, BACK = 0.12, -0.04
"""Depths of the slab in the network's units."""
PIXELS = 256


@pytest.fixture(scope="module")
def lit(scene):
    """A scene with a gray photo and a bright disc: its middle and radius, pixels.

    The disc is above and to the right of the person's middle.
    """
    subject, body, camera = scene
    rows, columns = np.nonzero(subject.mask > 0.5)
    u, v = (columns.min() + columns.max()) / 2, (rows.min() + rows.max()) / 2
    radius = 0.16 * np.ptp(rows)
    middle = np.array([u + 0.5 * radius, v - 1.2 * radius])
    height, width = subject.mask.shape
    near = (
        np.hypot(
            np.arange(width)[None] + 0.5 - middle[0], np.arange(height)[:, None] + 0.5 - middle[1]
        )
        < radius
    )
    image = np.where(near, 255, 128).astype(np.uint8)[..., None].repeat(3, axis=2)
    mask = np.maximum(subject.mask, near.astype(np.float32))
    return dataclasses.replace(subject, image=image, mask=mask), body, camera, middle, radius


@pytest.fixture(scope="module")
def files(lit, tmp_path_factory):
    subject, _, camera, _, _ = lit
    folder = tmp_path_factory.mktemp("slab")
    frame = make_frame(subject.image, subject.mask, camera, PIXELS)
    image = (frame.image.astype(np.float32) / 127.5 - 1) * frame.mask[..., None]
    with torch.inference_mode():
        network = PIFuGeometry(saved(slab(FRONT, BACK, 1.0), folder / "first"))
        inside = float(
            network.image_filter(torch.from_numpy(image.transpose(2, 0, 1)[None].copy())).max()
        )
    colors = pifu_color((513, 8, 8, 8, 8, 3))
    for name in colors:
        if name.startswith("surface_classifier"):
            colors[name].zero_()
    for index in range(5):  # red where the first of the geometry's features says bright
        colors[f"surface_classifier.conv{index}.weight"][0, 0, 0] = 4
    return PapersSettings(
        pifu_geometry=saved(slab(FRONT, BACK, inside), folder / "net_G"),
        pifu_color=saved(colors, folder / "net_C"),
        pixels=PIXELS,
        resolution=200,
    )


@pytest.fixture(scope="module")
def person(lit, files):
    subject, body, camera, _, _ = lit
    return reconstruct(subject, body, camera, files)


def test_the_field_becomes_its_surface(lit, person):
    subject, body, camera, middle, radius = lit
    surface, expected = person.surface, person.expected_colors
    vertices = surface.vertices
    assert is_closed(vertices, surface.faces)
    pixels = camera.project(vertices)
    assert np.allclose((pixels.min(axis=0) + pixels.max(axis=0)) / 2, middle, atol=0.06 * radius)
    assert np.allclose(
        np.ptp(pixels, axis=0) / 2, radius, rtol=0.15
    )  # the hourglasses blur the rim
    frame = make_frame(subject.image, subject.mask, camera, PIXELS)
    meters = PIXELS / 2 / frame.camera.scale / DEPTH_FACTOR
    depth = float(np.mean(body.vertices[:, 2]))
    assert vertices[:, 2].max() == pytest.approx(depth + FRONT * meters, abs=0.012)
    assert vertices[:, 2].min() == pytest.approx(depth + BACK * meters, abs=0.012)
    assert surface.provenance["geometry"] == "pifu"
    assert expected is not None
    assert expected[:, 0].mean() > 0.9
    assert np.allclose(expected[:, 1:], 0.5)


def test_the_backend_joins_the_colors_by_equation_14(lit, person):
    subject, body, camera, _, _ = lit
    assert person.backend == "papers"
    colored = color_by_photo(person, subject, body, camera, settings=ColorSettings(texture=0))
    back = colored.vertices[:, 2] < colored.vertices[:, 2].min() + 0.02
    front = colored.visible & (colored.vertices[:, 2] > colored.vertices[:, 2].max() - 0.02)
    assert np.median(colored.colors[front], axis=0) == pytest.approx([1, 1, 1], abs=0.1)
    assert np.median(colored.colors[back], axis=0) == pytest.approx([1, 0.5, 0.5], abs=0.1)


def test_what_does_not_fit_is_refused(lit, files, tmp_path):
    subject, body, camera, _, _ = lit
    for settings, words in [
        (PapersSettings(), "--pifuhd FILE, --pifu-geometry FILE or --pamir-geometry FILE"),
        (
            dataclasses.replace(files, pifu_geometry="", pifuhd=files.pifu_color),
            "needs --pifu-geometry",
        ),
        (dataclasses.replace(files, pifu_geometry=str(tmp_path / "none")), "does not exist"),
        (dataclasses.replace(files, digest="0"), "were changed meanwhile"),
    ]:
        with pytest.raises(InputError, match=words):
            papers_surface(subject, body, camera, settings=settings)
    with pytest.raises(InputError, match="multiple of 32"):
        PapersSettings(pixels=100)

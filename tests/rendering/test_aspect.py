"""Views that are not square."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.rendering import Framing, Renderer, follow_cameras
from a2v.types import RenderSettings
from tests.support.blocks import block


@pytest.mark.parametrize(
    ("aspect", "size", "shape"),
    [
        ("1:1", 512, (512, 512)),
        ("9:16", 1920, (1080, 1920)),
        ("16:9", 1280, (1280, 720)),
        ("16:9", 512, (512, 288)),
        ("4:1", 62, (62, 16)),
    ],
)
def test_sizes(aspect: str, size: int, shape: tuple[int, int]) -> None:
    settings = RenderSettings(size=size, aspect=aspect)
    assert settings.shape == shape
    square = np.zeros((size, size))[settings.window]
    assert square.shape == shape[::-1]


@pytest.mark.parametrize("aspect", ["16:9:1", "9x16", "0:1", "1:9", "", "nan:1"])
def test_shapes_that_cannot_be_are_named(aspect: str) -> None:
    with pytest.raises(InputError, match="aspect"):
        RenderSettings(aspect=aspect)


@pytest.mark.parametrize("aspect", ["9:16", "16:9", "1:3"])
def test_the_whole_body_fits_with_its_border(aspect: str) -> None:
    surface = block()
    wide = surface.vertices * np.float32([3, 1, 1])  # arms spread
    settings = RenderSettings(size=96, aspect=aspect)
    width, height = settings.shape
    rows, columns = settings.window
    tight = []
    for view, (camera,) in follow_cameras(wide[None], settings, framing=Framing(share=1.0)).items():
        pixels = camera.project(wide, 96) - (columns.start, rows.start)
        share = np.abs(pixels / (width, height) - 0.5).max(axis=0) * 2
        assert share.max() <= 0.881, view
        tight.append(share.max())
    assert max(tight) > 0.85


def test_a_picture_has_the_shape_and_the_backdrop_fills_it() -> None:
    surface = block()
    settings = RenderSettings(size=64, aspect="9:16", spp=2, threads=1)
    camera = follow_cameras(surface.vertices[None], settings)["front"][0]
    assert Renderer(surface, settings).render(surface.vertices, camera).shape == (64, 36, 3)
    bands = np.zeros((160, 90, 3), np.uint8)
    bands[:80, :, 0], bands[80:, :, 2] = 200, 200
    behind = dataclasses.replace(settings, background="image", denoise=False)
    picture = Renderer(surface, behind, backdrop=bands).render(surface.vertices, camera)
    assert picture.shape == (64, 36, 3)
    np.testing.assert_allclose(picture[0, [0, -1]], [[200, 0, 0]] * 2, atol=2)
    assert (picture[-1, [0, -1], 2] > 60).all()
    assert picture[-1, [0, -1], 0].max() == 0


@pytest.mark.parametrize("aspect", ["9:16", "16:9"])
def test_what_is_cut_off_is_not_traced_and_the_rest_is_the_square_pictures(aspect: str) -> None:
    surface = block()
    settings = RenderSettings(size=96, aspect=aspect, spp=16, threads=1)
    camera = follow_cameras(surface.vertices[None], settings)["front"][0]
    whole = Renderer(surface, dataclasses.replace(settings, aspect="1:1"))
    if not whole.variant.startswith("llvm"):
        pytest.skip("without LLVM whole frames are path traced")
    square = whole.render(surface.vertices, camera)[settings.window].astype(int)
    picture = Renderer(surface, settings).render(surface.vertices, camera).astype(int)
    assert np.sqrt(((picture - square) ** 2).mean()) < 1.5
    assert np.abs(picture - square).max() < 40  # the denoiser sees other neighbors at the border

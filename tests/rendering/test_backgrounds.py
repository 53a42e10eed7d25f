"""Every background, small, and of sizes that no tile divides."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.rendering import Renderer, follow_cameras
from a2v.types import RenderSettings
from tests.support.blocks import block

PICTURE = np.tile(np.linspace(40, 200, 50).astype(np.uint8)[:, None, None], (1, 40, 3))


@pytest.mark.parametrize("size", [18, 50, 70])
@pytest.mark.parametrize("background", ["stage", "#204060", "image", "transparent"])
def test_the_person_is_the_same_and_what_is_behind_is_as_asked(background: str, size: int) -> None:
    surface = block()
    settings = RenderSettings(size=size, spp=8, threads=1, background=background)
    camera = follow_cameras(surface.vertices[None], settings)["front"][0]
    renderer = Renderer(surface, settings, backdrop=PICTURE if background == "image" else None)
    picture = renderer.render(surface.vertices, camera)
    assert picture.shape == (size, size, 4 if background == "transparent" else 3)
    mask = renderer.mask(surface.vertices, camera)
    stage = Renderer(surface, dataclasses.replace(settings, background="stage")).render(
        surface.vertices, camera
    )
    inside = mask == 1
    assert inside.sum() > 10
    assert np.abs(picture[inside, :3].astype(int) - stage[inside]).max() <= 2
    sky = picture[0, [0, -1]]  # nobody and no shadow there
    if background == "transparent":
        assert (sky[:, 3] == 0).all()
    elif background == "image":
        np.testing.assert_allclose(sky, PICTURE[5, 0, 0], atol=8)  # the middle square of it
    elif background == "#204060":
        np.testing.assert_array_equal(sky, [[0x20, 0x40, 0x60]] * 2)

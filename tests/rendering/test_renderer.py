from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.rendering import Framing, LookSettings, Renderer, ViewCamera, denoise, follow_cameras
from a2v.rendering.person_mesh import render_mesh
from a2v.types import RenderSettings, Surface
from tests.support.blocks import RED, block

SETTINGS = RenderSettings(size=96, spp=8, threads=1)


def textured_quad() -> Surface:
    """A square 1 m wide that faces +z: red above, blue below, green at the upper left."""
    vertices = np.array([[-0.5, 0.4, 0], [0.5, 0.4, 0], [0.5, 1.4, 0], [-0.5, 1.4, 0]], np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    texture = np.zeros((64, 64, 3), np.uint8)
    texture[:32], texture[32:], texture[:16, :16] = (200, 20, 20), (20, 20, 200), (20, 200, 20)
    return Surface(
        vertices=vertices,
        faces=faces,
        colors=np.full((4, 3), 0.5, np.float32),
        uv=corners[faces],
        texture=texture,
    )


@pytest.fixture(scope="module")
def surface() -> Surface:
    return block()


@pytest.fixture(scope="module")
def renderer(surface: Surface) -> Renderer:
    return Renderer(surface, SETTINGS)


def mean_of(image: np.ndarray, u: slice, v: slice) -> np.ndarray:
    return image[v, u].reshape(-1, 3).astype(float).mean(axis=0)


def test_left_view_shows_the_left_side(surface: Surface, renderer: Renderer) -> None:
    cameras = follow_cameras(surface.vertices[None], SETTINGS)
    images = {view: renderer.render(surface.vertices, path[0]) for view, path in cameras.items()}
    middle = slice(44, 52)
    left, right = (
        mean_of(images["left"], middle, slice(40, 60)),
        mean_of(images["right"], middle, slice(40, 60)),
    )
    assert left[0] > 2 * left[2]
    assert right[2] > 2 * right[0]
    # seen from the front, the person's left (+x) is on the right of the picture; from the back on
    # the left
    near, far = slice(51, 56), slice(40, 45)
    assert (
        mean_of(images["front"], near, slice(40, 60))[0]
        > 2 * mean_of(images["front"], far, slice(40, 60))[0]
    )
    assert (
        mean_of(images["back"], far, slice(40, 60))[0]
        > 2 * mean_of(images["back"], near, slice(40, 60))[0]
    )


def test_points_land_on_their_pixels(surface: Surface, renderer: Renderer) -> None:
    camera = ViewCamera(origin=(1.2, 1.5, 3.5), target=(0.1, 0.8, 0), fov=35)
    mask = renderer.mask(surface.vertices, camera)
    pixels = camera.project(surface.vertices, SETTINGS.size)
    rows, columns = np.nonzero(mask > 0.5)
    np.testing.assert_allclose(pixels.min(axis=0), [columns.min(), rows.min()], atol=1.0)
    np.testing.assert_allclose(pixels.max(axis=0), [columns.max() + 1, rows.max() + 1], atol=1.0)
    from scipy.spatial import (
        ConvexHull,
    )  # the box is convex: its mask is the hull of its projected corners

    assert mask.sum() == pytest.approx(ConvexHull(pixels).volume, rel=0.01)


def test_texture_orientation_and_colors() -> None:
    quad = textured_quad()
    camera = ViewCamera(origin=(0, 0.9, 3), target=(0, 0.9, 0), fov=28)
    layers = Renderer(quad, SETTINGS).layers(quad.vertices, camera)
    (u0, v1), (u1, v0) = camera.project(quad.vertices[[0, 2]], 96)

    def albedo(across: float, up: float) -> np.ndarray:
        encoded = linear_to_srgb(
            layers.albedo[int(v1 + (v0 - v1) * up), int(u0 + (u1 - u0) * across)]
        )
        return np.asarray(np.rint(255 * encoded))

    np.testing.assert_allclose(albedo(0.75, 0.75), [200, 20, 20], atol=2)
    np.testing.assert_allclose(albedo(0.75, 0.25), [20, 20, 200], atol=2)
    np.testing.assert_allclose(albedo(0.1, 0.9), [20, 200, 20], atol=2)


def test_vertex_colors_are_srgb(surface: Surface, renderer: Renderer) -> None:
    camera = follow_cameras(surface.vertices[None], SETTINGS)["left"][0]
    albedo = renderer.layers(surface.vertices, camera).albedo[50, 48]
    np.testing.assert_allclose(albedo, srgb_to_linear(np.array(RED)), atol=0.01)


def test_moving_vertices_moves_pixels(surface: Surface, renderer: Renderer) -> None:
    camera = follow_cameras(surface.vertices[None], SETTINGS)["front"][0]
    before = renderer.mask(surface.vertices, camera)
    after = renderer.mask(surface.vertices + np.float32([0.2, 0, 0]), camera)
    at = [(mask * (np.arange(96) + 0.5)).sum() / mask.sum() for mask in (before, after)]
    # perspective spreads the shift of a thick box a little
    shift = camera.project(np.array([0.2, 0.9, 0.15]), 96)[0] - 48
    assert at[1] - at[0] == pytest.approx(shift, rel=0.05)
    first, second = (
        renderer.render(surface.vertices, camera),
        renderer.render(surface.vertices + np.float32([0.2, 0, 0]), camera),
    )
    assert np.abs(first.astype(int) - second).max() > 50


def test_pictures_do_not_depend_on_what_was_rendered_before(
    surface: Surface, renderer: Renderer
) -> None:
    cameras = follow_cameras(surface.vertices[None], SETTINGS)
    for view, offset in (("left", 0.3), ("back", -0.2), ("front", 0.1)):
        renderer.render(surface.vertices + np.float32(offset), cameras[view][0])  # type: ignore[index]
    moved = surface.vertices + np.float32([0.05, 0, 0.1])
    camera = cameras["right"][0]
    fresh = Renderer(surface, SETTINGS)
    np.testing.assert_allclose(
        renderer.linear(moved, camera), fresh.linear(moved, camera), atol=1e-4
    )


def test_what_does_not_move_does_not_flicker(surface: Surface, renderer: Renderer) -> None:
    camera = ViewCamera(origin=(0, 0.9, 5), target=(0, 0.9, 0), fov=28)
    layers = [
        renderer.layers(surface.vertices + np.float32([0.01 * i, 0, 0]), camera) for i in range(6)
    ]
    traced = np.stack([255 * linear_to_srgb(layer.color) for layer in layers])
    shown = np.stack([255 * linear_to_srgb(denoise(layer)) for layer in layers])
    # what neither the box nor its shadows and reflections reach: the same seed traces it the same
    # way in every frame ...
    from scipy.ndimage import binary_dilation

    still = ~binary_dilation(
        (np.abs(np.diff(traced, axis=0)).max(axis=-1) > 0.5).any(axis=0), iterations=4
    )
    assert still.mean() > 0.3
    # ... and the denoiser, which sees a large neighborhood, leaves it alone (in levels of 255)
    assert shown[:, still].std(axis=0).mean() < 0.3
    assert np.quantile(shown[:, still].std(axis=0), 0.99) < 1.5


def test_open_ground_dissolves_into_the_backdrop(surface: Surface) -> None:
    scene = LookSettings(spot=(0, 0, 0), grid=0)
    far = surface.vertices + np.float32([0, 0, -500])  # out of the picture's way
    camera = ViewCamera(origin=(0, 0.9, 5), target=(0, 0.9, 0), fov=28)
    image = (
        Renderer(surface, dataclasses.replace(SETTINGS, spp=64), scene)
        .render(far, camera)
        .astype(float)
    )
    above, below = (
        mean_of(image, slice(0, 30), slice(0, 30)),
        mean_of(image, slice(0, 30), slice(60, 96)),
    )
    np.testing.assert_allclose(below, above, atol=3)
    np.testing.assert_allclose(above, 255 * np.array(scene.background), atol=1)


def test_denoising_brings_pictures_nearer_to_the_truth(
    surface: Surface, renderer: Renderer
) -> None:
    camera = follow_cameras(surface.vertices[None], SETTINGS)["front"][0]
    truth = linear_to_srgb(renderer.layers(surface.vertices, camera, spp=1024, seed=7).color)
    noisy = renderer.layers(surface.vertices, camera, spp=4)
    before = np.mean((linear_to_srgb(noisy.color) - truth) ** 2)
    after = np.mean((linear_to_srgb(denoise(noisy)) - truth) ** 2)
    assert 10 * np.log10(before / after) > 5  # dB


def test_the_lights_cast_shadows_from_above(surface: Surface, renderer: Renderer) -> None:
    camera = ViewCamera(origin=(0, 6, 0.01), target=(0, 0, 0), fov=60)
    with_box = renderer.linear(surface.vertices, camera).mean(axis=-1)
    without = renderer.linear(surface.vertices + np.float32([0, 0, 300]), camera).mean(axis=-1)
    covered = renderer.mask(surface.vertices, camera) > 0
    drop = np.where(covered, 0, 1 - with_box / without)
    assert drop.max() > 0.25
    direction = np.array(LookSettings().sun_direction)
    # the sun's shadow falls away from it: in this picture x grows to the right and z downwards
    tip = camera.project(np.array([0, 0.9, 0]) - 0.9 * direction / direction[1], 96)
    sunlit = camera.project(
        np.array([0, 0.9, 0])
        - 0.9 * np.array([direction[0], direction[1], -direction[2]]) / direction[1],
        96,
    )
    assert drop[int(tip[1]), int(tip[0])] > drop[int(sunlit[1]), int(sunlit[0])] + 0.1


def test_scalar_variant_agrees(surface: Surface, renderer: Renderer) -> None:
    if renderer.variant == "scalar_rgb":
        pytest.skip("LLVM does not work here: there is only one variant to compare")
    camera = follow_cameras(surface.vertices[None], SETTINGS)["front"][0]
    scalar = Renderer(surface, dataclasses.replace(SETTINGS, variant="scalar_rgb"))
    difference = scalar.render(surface.vertices, camera).astype(float) - renderer.render(
        surface.vertices, camera
    )
    assert np.abs(difference).mean() < 2
    assert scalar.variant == "scalar_rgb"


def test_nothing_is_compiled_again_between_frames(surface: Surface) -> None:
    renderer = Renderer(surface, SETTINGS)
    if not renderer.variant.startswith("llvm"):
        pytest.skip("only the LLVM variant compiles kernels")
    import drjit

    cameras = follow_cameras(
        surface.vertices[None]
        + np.zeros((8, 1, 3), np.float32)
        + np.linspace(0, 1, 8)[:, None, None],
        SETTINGS,
    )
    for frame, view in ((0, "front"), (1, "left")):
        renderer.layers(surface.vertices + 0.1 * frame, cameras[view][frame])  # type: ignore[index]
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        drjit.kernel_history_clear()
        for frame in range(2, 8):
            renderer.layers(surface.vertices + np.float32(0.1 * frame), cameras["back"][frame])
        compiled = [
            entry
            for entry in drjit.kernel_history([drjit.KernelType.JIT])
            if not entry["cache_hit"]
        ]
    assert compiled == []


def test_seams_of_the_texture_do_not_show_in_the_normals() -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices, faces = np.asarray(ball.vertices, np.float32), np.asarray(ball.faces, np.int32)
    generator = np.random.default_rng(0)
    uv = generator.uniform(size=(len(faces), 3, 2)).astype(
        np.float32
    )  # every face is an island: all edges are seams
    cut = Surface(
        vertices=vertices,
        faces=faces,
        colors=np.ones_like(vertices),
        uv=uv,
        texture=np.zeros((4, 4, 3), np.uint8),
    )
    mesh = render_mesh(cut)
    assert len(mesh.source) == 3 * len(faces)
    np.testing.assert_allclose(mesh.normals(vertices), vertices[mesh.source], atol=0.02)


def test_wrong_vertices_are_named(surface: Surface, renderer: Renderer) -> None:
    camera = follow_cameras(surface.vertices[None], SETTINGS)["front"][0]
    with pytest.raises(InputError, match="shape"):
        renderer.render(surface.vertices[:-1], camera)
    broken = surface.vertices.copy()
    broken[3, 1] = np.nan
    with pytest.raises(InputError, match="NaN"):
        renderer.render(broken, camera)
    with pytest.raises(InputError, match="no faces"):
        Renderer(dataclasses.replace(surface, faces=surface.faces[:0]), SETTINGS)


def test_odd_scenes_are_named() -> None:
    with pytest.raises(InputError, match="above the ground"):
        LookSettings(sun_direction=(1, -1, 0))
    with pytest.raises(InputError, match="background"):
        LookSettings(background=(2, 0, 0))


# ---- backgrounds


def with_background(name: str) -> RenderSettings:
    return dataclasses.replace(SETTINGS, background=name)


@pytest.fixture(scope="module")
def camera(surface: Surface) -> ViewCamera:
    """A camera for which the bounds below hold.

    If the person takes 68 % of the picture, one pixel of the rim has a contact shadow of .28 at the
    feet.
    """
    framing = Framing(share=0.72)
    return follow_cameras(surface.vertices[None], SETTINGS, framing=framing)["front"][0]


@pytest.fixture(scope="module")
def cut(surface: Surface, camera: ViewCamera) -> tuple[np.ndarray, np.ndarray]:
    """The transparent frame and the person's mask."""
    renderer = Renderer(surface, with_background("transparent"))
    return renderer.render(surface.vertices, camera), renderer.mask(surface.vertices, camera)


def test_a_transparent_frame_holds_the_person_and_its_shadow_alone(
    surface: Surface, renderer: Renderer, camera: ViewCamera, cut: tuple[np.ndarray, np.ndarray]
) -> None:
    rgba, mask = cut
    assert rgba.shape == (96, 96, 4)
    inside, outside = mask == 1, mask == 0
    assert (rgba[inside, 3] == 255).all()
    whole = renderer.render(surface.vertices, camera)
    assert np.abs(rgba[inside, :3].astype(int) - whole[inside]).max() <= 1
    sky = outside.copy()
    sky[50:] = False
    assert (rgba[sky, 3] == 0).all()
    shadow = outside & (rgba[..., 3] > 40)
    assert shadow.mean() > 0.005
    assert rgba[shadow, :3].max() < 20  # black, thinner or denser
    rim = (mask > 0.05) & (mask < 0.95)
    np.testing.assert_allclose(rgba[rim, 3] / 255, mask[rim], atol=0.25)


def test_the_rim_keeps_nothing_of_the_stage(cut: tuple[np.ndarray, np.ndarray]) -> None:
    """Laid over black, a rim pixel is as dark as its share of red and blue: the stage's gray is
    gone (its green channel tells)."""
    rgba, mask = cut
    above = slice(0, 60)  # the ground's shadow is below
    rim = (mask[above] > 0.05) & (mask[above] < 0.95)
    assert rim.sum() > 20
    laid = rgba[above][rim] / 255
    green = laid[:, 1] * laid[:, 3]
    inner = (rgba[above][mask[above] == 1, 1] / 255).max()
    assert green.max() <= inner + 0.02


def test_a_color_and_a_picture_stand_behind_the_person(
    surface: Surface, camera: ViewCamera, cut: tuple[np.ndarray, np.ndarray]
) -> None:
    rgba, mask = cut
    flat = Renderer(surface, with_background("#204060")).render(surface.vertices, camera)
    clear = (mask == 0) & (rgba[..., 3] == 0)
    assert (flat[clear] == (0x20, 0x40, 0x60)).all()
    picture = np.zeros((60, 120, 3), np.uint8)
    picture[:, 30:60], picture[:, 60:90] = (
        (200, 0, 0),
        (0, 200, 0),
    )  # the middle square is what is shown
    shown = Renderer(surface, with_background("image"), backdrop=picture).render(
        surface.vertices, camera
    )
    for half, color in ((slice(0, 44), (200, 0, 0)), (slice(52, 96), (0, 200, 0))):
        assert np.abs(shown[:, half][clear[:, half]].astype(int) - color).max() <= 2
    inside = mask == 1
    assert (
        np.abs(shown[inside].astype(int) - flat[inside]).max() <= 1
    )  # the light on the person is the stage's
    shadow = (mask == 0) & (rgba[..., 3] > 40)
    assert (flat[shadow].sum(axis=1) < 0x20 + 0x40 + 0x60).all()


def test_what_the_ground_hides_is_hidden_in_a_cutout_too(
    surface: Surface, camera: ViewCamera
) -> None:
    sunk = surface.vertices - np.float32([0, 0.5, 0])
    renderer = Renderer(surface, with_background("transparent"))
    cutout, mask = renderer.cutout(sunk, camera), renderer.mask(sunk, camera)
    assert mask.sum() > cutout.alpha.sum() + 100  # the mask is the whole person's
    rows = np.flatnonzero(cutout.alpha.max(axis=1) > 0.5)
    foot = camera.project(np.array([0, 0, 0.15]), 96)[1]
    assert rows.max() == pytest.approx(foot, abs=1.5)


def test_backgrounds_that_cannot_be_used_are_named(surface: Surface) -> None:
    with pytest.raises(InputError, match="no picture"):
        Renderer(surface, with_background("image"))
    with pytest.raises(InputError, match="background is 'red'"):
        with_background("red")

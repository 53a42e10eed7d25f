"""Skin and eyes: their vertices, and the light on them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.face import FACE_KINDS, Face
from a2v.rendering import LookSettings, Renderer, ViewCamera, activate
from a2v.rendering.matter import EYE, WRAP, Hit, matter_of
from a2v.types import FloatArray, RenderSettings, Surface
from tests.support.blocks import block

CAMERA = ViewCamera(origin=(0.0, 1.0, 4.5), target=(0.0, 0.9, 0.0), fov=28)
SIDE = LookSettings(
    sun=(0.0, 0.0, 0.0),
    spot=(1.0, 1.0, 1.0),
    spot_position=(4.0, 2.0, 0.6),
    background=(0.1, 0.1, 0.1),
    grid=0,
    bounces=1,
)
SETTINGS = RenderSettings(size=64, spp=32, threads=1)


def faced() -> Surface:
    """The block, whose red side's upper part is a face and in it an eye."""
    plain = block()
    patch = np.flatnonzero((plain.vertices[:, 0] > 0.05) & (plain.vertices[:, 1] > 1.2)).astype(
        np.int32
    )
    kinds = np.zeros(len(patch), np.uint8)
    kinds[:3] = FACE_KINDS.index("eye")
    none = np.zeros(0, np.int32)
    face = Face(
        names=(),
        starts=np.zeros(1, np.int32),
        vertices=none,
        offsets=np.zeros((0, 3), np.float32),
        patch=patch,
        twins=np.zeros(len(patch), np.int32),
        kinds=kinds,
        landmarks=np.zeros((478, 3), np.float32),
    )
    return dataclasses.replace(plain, face=face)


def test_skin_is_what_looks_as_the_face_does() -> None:
    surface = faced()
    assert surface.face is not None
    found = matter_of(surface)
    assert found is not None
    eyes = surface.face.patch[:3]
    assert (found[eyes] == EYE).all()
    others = np.setdiff1d(np.arange(len(found)), eyes)
    red = surface.vertices[others, 0] > 0.2
    blue = surface.vertices[others, 0] < -0.2
    assert found[others][red].min() > 0.8  # below the face too
    assert found[others][blue].max() < 0.05
    assert matter_of(block()) is None


def test_without_a_face_head_and_hands_say_what_skin_looks_like() -> None:
    plain = block()
    colors = np.where(plain.vertices[:, :1] > 0, [0.82, 0.6, 0.47], [0.2, 0.3, 0.7]).astype(
        np.float32
    )
    hair = (plain.vertices[:, 0] > 0) & (plain.vertices[:, 1] > 1.6)
    colors[hair] = [0.12, 0.08, 0.06]
    surface = dataclasses.replace(plain, colors=colors)
    bare = plain.vertices[:, 1] > 0.8  # the upper end, of skin, hair and cloth
    found = matter_of(surface, bare)
    assert found is not None
    inner = np.abs(plain.vertices[:, 0]) > 0.1
    low, skin = plain.vertices[:, 1] < 1.4, plain.vertices[:, 0] > 0
    assert found[inner & skin & low].min() > 0.6
    assert found[inner & ~skin].max() < 0.05
    assert (
        np.median(found[inner & hair & (plain.vertices[:, 1] > 1.75)]) < 0.2
    )  # the mesh is coarse, and evened
    blue = dataclasses.replace(
        surface, colors=np.tile(np.float32([0.2, 0.3, 0.7]), (len(colors), 1))
    )
    assert matter_of(blue, bare) is None  # gloves and a mask


def test_the_soft_falloff_keeps_the_lights_sum() -> None:
    mi = (
        activate("llvm_ad_rgb")
        if Renderer(block(), SETTINGS).variant.startswith("llvm")
        else pytest.skip("needs LLVM")
    )
    cosine = mi.Float(np.linspace(-1, 1, 20001).astype(np.float32))
    up = mi.Vector3f(0, 1, 0)
    for skin, reach in ((1.0, WRAP[0]), (0.0, 0.0)):
        hit = Hit(
            mi=mi,
            skin=mi.Float(skin),
            glossy=mi.Float(skin),
            alpha=mi.Float(0.2),
            normal=up,
            viewer=up,
        )
        back = np.array(hit.falloff(cosine))
        np.testing.assert_allclose(2 * np.pi * back.mean(axis=1) * 2, np.pi, rtol=2e-3)
        np.testing.assert_allclose(back[:, -1], 1, rtol=1e-5)
        assert (back[:, np.array(cosine) < -reach - 1e-3] < 1e-3).all()


def test_light_goes_softly_round_skin_and_leaves_the_rest() -> None:
    surface = faced()
    pictures: list[FloatArray] = []
    for gloss in (False, True):
        renderer = Renderer(
            surface,
            dataclasses.replace(SETTINGS, denoise=False),
            dataclasses.replace(SIDE, gloss=gloss),
        )
        if not renderer.variant.startswith("llvm"):
            pytest.skip("without LLVM all is matt")
        every = np.arange(64 * 64)
        renderer.linear(surface.vertices, CAMERA)
        assert renderer._tracer is not None
        pictures.append(renderer._tracer.trace(every, 32, CAMERA, 64, 0).color.reshape(64, 64, 3))
    matt, soft = pictures
    column = [
        round(float(CAMERA.project(np.array([[x, 0.9, 0.15]]), 64)[0, 0])) for x in (-0.2, 0.14)
    ]
    rows = slice(26, 38)
    np.testing.assert_allclose(
        soft[rows, column[0] - 3 : column[0] + 2],
        matt[rows, column[0] - 3 : column[0] + 2],
        rtol=0.02,
    )
    on_skin = [
        picture[rows, column[1] - 1 : column[1] + 2].mean(axis=(0, 1)) for picture in (matt, soft)
    ]
    gain = on_skin[1] / on_skin[0]
    assert gain[0] > 1.2  # the light only grazes it: more of it comes round
    np.testing.assert_allclose(matter_gain(surface), 1, atol=1e-6)


def matter_gain(surface: Surface) -> FloatArray:
    """Return the ratio of the light with and without gloss on a surface without a face."""
    bare = dataclasses.replace(surface, face=None)
    made = [
        Renderer(bare, SETTINGS, dataclasses.replace(SIDE, gloss=gloss)).linear(
            bare.vertices, CAMERA
        )
        for gloss in (False, True)
    ]
    return np.asarray(made[1] / np.maximum(made[0], 1e-6))

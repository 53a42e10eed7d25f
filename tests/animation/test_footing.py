"""A climbing person stays up and stands on something."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from a2v.animation import RetargetSettings, retarget
from a2v.animation.footing import find_props
from a2v.animation.retarget import has_steps
from a2v.animation.rig import SIDES, rig_of, sole_points
from a2v.formats.gltf import write_glb
from a2v.formats.registry import write_character
from a2v.geometry.mesh import vertex_normals
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.props import Props, box, rod
from a2v.rendering.things import with_props
from a2v.types import Body, Character, Motion, Surface


def climbing(action: str) -> Motion:
    return make_motion(
        MotionModel.load("cmu-fine"), [Step(action=action)], Take(frames=150, fps=30, seed=0)
    )


@pytest.mark.parametrize(("action", "least"), [("Climb a ladder", 0.7), ("Climb stairs", 0.2)])
def test_climbs_stay_up_on_a_body_and_feet_stand_on_solids(
    body: Body, action: str, least: float
) -> None:
    motion = climbing(action)
    assert has_steps(motion)
    moves, rig = retarget(motion, body).astype(np.float64), rig_of(body)
    pelvis = moves[:, rig.bones["pelvis"], 1, 3]
    rise = np.quantile(pelvis, 0.95) - np.quantile(pelvis, 0.05)
    source = np.quantile(motion.root[:, 1], 0.95) - np.quantile(motion.root[:, 1], 0.05)
    assert rise > least
    assert abs(rise - source) < 0.2 * source
    props = find_props(moves, body, motion.fps)
    tops = [
        props.vertices[np.unique(props.faces[props.owner == number])][:, 1].max()
        for number in range(len(props.names))
    ]
    last = [sole_points(moves[-1:], rig, side)[..., 1].min() for side in SIDES]
    assert min(last) > 0.1  # both feet are up at the end, each on something
    assert all(min(abs(np.array(tops) - height)) < 0.06 for height in last)
    flat = retarget(motion, body, settings=RetargetSettings(steps="never"))[
        :, rig.bones["pelvis"], 1, 3
    ]
    assert np.ptp(flat) < 0.5 * np.ptp(pelvis)


def test_what_does_not_rise_has_no_steps(body: Body) -> None:
    motion = climbing("Walk")
    assert not has_steps(motion)
    assert find_props(retarget(motion, body), body, motion.fps).names == ()


def test_solids_are_closed_and_face_outwards() -> None:
    props = Props.of(
        [
            ("step", box(np.zeros(3), np.array([0.6, 0.2, 0.3]))),
            ("rung", rod(np.zeros(3), np.array([0.5, 0.1, 0]), 0.02)),
            ("step", box(-np.ones(3), np.zeros(3))),
        ]
    )
    assert props.names == ("step_1", "rung_1", "step_2")
    corners = props.vertices[props.faces].astype(np.float64)
    volume = np.bincount(props.owner, np.linalg.det(corners) / 6)
    assert volume == pytest.approx(
        [0.6 * 0.2 * 0.3, np.pi * 0.02**2 * np.hypot(0.5, 0.1), 1.0], rel=0.08
    )
    edges = np.sort(props.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_props_are_rendered_behind_the_surface_and_written_as_meshes_of_their_own(
    character: Character, tmp_path: Path
) -> None:
    surface = character.surface
    props = Props.of([("step", box(np.zeros(3), np.array([0.6, 0.2, 0.3])))])
    both = with_props(surface, props)
    assert np.array_equal(both.vertices[: len(surface.vertices)], surface.vertices)
    assert len(both.faces) == len(surface.faces) + len(props.faces)
    assert with_props(surface, Props.of([])) is surface
    normals = vertex_normals(both.vertices.astype(np.float64), both.faces)[len(surface.vertices) :]
    assert np.abs(normals).max(axis=1).min() > 0.95  # bevelled: sides are flat
    write_glb(tmp_path / "a.glb", character, props=props)
    data = (tmp_path / "a.glb").read_bytes()
    content = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    named = {node["name"]: node for node in content["nodes"]}
    assert "mesh" in named["step_1"]
    assert "skin" not in named["step_1"]


def test_the_solids_of_several_clips_stand_in_one_scene_by_the_names_of_their_clips() -> None:
    step = Props.of([("step", box(np.zeros(3), np.array([0.6, 0.2, 0.3])))])
    bar = Props.of([("bar", rod(np.array([-0.5, 2, 1]), np.array([0.5, 2, 1]), 0.02))])
    both = Props.of_clips({"Climb": step, "Walk": Props.of([]), "Hang": bar})
    assert both.names == ("Climb_step_1", "Hang_bar_1")
    surfaces = dict(both.surfaces())
    np.testing.assert_array_equal(surfaces["Hang_bar_1"].vertices, bar.surfaces()[0][1].vertices)
    assert Props.of_clips({"Climb": step}).names == ("step_1",)
    assert Props.of_clips({"Walk": Props.of([])}).names == ()


def test_usd_holds_props_beside_the_skinned_mesh(character: Character, tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    props = Props.of([("step", box(np.zeros(3), np.array([0.6, 0.2, 0.3])))])
    write_character(tmp_path / "a.usdc", character, {}, props=props)
    stage = usd.Stage.Open(str(tmp_path / "a.usdc"))
    mesh = stage.GetPrimAtPath("/character/props/step_1")
    assert mesh.GetTypeName() == "Mesh"
    assert not mesh.HasRelationship("skel:skeleton")
    assert len(mesh.GetAttribute("points").Get()) == 24


def test_textured_surfaces_keep_their_texture() -> None:
    texture = np.arange(16 * 16 * 3, dtype=np.uint8).reshape(16, 16, 3)
    quad = Surface(
        vertices=np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]),
        faces=np.int32([[0, 1, 2]]),
        colors=np.zeros((3, 3), np.float32),
        uv=np.float32([[[0, 0], [1, 0], [0, 1]]]),
        texture=texture,
    )
    both = with_props(quad, Props.of([("step", box(np.zeros(3), np.ones(3)))]))
    assert both.texture is not None
    assert both.uv is not None
    assert np.array_equal(both.texture[:16], texture)
    rows = (1 - both.uv[0, :, 1]) * len(both.texture)
    assert rows == pytest.approx((1 - quad.uv[0, :, 1]) * 16, abs=1e-4)
    assert ((1 - both.uv[1:, :, 1]) * len(both.texture) > 16).all()

"""Prepare clips for game engines: the travel on a separate root, or no travel at all."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from a2v.animation.change_rig import change_rig
from a2v.animation.engine import coarser
from a2v.animation.rig_spec import OWN_RIG, load_rig
from a2v.animation.visemes import add_visemes
from a2v.kinematics.ground import GroundTrajectory, trajectory_of
from a2v.types import Body, Character, FloatArray

ROOT_NAME = "Root"
"""Name of the root that is added to a rig without a root."""


def ground_trajectory_of(bone_transforms: FloatArray, body: Body) -> GroundTrajectory:
    """Position of the topmost bone over the ground and heading by hips and shoulders, for bones (T,
    B, 4, 4) of `body`.

    Raises
    ------
    InputError
        Hips and shoulders are not found among the body's bones.
    """
    places = np.asarray(bone_transforms, dtype=np.float64)[..., :3, 3]
    return trajectory_of(
        places, body.bone_names, body.bone_parents.tolist(), whose=f"body model '{body.model}'"
    )


def put_rig_in_place(bone_transforms: FloatArray, body: Body, fps: float) -> FloatArray:
    """Remove travel and turning from bones (T, B, 4, 4) of `body`; sway stays.

    Raises
    ------
    InputError
        See `ground_trajectory_of`.
    """
    path = ground_trajectory_of(bone_transforms, body).smooth(fps).transforms()
    moved: FloatArray = (np.linalg.inv(path)[:, None] @ bone_transforms).astype(np.float32)
    return moved


def add_root(character: Character, name: str = ROOT_NAME) -> Character:
    """Add a first bone to a character: on the ground at the origin, the parent of all others."""
    body = character.body
    above = np.eye(4, dtype=np.float32)[None]
    body = dataclasses.replace(
        body,
        bone_names=(name, *body.bone_names),
        bone_parents=np.concatenate(
            [[-1], np.where(body.bone_parents < 0, 0, body.bone_parents + 1)]
        ),
        bone_transforms=np.concatenate([above, body.bone_transforms]),
        rest_transforms=np.concatenate([above, body.rest_transforms]),
        bone_tails=np.concatenate([np.array([[0, 0, 0.2]], np.float32), body.bone_tails]),
        weights=np.concatenate(
            [np.zeros((len(body.weights), 1), np.float32), body.weights], axis=1
        ),
    )
    return dataclasses.replace(character, body=body, bones=character.bones + np.int32(1))


def prepare_rig(
    character: Character,
    clips: Mapping[str, tuple[FloatArray, float]],
    *,
    rig: str = OWN_RIG,
    root_motion: bool = False,
    visemes: str = "",
) -> tuple[Character, dict[str, tuple[FloatArray, float]]]:
    """Convert a character and its clips for another tool, ready for `a2v.formats`.

    Parameters
    ----------
    character : Character
    clips : by name: bone transforms (T, B, 4, 4), world from bone, meters, and frames per second
    rig : str
        One of `a2v.animation.rig_spec.RIGS`.
    root_motion : bool
        The root takes the travel and the heading, without the sway of steps; the hips take the
        rest. A rig without a root gets one.
    visemes : str
        Naming in `a2v.animation.visemes.NAMINGS` of additional shapes of the face; empty takes the
        rig's.

    Raises
    ------
    InputError
        Unknown rig or visemes, or a body that lacks bones of the rig.
    """
    paths = (
        {
            name: ground_trajectory_of(moves, character.body).smooth(fps).transforms()
            for name, (moves, fps) in clips.items()
        }
        if root_motion
        else {}
    )
    made = {
        name: (np.asarray(moves, dtype=np.float64), fps) for name, (moves, fps) in clips.items()
    }
    rooted = False
    if rig != OWN_RIG:
        spec = load_rig(rig)
        if spec.triangles:
            character = coarser(character, spec.triangles, spec.texture)
        change = change_rig(character, spec)
        character, made, rooted = change.character, change.clips(made), bool(spec.root)
        visemes = visemes or spec.visemes
    if visemes:
        character = add_visemes(character, visemes)
    if root_motion:
        if not rooted:
            character = add_root(character)
        made = {
            name: (np.concatenate([paths[name][:, None], moves[:, int(rooted) :]], axis=1), fps)
            for name, (moves, fps) in made.items()
        }
    return character, made

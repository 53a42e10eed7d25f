"""Nodes from a surface, a body and a motion to a moving character."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from a2v.animation import (
    BindSettings,
    BlinkSettings,
    DeformSettings,
    FootingSettings,
    RetargetSettings,
)
from a2v.motion.edit import Edit
from a2v.props import Props
from a2v.types import Body, Character, FloatArray, Motion, Surface
from pipelines.engine.memo import memo
from pipelines.engine.refs import Ref
from pipelines.engine.store import current, get, put
from pipelines.nodes.values import Pose, Poses, Vertices, load_character


@memo()
def character(colored_surface: Ref[Surface], body: Ref[Body], bind: BindSettings) -> Ref[Character]:
    """Bind the surface to the body's bones (Eq. 19); one that stands at rest is bound already."""
    from a2v import animation

    surface, fitted = get(colored_surface, Surface), get(body, Body)
    return put(
        animation.standing_character(surface, fitted)
        if surface.standing is not None
        else animation.bind(surface, fitted, settings=bind)
    )


@memo()
def poses(
    motion: Ref[Motion],
    body: Ref[Body],
    retarget: RetargetSettings,
    edit: Edit,
    blink: BlinkSettings,
) -> Ref[Poses]:
    """Retarget the motion to the body's bones.

    Feet neither slide nor sink, and the eyes blink unless a video showed the face. The given motion
    travels, also for a result in place: the travel is removed after the feet are cleaned.
    """
    from a2v import animation
    from a2v.motion.on_rig import retarget_edited

    clip = get(motion, Motion)
    moves = retarget_edited(clip, get(body, Body), edit, settings=retarget)
    shown = (
        clip.expressions
        if clip.expressions and all(len(own) == len(moves) for own in clip.expressions.values())
        else None
    )
    return put(
        Poses(
            bone_transforms=moves,
            fps=clip.fps,
            action=clip.action,
            expressions=shown or animation.blinking(len(moves), clip.fps, blink),
        )
    )


@memo()
def props(
    motion: Ref[Motion],
    poses: Ref[Poses],
    body: Ref[Body],
    retarget: RetargetSettings,
    edit: Edit,
    footing: FootingSettings,
) -> Ref[Props]:
    """Return steps, ladders and bars for a climbing person, seats for one who sits, and things in
    hands.

    A motion in place, or a cycle, has nothing to climb on.
    """
    from a2v.animation.footing import find_props
    from a2v.animation.held import find_held
    from a2v.animation.retarget import has_steps
    from a2v.animation.seats import find_seats

    moves = get(poses, Poses)
    climbs = (
        footing.shown
        and not edit.in_place
        and not edit.loop
        and has_steps(get(motion, Motion), retarget)
    )
    if climbs:
        return put(find_props(moves.bone_transforms, get(body, Body), moves.fps))
    if not footing.shown or retarget.raw:
        return put(Props.of([]))
    person, clip = get(body, Body), get(motion, Motion)
    seats = find_seats(moves.bone_transforms, person, moves.fps)
    held = find_held(moves.bone_transforms, person, clip)
    return put(Props.of(seats).with_moving(held))


@memo()
def things(props: Ref[Props], poses: Ref[Poses]) -> list[Ref[Props]]:
    """Return the props of every frame."""
    solids = get(props, Props)
    return [put(solids.frame(frame)) for frame in range(len(get(poses, Poses).bone_transforms))]


@memo()
def pose(poses: Ref[Poses]) -> list[Ref[Pose]]:
    """Return the frames of the motion, one by one."""
    moves = get(poses, Poses)
    return [
        put(
            Pose(
                bone_transforms=transforms,
                expressions={
                    name: np.asarray(all_of[frame])
                    for name, all_of in moves.expressions.items()
                    if all_of[frame]
                },
            )
        )
        for frame, transforms in enumerate(moves.bone_transforms)
    ]


@memo()
def vertices(character: Ref[Character], pose: Ref[Pose], deform: DeformSettings) -> Ref[Vertices]:
    """Deform the character to one pose (Eq. 20), with its facial expressions."""
    from a2v import animation

    address, now = current().address, get(pose, Pose)
    vertices = _deformer(address, character, deform)(now.bone_transforms)
    if now.expressions:
        strengths = {name: float(strength) for name, strength in now.expressions.items()}
        vertices = animation.express(
            load_character(address, character), vertices, now.bone_transforms, strengths
        )
    return put(Vertices(vertices=vertices))


@functools.lru_cache(maxsize=1)
def _deformer(
    address: str, ref: Ref[Character], settings: DeformSettings
) -> Callable[[FloatArray], FloatArray]:
    """Return the factored character, which is kept for later frames in the same process."""
    from a2v import animation

    character = load_character(address, ref)
    if settings.method == "skinning":
        return functools.partial(animation.deform, character)
    return animation.ArapDeformer(character, settings)

"""From a surface, a body and a motion to a character that moves."""

from __future__ import annotations

import functools
from collections.abc import Callable

from a2v.animation import BindSettings, DeformSettings, RetargetSettings
from a2v.motion.edit import Edit
from a2v.types import Body, Character, FloatArray, Motion, Surface
from pipelines.memo import memo
from pipelines.nodes.values import Pose, Poses, Vertices, load_character
from pipelines.store import Ref, current, get, put


@memo()
def character(colored: Ref[Surface], body: Ref[Body], bind: BindSettings) -> Ref[Character]:
    """Bind the surface to the body's bones (Eq. 19)."""
    from a2v import animation

    return put(animation.bind(get(colored, Surface), get(body, Body), settings=bind))


@memo()
def poses(motion: Ref[Motion], body: Ref[Body], retarget: RetargetSettings, edit: Edit) -> Ref[Poses]:
    """Carry the motion over to the body's bones; the feet neither slide nor sink. What goes on the spot travels until here."""
    from a2v.motion.on_rig import retarget_edited

    clip = get(motion, Motion)
    return put(Poses(bone_transforms=retarget_edited(clip, get(body, Body), edit, settings=retarget), fps=clip.fps, action=clip.action))


@memo()
def pose(poses: Ref[Poses]) -> list[Ref[Pose]]:
    """The frames of the motion, one by one."""
    return [put(Pose(bone_transforms=transforms)) for transforms in get(poses, Poses).bone_transforms]


@memo()
def posed(character: Ref[Character], pose: Ref[Pose], deform: DeformSettings) -> Ref[Vertices]:
    """Deform the character to one pose (Eq. 20)."""
    deformed = _deformer(current().address, character, deform)
    return put(Vertices(vertices=deformed(get(pose, Pose).bone_transforms)))


@functools.lru_cache(maxsize=1)
def _deformer(address: str, ref: Ref[Character], settings: DeformSettings) -> Callable[[FloatArray], FloatArray]:
    """The factored character, kept for the frames that follow in the same process."""
    from a2v import animation

    character = load_character(address, ref)
    if settings.method == "skinning":
        return functools.partial(animation.deform, character)
    return animation.ArapDeformer(character, settings)

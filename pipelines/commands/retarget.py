"""``a2v retarget``: add actions to a user's character file."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from a2v.animation import RetargetSettings
from a2v.errors import InputError
from a2v.formats.fbx import fbx_to_glb, glb_to_fbx
from a2v.formats.gltf.people import has_skin, read_person, write_map_of
from a2v.formats.gltf.person_clips import write_person
from a2v.formats.registry import read_motion, readable_motions, split_clip
from a2v.io import say
from a2v.motion.edit import Edit, edited
from a2v.motion.on_rig import retarget_edited
from a2v.motion.timeline import Take
from a2v.types import FloatArray, Motion
from pipelines.answer import Answer
from pipelines.bone_maps import map_answer, written_map
from pipelines.inputs import check_writable
from pipelines.mesh_rig import rig_mesh
from pipelines.options import flag, group, option, settings
from pipelines.requests.motion import (
    ACTION,
    MAP,
    EditOptions,
    LengthOptions,
    PlanOptions,
    plan_length,
    read_plan,
)

HELP = "Add actions to your own character: write its file with further animations."
EXAMPLES = """examples:
  a2v retarget --character theirs.glb --actions Walk,Jump --out moving.glb
  a2v retarget --character theirs.vrm --action "sneak for 3 s, then wave" --out moving.vrm
  a2v retarget --character theirs.glb --motions dance.bvh --in-place --out moving.glb
  a2v retarget --character theirs.fbx --actions Walk,Run --out clips.fbx

The character must stand in its file. Its bones are found by names of Mixamo, Sketchfab, VRM, Unreal, Unity, Rigify, Character Creator, Daz and other
tools, by a .vrm's own list, or by their shape; --bone-map bones.txt writes what was found, to be corrected. A mesh without bones, in T or A pose,
gets those of our body. Meshes, pictures, expressions and animations are not changed; fingers and face keep the pose of the file.
An .fbx keeps PNG and JPEG pictures of color, normals and emission, embedded or in its folder; other properties of its materials are lost."""

SUFFIXES = (".glb", ".gltf", ".vrm", ".fbx")
"""Suffixes of files that can be read; a .gltf is written as .glb, with its parts inside."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    character: str = option("your character: a skinned .glb, .gltf, .vrm or .fbx", metavar="FILE")
    out: str = option("file to write, with the suffix of --character (.glb for a .gltf)")
    bone_map: str | None = option(f"{MAP} --character", default=None, metavar="FILE")
    motion_bone_map: str | None = option(
        f"{MAP} --motions", default=None, metavar="FILE", rare=True
    )
    action: str = option(ACTION, default="")
    actions: str = option("actions, separated by commas; each becomes an animation", default="")
    motions: str = option(
        f"motion files, separated by commas ({readable_motions(', ')}; FILE#CLIP for one of several); each becomes an animation",
        default="",
    )
    lengths: LengthOptions = group(LengthOptions, "the motions")
    edits: EditOptions = group(EditOptions, "the motions")
    raw: bool = flag("skip the contact clean-up: feet may slide as in the motion", rare=True)
    retarget: RetargetSettings = settings(
        RetargetSettings, users=("raw", "align", "level", "smoothing", "clear_arms", "life")
    )


def run(options: Options) -> Answer:
    """Read the character, make the motions, write the file."""
    source, target = Path(options.character), Path(options.out)
    for path in (source, target):
        if path.suffix.lower() not in SUFFIXES:
            raise InputError(
                f"cannot use {path}; expected a name that ends in {', '.join(SUFFIXES)}"
            )
    suffix = {".gltf": ".glb"}.get(source.suffix.lower(), source.suffix.lower())
    if target.suffix.lower() != suffix:
        raise InputError(f"cannot write {target}; expected a name that ends in {suffix}")
    wanted = _wanted(options)
    first = next((file for file in wanted.values() if file is not None), None)
    if (answer := written_map(options.motion_bone_map, first)) is not None:
        return answer
    check_writable(target.parent)
    with tempfile.TemporaryDirectory() as folder:
        return _retarget(options, source, target, wanted, Path(folder))


def _retarget(
    options: Options, source: Path, target: Path, wanted: dict[str, str | None], folder: Path
) -> Answer:
    """Read the character, make the motions, write the file.

    An FBX file is converted to GLB in `folder` and back.
    """
    is_fbx = source.suffix.lower() == ".fbx"
    notes = []
    if is_fbx and (lost := fbx_to_glb(source, folder / "in.glb")):
        notes.append(
            f"{target.name} is written without {', '.join(lost[:4])}: expected PNG or JPEG inside "
            f"{source.name} or beside it"
        )
    read = folder / "in.glb" if is_fbx else source
    if not has_skin(read):
        rig_mesh(read, folder / "rigged.glb", name=source)
        read = folder / "rigged.glb"
        notes.append(f"{source.name} has no bones: our body's were fitted to its mesh")
    if options.bone_map is not None and not Path(options.bone_map).exists():
        write_map_of(read, options.bone_map, name=source)
        return map_answer(options.bone_map)
    person = read_person(read, name=source, bone_map=options.bone_map)
    notes += person.notes
    if person.odd:
        odd = ", ".join(
            person.body.bone_names[bone] or "a nameless bone" for bone in person.odd[:4]
        )
        stay = "stays" if len(person.odd) == 1 else "stay"
        notes.append(
            f"{odd} of {source.name} {stay} in the pose of the file: mirrored or scaled unevenly"
        )
    edit, carried = (
        options.edits.edit,
        replace(options.retarget, raw=options.raw or options.retarget.raw),
    )
    clips: dict[str, tuple[FloatArray, float]] = {}
    for name, file in wanted.items():
        motion = (
            _made(options, name, edit)
            if file is None
            else edited(
                read_motion(file, fps=options.lengths.fps, bone_map=options.motion_bone_map),
                replace(edit, in_place=False),
            )
        )
        notes += [f"{name}: {note}" for note in motion.provenance.get("notes", ())]
        clips[name] = retarget_edited(motion, person.body, edit, settings=carried), motion.fps
    write_person(folder / "out.glb" if is_fbx else target, person, clips)
    if is_fbx:
        glb_to_fbx(folder / "out.glb", target, fps=max(fps for _, fps in clips.values()))
    return Answer(
        files=[target], facts={"clips": list(clips), "bones": len(person.nodes)}, notes=notes
    )


def _made(options: Options, action: str, edit: Edit) -> Motion:
    """Generate a motion with a model, and apply all edits except --in-place."""
    shared: dict[str, Any] = {
        item.name: getattr(options.lengths, item.name) for item in fields(options.lengths)
    }
    plan = read_plan(PlanOptions(action=action, **shared), directed=False)
    for line in plan.lines():
        say(line)
    length = plan_length(
        plan,
        frames=options.lengths.frames,
        seconds=options.lengths.seconds,
        fps=options.lengths.fps,
    )
    take = Take(frames=length, fps=options.lengths.fps, seed=options.lengths.seed)
    made = plan.make(take, edit=Edit(speed=edit.speed))
    return edited(made[0] if made.batch else made, replace(edit, speed=1.0, in_place=False))


def _wanted(options: Options) -> dict[str, str | None]:
    """Return the animations to make by name: None for an action, else a motion file."""
    asked: list[tuple[str, str | None]] = [
        (part.strip(), None)
        for part in (options.action, *options.actions.split(","))
        if part.strip()
    ]
    for part in filter(None, map(str.strip, options.motions.split(","))):
        file, clip = split_clip(part)
        number = f"{file.stem} {clip}" if clip.isdecimal() else clip
        asked.append((number or file.stem, part))
    names = [name for name, _ in asked]
    if twice := {name for name in names if names.count(name) > 1}:
        raise InputError(
            f"'{min(twice)}' is given twice; every animation of a file needs a different name"
        )
    if not asked:
        raise InputError(
            "no motion given; name one with --action, several with --actions (a2v actions lists "
            "them), or files with --motions"
        )
    return dict(asked)

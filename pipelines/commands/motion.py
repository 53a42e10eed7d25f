"""``a2v motion``: an action to motion files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.types import Motion

if TYPE_CHECKING:
    from a2v.formats.registry import MotionFormat
    from a2v.motion import MotionModel

HELP = "Generate motions of an action (or of several actions in turn) and write them as .npz, .bvh or pictures of stick figures."
EXAMPLES = """examples:
  a2v motion --action Walk --out walk.npz
  a2v motion --action Walk,Jump --frames 120 --out walk-jump.bvh        a transition
  a2v motion --model humanact12 --action throw --count 20 --seed 7 --out throw.npz   one file, a leading 20
  a2v motion --action Walk --count 6 --out walks.mp4                    side by side; also .gif, and .png for rows of poses
  a2v motion --action Walk --start mine.bvh --start_frames 10 --count 3 --out futures.mp4   go on from given poses
  a2v motion --model humanact12 --action lift_dumbbell --interpolate 5 --seed 1 --to_seed 4 --out between.png
  a2v motion --model humanact12-fine --action 'lift_dumbbell*' --out kinds.png         one clip of each action that matches
  a2v motion --action Walk --bone_scale legs=1.3,arms=0.8 --out giant.bvh
  a2v motion --action Walk --bones mine.bvh --out my-walk.bvh           with the bone lengths of the person in a file
  a2v motion --model humanact12 --action jump --count 100 --native --out jump.npz     as the papers' classifiers expect it

With several clips an .npz holds all of them with a leading dimension, .bvh become numbered files, pictures and videos show
them beside each other."""


def file_formats() -> tuple[MotionFormat, ...]:
    """What --out may be: motions as data, and drawn."""
    from a2v.formats.registry import MOTION_FORMATS
    from a2v.rendering.stickfigure import DRAWN_FORMATS

    return (*MOTION_FORMATS, *DRAWN_FORMATS)


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.formats.registry import suffixes_of
    from pipelines.inputs import add_model_argument

    parser.add_argument(
        "--action", required=True, help="what to do; several with commas follow each other, a pattern with * makes one clip each"
    )
    add_model_argument(parser)
    parser.add_argument("--out", required=True, help=f"the file to write: {', '.join(suffixes_of(file_formats()))}")
    parser.add_argument("--count", type=int, default=1, help="clips")
    parser.add_argument("--frames", type=int, default=60, help="frames a clip")
    parser.add_argument("--seed", type=int, default=0, help="seed of the noise")
    parser.add_argument(
        "--bone_scale",
        "--bone-scale",
        type=float | str,
        default=1.0,
        help="factor on all bone lengths, or PART=FACTOR,... (arms, legs, torso, head, a joint)",
    )
    parser.add_argument("--bones", type=str | None, default=None, help="motion file (.bvh, .npz) whose bone lengths are taken")
    parser.add_argument("--start", type=str | None, default=None, help="motion file (.bvh, .npz) whose poses begin every clip")
    parser.add_argument(
        "--start_frames", "--start-frames", type=int | None, default=None, help="how many of its first poses; all by default"
    )
    parser.add_argument("--interpolate", type=int, default=0, help="rows between the motions of --seed and --to_seed")
    parser.add_argument("--to_seed", "--to-seed", type=int | None, default=None, help="seed of the last row; --seed + 1 by default")
    parser.add_argument(
        "--native", action="store_true", help=".npz of joints in the data set's own frame and unit, first root at the origin"
    )


def run(settings: Any) -> int:
    """Generate; print the paths."""
    from a2v.formats.registry import write_motion, writer_of
    from a2v.motion import MotionModel
    from pipelines.inputs import check_writable

    path = Path(settings.out)
    writer_of(path, file_formats())
    if settings.native and path.suffix.lower() != ".npz":
        raise InputError(f"cannot write {path}; --native joints go into an .npz")
    model = MotionModel.load(settings.model)
    if settings.native:
        content = native(model, settings)
        check_writable(path.parent)
        from a2v.io import write_npz

        write_npz(path, content)
        print(path)
        return 0
    made = generate(model, settings)
    check_writable(path.parent)
    for target in write_motion(path, made, file_formats()):
        print(target)
    return 0


def generate(model: MotionModel, settings: Any) -> Motion:
    """The clip or clips that the options ask for.

    Raises
    ------
    InputError
        Options that exclude each other, an unknown action, an unusable file, or a number out of range.
    """
    from a2v.motion.applications import interpolate, matching_actions, outpaint, sample_each

    alone = [name for name in ("start", "interpolate") if getattr(settings, name)]
    alone += ["a pattern"] if "*" in settings.action or "?" in settings.action else []
    if len(alone) > 1:
        raise InputError(f"give either {' or '.join(alone)}, not both")
    changed = [name for name, default in (("bone_scale", 1.0), ("bones", None)) if getattr(settings, name) != default]
    if alone and changed:
        raise InputError(f"{changed[0]} cannot be given with {alone[0]}; it is for plain clips and transitions")
    names = [name.strip() for name in settings.action.split(",")]
    if settings.start:
        return outpaint(
            model,
            first_frames(settings.start, settings.start_frames),
            names,
            frames=settings.frames,
            count=settings.count,
            seed=settings.seed,
        )
    if settings.interpolate:
        if len(names) > 1:
            raise InputError("interpolate goes between two motions of one action; give one --action")
        last = settings.seed + 1 if settings.to_seed is None else settings.to_seed
        return interpolate(model, names[0], seeds=(settings.seed, last), rows=settings.interpolate, frames=settings.frames)
    if alone:
        found = [action for name in names for action in matching_actions(model, name)]
        return sample_each(model, found, frames=settings.frames, seed=settings.seed)
    return model.sample(
        names, frames=settings.frames, count=settings.count, seed=settings.seed, bone_scale=bone_scale(settings.bone_scale),
        lengths=own_bones(model, settings),
    )  # fmt: skip


def bone_scale(text: float | str) -> float | dict[str, float]:
    """The option --bone_scale: a number, or names with numbers.

    Raises
    ------
    InputError
        It is neither.
    """
    try:
        if not isinstance(text, str) or "=" not in text:
            return float(text)
        return {name.strip(): float(value) for name, value in (part.split("=") for part in text.split(","))}
    except ValueError:
        raise InputError(f"bone_scale is '{text}'; expected a number, or names with numbers such as legs=1.3,arms=0.8") from None


def own_bones(model: MotionModel, settings: Any) -> np.ndarray | None:
    """Bone lengths (J,) in native units of the person in --bones, times --bone_scale; None without that option."""
    if settings.bones is None:
        return None
    from a2v.kinematics import bone_lengths
    from a2v.motion.applications import on_skeleton

    unit = model.card.metres_per_unit
    person = first_frames(settings.bones, None)
    lengths = bone_lengths(on_skeleton(person, model.skeleton, model.bone_lengths * unit), model.skeleton)
    scale: np.ndarray = (
        np.median(lengths, axis=0) / unit * (model.scaled_bones(bone_scale(settings.bone_scale)) / np.maximum(model.bone_lengths, 1e-9))
    )
    return scale.astype(np.float32)


def first_frames(path: str, frames: int | None) -> Motion:
    """The first `frames` poses of a motion file's (first) clip; all of them for None.

    Raises
    ------
    InputError
        The file is unreadable, or has not so many frames.
    """
    from a2v.formats import read_motion

    motion = read_motion(path)
    if motion.batch:
        motion = motion[(0,) * len(motion.batch)]
    if frames is None:
        return motion
    if not 1 <= frames <= motion.frames:
        raise InputError(f"start_frames is {frames}; {path} has {motion.frames} frames")
    return motion.first(frames)


def native(model: MotionModel, settings: Any) -> dict[str, Any]:
    """What --native writes: ``joints`` (..., T, J, 3) in native frame and unit, ``labels`` (..., T) and what they mean."""
    names = [model.actions[model.label(name.strip())] for name in settings.action.split(",")] if "*" not in settings.action else []
    plain = len(names) == 1 and not settings.start and not settings.interpolate
    if plain:
        own = own_bones(model, settings)
        lengths = model.scaled_bones(bone_scale(settings.bone_scale)) if own is None else own
        joints = model.sample_native(names[0], frames=settings.frames, count=settings.count, seed=settings.seed, lengths=lengths)
        joints = joints if settings.count > 1 else joints[0]
        labels = np.broadcast_to(model.frame_labels(names, settings.frames), joints.shape[:-2])
        action = names[0]
    else:
        made = generate(model, settings)
        joints, action = model.to_native(made.joints), made.action
        clips = [model.frame_labels(part.split(","), made.frames) for part in action.split("|")]
        labels = np.broadcast_to(np.stack(clips) if len(clips) > 1 else clips[0], joints.shape[:-2])
    skeleton = model.skeleton
    return {
        "joints": joints, "labels": np.ascontiguousarray(labels, dtype=np.int64), "actions": np.asarray(model.actions), "action": action,
        "dataset": model.card.dataset, "fps": model.fps, "seed": settings.seed, "parents": skeleton.parents,
        "joint_names": np.asarray(skeleton.joint_names), "metres_per_unit": model.card.metres_per_unit,
        "native_signs": np.asarray(model.card.native_signs), "model_digest": model.digest,
    }  # fmt: skip

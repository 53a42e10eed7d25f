"""The person on the stage: make it from a photo, let it act, and draw a still of a film.

These functions run in child processes (`pipelines.serve.worker`).
"""

from __future__ import annotations

import base64
import dataclasses
import functools
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.folders import make_folder
from a2v.io import atomic_path
from a2v.props import Props
from pipelines.clock import STILL, Clock
from pipelines.engine.graph import Parameters
from pipelines.engine.progress import Update
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions
from pipelines.nodes.values import Blob, Image, Poses
from pipelines.serve.records import PERSON
from pipelines.serve.stages import shapes
from pipelines.serve.talk import EXPORTS, Tell
from pipelines.serve.watched import Watched, spent
from pipelines.serve.wishes import IDLE, Wish

if TYPE_CHECKING:
    from a2v.types import Body, Character, FloatArray, Motion
    from pipelines.requests.motion import ResolvedMotion
    from pipelines.requests.video import VideoRequest

BODY = "body.npz"
"""File name of the person's body, to which motions are carried over."""
IDLE_SECONDS = 6.0
"""Length of the cycle in which a person waits."""
STILL_SIZE = 360
"""Height in pixels of the still of a film."""
FIRST_SECONDS = 1.2
"""Length of the beginning of a motion that is sent before the whole motion."""
AHEAD_SECONDS = 0.3
"""What is carried over beyond that beginning, since the last frames lack what comes after them."""
QUATS = 32767
"""Steps from 0 to 1 of a sent quaternion's parts."""
MOTIONS = (".bvh", ".npz")
"""Suffixes of exported files that hold a motion without a character."""

Write = Callable[["VideoRequest", str, Path, str, RunOptions], "list[Path]"]
"""``a2v character``: writes files and returns their paths.

It takes the request, the clip's name, the file, the rig, and how to run.
"""


def wake(task: Mapping[str, Any], tell: Tell) -> dict[str, object]:
    """Make the character of a photo, with a shape of every stage on the way.

    Returns
    -------
    dict
        "notes", and "times" of nodes for the next estimates.
    """
    from a2v.types import Body, Character

    folder = Path(task["folder"])
    clock = Clock(nodes=STILL, measured=task["times"])
    shown, last = list[str](), dict[str, object]()

    def hear(update: Update) -> None:
        last.update(clock.take(update))
        last["stage"] = str(last["stage"]).capitalize()
        tell({"progress": last | {"shown": shown}})

    def show(stage: str) -> None:
        shown.append(stage)
        tell({"progress": last | {"shown": shown}})

    running = Watched(cache=task["cache"], quiet=True, listener=hear, early=shapes(folder, show))
    outcome = running.run(["engine_character", "body"], person_parameters(task))
    body, character = outcome.get("body", Body), outcome.get("engine_character", Character)
    if not folder.is_dir():
        raise InputError("the photo was removed")
    body.save(folder / BODY)
    write_figure(folder / PERSON, character, body)
    return {"notes": list(outcome.notes), "times": clock.measured(spent(outcome))}


def person_parameters(task: Mapping[str, Any]) -> Parameters:
    """Return the graph's parameters of the person of a task."""
    request = Wish(action=IDLE).request(task["photo"], task["corrections"], task["more"])
    return request.person.resolve(Store(task["cache"]))


def write_figure(path: Path, character: Character, body: Body, quality: int = 90) -> None:
    """Write a character that waits, as the stage shows it."""
    from a2v.formats.gltf import write_glb

    request = Wish(action=IDLE, seconds=IDLE_SECONDS).request("photo")
    cycle = dataclasses.replace(request.motion, loop=True)
    moves, faces, fps = performed(cycle.resolve(), body)
    write_glb(
        path, character, {IDLE: (moves, fps)}, expressions={IDLE: faces}, jpeg_quality=quality
    )


def performed(
    resolved: ResolvedMotion, body: Body, *, first: bool = False
) -> tuple[FloatArray, Mapping[str, FloatArray], float]:
    """Return a generated motion on a body: what the nodes `motion` and `poses` return.

    Nothing is stored, so that it takes a fraction of a second. With `first` it is only the
    beginning, `FIRST_SECONDS` long, whose last frames differ a little from those of the whole.

    Returns
    -------
    bones (T, B, 4, 4), strengths (T,) of the face's expressions, frames per second
    """
    from a2v.animation import blinking
    from a2v.animation.source import LEANING
    from a2v.motion.on_rig import retarget_edited
    from a2v.motion.plan import make_steps
    from a2v.motion.timeline import Take

    asked = resolved.parameters
    steps, edit, fps = asked["steps"], asked["edit"], asked["fps"]
    model = None if any(step.source for step in steps) else _model(asked["model"].path)
    motion: Motion = make_steps(
        model,
        steps,
        Take(frames=asked["frames"], fps=fps, seed=asked["seed"]),
        edit=edit,
        direction=asked["direction"],
    )
    blinks = blinking(motion.frames, fps, asked["blink"])
    # a clip that leans is turned upright as a whole, so that its beginning needs all of it
    if first and not edit.loop and motion.skeleton not in LEANING:
        motion = motion.first(round((FIRST_SECONDS + AHEAD_SECONDS) * fps))
    moves = retarget_edited(motion, body, edit, settings=asked["retarget"])
    if first:
        moves = moves[: max(2, round(FIRST_SECONDS * fps))]
    return moves, {name: own[: len(moves)] for name, own in blinks.items()}, fps


@functools.lru_cache(maxsize=4)
def _model(path: str) -> Any:
    from a2v.motion import MotionModel

    return MotionModel.load(path)


@functools.lru_cache(maxsize=8)
def _body(path: str, written: float) -> Body:
    """Return the body of a person; the sample's without a path."""
    from a2v.samples import load_ready_person
    from a2v.types import Body

    return Body.load(path) if path else load_ready_person().body


def body_of(folder: str) -> Body:
    """Return the body of the person in a photo's folder; the sample's for "".

    Raises
    ------
    InputError
        The person is not made yet.
    """
    if not folder:
        return _body("", 0.0)
    path = Path(folder) / BODY
    try:
        return _body(str(path), path.stat().st_mtime)
    except OSError:
        raise InputError("this person is not made yet; wait a moment") from None


def play(task: Mapping[str, Any]) -> dict[str, object]:
    """Return what a person does.

    Returns
    -------
    dict
        "fps"; "frames"; "bones": quaternions x, y, z, w of all bones in their parents, whole
        numbers of 16 bits in base64; "place" of the first bone, meters; "face": strengths by
        expression. With "first" in the task, only the beginning of a generated motion.
    """
    from a2v.formats.characters import parent_from_bone
    from a2v.kinematics import rotmat_to_quat

    body, wish = body_of(task["folder"]), Wish.of(task["wish"])
    request = wish.request("photo", clip=task["clip"])
    if wish.recorded:
        poses = copied(request, body, task["cache"])
        moves, faces, fps = poses.bone_transforms, poses.expressions, poses.fps
    else:
        moves, faces, fps = performed(request.motion.resolve(), body, first=bool(task.get("first")))
    local = parent_from_bone(np.asarray(moves, np.float64), body.bone_parents)
    quats = rotmat_to_quat(local[..., :3, :3])[..., [1, 2, 3, 0]]
    whole = np.round(np.clip(quats, -1, 1) * QUATS).astype("<i2")
    return {
        "fps": fps,
        "frames": len(moves),
        "bones": base64.b64encode(whole.tobytes()).decode(),
        "place": local[:, 0, :3, 3].round(4).ravel().tolist(),
        "face": {name: np.round(own, 3).tolist() for name, own in faces.items() if np.any(own)},
    }


def copied(request: VideoRequest, body: Body, cache: str | None) -> Poses:
    """Return the motion of a video or file on a body; the store keeps it."""
    from pipelines.requests.video import Resolved

    running = Watched(cache=cache, quiet=True)
    resolved = Resolved(parameters=request.motion.resolve().parameters, recorded=True)
    outcome = running.run(
        "poses",
        resolved.parameters,
        graph=resolved.graph,
        overrides={"body": running.store.put(body)},
    )
    return outcome.get("poses", Poses)


def still(task: Mapping[str, Any]) -> dict[str, object]:
    """Draw the middle frame of a film as it will look.

    Returns
    -------
    dict
        "picture": a JPEG in base64.
    """
    import PIL.Image

    wish, request = Wish.of(task["wish"]), asked_of(task)
    running = Watched(cache=task["cache"], quiet=True)
    resolved = request.resolve(running.store)
    outcome = running.run(["poses", "props"], resolved.parameters, graph=resolved.graph)
    poses = outcome.get("poses", Poses)
    middle = len(poses.bone_transforms) // 2
    held = running.store.put(outcome.get("props", Props).frame(middle))
    one = Poses(
        bone_transforms=poses.bone_transforms[middle : middle + 1],
        fps=poses.fps,
        action=poses.action,
        expressions={name: own[middle : middle + 1] for name, own in poses.expressions.items()},
    )
    size = 2 * round(min(wish.size, STILL_SIZE) / 2)
    small = Wish.of({**wish.said(), "size": size, "views": wish.views[:1]})
    drawn = asked_of({**task, "wish": small.said()}).resolve(running.store)
    frames = running.run(
        "frame",
        drawn.parameters,
        graph=drawn.graph,
        overrides={"poses": running.store.put(one), "props": held},
    )
    image = running.store.get(np.asarray(frames.values["frame"], object).ravel()[0], Image)
    data = io.BytesIO()
    with PIL.Image.open(io.BytesIO(image.png.tobytes())) as opened:
        opened.convert("RGB").save(data, "jpeg", quality=88)
    return {"picture": base64.b64encode(data.getvalue()).decode()}


def asked_of(task: Mapping[str, Any]) -> VideoRequest:
    """Return the request of a task with the person's files."""
    wish = Wish.of(task["wish"])
    return wish.request(task["photo"], task["corrections"], task["more"], task["clip"])


def export(task: Mapping[str, Any], write: Write) -> dict[str, object]:
    """Write a person with a motion, or the motion alone, for another tool.

    Returns
    -------
    dict
        "files" with their sizes in bytes.
    """
    from a2v.types import Motion

    folder, request, suffix = Path(task["folder"]), asked_of(task), str(task["format"])
    running = Watched(cache=task["cache"], quiet=True)
    make_folder(folder / EXPORTS)
    if suffix not in MOTIONS:
        target = folder / EXPORTS / f"{task['rig']}{suffix}"
        paths = list(write(request, str(task["name"]), target, str(task["rig"]), running))
    else:
        target = folder / EXPORTS / f"motion{suffix}"
        resolved = request.resolve(running.store)
        name = "bvh" if suffix == ".bvh" else "motion"
        outcome = running.run(name, resolved.parameters, graph=resolved.graph)
        with atomic_path(target) as temporary:
            if suffix == ".bvh":
                temporary.write_bytes(bytes(outcome.get("bvh", Blob)))
            else:
                outcome.get("motion", Motion).save(temporary)
        paths = [target]
    if not folder.is_dir():
        raise InputError("the photo was removed")
    return {"files": {str(path.relative_to(folder)): path.stat().st_size for path in paths}}

"""The live mode's process: track the person in camera frames and drive the character.

Its tasks are "open", "frame", "record" and "keep". See `pipelines.serve.talk` for the protocol.
"""

from __future__ import annotations

import base64
import io
import socket
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.folders import make_folder
from a2v.io import atomic_path
from pipelines.serve.talk import Tell, answer

if TYPE_CHECKING:
    from a2v.animation.live import LiveRig
    from a2v.footage.live import LiveTracker
    from a2v.footage.live_fit import LiveFit
    from a2v.types import ByteArray, Character, FloatArray

RECORDINGS = "live"
"""Folder of recorded motions in the folder of a photo."""
MOST_SIDE = 1280
"""Longer side in pixels of the largest frames that are decoded."""
LEAST_SIDE = 64
"""Shorter side in pixels of the smallest frames that are decoded."""
LONGEST = 300.0
"""Length in seconds at which a recording ends."""
LEAST_RECORDED = 5
"""Number of poses of the shortest recording that is kept."""
_LOCAL = "127.0.0.1"

Find = Callable[[Mapping[str, Any]], "Character"]
"""Returns the character of a person from the entries of a task."""


@dataclass(eq=False)
class Session:
    """A character that is driven by a camera.

    Attributes
    ----------
    folder : Path
        Of the photo.
    character : Character
    tracker : LiveTracker
    rig : LiveRig
        Of the character.
    vmc : tuple of port and LiveRig, or None
        Where poses are sent as well, and the rig with VRM's bones.
    size : pair of int
        Width and height of the frames, pixels; (0, 0) before the first frame.
    fit : LiveFit or None
        Of frames of `size`.
    recorded : list of (time, joints (J, 3)), or None
        Poses since the start of the recording.
    last : float
        Time of the newest frame, seconds.
    used : float
        Processor time of the last fit, seconds.
    outlet : socket
        For VMC.
    """

    folder: Path
    character: Character
    tracker: LiveTracker
    rig: LiveRig
    vmc: tuple[int, LiveRig] | None
    size: tuple[int, int] = (0, 0)
    fit: LiveFit | None = None
    recorded: list[tuple[float, FloatArray]] | None = None
    last: float = -1.0
    used: float = 0.0
    outlet: socket.socket = field(
        default_factory=lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    )


def main(find: Find) -> None:
    """Run tasks from standard input until it ends."""
    sessions: list[Session] = []
    answer(lambda task, tell: serve(task, tell, sessions, find))


def serve(
    task: Mapping[str, Any], tell: Tell, sessions: list[Session], find: Find
) -> dict[str, object] | None:
    """Run a task and return its answer."""
    if task["task"] == "open":
        sessions[:] = [opened(task, find)]
        return {}
    if not sessions:
        raise InputError("the live mode is not open; start it again")
    session = sessions[0]
    if task["task"] == "frame":
        return shown(session, decoded(base64.b64decode(task["jpeg"])), float(task["time"]))
    if task["task"] == "record":
        session.recorded = []
        return {}
    return kept(session)


def opened(task: Mapping[str, Any], find: Find) -> Session:
    """Load the networks and the character."""
    from a2v.animation.live import LiveRig
    from a2v.footage.figure import person_skeleton
    from a2v.footage.live import LiveTracker

    character = find(task)
    folder = Path(task["folder"])
    rig = LiveRig(character.body, person_skeleton())
    tracker = LiveTracker().__enter__()  # closed with the process
    vmc = None if not task["vmc"] else (int(task["vmc"]), _vrm_rig(character))
    return Session(folder, character, tracker, rig, vmc)


def _vrm_rig(character: Character) -> LiveRig:
    from a2v.animation.change_rig import change_rig
    from a2v.animation.live import LiveRig
    from a2v.animation.rig_spec import load_rig
    from a2v.footage.figure import person_skeleton

    return LiveRig(change_rig(character, load_rig("vrm")).character.body, person_skeleton())


def decoded(jpeg: bytes) -> ByteArray:
    """Decode a camera frame (H, W, 3), sRGB.

    Raises
    ------
    InputError
        It is not a JPEG of `LEAST_SIDE` to `MOST_SIDE` pixels.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(jpeg), formats=["JPEG"]) as image:
            size = image.size
            fits = min(size) >= LEAST_SIDE and max(size) <= MOST_SIDE
            found = np.asarray(image.convert("RGB")) if fits else None
    except Image.DecompressionBombError:
        raise InputError(f"the frame is too large; expected at most {MOST_SIDE} pixels") from None
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError):
        raise InputError("the frame is not a JPEG picture") from None
    if found is None:
        raise InputError(
            f"the frame has {size[0]} x {size[1]} pixels; expected {LEAST_SIDE} to {MOST_SIDE} "
            "each way"
        )
    return found


def shown(session: Session, image: ByteArray, at: float) -> dict[str, object]:
    """Track the person in a frame and move the character.

    Returns
    -------
    dict
        "state": "late" if a newer frame arrived earlier, "nobody", "warming" or "driven". If
        driven, "bones": quaternions (x, y, z, w) of all bones in their parents, flat; "place":
        position of the first bone, meters; "recorded": number of recorded poses; "seconds" of
        processing.
    """
    from a2v.footage.live_fit import LiveFit
    from a2v.formats.characters import parent_from_bone
    from a2v.kinematics import rotmat_to_quat

    begun = time.monotonic()
    size = image.shape[1], image.shape[0]
    if not np.isfinite(at):
        raise InputError("the frame has no time; expected seconds")
    if at <= session.last:
        return {"state": "late"}
    if session.fit is None or session.size != size:
        session.fit, session.size = LiveFit(size), size
    session.last = at
    sighting = session.tracker.look(image, at, used=session.used)
    if sighting.keypoints is None:
        return {"state": "nobody", "seconds": time.monotonic() - begun}
    looked = time.process_time()
    pose = session.fit.add(sighting)
    if pose is None:
        return {"state": "warming", "seconds": time.monotonic() - begun}
    bones = session.rig.add(pose.joints)
    if session.vmc is not None:
        _send(session, pose.joints, at)
    if session.recorded is not None and (
        not session.recorded or at - session.recorded[0][0] < LONGEST
    ):
        session.recorded.append((at, pose.joints))
    session.used = min(time.process_time() - looked, 0.1)
    local = parent_from_bone(bones[None], session.character.body.bone_parents)[0]
    quats = rotmat_to_quat(local[:, :3, :3])[:, [1, 2, 3, 0]]
    return {
        "state": "driven",
        "bones": quats.round(4).ravel().tolist(),
        "place": local[0, :3, 3].round(4).tolist(),
        "recorded": 0 if session.recorded is None else len(session.recorded),
        "seconds": round(time.monotonic() - begun, 3),
    }


def _send(session: Session, joints: FloatArray, at: float) -> None:
    """Send the pose to the program that listens for VMC on this machine."""
    from a2v.formats.characters import parent_from_bone
    from a2v.formats.vmc import vmc_bundle

    assert session.vmc is not None
    port, rig = session.vmc
    local = parent_from_bone(rig.add(joints)[None], rig.body.bone_parents)[0]
    session.outlet.sendto(
        vmc_bundle(dict(zip(rig.body.bone_names, local, strict=True)), time=at), (_LOCAL, port)
    )


def kept(session: Session) -> dict[str, object]:
    """Write the recorded motion as BVH and as the moving character.

    Returns
    -------
    dict
        "files" with their sizes in bytes.
    """
    from a2v.animation import retarget, rig_motion
    from a2v.footage.follow import grounded_motion
    from a2v.formats.bvh import write_bvh
    from a2v.formats.gltf import write_glb

    recorded, session.recorded = session.recorded or [], None
    if len(recorded) < LEAST_RECORDED:
        raise InputError(
            f"the recording has {len(recorded)} poses; expected {LEAST_RECORDED} or more: stay "
            "in the picture for a second or longer"
        )
    times = np.array([at for at, _ in recorded])
    folder = session.folder / RECORDINGS
    make_folder(folder)
    number = 1 + len(list(folder.glob("live-*.bvh")))
    motion = grounded_motion(
        np.stack([joints for _, joints in recorded]), times, action=f"live {number}"
    )
    body = session.character.body
    transforms = retarget(motion, body)
    bvh, glb = folder / f"live-{number}.bvh", folder / f"live-{number}.glb"
    with atomic_path(bvh) as temporary:
        write_bvh(temporary, rig_motion(transforms, body, motion.fps))
    write_glb(glb, session.character, {motion.action: (transforms, motion.fps)})
    return {
        "files": {str(path.relative_to(session.folder)): path.stat().st_size for path in (bvh, glb)}
    }

"""Hand-keyed clips that are actions like those of the models: idle, talk, bow, sit down,
backflip...

``clips.csv`` lists them and their mode of play. ``a2v/weights/clips.npz`` contains their joints,
with fingers (made by ``scripts/make_clips.py``). `AUTHORS` names authors and licenses. The seed
varies a clip: its tempo is warped, left and right are swapped if the clip allows it, and the upper
body moves slightly more or less.
"""

from __future__ import annotations

import csv
import lzma
import zlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import read_npz
from a2v.kinematics import Skeleton, skeleton_from_parents
from a2v.kinematics.from_joints import motion_of_joints
from a2v.kinematics.transforms import bone_vectors, on_lengths
from a2v.motion.edit import mirror_motion
from a2v.motion.names import plain_name
from a2v.sessions import WEIGHTS, file_digest
from a2v.types import FloatArray, Motion

SOURCE = "clips"
"""Name of the library among the names of models."""

TABLE = Path(__file__).with_name("clips.csv")
LIBRARY = WEIGHTS / "clips.npz"
STEP = 2e-4
"""Meters per unit of the file."""

OWN = "own-"
"""Prefix of the files of our own gestures (``scripts/gestures.py``)."""
AUTHORS = {
    "30": ("Quaternius, Universal Animation Library", "CC0-1.0"),
    "24": ("Mesh2Motion", "CC0-1.0"),
    OWN: ("a2v", "CC0-1.0"),
    "kaykit": ("Kay Lousberg, KayKit Character Animations", "CC0-1.0"),
    "deepmimic": ("DeepMimic, X. B. Peng and others", "MIT"),
    "animated": ("AnimatedDrawings, Meta Platforms", "MIT"),
    "cmu": ("CMU Graphics Lab Motion Capture Database", "free"),
}
"""Author and license of clips, by the folder of the file; of files without one by their frame
rate."""

RELAXED = "Idle"
"""The clip of a relaxed standing person."""

SHOWN_SECONDS = 5.0
"""Seconds for which a cycle is played if no length is given."""
REPEATED_SECONDS = 2.5
"""A clip that can be repeated is repeated until this time, seconds."""

TEMPO = 0.2
"""Two standard deviations of the logarithm of a seed's tempo relative to the keyed one."""
WARP = 0.03
"""Largest shift of moments by the time warp, as a share of the clip's length."""
AMPLITUDE = (0.75, 1.25)
"""Range of the factor on the movement of trunk, head and arms about their mean pose."""
HANDS_FREE = 0.3
"""Least height of hands above the ground, meters, for the upper body to vary: lower hands lean on
it."""
SEAM_SECONDS = 0.15
"""Seconds over which the end of a repeated clip is blended into its beginning."""


@dataclass(frozen=True, kw_only=True)
class Clip:
    """A clip of the library.

    Attributes
    ----------
    name : str
        Name as an action.
    file : str
        The author's name of it.
    theme : str
    plays : "loop", "repeat" or "once"
        A cycle; an action that is repeated if there is time; an action that is held at its end.
    mirrors : bool
        Whether left and right may be exchanged.
    air : bool
        Whether it takes place above the ground.
    words : str
        Other names.
    fps : float
    pace : float
        Forward speed, meters per second.
    aside : float
        Speed to the left, meters per second.
    before, after : str
        Clips from which and into which it is played when it stands alone; "-" for its own first
        and last pose.
    beats : int
        How often a cycle repeats what it is named after; 0 if that cannot be counted.
    """

    name: str
    file: str
    theme: str
    plays: str
    mirrors: bool
    air: bool
    words: str
    fps: float
    pace: float
    beats: int = 0
    aside: float = 0.0
    before: str = ""
    after: str = ""

    @property
    def author(self) -> str:
        """Author of the clip."""
        return self._origin[0]

    @property
    def license(self) -> str:
        """License of the clip."""
        return self._origin[1]

    @property
    def _origin(self) -> tuple[str, str]:
        kind = self.file.partition("/")[0] if "/" in self.file else ""
        if kind or not self.file.startswith(OWN):
            return AUTHORS[kind or f"{self.fps:g}"]
        return AUTHORS[OWN]


@dataclass(frozen=True)
class ClipLibrary:
    """The clips and their common skeleton."""

    clips: tuple[Clip, ...]
    joints: tuple[FloatArray, ...]
    skeleton: Skeleton
    rest_offsets: FloatArray

    @property
    def actions(self) -> tuple[str, ...]:
        """Names of the clips."""
        return tuple(clip.name for clip in self.clips)

    def index(self, action: str) -> int:
        """Return the index of the clip of an action; case, spaces and hyphens don't matter.

        Raises
        ------
        InputError
            No clip has that name.
        """
        plain = plain_name(action)
        for index, clip in enumerate(self.clips):
            if plain_name(clip.name) == plain:
                return index
        raise InputError(f"no clip is called '{action}'; a2v actions lists them")

    def seconds(self, action: str) -> float:
        """Return the duration for which a clip is played if no length is given, seconds."""
        index = self.index(action)
        clip, own = self.clips[index], len(self.joints[index]) / self.clips[index].fps
        if clip.plays == "loop":
            return SHOWN_SECONDS
        return own * np.ceil(REPEATED_SECONDS / own) if clip.plays == "repeat" else own

    @property
    def lengths(self) -> FloatArray:
        """Bone lengths (J,), meters; the same in all clips."""
        return np.asarray(np.linalg.norm(self.rest_offsets, axis=-1))


@cache
def clip_library() -> ClipLibrary:
    """Load the shipped library."""
    held = read_npz(LIBRARY)
    with TABLE.open(newline="", encoding="utf-8") as stream:
        rows = {row["file"]: row for row in csv.DictReader(stream)}
    packed = np.frombuffer(lzma.decompress(held["steps"].tobytes()), np.int16)
    steps = packed.reshape(len(held["joint_names"]), 3, -1).transpose(2, 0, 1)
    parts = np.split(steps, np.cumsum(held["frames"])[:-1])
    joints = tuple(
        np.cumsum(part, axis=0, dtype=np.int64).astype(np.float64) * STEP for part in parts
    )
    clips = []
    for file, fps, pace, aside in zip(
        *(held[name].tolist() for name in ("files", "fps", "pace", "aside")), strict=True
    ):
        row = rows[file]
        clips.append(
            Clip(
                name=row["name"],
                file=file,
                theme=row["theme"],
                plays=row["plays"],
                mirrors=row["mirrors"] == "yes",
                air=row["air"] == "yes",
                words=row["words"],
                fps=fps,
                pace=pace,
                aside=aside,
                beats=int(row["beats"] or 0),
                before=row["before"],
                after=row["after"],
            )
        )
    offsets = held["rest_offsets"].astype(np.float64)
    skeleton = skeleton_from_parents(
        held["parents"].tolist(), held["joint_names"].tolist(), offsets, name="custom"
    )
    return ClipLibrary(tuple(clips), joints, skeleton, offsets)


def play_clip(
    action: str, *, frames: int, fps: float, speed: float = 1.0, seed: int = 0, cycles: int = 0
) -> Motion:
    """Play a clip for the given length: cycles continue, other clips are repeated or held at their
    end.

    Parameters
    ----------
    action : str
        A name of `ClipLibrary.actions`.
    frames, fps
    speed : float
        1 as keyed, 2 twice as fast.
    cycles : int
        If not 0, the frames are this number of whole cycles at any tempo, and the last frame leads
        to the first.
    seed : int
        0 plays the clip unchanged; other seeds vary tempo, side and the amplitude of the upper
        body.

    Returns
    -------
    Motion
        Meters, y up, ahead along +z, with joints of fingers and ``head_front``.

    Raises
    ------
    InputError
        The clip is unknown.
    """
    library = clip_library()
    index, skeleton = library.index(action), library.skeleton
    clip, keyed = library.clips[index], library.joints[index]
    draw = np.random.default_rng([seed, zlib.crc32(clip.file.encode())])
    tempo, phase, mirrored, amplitude = (
        draw.normal() * TEMPO / 2,
        draw.random(),
        draw.random() < 0.5,
        draw.uniform(*AMPLITUDE),
    )
    warp = WARP
    if seed == 0:
        tempo, phase, mirrored, amplitude, warp = 0.0, 0.0, False, 1.0, 0.0
    if amplitude != 1.0:
        keyed = _varied(keyed, skeleton, amplitude)
    if clip.plays == "repeat":
        keyed = _closed(keyed, clip.fps)
    length = len(keyed)
    at = np.arange(frames) / fps * speed * float(np.exp(np.clip(tempo, -TEMPO, TEMPO))) * clip.fps
    if cycles:
        at = np.arange(frames) / frames * cycles * length
    if clip.plays == "loop":
        at = at + phase * length
    moved = at - (at[0] if len(at) else 0.0)
    at = at + warp * length / (2 * np.pi) * (
        np.sin(2 * np.pi * (at / length + phase)) - np.sin(2 * np.pi * (at[0] / length + phase))
    )
    joints = _sampled(keyed, at, skeleton, library.lengths, around=clip.plays != "once")
    for axis, pace in ((0, clip.aside), (2, clip.pace)):
        joints[..., axis] += (moved / clip.fps * pace)[:, None]
    played = motion_of_joints(
        joints,
        skeleton,
        float(fps),
        action=clip.name,
        seed=seed,
        rest_offsets=library.rest_offsets,
        provenance=_facts(clip, seed),
    )
    return mirror_motion(played) if mirrored and clip.mirrors else played


def _facts(clip: Clip, seed: int) -> dict[str, Any]:
    """Where a motion of a clip comes from."""
    return {
        "clip": clip.file,
        "author": clip.author,
        "license": clip.license,
        "model_digest": file_digest(LIBRARY),
        "seed": seed,
        "told": [True],
        "air": [clip.air],
    }


def _sampled(
    keyed: FloatArray, at: FloatArray, skeleton: Skeleton, lengths: FloatArray, *, around: bool
) -> FloatArray:
    """Sample joints (T, J, 3) at the frames `at` (T,) of a clip (K, J, 3); bones keep their
    `lengths` (J,).

    With `around` the clip repeats.
    """
    count = len(keyed)
    low = np.floor(at).astype(np.int64)
    share: FloatArray = (at - low)[:, None, None]
    one, two = (
        (low % count, (low + 1) % count)
        if around
        else (np.clip(low, 0, count - 1), np.clip(low + 1, 0, count - 1))
    )
    return on_lengths(keyed[one] + share * (keyed[two] - keyed[one]), skeleton, lengths)


def _varied(keyed: FloatArray, skeleton: Skeleton, amplitude: float) -> FloatArray:
    """Scale the movement of trunk, head and arms of a clip (K, J, 3) about their mean pose by
    `amplitude`.

    Frames with hands near the ground are unchanged.
    """
    names = skeleton.joint_names
    if keyed[:, [names.index("hand_l"), names.index("hand_r")], 1].min() < HANDS_FREE:
        return keyed
    legs = [
        index
        for index, name in enumerate(names)
        if name.startswith(("pelvis", "thigh", "calf", "foot", "ball"))
    ]
    vectors = bone_vectors(keyed, skeleton)
    mean = vectors.mean(axis=0)
    changed = mean + amplitude * (vectors - mean)
    changed *= np.linalg.norm(vectors, axis=-1, keepdims=True) / np.maximum(
        np.linalg.norm(changed, axis=-1, keepdims=True), 1e-9
    )
    changed[:, legs] = vectors[:, legs]
    varied: FloatArray = np.einsum("jb,tbx->tjx", skeleton.path_matrix, changed) + keyed[:, :1]
    return varied


def _closed(keyed: FloatArray, fps: float) -> FloatArray:
    """Blend the end of a clip (K, J, 3) into its beginning over `SEAM_SECONDS`."""
    fade = min(max(2, round(SEAM_SECONDS * fps)), len(keyed))
    weight = np.linspace(0, 1, fade + 1)[1:, None, None]
    closed = keyed.copy()
    closed[-fade:] += weight * (keyed[:1] - closed[-1:])
    return closed

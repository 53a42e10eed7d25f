"""Options of the file of a motion, shared by the commands that write one."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from a2v.animation import RIGS
from a2v.formats.registry import MOTION_FORMATS, suffixes_of, write_motion, writer_of
from a2v.motion.edit import Edit, check_speed, edited
from a2v.rendering.stickfigure import DRAWN_FORMATS
from a2v.types import Motion
from pipelines.answer import Answer
from pipelines.inputs import check_writable
from pipelines.options import flag, group, option
from pipelines.requests.motion import EditOptions
from pipelines.rigs import ROOT_MOTION, RigOptions, rig_of_motions, write_rigged_motion

FORMATS = (*MOTION_FORMATS, *DRAWN_FORMATS)
"""Suffixes of --out: motion files, and drawings."""


@dataclass(frozen=True, kw_only=True)
class MotionFileOptions:
    """Options of a motion's file: its name, its bones and edits."""

    out: str = option(f"file to write: {', '.join((*suffixes_of(FORMATS), '.vrma'))}")
    rig: str | None = option(
        "write a .bvh, .fbx or .glb of an adult of average build with the bones of another tool: "
        f"{', '.join(RIGS)}; smpl with .npz is AMASS's layout",
        default=None,
        choices=RIGS,
        metavar="RIG",
    )
    root_motion: bool = flag(f"with --rig: {ROOT_MOTION}")
    edits: EditOptions = group(EditOptions)

    @property
    def path(self) -> Path:
        """The file."""
        return Path(self.out)

    @property
    def rigging(self) -> RigOptions | None:
        """The options of the rig; None for the motion's own skeleton. See `rig_of_motions`."""
        return rig_of_motions(self.path, self.rig, self.root_motion)

    def check(self) -> None:
        """Check the options before a long computation.

        Raises
        ------
        InputError
            No format has this suffix, the file cannot have the rig, or the tempo is out of range.
        """
        if self.rigging is None:
            writer_of(self.path, FORMATS)
        check_speed(self.edits.speed)

    def write(
        self, motion: Motion, edit: Edit | None = None, *, notes: Sequence[str] = ()
    ) -> Answer:
        """Edit a motion that has its final tempo, by default as the options say, and write it."""
        check_writable(self.path.parent)
        rigging = self.rigging
        edit = dataclasses.replace(self.edits.edit if edit is None else edit, speed=1.0)
        if rigging is None:
            motion = edited(motion, edit)
            written = write_motion(self.path, motion, FORMATS)
        else:
            motion = edited(motion, dataclasses.replace(edit, in_place=False))
            written = write_rigged_motion(self.path, motion, rigging, edit)
        facts = {"action": motion.action, "frames": motion.frames, "fps": float(motion.fps)}
        return Answer(files=written, notes=notes, facts=facts)

"""Tables of bones that commands write for users to correct."""

from __future__ import annotations

from pathlib import Path

from a2v.formats.registry import write_motion_map
from pipelines.answer import Answer


def written_map(table: str | None, motion: str | None) -> Answer | None:
    """Write the table of a motion file's bones if `table` names a file that does not exist.

    Returns
    -------
    Answer or None
        None if there is nothing to write.

    Raises
    ------
    InputError
        The motion cannot be read, or the table cannot be written.
    """
    if table is None or motion is None or Path(table).exists():
        return None
    write_motion_map(motion, table)
    return map_answer(table)


def map_answer(table: str) -> Answer:
    """Return the answer of a command that has written a table."""
    note = "these are the bones as they were understood; correct the table and run again"
    return Answer(files=[Path(table)], notes=[note])

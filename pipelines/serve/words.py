"""Put messages of commands into the words of the page: no option, file, node or class is named."""

from __future__ import annotations

import re
from collections.abc import Mapping

from pipelines.stages import said

REMEDIES: Mapping[str, str] = {
    "one whole person, or give --mask and --keypoints": "one whole person, from head to feet",
    "one whole person, or give --mask": "one whole person, from head to feet",
    "or give --mask and --keypoints": "or press Correct",
    "give --mask and --keypoints": "press Correct",
    "or give --mask": "or press Correct",
    "(give --mask or --corrections to choose another)": "; press another one to take that one",
    "(give --photo again)": "(Add a view)",
    "give --keypoints (OpenPose JSON) or another photo": "choose another photo",
    "; choose another --out": "; free some space and try again",
    "increase --seconds": "choose more seconds",
    "give a longer motion, such as --seconds 5": "choose more seconds",
    "change the tempo with --speed": "change the tempo",
    "give another --seed for another one": "take another take",
    "a path takes one action; give one --action": "a path takes one action; leave the others out",
    "(a2v actions lists them)": "",
    "name one with --action": "press one or describe it",
    "start a2v serve with another --folder": "start the page with another folder",
    "a defect of a2v": "something went wrong here",
}
"""What a remedy of the command line is on the page."""
FOREIGN = re.compile(
    r"(?<![\w-])--?[a-z][\w.-]+"  # options
    r"|\b[a-zA-Z]+_\w+"  # names of programs
    r"|\b(?!(?:NaN|WebP|WebM|QuickTime)\b)[A-Z][a-z]+(?:[A-Z][a-z0-9]*)+\b"  # classes
    r"|(?<![\w.])/(?:[\w.-]+/)+[\w.-]*"  # paths
    r"|\b[\w-]+\.(?:py|npz|yaml|onnx|json|toml|csv)\b"  # files of programs
    r"|\ba2v (?:video|motion|character|actions|cache|doctor|train|serve)\b"
    r"|\b(?:pip|npm|apt) install\b"
)
"""What no text of the page holds."""
NOTHING = "this cannot be done; try something else"
_CLAUSE = re.compile(r"(; |: |, or |, such as | \([^()]*\))")


def for_page(text: str) -> str:
    """Return a message in the words of the page.

    Remedies of the command line become those of the page, actions get their words, and clauses that
    still name something of a program are left out.
    """
    for given, meant in REMEDIES.items():
        text = text.replace(given, meant)
    text = said(text)
    if not FOREIGN.search(text):
        return text.replace(" ;", ";")
    kept, mark = list[str](), ""
    for part in _CLAUSE.split(text):
        if _CLAUSE.fullmatch(part) and not part.startswith(" ("):
            mark = part
        elif part and not FOREIGN.search(part):
            kept += [mark, part] if kept else [part]
            mark = ""
    return "".join(kept).replace(" ;", ";").strip(" ;:,") or NOTHING

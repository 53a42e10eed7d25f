"""``a2v actions``: list the actions that can be requested."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from a2v.motion.catalog import LICENSES, NAMES, SOURCES, Catalog, catalog
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.plan import AUTO
from a2v.motion.vocabulary import Vocabulary
from pipelines.answer import Answer
from pipelines.options import option
from pipelines.requests.motion import MODEL, open_model

HELP = "List all actions by theme, with source and license. With --model, list the names of one model, one per line."
EXAMPLES = """examples:
  a2v actions
  a2v actions --license free                     without sources that are for research only
  a2v actions --model humanact12
  a2v actions --find "sneaking thief"            how a2v understands these words, and the nearest actions"""


# : Maximum number of actions that --find lists.
SHOWN = 8


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    model: str = option(MODEL, default=AUTO)
    license: str = option(
        "any, or free: leave out sources that are for research only",
        default=LICENSES[0],
        choices=LICENSES,
    )
    find: str = option("list the actions nearest to these words", default="", metavar="TEXT")


def run(options: Options) -> Answer:
    """List all names, or those nearest to the given words."""
    if options.model not in (AUTO, CLIPS):
        card = open_model(options.model).card
        found: Sequence[str] = (
            _nearest(Vocabulary.of(card), options.find) if options.find else card.actions
        )
        return Answer(text="\n".join(found), facts={"model": options.model, "actions": list(found)})
    known = catalog(options.license, SOURCES if options.model == AUTO else (CLIPS,))
    if options.find:
        found = _nearest(known.vocabulary, options.find)
        return Answer(text="\n".join(found), facts={"model": options.model, "actions": list(found)})
    told = {
        entry.name: {"theme": entry.theme, "source": entry.sources[0], "license": entry.license}
        | ({"note": entry.note} if entry.note else {})
        for entry in known.entries
    }
    return Answer(
        text=_listed(known), facts={"model": options.model, "actions": list(told), "known": told}
    )


def _nearest(vocabulary: Vocabulary, text: str) -> list[str]:
    return [name for name, score in vocabulary.rank(text)[:SHOWN] if score > 0]


def _listed(known: Catalog) -> str:
    """Format the list: one block per theme, one line per action."""
    blocks = []
    for theme, entries in known.themes().items():
        width = max(len(entry.name) for entry in entries)
        blocks.append(
            "\n".join(
                [
                    theme.upper(),
                    *(
                        f"  {entry.name:{width}}  {NAMES[entry.sources[0]]} ({entry.license})"
                        + (f"; {entry.note}" if entry.note else "")
                        for entry in entries
                    ),
                ]
            )
        )
    return "\n\n".join(blocks)

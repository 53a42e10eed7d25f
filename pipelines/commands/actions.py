"""``a2v actions``: list the actions that can be requested."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.io import shorten
from a2v.motion.catalog import LICENSES, NAMES, SOURCES, Catalog, catalog
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.plan import AUTO, plan_motion
from a2v.motion.vocabulary import NEAR, UnknownActionError, Vocabulary
from pipelines.answer import Answer
from pipelines.options import option
from pipelines.requests.motion import MODEL, open_model

HELP = "List all actions by theme, with source and license. With --model, list the names of one model, one per line."
EXAMPLES = """examples:
  a2v actions
  a2v actions --license free                     without sources that are for research only
  a2v actions --model humanact12
  a2v actions --find "sneaking thief"            what motion makes of these words, and the nearest actions"""


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
        if options.find:
            return _found(options, Vocabulary.of(card))
        names = list(card.actions)
        return Answer(text="\n".join(names), facts={"model": options.model, "actions": names})
    known = catalog(options.license, SOURCES if options.model == AUTO else (CLIPS,))
    if options.find:
        return _found(options, known.vocabulary)
    told = {
        entry.name: {"theme": entry.theme, "source": entry.sources[0], "license": entry.license}
        | ({"note": entry.note} if entry.note else {})
        for entry in known.entries
    }
    return Answer(
        text=_listed(known), facts={"model": options.model, "actions": list(told), "known": told}
    )


def _found(options: Options, vocabulary: Vocabulary) -> Answer:
    """Tell how `a2v motion` understands the words, and list the nearest actions.

    Raises
    ------
    InputError
        No action is near.
    """
    try:
        told = plan_motion(options.find, model=options.model, license=options.license).lines()
    except UnknownActionError as error:
        if not error.nearest:
            raise
        told = [f"'{shorten(error.text, 80)}' is none of the actions that are known"]
    names = [name for name, score in vocabulary.rank(options.find)[:SHOWN] if score > NEAR]
    return Answer(
        text="\n".join([*told, "the nearest actions:", *(f"  {name}" for name in names)]),
        facts={"model": options.model, "actions": names, "understood": told},
    )


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

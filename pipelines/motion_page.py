"""``a2v motion --page``: write the model as one web page instead of motion files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from pipelines.answer import Answer
from pipelines.inputs import check_writable
from pipelines.options import option
from pipelines.requests.motion import DEFAULT_SECONDS, PlanOptions, open_model


@dataclass(frozen=True, kw_only=True)
class PageOptions:
    """Options for a page that generates motions."""

    page: str | None = option(
        "instead of --out: a page (.html) that holds the model and makes motions in the browser",
        default=None,
        metavar="FILE",
    )
    character: str | None = option(
        "with --page: the character (.glb) that performs them", default=None, metavar="FILE"
    )


def write_page(options: PageOptions, plan: PlanOptions, others: list[str]) -> Answer:
    """Write the page; it starts with the plan's action, seed and length.

    `others` are given options that cannot be combined with a page.

    Raises
    ------
    InputError
        Options that a page cannot take, several actions, or what
        `a2v.motion.page.write_motion_page` refuses.
    """
    from a2v.motion.page import write_motion_page
    from a2v.motion.prompts import Vocabulary, parse_prompt

    assert options.page is not None
    path = Path(options.page)
    if path.suffix.lower() != ".html":
        raise InputError(f"cannot write {path}; --page writes .html")
    others = others + [name for name in ("timeline", "frames") if getattr(plan, name) is not None]
    if others:
        raise InputError(
            f"{others[0]} cannot be given with page; a page takes model, action, seed, seconds and "
            "character"
        )
    model = open_model(plan.model)
    steps = parse_prompt(plan.action, Vocabulary.of(model.card))[0] if plan.action else []
    if len(steps) > 1:
        raise InputError("a page starts with one action; give one --action")
    check_writable(path.parent)
    write_motion_page(
        path,
        model,
        options.character,
        action=steps[0].action if steps else None,
        seed=plan.seed,
        seconds=DEFAULT_SECONDS if plan.seconds is None else plan.seconds,
        title=f"a2v: {len(model.actions)} actions",
    )
    return Answer(files=[path], facts={"model": model.path.name, "bytes": path.stat().st_size})

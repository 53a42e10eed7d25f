"""``a2v doctor``: check what works on this machine."""

from __future__ import annotations

from dataclasses import dataclass

from pipelines.answer import Answer
from pipelines.checks import run_checks
from pipelines.options import option

HELP = "Try every part that a video needs; report what works here and how to repair the rest."
EXAMPLES = """examples:
  a2v doctor
  a2v doctor --json

Each part "works", is "slow" (works, but could be faster), "optional" (not installed, and no video needs it) or "fails" (a video needs it; the exit code is 2)."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    cache: str | None = option(
        "folder of the store (default: $A2V_CACHE, else ~/.cache/a2v)",
        default=None,
        metavar="FOLDER",
    )


def run(options: Options) -> Answer:
    """Run all checks."""
    checks = list(run_checks(options.cache))
    lines = [
        f"{check.status:<8} {check.name:<10} {check.about}"
        + f"\n{'':<20}-> {check.advice}" * bool(check.advice)
        for check in checks
    ]
    failed = [check.name for check in checks if check.status == "fails"]
    error = f"{', '.join(failed)}: needed for every video; repair it first" if failed else ""
    text = "\n".join([*lines, "", error or "a video can be made here"])
    return Answer(
        text=text,
        facts={"checks": checks, "works": not failed},
        code=2 if failed else 0,
        error=error,
    )

"""``a2v evaluate reconstruction``: compare reconstructions from photos with ground truth."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import cv2

from a2v.errors import InputError
from a2v.io import atomic_path, say
from a2v.lab.evaluation.reconstruction import (
    PANELS,
    BenchmarkSettings,
    Case,
    Measured,
    Method,
    Outcome,
    Pin,
    calibration,
    evaluate_case,
    fit_table,
    group_table,
    method_table,
    open_case,
    open_studio,
    peak_memory,
    report,
    stack_rows,
)
from a2v.lab.studio.studio import Studio
from a2v.reconstruction.backends import backend_digest
from pipelines.answer import Answer
from pipelines.bar import bar
from pipelines.lab.tables import table_path, table_result, write_table
from pipelines.options import group, option

HELP = (
    "Measure the reconstruction (shape, silhouette, colors, time, memory) on synthetic photos of "
    "people that were not used in any training."
)
EXAMPLES = """examples:
  a2v evaluate reconstruction --data ../shared/data --studio runs/studio --out table.md
  a2v evaluate reconstruction --data ../shared/data --studio runs/studio --panel development --methods pifu --out action.md
  a2v evaluate reconstruction --data ../shared/data --studio runs/studio --methods body-prior,body-prior:mirrored --views 7 --out table.md
  a2v evaluate reconstruction --data ../shared/data --studio runs/studio --panel phone --methods character,character+180,character+90 --out two.md
  a2v evaluate reconstruction --data ../shared/data --studio runs/studio --true-mask true --sheet 4 --out table.md

A method is one of these:
  BACKEND              a reconstruction backend
  BACKEND:mirrored     with unseen points in the photo's color at their pixel, for an ablation
  BACKEND:network      with the colors of the backend only, for an ablation
  character            the canonical character
  character+180        the character of two photos; in the second one the person is turned by 180
                       degrees and has another pose

The photos of each --panel are fixed: studio (20 like those of a2v studio), development (people in
action, for trying changes), report (other people in action, for final figures), final (40 photos
of people that were not used in any training, half of them in action, to be measured once) and
phone (14 with near cameras, like those of phones). --studio is a folder of a2v studio, whose poses
and guides are used; it is made if it does not exist. Writes tables as Markdown and, beside them,
the values of every photo as JSON and a picture sheet as JPEG. The sheet has for each photo one row
for the ground truth and one for each method: photo or mask; front, left, back, right; and front,
left, back as clay. Finished photos are kept in a folder named like OUT, so an interrupted run can
resume."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    data: str = option("folder with avatars/ and the motion data")
    studio: str = option("folder of a2v studio")
    methods: str = option(
        "methods, separated by commas: BACKEND or BACKEND:COLORING",
        default="pifu,pifu:mirrored,pifu:network,body-prior,body-prior:mirrored",
    )
    weights: str = option(
        "folder of custom reconstruction weights (a2v train reconstruction) for pifu",
        default="",
    )
    sheet: int = option("photos on the picture sheet, 0 for none", default=8)
    memory: bool = option("measure each method's memory, in a separate process", default=True)
    out: str = option("the .md to write; .json and .jpg lie beside it")
    protocol: BenchmarkSettings = group(BenchmarkSettings)


def run(options: Options) -> Answer:
    """Measure the methods and write the tables."""
    out, protocol = table_path(options.out), options.protocol
    methods = [Method.parse(name.strip(), options.weights) for name in options.methods.split(",")]
    for method in methods:
        backend_digest(
            method.backend, method.weights
        )  # Missing weights are reported now, not after a long computation.
    studio = open_studio(options.studio, options.data, protocol.panel)
    measured = Measured(out.with_suffix(""), studio, protocol)
    outcomes = _measure(measured, studio, protocol, methods)
    good = [outcome for outcome in outcomes if not outcome.failure]
    if not good:
        raise InputError(f"all {len(outcomes)} photos failed, the first one: {outcomes[0].failure}")
    memory: dict[str, float] = {}
    if options.memory:
        first = next(pin for pin in PANELS[protocol.panel] if pin.index == good[0].index)
        case = open_case(studio, first, measured.cases)
        memory = {
            method.name: peak_memory(case, method, protocol)
            for method in methods
            if not method.character
        }
    text = [
        "# Reconstruction",
        f"{len(good)} photos of the panel {protocol.panel} ({len(outcomes) - len(good)} failed), "
        f"{'true' if protocol.true_mask else 'own'} masks, {protocol.size} rays a "
        "side. Mean ± 95 % interval; see docs/reconstruction.md. "
        "Seconds are wall time, all of it with perception and fit; memory is that of "
        "a fresh process, photo to colored surface.",
        method_table(outcomes, memory),
        "## The fit",
        fit_table(outcomes),
        calibration(outcomes),
    ]
    for method in methods:
        if method.coloring == "ours":
            text += [
                f"## {method.name}",
                *(group_table(outcomes, method.name, by) for by in ("pose", "identity", "outfit")),
            ]
    content = report(outcomes, memory, protocol, studio)
    written = write_table(out, text, content)
    if options.sheet:
        sheet = stack_rows(
            [measured.sheet(outcome.index, methods) for outcome in good[: options.sheet]]
        )
        with atomic_path(out.with_suffix(".jpg")) as temporary:
            cv2.imwrite(str(temporary), sheet[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])
    return table_result(out, written, content)


def _turned_photo(studio: Studio, pin: Pin, measured: Measured, turn: float) -> Case:
    """Return another photo of a pin's person, turned by a number of degrees."""
    return open_case(studio, pin, measured.cases, turn=turn)


def _measure(
    measured: Measured, studio: Studio, protocol: BenchmarkSettings, methods: Sequence[Method]
) -> list[Outcome]:
    """Return the outcome of every photo; outcomes in `measured` are used again."""
    outcomes: list[Outcome] = []
    views = PANELS[protocol.panel][: protocol.views]
    with bar("photos", "photo") as progress:
        for done, pin in enumerate(views):
            outcome = measured.load(pin.index, methods)
            missing = [
                method for method in methods if outcome is None or method.name not in outcome.scores
            ]
            if missing:
                again = functools.partial(_turned_photo, studio, pin, measured)
                result = evaluate_case(
                    open_case(studio, pin, measured.cases), missing, protocol, again
                )
                measured.save(result, missing)
                outcome = outcome.with_others(result.outcome) if outcome else result.outcome
            assert outcome is not None
            if outcome.failure:
                say(f"photo {pin.index} ({outcome.name}) failed: {outcome.failure}")
            outcomes.append(outcome)
            progress(done + 1, len(views))
    return outcomes

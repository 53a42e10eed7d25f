"""``a2v evaluate reconstruction``: measure reconstructions of people from photos against the truth."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from a2v.errors import InputError
from a2v.io import atomic_path

HELP = (
    "Measure the reconstruction on synthetic photos of people whom no network has learned from: shape, silhouette, colours, time, memory."
)
EXAMPLES = """examples:
  a2v evaluate reconstruction --data ../shared/data --studio runs/studio --out table.md
  a2v evaluate reconstruction --data ../shared/data --studio runs/studio --methods body-prior,body-prior:mirrored --views 7 --out table.md
  a2v evaluate reconstruction --data ../shared/data --studio runs/studio --true_mask true --sheet 4 --out table.md

A method is a backend, or BACKEND:COLOURING for an ablation: mirrored (all that was not seen has the photo's colour at its pixel) or network
(the backend's own colours alone). Photos are of the validation split of a2v studio, --studio is a folder that it wrote (its poses and guides
are used; made there if it is new). Writes tables as Markdown and, beside them, every photo's values as JSON and a picture sheet as JPEG:
per photo a row for the truth and one for each method (photo or mask; front, left, back, right; front, left, back as clay). Finished photos are
kept in a folder named like OUT: a run that was stopped goes on, and another method takes its own time only."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.evaluation.reconstruction import BenchmarkSettings

    parser.add_argument("--data", required=True, help="folder with avatars/ and the motion data")
    parser.add_argument("--studio", required=True, help="folder of a2v studio")
    parser.add_argument(
        "--methods",
        default="pifu,pifu:mirrored,pifu:network,body-prior,body-prior:mirrored",
        help="BACKEND or BACKEND:COLOURING, with commas",
    )
    parser.add_argument("--weights", default="", help="folder of reconstruction weights of one's own (a2v train reconstruction) for pifu")
    parser.add_argument("--sheet", type=int, default=8, help="photos on the picture sheet, 0 for none")
    parser.add_argument("--memory", type=bool, default=True, help="measure each method's memory, in a process of its own")
    parser.add_argument("--out", required=True, help="the .md to write; .json and .jpg lie beside it")
    parser.add_class_arguments(BenchmarkSettings, None)


def run(settings: Any) -> int:
    """Measure; print the tables."""
    import cv2

    from a2v.evaluation.reconstruction import (
        BenchmarkSettings,
        Measured,
        Method,
        Outcome,
        choose_views,
        evaluate_case,
        group_table,
        method_table,
        open_case,
        open_studio,
        peak_memory,
        report,
        stack_rows,
    )
    from a2v.reconstruction.backends import backend_digest
    from pipelines.bar import bar
    from pipelines.inputs import check_writable

    out = Path(settings.out)
    if out.suffix != ".md":
        raise InputError(f"cannot write {out}; expected a name that ends in .md")
    check_writable(out.parent)
    protocol = BenchmarkSettings(**{name: settings[name] for name in BenchmarkSettings.__dataclass_fields__})
    methods = [Method.parse(name.strip(), settings.weights) for name in settings.methods.split(",")]
    for method in methods:
        backend_digest(method.backend, method.weights)  # weights that are missing are told now
    studio = open_studio(settings.studio, settings.data)
    measured = Measured(out.with_suffix(""), studio, protocol)
    outcomes: list[Outcome] = []
    memory: dict[str, float] = {}
    views = choose_views(studio, protocol)
    with bar("photos", "photo") as progress:
        for done, index in enumerate(views):
            outcome = measured.load(index, methods)
            missing = [method for method in methods if outcome is None or method.name not in outcome.scores]
            if missing:
                result = evaluate_case(open_case(studio, index), missing, protocol)
                measured.save(result, missing)
                outcome = outcome.with_others(result.outcome) if outcome else result.outcome
            assert outcome is not None
            if outcome.failure:
                print(f"photo {index} ({outcome.name}) failed: {outcome.failure}", file=sys.stderr)
            outcomes.append(outcome)
            progress(done + 1, len(views))
    good = [outcome for outcome in outcomes if not outcome.failure]
    failed = len(outcomes) - len(good)
    if not good:
        raise InputError(f"all {failed} photos failed, the first one: {outcomes[0].failure}")
    if settings.memory:
        case = open_case(studio, good[0].index)
        memory = {method.name: peak_memory(case, method, protocol) for method in methods}
    text = [
        "# Reconstruction",
        f"{len(outcomes) - failed} photos of the validation split ({failed} failed), seed {protocol.seed}, "
        f"{'true' if protocol.true_mask else 'own'} masks, {protocol.size} rays a side. Mean ± 95 % interval; see docs/reconstruction.md. "
        "Seconds are wall time, all of it with perception and fit; memory is that of a fresh process, photo to coloured surface.",
        method_table(outcomes, memory),
    ]
    for method in methods:
        if method.coloring == "ours":
            text += [f"## {method.name}", *(group_table(outcomes, method.name, by) for by in ("identity", "outfit"))]
    joined = "\n\n".join(text) + "\n"
    with atomic_path(out) as temporary:
        temporary.write_text(joined)
    with atomic_path(out.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(report(outcomes, memory, protocol, studio), indent=1))
    if settings.sheet:
        sheet = stack_rows([measured.sheet(outcome.index, methods) for outcome in good[: settings.sheet]])
        with atomic_path(out.with_suffix(".jpg")) as temporary:
            cv2.imwrite(str(temporary), sheet[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])
    print(joined)
    print(out)
    return 0

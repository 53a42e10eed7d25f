"""``a2v evaluate moved``: compare characters from photos with the true people in other poses."""

from __future__ import annotations

import dataclasses
import io
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from a2v.errors import InputError
from a2v.io import atomic_path, say, sha256
from a2v.lab.evaluation.moved.cases import MovedCase, open_moved_case
from a2v.lab.evaluation.moved.measures import PROTOCOL, MovedSettings, compare_moved, move
from a2v.lab.evaluation.moved.panels import MOVED_PANELS
from a2v.lab.evaluation.moved.rules import METRICS, Bench, Trial, noise_of, rules_table
from a2v.lab.evaluation.moved.sheets import moved_rows
from a2v.lab.evaluation.moved.tables import MovedOutcome, moved_table, photo_table
from a2v.lab.evaluation.reconstruction.panels import Pin
from a2v.lab.evaluation.reconstruction.pictures import stack_rows
from a2v.reconstruction.canonical import Sight
from a2v.reconstruction.reading import Reading
from a2v.reconstruction.rules import COLORING, READING, left_out
from a2v.types import Body, Character, PhotoCamera, Reconstruction, Subject
from pipelines.answer import Answer
from pipelines.bar import bar
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions, check_writable
from pipelines.lab.tables import table_path, table_result, write_table
from pipelines.options import group, option
from pipelines.requests.person import PersonStages

HELP = (
    "Measure characters in a T-pose and in motion. They are made from photos of people that "
    "were not used in any training."
)
EXAMPLES = """examples:
  a2v evaluate moved --data ../shared/data --out moved.md
  a2v evaluate moved --data ../shared/data --photos 8 --out moved.md                   the first eight photos of the panel
  a2v evaluate moved --data ../shared/data --only 40001,40003 --out moved.md           these two
  a2v evaluate moved --data ../shared/data --photos 8 --without all --color.texture 512 --out rules.md   what each rule brings
  a2v evaluate moved --data ../shared/data --panel final --out docs/results/moved.md   other people, when the work is done

The people stand, walk, sit or squat as in everyday photographs, also with hands on the body and
feet together. The pipeline makes a character from each photo. The character is put into the
T-pose and into six frames of a motion, and compared with the true person in the same poses: it
gets the true joint rotations and keeps its own bone lengths. OUT gets a table. The .json beside it
has the values of every photo; the .jpg has the pictures: photo, T-pose from three sides and
frames, with the ground truth below. Finished photos are kept in a folder named like OUT, so an
interrupted run can resume. Another method of making the character adds its rows to the same table."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    data: str = option("folder with avatars/, motions/ and MakeHuman's archive")
    panel: str = option("panel of photos", default="development", choices=tuple(MOVED_PANELS))
    photos: int = option("number of photos: the first ones of the panel", default=20)
    only: str = option(
        "numbers of single photos, separated by commas; instead of --photos", default=""
    )
    seeds: int = option(
        "with --without: number of seeds of the matching of patches, at least four", default=4
    )
    beside: str = option(
        "with --without: further photos without a true person, separated by commas", default=""
    )
    label: str = option(
        "name of this method in the table (default: the name of the character)",
        default="",
    )
    sheet: int = option("number of photos on the picture sheet; 0: no sheet", default=20)
    out: str = option("file to write, .md; the .json and the .jpg are written beside it")
    protocol: MovedSettings = group(MovedSettings)
    stages: PersonStages = group(PersonStages)
    running: RunOptions = group(RunOptions)

    @property
    def method(self) -> str:
        """The name of the character in the table."""
        return self.label or str(getattr(self.stages, "character", "fused"))

    @property
    def pins(self) -> tuple[Pin, ...]:
        """Return the photos.

        Raises
        ------
        InputError
            A number is not in the panel.
        """
        pins = MOVED_PANELS[self.panel]
        if not self.only:
            return pins[: max(1, self.photos)]
        known = {str(pin.index): pin for pin in pins}
        asked = [number.strip() for number in self.only.split(",")]
        if unknown := [number for number in asked if number not in known]:
            raise InputError(
                f"photo '{unknown[0]}' is not in the panel {self.panel}; choose from "
                f"{', '.join(known)}"
            )
        return tuple(known[number] for number in asked)


def run(options: Options) -> Answer:
    """Measure the photos and write the table."""
    if options.stages.without:
        return _run_rules(options)
    out = table_path(options.out)
    folder = check_writable(out.with_suffix(""))
    outcomes = []
    with bar("photos", "photo", hidden=options.running.quiet) as progress:
        for done, pin in enumerate(options.pins, 1):
            outcomes.append(_measure(options, pin, folder))
            if outcomes[-1].failure:
                say(f"photo {pin.index} failed: {outcomes[-1].failure}")
            progress(done, len(options.pins))
    if all(outcome.failure for outcome in outcomes):
        raise InputError(f"all {len(outcomes)} photos failed, the first one: {outcomes[0].failure}")
    everything = _known(folder, options, {pin.index for pin in options.pins})
    text = [
        "# Moved people",
        f"{len(options.pins)} photos of the panel {options.panel}; see "
        "docs/reconstruction.md. T: in T-pose; motion: the mean of six frames. "
        "Distances after rigid alignment; torn: area of triangles with an edge over "
        "4 cm that is over three times as long as where the character "
        "was made; pictures unlit, four sides. Mean ± 95 % interval.",
        moved_table(everything),
        "## Photos",
        photo_table(everything),
    ]
    content = {
        "protocol": dataclasses.asdict(options.protocol)
        | {"panel": options.panel, "version": PROTOCOL},
        "photos": [dataclasses.asdict(outcome) for outcome in everything],
    }
    written = write_table(out, text, content)
    _write_sheet(
        out.with_suffix(".jpg"),
        [_key(folder, outcome, ".png") for outcome in everything][: options.sheet],
    )
    return table_result(out, written, content)


def _run_rules(options: Options) -> Answer:
    """Measure single rules and write their table; ``--without all`` measures every one."""
    out = table_path(options.out)
    folder = check_writable(out.with_suffix(""))
    known = {**READING, **COLORING}
    names = options.stages.without
    rules = [*known] if names == "all" else sorted(left_out(names, known), key=[*known].index)
    if options.seeds < 2:
        raise InputError(f"--seeds is {options.seeds}; expected at least 2, better 4")
    photos: list[tuple[str, Path, MovedCase | None]] = []
    for pin in options.pins:
        own = open_moved_case(pin, options.data, folder.parent / "cases")
        photos.append((f"{pin.index}", _as_file(own, folder), own))
    beside = [Path(name.strip()) for name in options.beside.split(",") if name.strip()]
    photos += [(path.stem, path, None) for path in beside]
    trials = list[Trial]()
    with bar("photos", "photo", hidden=options.running.quiet) as progress:
        for done, (name, path, case) in enumerate(photos, 1):
            trials += _bench(options, name, path, case).trials(rules, options.seeds)
            progress(done, len(photos))
    noise = ", ".join(f"{label} ± {noise_of(trials, name):.3f}" for name, label in METRICS.items())
    text = [
        "# Rules",
        f"Score with a rule minus score without it, mean over the photos on which it acts, ± half "
        f"the 95 % interval over {options.seeds} seeds of the matching of patches. "
        f"{len(options.pins)} photos of the panel {options.panel} in T-pose and {len(beside)} "
        f"others, texture {options.stages.color.texture}. Clear: beyond the interval, with the rule better or worse. "
        f"All rules, mean over the panel between seeds: {noise}.",
        rules_table(trials, {name: known[name] for name in rules}),
    ]
    content = {"trials": [dataclasses.asdict(one) for one in trials]}
    return table_result(out, write_table(out, text, content), content)


def _bench(options: Options, name: str, path: Path, case: MovedCase | None) -> Bench:
    """Return the person of a photo, made with all rules."""
    store = Store(options.running.cache)
    stages = dataclasses.replace(options.stages, without="")
    targets = ["subject", "surface", "body", "photo_camera", "reading", "surface_with_face"]
    made = options.running.run(targets, stages.with_photo(os.fspath(path)).resolve(store))
    sight = Sight(
        made.get("subject", Subject),
        made.get("body", Body),
        made.get("photo_camera", PhotoCamera),
        made.get("surface", Reconstruction),
        made.get("reading", Reading),
    )
    person = made.get("surface_with_face", Reconstruction)
    return Bench(name, sight, person, case, stages.color, options.protocol)


def _key(folder: Path, outcome: MovedOutcome, suffix: str) -> Path:
    return folder / f"{outcome.index:06d}-{outcome.method}{suffix}"


def _measure(options: Options, pin: Pin, folder: Path) -> MovedOutcome:
    """Return the outcome of a photo; a stored outcome of the same character is used again."""
    store = Store(options.running.cache)
    case = open_moved_case(pin, options.data, folder.parent / "cases")
    photo = _as_file(case, folder)
    outcome = MovedOutcome(case.name, case.index, case.stance, options.method)
    try:
        made = options.running.run(
            ["character", "subject", "photo_camera", "body"],
            options.stages.with_photo(os.fspath(photo)).resolve(store),
        )
    except InputError as error:
        return _keep(dataclasses.replace(outcome, failure=str(error)), folder, "")
    key = sha256(
        json.dumps(
            [made.values["character"].digest, dataclasses.asdict(options.protocol), PROTOCOL]
        ).encode()
    )[:16]
    path = _key(folder, outcome, ".json")
    if path.exists() and (known := json.loads(path.read_text(encoding="utf-8")))["key"] == key:
        return MovedOutcome(**known["outcome"])
    character = made.get("character", Character)
    moved = move(
        case,
        character,
        made.get("body", Body),
        made.get("photo_camera", PhotoCamera),
        made.get("subject", Subject),
        options.protocol,
    )
    scores = compare_moved(case, moved, options.protocol)
    outcome = dataclasses.replace(outcome, scores=scores, triangles=len(character.surface.faces))
    with atomic_path(_key(folder, outcome, ".png")) as temporary:
        cv2.imwrite(str(temporary), moved_rows(case, moved)[..., ::-1])
    return _keep(outcome, folder, key)


def _keep(outcome: MovedOutcome, folder: Path, key: str) -> MovedOutcome:
    """Store an outcome; one without a key is computed again the next time."""
    with atomic_path(_key(folder, outcome, ".json")) as temporary:
        temporary.write_text(
            json.dumps({"key": key, "outcome": dataclasses.asdict(outcome)}), encoding="utf-8"
        )
    return outcome


def _as_file(case: MovedCase, folder: Path) -> Path:
    """Return the path of the photo as a file, as a user would give it."""
    path = folder.parent / "cases" / f"{case.index:06d}.png"
    if not path.exists():
        stream = io.BytesIO()
        Image.fromarray(case.image).save(stream, format="PNG")
        with atomic_path(path) as temporary:
            temporary.write_bytes(stream.getvalue())
    return path


def _known(folder: Path, options: Options, indices: set[int]) -> list[MovedOutcome]:
    """Return every stored outcome of these photos for any character, by photo."""
    found = [
        MovedOutcome(**json.loads(path.read_text(encoding="utf-8"))["outcome"])
        for path in sorted(folder.glob("*.json"))
    ]
    return [outcome for outcome in found if outcome.index in indices]


def _write_sheet(path: Path, pictures: Iterable[Path]) -> None:
    rows = [
        np.asarray(cv2.imread(str(picture)))[..., ::-1] for picture in pictures if picture.exists()
    ]
    if rows:
        with atomic_path(path) as temporary:
            cv2.imwrite(str(temporary), stack_rows(rows)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])

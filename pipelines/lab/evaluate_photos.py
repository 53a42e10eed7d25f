"""``a2v evaluate photos``: characters from real photographs, which have no ground truth."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path

from a2v.errors import A2VError, InputError
from a2v.io import atomic_path, say, sha256
from a2v.lab.evaluation.photos.made import Made
from a2v.lab.evaluation.photos.measures import PROTOCOL, PhotoOutcome, PhotoSettings, measure
from a2v.lab.evaluation.photos.recognition import load_models
from a2v.lab.evaluation.photos.sheets import photo_sheet
from a2v.lab.evaluation.photos.tables import (
    COLUMNS,
    grades_table,
    measures_table,
    read_grades,
    summary_lines,
)
from a2v.types import Character, PhotoCamera, Subject, Surface
from pipelines.answer import Answer
from pipelines.bar import bar
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions, check_writable
from pipelines.lab.tables import table_result, write_table
from pipelines.nodes.values import Poses
from pipelines.options import group, option
from pipelines.requests.person import PersonStages
from pipelines.requests.video import video_parameters

HELP = "Draw and measure the characters of a folder of real photographs, without ground truth."
EXAMPLES = """examples:
  a2v evaluate photos ../shared/data/photos/real --out runs/photos
  a2v evaluate photos photos --only anna,ben --out runs/photos                     these two
  a2v evaluate photos photos --grades grades.csv --out runs/photos                 with grades by eye: photo,grade,reason

OUT gets a sheet of every photo: the photo, the character posed as photographed, in T-pose from four
sides and in two frames of motion; its head from five sides, with closed eyes and an open mouth. The
tables photos.md and photos.json have, for every photo, the outline's IoU and the CIELAB difference
of the character posed as photographed, the distance of faces by dlib's descriptor (below 0.6: the
same person), and how far features are off their places when a face is detected on the character.
An interrupted run goes on: characters are in the store, finished photos in OUT. Faces are compared
by packages of the extra a2v[evaluation]."""
TARGETS = ("subject", "photo_camera", "colored_surface", "character", "poses")
SUFFIXES = (".jpg", ".jpeg", ".png", ".webp")


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    folder: str = option("folder of photos", names=("folder",), metavar="FOLDER")
    only: str = option("names of single photos, separated by commas", default="")
    action: str = option("action of the two frames of motion", default="Walk")
    grades: str | None = option(
        "CSV file of grades by eye: photo, grade (1 to 5), reason", default=None, metavar="FILE"
    )
    out: str = option("folder to write to")
    protocol: PhotoSettings = group(PhotoSettings)
    stages: PersonStages = group(PersonStages)
    running: RunOptions = group(RunOptions)

    def photos(self) -> list[Path]:
        """Return the photos, without the masks beside them.

        Raises
        ------
        InputError
            There are none, or one of `only` is missing.
        """
        found = {
            path.stem: path
            for path in sorted(Path(self.folder).glob("*"))
            if path.suffix.lower() in SUFFIXES and not path.stem.endswith("_mask")
        }
        asked = [name.strip() for name in self.only.split(",") if name.strip()]
        if not found:
            raise InputError(
                f"there is no photo in {self.folder}; expected a folder with files that end in "
                f"{', '.join(SUFFIXES)}"
            )
        if unknown := [name for name in asked if name not in found]:
            raise InputError(
                f"there is no photo '{unknown[0]}' in {self.folder}; choose from {', '.join(found)}"
            )
        return [found[name] for name in asked or found]


def run(options: Options) -> Answer:
    """Make, draw and measure the characters, and write the tables."""
    photos = options.photos()
    grades = {} if options.grades is None else read_grades(options.grades)
    load_models()
    out = check_writable(options.out)
    outcomes = []
    with bar("photos", "photo", hidden=options.running.quiet) as progress:
        for done, photo in enumerate(photos, 1):
            outcomes.append(_outcome(options, photo, out))
            if outcomes[-1].failure:
                say(f"{photo.name} failed: {outcomes[-1].failure}")
            progress(done, len(photos))
    text = [
        "# Characters from real photographs",
        "Made by `a2v evaluate photos`; what the columns are is in docs/evaluation.md.",
        " ".join(summary_lines(outcomes, grades)),
        measures_table(outcomes),
        "## Grades by eye and notes",
        grades_table(outcomes, grades),
    ]
    content = {
        "protocol": dataclasses.asdict(options.protocol) | {"version": PROTOCOL},
        "columns": {name: label for name, (label, _) in COLUMNS.items()},
        "photos": [dataclasses.asdict(outcome) for outcome in outcomes],
        "grades": {name: dataclasses.asdict(grade) for name, grade in grades.items()},
    }
    table = out / "photos.md"
    return table_result(table, write_table(table, text, content), content)


def _outcome(options: Options, photo: Path, out: Path) -> PhotoOutcome:
    """Return the outcome of a photo; a stored outcome of the same character is used again."""
    store, name = Store(options.running.cache), photo.stem
    stages = {
        item.name: getattr(options.stages, item.name) for item in dataclasses.fields(PersonStages)
    }
    try:
        found = options.running.run(
            TARGETS, video_parameters(store, photo, options.action, **stages)
        )
    except A2VError as error:
        return PhotoOutcome(name, failure=str(error))
    facts = [found.values["character"].digest, dataclasses.asdict(options.protocol), PROTOCOL]
    key = sha256(json.dumps([*facts, found.notes]).encode())[:16]
    kept, sheet = out / "kept" / f"{name}.json", out / f"{name}.png"
    if kept.exists() and sheet.exists():
        known = json.loads(kept.read_text(encoding="utf-8"))
        if known["key"] == key:
            return PhotoOutcome(**known["outcome"])
    made = Made(
        found.get("subject", Subject),
        found.get("photo_camera", PhotoCamera),
        found.get("colored_surface", Surface),
        found.get("character", Character),
        found.get("poses", Poses).bone_transforms,
        found.notes,
    )
    outcome = PhotoOutcome(
        name, measure(made, options.protocol), found.notes, seconds=round(found.seconds, 1)
    )
    _write_sheet(sheet, made, outcome)
    with atomic_path(kept) as temporary:
        temporary.write_text(
            json.dumps({"key": key, "outcome": dataclasses.asdict(outcome)}), encoding="utf-8"
        )
    return outcome


def _write_sheet(path: Path, made: Made, outcome: PhotoOutcome) -> None:
    from PIL import Image

    figures = ", ".join(f"{name} {value:.2f}" for name, value in outcome.values.items())
    picture = photo_sheet(made, [outcome.name, figures, *(outcome.notes or ("no notes",))])
    with atomic_path(path) as temporary:
        Image.fromarray(picture).save(temporary, format="png")

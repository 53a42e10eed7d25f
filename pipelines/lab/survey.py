"""``a2v survey``: make a user study, or analyze its answers."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.io import atomic_path
from a2v.lab.datasets import load_dataset
from a2v.lab.evaluation.baselines import baseline_motions, open_baseline
from a2v.lab.evaluation.survey import REAL, SurveySettings, write_survey
from a2v.lab.evaluation.survey_answers import analyze, read_answers, read_key, survey_table
from a2v.motion import MotionModel
from a2v.motion.names import plain_name
from a2v.rendering.stickfigure import plot_rows, save_figure
from a2v.types import Motion
from pipelines.answer import Answer
from pipelines.bar import bar
from pipelines.options import group, option
from pipelines.requests.motion import MODEL

MAX_ROWS = 40
"""Maximum number of rows in one picture."""
HELP = (
    "Make the papers' user studies (preference ranking, real or fake) as one web page, "
    "or turn its answers into percentages."
)
EXAMPLES = """examples:
  a2v survey --model humanact12 --dataset humanact12 --data ../shared/data --out survey.html
  a2v survey --model cmu --model mine.onnx --real-or-fake 0 --out survey.html          two models, no data
  a2v survey --model cmu --motions theirs=walks.npz --real-or-fake 0 --out survey.html  motions of another system
  a2v survey --model humanact12-lie --model runs/condgru/baseline.pt --dataset humanact12 --data ../shared/data --action run --out rows.png
  a2v survey --analyze answers*.json --key survey.key.json --out result.md

Writes the page, which needs no server and no network, and beside it survey.key.json: keep the key
from participants. Each participant saves a file of answers at the end; --analyze counts them and
writes the table, with the numbers as JSON beside it."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    model: tuple[str, ...] = option(
        f"{MODEL}, or the baseline.pt of a2v train baseline; may be repeated",
        default=(),
        many="repeated",
    )
    motions: tuple[str, ...] = option(
        "NAME=FILE (.npz, .bvh): clips of another system; may be repeated",
        default=(),
        many="repeated",
        metavar="NAME=FILE",
    )
    dataset: str | None = option("data set of the real motions (a2v data)", default=None)
    data: str | None = option("folder or archive that holds it", default=None)
    action: str | None = option(
        "actions of the questions, separated by commas (default: all)", default=None
    )
    frames: int = option("frames per clip", default=60)
    analyze: tuple[str, ...] = option(
        "files of answers to analyze", default=(), many="listed", metavar="FILE"
    )
    key: str | None = option(
        "the key that was written beside the page", default=None, metavar="FILE"
    )
    out: str | None = option(
        "file to write: .html, or .png or .svg for the clips only; with --analyze .md",
        default=None,
    )
    survey: SurveySettings = group(SurveySettings)


def run(options: Options) -> Answer:
    """Write the page, or count the answers."""
    if options.analyze:
        return _analyse(options)
    if options.out is None:
        raise InputError("give --out survey.html, or answers to --analyze")
    chosen = options.survey
    picture = Path(options.out).suffix in (".png", ".svg")
    sources = _sources(options, 1 if picture else chosen.preference + chosen.real_or_fake)
    if picture:
        rows = {
            f"{name}, {action}": clips[0]
            for name, own in sources.items()
            for action, clips in own.items()
        }
        if len(rows) > MAX_ROWS:
            raise InputError(
                f"{len(rows)} rows in one picture; expected at most {MAX_ROWS}: name "
                "fewer with --action"
            )
        save_figure(options.out, plot_rows(list(rows.values()), titles=list(rows)))
        return Answer(files=[Path(options.out)])
    with bar("survey", "clip") as progress:
        key = write_survey(options.out, sources, chosen, progress=progress)
    return Answer(files=[Path(options.out), Path(key)])


def _sources(options: Options, questions: int) -> dict[str, dict[str, list[Motion]]]:
    """Return clips by source and action.

    Clips of an action have equal lengths, since the length would reveal the source.
    """
    if not 2 <= options.frames <= 1000:
        raise InputError(f"frames is {options.frames}; expected 2 to 1000")
    models: dict[str, MotionModel | Path] = {}
    for name in options.model:
        path = Path(name)
        learned = path.suffix == ".pt"
        models[path.parent.name if learned else path.stem] = (
            path if learned else MotionModel.load(name)
        )
    if len(models) < len(options.model):
        raise InputError(
            "two models have the name "
            f"{', '.join(sorted({Path(name).stem for name in options.model}))}; "
            "rename one file"
        )
    sources: dict[str, dict[str, list[Motion]]] = {}
    actions = [name.strip() for name in options.action.split(",")] if options.action else None
    lengths: dict[str, int] = {}
    if options.dataset is not None:
        sources[REAL], lengths = _real_clips(options.dataset, options, questions)
        actions = actions or list(sources[REAL])
    elif options.data is not None:
        raise InputError("give --dataset as well: the name of the data set in --data")
    exported = [model for model in models.values() if isinstance(model, MotionModel)]
    if actions is None and exported:
        actions = list(exported[0].actions)
    others: dict[str, dict[str, list[Motion]]] = {}
    for entry in options.motions:
        name, _, file = entry.partition("=")
        if not file:
            raise InputError(f"--motions is '{entry}'; expected NAME=FILE")
        motion = read_motion(file)
        clips = [motion[index] for index in np.ndindex(motion.batch)] if motion.batch else [motion]
        others.setdefault(name, {}).setdefault(motion.action, []).extend(
            clip.first(options.frames) for clip in clips
        )
    if taken := sorted(
        name
        for name in (*models, *others)
        if name.lower() == REAL or not name or (name in models and name in others)
    ):
        raise InputError(
            f"'{taken[0]}' cannot be the name of a source of motions: '{REAL}' means the "
            "recorded clips, and each name may be used once; "
            "rename the model's file or the NAME of --motions"
        )
    if actions is None:
        actions = sorted({action for own in others.values() for action in own})
    if REAL in sources:
        known = {plain_name(name): name for name in sources[REAL]}
        actions = [known.get(plain_name(name), name) for name in actions]
        sources[REAL] = {name: sources[REAL][name] for name in actions if name in sources[REAL]}
    clips_each = max(1, -(-questions // max(len(actions), 1)))
    for place, (name, model) in enumerate(models.items()):
        sources[name] = {}
        for index, action in enumerate(actions):
            frames = lengths.get(action, options.frames)
            seed = options.survey.seed * 1000 + place * 100 + index
            if not isinstance(model, MotionModel):
                sources[name][action] = _of_baseline(
                    model, options, action, frames=frames, count=clips_each, seed=seed
                )
                continue
            batch = model.sample(action, frames=frames, count=clips_each + 1, seed=seed)
            sources[name][action] = [batch[i] for i in range(clips_each)]
    for name, own in others.items():
        known = {plain_name(action): action for action in actions}
        sources[name] = {
            known[plain_name(action)]: clips
            for action, clips in own.items()
            if plain_name(action) in known
        }
    return sources


def _of_baseline(
    path: Path, options: Options, action: str, *, frames: int, count: int, seed: int
) -> list[Motion]:
    """Return clips of a trained baseline, with first poses from the data set."""
    if options.dataset is None or options.data is None:
        raise InputError(f"{path} needs its training data; give --dataset and --data")
    dataset = load_dataset(options.dataset, options.data)
    trained = open_baseline(str(path), dataset)
    known = {plain_name(name): name for name in dataset.actions}
    if plain_name(action) not in known:
        raise InputError(
            f"{dataset.name} has no action '{action}'; it has {', '.join(dataset.actions)}"
        )
    return [
        clip.first(min(frames, clip.frames))
        for clip in baseline_motions(
            trained, dataset, known[plain_name(action)], count=count, seed=seed
        )
    ]


def _real_clips(
    name: str, options: Options, questions: int
) -> tuple[dict[str, list[Motion]], dict[str, int]]:
    """Return random real clips of the data set `name` by action, and their length by action.

    They are cut to the median length of the action or to --frames.
    """
    if options.data is None:
        raise InputError("give --data: the folder or archive of --dataset")
    dataset = load_dataset(name, options.data)
    generator = np.random.default_rng(options.survey.seed)
    counts = np.array([len(joints) for joints in dataset.joints])
    clips: dict[str, list[Motion]] = {}
    lengths: dict[str, int] = {}
    for label, action in enumerate(dataset.actions):
        own = np.flatnonzero(dataset.labels == label)
        if not len(own):
            continue
        lengths[action] = int(min(options.frames, np.median(counts[own])))
        long = own[counts[own] >= lengths[action]]
        picked = generator.permutation(long)[: -(-questions // len(dataset.actions)) + 1]
        clips[action] = [dataset.motion(int(index)).first(lengths[action]) for index in picked]
    return clips, lengths


def _analyse(options: Options) -> Answer:
    if options.key is None:
        raise InputError("give --key: the .key.json that was written beside the page")
    out = None if options.out is None else Path(options.out)
    if out is not None and out.suffix != ".md":
        raise InputError(f"cannot write {out}; expected a name that ends in .md")
    key = read_key(options.key)
    result = analyze(key, [read_answers(path, key) for path in options.analyze])
    table = survey_table(result)
    text, files = table, []
    if out is not None:
        with atomic_path(out) as temporary:
            temporary.write_text(f"# {key['title']}\n\n{table}\n", encoding="utf-8")
        with atomic_path(out.with_suffix(".json")) as temporary:
            temporary.write_text(
                json.dumps(result.as_dict() | {"survey": key["survey"]}, indent=1), encoding="utf-8"
            )
        text, files = f"{table}\n{out}", [out, out.with_suffix(".json")]
    return Answer(text=text, files=files, facts=result.as_dict())

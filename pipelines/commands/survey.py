"""``a2v survey``: make a user study, or analyse its answers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path

if TYPE_CHECKING:
    from a2v.types import Motion

HELP = "Make the papers' user studies (preference ranking, real or fake) as one web page, or turn its answers into percentages."
EXAMPLES = """examples:
  a2v survey --model humanact12 --dataset humanact12 --data ../shared/data --out survey.html
  a2v survey --model cmu --model mine.onnx --real_or_fake 0 --out survey.html          two models, no data
  a2v survey --model cmu --motions theirs=walks.npz --real_or_fake 0 --out survey.html  motions of another system
  a2v survey --analyse answers*.json --key survey.key.json --out result.md

Writes the page, which needs no server and no network, and beside it survey.key.json: keep the key from participants. Each
participant saves a file of answers at the end; --analyse counts them and writes the table, with the numbers as JSON beside it."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.evaluation.survey import SurveySettings
    from pipelines.inputs import add_model_argument

    add_model_argument(parser, several=True)
    parser.add_argument("--motions", action="append", default=[], help="NAME=FILE (.npz, .bvh): clips of another system; may be repeated")
    parser.add_argument("--dataset", type=str | None, default=None, help="data set of the real motions (a2v data)")
    parser.add_argument("--data", type=str | None, default=None, help="folder or archive that holds it")
    parser.add_argument("--action", type=str | None, default=None, help="actions to ask about, with commas; all by default")
    parser.add_argument("--frames", type=int, default=60, help="frames a clip")
    parser.add_argument("--analyse", nargs="+", default=[], help="files of answers")
    parser.add_argument("--key", type=str | None, default=None, help="the key that was written beside the page")
    parser.add_argument("--out", type=str | None, default=None, help="the .html to write; with --analyse the .md")
    parser.add_class_arguments(SurveySettings, None)


def run(settings: Any) -> int:
    """Write the page, or print the table."""
    if settings.analyse:
        return _analyse(settings)
    from a2v.evaluation.survey import SurveySettings, write_survey
    from pipelines.bar import bar

    if settings.out is None:
        raise InputError("give --out survey.html, or answers to --analyse")
    chosen = SurveySettings(**{name: settings[name] for name in SurveySettings.__dataclass_fields__})
    sources = _sources(settings, chosen.preference + chosen.real_or_fake)
    with bar("survey", "clip") as progress:
        key = write_survey(settings.out, sources, chosen, progress=progress)
    print(settings.out)
    print(key)
    return 0


def _sources(settings: Any, questions: int) -> dict[str, dict[str, list[Motion]]]:
    """Clips by source and action; clips of an action are equally long, since a length would give its source away."""
    from a2v.evaluation.survey import REAL
    from a2v.formats import read_motion
    from a2v.motion import MotionModel
    from a2v.motion.model import plain_name

    if not 2 <= settings.frames <= 1000:
        raise InputError(f"frames is {settings.frames}; expected 2 to 1000")
    models = {Path(name).stem: MotionModel.load(name) for name in settings.model}
    if len(models) < len(settings.model):
        raise InputError(f"two models have the name {', '.join(sorted({Path(name).stem for name in settings.model}))}; rename one file")
    sources: dict[str, dict[str, list[Motion]]] = {}
    actions = [name.strip() for name in settings.action.split(",")] if settings.action else None
    lengths: dict[str, int] = {}
    if settings.dataset is not None:
        sources[REAL], lengths = _real_clips(settings, questions)
        actions = actions or list(sources[REAL])
    elif settings.data is not None:
        raise InputError("give --dataset as well: which data set lies in --data?")
    if actions is None and models:
        actions = list(next(iter(models.values())).actions)
    others: dict[str, dict[str, list[Motion]]] = {}
    for entry in settings.motions:
        name, _, path = entry.partition("=")
        if not path:
            raise InputError(f"--motions is '{entry}'; expected NAME=FILE")
        motion = read_motion(path)
        clips = [motion[index] for index in np.ndindex(motion.batch)] if motion.batch else [motion]
        others.setdefault(name, {}).setdefault(motion.action, []).extend(clip.first(settings.frames) for clip in clips)
    if taken := sorted(name for name in (*models, *others) if name.lower() == REAL or not name or (name in models and name in others)):
        raise InputError(
            f"'{taken[0]}' cannot name a source of motions: '{REAL}' is kept for the recorded clips and every name stands once; "
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
            frames = lengths.get(action, settings.frames)
            batch = model.sample(action, frames=frames, count=clips_each + 1, seed=settings.seed * 1000 + place * 100 + index)
            sources[name][action] = [batch[i] for i in range(clips_each)]
    for name, own in others.items():
        known = {plain_name(action): action for action in actions}
        sources[name] = {known[plain_name(action)]: clips for action, clips in own.items() if plain_name(action) in known}
    return sources


def _real_clips(settings: Any, questions: int) -> tuple[dict[str, list[Motion]], dict[str, int]]:
    """Random real clips by action, cut to the action's median length or --frames, and that length by action."""
    from a2v.datasets import load_dataset

    if settings.data is None:
        raise InputError("give --data: the folder or archive of --dataset")
    dataset = load_dataset(settings.dataset, settings.data)
    generator = np.random.default_rng(settings.seed)
    counts = np.array([len(joints) for joints in dataset.joints])
    clips: dict[str, list[Motion]] = {}
    lengths: dict[str, int] = {}
    for label, action in enumerate(dataset.actions):
        own = np.flatnonzero(dataset.labels == label)
        if not len(own):
            continue
        lengths[action] = int(min(settings.frames, np.median(counts[own])))
        long = own[counts[own] >= lengths[action]]
        picked = generator.permutation(long)[: -(-questions // len(dataset.actions)) + 1]
        clips[action] = [dataset.motion(int(index)).first(lengths[action]) for index in picked]
    return clips, lengths


def _analyse(settings: Any) -> int:
    from a2v.evaluation.survey_answers import analyse, read_answers, read_key, survey_table

    if settings.key is None:
        raise InputError("give --key: the .key.json that was written beside the page")
    out = None if settings.out is None else Path(settings.out)
    if out is not None and out.suffix != ".md":
        raise InputError(f"cannot write {out}; expected a name that ends in .md")
    key = read_key(settings.key)
    result = analyse(key, [read_answers(path, key) for path in settings.analyse])
    table = survey_table(result)
    print(table)
    if out is not None:
        with atomic_path(out) as temporary:
            temporary.write_text(f"# {key['title']}\n\n{table}\n", encoding="utf-8")
        with atomic_path(out.with_suffix(".json")) as temporary:
            temporary.write_text(json.dumps(result.as_dict() | {"survey": key["survey"]}, indent=1), encoding="utf-8")
        print(out)
    return 0

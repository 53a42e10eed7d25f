"""``a2v evaluate``: measure motion models under the papers' protocol."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

from a2v.errors import InputError
from a2v.io import say
from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.classifier import Evaluator, load_evaluator
from a2v.lab.evaluation.protocol import (
    REAL_ALIKE,
    EvaluationSettings,
    evaluate,
)
from a2v.lab.evaluation.published import published_action_table, published_table
from a2v.lab.evaluation.scores import (
    action_table,
    markdown_table,
    physics_table,
    scores_as_dict,
)
from a2v.lab.evaluation.sources import recorded
from a2v.lab.evaluation.standing import FPS, SECONDS, StandingScore, score_standing, standing_table
from a2v.lab.evaluation.training import FILE, ClassifierSettings
from a2v.lab.evaluation.vocabulary import score_actions, vocabulary_table
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.types import Motion
from pipelines.answer import Answer
from pipelines.bar import bar
from pipelines.lab.actor_table import make_actor_table
from pipelines.lab.dataset_options import DataOptions, hold_out
from pipelines.lab.evaluated import MODELS, Evaluated, open_models
from pipelines.lab.evaluation_rows import Table, actions_content
from pipelines.lab.tables import table_path, table_result, write_numbers, write_table
from pipelines.lab.train_classifier import run_classifier
from pipelines.options import group, option, settings

HELP = (
    "Measure motion models under the papers' protocol: FID, accuracy, diversity and "
    "multimodality beside real motions."
)
EXAMPLES = """examples:
  a2v evaluate --dataset humanact12 --data ../shared/data --model humanact12 --out table.md
  a2v evaluate --dataset cmu --data ../shared/data --model cmu --model mine.onnx --repeats 5 --state zeros --out table.md
  a2v evaluate --dataset humanact12 --data ../shared/data --model runs/condgru/baseline.pt --model first-frame --out table.md
  a2v evaluate --dataset cmu --data ../shared/data --model cmu --actions Walk,Jump --out table.md     Table 4: locomotion
  a2v evaluate --dataset humanact12 --data ../shared/data --model humanact12 --protocol actor --out actor.md     beside MDM, MLD ...
  a2v evaluate --dataset cmu-fine --data ../shared/data --model cmu-fine --each-action 40 --out table.md     all 124 actions
  a2v evaluate --dataset cmu --data ../shared/data --model cmu --model cmu-fine --out table.md      fine actions as the papers' eight
  a2v evaluate --dataset humanact12 --data ../shared/data --model runs/unseen/motion.onnx --held-out P03,P10 --out table.md
  a2v evaluate --dataset bvh --data my_actions --model runs/mine/motion.onnx --out table.md
  a2v evaluate reconstruction --help                        reconstruction from photos, with its own protocol and options

Each table is made twice: once with actions as frequent as in the data, and once with equally
frequent actions, which is the protocol of the papers (--alike false makes only the first). Do not
compare rows of the two tables. Writes the tables as Markdown and, beside them, every repeat's values
with protocol, seeds and data hashes as JSON. With --state zeros the classifier is deterministic.
Rows that --out already has for the same models, data, classifier and protocol are kept, so an
interrupted run can resume and models can be added. --evaluator is a trained action classifier; by
default that of the papers' authors in DATA/evaluators, else classifier.pt in the folder of OUT. If
that does not exist, it is trained first, with the settings --classifier. --held-out adds a table
that compares with the clips of these subjects only (auto: the subjects that
`a2v train --held-out auto` leaves out). --protocol actor makes one table only, that of ACTOR's
evaluation, in which MDM, MLD and others report: every recording once, a generated clip for each
one's action. Its rows do not compare with those of the other tables."""

EVALUATORS = {
    "humanact12": "action_recognition_model_humanact12.tar",
    "humanact12-fine": "action_recognition_model_humanact12_fineG.tar",
    "cmu": "action_recognition_model_mocap_new.tar",
    "ntu_vibe": "action_recognition_model_vibe_v2.tar",
}
"""The authors' classifier of each data set."""


@dataclass(frozen=True, kw_only=True)
class Options(DataOptions):
    """Options of the command."""

    model: tuple[str, ...] = option(f"{MODELS}; may be repeated", default=(), many="repeated")
    evaluator: str | None = option(
        "file of a trained action classifier", default=None, metavar="FILE"
    )
    actions: str = option(
        "actions with a separate table each (500 clips), separated by commas", default=""
    )
    each_action: int = option(
        "number of clips per action for a table with the accuracy of each action, and the distance "
        "of its clips to the most similar recordings",
        default=0,
    )
    stand: int = option(
        "number of clips per action, made as by a2v motion, for a table of foot contact, "
        "liveliness and variety between seeds",
        default=0,
    )
    held_out: str = option(
        "also compare with the clips of these subjects only: names separated by commas, or auto",
        default="none",
    )
    out: str = option("file to write, .md; the .json is written beside it")
    alike: bool = option(
        "also write a table with equally frequent actions, as in the papers; "
        "its numbers are in .alike.json",
        default=True,
    )
    protocol: str = option(
        "evaluation: of the papers, or of ACTOR (Petrovich et al. 2021) and later methods",
        default="papers",
        choices=("papers", "actor"),
    )
    measuring: EvaluationSettings = group(EvaluationSettings)
    classifier: ClassifierSettings = settings(ClassifierSettings)


def find_evaluator(options: Options, dataset: ActionDataset) -> Evaluator:
    """Return the classifier: the given file, else the authors', else that of the output folder.

    The last one is trained if it does not exist.

    Raises
    ------
    InputError
        The given one is missing or was trained for other actions.
    """
    name = EVALUATORS.get(options.dataset)
    published = None if name is None else Path(options.data) / "evaluators" / name
    if options.evaluator is not None:
        found = load_evaluator(options.evaluator)
    elif published is not None and published.is_file():
        found = load_evaluator(published)
    else:
        folder = Path(options.out).parent
        lacking = (
            f"no classifier of the authors at {published}"
            if published
            else f"the authors published no classifier for {dataset.name}"
        )
        say(f"{lacking}; taking ours, {folder / FILE}")
        training, unseen = hold_out(
            dataset, "auto" if options.held_out == "none" else options.held_out
        )
        found = run_classifier(training, unseen, folder, options.classifier)
    found.demand_actions(dataset)
    return found


def run(options: Options) -> Answer:
    """Measure the models and write the tables.

    Raises
    ------
    InputError
        An option does not go with the protocol.
    """
    _demand_protocol(options)
    out, protocol = table_path(options.out), options.measuring
    dataset = options.open()
    training, unseen = hold_out(dataset, options.held_out)
    opened = open_models(options.model, dataset, options.data)
    evaluator = find_evaluator(options, dataset)
    if options.protocol == "actor":
        return make_actor_table(out, protocol, dataset, evaluator, opened)
    table = Table(out, dataset, evaluator, protocol, opened)
    scores = table.measure()
    text = [
        f"# {dataset.name}",
        f"Protocol: {protocol.name}; classifier {evaluator.source}.",
        markdown_table(scores),
    ]
    if physics := physics_table(scores):
        text += [
            (
                f"Physical plausibility of {min(protocol.physics_clips, protocol.clips)} "
                "clips (real motions are not at zero either):"
            ),
            physics,
        ]
    content = table.content(scores)
    if options.alike and protocol.labels == "data":
        text += _alike(
            Table(
                out.with_suffix(".alike.md"),
                dataset,
                evaluator,
                replace(protocol, labels="uniform", physics_clips=0),
                opened,
            )
        )
    parts = (
        _single_actions(options, table, content),
        _each_action(options, table),
        _stands(options, dataset),
        _against_unseen(training, unseen, evaluator, opened, protocol),
    )
    for part in parts:
        text += part.text
        content |= part.numbers
    return table_result(out, write_table(out, text, content), content)


def _demand_protocol(options: Options) -> None:
    """Refuse what ACTOR's protocol does not have, and its labels without it."""
    if options.protocol == "papers":
        if options.measuring.labels == "each":
            raise InputError("labels is each; that is ACTOR's protocol: give --protocol actor")
        return
    others = {
        "--actions": options.actions,
        "--each-action": options.each_action,
        "--stand": options.stand,
        "--held-out": options.held_out not in ("none", ""),
        "--labels": options.measuring.labels == "uniform",
    }
    if given := [name for name, value in others.items() if value]:
        raise InputError(
            f"{given[0]} does not go with --protocol actor, which makes one table; make the other "
            "one without --protocol"
        )


class _Part(NamedTuple):
    """A section of the page, and its numbers."""

    text: list[str]
    numbers: Mapping[str, object]


_NOTHING = _Part([], {})


def _single_actions(options: Options, table: Table, content: Mapping[str, object]) -> _Part:
    """Measure single actions, as Table 4 of the journal paper.

    `content` has the numbers of the page so far.
    """
    if not options.actions:
        return _NOTHING
    alone = replace(options.measuring, clips=min(500, options.measuring.clips), physics_clips=0)
    actions = [name.strip() for name in options.actions.split(",")]
    tables = table.measure_actions(actions, alone, content)
    text = [
        (
            f"Single actions, {alone.clips} clips each (Table 4 of the journal paper is "
            "this for CMU's Walk and Jump):"
        ),
        action_table(tables),
    ]
    if published := published_action_table(table.dataset.name, tables):
        text += ["As published (Table 4):", published]
    return _Part(text, actions_content(alone, tables))


def _each_action(options: Options, table: Table) -> _Part:
    """Measure how well each action is recognized, and how closely clips repeat the training."""
    if not options.each_action:
        return _NOTHING
    text, measured = [], {}
    for name, generate in table.models.items():
        with bar(name, "action") as progress:
            rows = score_actions(
                generate,
                table.dataset,
                table.evaluator,
                clips=options.each_action,
                seed=options.measuring.seed,
                progress=progress,
            )
        text += [
            f"Every action of {name}, {options.each_action} clips each (zero classifier state):",
            vocabulary_table(rows),
        ]
        measured[name] = [asdict(row) for row in rows]
    return _Part(text, {"vocabulary": {"clips": options.each_action, "scores": measured}})


def _stands(options: Options, dataset: ActionDataset) -> _Part:
    """Measure the foot contact in clips of each exported model."""
    if not options.stand:
        return _NOTHING
    text, rows_of = [], _standing(options, dataset)
    for name, scored in rows_of.items():
        text += [
            f"Every action of {name} as a2v motion makes it, {options.stand} seeds, five seconds:",
            standing_table(scored),
        ]
    scores = {name: [asdict(row) for row in scored] for name, scored in rows_of.items()}
    return _Part(text, {"standing": {"clips": options.stand, "scores": scores}})


def _against_unseen(
    training: ActionDataset,
    unseen: ActionDataset | None,
    evaluator: Evaluator,
    opened: Mapping[str, Evaluated],
    protocol: EvaluationSettings,
) -> _Part:
    """Make the table against the clips of the held-out people only."""
    if unseen is None:
        return _NOTHING
    models = {name: model.generate for name, model in opened.items()}
    with bar("held out", "set") as progress:
        against = evaluate(
            {"Training clips": recorded(training), **models},
            unseen,
            evaluator,
            protocol,
            progress=progress,
        )
    numbers = {
        "subjects": sorted(set(unseen.subjects)),
        "clips": len(unseen),
        "sha256": unseen.sha256,
        "training_sha256": training.sha256,
        "scores": scores_as_dict(against),
    }
    text = [_describe_split(training, unseen, evaluator, opened), markdown_table(against)]
    return _Part(text, {"held_out": numbers})


def _standing(options: Options, dataset: ActionDataset) -> dict[str, list[StandingScore]]:
    """Measure clips of exported models for the data set's own actions, by the models' names."""
    found = {}
    for name in options.model:
        if (
            Path(name).suffix == ".pt"
            or (model := MotionModel.load(name)).actions != dataset.actions
        ):
            continue

        def make(action: str, seed: int, model: MotionModel = model) -> Motion:
            return make_motion(
                model, [Step(action=action)], Take(frames=round(SECONDS * FPS), fps=FPS, seed=seed)
            )

        with bar(name, "action") as progress:
            found[name] = score_standing(
                make, dataset, clips=options.stand, seconds=SECONDS, progress=progress
            )
    return found


def _alike(table: Table) -> list[str]:
    """Make the table with equally frequent actions: models, recordings and the papers' figures."""
    scores = table.measure()
    write_numbers(table.out, table.content(scores))
    published = published_table(table.dataset.name)
    return [
        "Actions drawn uniformly, as in the published evaluation, which keeps the real "
        f"clips' frequencies: '{REAL_ALIKE}' is the score of recordings here, not a lower "
        "limit. Do not compare rows of this table with the table above.",
        markdown_table(scores),
        *(
            ["As published, in this protocol (CondGRU: actions as in the data):", published]
            if published
            else []
        ),
    ]


def _describe_split(
    training: ActionDataset,
    unseen: ActionDataset,
    evaluator: Evaluator,
    models: Mapping[str, Evaluated],
) -> str:
    """Describe the split, and which models and classifiers were trained on the held-out people."""
    people = sorted(set(unseen.subjects))
    blind = [name for name, model in models.items() if model.trained_on == training.sha256]
    seen = [name for name in models if name not in blind]
    lines = [
        f"Against the {len(unseen)} clips of {', '.join(people)} alone "
        f"({len(training)} clips are of others). Actions and bone lengths of generated "
        "clips are the held-out people's; 'Training clips' are recordings of the others "
        "with the same actions: the score of a perfect model."
    ]
    if blind:
        lines.append(f"Trained without these people: {', '.join(blind)}.")
    if seen:
        lines.append(f"Trained on other data, these people possibly included: {', '.join(seen)}.")
    unaware = evaluator.info.get("dataset_digest") == training.sha256
    lines.append(f"The classifier was trained {'without' if unaware else 'with'} them.")
    return " ".join(lines)

# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Evaluation
#
# How good generated motions are: by the papers' measures (an action classifier and its features), by physics, and by asking people.
# With the papers' data (`A2V_DATA`, else `../../shared/data`) the authors' classifier and recorded clips are used; without it, a
# classifier is trained here on clips of the shipped model, which shows the parts but measures nothing about people.

# %%
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Markdown, display

from a2v.lab.datasets import load_dataset
from a2v.lab.datasets.generated import generated_dataset
from a2v.lab.evaluation.classifier import load_evaluator
from a2v.lab.evaluation.metrics import fid
from a2v.lab.evaluation.protocol import EvaluationSettings, evaluate, generator_of, markdown_table, recorded
from a2v.lab.evaluation.survey import REAL, SurveySettings, write_survey
from a2v.lab.evaluation.survey_answers import analyse, read_answers, read_key, survey_table, wilson_interval
from a2v.lab.evaluation.training import ClassifierSettings, train_classifier
from a2v.motion import MotionModel
from a2v.rendering.stickfigure import StickSettings, plot_rows

SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
DATA = Path(os.environ.get("A2V_DATA", "../../shared/data"))
folder = Path(tempfile.mkdtemp(prefix="a2v-evaluation-"))
model = MotionModel.load("humanact12")
if DATA.is_dir():
    data = load_dataset("humanact12", DATA)
    evaluator = load_evaluator(DATA / "evaluators" / "action_recognition_model_humanact12.tar")
else:
    data = generated_dataset(model, clips=6 if SMALL else 40)
    evaluator = train_classifier(data, folder / "classifier", settings=ClassifierSettings(iterations=20 if SMALL else 300, threads=1))
print(f"{data.name}, {len(data)} clips; classifier {evaluator.source}")

# %% [markdown]
# ## The classifier
# A GRU with a feature of 30 numbers. It recognises recorded clips; its features of one action lie together. The published classifier
# starts from a random state, which alone moves the features; zeros make it deterministic.

# %%
generate = recorded(data)
signs = np.asarray(data.frame.signs, np.float32)
generator = np.random.default_rng(0)
clips = generator.integers(0, len(data), 100 if SMALL else 600)
real = generate(data.labels[clips], data.clip_bone_lengths[clips], generator)
features, predicted = evaluator(real)
noisy, _ = evaluator(real, state="random", generator=generator)
print(f"recorded clips recognised: {(predicted == data.labels[clips]).mean():.1%}")
print(
    f"a random first state moves features by {np.linalg.norm(noisy - features, axis=1).mean():.2f} of {np.linalg.norm(features, axis=1).mean():.2f}"
)
centred = features - features.mean(0)
plane = centred @ np.linalg.svd(centred, full_matrices=False)[2][:2].T
plt.figure(figsize=(6, 4))
plt.scatter(*plane.T, c=data.labels[clips], cmap="tab20", s=8)
plt.gca().set(title="features of recorded clips, a colour an action")

# %% [markdown]
# ## FID, accuracy, diversity, multimodality
# `evaluate` runs the papers' protocol on any number of models beside recorded motions. Here at a small size (the papers: 3,000 clips, 20
# repeats; `a2v evaluate` does that). Two bad models show what the measures see: recorded motions shaken, and a single pose.


# %%
def shaken(labels, lengths, generator):
    motions = generate(labels, lengths, generator)
    return motions + generator.normal(0, 0.03, motions.shape).astype(np.float32)


def frozen(labels, lengths, generator):
    return np.repeat(generate(labels, lengths, generator)[:, :1], data.length, axis=1)


protocol = EvaluationSettings(clips=60 if SMALL else 800, repeats=1 if SMALL else 3, physics_clips=20 if SMALL else 100)
models = {"shipped model": generator_of(model, data.length), "recorded, shaken by 3 cm": shaken, "recorded, frozen": frozen}
scores = evaluate(models, data, evaluator, protocol)
display(Markdown(markdown_table(scores)))
print(protocol.name)

# %% [markdown]
# FID needs many clips: the same recorded motions against each other seem worse, the fewer they are.

# %%
sizes = [40, 80] if SMALL else [50, 100, 200, 400, 800, 1600]
values = []
for size in sizes:
    pair = []
    for _ in range(2):
        chosen = generator.integers(0, len(data), size)
        pair.append(evaluator(generate(data.labels[chosen], data.clip_bone_lengths[chosen], generator))[0])
    values.append(fid(*pair))
plt.figure(figsize=(5, 2.8))
plt.loglog(sizes, values, "o-")
plt.gca().set(xlabel="clips", ylabel="FID", title="recorded motions against recorded motions")
# %% [markdown]
# ## Which actions are recognised
# Rows: what was asked for; columns: what the classifier saw.

# %%
each = 10 if SMALL else 40
labels = np.repeat(np.arange(len(data.actions)), each)
own = np.array([generator.choice(np.flatnonzero(data.labels == label)) for label in labels])
_, seen = evaluator(generator_of(model, data.length)(labels, data.clip_bone_lengths[own], generator))
confusion = np.zeros((len(data.actions),) * 2)
np.add.at(confusion, (labels, seen), 1 / each)
figure, ax = plt.subplots(figsize=(6, 5))
image = ax.imshow(confusion, vmin=0, vmax=1, cmap="Blues")
ax.set_xticks(range(len(data.actions)), data.actions, rotation=90, fontsize=7)
ax.set_yticks(range(len(data.actions)), data.actions, fontsize=7)
figure.colorbar(image)
figure.tight_layout()

# %% [markdown]
# ## Physics
# Do feet slide, do they sink, does the motion jitter? Always beside recorded motions, for which these are never zero.

# %%
from a2v.lab.evaluation.protocol import physics_table

display(Markdown(physics_table(scores)))

# %% [markdown]
# ## Asking people
# `a2v survey` writes one web page with the papers' two studies: ranking motions of several sources, and telling real from made. Sources and
# order are hidden; answers are saved as JSON by each participant and counted with the key that lies beside the page.

# %%
actions = data.actions[1:4]
sources = {REAL: {}, "shipped model": {}}
for label, action in enumerate(actions, start=1):
    long_enough = [i for i in np.flatnonzero(data.labels == label) if len(data.joints[i]) >= 40][:3]
    sources[REAL][action] = [data.motion(int(i)) for i in long_enough]
    sources["shipped model"][action] = [model.sample(action, frames=40, seed=seed) for seed in range(3)]
display(
    plot_rows(
        [own[action][0] for action in actions for own in sources.values()],
        titles=[f"{action}, {name}" for action in actions for name in sources],
        poses=6,
        settings=StickSettings(size=120),
    )
)
key_path = write_survey(
    folder / "survey.html", sources, SurveySettings(preference=2 if SMALL else 6, real_or_fake=2 if SMALL else 6, size=64 if SMALL else 160)
)
print(f"survey.html: {(folder / 'survey.html').stat().st_size / 1e6:.1f} MB")

# %% [markdown]
# What the analysis gives, on made-up answers of participants who toss coins: every interval should hold the half.

# %%
import json

key = read_key(key_path)
answers = []
for person in range(12):
    given = []
    for question in key["questions"]:
        value = (
            {"ranking": list(generator.permutation(question["clips"]))}
            if question["kind"] == "preference"
            else {"real": bool(generator.integers(2))}
        )
        given.append({"question": question["id"], **value})
    path = folder / f"answers-{person}.json"
    path.write_text(json.dumps({"format": "a2v-survey-answers/1", "survey": key["survey"], "participant": f"p{person}", "answers": given}))
    answers.append(read_answers(path, key))
display(Markdown(survey_table(analyse(key, answers))))
print("54.4 % of 200 answers, the papers' kind of figure:", " to ".join(f"{share:.1%}" for share in wilson_interval(109, 200)))

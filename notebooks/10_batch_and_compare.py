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
# # Many videos, and several methods beside each other
#
# A table of jobs makes thousands of videos and repeats nothing. A comparison makes the *same* video
# by several methods and asks people which is better: the papers' Tables 5 and 6.

# %%
import base64
import contextlib
import io
import json
import os
import re
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import PIL.Image
from IPython.display import Markdown, display

from a2v.lab.evaluation.survey_answers import (
    analyze,
    read_answers,
    read_key,
    survey_table,
    wilson_interval,
)
from pipelines.cli import main

SMALL = bool(os.environ.get("A2V_SMALL"))  # the tests run this notebook at a small size
SIZE, FRAMES = (64, 3) if SMALL else (80, 3)
PHOTO = Path("../a2v/samples/person.jpg").resolve()
folder = Path(tempfile.mkdtemp(prefix="a2v-many-"))


def a2v(*words):
    """Run a command of a2v in this process; what it says on standard error."""
    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        code = main([str(word) for word in words])
    assert code == 0, said.getvalue()[-2000:]
    return said.getvalue()


# %% [markdown]
# ## A table of jobs
# Each row is one video, each column an option of `a2v video`. A node of the graph is remembered by
# the content of all that it depends on:
#
# $$\text{key}(n) = \mathrm{hash}\big(\text{code of } n,\; \text{key}(m_1), \dots,
# \text{key}(m_k)\big)$$
#
# where $m_1, \dots, m_k$ are its inputs. So two jobs with the same photo share the person, and a
# row that failed or was stopped is all that a second run computes.

# %%
table = folder / "jobs.csv"
table.write_text(
    "name,photo,action,seed,frames\n"
    + "".join(f"walk-{seed},{PHOTO},Walk,{seed},{FRAMES}\n" for seed in range(2))
)
# all of this makes the person quick and coarse: a surface without networks, colors of vertices
# instead of a texture... Leave it out for the defaults
quick = (
    "--backend", "body-prior", "--character", "fused", "--fit.rounds", 2,
    "--shape.resolution", 200, "--shape.vertices", 25000, "--hands.replace", "false",
    "--face.expressions", "false", "--color.texture", 0, "--color.synthesis", "false",
    "--color.delight", "false", "--size", SIZE, "--spp", 1, "--executor", "serial",
    *(("--fit.starts", 0, "--fit.steps", 20) if SMALL else ()),
)  # fmt: skip
options = ("--out", folder / "batch", *quick, "--views", "front")
known = {}
for run in ("first", "second"):
    a2v("batch", table, *options)
    films = {path: path.stat().st_mtime_ns for path in (folder / "batch").rglob("front.mp4")}
    new = [path for path, changed in films.items() if known.get(path) != changed]
    print(f"{run} run: {len(new)} of {len(films)} films are new")
    known = films
print(sorted(path.relative_to(folder).as_posix() for path in known))

# %% [markdown]
# ## The same video by several methods
# `a2v compare` makes one page with every method's films, and below them the same frames of all. Two
# methods here do without parts of the pipeline: `warp` moves the photo's pixels with the body in
# two dimensions, and `mirror` paints the front on the back. All three start from the body here,
# without surface networks. Add `pifu` to `METHODS` for the default's surface; `papers` takes your
# own checkpoints of PIFu and PIFuHD.

# %%
METHODS = ("body-prior", "warp", "mirror")
told = a2v(
    "compare", "--photo", PHOTO, "--action", "Walk", "--methods", ",".join(METHODS),
    *quick, "--frames", FRAMES, "--views", "front,back", "--shown", 3,
    "--survey", folder / "survey.html", "--out", folder / "sheet.html",
)  # fmt: skip
print("\n".join(line for line in told.splitlines() if line.startswith("method")))
page = (folder / "sheet.html").read_text()
pictures = [
    PIL.Image.open(io.BytesIO(base64.b64decode(data)))
    for data in re.findall(r'<img src="data:image/jpeg;base64,([^"]+)"', page)
]
columns = len(pictures) // (2 * len(METHODS))
figure, axes = plt.subplots(len(METHODS), 2 * columns, figsize=(1.5 * 2 * columns, 4.6))
for index, picture in enumerate(pictures):
    view, rest = divmod(index, columns * len(METHODS))
    row, column = divmod(rest, columns)
    ax = axes[row, view * columns + column]
    ax.imshow(picture)
    ax.axis("off")
    if not column:
        ax.set_title(f"{METHODS[row]}, {('front', 'back')[view]}", fontsize=8)

# %% [markdown]
# ## Asking people, and how sure the answer is
# The survey shows the films without names, in random order. Of $n$ answers, $k$ prefer one method.
# The share $\hat p = k/n$ has Wilson's interval (95 %: $z = 1.96$), which stays within 0 and 1 and
# works for few answers:
#
# $$\frac{\hat p + \frac{z^2}{2n} \pm z\sqrt{\frac{\hat p(1-\hat p)}{n} + \frac{z^2}{4n^2}}}
# {1 + \frac{z^2}{n}}$$
#
# How many answers does a preference of 54.4 % need, the journal's Table 3, to be more than chance?

# %%
SHARE = 0.544
numbers = np.unique(np.geomspace(10, 5000, 60).astype(int))
bounds = np.array([wilson_interval(round(SHARE * n), int(n)) for n in numbers])
plt.figure(figsize=(6, 2.6))
plt.fill_between(numbers, *bounds.T, alpha=0.3)
plt.axhline(SHARE, lw=1)
plt.axhline(0.5, c="k", ls=":")
plt.xscale("log")
plt.gca().set(xlabel="answers", ylabel="share", title="95 % interval of a share of 54.4 %")
enough = numbers[bounds[:, 0] > 0.5]
print(f"from about {enough[0] if len(enough) else 'more than 5000'} answers on")

# %% [markdown]
# Invented answers of 20 people who toss coins show what the analysis writes. The journal's
# second table of this kind is by action (Fig. 11); here the views take the place of actions.

# %%
key = read_key(folder / "survey.key.json")
toss = np.random.default_rng(0)
answers = []
for person in range(20):
    given = [
        {
            "question": question["id"],
            "ranking": [str(x) for x in toss.permutation(question["clips"])],
        }
        for question in key["questions"]
    ]
    content = {
        "format": "a2v-survey-answers/1",
        "survey": key["survey"],
        "participant": f"p{person}",
        "answers": given,
    }
    path = folder / f"answers-{person}.json"
    path.write_text(json.dumps(content))
    answers.append(read_answers(path, key))
display(Markdown(survey_table(analyze(key, answers))))

# %% [markdown]
# **Exercise 1.** Change one `seed` in the table and run the batch again. What is computed?
# **Exercise 2.** The intervals treat all answers as independent. Why are they too narrow if 20
# people give 36 answers each?
#
# *Answers.* 1: the motion of that row, its vertices, frames and films; the person is remembered. 2:
# answers of one person are alike, since that person may look at feet or at faces only. In the
# extreme, 20 people who always answer the same way are 20 answers, not 720.

"""Numbers on the pages of the motion models are those of the values beside them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from a2v.lab.evaluation.metrics import confidence_interval
from a2v.lab.evaluation.published import PUBLISHED, PUBLISHED_ACTOR
from a2v.lab.evaluation.scores import METRICS

DOCS = Path(__file__).resolve().parents[1] / "docs"
VAES = ("plain", "lie", "glmi-m", "glmi-r")
SETS = ("humanact12", "humanact12-fine", "cmu")

Table = dict[str, list[str]]


def tables(page: str) -> list[Table]:
    """The tables of a page: the other cells of each row by its first."""
    found: list[Table] = []
    before = ""
    for line in (DOCS / page).read_text(encoding="utf-8").splitlines():
        if line.startswith("|"):
            if not before.startswith("|"):
                found.append({})
            name, *others = (cell.strip() for cell in line.strip("|").split("|"))
            found[-1][name] = others
        before = line
    return found


def the_table(page: str, row: str, columns: int, number: int = 0) -> Table:
    """The `number`-th table with this row and so many columns of values."""
    return [own for own in tables(page) if len(own.get(row, ())) == columns][number]


def measured(name: str) -> dict[str, list[str]]:
    """Mean and interval of each metric as text, by row of a file of values."""
    text = (DOCS / "results" / f"{name}.json").read_text(encoding="utf-8")
    return {
        row: ["{:.3f} ± {:.3f}".format(*confidence_interval(values[m])) for m in METRICS]
        for row, values in json.loads(text)["scores"].items()
    }


def measured_at_one(name: str) -> dict[str, list[str]]:
    """`measured` at temperature 1: without the rows at temperatures of the files."""
    return {row: own for row, own in measured(name).items() if " at its " not in row}


@pytest.mark.parametrize(("number", "values"), [(0, "motion_cmu"), (1, "motion_cmu.alike")])
def test_cmus_tables_have_the_measured_values(number: int, values: str) -> None:
    table = the_table("results/motion_cmu.md", "Real motions", 4, number)
    scores = measured(values)
    assert len(scores) >= 2 * len(VAES) + 2  # at temperature 1, and at that of the file
    assert {name: table.get(name) for name in scores} == scores


PAGES = {
    "motion_humanact12": ("motion_humanact12", "motion_humanact12.alike"),
    "motion_humanact12_fine": ("motion_humanact12_fine_vaes", "motion_humanact12_fine_vaes.alike"),
    "motion_cmu_fine": ("motion_cmu_fine", "motion_cmu_fine.alike"),
    "motion_humanact12_held_out": ("motion_humanact12_held_out",),
    "baselines": tuple(
        f"baselines_{name.replace('-', '_')}{e}" for name in SETS for e in ("", ".alike")
    ),
}
"""Files of values by the page whose tables show them."""


@pytest.mark.parametrize(
    ("page", "values"), [(page, name) for page, names in PAGES.items() for name in names]
)
def test_pages_have_the_measured_values(page: str, values: str) -> None:
    shown = {
        (name.removesuffix(", trained here").casefold().replace(" ", "-"), *cells[:4])
        for own in tables(f"results/{page}.md")
        for name, cells in own.items()
    }
    for name, own in measured(values).items():
        if not (page == "motion_humanact12_fine" and name == "Real motions"):  # the flow's draw
            row = name.removesuffix(" (baseline.pt)").casefold().replace(" ", "-")
            assert (row.replace("latent-transition", "latenttransition"), *own) in shown, name


@pytest.mark.parametrize(("column", "values"), [(0, "motion_humanact12"), (2, "motion_cmu")])
def test_the_overview_has_the_same_values(column: int, values: str) -> None:
    table = the_table("motion_models.md", "our flow", 3)
    scores = {name.split(" ")[0]: own for name, own in measured_at_one(values).items()}
    names = {"our flow": "flow", "real": "Real"} | {vae: vae for vae in VAES}
    for row, name in names.items():
        assert table[row][column] == " / ".join(scores[name][:2]), row


@pytest.mark.parametrize("values", ["motion_humanact12", "motion_cmu"])
def test_the_page_of_the_weights_has_the_same_values(values: str) -> None:
    table = the_table("../a2v/weights/README.md", "`cmu`", 5)
    for name, own in measured_at_one(values).items():
        if name != "Real motions":
            weights = name.split("(")[-1].rstrip(")")
            assert table[f"`{weights}`"][:2] == own[:2], name


@pytest.mark.parametrize("values", ["motion_humanact12", "motion_cmu"])
def test_text_names_the_best_decoder_with_its_value(values: str) -> None:
    own = {name.split(" ")[0]: row for name, row in measured_at_one(values).items()}
    best = min(VAES, key=lambda vae: float(own[vae][0].split(" ")[0]))
    fid, accuracy = (cell.split(" ")[0].removeprefix("0") for cell in own[best][:2])
    assert f"{fid} and {accuracy}" in (DOCS / "method.md").read_text(encoding="utf-8")
    research = (DOCS / "research" / "motion-vae.md").read_text(encoding="utf-8")
    assert f"{fid} on " in research


@pytest.mark.parametrize(("column", "dataset"), list(enumerate(SETS)))
def test_the_overview_has_the_published_values(column: int, dataset: str) -> None:
    table = the_table("motion_models.md", "plain", 3, 1)
    for vae in VAES:
        fid, accuracy = map(float, table[vae][column].split(" / "))
        assert abs(fid - PUBLISHED[dataset][vae][0]) <= 0.0051, vae
        assert abs(accuracy - PUBLISHED[dataset][vae][1]) < 1e-9, vae


@pytest.mark.parametrize("dataset", SETS)
def test_baselines_have_the_published_values_in_their_protocol(dataset: str) -> None:
    page, at = "results/baselines.md", 2 * SETS.index(dataset)
    alike, as_in_the_data = (
        the_table(page, "CondGRU, trained here", 4, number) for number in (at, at + 1)
    )
    ending = ", as published"
    for table, expected in ((alike, 4), (as_in_the_data, 1)):
        rows = [row for row in table if row.endswith(ending)]
        assert len(rows) == expected
        assert all(
            [float(cell) for cell in table[row]] == list(PUBLISHED[dataset][row[: -len(ending)]])
            for row in rows
        )
    assert f"CondGRU{ending}" in as_in_the_data


def test_actors_table_has_the_measured_and_the_published_values() -> None:
    page = "results/motion_humanact12_actor.md"
    ours = the_table(page, "Real motions", 4)
    scores = measured("motion_humanact12_actor")
    assert len(scores) == len(VAES) + 2
    assert {name: [cell.split(" (")[0] for cell in ours[name]] for name in scores} == scores
    theirs = the_table(page, "ACTOR", 2)
    for name, values in PUBLISHED_ACTOR["humanact12"].items():
        assert tuple(map(float, theirs[name])) == values, name
    assert not set(theirs) & set(scores)
    text = (DOCS / page).read_text(encoding="utf-8")
    part = measured("motion_humanact12_actor_1000")["flow (humanact12)"]
    assert f"{part[0].lstrip('0').replace('± 0', '± ')} / {part[1][1:5]} and Lie" in text

"""The page of the papers is complete; test_docs tests its commands and names."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "papers.md").read_text(encoding="utf-8")


def section(heading: str) -> str:
    return PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]


def numbers(cell: str) -> set[int]:
    return {int(number) for number in re.findall(r"\d+", cell)}


def test_every_equation_table_and_figure_has_its_row():
    first = {
        name: [line.split("|")[1] for line in section(name).splitlines() if line.startswith("|")]
        for name in ("Equations", "Tables", "Figures")
    }
    assert set().union(*map(numbers, first["Equations"])) == set(range(1, 23))
    for name, journal, conference in (("Tables", 6, 5), ("Figures", 24, 9)):
        found = {"journal": set(), "conference": set()}
        for cell in first[name]:
            for paper, listed in re.findall(r"(journal|conference) ([\d, ]+)", cell):
                found[paper] |= numbers(listed)
        assert found == {
            "journal": set(range(1, journal + 1)),
            "conference": set(range(1, conference + 1)),
        }, name


def test_every_system_is_named():
    for system in [
        "CondGRU",
        "Two-stage",
        "Act-MoCoGAN",
        "Dancing2Music",
        "LatentTransition",
        "plain",
        "Lie",
        "GLMI-M",
        "GLMI-R",
        "PIFu",
        "PIFuHD",
        "PaMIR",
        "ARCH",
        "Weng",
        "Kim",
        "Liquid",
        "Unity3D",
        "OpenPose",
    ]:
        assert system in PAGE, system

"""One photo and motion by every method, small: the page and its user study."""

from __future__ import annotations

import contextlib
import io
import json
import re
from pathlib import Path

import pytest

from a2v.body import load_body_model
from a2v.lab.evaluation.survey_answers import analyze, read_key
from pipelines.cli import main
from tests.support.checkpoints import liquid_warping, saved, slab
from tests.support.whole_run import whole_run

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"
METHODS = ("pifu", "body-prior", "papers", "warp", "liquid", "mirror")
FRAMES, VIEWS = 2, ("front", "back")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    faces = load_body_model("anny").faces
    corners = int(faces.max()) + 1
    lines = [f"vt {index / corners} {index % 100 / 100}" for index in range(corners)]
    lines += [
        "f " + " ".join(f"{corner + 1}/{corner + 1}/1" for corner in face)
        for face in faces.tolist()
    ]
    (folder / "mapper.txt").write_text("\n".join(lines))
    given = {
        "--photo": SAMPLE,
        "--action": "Walk",
        "--methods": ",".join(METHODS),
        "--frames": FRAMES,
        "--views": ",".join(VIEWS),
        "--size": 64,
        "--spp": 1,
        "--shown": 2,
        "--pifu-geometry": saved(slab(0.12, -0.08, 0.5), folder / "net_G"),
        "--executor": "serial",
        "--shape.resolution": 200,
        "--shape.vertices": 25_000,
        "--liquid-generator": saved(liquid_warping(), folder / "net_epoch_30_id_G.pth"),
        "--liquid-uv": folder / "mapper.txt",
        "--cache": whole_run().store,
        "--color.texture": 512,
        "--color.synthesis": "false",
        "--color.delight": "false",
        "--color.tolerance": 0.1,
        "--survey": folder / "survey.html",
        "--out": folder / "sheet.html",
    }
    words = [str(word) for pair in given.items() for word in pair]
    out, told = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(told):
        code = main(["compare", *words])
    assert code == 0, told.getvalue()
    return folder, out.getvalue(), told.getvalue()


@pytest.mark.slow
def test_the_page_has_every_methods_videos_and_the_same_frames(made):
    folder, _, told = made
    for number, method in enumerate(METHODS, 1):
        assert f"method {number} of {len(METHODS)}: {method}\n" in told
    page = (folder / "sheet.html").read_text()
    assert re.findall("<th class=m>(.*?)</th>", page) == list(METHODS) * (1 + len(VIEWS))
    films = re.findall('<video[^>]*src="(.*?)"', page)
    pictures = re.findall('<img src="(.*?)"', page)
    assert len(films) == len(set(films)) == len(METHODS) * len(VIEWS)
    assert len(pictures) == len(set(pictures)) == len(METHODS) * len(VIEWS) * FRAMES
    assert "http" not in page


@pytest.mark.slow
def test_the_study_shows_the_same_videos_and_its_answers_are_counted(made):
    folder, out, _ = made
    assert out.splitlines()[-2:] == [
        str(folder / "survey.html"),
        str(folder / "survey.key.json"),
    ]
    key = read_key(folder / "survey.key.json")
    assert sorted(clip["source"] for clip in key["clips"].values()) == sorted(METHODS * len(VIEWS))
    study, page = (folder / "survey.html").read_text(), (folder / "sheet.html").read_text()
    for film in re.findall('<video[^>]*src="data:video/mp4;base64,(.*?)"', page):
        assert film in study
    best = {
        name: sorted(
            question["clips"], key=lambda clip: METHODS.index(key["clips"][clip]["source"])
        )
        for name, question in ((question["id"], question) for question in key["questions"])
    }
    answers = [{"question": name, "ranking": ranking} for name, ranking in best.items()]
    told = {
        "format": "a2v-survey-answers/1",
        "survey": key["survey"],
        "participant": "p1",
        "answers": answers,
    }
    counted = analyze(key, [told])
    assert counted.ranks["pifu"][0] == counted.ranks["mirror"][-1] == len(VIEWS)
    (folder / "answers.json").write_text(json.dumps(told))
    words = [
        "survey",
        "--analyze",
        folder / "answers.json",
        "--key",
        folder / "survey.key.json",
        "--out",
        folder / "result.md",
    ]
    assert main([str(word) for word in words]) == 0
    assert "liquid" in (folder / "result.md").read_text()


def test_liquid_warping_needs_its_files(tmp_path, capsys):
    assert (
        main(
            [
                "compare",
                "--photo",
                str(SAMPLE),
                "--action",
                "Walk",
                "--methods",
                "liquid",
                "--out",
                str(tmp_path / "a.html"),
            ]
        )
        == 2
    )
    assert "--liquid-generator FILE, --liquid-uv FILE" in capsys.readouterr().err

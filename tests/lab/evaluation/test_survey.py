"""User studies: what the page shows and hides, answers of a real browser, and counted results."""

from __future__ import annotations

import base64
import html
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import pytest

from a2v.errors import InputError
from a2v.lab.evaluation.survey import REAL, SurveySettings, plan_survey, write_survey
from a2v.lab.evaluation.survey_answers import analyze, read_answers, read_key
from pipelines.cli import main
from tests.support.motions import person

CHROMIUM = next(
    (
        path
        for name in ("chromium", "chromium-browser", "google-chrome")
        if (path := shutil.which(name))
    ),
    None,
)


def sources(names=(REAL, "ours", "theirs"), actions=("walk", "jump"), clips=2):
    made = {}
    for i, name in enumerate(names):
        made[name] = {
            action: [person(frames=4 + j, step=0.05 * (i + 1)) for j in range(clips)]
            for action in actions
        }
    return made


SETTINGS = SurveySettings(preference=3, real_or_fake=4, size=64, title="A <study> & more")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "page.html"
    key_path = write_survey(path, sources(), SETTINGS)
    return path, key_path, read_key(key_path)


class Page(HTMLParser):
    """Return what is in the page: its data, and every address it names."""

    def __init__(self, text):
        super().__init__()
        self.data, self.addresses, self.title, self._inside = "", [], "", ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self._inside = "data" if attributes.get("id") == "survey" else tag
        self.addresses += [value for name, value in attrs if name in ("src", "href", "action")]

    def handle_endtag(self, tag):
        self._inside = ""

    def handle_data(self, data):
        if self._inside == "data":
            self.data += data
        if self._inside == "title":
            self.title += data


def test_the_plan_is_balanced_and_shuffled():
    survey = plan_survey(sources(), SurveySettings(preference=40, real_or_fake=40, seed=3))
    ranked = [question for question in survey.questions if question["kind"] == "preference"]
    assert len(ranked) == 40
    assert {question["action"] for question in ranked} == {"walk", "jump"}
    assert all(
        sorted(survey.sources[name] for name in question["clips"]) == ["ours", REAL, "theirs"]
        for question in ranked
    )
    first = [survey.sources[question["clips"][0]] for question in ranked]
    assert all(first.count(name) >= 5 for name in (REAL, "ours", "theirs"))
    owners = [
        survey.sources[question["clips"][0]]
        for question in survey.questions
        if question["kind"] == "real"
    ]
    assert (owners.count(REAL), owners.count("ours"), owners.count("theirs")) == (20, 10, 10)
    kinds = [question["kind"] for question in survey.questions]
    assert kinds != sorted(kinds)
    assert [question["id"] for question in survey.questions] == [f"q{i + 1}" for i in range(80)]
    assert len(survey.clips) == 40 * 3 + 40
    again, other = (
        plan_survey(sources(), SurveySettings(preference=40, real_or_fake=40, seed=seed))
        for seed in (3, 4)
    )
    assert again.id == survey.id != other.id


def test_the_page_holds_its_clips_and_nothing_that_tells_their_sources(study):
    path, _, key = study
    text = path.read_text(encoding="utf-8")
    page = Page(text)
    data = json.loads(page.data)
    assert page.title == SETTINGS.title
    assert html.escape(SETTINGS.title) in text
    assert page.addresses == []  # nothing is loaded from anywhere
    assert "http:" not in text
    assert "https:" not in text
    assert data["questions"] == key["questions"]
    assert data["id"] == key["survey"]
    assert (
        set(data["videos"])
        == set(key["clips"])
        == {name for question in data["questions"] for name in question["clips"]}
    )
    for video in data["videos"].values():
        head, body = video.split(",", 1)
        assert head == "data:video/mp4;base64"
        assert base64.b64decode(body)[4:8] == b"ftyp"
    told = re.sub(r'"data:video[^"]*"', "", text).lower()
    for name in ("ours", "theirs"):
        assert not re.search(rf"\b{name}\b", told)
    assert list(data["videos"]) == sorted(data["videos"])
    assert {clip["source"] for clip in key["clips"].values()} == {REAL, "ours", "theirs"}


DRIVER = """<script>
let saved = null;
const given = URL.createObjectURL;
URL.createObjectURL = blob => { saved = blob; return given.call(URL, blob); };
</script>"""


CLICKS = """<script>
(async () => {
  document.getElementById("begin").click();
  const seen = [];
  for (let i = 0; i < 100; i++) {
    const figures = [...document.querySelectorAll("figure")];
    if (!figures.length) break;
    const videos = [...document.querySelectorAll("video")];
    await Promise.all(videos.map(v => v.readyState >= 2 ? 0 : new Promise(done => { v.onloadeddata = done; v.onerror = done; })));
    seen.push(...videos.map(v => v.videoWidth));
    if (document.getElementById("next")) {
      const next = document.getElementById("next");
      if (!next.disabled) throw Error("next before the ranking");
      figures.forEach(figure => figure.querySelector("button").click());
      figures.at(-1).querySelector("button").click();  // taken back
      if (!next.disabled) throw Error("next with a clip taken back");
      figures.at(-1).querySelector("button").click();
      next.click();
    } else if (i % 2) document.getElementById("real").click(); else document.getElementById("fake").click();
  }
  const text = await saved.text();
  const out = document.createElement("pre");
  out.id = "answers";
  out.textContent = JSON.stringify({ text, seen, name: document.getElementById("download").download,
    kept: Object.keys(JSON.parse(localStorage.getItem("a2v-survey-" + survey.id)).answers).length });
  document.body.append(out);
})();
</script>"""


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here to open the page with")
def test_a_participant_in_a_browser(study, tmp_path):
    """Every button of the page, in a real browser; its file of answers is what the analysis
    takes."""
    path, _, key = study
    text = (
        path.read_text(encoding="utf-8")
        .replace("<script>", DRIVER + "<script>", 1)
        .replace("</body>", CLICKS + "</body>")
    )
    (tmp_path / "driven.html").write_text(text, encoding="utf-8")
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        f"--user-data-dir={tmp_path / 'profile'}",
        "--timeout=30000",
        "--virtual-time-budget=20000",
        "--dump-dom",
        (tmp_path / "driven.html").as_uri(),
    ]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    found = re.search(r'<pre id="answers">(.*?)</pre>', dom, flags=re.DOTALL)
    assert found, dom[-2000:]
    content = json.loads(html.unescape(found[1]))
    assert content["kept"] == 7
    assert len(content["seen"]) == 3 * 3 + 4
    assert set(content["seen"]) == {64}  # every clip was decoded
    assert re.fullmatch(r"answers-[0-9a-f]{16}\.json", content["name"])
    (tmp_path / "answers.json").write_text(content["text"], encoding="utf-8")
    answers = read_answers(tmp_path / "answers.json", key)
    assert {answer["question"] for answer in answers["answers"]} == {
        question["id"] for question in key["questions"]
    }
    result = analyze(key, [answers])
    assert sum(result.ranks["ours"]) == 3
    assert result.correct.total == 4


@pytest.mark.parametrize(
    ("given", "options", "words"),
    [
        (sources(["ours"]), {"real_or_fake": 0}, "at least two sources"),
        (sources(["ours", "theirs"]), {}, "need the real data"),
        ({**sources([REAL]), **sources(["ours"], ["swim"])}, {}, "no action in common"),
        (sources(), {"preference": 1000}, "exceed 600"),
        ({}, {}, "0 sources"),
    ],
)
def test_impossible_studies_are_explained(given, options, words):
    with pytest.raises(InputError, match=words):
        plan_survey(given, SurveySettings(**options))
    with pytest.raises(InputError, match="at least one question"):
        SurveySettings(preference=0, real_or_fake=0)


def test_the_command_makes_and_analyses(tmp_path, capsys):
    walk = person(frames=5)
    walk.save(tmp_path / "walk.npz")
    page = tmp_path / "s.html"
    arguments = [
        "survey",
        "--model",
        "cmu",
        "--motions",
        f"theirs={tmp_path / 'walk.npz'}",
        "--action",
        "Walk",
        "--frames",
        "4",
    ]
    assert (
        main(
            [
                *arguments,
                "--preference",
                "1",
                "--real_or_fake",
                "0",
                "--size",
                "64",
                "--out",
                str(page),
            ]
        )
        == 2
    )
    assert "no action in common" in capsys.readouterr().err  # the file names no action
    import dataclasses

    dataclasses.replace(walk, action="walk").save(tmp_path / "walk.npz")
    assert (
        main(
            [
                *arguments,
                "--preference",
                "1",
                "--real_or_fake",
                "0",
                "--size",
                "64",
                "--out",
                str(page),
            ]
        )
        == 0
    )
    assert capsys.readouterr().out.splitlines() == [str(page), str(page.with_suffix(".key.json"))]
    key = read_key(page.with_suffix(".key.json"))
    assert {clip["source"] for clip in key["clips"].values()} == {"cmu", "theirs"}
    order = sorted(key["clips"], key=lambda name: key["clips"][name]["source"])
    files = []
    for i in range(3):
        given = [{"question": "q1", "ranking": order}]
        content = {
            "format": "a2v-survey-answers/1",
            "survey": key["survey"],
            "participant": f"p{i}",
            "answers": given,
        }
        path = tmp_path / f"answers-{i}.json"
        path.write_text(json.dumps(content), encoding="utf-8")
        files.append(str(path))
    out = tmp_path / "result.md"
    assert (
        main(
            [
                "survey",
                "--analyze",
                *files,
                "--key",
                str(page.with_suffix(".key.json")),
                "--out",
                str(out),
            ]
        )
        == 0
    )
    assert "| cmu over theirs | 100.0 % [43.9, 100.0] |" in out.read_text(encoding="utf-8")
    assert json.loads(out.with_suffix(".json").read_text())["participants"] == 3
    assert main(["survey", "--analyze", files[0]]) == 2
    assert "give --key" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["real", "Real", "cmu", ""])
def test_names_of_sources_that_would_replace_others_are_refused(tmp_path, capsys, name):
    person(frames=4).save(tmp_path / "clips.npz")
    words = [
        "--model",
        "cmu",
        "--motions",
        f"{name}={tmp_path / 'clips.npz'}",
        "--real_or_fake",
        "0",
        "--preference",
        "2",
        "--frames",
        "4",
    ]
    assert main(["survey", *words, "--out", str(tmp_path / "page.html")]) == 2
    assert "cannot be the name of a source" in capsys.readouterr().err
    assert not (tmp_path / "page.html").exists()


def test_each_baseline_is_a_source_and_a_row_of_a_picture(tmp_path, capsys):
    from a2v.formats import read_motion
    from a2v.formats.bvh import write_bvh
    from a2v.lab.datasets import load_dataset
    from a2v.lab.motion.baselines import NAMES
    from a2v.lab.motion.baselines.training import BaselineSettings, train_baseline
    from tests.support.motions import waving

    clips = waving()
    for index in range(len(clips)):
        path = tmp_path / "data" / clips.actions[clips.labels[index]] / f"{index}.bvh"
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bvh(path, clips.motion(index))
    data = tmp_path / "data"
    given = ["--frames", "8"]
    for name in NAMES:
        settings = BaselineSettings(
            name=name, iterations=2, batch_size=4, width=0.1, threads=1, device="cpu"
        )
        train_baseline(load_dataset("bvh", data), tmp_path / name, settings=settings)
        given = ["--model", str(tmp_path / name / "baseline.pt"), *given]
    asked = ["--dataset", "bvh", "--data", str(data)]
    assert main(["survey", *given, *asked, "--out", str(tmp_path / "rows.svg")]) == 0
    shown = (tmp_path / "rows.svg").read_text(encoding="utf-8")
    assert all(part in shown for name in NAMES for part in name.split("-"))
    assert main(["survey", *given, "--action", "slow", "--out", str(tmp_path / "rows.png")]) == 2
    assert "give --dataset and --data" in capsys.readouterr().err
    for name in NAMES:  # without the data
        words = ["--model", str(tmp_path / name / "baseline.pt"), "--action", "slow"]
        assert main(["sample", *words, "--count", "2", "--out", str(tmp_path / "a.npz")]) == 0, name
    made = read_motion(tmp_path / "a.npz")
    assert (made.joints.shape, made.fps) == ((2, 89, 20, 3), 30)  # 60 frames at 20 a second
    assert main(["sample", *words, "--frames", "9", "--out", str(tmp_path / "b.bvh")]) == 0
    assert read_motion(tmp_path / "b.bvh").frames == 9
    for words, said in (
        (["--action", "fast", "--bones", "a.npz"], "bones cannot be given with a baseline"),
        (["--action", "sing"], "unknown action 'sing'"),
    ):
        assert main(["sample", *given[:2], *words, "--out", str(tmp_path / "x.npz")]) == 2
        assert said in capsys.readouterr().err

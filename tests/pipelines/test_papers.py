"""``a2v video --papers``: one flag for the papers' way, of which other options replace parts."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from a2v.errors import InputError
from pipelines.commands import video
from pipelines.engine.store import Store
from pipelines.options import parse
from pipelines.requests.papers import PAPERS, parts_used
from pipelines.requests.video import VideoRequest

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"
ASKED = ("--photo", str(SAMPLE), "--out", "o", "--action", "Walk")


def given(*words: str) -> video.Options:
    return parse(video.Options, [*ASKED, *words], command="video", about="", examples="")


def told(options: video.Options, store: Store) -> str:
    return "\n".join(parts_used(options.request, options.request.resolve(store)))


def test_one_flag_sets_the_papers_way_for_the_graph(tmp_path):
    options = given("--papers")
    resolved = options.request.resolve(Store(tmp_path))
    of = resolved.parameters
    assert Path(of["model"].path).stem == "motion_humanact12_glmi_m"
    assert of["figure"].kind == "fused"
    assert not of["color"].synthesis
    assert not of["color"].delight
    assert (of["deform"].method, of["deform"].control) == ("arap", 1)
    assert not of["hands"].replace
    assert not of["face"].expressions
    assert of["retarget"].raw
    assert (of["render"].views, of["render"].follow) == (("front", "back", "left", "right"), False)
    assert options.request == VideoRequest.of(photo=SAMPLE, action="Walk", **PAPERS)
    text = told(options, Store(tmp_path))
    assert "motion of humanact12-glmi-m\n" in text
    assert "our networks of PIFu's kind, since no checkpoint is given, fused" in text
    assert "Anny, since no SMPL file is given" in text
    assert "Eq. 14 alone, frames by Eq. 20 with control 1, views front,back,left,right" in text
    assert given().request.person.character == "canonical"  # and nothing without the flag


def test_options_replace_parts_even_by_their_defaults_and_before_the_flag(tmp_path):
    line = ("--character", "canonical", "--model", "cmu-lie", "--deform.control", "0.05")
    for words in ((*line, "--papers"), ("--papers", *line)):
        options = given(*words)
        assert options.request.person.character == "canonical"
        assert not options.request.person.color.synthesis  # the other parts stay
        text = told(options, Store(tmp_path))
        assert "motion of cmu-lie, not GLMI-M" in text
        assert "canonical" in text
        assert "control 0.05" in text


def test_checkpoints_and_smpl_are_used_if_they_are_given(tmp_path):
    weights, smpl = tmp_path / "net_G", tmp_path / "smpl.npz"
    for path in (weights, smpl):
        shutil.copy(SAMPLE, path)
    options = given("--papers", "--pifu-geometry", str(weights), "--fit.model", str(smpl))
    assert options.request.person.backend == "papers"
    resolved = options.request.resolve(Store(tmp_path / "store"))
    assert resolved.parameters["shape"].pifu_geometry == str(weights)
    text = told(options, Store(tmp_path / "store"))
    assert "surface of your checkpoints of PIFu, fused" in text
    assert "body smpl.npz, carried over from Anny's fit" in text
    without = given("--pifu-geometry", str(weights))
    assert without.request.person.backend == "pifu"  # as before


def test_the_flag_belongs_on_the_command_line(tmp_path):
    (tmp_path / "papers.yaml").write_text("papers: true\n")
    with pytest.raises(InputError, match="papers cannot be set in a file; give --papers"):
        given("--config", str(tmp_path / "papers.yaml"))
    (tmp_path / "own.yaml").write_text("character: canonical\n")
    mixed = given("--papers", "--config", str(tmp_path / "own.yaml"))
    assert mixed.request.person.character == "canonical"

"""``a2v motion`` and ``a2v sample``: the papers' applications and native joints, on the shipped
models; and what old spellings are answered with."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.io import read_npz
from a2v.kinematics import bone_lengths
from a2v.motion import MotionModel
from a2v.motion.direct import on_feet
from a2v.types import Motion
from pipelines.cli import load_command, main
from pipelines.motion_clips import ClipOptions
from pipelines.options import parse


def motion(*arguments: object, code: int = 0, command: str = "motion") -> None:
    assert main([command, *(str(argument) for argument in arguments)]) == code


def sample(*arguments: object, code: int = 0) -> None:
    motion(*arguments, code=code, command="sample")


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    """A clip of nine frames and its path, as .npz and as .bvh."""
    folder = tmp_path_factory.mktemp("start")
    motion("--action", "Walk", "--frames", 9, "--fps", 12, "--out", folder / "start.npz")
    motion("--action", "Walk", "--frames", 9, "--fps", 12, "--out", folder / "start.bvh")
    return folder / "start"


@pytest.mark.parametrize("suffix", [".npz", ".bvh"])
def test_futures_of_a_file(start, tmp_path, suffix):
    path = start.with_suffix(suffix)
    sample(
        "--action",
        "Walk",
        "--start",
        path,
        "--start_frames",
        6,
        "--count",
        2,
        "--frames",
        20,
        "--fps",
        12,
        "--out",
        tmp_path / "f.npz",
    )
    made, given = Motion.load(tmp_path / "f.npz"), read_motion(path)
    assert made.joints.shape == (2, 20, 20, 3)
    assert np.abs(made.joints[:, :6] - given.joints[:6]).max() < 1e-3
    assert np.abs(made.joints[0] - made.joints[1]).max() > 0.01


@pytest.mark.parametrize("name", ["cmu-glmi-m", "humanact12-glmi-m"])
def test_futures_of_a_frame_by_frame_model_go_on_without_a_jump(start, tmp_path, name):
    """A VAE reproduces given poses with an error of centimeters, which must not show at once."""
    given = ["--start", start.with_suffix(".npz"), "--start_frames", 9, "--model", name]
    asked = ["--action", "Walk", "--frames", 60, "--count", 20, "--fps", MotionModel.load(name).fps]
    sample(*given, *asked, "--out", tmp_path / "f.npz")
    made = Motion.load(tmp_path / "f.npz")
    changes = np.linalg.norm(np.diff(made.joints, 2, axis=1), axis=-1).mean(-1)
    assert np.median(changes[:, made.given_frames - 2]) < 2 * np.median(
        changes[:, made.given_frames :]
    )


def test_rows_between_two_motions(tmp_path):
    sample(
        "--action",
        "Jump",
        "--interpolate",
        4,
        "--seed",
        2,
        "--to_seed",
        9,
        "--frames",
        10,
        "--fps",
        12,
        "--out",
        tmp_path / "i.npz",
    )
    made, model = Motion.load(tmp_path / "i.npz"), MotionModel.load("cmu-fine")
    for row, seed in ((0, 2), (3, 9)):
        alone = on_feet(model.sample("Jump", frames=10, seed=seed), model)
        assert np.allclose(made.joints[row], alone.joints, atol=1e-5)


def test_one_clip_of_every_action_that_matches(tmp_path):
    sample(
        "--model", "humanact12", "--action", "w*,sit", "--frames", 8, "--out", tmp_path / "k.npz"
    )
    made = Motion.load(tmp_path / "k.npz")
    assert made.action == "warm_up|walk|sit"
    assert made.batch == (3,)


def test_bodies(tmp_path, start):
    model = MotionModel.load("cmu-fine")
    motion(
        "--action",
        "Walk",
        "--frames",
        5,
        "--bone_scale",
        "legs=1.5",
        "--out",
        tmp_path / "legs.npz",
    )
    tall = Motion.load(tmp_path / "legs.npz")
    assert np.allclose(
        bone_lengths(tall.joints, model.skeleton)[0] / model.card.meters_per_unit,
        model.scaled_bones({"legs": 1.5}),
        atol=1e-5,
    )
    motion(
        "--action",
        "Jump",
        "--frames",
        5,
        "--bones",
        tmp_path / "legs.npz",
        "--out",
        tmp_path / "own.npz",
    )
    own = Motion.load(tmp_path / "own.npz")
    assert np.allclose(
        bone_lengths(own.joints, model.skeleton)[0],
        bone_lengths(tall.joints, model.skeleton)[0],
        atol=1e-4,
    )
    for text, factors in (
        ("1.25", 1.25),
        ("legs=1.5, left_elbow=2", {"legs": 1.5, "left_elbow": 2.0}),
    ):
        found = ClipOptions(bone_scale=text).lengths(model)
        assert np.array_equal(found, model.scaled_bones(factors))
    for text in ("wide", "legs=", "legs", "legs=1,arms"):
        with pytest.raises(InputError, match="expected a number"):
            ClipOptions(bone_scale=text).lengths(model)


@pytest.mark.parametrize("suffix", [".png", ".gif", ".mp4"])
def test_pictures(tmp_path, suffix):
    path = tmp_path / f"w{suffix}"
    motion("--action", "Walk", "--frames", 6, "--count", 2, "--out", path)
    assert path.stat().st_size > 1000
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--start", "none.npz"], "none.npz does not exist"),
        (["--start_frames", 30, "--start", "START"], "start_frames is 30"),
        (["--start", "START", "--frames", 9, "--fps", 12], "make the result longer"),
        (["--frames", 9, "--seconds", 2], "both frames (9) and seconds (2)"),
        (["--seconds", 0], "seconds is 0"),
        (["--speed", 50], "speed is 50"),
        (["--start", "START", "--interpolate", 3], "not both"),
        (["--start", "START", "--bone_scale", 2], "bone_scale cannot be given with start"),
        (["--interpolate", 1], "rows is 1"),
        (["--bone_scale", "tail=2"], "no bone 'tail'"),
        (["--bone_scale", "legs=99"], "bone_scale is 99"),
        (["--action", "Swim*"], "matches 'Swim*'"),
        (["--action", "Walk,Jump", "--interpolate", 3], "one --action"),
        (["--action", "sneak, then bow"], "sample needs a single model"),
        (["--model", "runs/baseline.pt", "--native"], "native cannot be given with a baseline"),
    ],
)
def test_what_does_not_go_is_explained(tmp_path, capsys, start, options, words):
    given = [str(start.with_suffix(".npz")) if option == "START" else option for option in options]
    sample("--action", "Walk", "--out", tmp_path / "x.npz", *given, code=2)
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_native_joints_go_into_npz_only(tmp_path, capsys):
    sample("--action", "Walk", "--native", "--out", tmp_path / "x.bvh", code=2)
    assert "--native" in capsys.readouterr().err
    for other in (["--loop"], ["--speed", 2], ["--rig", "smpl"]):
        sample("--action", "Walk", "--native", *other, "--out", tmp_path / "x.npz", code=2)
        assert "native" in capsys.readouterr().err
    sample("--action", "Walk,Jump", "--native", "--frames", 30, "--out", tmp_path / "x.npz")
    content = read_npz(tmp_path / "x.npz")
    assert content["joints"].shape == (30, 20, 3)
    walk, jump = (
        MotionModel.load("cmu-fine").card.actions.index(name) for name in ("Walk", "Jump")
    )
    assert content["labels"].tolist() == [walk] * 15 + [jump] * 15
    assert np.abs(content["joints"][0, 0]).max() < 1e-6


AUTHORS = {
    "humanact12": ("action_recognition_model_humanact12.tar", 0.05),
    "cmu": ("action_recognition_model_mocap_new.tar", 0.08),
}


@pytest.mark.parametrize("name", sorted(AUTHORS))
def test_the_authors_classifier_recognises_native_files_as_in_the_evaluation(
    name, data_dir, tmp_path
):
    from a2v.lab.evaluation.classifier import load_evaluator
    from a2v.lab.evaluation.sources import generator_of

    model = MotionModel.load(name)
    frames, count = model.card.frames, 60
    file, tolerance = AUTHORS[name]
    evaluator = load_evaluator(data_dir / "evaluators" / file)
    right, wrong_frame, labels = [], [], []
    for label, action in enumerate(model.actions):
        sample(
            "--model",
            name,
            "--action",
            action,
            "--frames",
            frames,
            "--count",
            count,
            "--native",
            "--out",
            tmp_path / "n.npz",
        )
        content = read_npz(tmp_path / "n.npz")
        assert (content["labels"] == label).all()
        right.append(evaluator(content["joints"])[1] == label)
        meters = content["joints"] * content["native_signs"] * content["meters_per_unit"]
        wrong_frame.append(evaluator(meters.astype(np.float32))[1] == label)
        labels += [label] * count
    bodies = np.tile(model.bone_lengths, (len(labels), 1))
    path = generator_of(model, frames)(np.array(labels), bodies, np.random.default_rng(0))
    expected = (evaluator(path)[1] == np.array(labels)).mean()
    assert np.mean(right) > expected - tolerance
    if name == "humanact12":
        assert np.mean(wrong_frame) < 0.5  # upside down


def test_native_joints_of_real_clips_are_the_files(data_dir):
    from a2v.lab.datasets import load_dataset

    for name in AUTHORS:
        dataset, model = load_dataset(name, data_dir), MotionModel.load(name)
        for index in (0, 17):
            file = dataset.joints[index] * np.asarray(dataset.frame.signs, np.float32)
            native = model.to_native(dataset.motion(index).joints)
            assert np.abs(native - (file - file[:1, :1])).max() < 1e-4


def test_futures_of_a_recording_of_another_skeleton(data_dir, tmp_path):
    """A file of the CMU motion capture data base: 38 joints in inches at 120 fps, continued by the
    HumanAct12 model."""
    import zipfile

    with zipfile.ZipFile(data_dir / "cmu_bvh.zip") as archive:
        name = next(name for name in sorted(archive.namelist()) if name.endswith("02_01.bvh"))
        (tmp_path / "walk.bvh").write_bytes(archive.read(name))
    start = ["--start", tmp_path / "walk.bvh", "--start_frames", 100]
    sample(
        "--model",
        "humanact12",
        "--action",
        "walk",
        *start,
        "--frames",
        40,
        "--fps",
        20,
        "--count",
        2,
        "--out",
        tmp_path / "f.npz",
    )
    made, given = Motion.load(tmp_path / "f.npz"), read_motion(tmp_path / "walk.bvh", fps=20)
    names = {
        name: given.joint_names.index(other)
        for name, other in (("left_knee", "LeftLeg"), ("right_wrist", "RightHand"))
    }
    for name, index in names.items():
        assert (
            np.abs(
                made.joints[:, :16, made.joint_names.index(name)] - given.joints[:16, index]
            ).max()
            < 0.01
        )
    root = made.root[:, :, [0, 2]]
    steps = np.linalg.norm(np.diff(made.joints, axis=1), axis=-1).max(-1)
    assert (steps[:, 16] < 0.25).all()  # no jump where the recording ends
    assert (np.linalg.norm(root[:, -1] - root[:, 16], axis=-1) > 0.2).all()  # it walks on
    assert made.joints[..., 1].min() > -0.1


@pytest.mark.parametrize("rig", ["mixamo", "unreal"])
def test_a_bvh_on_another_tools_bones(tmp_path, rig, capsys):
    main(
        [
            "motion",
            "--action",
            "Walk",
            "--frames",
            "12",
            "--rig",
            rig,
            "--root-motion",
            "--out",
            str(tmp_path / "w.bvh"),
        ]
    )
    motion = read_motion(tmp_path / "w.bvh")
    assert motion.frames == 12
    assert {"mixamo": "mixamorig:LeftHandIndex3", "unreal": "index_03_l"}[rig] in motion.joint_names
    assert (
        main(["motion", "--action", "Walk", "--root-motion", "--out", str(tmp_path / "x.bvh")]) != 0
    )
    assert "--rig" in capsys.readouterr().err


@pytest.mark.parametrize("way", ["0,0 0,3", "csv"])
def test_a_path_in_words_and_numbers(
    way: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if way == "csv":
        way = str(tmp_path / "way.csv")
        Path(way).write_text("x,z\n0,0\n0,3\n", encoding="utf-8-sig")
    out = tmp_path / "way.npz"
    assert (
        main(
            [
                "motion",
                "--model",
                "cmu-fine",
                "--action",
                "stroll slowly",
                "--path",
                way,
                "--out",
                str(out),
            ]
        )
        == 0
    )
    assert "is taken for Walk slowly" in capsys.readouterr().err
    made = Motion.load(out)
    assert made.fps == 30
    assert np.linalg.norm(made.root[-1, [0, 2]] - (0, 3)) < 0.3


def test_prompts_loops_and_edits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.npz"
    command = ["motion", "--model", "cmu-fine", "--out", str(out)]
    assert main([*command, "--action", "sneak for 2 s, then run away for 30 frames"]) == 0
    made = Motion.load(out)
    assert (made.action, made.fps, made.frames) == ("Sneak,Run", 30, 90)
    assert (
        main([*command, "--action", "Walk", "--loop", "--in-place", "--mirror", "--speed", "1.5"])
        == 0
    )
    loop = Motion.load(out)
    assert (
        np.abs(loop.root[:, [0, 2]]).max() < 0.4
    )  # no travel; a walk that slows down and goes on sways by .3
    (tmp_path / "t.yaml").write_text("- {action: sneak, seconds: 1}\n- {action: run, frames: 12}\n")
    assert main([*command, "--timeline", str(tmp_path / "t.yaml"), "--seed", "4"]) == 0
    assert (Motion.load(out).action, Motion.load(out).frames) == ("Sneak,Run", 42)
    capsys.readouterr()
    assert main([*command, "--timeline", str(tmp_path / "t.yaml"), "--action", "Walk"]) == 2
    assert main([*command]) == 2
    assert main([*command, "--action", "Walk", "--pace", "1"]) == 2
    assert main([*command, "--action", "Walk", "--loop", "--count", "2"]) == 2
    assert main([*command, "--action", "Walk", "--path", "nowhere"]) == 2
    assert main([*command, "--action", "jumble"]) == 2
    assert "the nearest are" in capsys.readouterr().err


def test_actions_can_be_found_by_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["actions", "--model", "cmu-fine", "--find", "something like dancing"]) == 0
    found = capsys.readouterr().out.split("\n")
    assert found[:2] == [
        "'something like dancing' is none of the actions that are known",
        "the nearest actions:",
    ]
    assert {"  Salsa", "  Ballet", "  Charleston"} & set(found[2:6])
    assert main(["actions", "--find", "sneaking thief"]) == 0
    found = capsys.readouterr().out.split("\n")
    assert found[0].startswith("'sneaking thief' is taken for Sneak (near: ")
    assert "  Careful walk" in found
    assert main(["actions", "--find", "сидеть"]) == 0
    assert "Russian, read as 'sit'" in capsys.readouterr().out
    assert main(["actions", "--find", "istua kävellä"]) == 2
    assert "its language is unknown" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("--from-video 'my clip.mp4' --out o.bvh", "follow --video 'my clip.mp4' --out o.bvh"),
        ("--from_video=a.mp4 --out=o.bvh --rig vrm", "follow --video=a.mp4 --out=o.bvh --rig vrm"),
        ("--page p.html --character me.glb", "motion-page --out p.html --character me.glb"),
        ("--action Walk --native --out x.npz", "sample --action Walk --native --out x.npz"),
        (
            "--action Walk --start a.bvh --start_frames 4 --out x.npz",
            "sample --action Walk --start a.bvh --start-frames 4 --out x.npz",
        ),
        (
            "--action Walk --interpolate 2 --to-seed 3 --out x.npz",
            "sample --action Walk --interpolate 2 --to-seed 3 --out x.npz",
        ),
        ("--action 'W*' --out x.npz", "sample --action 'W*' --out x.npz"),
        (
            "--model runs/baseline.pt --action walk --out x.npz",
            "sample --model runs/baseline.pt --action walk --out x.npz",
        ),
    ],
)
def test_old_spellings_are_answered_with_the_new_command(capsys, old, new):
    motion(*shlex.split(old), code=2)
    said = capsys.readouterr().err.strip()
    assert said.endswith(f"the same is: a2v {new}")
    name, *words = shlex.split(new)
    command = load_command(name)
    parse(command.Options, words, command=name, about="", examples="")


def test_the_commands_share_what_a_motion_file_is(tmp_path):
    """Plain clips of a single model are those of ``a2v motion``."""
    given = ("--model", "humanact12", "--action", "throw", "--frames", 8, "--speed", 1.5)
    motion(*given, "--out", tmp_path / "a.npz")
    sample(*given, "--out", tmp_path / "b.npz")
    first, second = (Motion.load(tmp_path / name) for name in ("a.npz", "b.npz"))
    assert np.array_equal(first.joints, second.joints)

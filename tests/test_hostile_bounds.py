"""Small inputs that request too much are refused before anything is allocated or computed."""

from __future__ import annotations

import ast
import io
import json
import os
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats.gltf import read_glb
from a2v.io import write_npz
from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.datasets.files import MAX_ARCHIVE_BYTES, FileSource
from a2v.lab.evaluation.classifier import load_evaluator
from a2v.lab.papers.checkpoints import read_state
from a2v.lab.studio.avatar_files import load_avatar
from a2v.motion.card import read_card
from a2v.motion.ways import MAX_METRES, read_path
from a2v.rendering import write_video
from a2v.types import Motion
from pipelines.batch.results import write_tables
from tests.support.commands import refused
from tests.support.glb import glb
from tests.support.motions import person

ROOT = Path(__file__).resolve().parents[1]
WEIGHTS = ROOT / "a2v" / "weights"


# ------------------------------------------------------------------------------------------------------------------ motions


@pytest.mark.parametrize(
    "text",
    [
        "0,0 0,1e7",
        "0,0 0,1e300",
        "1e308,0 -1e308,0",
        "0,0 0,1e-5",
        "0,0 0,1e5",
        "nan,0 0,1",
        "0,0 0,1900 0,0",
        f"0,0 0,{2 * MAX_METRES}",
    ],
)
def test_paths_are_neither_endless_nor_a_place(text):
    begun = time.process_time()
    with pytest.raises(InputError):
        read_path(text)
    assert time.process_time() - begun < 1


@pytest.mark.parametrize(
    "words",
    [
        ("motion", "--count", 10**6, "--frames", 1),
        ("motion", "--count", 10**9),
        ("sample", "--action", ",".join(["*"] * 20_000)),
    ],
)
def test_clips_without_number_are_refused_at_once(capsys, tmp_path, words):
    begun = time.process_time()
    refused(capsys, words[0], "--action", "Walk", *words[1:], "--out", tmp_path / "a.npz")
    assert time.process_time() - begun < 8


@pytest.mark.parametrize("pace", [0, -1, 1e-9, 1e9, ".inf", ".nan"])
def test_paces_that_nobody_walks(capsys, tmp_path, pace):
    refused(
        capsys,
        "motion",
        "--action",
        "Walk",
        "--path",
        "0,0 0,2",
        f"--pace={pace}",
        "--out",
        tmp_path / "a.npz",
    )


@pytest.mark.parametrize(
    ("command", "option"), [("sample", "--start"), ("motion", "--bones"), ("motion", "--end-pose")]
)
def test_a_motion_file_of_no_clips(capsys, tmp_path, command, option):
    arrays = person(frames=3).to_arrays()
    empty = {
        name: np.zeros((0, *arrays[name].shape), np.float32)
        for name in ("joints", "rotations", "root")
    }
    write_npz(tmp_path / "none.npz", {**arrays, **empty})
    with pytest.raises(InputError, match="batch of 0 clips"):
        Motion.load(tmp_path / "none.npz")
    refused(
        capsys,
        command,
        "--action",
        "Walk",
        option,
        tmp_path / "none.npz",
        "--out",
        tmp_path / "a.npz",
    )


# ------------------------------------------------------------------------------------------------------------------ models


def changed_model(path: Path, name: str, **said: object) -> Path:
    """A shipped motion model with another description of itself."""
    import onnx

    model = onnx.load(WEIGHTS / f"motion_{name}.onnx")
    metadata = {prop.key: prop.value for prop in model.metadata_props}
    onnx.helper.set_model_props(
        model, {**metadata, "a2v": json.dumps({**json.loads(metadata["a2v"]), **said})}
    )
    onnx.save(model, path)
    return path


def foreign_model(path: Path, name: str) -> Path:
    """Another graph with the description of a shipped motion model."""
    import onnx

    metadata = {
        prop.key: prop.value for prop in onnx.load(WEIGHTS / f"motion_{name}.onnx").metadata_props
    }
    values = [
        onnx.helper.make_tensor_value_info(one, onnx.TensorProto.FLOAT, [1]) for one in ("x", "y")
    ]
    graph = onnx.helper.make_graph(
        [onnx.helper.make_node("Identity", ["x"], ["y"])], "g", values[:1], values[1:]
    )
    model = onnx.helper.make_model(
        graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=8
    )
    onnx.helper.set_model_props(model, metadata)
    onnx.save(model, path)
    return path


@pytest.mark.parametrize(
    "make",
    [
        lambda path: foreign_model(path, "humanact12"),
        lambda path: foreign_model(path, "humanact12_plain"),
        lambda path: changed_model(path, "humanact12", latent_size=10**9),
        lambda path: changed_model(path, "humanact12", latent_size=9000),
        lambda path: changed_model(path, "humanact12_plain", latent_size=9000),
        lambda path: changed_model(path, "humanact12_plain", hidden_size=9000),
        lambda path: changed_model(path, "humanact12", window_frames=10**6),
        lambda path: changed_model(path, "humanact12", context_frames=30),
    ],
)
def test_graphs_that_are_not_what_they_say(capsys, tmp_path, make):
    path = make(tmp_path / "model.onnx")
    with pytest.raises(InputError, match=r"model\.onnx"):
        read_card(path)
    refused(
        capsys,
        "motion",
        "--model",
        path,
        "--action",
        "Jump",
        "--frames",
        4,
        "--out",
        tmp_path / "a.npz",
    )
    script = [
        sys.executable,
        ROOT / "export" / "sample.py",
        path,
        "--action",
        "Jump",
        "--frames",
        4,
        "--out",
        tmp_path / "a.npz",
    ]
    done = subprocess.run(list(map(str, script)), capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert not (tmp_path / "a.npz").exists()


@pytest.mark.parametrize(
    "read", [read_state, load_evaluator, lambda path: read_checkpoint(path, ()), read_card]
)
def test_networks_are_read_from_regular_files(tmp_path, read):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=r"not a regular file|motion model"):
        read(tmp_path / "pipe")
    with pytest.raises(InputError, match=r"does not exist|motion model"):
        read(tmp_path / "nothing")


def test_checkpoints_whose_tensors_are_larger_than_they(tmp_path):
    import torch

    torch.save({"a": torch.zeros(1, dtype=torch.float16).expand(1 << 34)}, tmp_path / "wide.pth")
    with pytest.raises(InputError, match="would take"):
        read_state(tmp_path / "wide.pth")
    torch.save({"a": torch.zeros(1 << 22)}, tmp_path / "plain.pth")
    with (
        zipfile.ZipFile(tmp_path / "plain.pth") as plain,
        zipfile.ZipFile(tmp_path / "packed.pth", "w", zipfile.ZIP_DEFLATED) as packed,
    ):
        for info in plain.infolist():
            packed.writestr(info.filename, plain.read(info.filename))
    with pytest.raises(InputError, match="would take"):
        read_state(tmp_path / "packed.pth")


# ------------------------------------------------------------------------------------------------------------------ archives, glTF


def test_the_members_of_a_zip_are_bounded_together(tmp_path):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for index in range(MAX_ARCHIVE_BYTES // (54 << 20) + 1):
            archive.writestr(f"P01G01R01F0001T0064A01{index:02d}.npy", bytes(54 << 20))
    (tmp_path / "data.zip").write_bytes(buffer.getvalue())
    with pytest.raises(InputError, match="unpacks to"):
        FileSource(tmp_path / "data.zip")


NODES = {
    "children are a number": [{"children": 3}],
    "children are no nodes": [{"children": [10**400]}],
    "a node of two parents": [{"children": [2]}, {"children": [2]}, {}],
    "a loop": [{"children": [1]}, {"children": [0]}],
    "a deep chain": [*({"children": [index + 1]} for index in range(8000)), {}],
    "a deep chain, the leaf first": [{}, *({"children": [index]} for index in range(8000))],
    "a huge number": [{"scale": [10**400, 1, 1]}],
    "a short rotation": [{"rotation": [1]}],
    "a long name": [{"name": "x" * 9000, "matrix": "y" * 9000}],
    "nodes without number": [{}] * 60_000,
}


@pytest.mark.parametrize("name", NODES)
def test_nodes_that_are_none(tmp_path, name):
    (tmp_path / "a.glb").write_bytes(glb({"nodes": NODES[name]}))
    begun = time.process_time()
    with pytest.raises(InputError, match=r"a\.glb") as caught:
        read_glb(tmp_path / "a.glb").node_matrices()
    assert time.process_time() - begun < 2
    assert len(str(caught.value)) < 700


@pytest.mark.parametrize(
    "skin",
    [
        {"joints": 3},
        {"joints": [0, 0]},
        {"joints": []},
        {"joints": [10**400]},
        {"joints": ["x" * 9000]},
        {},
    ],
)
def test_skins_that_are_none(capsys, tmp_path, skin):
    (tmp_path / "a.glb").write_bytes(
        glb({"nodes": [{"mesh": 0, "skin": 0}], "skins": [skin], "meshes": [{"primitives": []}]})
    )
    with pytest.raises(InputError, match=r"a\.glb") as caught:
        load_avatar(tmp_path / "a.glb")
    assert len(str(caught.value)) < 700
    refused(capsys, "motion-page", "--out", tmp_path / "a.html", "--character", tmp_path / "a.glb")


@pytest.mark.parametrize(
    "change",
    [
        {"componentType": {}},
        {"componentType": [5126]},
        {"type": {}},
        {"type": []},
        {"count": 10**400},
        {"componentType": True},
    ],
)
def test_accessors_that_are_none(tmp_path, change):
    content = {"accessors": [{"componentType": 5126, "type": "VEC3", "count": 1, **change}]}
    (tmp_path / "a.glb").write_bytes(glb(content))
    with pytest.raises(InputError, match=r"a\.glb"):
        read_glb(tmp_path / "a.glb").accessor(0)


def test_a_flat_file_of_many_nodes_is_read_in_time(tmp_path):
    """A matrix a node, not a list of all nodes a node."""
    (tmp_path / "a.glb").write_bytes(
        glb({"nodes": [{"children": list(range(1, 8000))}, *[{}] * 7999]})
    )
    begun = time.process_time()
    assert read_glb(tmp_path / "a.glb").node_matrices()[0].shape == (8000, 4, 4)
    assert time.process_time() - begun < 1.5


# ------------------------------------------------------------------------------------------------------------------ what is written


@pytest.mark.parametrize("width", [514, 704])
def test_the_same_frames_are_the_same_file(tmp_path, width):
    """Encoded bytes do not depend on memory contents.

    x264's AVX-512 path gave other bytes if the width was no multiple of 128.
    """
    rng = np.random.default_rng(0)
    wide = (
        rng.integers(0, 255, (8, 16, 3), dtype=np.uint8)
        .repeat(16, axis=0)
        .repeat(width // 16 + 1, axis=1)[:, :width]
    )
    frames = [np.roll(wide, 3 * index, axis=1) for index in range(20)]
    made, kept = set(), []
    for index in range(6):
        kept.append(np.full(int(rng.integers(1, 1 << 22)), 37 * index + 1, np.uint8))
        write_video(tmp_path / "a.mp4", frames, 30.0)
        made.add((tmp_path / "a.mp4").read_bytes())
        kept = kept[index % 2 :]
    assert len(made) == 1


def test_tables_of_odd_records(tmp_path):
    """Records without some entries, and a folder whose name is not UTF-8."""
    odd = os.fsdecode(b"caf\xe9")
    for folder, record in (
        ("a", {}),
        (odd, {"name": [1], "photo": {"a": 1}, "action": None, "seed": odd}),
        ("b", {"files": {"\0": 1}, "name": odd}),
    ):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "job.json").write_text(
            json.dumps({"folder": folder, "status": "done", "files": {}, **record}),
            encoding="utf-8",
        )
    assert write_tables(tmp_path) == {"done": 3, "failed": 0}
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "caf%E9/preview.html" in page
    assert page.count("<img ") == 3


def test_a_batch_in_a_plain_locale_and_a_folder_that_is_no_utf_8(tmp_path):
    folder = os.fsencode(tmp_path) + b"/caf\xe9"
    os.mkdir(folder)  # noqa: PTH102 - bytes
    with open(folder + b"/jobs.csv", "wb") as stream:
        stream.write("name,photo,action\nAda Müller,nobody.jpg,Walk\n".encode())
    environment = {
        **os.environ,
        "LC_ALL": "C",
        "PYTHONCOERCECLOCALE": "0",
        "PYTHONUTF8": "0",
        "A2V_CACHE": str(tmp_path / "store"),
    }
    command = [
        sys.executable,
        "-m",
        "pipelines",
        "batch",
        folder + b"/jobs.csv",
        "--out",
        folder + b"/out",
        "--quiet",
    ]
    done = subprocess.run(command, capture_output=True, timeout=120, env=environment, cwd=ROOT)
    assert done.returncode == 0, done.stderr.decode(errors="replace")
    with open(folder + b"/out/results.csv", "rb") as stream:
        assert "Ada Müller" in stream.read().decode()


def test_text_is_opened_with_its_encoding_named():
    """Under ``LC_ALL=C`` the default is ASCII."""
    for path in (
        path for room in ("a2v", "pipelines", "export") for path in (ROOT / room).rglob("*.py")
    ):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or any(
                word.arg == "encoding" for word in node.keywords
            ):
                continue
            plain = isinstance(node.func, ast.Name) and node.func.id == "open"
            text = isinstance(node.func, ast.Attribute) and node.func.attr in (
                "read_text",
                "write_text",
            )
            modes = [str(one.value) for one in node.args if isinstance(one, ast.Constant)]
            assert not text, f"{path}:{node.lineno}"
            assert not plain or any("b" in mode for mode in modes), f"{path}:{node.lineno}"

"""A web page in one file that runs a motion model: no server, no network, no Python.

The scripts are in ``browser`` beside this file: `sample.js` is the same algorithm as
``export/sample.py``, and `random.js` draws numpy's random numbers, so that a seed gives the same
clip. They use onnxruntime-web, which is installed once from npm by the command that ``a2v doctor``
prints. It is copied into the page.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from a2v.animation.posture import SOFT_KNEE, table_of
from a2v.errors import InputError
from a2v.formats.gltf.reading import read_glb
from a2v.io import atomic_path, read_bytes
from a2v.kinematics.limbs import legs_of
from a2v.kinematics.names import canonical_joints, missing_joints, split_side
from a2v.motion.card import STEP_FORMAT, WINDOW_FORMAT
from a2v.motion.model import MotionModel
from a2v.motion.names import BUNDLED
from a2v.motion.settling import air_seconds, rises
from a2v.motion.smoothing import SMOOTHED
from a2v.npm import NpmPackages
from a2v.rendering.page import MAX_PAGE_BYTES, stage_script, viewer_script
from a2v.rendering.stickfigure import StickSettings
from a2v.sessions import read_metadata

PACKAGES = NpmPackages("page", ("onnxruntime-web@1.30.0",))
"""The package that runs the model in a browser (MIT). The page takes its smallest build,
WebAssembly with SIMD, and runs it on one thread."""

RUNTIME = ("ort.wasm.min.js", "ort-wasm-simd-threaded.mjs", "ort-wasm-simd-threaded.wasm")
"""The files of that build: the interface, the loader of the engine, the engine."""

MAX_SECONDS = 30.0
_KEPT = (
    "format",
    "actions",
    "active",
    "bone_lengths",
    "context_frames",
    "window_frames",
    "frames",
    "fps",
    "guidance",
    "latent_size",
    "hidden_size",
)


def write_motion_page(
    path: str | os.PathLike[str],
    model: MotionModel,
    character: str | os.PathLike[str] | None = None,
    *,
    action: str | None = None,
    seed: int = 0,
    seconds: float = 5.0,
    title: str = "a2v",
) -> None:
    """Write an HTML page that samples `model`. Action, seed, length and guidance can be chosen
    there.

    Clips equal those of ``export/sample.py`` and, for the same seed, of `MotionModel.sample`, to a
    tenth of a millimeter.

    Parameters
    ----------
    path
        Ends in ``.html``; written atomically.
    model : MotionModel
    character : path or None
        A binary glTF of a skinned person that shows the motion; a stick figure by default.
    action : str or None
        First action; the model's first action by default.
    seed : int
    seconds : float
        Initial length, 1 to 30.
    title : str

    Raises
    ------
    InputError
        An unknown action, a number out of range, a character without a person's bones, or a page
        that would be too large.
    MissingDependencyError
        onnxruntime-web is not installed. The message has the command.
    """
    if not 1 <= seconds <= MAX_SECONDS:
        raise InputError(
            f"seconds is {seconds:g}; a page makes clips of 1 to {MAX_SECONDS:g} seconds"
        )
    if not 0 <= seed < 2**53:
        raise InputError(f"seed is {seed}; a page takes 0 to 2^53 - 1")
    first = None if action is None else model.label(action)
    dist = (
        PACKAGES.demand("a page that makes motions", "nothing is downloaded later")
        / "onnxruntime-web"
        / "dist"
    )
    script, loader, engine = (read_bytes(dist / name) for name in RUNTIME)
    graph, guided = page_graph(model.path)
    figure, glb = (_sticks(model), b"") if character is None else _character(model, character)
    about: dict[str, Any] = {
        "figure": figure,
        "model": _name(model),
        "action": first,
        "seed": seed,
        "seconds": seconds,
    }
    about |= {"meta": _meta(model, guided), "words": _words(model)}
    text = json.dumps(about, separators=(",", ":")).replace("<", "\\u003c")
    parts = {"title": html.escape(title).encode(), "about": text.encode(), "runtime": script}
    packed = {"model": graph, "character": glb, "engine": engine, "loader": loader}
    pieces = _pieces(parts | {name: _packed(data) for name, data in packed.items()})
    if sum(map(len, pieces)) > MAX_PAGE_BYTES:
        raise InputError(
            f"the page would have {sum(map(len, pieces)) >> 20} MB; expected at most "
            f"{MAX_PAGE_BYTES >> 20} MB"
        )
    with atomic_path(path) as temporary, open(temporary, "wb") as stream:
        stream.writelines(pieces)


def _pieces(parts: dict[str, bytes]) -> list[bytes]:
    """Return the parts of the page: ``browser/index.html`` with `parts` and our own scripts
    inserted."""
    own = {
        name: _part(f"{name}.js").encode()
        for name in ("random", "sample", "plant", "figure", "save", "main")
    }
    parts = parts | own | {"viewer": viewer_script().encode(), "stage": stage_script().encode()}
    words = re.split(r"\$([a-z]+)\b", _part("index.html"))
    return [parts[word] if place % 2 else word.encode() for place, word in enumerate(words)]


def page_graph(path: Path) -> tuple[bytes, bool]:
    """Return a model's graph for the page: joints are the only output, and guidance is an input if
    the model is guided.

    Returns
    -------
    graph : bytes
        ONNX, without the description.
    guided : bool
        Whether there is the input ``guidance`` (1,) float32.
    """
    proto = onnx.load_model_from_string(read_bytes(path))
    strength = json.loads(
        next((entry.value for entry in proto.metadata_props if entry.key == "a2v"), "{}")
    ).get("guidance")
    graph = proto.graph
    defaults = {item.name for item in graph.initializer}
    keep = [
        item for item in graph.input if item.name not in defaults
    ]  # constraints keep their default: none
    del graph.input[:]
    graph.input.extend(keep)
    joints = next(item for item in graph.output if item.name == "joints")
    del graph.output[:]
    graph.output.append(joints)
    del proto.metadata_props[:]
    makers = {name: node for node in graph.node for name in node.output}
    numbers = {item.name: numpy_helper.to_array(item) for item in graph.initializer}
    found = [
        node
        for node in graph.node
        if node.op_type == "Mul"
        and strength is not None
        and (by := numbers.get(node.input[1])) is not None
        and by.size == 1
        and float(by.reshape(())) == strength
        and node.input[0] in makers
        and makers[node.input[0]].op_type == "Sub"
    ]
    for node in found:  # free + guidance * (pushed - free), as in FlowNetwork.integrate
        node.input[1] = "guidance"
    if found:
        graph.input.append(helper.make_tensor_value_info("guidance", TensorProto.FLOAT, (1,)))
        used = {name for node in graph.node for name in node.input}
        for item in [item for item in graph.initializer if item.name not in used]:
            graph.initializer.remove(item)
    return proto.SerializeToString(), bool(found)


def _meta(model: MotionModel, guided: bool) -> dict[str, Any]:
    said = read_metadata(model.path, (STEP_FORMAT, WINDOW_FORMAT), "motion model")
    kept = {name: said[name] for name in _KEPT if name in said and (name != "guidance" or guided)}
    return kept | {"skeleton": _skeleton(model), "feet": _feet(model)}


def _feet(model: MotionModel) -> dict[str, Any]:
    """Return the settings of `plant.js`: the joints of the legs and, for each action, the longest
    time in the air, whether the action goes up, and the width of the smoothing."""
    card = model.card
    return {
        "legs": [list(leg) for leg in legs_of(model.skeleton)],
        "air": [air_seconds(card, action) for action in card.actions],
        "rises": [rises(card, action) for action in card.actions],
        "smoothed": [SMOOTHED.get(action, 0.0) for action in card.actions],
    }


def _skeleton(model: MotionModel) -> dict[str, Any]:
    """The skeleton for files of clips: parents, names, and rest directions of the bones."""
    own = model.skeleton
    return {
        "parents": own.parents.tolist(),
        "names": list(model.card.joint_names),
        "rest": np.round(own.rest_directions, 6).tolist(),
    }


def _words(model: MotionModel) -> list[str]:
    """Searchable words of each action besides its name."""
    card, none = model.card, [()] * len(model.actions)
    return [
        " ".join((*words, *traits))
        for words, traits in zip(card.descriptions or none, card.traits or none, strict=True)
    ]


def _name(model: MotionModel) -> str:
    return next(
        (name for name, file in BUNDLED.items() if file == model.path.name), model.path.name
    )


def _sticks(model: MotionModel) -> dict[str, Any]:
    from matplotlib.colors import to_hex

    drawn = StickSettings()
    colors = {"left": to_hex(drawn.left), "right": to_hex(drawn.right), "": to_hex(drawn.middle)}
    return {"colors": [colors[split_side(name)[0]] for name in model.card.joint_names]}


def _character(model: MotionModel, path: str | os.PathLike[str]) -> tuple[dict[str, Any], bytes]:
    """Return the tables of joints by which the page moves a character's bones, and the character's
    bytes."""
    glb = read_glb(path)
    skins = glb.items("skins")
    if not skins:
        raise glb.fail("has no skin")
    nodes, parents = glb.items("nodes"), glb.node_matrices()[1]
    inside = set(glb.joints(skins[0]))
    names = [
        str(node.get("name", "")) if index in inside else "" for index, node in enumerate(nodes)
    ]
    bones = canonical_joints(names, parents)
    source = canonical_joints(model.card.joint_names, model.skeleton.parents.tolist())
    if missing := missing_joints(bones):
        raise glb.fail(f"has no bone for {', '.join(missing[:4])}")
    if missing := missing_joints(source):
        raise InputError(
            f"{model.path.name} has no {', '.join(missing[:4])} among its joints; leave the "
            "character out"
        )
    table = table_of(model.skeleton.name)
    neutral = {"knee": SOFT_KNEE} | {
        name: table[name] for name in ("lean", "neck", "dip", "knee") if name in table
    }
    return {"bones": bones, "source": source, "neutral": neutral}, read_bytes(path)


def _packed(data: bytes) -> bytes:
    return base64.b64encode(gzip.compress(data, 6, mtime=0)) if data else b""


def _part(name: str) -> str:
    return (Path(__file__).with_name("browser") / name).read_text(encoding="utf-8")

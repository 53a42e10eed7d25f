"""Motions and a character of other tools together, through the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.formats.gltf.reading import Gltf, read_glb
from pipelines.commands import retarget as command
from pipelines.options import parse


def _heights(file: Gltf, clip: int, frame: int) -> dict[str, float]:
    """Height of every named node in a frame of a clip."""
    nodes = [dict(node) for node in file.json["nodes"]]
    animation = file.json["animations"][clip]
    for channel in animation["channels"]:
        values = file.accessor(animation["samplers"][channel["sampler"]]["output"])
        nodes[channel["target"]["node"]][channel["target"]["path"]] = values[frame].tolist()
    world = Gltf(file.path, {**file.json, "nodes": nodes}, file.binary).node_matrices()[0]
    return {
        str(node.get("name", "")): float(matrix[1, 3])
        for node, matrix in zip(nodes, world, strict=True)
    }


def test_a_character_of_sketchfab_walks_and_stands_on_its_hands(
    data_dir: Path, tmp_path: Path
) -> None:
    folder = data_dir / "strangers"
    source = folder / "sketchfab_numbered_names.glb"
    motions = [folder / f"{name}.bvh" for name in ("r09_reference_root", "r28_handstand")]
    if missing := [file for file in (source, *motions) if not file.is_file()]:
        pytest.skip(f"{missing[0]} is not present")
    words = ("--character", str(source), "--motions", ",".join(map(str, motions)))
    out = tmp_path / "out.glb"
    answer = command.run(
        parse(
            command.Options,
            (*words, "--out", str(out)),
            command="retarget",
            about=command.HELP,
            examples=command.EXAMPLES,
        )
    )
    assert answer.notes == [
        "r09_reference_root: Reference above the pelvis became part of its path"
    ]
    file = read_glb(out)
    walking, on_hands = (_heights(file, clip, 30) for clip in (0, 1))
    assert np.all(np.diff([walking[n] for n in ("foot_l_57", "pelvis_65", "head_02")]) > 0.4)
    assert np.all(np.diff([on_hands[n] for n in ("head_02", "pelvis_65", "foot_l_57")]) > 0.4)
    assert abs(on_hands["hand_l_24"]) < 0.3

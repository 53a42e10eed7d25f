"""Draw a sheet of characters of others that move: five of other proportions, and a mesh without
bones, made of one avatar, each with an action.

python scripts/draw_retargeted.py AVATAR.glb SHEET.png [--action Walk]
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from a2v.animation import RetargetSettings, retarget
from a2v.formats.gltf.document import Document, pack_glb
from a2v.formats.gltf.mesh import add_mesh
from a2v.formats.gltf.people import Person, read_person
from a2v.kinematics.names import canonical_joints
from a2v.motion.timeline import Take
from a2v.types import FloatArray, Motion, Surface
from pipelines.mesh_rig import rig_mesh
from pipelines.requests.motion import PlanOptions, read_plan

FRAMES = 6
KINDS: dict[str, dict[str, float]] = {
    "long arms": {"elbow": 1.5, "wrist": 1.5},
    "short legs": {"knee": 0.55, "ankle": 0.55},
    "child": {"knee": 0.75, "ankle": 0.75, "elbow": 0.75, "wrist": 0.75, "head": 1.2},
    "toy": {"knee": 0.45, "ankle": 0.45, "elbow": 0.5, "wrist": 0.5, "shoulder": 1.3, "head": 1.6},
    "giant": {"knee": 1.3, "ankle": 1.3, "shoulder": 1.4, "elbow": 1.15, "wrist": 1.15},
}
"""Factors of the bones that end at joints."""


def reshaped(source: Path, target: Path, factors: dict[str, float]) -> None:
    """Write an avatar with bones of other lengths; its skin follows."""
    person = read_person(source)
    file, body = person.file, person.body
    found = canonical_joints(body.bone_names, body.bone_parents.tolist())
    tree = json.loads(json.dumps(file.json))
    for joint, bone in found.items():
        factor = factors.get(joint.split("_")[-1])
        node = tree["nodes"][person.nodes[bone]]
        if factor and "translation" in node:
            node["translation"] = [factor * value for value in node["translation"]]
    target.write_bytes(pack_glb(tree, file.binary))


def without_bones(source: Path, target: Path) -> None:
    """Write the mesh of an avatar in its pose, without its bones."""
    body = read_person(source).body
    document = Document("mesh")
    gray = np.full(body.vertices.shape, 0.6, np.float32)
    (mesh,) = add_mesh(
        document, Surface(vertices=body.vertices, faces=body.faces, colors=gray), "mesh", 92
    )
    document.json["scenes"][0]["nodes"] = [document.node(name="mesh", mesh=mesh)]
    document.write(target)


def posed(person: Person, moves: FloatArray) -> FloatArray:
    """Return the vertices (T, V, 3) of a person's clip."""
    body = person.body
    matrices = moves @ np.linalg.inv(body.rest_transforms.astype(np.float64))
    points = np.concatenate([body.vertices, np.ones((len(body.vertices), 1))], axis=1)
    blended = np.einsum("vb,tbac->tvac", body.weights.astype(np.float64), matrices)
    return np.asarray(np.einsum("tvac,vc->tva", blended, points)[..., :3])


def draw(axes, vertices: FloatArray, faces: np.ndarray, turn: float) -> None:  # type: ignore[no-untyped-def]
    """Draw a shaded mesh, seen from a heading in degrees, above the ground."""
    cosine, sine = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    middle = vertices.mean(axis=0) * (1, 0, 1)
    seen = (vertices - middle) @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]).T
    corners = seen[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    front = normal[:, 2] > 0
    order = np.argsort(corners[front][:, :, 2].mean(axis=1))
    light = np.clip(0.25 + 0.75 * (normal[front] @ [0.3, 0.5, 0.81]), 0, 1)[order]
    axes.add_collection(
        PolyCollection(
            corners[front][order][..., :2],
            facecolors=light[:, None] * [0.8, 0.85, 1.0],
            edgecolors="none",
        )
    )
    height = float(vertices[..., 1].max())
    axes.plot([-height, height], [0, 0], color="0.5", linewidth=0.5)
    axes.set(
        xlim=(-0.4 * height, 0.4 * height), ylim=(-0.05 * height, 1.1 * height), aspect="equal"
    )
    axes.axis("off")


def main() -> None:
    """Make the sheet and print the heights of the lowest points."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("avatar", type=Path)
    parser.add_argument("sheet", type=Path)
    parser.add_argument("--action", default="Walk")
    options = parser.parse_args()
    made = read_plan(PlanOptions(action=options.action)).make(Take(frames=60, fps=20.0, seed=0))
    motion: Motion = made[0] if made.batch else made
    figure = Figure(figsize=(1.5 * FRAMES, 2 * (len(KINDS) + 1)), dpi=80)
    figure.subplots_adjust(0, 0, 1, 0.98, 0, 0.08)
    with tempfile.TemporaryDirectory() as folder:
        for row, kind in enumerate([*KINDS, "no bones"]):
            path = Path(folder) / "a.glb"
            if kind == "no bones":
                without_bones(options.avatar, Path(folder) / "mesh.glb")
                rig_mesh(Path(folder) / "mesh.glb", path, name=options.avatar)
            else:
                reshaped(options.avatar, path, KINDS[kind])
            person = read_person(path)
            moves = retarget(motion, person.body, settings=RetargetSettings())
            chosen = np.linspace(0, len(moves) - 1, FRAMES).astype(int)
            vertices = posed(person, moves[chosen])
            low = vertices[..., 1].min(axis=1)
            print(f"{kind}: lowest points {np.round(1000 * low).astype(int).tolist()} mm")
            for column in range(FRAMES):
                axes = figure.add_subplot(len(KINDS) + 1, FRAMES, row * FRAMES + column + 1)
                draw(axes, vertices[column], person.body.faces, 35.0)
                if not column:
                    axes.set_title(kind, fontsize=8, loc="left")
    figure.savefig(options.sheet)


if __name__ == "__main__":
    main()

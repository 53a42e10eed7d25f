"""Measure the flicker of frames: `python -m benchmarks.flicker` (minutes).

A rendered frame is the truth plus an error. An error that stays is not seen in motion, one that
changes from frame to frame is: flicker is the root mean square of the error's change between
consecutive frames, in levels of 255. The truth is the same picture with many samples, without
denoising. Beside it: whole frames path traced, independent noise (another seed for each frame), and
no denoising.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import time
from pathlib import Path

import numpy as np

from a2v.animation import ArapDeformer, bind
from a2v.body import load_body_model, make_body
from a2v.geometry.colors import linear_to_srgb
from a2v.geometry.mesh import vertex_normals
from a2v.rendering import Layers, Renderer, denoise, follow_cameras
from a2v.types import Character, FloatArray, RenderSettings, Surface


def subject() -> Character:
    """Return Anny's adult with a fine pattern of colors, which shows lost detail and moving noise."""
    body = make_body(load_body_model(), grounded=True)
    normals = vertex_normals(body.vertices.astype(np.float64), body.faces.astype(np.int64))
    stripes = 0.5 + 0.25 * np.sin(60 * body.vertices) * (0.6, 1.0, 0.8)
    return bind(
        Surface(
            vertices=(body.vertices + 0.005 * normals).astype(np.float32),
            faces=body.faces,
            colors=stripes.astype(np.float32),
        ),
        body,
    )


def swing(character: Character, frames: int, fps: float) -> FloatArray:
    """Bone transforms (T, B, 4, 4): one arm lifts by .36 radians a second while the body drifts
    along x by 5 cm a second."""
    model = load_body_model()
    clip = []
    for step in range(frames):
        turns = np.zeros((model.n_bones, 3), np.float32)
        turns[model.bone("upperarm01.L"), 2] = 0.36 / fps * step
        clip.append(
            make_body(
                model,
                turns,
                translation=np.array(
                    [0.048 / fps * step, character.surface.vertices[:, 1].ptp() / 2, 0]
                ),
            ).bone_transforms
        )
    moved = np.stack(clip)
    moved[:, :, 1, 3] += character.body.bone_transforms[0, 1, 3] - moved[0, 0, 1, 3]
    return moved


def flicker(errors: FloatArray, where: np.ndarray) -> float:
    """Root mean square change of errors (T, H, W, 3) between frames over pixels (T, H, W),
    levels."""
    change = np.diff(errors, axis=0)[where[1:] & where[:-1]]
    return float(np.sqrt(np.mean(change**2)))


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--fps", type=float, default=12, help="of the same motion")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--truth", type=int, default=512, help="samples a pixel of the reference")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    character = subject()
    settings = RenderSettings(size=options.size, spp=8, threads=1)
    deformer, renderer = ArapDeformer(character), Renderer(character.surface, settings)
    vertices = np.stack([deformer(t) for t in swing(character, options.frames, options.fps)])
    still = dataclasses.replace(settings, follow=False)
    cameras = follow_cameras(vertices, still)["front"]

    def shown(layers: Layers, clean: bool) -> FloatArray:
        return 255 * linear_to_srgb(denoise(layers) if clean else layers.color)

    start = time.process_time()
    pictures: dict[str, list[FloatArray]] = {
        "truth": [],
        "ours": [],
        "all of it path traced": [],
        "another seed a frame": [],
        "not denoised": [],
    }
    person, ground = [], []
    for frame, cloud in enumerate(vertices):
        truth = renderer.layers(cloud, cameras[0], spp=options.truth, seed=1000 + frame)
        ours, other = (
            renderer.layers(cloud, cameras[0]),
            renderer.layers(cloud, cameras[0], seed=1 + frame),
        )
        pictures["truth"].append(shown(truth, False))
        pictures["ours"].append(255 * linear_to_srgb(renderer.linear(cloud, cameras[0])))
        pictures["all of it path traced"].append(shown(ours, True))
        pictures["another seed a frame"].append(shown(other, True))
        pictures["not denoised"].append(shown(ours, False))
        mask = renderer.mask(cloud, cameras[0])
        person.append(mask > 0.99)
        ground.append((mask < 0.01) & (truth.alpha > 0.99))
    stacks = {name: np.stack(images) for name, images in pictures.items()}
    where = {"person": np.stack(person), "ground": np.stack(ground)}
    rows = []
    for name in ("ours", "all of it path traced", "another seed a frame", "not denoised"):
        errors = stacks[name] - stacks["truth"]
        row = {"name": name} | {
            f"flicker_{part}": round(flicker(errors, mask), 3) for part, mask in where.items()
        }
        row |= {
            f"error_{part}": round(float(np.sqrt(np.mean(errors[mask] ** 2))), 3)
            for part, mask in where.items()
        }
        rows.append(row)
    print(
        f"{options.frames} frames at {options.fps:g} a second, {options.size} px, 8 spp, truth "
        f"{options.truth} spp; levels of 255; {time.process_time() - start:.0f} CPU s"
    )
    print(
        "| | flicker, person | flicker, ground | error, person | error, ground "
        "|\n|---|---|---|---|---|"
    )
    for row in rows:
        print(
            f"| {row['name']} | {row['flicker_person']} | {row['flicker_ground']} | "
            f"{row['error_person']} | {row['error_ground']} |"
        )
    if options.out:
        options.out.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()

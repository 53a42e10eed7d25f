"""Measure the seconds per 512 px frame at equal noise: a2v's Mitsuba 3 and Blender's Cycles.

python benchmarks/rendering.py [--cycles-python /path/to/python/with/bpy] [--out
docs/results/rendering.json]

Both render the same person (an avatar of $A2V_DATA), ground, sun, spot and fill light, one bounce,
box filter, one thread. Noise is PSNR in sRGB against the same renderer's own picture at many
samples. `bpy` needs its own environment (``python3.11 -m venv E && E/bin/pip install bpy``);
without `--cycles-python` that half is left out, and the table says so. Times are the minimum of the
repeats, in CPU seconds of all threads and by the wall clock. The comparison at equal noise uses the
wall clock: run it on an idle machine.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.io import atomic_path
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.avatars import a_pose
from a2v.rendering import LookSettings, Renderer, ViewCamera, follow_cameras
from a2v.types import RenderSettings, Surface

ROOT = Path(__file__).resolve().parent.parent
OURS = ((1, 1), (2, 1), (4, 1), (8, 1), (16, 1), (32, 1), (8, 0), (32, 0), (128, 0))
THEIRS = ((1, 1), (2, 1), (4, 1), (8, 1), (16, 1), (32, 1), (64, 1), (8, 0), (32, 0), (128, 0))


def psnr(picture: np.ndarray, truth: np.ndarray) -> float:
    """Peak signal-to-noise ratio, dB, of linear pictures compared in sRGB."""
    return float(-10 * np.log10(np.mean((linear_to_srgb(picture) - linear_to_srgb(truth)) ** 2)))


def weld(surface: Surface) -> Surface:
    """Merge vertices at one place, so that both renderers smooth normals over texture seams."""
    vertices, index = np.unique(surface.vertices, axis=0, return_inverse=True)
    faces = index.ravel()[surface.faces].astype(np.int32)
    keep = (
        (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 0] != faces[:, 2])
    )
    assert surface.uv is not None
    return Surface(
        vertices=vertices,
        faces=faces[keep],
        colors=np.full_like(vertices, 0.5),
        uv=surface.uv[keep],
        texture=surface.texture,
    )


def ours(
    surface: Surface,
    settings: RenderSettings,
    scene: LookSettings,
    camera: ViewCamera,
    reference: int,
    repeats: int,
) -> dict[str, Any]:
    """Pictures and times of a2v at every row of `OURS`."""
    renderer = Renderer(surface, settings, scene)
    truth = renderer.layers(surface.vertices, camera, spp=reference, seed=99).color
    rows = []
    for samples, denoised in OURS:
        one = Renderer(surface, replace(settings, spp=samples), scene) if denoised else renderer
        best = [np.inf, np.inf]
        for repeat in range(repeats + 1):
            moved = (
                surface.vertices + np.float32([1e-6 * (repeat + 1), 0, 0])
                if repeat < repeats
                else surface.vertices
            )
            wall, cpu = time.perf_counter(), time.process_time()
            picture = (
                one.linear(moved, camera)
                if denoised
                else one.layers(moved, camera, spp=samples).color
            )
            if repeat:
                best = [
                    min(best[0], time.perf_counter() - wall),
                    min(best[1], time.process_time() - cpu),
                ]
        rows.append(
            {
                "spp": samples,
                "denoised": bool(denoised),
                "psnr": psnr(picture, truth),
                "wall": best[0],
                "cpu": best[1],
            }
        )
    return {"rows": rows, "truth": truth, "variant": renderer.variant}


def theirs(
    python: str,
    surface: Surface,
    settings: RenderSettings,
    scene: LookSettings,
    camera: ViewCamera,
    reference: int,
    repeats: int,
) -> dict[str, Any]:
    """Pictures and times of Cycles at every row of `THEIRS`, from a child process."""
    reach = float(np.linalg.norm(np.subtract(scene.spot_position, (0.0, 0.9, 0.0))))
    plan = np.array([*((*row, repeats) for row in THEIRS), (reference, 0, 0)])
    with tempfile.TemporaryDirectory() as name:
        given, made = Path(name) / "scene.npz", Path(name) / "pictures.npz"
        np.savez(
            given,
            vertices=surface.vertices,
            faces=surface.faces,
            uv=surface.uv,
            texture=surface.texture,
            ground=scene.ground_albedo,
            fill=srgb_to_linear(np.array(scene.background)),
            sun=np.array(scene.sun),
            sun_direction=np.array(scene.sun_direction),
            sun_angle=np.radians(scene.sun_angle),
            spot_radius=scene.spot_radius,
            spot_radiance=np.array(scene.spot)
            * (reach**2 + scene.spot_radius**2)
            / scene.spot_radius**2,
            spot_position=np.array([camera.target[0], 0, camera.target[2]]) + scene.spot_position,
            target=np.array(camera.target),
            axes=camera.axes,
            origin=np.array(camera.origin),
            fov=np.radians(camera.fov),
            size=settings.size,
            threads=settings.threads,
            bounces=scene.bounces,
            plan=plan,
        )
        script = str(Path(__file__).with_name("rendering_cycles.py"))
        child = subprocess.run(
            [python, script, str(given), str(made)],
            capture_output=True,
            text=True,
            cwd=name,
            check=False,
        )
        if child.returncode:
            raise SystemExit(f"Cycles failed: {child.stderr.strip().splitlines()[-1:]}")
        data = dict(np.load(made))
    truth = data[f"picture{len(THEIRS)}"]
    rows = [
        {
            "spp": samples,
            "denoised": bool(on),
            "psnr": psnr(data[f"picture{i}"], truth),
            "wall": float(data["wall"][i]),
            "cpu": float(data["cpu"][i]),
        }
        for i, (samples, on) in enumerate(THEIRS)
    ]
    return {"rows": rows, "truth": truth, "version": str(data["version"])}


def seconds_at(rows: list[dict[str, Any]], target: float) -> float | None:
    """Return the wall-clock seconds at which denoised pictures reach `target` dB, interpolated
    along the measured curve; None if they never do. On one thread of an idle machine these are CPU
    seconds; Cycles' own count is twice as high, because one of its threads waits busily.
    """
    curve = sorted(
        ((row["wall"], row["psnr"]) for row in rows if row["denoised"]), key=lambda pair: pair[0]
    )
    best = np.maximum.accumulate([value for _, value in curve])
    if best[-1] < target:
        return None
    return float(np.interp(target, best, [cost for cost, _ in curve]))


def main() -> int:
    """Run both, print the tables, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cycles-python", help="a Python with bpy")
    parser.add_argument("--avatar", default="NHPI_M_1_Casual")
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--reference", type=int, default=1024)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--pictures", type=Path, help="folder for the two references, to look at")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "results" / "rendering.json")
    given = parser.parse_args()
    data = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data"))
    surface = weld(load_avatar(data / "avatars" / f"{given.avatar}.glb").surface(a_pose()))
    settings, scene = RenderSettings(size=given.size, threads=1), LookSettings(grid=0)
    camera = follow_cameras(surface.vertices[None], settings)["front"][0]
    result: dict[str, Any] = {
        "settings": {
            "size": given.size,
            "reference_spp": given.reference,
            "threads": 1,
            "avatar": given.avatar,
            "scene": asdict(scene),
        },
        "machine": {
            "python": platform.python_version(),
            "processor": platform.machine(),
            "cores": os.cpu_count(),
            "load": os.getloadavg(),
        },
    }
    a = ours(surface, settings, scene, camera, given.reference, given.repeats)
    result["mitsuba"] = {"variant": a["variant"], "rows": a["rows"]}
    b = None
    if given.cycles_python:
        b = theirs(
            given.cycles_python, surface, settings, scene, camera, given.reference, given.repeats
        )
        result["cycles"] = {
            "version": b["version"],
            "rows": b["rows"],
            "references_psnr": psnr(a["truth"], b["truth"]),
        }
        result["equal_noise"] = []
        for row in a["rows"]:
            if row["denoised"]:
                cost = seconds_at(b["rows"], row["psnr"])
                result["equal_noise"].append(
                    {
                        "psnr": row["psnr"],
                        "mitsuba_spp": row["spp"],
                        "mitsuba": row["wall"],
                        "cycles": cost,
                        "ratio": cost / row["wall"] if cost else None,
                    }
                )
    if given.pictures:
        from PIL import Image

        given.pictures.mkdir(parents=True, exist_ok=True)
        for name, part in (("mitsuba", a), ("cycles", b)):
            if part:
                Image.fromarray(np.rint(255 * linear_to_srgb(part["truth"])).astype(np.uint8)).save(
                    given.pictures / f"{name}.png"
                )
    print("| renderer | spp | denoised | PSNR dB | CPU s | wall s |\n|---|---|---|---|---|---|")
    for name, part in (("Mitsuba 3 (a2v)", a), ("Cycles", b)):
        for row in part["rows"] if part else []:
            print(
                f"| {name} | {row['spp']} | {'yes' if row['denoised'] else 'no'} | "
                f"{row['psnr']:.2f} | {row['cpu']:.2f} | {row['wall']:.2f} |"
            )
    if b:
        print(f"\nThe two references agree to {result['cycles']['references_psnr']:.1f} dB.")
        for row in result["equal_noise"]:
            cost = (
                f"{row['cycles']:.2f} s, {row['ratio']:.1f} times ours"
                if row["cycles"]
                else "not reached"
            )
            print(
                f"at {row['psnr']:.2f} dB: ours {row['mitsuba']:.2f} s ({row['mitsuba_spp']} spp), "
                f"Cycles {cost}"
            )
    else:
        print(
            "\nCycles was not run: give --cycles-python, a Python where `pip install bpy` worked."
        )
    with atomic_path(given.out) as temporary:
        temporary.write_text(json.dumps(result, indent=1) + "\n")
    print(given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())

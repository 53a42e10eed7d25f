"""The Blender half of ``benchmarks/rendering.py``: runs where `bpy` is installed and imports
nothing of a2v.

    python rendering_cycles.py SCENE.npz OUT.npz

SCENE.npz holds the mesh, texture, lights and camera that ``rendering.py`` wrote (y up); OUT.npz
gets one linear picture and one time for every row of `plan` (samples, denoised or not).
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

TO_BLENDER = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # y up to z up


def material(name: str, color: tuple[float, ...] | None = None, image: object = None) -> object:
    """A Lambertian material of one color or with a texture."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    out, diffuse = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Roughness"].default_value = 0.0  # Lambertian, as Mitsuba's diffuse
    links.new(diffuse.outputs[0], out.inputs["Surface"])
    if image is None:
        diffuse.inputs["Color"].default_value = (*color, 1)
    else:
        texture = nodes.new("ShaderNodeTexImage")
        texture.image, texture.interpolation, texture.extension = image, "Linear", "EXTEND"
        links.new(texture.outputs["Color"], diffuse.inputs["Color"])
    return made


def mesh(name: str, vertices: np.ndarray, faces: np.ndarray, look: object) -> object:
    """An object in the scene from y-up vertices."""
    data = bpy.data.meshes.new(name)
    data.from_pydata((vertices @ TO_BLENDER.T).tolist(), [], faces.tolist())
    data.materials.append(look)
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    return made


def orient(thing: object, axes: np.ndarray, place: np.ndarray) -> None:
    """Return as columns of `axes` where the object's x, y and z point (y-up world)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = TO_BLENDER @ axes, TO_BLENDER @ place
    thing.matrix_world = Matrix(matrix.tolist())


def frame_along(backward: np.ndarray) -> np.ndarray:
    """Return the axes of a lamp that shines against `backward` (Blender's lamps shine along -z)."""
    backward = backward / np.linalg.norm(backward)
    side = np.cross([0.0, 0, 1] if abs(backward[2]) < 0.9 else [1.0, 0, 0], backward)
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(backward, side), backward], axis=1)


def build(given: dict[str, np.ndarray], folder: Path) -> object:
    """The scene that `rendering.py` described; returns the person."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    texture_path = folder / "texture.png"
    image = bpy.data.images.new("texture", given["texture"].shape[1], given["texture"].shape[0])
    flipped = given["texture"][::-1].astype(np.float32) / 255
    image.pixels.foreach_set(
        np.concatenate([flipped, np.ones((*flipped.shape[:2], 1), np.float32)], axis=2).ravel()
    )
    image.filepath_raw, image.file_format = str(texture_path), "PNG"
    image.save()
    image = bpy.data.images.load(str(texture_path))
    image.colorspace_settings.name = "sRGB"
    person = mesh("person", given["vertices"], given["faces"], material("person", image=image))
    layer = person.data.uv_layers.new(name="uv")
    layer.data.foreach_set("uv", given["uv"].astype(np.float32).ravel())
    for polygon in person.data.polygons:
        polygon.use_smooth = True
    big = 100.0
    corners = np.array([[-big, 0, -big], [-big, 0, big], [big, 0, big], [big, 0, -big]])
    mesh(
        "ground",
        corners,
        np.array([[0, 1, 2, 3]]),
        material("ground", tuple(given["ground"].tolist())),
    )
    world = bpy.data.worlds.new("world")
    scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*given["fill"].tolist(), 1)
    sun = bpy.data.lights.new("sun", "SUN")
    sun.angle, sun.energy, sun.color = (
        float(2 * given["sun_angle"]),
        float(np.pi * given["sun"].max()),
        (given["sun"] / given["sun"].max()).tolist(),
    )
    lamp = bpy.data.objects.new("sun", sun)
    scene.collection.objects.link(lamp)
    orient(lamp, frame_along(given["sun_direction"]), given["sun_direction"] * 10)
    spot = bpy.data.lights.new("spot", "AREA")
    radius = float(given["spot_radius"])
    spot.shape, spot.size = "DISK", 2 * radius
    radiance = given["spot_radiance"]
    spot.energy, spot.color = (
        float(radiance.max() * np.pi * np.pi * radius**2),
        (radiance / radiance.max()).tolist(),
    )
    lamp = bpy.data.objects.new("spot", spot)
    scene.collection.objects.link(lamp)
    orient(
        lamp,
        frame_along(
            given["spot_position"] - np.array([given["target"][0], 0.9, given["target"][2]])
        ),
        given["spot_position"],
    )
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "HORIZONTAL", float(given["fov"])
    eye = bpy.data.objects.new("camera", camera)
    scene.collection.objects.link(eye)
    orient(eye, given["axes"].T, given["origin"])
    scene.camera = eye
    return person


def set_up(given: dict[str, np.ndarray]) -> None:
    """Set the path length, filter and denoiser of the other half."""
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine, cycles.device = "CYCLES", "CPU"
    render.resolution_x = render.resolution_y = int(given["size"])
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", int(given["threads"])
    render.use_persistent_data = True  # animators switch this on: keep the scene between frames
    render.use_compositing = render.use_sequencer = False
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles.use_adaptive_sampling = False
    cycles.max_bounces = cycles.diffuse_bounces = int(given["bounces"]) - 1
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1.0
    cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.denoising_input_passes, cycles.denoising_prefilter, cycles.denoising_quality = (
        "RGB_ALBEDO_NORMAL",
        "NONE",
        "HIGH",
    )
    cycles.sample_clamp_indirect = 0.0
    cycles.use_light_tree = True


def main() -> None:
    """Render every row of the plan."""
    scene_path, out_path = Path(sys.argv[1]), Path(sys.argv[2])
    given = dict(np.load(scene_path))
    results: dict[str, np.ndarray] = {"version": np.array(bpy.app.version_string)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        person = build(given, folder)
        set_up(given)
        scene = bpy.context.scene
        base = given["vertices"] @ TO_BLENDER.T
        wall, cpu = [], []
        for row, (samples, denoised, repeats) in enumerate(given["plan"]):
            # the reference must not share its first samples with the compared pictures
            scene.cycles.seed = 0 if repeats else 99
            scene.cycles.samples, scene.cycles.use_denoising = int(samples), bool(denoised)
            best_wall = best_cpu = np.inf
            for repeat in range(int(repeats) + 1):  # the first one warms up
                moved = base + np.array(
                    [1e-6 * (repeat + 1), 0, 0]
                )  # a new frame: the mesh is sent again
                last = repeat == int(repeats)
                start, start_cpu = time.perf_counter(), time.process_time()
                person.data.vertices.foreach_set(
                    "co", (base if last else moved).astype(np.float32).ravel()
                )
                person.data.update()
                path = folder / f"picture{row}.exr"
                scene.render.filepath = str(path)
                bpy.ops.render.render(write_still=True)
                if repeat or not int(repeats):
                    best_wall, best_cpu = (
                        min(best_wall, time.perf_counter() - start),
                        min(best_cpu, time.process_time() - start_cpu),
                    )
            wall.append(best_wall)
            cpu.append(best_cpu)
            picture = bpy.data.images.load(str(path))
            picture.colorspace_settings.name = "Non-Color"
            pixels = np.empty(int(given["size"]) ** 2 * 4, np.float32)
            picture.pixels.foreach_get(pixels)
            results[f"picture{row}"] = pixels.reshape(int(given["size"]), int(given["size"]), 4)[
                ::-1, :, :3
            ]
    np.savez(out_path, wall=np.array(wall), cpu=np.array(cpu), **results)


if __name__ == "__main__":
    main()

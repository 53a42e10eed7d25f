"""Write what ufbx reads in an FBX as JSON.

It is a separate process, since the binding's objects may be freed in the wrong order: python
look_in_fbx.py file.fbx out.json FPS
"""

import gc
import itertools
import json
import os
import sys

import ufbx

gc.disable()
scene = ufbx.load_file(sys.argv[1])
fps = float(sys.argv[3])
keep = []


def held(thing):
    """Return the object, which is kept until the end."""
    keep.append(thing)
    return thing


def vector(value):
    """Three numbers."""
    return [value.x, value.y, value.z]


def transform(matrix):
    """World from bone as its four columns."""
    return [vector(held(column)) for column in (matrix.c0, matrix.c1, matrix.c2, matrix.c3)]


def clip(stack):
    """Length, and the bones' transforms at every frame and half-way to the next."""
    count = round((stack.time_end - stack.time_begin) * fps) * 2 + 1
    frames = []
    for step in range(count):
        posed = held(scene.evaluate(held(stack.anim), step / 2 / fps))
        frames.append(
            [transform(held(held(posed.find_node(name)).node_to_world)) for name in bones]
        )
    anim = held(stack.anim)
    weights = {
        channel.name: [
            channel.evaluate_blend_weight(anim, step / fps) for step in range(count // 2 + 1)
        ]
        for channel in channels
    }
    return {"seconds": stack.time_end - stack.time_begin, "frames": frames, "weights": weights}


def shape(channel):
    """Which vertices a blend shape moves, and where to."""
    target = held(channel.target_shape)
    return [
        list(held(target.offset_vertices)),
        [vector(offset) for offset in held(target.position_offsets)],
    ]


axes = held(scene.settings.axes)
nodes = [held(node) for node in held(scene.nodes)]
bones = [node.name for node in nodes if node.bone is not None]
mesh = held(held(scene.meshes)[0])
skin = held(held(mesh.skin_deformers)[0])
channels = [held(channel) for channel in held(scene.blend_channels)]
uv = held(mesh.vertex_uv)
told = {
    "unit": scene.settings.unit_meters,
    "fps": scene.settings.frames_per_second,
    "axes": [axes.right.name, axes.up.name, axes.front.name],
    "parents": {node.name: held(node.parent).name for node in nodes if node.bone is not None},
    "rest": {
        node.name: transform(held(node.node_to_world)) for node in nodes if node.bone is not None
    },
    "triangles": mesh.num_triangles,
    "vertices": [vector(point) for point in held(mesh.vertices)],
    "corners": list(held(mesh.vertex_indices)),
    "uv": [[value.x, value.y] for value in held(uv.values)],
    "uv_corners": list(held(uv.indices)),
    "skin": {
        held(cluster.bone_node).name: [list(held(cluster.vertices)), list(held(cluster.weights))]
        for cluster in map(held, held(skin.clusters))
    },
    "texture": "".join(bytes(held(video).content).hex() for video in held(scene.videos)),
    "leap": max(
        (
            abs(b - a)
            for curve in map(held, held(scene.anim_curves))
            for values in [[held(key).value for key in held(curve.keyframes)]]
            for a, b in itertools.pairwise(values)
        ),
        default=0.0,
    ),
    "clips": {stack.name: clip(stack) for stack in map(held, held(scene.anim_stacks))},
    "bones": bones,
    "shapes": {channel.name: shape(channel) for channel in channels},
}
with open(sys.argv[2], "w") as stream:
    json.dump(told, stream)
os._exit(0)

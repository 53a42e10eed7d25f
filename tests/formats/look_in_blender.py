"""Run by a Python that has bpy: opens a GLB and a BVH and says, as JSON, what Blender sees. Imports nothing of a2v.

python look_in_blender.py character.glb motion.bvh FPS BONE,BONE FRAME,FRAME
"""

import json
import sys

import bpy

glb, bvh, fps, bones, frames = sys.argv[1], sys.argv[2], float(sys.argv[3]), sys.argv[4].split(","), list(map(int, sys.argv[5].split(",")))


def opened(operator, **options):
    """The armature that importing a file brings, in an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = round(fps)
    operator(**options)
    (armature,) = (item for item in bpy.context.scene.objects if item.type == "ARMATURE")
    return armature


def heads(armature, action, first):
    """Bone heads in Blender's world, back in y up: (frames, bones, 3)."""
    armature.animation_data.action = action
    if hasattr(armature.animation_data, "action_slot") and action.slots:
        armature.animation_data.action_slot = action.slots[0]
    for track in armature.animation_data.nla_tracks:
        track.mute = True
    places = []
    for frame in frames:
        bpy.context.scene.frame_set(first + frame)
        found = [armature.matrix_world @ armature.pose.bones[bone].head for bone in bones]
        places.append([[point.x, point.z, -point.y] for point in found])
    return places


told = {}
armature = opened(bpy.ops.import_scene.gltf, filepath=glb)
meshes = [item for item in bpy.context.scene.objects if item.type == "MESH" and item.find_armature() is armature]
told["glb"] = {
    "bones": len(armature.data.bones),
    "vertices": sum(len(mesh.data.vertices) for mesh in meshes),
    "images": len([image for image in bpy.data.images if image.size[0] > 0]),
    "clips": {
        action.name: {"range": list(action.frame_range), "heads": heads(armature, action, round(action.frame_range[0]))}
        for action in bpy.data.actions
    },
}
armature = opened(bpy.ops.import_anim.bvh, filepath=bvh, axis_forward="-Z", axis_up="Y", global_scale=0.01)  # centimetres
(action,) = bpy.data.actions
told["bvh"] = {
    "bones": len(armature.data.bones),
    "range": list(action.frame_range),
    "heads": heads(armature, action, round(action.frame_range[0])),
}
print("TOLD " + json.dumps(told))

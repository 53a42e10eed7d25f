"""Open a GLB, a BVH and an FBX in Blender and print what it sees, as JSON.

It is run by a Python with bpy and imports nothing of a2v: python look_in_blender.py character.glb
motion.bvh character.fbx FPS BONE,BONE FRAME,FRAME

The FBX may be "-": then it is left out.
"""

import json
import sys

import bpy

glb, bvh, fbx, fps, bones = *sys.argv[1:4], float(sys.argv[4]), sys.argv[5].split(",")
frames = list(map(int, sys.argv[6].split(",")))


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


def shapes(meshes):
    """Return by name the largest offset of a vertex by each shape key, meters."""
    found = {}
    for mesh in meshes:
        scale = mesh.matrix_world.to_scale()[0]
        for key in mesh.data.shape_keys.key_blocks[1:] if mesh.data.shape_keys else []:
            far = max(
                (a.co - b.co).length
                for a, b in zip(key.data, mesh.data.shape_keys.key_blocks[0].data, strict=True)
            )
            found[key.name] = max(found.get(key.name, 0.0), scale * far)
    return found


def curves(action):
    """The curves of an action, which Blender 5 keeps by slots."""
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    return [
        curve
        for layer in action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        for curve in bag.fcurves
    ]


told = {}
armature = opened(bpy.ops.import_scene.gltf, filepath=glb)
meshes = [
    item
    for item in bpy.context.scene.objects
    if item.type == "MESH" and item.find_armature() is armature
]
told["glb"] = {
    "bones": len(armature.data.bones),
    "vertices": sum(len(mesh.data.vertices) for mesh in meshes),
    "images": len([image for image in bpy.data.images if image.size[0] > 0]),
    "shapes": shapes(meshes),
    "lids": max(
        key.co[1]
        for action in bpy.data.actions
        for curve in curves(action)
        if "eyeBlinkLeft" in curve.data_path
        for key in curve.keyframe_points
    ),
    "clips": {
        action.name: {
            "range": list(action.frame_range),
            "heads": heads(armature, action, round(action.frame_range[0])),
        }
        for action in bpy.data.actions
        if any(curve.data_path.startswith("pose.") for curve in curves(action))
    },
}
armature = opened(
    bpy.ops.import_anim.bvh, filepath=bvh, axis_forward="-Z", axis_up="Y", global_scale=0.01
)  # centimeters
(action,) = bpy.data.actions
told["bvh"] = {
    "bones": len(armature.data.bones),
    "range": list(action.frame_range),
    "heads": heads(armature, action, round(action.frame_range[0])),
}
if fbx != "-":
    armature = opened(bpy.ops.import_scene.fbx, filepath=fbx)
    meshes = [item for item in bpy.context.scene.objects if item.type == "MESH"]
    actions = [
        one
        for one in bpy.data.actions
        if any(curve.data_path.startswith("pose.") for curve in curves(one))
    ]
    told["fbx"] = {
        "bones": len(armature.data.bones),
        "height": max((mesh.matrix_world @ v.co).z for mesh in meshes for v in mesh.data.vertices),
        "images": len([image for image in bpy.data.images if image.size[0] > 0]),
        "shapes": shapes(meshes),
        "clips": {
            action.name: {
                "range": list(action.frame_range),
                "heads": heads(armature, action, round(action.frame_range[0])),
            }
            for action in actions
        },
    }
print("TOLD " + json.dumps(told))

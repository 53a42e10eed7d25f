"""Open animated characters in Blender and print where it sees their bones, as JSON.

It is run by a Python with bpy and imports nothing of a2v: python look_at_rigs_in_blender.py FPS
FRAME,FRAME FILE...
"""

import json
import sys
from pathlib import Path

import bpy

fps, frames, files = float(sys.argv[1]), list(map(int, sys.argv[2].split(","))), sys.argv[3:]
OPENED_BY = {
    ".glb": bpy.ops.import_scene.gltf,
    ".fbx": bpy.ops.import_scene.fbx,
    ".usdc": bpy.ops.wm.usd_import,
    ".bvh": lambda filepath: bpy.ops.import_anim.bvh(
        filepath=filepath, axis_forward="-Z", axis_up="Y", global_scale=0.01
    ),
}
told = {}
READ = [(file, OPENED_BY[Path(file).suffix], file) for file in files]
READ += [
    (file, bpy.ops.wm.fbx_import, f"{file} anew") for file in files if file.endswith(".fbx")
]  # Blender has two importers of FBX
for file, operator, name in READ:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = round(fps)
    operator(filepath=file)
    (armature,) = (item for item in bpy.context.scene.objects if item.type == "ARMATURE")
    (action,) = (
        one
        for one in bpy.data.actions
        if one.name.split("|")[0] != "expressions" and armature.animation_data.action in (one, None)
    )
    for track in armature.animation_data.nla_tracks:
        track.mute = True
    armature.animation_data.action = action
    if hasattr(armature.animation_data, "action_slot") and action.slots:
        armature.animation_data.action_slot = action.slots[0]
    heads = []
    for frame in frames:
        bpy.context.scene.frame_set(round(action.frame_range[0]) + frame)
        places = {bone.name: armature.matrix_world @ bone.head for bone in armature.pose.bones}
        heads.append({name: [point.x, point.z, -point.y] for name, point in places.items()})
    told[name] = {"range": list(action.frame_range), "heads": heads}
print("TOLD " + json.dumps(told) + " END")

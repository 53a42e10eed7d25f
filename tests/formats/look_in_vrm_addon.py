"""Open an avatar and a clip in Blender with the VRM add-on and print what it sees, as JSON.

It is run by a Python with bpy and bpy-vrm-format and imports nothing of a2v: python
look_in_vrm_addon.py avatar.vrm clip.vrma FPS FRAME,FRAME BONE,BONE
"""

import json
import sys

import bpy
from io_scene_vrm.editor.validation import (
    WM_OT_vrm_validator,
)  # The add-on runs this before it exports, and for "Check VRM Model".

avatar, clip, fps, frames, bones = (
    *sys.argv[1:3],
    float(sys.argv[3]),
    list(map(int, sys.argv[4].split(","))),
    sys.argv[5].split(","),
)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.preferences.addon_enable(module="io_scene_vrm")
bpy.context.scene.render.fps = round(fps)
told = {"read": sorted(bpy.ops.import_scene.vrm(filepath=avatar))}
(armature,) = (item for item in bpy.context.scene.objects if item.type == "ARMATURE")
bpy.context.view_layer.objects.active = armature
vrm = armature.data.vrm_addon_extension.vrm1
humans = {name: getattr(vrm.humanoid.human_bones, name) for name in dir(vrm.humanoid.human_bones)}
told["bones"] = {
    name: bone.node.bone_name
    for name, bone in humans.items()
    if hasattr(bone, "node") and bone.node.bone_name
}
told["meta"] = {
    "name": vrm.meta.vrm_name,
    "authors": [one.value for one in vrm.meta.authors],
    "license": vrm.meta.other_license_url,
    "look_at": vrm.look_at.type,
}
told["presets"] = {
    name: len(getattr(vrm.expressions.preset, name).morph_target_binds)
    for name in ("blink", "blink_left", "happy", "aa", "oh", "look_up")
}
told["custom"] = len(vrm.expressions.custom)


class Errors(list):
    """Holds the add-on's findings."""

    def add(self):
        self.append(type("Finding", (), {"message": "", "severity": 0})())
        return self[-1]


found = Errors()
WM_OT_vrm_validator.detect_errors(bpy.context, found, armature.name)
told["found"] = [[one.severity, one.message] for one in found]
told["played"] = sorted(
    bpy.ops.import_scene.vrma(filepath=clip, armature_object_name=armature.name)
)
first = bpy.context.scene.frame_start
told["heads"], told["lid"] = [], []
for frame in frames:
    bpy.context.scene.frame_set(first + frame)
    places = [
        armature.matrix_world @ armature.pose.bones[told["bones"][bone]].head for bone in bones
    ]
    told["heads"].append([[point.x, point.z, -point.y] for point in places])
    told["lid"].append(vrm.expressions.preset.blink_left.preview)
told["frames"] = [bpy.context.scene.frame_start, bpy.context.scene.frame_end]
print("TOLD " + json.dumps(told) + " END")

"""Run by a Python that has bpy: switches the extension on, uses it and says as JSON what happened.

python look_at_extension.py export/blender character.glb missing.jpg
"""

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import bpy

folder, glb, photo = sys.argv[1:4]
told = {}
manager = (
    Path(bpy.utils.system_resource("SCRIPTS")) / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
)
with tempfile.TemporaryDirectory() as out:
    command = [sys.executable, str(manager), "build", "--source-dir", folder, "--output-dir", out]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    archives = list(Path(out).glob("*.zip"))
    told["built"] = [
        sorted(zipfile.ZipFile(path).namelist()) for path in archives
    ] or built.stdout + built.stderr

spec = importlib.util.spec_from_file_location(
    "a2v_extension", Path(folder) / "__init__.py", submodule_search_locations=[folder]
)
extension = sys.modules["a2v_extension"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(extension)
bpy.ops.wm.read_factory_settings(use_empty=True)
extension.register()
told["operators"] = [
    hasattr(bpy.types, name) for name in ("IMPORT_SCENE_OT_a2v_character", "OBJECT_OT_a2v_person")
]

told["imported"] = sorted(bpy.ops.import_scene.a2v_character(filepath=glb))
(armature,) = (item for item in bpy.data.objects if item.type == "ARMATURE")
told["shapes"] = sorted({bone.custom_shape.name for bone in armature.pose.bones})
told["bones"] = len(armature.pose.bones)
told["actions"] = sorted(action.name for action in bpy.data.actions if action.use_fake_user)
told["playing"] = armature.animation_data.action.name
told["frames"] = [bpy.context.scene.frame_start, bpy.context.scene.frame_end]
told["extra"] = [
    item.name
    for item in bpy.context.scene.objects
    if item.type not in ("ARMATURE", "MESH", "EMPTY")
]


def wrong(operator, **options):
    """Return what an operator reports if it cannot work."""
    try:
        operator(**options)
    except RuntimeError as error:
        return str(error)
    return ""


told["no character"] = wrong(bpy.ops.import_scene.a2v_character, filepath=photo)
told["no photo"] = wrong(bpy.ops.object.a2v_person, filepath=photo, actions="Walk", wait=True)
if len(sys.argv) > 4:  # a real photo, not cropped
    told["added"] = sorted(
        bpy.ops.object.a2v_person(filepath=sys.argv[4], actions="Walk", rig="mixamo", wait=True)
    )
    told["armatures"] = sorted(
        len(item.data.bones) for item in bpy.data.objects if item.type == "ARMATURE"
    )
os.environ["PATH"] = ""
told["no a2v"] = wrong(bpy.ops.object.a2v_person, filepath=photo, wait=True)
extension.unregister()
told["left"] = hasattr(bpy.types, "OBJECT_OT_a2v_person")
print("TOLD " + json.dumps(told))

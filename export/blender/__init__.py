"""Blender extension: *File > Import > a2v character* and *Add > a2v person*. Imports nothing of
a2v: it runs the installed command.

No ``from __future__ import annotations`` here: Blender reads the annotations of operators as
properties.
"""

import json
import math
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import bpy
from bpy_extras.io_utils import ImportHelper

RIGS = ("anny", "mixamo", "rigify", "unity", "unreal")
SHAPE = "a2v bone"


def bone_shape() -> Any:
    """The wire that bones are drawn as: a ring around the bone's middle, a line along it; one
    object for all characters."""
    known = bpy.data.objects.get(SHAPE)
    if known is not None:
        return known
    turns = [2 * math.pi * step / 16 for step in range(16)]
    ring = [(0.25 * math.cos(turn), 0.5, 0.25 * math.sin(turn)) for turn in turns]
    mesh = bpy.data.meshes.new(SHAPE)
    mesh.from_pydata(
        [*ring, (0, 0, 0), (0, 1, 0)],
        [*((step, (step + 1) % 16) for step in range(16)), (16, 17)],
        [],
    )
    shape = bpy.data.objects.new(SHAPE, mesh)
    shape.use_fake_user = True  # it stands in no scene
    return shape


def import_character(context: Any, path: str) -> Any:
    """Import a GLB of a2v with bones drawn as rings and each clip as a kept action.

    The first clip plays. Returns the armature.
    """
    before = set(bpy.data.objects)
    actions = set(bpy.data.actions)
    bpy.ops.import_scene.gltf(filepath=path, disable_bone_shape=True)
    armature = next(
        item for item in bpy.data.objects if item not in before and item.type == "ARMATURE"
    )
    shape = bone_shape()
    for bone in armature.pose.bones:
        bone.custom_shape = shape
    armature.show_in_front = True
    clips = [action for action in bpy.data.actions if action not in actions]
    for action in clips:
        action.use_fake_user = True
    if armature.animation_data is not None:
        for track in armature.animation_data.nla_tracks:
            track.mute = True
    if clips:
        _play(context, armature, clips[0])
    return armature


def _play(context: Any, armature: Any, action: Any) -> None:
    armature.animation_data_create()
    armature.animation_data.action = action
    if getattr(action, "slots", None):  # Blender 4.4 and later
        armature.animation_data.action_slot = action.slots[0]
    context.scene.frame_start, context.scene.frame_end = (
        math.floor(action.frame_range[0]),
        math.ceil(action.frame_range[1]),
    )


class Making:
    """One run of ``a2v character`` in the background."""

    def __init__(self, command: str, photo: str, actions: str, rig: str) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="a2v-")
        self.path = Path(self._folder.name) / "person.glb"
        words = [
            command,
            "character",
            "--photo",
            photo,
            "--actions",
            actions,
            "--rig",
            rig,
            "--out",
            str(self.path),
            "--json",
            "--quiet",
        ]
        self._said = open(Path(self._folder.name) / "said.json", "w+", encoding="utf-8")  # noqa: SIM115 - open until the program ends
        self._program = subprocess.Popen(words, stdout=self._said, stderr=subprocess.DEVNULL)

    def running(self) -> bool:
        """Whether it is still running."""
        return self._program.poll() is None

    def result(self, context: Any) -> tuple[Any, str]:
        """Return the armature, or None and the error, after waiting for the end."""
        self._program.wait()
        self._said.seek(0)
        said = self._said.read()
        try:
            answer = json.loads(said)
            if "error" in answer:
                return None, answer["error"]
            return import_character(context, answer["files"][0]), ""
        except (ValueError, KeyError, IndexError):
            return (
                None,
                f"a2v ended with code {self._program.returncode} and said nothing that is "
                "understood",
            )
        finally:
            self._said.close()
            self._folder.cleanup()


class IMPORT_SCENE_OT_a2v_character(bpy.types.Operator, ImportHelper):  # type: ignore[misc]
    """Import a character that a2v made."""

    bl_idname = "import_scene.a2v_character"
    bl_label = "Import a2v character"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's
    filename_ext = ".glb"
    filter_glob: bpy.props.StringProperty(default="*.glb", options={"HIDDEN"})  # type: ignore[valid-type]

    def execute(self, context: Any) -> set[str]:
        """Import the chosen file."""
        try:
            import_character(context, self.filepath)
        except (RuntimeError, StopIteration) as error:
            self.report({"ERROR"}, f"{self.filepath} is no character of a2v: {error}")
            return {"CANCELLED"}
        return {"FINISHED"}


class OBJECT_OT_a2v_person(bpy.types.Operator, ImportHelper):  # type: ignore[misc]
    """Make a person of a photo with the installed a2v, in the background."""

    bl_idname = "object.a2v_person"
    bl_label = "a2v person"
    bl_options = {"REGISTER"}  # noqa: RUF012
    filename_ext = ""
    filter_glob: bpy.props.StringProperty(default="*.jpg;*.jpeg;*.png;*.webp", options={"HIDDEN"})  # type: ignore[valid-type]
    actions: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Actions", default="Walk", description="with commas: Walk,Jump"
    )
    rig: bpy.props.EnumProperty(name="Rig", items=[(name, name, "") for name in RIGS])  # type: ignore[valid-type]
    wait: bpy.props.BoolProperty(default=False, options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]

    def execute(self, context: Any) -> set[str]:
        """Start a2v; the person appears when it is done."""
        command = _command(context)
        if command is None:
            self.report(
                {"ERROR"},
                "a2v is not installed; install it (README), or name its program in the extension's "
                "preferences",
            )
            return {"CANCELLED"}
        try:
            making = Making(command, self.filepath, self.actions, self.rig)
        except OSError as error:
            self.report(
                {"ERROR"},
                f"{command} cannot be run: {error.strerror}; name the program in the extension's "
                "preferences",
            )
            return {"CANCELLED"}
        if self.wait:
            _, problem = making.result(context)
            if problem:
                self.report({"ERROR"}, problem)
            return {"CANCELLED"} if problem else {"FINISHED"}
        context.workspace.status_text_set("a2v is making the person; a minute or two")
        bpy.app.timers.register(lambda: _look_after(making), first_interval=1.0)
        return {"FINISHED"}


def _look_after(making: Making) -> float | None:
    """Return the seconds until Blender's timer calls this again, or None at the end."""
    if making.running():
        return 1.0
    context = bpy.context
    context.workspace.status_text_set(None)
    _, problem = making.result(context)
    if problem:
        context.window_manager.popup_menu(
            lambda menu, _: menu.layout.label(text=problem), title="a2v", icon="ERROR"
        )
    return None


class A2VPreferences(bpy.types.AddonPreferences):  # type: ignore[misc]
    """Settings of the extension."""

    bl_idname = __package__ or __name__
    command: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Program a2v", subtype="FILE_PATH", description="empty: the one on the PATH"
    )

    def draw(self, _: Any) -> None:
        """Show the only setting: the path of a2v."""
        self.layout.prop(self, "command")


def _command(context: Any) -> str | None:
    addon = context.preferences.addons.get(__package__ or __name__)
    chosen = (
        addon.preferences.command if addon is not None and addon.preferences is not None else ""
    )
    return bpy.path.abspath(chosen) if chosen else shutil.which("a2v")


CLASSES = (IMPORT_SCENE_OT_a2v_character, OBJECT_OT_a2v_person, A2VPreferences)


def _import_entry(menu: Any, _: Any) -> None:
    menu.layout.operator(IMPORT_SCENE_OT_a2v_character.bl_idname, text="a2v character (.glb)")


def _add_entry(menu: Any, _: Any) -> None:
    menu.layout.operator(OBJECT_OT_a2v_person.bl_idname, text="a2v person", icon="ARMATURE_DATA")


def register() -> None:
    """Called by Blender when the extension is switched on."""
    for kind in CLASSES:
        bpy.utils.register_class(kind)
    bpy.types.TOPBAR_MT_file_import.append(_import_entry)
    bpy.types.VIEW3D_MT_add.append(_add_entry)


def unregister() -> None:
    """Called by Blender when it is switched off."""
    bpy.types.VIEW3D_MT_add.remove(_add_entry)
    bpy.types.TOPBAR_MT_file_import.remove(_import_entry)
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)

"""The words for the stages of a run that people see: one table for the command line and the
page."""

from __future__ import annotations

from collections.abc import Mapping

WORDS: Mapping[str, str] = {
    "subject": "person",
    "other_subject": "person",
    "each_subject": "person",
    "photo_body": "body",
    "first_photo": "body",
    "each_fit": "body",
    "joint_fit": "body",
    "surface_fit": "body",
    "body": "body",
    "surface": "surface",
    "each_surface": "surface",
    "reading": "person",
    "each_reading": "person",
    "surface_with_hands": "hands",
    "face_draft": "face",
    "color_draft": "colors",
    "surface_with_face": "colors",
    "colored_surface": "colors",
    "shaded_surface": "colors",
    "person_of_photos": "face",
    "colored_by_photos": "colors",
    "shaded_by_photos": "colors",
    "character": "character",
    "motion": "motion",
    "recorded_motion": "motion",
    "poses": "movement",
    "pose": "movement",
    "props": "movement",
    "vertices": "skin",
    "frame_settings": "scene",
    "camera": "scene",
    "place": "scene",
    "spot": "scene",
    "frame": "frames",
    "photo_frame": "frames",
    "clip": "video",
    "video": "video",
    "photo_clip": "video",
    "engine_character": "exports",
    "glb": "exports",
    "bvh": "exports",
}
"""Words by name of the nodes of `pipelines.graph.video_graph`."""

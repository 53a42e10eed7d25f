"""The graph of a video. No other module names its edges."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipelines.engine.graph import Step


def video_graph(*, recorded: bool = False, several: bool = False) -> tuple[Step, ...]:
    """Steps from photos and an action or recorded motion to the video and exports."""
    from pipelines.nodes import animation, export, motion, place, rendering, subject

    return (
        Step(motion.recorded_motion if recorded else motion.motion, "motion"),
        Step(subject.subject, "subject"),
        *(_of_several_photos() if several else _of_one_photo()),
        Step(animation.character, "character"),
        Step(animation.poses, "poses"),
        Step(animation.props, "props"),
        Step(animation.things, "things", "... -> things[t]"),
        Step(animation.pose, "pose", "... -> pose[t]"),
        Step(animation.vertices, "vertices", "pose[t] -> vertices[t]"),
        Step(rendering.frame_settings, "frame_settings"),
        Step(rendering.camera, "camera", "... -> camera[t, c]"),
        Step(
            rendering.frame,
            "frame",
            "vertices[t], things[t], camera[t, c] -> frame[t, c]",
            together=_views_of_a_pose,
        ),
        Step(rendering.clip, "clip", "frame[:, c] -> clip[c]"),
        Step(rendering.video, "video"),
        Step(place.place, "place"),
        Step(place.spot, "spot", "... -> spot[t]"),
        Step(place.photo_frame, "photo_frame", "vertices[t], spot[t] -> photo_frame[t]"),
        Step(place.photo_clip, "photo_clip"),
        Step(export.engine_character, "engine_character"),
        Step(export.glb, "glb"),
        Step(export.bvh, "bvh"),
    )


def _of_one_photo() -> tuple[Step, ...]:
    """Steps from the person in a photo to the colored surface."""
    from pipelines.nodes import body, reconstruction

    return (
        Step(body.photo_body, ("photo_body", "photo_camera")),
        Step(reconstruction.surface, "surface"),
        Step(body.body, "body"),
        Step(reconstruction.reading, "reading"),
        Step(reconstruction.surface_with_hands, "surface_with_hands"),
        Step(reconstruction.face_draft, "face_draft"),
        Step(reconstruction.color_draft, "color_draft"),
        Step(reconstruction.surface_with_face, ("surface_with_face", "color_with_face")),
        Step(reconstruction.colored_surface, "colored_surface"),
        Step(reconstruction.shaded_surface, "shaded_surface"),
    )


def _of_several_photos() -> tuple[Step, ...]:
    """The same steps for several photos; `p` counts the further ones, `v` all of them."""
    from pipelines.nodes import photos

    return (
        Step(photos.other_subject, "other_subject", "other[p] -> other_subject[p]"),
        Step(photos.each_subject, "each_subject", "... -> each_subject[v]"),
        Step(photos.each_fit, "each_fit", "each_subject[v] -> each_fit[v]"),
        Step(photos.joint_fit, "joint_fit", "... -> joint_fit[v]"),
        Step(
            photos.each_surface, "each_surface", "each_subject[v], joint_fit[v] -> each_surface[v]"
        ),
        Step(photos.surface_fit, "surface_fit", "... -> surface_fit[v]"),
        Step(
            photos.each_reading,
            "each_reading",
            "each_subject[v], each_surface[v], surface_fit[v] -> each_reading[v]",
        ),
        Step(photos.first_photo, ("photo_body", "photo_camera", "surface", "body")),
        Step(photos.person_of_photos, "surface_with_face"),
        Step(photos.colored_by_photos, "colored_surface"),
        Step(photos.shaded_by_photos, "shaded_surface"),
    )


def _views_of_a_pose(inputs: Mapping[str, Any]) -> int:
    """Return the number of views.

    So all views of one pose go to one worker, which deforms the character once for them.
    """
    return max(1, len(getattr(inputs.get("render"), "views", ())))

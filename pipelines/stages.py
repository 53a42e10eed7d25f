"""The words for stages and actions that people see: one vocabulary for the command line and the
page."""

from __future__ import annotations

import re
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
    "things": "movement",
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

ACTIONS: Mapping[str, str] = {
    "Animal Behavior": "Moving like an animal",
    "warm_up": "Warming up",
    "drink": "Drinking",
    "lift_dumbbell": "Lifting a dumbbell",
    "eat": "Eating",
    "turn_steering_wheel": "Turning a steering wheel",
    "phone": "Making a phone call",
    "boxing": "Boxing",
    "throw": "Throwing",
    "walk": "Walking",
    "run": "Running",
    "jump": "Jumping",
    "sit": "Sitting down",
    "warm_up_wristankle": "Warming up wrists and ankles",
    "warm_up_pectoral": "Warming up the chest",
    "warm_up_elbowback": "Warming up, elbows back",
    "warm_up_bodylean_right_arm": "Leaning aside with the right arm",
    "warm_up_bodylean_left_arm": "Leaning aside with the left arm",
    "warm_up_bow_right": "Bending to the right foot",
    "warm_up_bow_left": "Bending to the left foot",
    "jump_handsup": "Jumping with the hands up",
    "jump_vertical": "Jumping up",
    "drink_bottle_righthand": "Drinking from a bottle, right hand",
    "drink_bottle_lefthand": "Drinking from a bottle, left hand",
    "drink_cup_righthand": "Drinking from a cup, right hand",
    "drink_cup_lefthand": "Drinking from a cup, left hand",
    "drink_both_hands": "Drinking with both hands",
    "lift_dumbbell_righthand": "Lifting a dumbbell, right hand",
    "lift_dumbbell_lefthand": "Lifting a dumbbell, left hand",
    "lift_dumbbell_bothhands": "Lifting a dumbbell with both hands",
    "lift_dumbbell_overhead": "Lifting a dumbbell overhead",
    "lift_dumbbell_bothhands_bend_legs": "Lifting a dumbbell from a squat",
    "eat_righthand": "Eating with the right hand",
    "eat_lefthand": "Eating with the left hand",
    "eat_pie_burger": "Eating a burger",
    "phone_take_out_call_put_back": "Taking out a phone for a call",
    "phone_call_lefthand": "Phoning, left hand",
    "boxing_left_right": "Boxing, left then right",
    "boxing_left_upwards": "Boxing, left uppercut",
    "boxing_right_upwards": "Boxing, right uppercut",
    "boxing_right_left": "Boxing, right then left",
    "throw_right_hand": "Throwing with the right hand",
    "throw_both_hands": "Throwing with both hands",
}
"""Words by name of the actions whose names are not words themselves."""
_NAMED = re.compile(
    rf"\b(?:{'|'.join(sorted((name for name in ACTIONS if '_' in name), key=len, reverse=True))})\b"
)


def title_of(action: str) -> str:
    """Return an action's name in words."""
    return ACTIONS.get(action) or action.replace("_", " ")


def said(text: str) -> str:
    """Return a text with the names of actions in words."""
    return ACTIONS.get(text.strip()) or _NAMED.sub(lambda found: ACTIONS[found[0]], text)

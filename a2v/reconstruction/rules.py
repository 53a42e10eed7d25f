"""The rules by which a photo is read and a character is colored, and how to leave one out.

A rule is admitted by a measured line in docs/results/rules.md.
"""

from __future__ import annotations

from collections.abc import Mapping

from a2v.errors import InputError

READING: Mapping[str, str] = {
    "place_arms": "arms by the landmarks where the fit is wrong",
    "find_gloves": "gloves on both hands",
    "find_skin": "pixels of bare hands",
    "tone_hands": "color of hidden hands",
    "find_bare_forearms": "forearms without sleeves",
    "find_surroundings": "background in the mask",
    "find_held_things": "held objects in the mask",
    "find_bare_feet": "feet without shoes",
    "find_skirts": "skirts, dresses and long coats",
    "find_long_hair": "long hair as a layer",
}
"""Readers of `a2v.reconstruction.reading` that can be left out, and what they find."""

COLORING: Mapping[str, str] = {
    "follow_map": "parts of pixels by the body map",
    "part_flanks": "trunk and hanging arm apart",
    "sort_by_palette": "pixels near a border sorted by the colors of both parts",
    "clear_hem": "legs below a hem take skin only",
    "delight": "the photo's shading removed",
    "move_face": "turned faces drawn over the model's features",
    "paint_face": "mouth and eyeballs",
    "add_other_photos": "further photos",
    "replace_strangers": "colors of places behind another limb",
    "tint_hidden_hands": "the color of hidden hands",
    "complete_head": "which colors of a head are right, and its hidden places, by a network",
    "paint_head": "hidden skin of the head as completed",
    "gather_evidence": "all continuation: labels, panels, detail",
    "pair_sides": "hidden places from the mirrored side",
    "bare_crossed_arms": "hidden forearms without sleeves",
    "run_borders": "hems and sleeves around the body",
    "dress_cut_legs": "clothes of legs below the picture",
    "split_panels": "garments of several colors",
    "keep_to_palette": "hidden cloth in the visible colors",
    "wear_gloves": "gloves on hidden hands",
    "even": "the tone of hidden skin and hair",
    "comb": "streaks of hidden long hair",
    "mirror_texels": "the hidden half of a head in the texture",
    "repeat_cloth": "the visible side of a skirt all around it in the texture",
    "smooth_borders": "borders of materials in the texture",
}
"""Rules of `a2v.reconstruction.coloring` that can be left out, and what they are for."""


CANVAS = ("follow_map", "part_flanks", "sort_by_palette", "clear_hem")
"""Those that tell which pixels belong to which part (`a2v.reconstruction.coloring.canvas`)."""
BAKING = ("mirror_texels", "repeat_cloth", "smooth_borders")
"""Those that change the texture alone."""


def left_out(text: str, among: Mapping[str, str]) -> frozenset[str]:
    """Return the names of the rules in a text, separated by commas.

    Raises
    ------
    InputError
        A rule is unknown.
    """
    names = [name.strip() for name in text.split(",") if name.strip()]
    if unknown := [name for name in names if name not in among]:
        raise InputError(
            f"there is no rule '{unknown[0]}' to leave out; choose from {', '.join(among)}"
        )
    return frozenset(names)

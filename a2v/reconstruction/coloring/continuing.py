"""Steps that label materials and continue them over the unseen side."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.body.parts import on_parts
from a2v.reconstruction.backs import (
    BackEvidence,
    Materials,
    continue_photo,
    find_panels,
    find_twins,
    in_palette,
    label_surface,
    run_around,
    seen_before,
)
from a2v.reconstruction.backs.seen import HAIR, HANDS, SKIN
from a2v.reconstruction.coloring.painting import Painting
from a2v.reconstruction.coloring.tones import (
    bare_arms,
)
from a2v.reconstruction.palettes import lab_of
from a2v.reconstruction.reading.skin import (
    is_skin,
    seen_face,
    skin_of_hands,
)


def gather_evidence(painting: Painting) -> Painting:
    """Gather what labels and continuation use."""
    spots, known, canvas = painting.spots, painting.known, painting.canvas
    if not painting.settings.synthesis or spots is None:
        return painting
    hidden = np.clip(painting.expected, 0, 1)
    colors = np.where(known[:, None], painting.colors, hidden)
    subject, pixels, main = painting.photo.subject, painting.pixels, painting.main
    face, _ = seen_face(subject, pixels, colors, known=main, head=painting.head)
    outer = main & ~painting.mouth
    _, skin = seen_face(subject, pixels, colors, known=outer, head=painting.head)
    if skin is None or not is_skin(lab_of(skin)):  # the back of a head, or hair over the cheeks
        hands = skin_of_hands(colors[known & on_parts(spots.parts, *HANDS)])
        skin = skin if hands is None else hands
    scalp, bare = spots.scalp, spots.bare
    if (cover := painting.head_cover) is not None:
        scalp = np.where(cover.told, cover.covered, scalp)
        bare = np.where(cover.told, ~cover.covered, bare)
    evidence = BackEvidence(
        vertices=painting.vertices,
        colors=colors,
        known=known,
        parts=spots.parts,
        front=seen_before(pixels, outer, spots.parts),
        twin=np.full(len(known), -1),
        scalp=scalp,
        bare=bare,
        neighbors=painting.neighbors,
        skin=skin,
        face=face | painting.mouth,
        rest=None if canvas is None else canvas.rest,
        cloth=None if canvas is None else canvas.loose,
        strands=None if canvas is None else canvas.hairy,
    )
    return dataclasses.replace(painting, evidence=evidence)


def pair_sides(painting: Painting) -> Painting:
    """Continue hidden places from the mirrored side, if the photo shows that squarely."""
    if painting.evidence is None or painting.spots is None:
        return painting
    # at grazing angles colors are mixed with those of the background and of what is in front
    square = painting.known & (painting.trust > 0.9)
    twin = find_twins(
        painting.spots, known=painting.known, clear=square, neighbors=painting.neighbors
    )
    evidence = dataclasses.replace(painting.evidence, twin=twin)
    return dataclasses.replace(painting, evidence=evidence)


def bare_crossed_arms(painting: Painting) -> Painting:
    """Make forearms without sleeves skin where the fit has put them into the trunk."""
    if painting.evidence is None or painting.canvas is None:
        return painting
    bare = painting.evidence.bare | bare_arms(painting.canvas, painting.known)
    evidence = dataclasses.replace(painting.evidence, bare=bare)
    return dataclasses.replace(painting, evidence=evidence)


def label(painting: Painting) -> Painting:
    """Label skin, hair, garments and shoes."""
    if painting.evidence is None:
        return painting
    spots = painting.spots
    labels, strange = label_surface(painting.evidence)
    if (cover := painting.head_cover) is not None:
        # strands beside a cheek make it no hair, and brown hair above brown skin is not bare
        labels = np.where(cover.told & ~cover.covered & (labels == HAIR), SKIN, labels)
        grown = cover.told & cover.covered & (False if spots is None else spots.scalp)
        labels = np.where(grown & (labels == SKIN), HAIR, labels)
    return dataclasses.replace(painting, materials=Materials.of(labels, strange))


def run_borders(painting: Painting) -> Painting:
    """Run hems, sleeves and belts around the body at rest."""
    if painting.evidence is None or painting.materials is None:
        return painting
    labels = run_around(painting.evidence, painting.materials.labels)
    materials = dataclasses.replace(painting.materials, labels=labels)
    return dataclasses.replace(painting, materials=materials)


def split_panels(painting: Painting) -> Painting:
    """Split garments of several colors into panels with borders."""
    if painting.evidence is None or painting.materials is None:
        return painting
    panels, colors = find_panels(painting.evidence, painting.materials.labels)
    materials = dataclasses.replace(painting.materials, panels=panels, colors=colors)
    return dataclasses.replace(painting, materials=materials)


def continue_materials(painting: Painting) -> Painting:
    """Continue the pattern of each material over the unseen side."""
    if painting.evidence is None or painting.materials is None:
        return painting
    continued = continue_photo(
        painting.evidence,
        painting.materials,
        painting.faces,
        painting.normals,
        painting.photo.clean,
        painting.photo.camera,
        seed=painting.settings.seed,
    )
    return dataclasses.replace(
        painting,
        continued=continued,
        report={**painting.report, "synthesis": dict(continued.report())},
    )


def keep_to_palette(painting: Painting) -> Painting:
    """Move hidden colors of a garment to the colors that the photo shows of it."""
    continued = painting.continued
    if continued is None:
        return painting
    expected = in_palette(continued.expected, continued.labels, painting.known)
    continued = dataclasses.replace(continued, expected=expected)
    return dataclasses.replace(painting, continued=continued)

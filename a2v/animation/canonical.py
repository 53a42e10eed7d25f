"""Make the character of a surface that is given in the body's rest pose and needs no binding."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.animation.deform import blended_matrices, deform
from a2v.errors import InputError
from a2v.types import Body, Character, Surface


def standing_body(body: Body) -> Body:
    """A body in its rest pose."""
    moved = body.rest_transforms.astype(np.float64) @ np.linalg.inv(
        body.bone_transforms.astype(np.float64)
    )
    skin = np.einsum("vb,bij->vij", body.weights.astype(np.float64), np.linalg.inv(moved))
    vertices = np.linalg.solve(skin[:, :3, :3], (body.vertices - skin[:, :3, 3])[..., None])[..., 0]
    tails = np.einsum(
        "bij,bj->bi",
        moved,
        np.concatenate([body.bone_tails, np.ones((len(body.bone_tails), 1))], axis=1),
    )[:, :3]
    return dataclasses.replace(
        body,
        vertices=vertices.astype(np.float32),
        bone_transforms=body.rest_transforms,
        bone_tails=tails.astype(np.float32),
    )


def standing_character(surface: Surface, body: Body) -> Character:
    """Make the character of a surface with a `Standing` on the body that was fitted to it: both in
    the body's rest pose, with the soles on the ground.

    Raises
    ------
    InputError
        The surface has no `Standing`.
    """
    standing = surface.standing
    if standing is None:
        raise InputError(
            "the surface has no standing pose, only that of the photo; bind it to the body"
        )
    still = standing_body(body)
    root = still.bone_transforms[0, :3, 3]
    shift = np.array([-root[0], -float(standing.vertices[:, 1].min()), -root[2]], np.float32)
    moved = np.array(still.bone_transforms)
    moved[:, :3, 3] += shift
    placed = dataclasses.replace(
        still,
        vertices=still.vertices + shift,
        bone_transforms=moved,
        bone_tails=still.bone_tails + shift,
    )
    return Character(
        surface=dataclasses.replace(surface, vertices=standing.vertices + shift, standing=None),
        body=placed,
        weights=standing.weights,
        bones=standing.bones,
        anchors=standing.anchors,
        parts=standing.parts,
        provenance={"bind": {"character": "canonical"}},
    )


def photographed_character(character: Character, body: Body) -> Character:
    """Put a character into the pose of the photo, and bind it there.

    Parameters
    ----------
    character : Character
        Made from `body`; one that is bound in the photo's pose stays as it is.
    body : Body
        Fitted to the photo.

    Returns
    -------
    Character
        In the world of the photo's camera: that sees it as in the photo. Clips deform it less well
        than the character at rest.

    Raises
    ------
    InputError
        The body has other bones.
    """
    surface = character.surface
    face = surface.face
    if face is not None:
        turns = blended_matrices(character, body.bone_transforms)[face.vertices, :, :3]
        offsets = np.einsum("vab,vb->va", turns, face.offsets.astype(np.float64))
        face = dataclasses.replace(face, offsets=offsets.astype(np.float32))
    vertices = deform(character, body.bone_transforms)
    return dataclasses.replace(
        character, surface=dataclasses.replace(surface, vertices=vertices, face=face), body=body
    )

"""Convert a character and its clips to the rig of another tool: bones, rest pose, weights,
animation."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from a2v.animation.deform import blended_matrices, deform
from a2v.animation.rest_pose import bone_axes, bones_of, heads_of, rest_transforms, tails_of
from a2v.animation.rig_spec import RigSpec
from a2v.geometry.polar import nearest_rotations
from a2v.types import Body, Character, Face, FloatArray, IntArray

_STIFF = 100.0
"""Weight of the heads of a bone's children relative to all of its skin; it keeps the heads in
place."""
_KEPT_REST = 0.02
"""Weight of a smooth rest pose relative to an exact reproduction of the photo's pose."""


@dataclass(frozen=True, kw_only=True)
class RigChange:
    """A character on another rig, and the conversion of clips to that rig.

    Attributes
    ----------
    character : Character
        Mesh and bones in the rig's rest pose, the soles on the ground. Weights of bones that the
        rig lacks are added to their nearest ancestor. Anchors are those of the given character.
    source : Body
        Body of the given character.
    spec : RigSpec
    rest : (B, 4, 4) float64
        The body's own bones in the rig's rest pose.
    drivers : (K,) int
        Bone of the body at the head of each bone of the rig, without the root.
    owner : (B,) int
        Bone of the rig, without the root, that each bone of the body follows.
    moments : (B, 3, 4) float64
        Of the skin of each bone of the body about the head of the rig's bone: sums of w x x^T and
        of w x, square meters and meters.
    """

    character: Character
    source: Body
    spec: RigSpec
    rest: FloatArray
    drivers: IntArray
    owner: IntArray
    moments: FloatArray

    def follow(self, bone_transforms: FloatArray) -> FloatArray:
        """Convert transforms of the body's bones to transforms of the rig's bones.

        Each bone gets the rotation that best fits the skin of all body bones that it replaces
        (least squares) and the directions of its children. The hips keep their position. All other
        bones keep their lengths, so only their rotations change, as engines require. A root stays
        on the ground at the origin.

        Parameters
        ----------
        bone_transforms : (T, B, 4, 4) float
            World from bone, meters, of the body's own rig.

        Returns
        -------
        (T, K, 4, 4) float64
            World from bone of the rig's bones; the root, if present, is first.
        """
        given = np.asarray(bone_transforms, dtype=np.float64)
        turns, heads = self._turns(given), self._heads(given)
        body, first = self.character.body, int(bool(self.spec.root))
        made = np.tile(np.eye(4), (len(given), len(body.bone_names), 1, 1))
        at_rest = body.rest_transforms.astype(np.float64)
        for place in range(len(self.spec.bones)):
            bone, parent = place + first, int(body.bone_parents[place + first]) - first
            made[:, bone, :3, :3] = turns[:, place] @ at_rest[bone, :3, :3]
            if parent < 0:
                made[:, bone, :3, 3] = heads[:, place]
            else:
                offset = at_rest[bone, :3, 3] - at_rest[parent + first, :3, 3]
                made[:, bone, :3, 3] = made[:, parent + first, :3, 3] + turns[:, parent] @ offset
        for bone in range(first + len(self.spec.bones), len(body.bone_names)):
            above = int(body.bone_parents[bone])
            made[:, bone] = made[:, above] @ (np.linalg.inv(at_rest[above]) @ at_rest[bone])
        return made

    def clips(
        self, clips: Mapping[str, tuple[FloatArray, float]]
    ) -> dict[str, tuple[FloatArray, float]]:
        """Apply `follow` to named clips of (bone transforms, frames per second)."""
        return {name: (self.follow(transforms), fps) for name, (transforms, fps) in clips.items()}

    def _heads(self, transforms: FloatArray) -> FloatArray:
        return heads_of(self.source, self.spec, self.drivers, transforms)

    def _turns(self, given: FloatArray) -> FloatArray:
        """Return the rotations (T, K, 3, 3) of the rig's bones from their rest orientations."""
        heads = self._heads(self.rest)
        turned = given[:, :, :3, :3] @ np.swapaxes(self.rest[:, :3, :3], 1, 2)
        now = self._heads(given)
        total = np.zeros((len(given), len(self.drivers), 3, 3))
        shift = (
            np.einsum("tbac,bc->tba", turned, heads[self.owner] - self.rest[:, :3, 3])
            + given[..., :3, 3]
            - now[:, self.owner]
        )
        parts = turned @ self.moments[:, :, :3] + shift[..., None] * self.moments[:, None, :, 3]
        for own, place in enumerate(self.owner.tolist()):
            total[:, place] += parts[:, own]
        places = {bone.name: place for place, bone in enumerate(self.spec.bones)}
        size = np.trace(total, axis1=-2, axis2=-1)
        scale = np.maximum(np.abs(size).max(axis=0), 1e-6)
        for place, bone in enumerate(self.spec.bones):
            if bone.parent in places:
                above = places[bone.parent]
                reach = heads[place] - heads[above]
                stiff = _STIFF * scale[above] / max(float(reach @ reach), 1e-6)
                total[:, above] += stiff * (now[:, place] - now[:, above])[..., None] * reach
        total += 1e-3 * scale[:, None, None] * turned[:, self.drivers]  # bones without skin
        return nearest_rotations(total)


def change_rig(character: Character, spec: RigSpec) -> RigChange:
    """Put a character on another rig.

    The mesh is moved to the rig's rest pose so that the new skinning reproduces the photo's pose.

    Parameters
    ----------
    character : Character
        On a body of Anny's bones.
    spec : RigSpec

    Returns
    -------
    RigChange
        `character` is ready for `a2v.formats`, `follow` makes its clips.

    Raises
    ------
    InputError
        The body lacks a bone that the rig needs.
    """
    body = character.body
    drivers, owner = bones_of(body, spec)
    rest = rest_transforms(body, spec)
    skin = deform(character, rest).astype(np.float64)
    low = float(skin[:, 1].min())
    rest[:, 1, 3] -= low
    skin[:, 1] -= low
    weights, bones = _merged(character, owner + int(bool(spec.root)))
    changed = dataclasses.replace(
        character, body=_rig_body(body, spec, rest, drivers, owner), weights=weights, bones=bones
    )
    moments = _moments(character, skin, heads_of(body, spec, drivers, rest), owner)
    change = RigChange(
        character=changed,
        source=body,
        spec=spec,
        rest=rest,
        drivers=drivers,
        owner=owner,
        moments=moments,
    )
    vertices = _unposed(character, change, skin)
    surface = dataclasses.replace(
        character.surface,
        vertices=vertices.astype(np.float32),
        face=_unposed_face(character, change),
    )
    return dataclasses.replace(change, character=dataclasses.replace(changed, surface=surface))


def _rig_body(
    body: Body, spec: RigSpec, rest: FloatArray, drivers: IntArray, owner: IntArray
) -> Body:
    """The body with the rig's bones, in the rig's rest pose."""
    heads, tails = heads_of(body, spec, drivers, rest), tails_of(body, spec, drivers, rest)
    transforms = np.tile(np.eye(4), (len(spec.names), 1, 1))
    first = int(bool(spec.root))
    last = first + len(spec.bones)
    transforms[first:last, :3, :3] = bone_axes(spec, tails - heads)
    transforms[first:last, :3, 3] = heads
    places = {name: place for place, name in enumerate(spec.names)}
    weights = np.zeros((len(body.vertices), len(spec.names)))
    np.add.at(weights.T, owner + first, body.weights.astype(np.float64).T)
    parents = np.array(
        [
            *([-1] if first else []),
            *(places.get(bone.parent, -1) for bone in spec.bones),
            *(places[end.parent] for end in spec.ends),
        ]
    )
    above = parents[last:]
    transforms[last:, :3, :3], transforms[last:, :3, 3] = (
        transforms[above, :3, :3],
        tails[above - first],
    )
    tails = np.concatenate([tails, tails[above - first] + 0.2 * (tails - heads)[above - first]])
    moved = rest @ np.linalg.inv(body.bone_transforms.astype(np.float64))
    blended = np.einsum("vb,bac->vac", body.weights.astype(np.float64), moved)
    vertices = (
        np.einsum("vac,vc->va", blended[:, :3, :3], body.vertices.astype(np.float64))
        + blended[:, :3, 3]
    )
    ends = np.concatenate([[[0.0, 0.0, 0.2]], tails]) if first else tails
    return dataclasses.replace(
        body,
        model=spec.name,
        vertices=vertices.astype(np.float32),
        bone_names=spec.names,
        bone_parents=parents,
        bone_transforms=transforms.astype(np.float32),
        rest_transforms=transforms.astype(np.float32),
        bone_tails=ends.astype(np.float32),
        weights=weights.astype(np.float32),
    )


def _merged(character: Character, owner: IntArray) -> tuple[FloatArray, IntArray]:
    """Weights and bones (V, 4) of a character whose bones (B,) become `owner`: weights of the same
    bone are summed and sorted, largest first."""
    bones = owner[character.bones]
    weights = character.weights.astype(np.float64)
    for later in range(1, 4):
        for earlier in range(later):
            same = (bones[:, later] == bones[:, earlier]) & (weights[:, later] > 0)
            weights[same, earlier] += weights[same, later]
            weights[same, later] = 0
    order = np.argsort(-weights, axis=1, kind="stable")
    weights = np.take_along_axis(weights, order, axis=1)
    bones = np.where(weights > 0, np.take_along_axis(bones, order, axis=1), 0)
    return (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32), bones.astype(np.int32)


def _moments(
    character: Character, skin: FloatArray, heads: FloatArray, owner: IntArray
) -> FloatArray:
    """See `RigChange.moments`; `skin` (V, 3) in the rest pose."""
    moments = np.zeros((len(owner), 3, 4))
    for column in range(4):
        bones, weights = character.bones[:, column], character.weights[:, column].astype(np.float64)
        reach = skin - heads[owner[bones]]
        both = np.concatenate([reach, np.ones((len(reach), 1))], axis=1)
        np.add.at(moments, bones, weights[:, None, None] * reach[:, :, None] * both[:, None])
    return moments


def _unposed_face(character: Character, change: RigChange) -> Face | None:
    """Return the expressions in the rest pose that give the present ones under the new skinning in
    the photo's pose."""
    face = character.surface.face
    if face is None:
        return None
    blended = blended_matrices(
        change.character, change.follow(character.body.bone_transforms[None])[0]
    )
    offsets = np.linalg.solve(
        blended[face.vertices, :, :3], face.offsets.astype(np.float64)[..., None]
    )[..., 0]
    return dataclasses.replace(face, offsets=offsets.astype(np.float32))


def _unposed(character: Character, change: RigChange, skin: FloatArray) -> FloatArray:
    """Return the vertices (V, 3) in the rest pose whose new skinning in the photo's pose gives the
    surface.

    `skin` is the shape that they should resemble.
    """
    blended = blended_matrices(
        change.character, change.follow(character.body.bone_transforms[None])[0]
    )
    matrix, target = (
        blended[..., :3],
        character.surface.vertices.astype(np.float64) - blended[..., 3],
    )
    square = np.swapaxes(matrix, 1, 2)
    left = square @ matrix + _KEPT_REST * np.eye(3)
    right = np.einsum("vab,vb->va", square, target) + _KEPT_REST * skin
    solved: FloatArray = np.linalg.solve(left, right[..., None])[..., 0]
    return solved

"""Variation of avatars: other builds, and clothes of other colors."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from a2v.body.parts import PARTS
from a2v.lab.studio.avatars import Avatar, avatar_part
from a2v.types import ByteArray, FloatArray, IntArray

VALIDATION_IDENTITIES: tuple[str, ...] = (
    "Asian_F_2",
    "Black_F_3",
    "Hispanic_M_3",
    "MENA_F_1",
    "NHPI_M_1",
    "White_M_3",
)
"""People who are not in training data, in any of their outfits."""

REPORT_IDENTITIES: tuple[str, ...] = (
    "X_AIAN_F_1",
    "X_AIAN_M_1",
    "X_MENA_F_1",
    "X_NHPI_F_1",
    "X_NHPI_F_2",
    "X_NHPI_F_3",
    "X_NHPI_M_1",
)
"""More people who are not in training data. They are only used for final figures, never during
development."""

VALIDATION_OUTFITS: tuple[str, ...] = ("Medi",)
"""Outfits that are not in training data, on any person."""

SPLITS: tuple[str, ...] = ("training", "validation")


def split_of(avatar: str) -> str:
    """Return the split, one of `SPLITS`, of the avatar of that name
    (``<group>_<F|M>_<number>_<outfit>``)."""
    identity, _, outfit = avatar.rpartition("_")
    return (
        "validation"
        if identity in (*VALIDATION_IDENTITIES, *REPORT_IDENTITIES) or outfit in VALIDATION_OUTFITS
        else "training"
    )


@dataclass(frozen=True)
class Build:
    """Difference of a person's build from the avatar's.

    Attributes
    ----------
    height : float
        Factor of the whole body.
    length, girth : mapping of segment name to float
        Factors of segments along and across their bones: parts of the body without their side
        ("torso", "thigh"...); 1 where absent.
    """

    height: float = 1.0
    length: Mapping[str, float] = field(default_factory=dict)
    girth: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def draw(cls, generator: np.random.Generator) -> Build:
        """Draw a plausible build: height within 8 %, limbs and girth by a few per cent."""
        names = ("torso", "neck", "upper_arm", "lower_arm", "hand", "thigh", "shin", "foot")
        legs, arms, stout = (
            generator.normal(0, 0.02),
            generator.normal(0, 0.02),
            np.clip(generator.normal(0, 0.04), -0.08, 0.1),
        )
        common = {"thigh": legs, "shin": legs, "upper_arm": arms, "lower_arm": arms}
        length = {name: 1 + common.get(name, 0.0) + generator.normal(0, 0.012) for name in names}
        share = {"foot": 0.2, "hand": 0.3, "neck": 0.6}
        girth = {
            name: 1 + share.get(name, 1.0) * stout + generator.normal(0, 0.015) for name in names
        }
        return cls(float(generator.uniform(0.92, 1.08)), length, girth)

    def thicker(self, factors: Mapping[str, float]) -> Build:
        """Return a build with the same lengths and girths multiplied by `factors` per segment."""
        return dataclasses.replace(
            self,
            girth={
                name: self.girth.get(name, 1.0) * factors.get(name, 1.0)
                for name in {*self.girth, *factors}
            },
        )


def segment_of(bone: str) -> str:
    """Return the segment of a `Build` that a bone of the avatars' rig belongs to."""
    return avatar_part(bone).removeprefix("left_").removeprefix("right_")


def stretch(build: Build, avatar: Avatar) -> tuple[FloatArray, FloatArray]:
    """Return linear maps (B, 3, 3) about each bone's head, and new heads (B, 3), meters, that give
    the avatar's rest pose another build."""
    heads = avatar.rest_transforms[:, :3, 3].astype(np.float64)
    children: dict[int, int] = {}
    for bone, parent in enumerate(avatar.bone_parents):
        if parent >= 0 and not avatar.bone_names[bone].endswith("_end"):
            children.setdefault(int(parent), bone)
    maps, moved = np.zeros((len(heads), 3, 3)), heads.copy()
    for bone, name in enumerate(avatar.bone_names):
        segment = segment_of(name)
        along, across = build.length.get(segment, 1.0), build.girth.get(segment, 1.0)
        direction = np.array([0.0, 1.0, 0.0])
        if segment not in ("torso", "neck", "head") and bone in children:
            direction = heads[children[bone]] - heads[bone]
            direction = direction / max(float(np.linalg.norm(direction)), 1e-9)
        maps[bone] = build.height * (
            across * np.eye(3) + (along - across) * np.outer(direction, direction)
        )
        parent = int(avatar.bone_parents[bone])
        moved[bone] = (
            build.height * heads[bone]
            if parent < 0
            else moved[parent] + maps[parent] @ (heads[bone] - heads[parent])
        )
    return maps, moved


def rebuild(avatar: Avatar, build: Build) -> Avatar:
    """Return the avatar with another build; its rest pose is still the T-pose."""
    maps, moved = stretch(build, avatar)
    heads = avatar.rest_transforms[:, :3, 3].astype(np.float64)
    own = avatar.bones
    influences = np.einsum("vkij,vkj->vki", maps[own], avatar.influences - heads[own]) + moved[own]
    # a stretched mesh has one rest position per vertex again: the blend over its bones
    blended = np.einsum("vk,vki->vi", avatar.weights, influences)
    rest = avatar.rest_transforms.copy()
    rest[:, :3, 3] = moved
    return dataclasses.replace(
        avatar,
        influences=np.repeat(blended[:, None], own.shape[1], axis=1).astype(np.float32),
        rest_transforms=rest,
    )


def part_map(avatar: Avatar) -> IntArray:
    """Return the body part (H, W) int8 of the texels of an avatar's texture; -1 outside faces, and
    on wigs and eyes."""
    body = np.flatnonzero(avatar.mesh_ids == np.bincount(avatar.mesh_ids).argmax())
    return paint_faces(avatar, body, avatar.parts[avatar.faces[body, 0]])


def paint_faces(avatar: Avatar, chosen: IntArray, values: IntArray) -> IntArray:
    """Paint the values (n,) of `chosen` faces (n,) on the texels (H, W) int8 of an avatar's
    texture; -1 elsewhere."""
    import cv2

    height, width = avatar.texture.shape[:2]
    corners = np.stack(
        [avatar.uv[chosen, :, 0] * width, (1 - avatar.uv[chosen, :, 1]) * height], axis=-1
    )
    painted = np.full((height, width), -1, np.int16)
    for corner, value in zip(np.rint(corners).astype(np.int32), values.tolist(), strict=True):
        cv2.fillConvexPoly(painted, corner, value)
    return painted.astype(np.int8)


@dataclass(frozen=True, eq=False)
class Wardrobe:
    """The texels of an avatar's clothes.

    Attributes
    ----------
    rows, columns : (n,) int
        Texels of clothes.
    lab : (n, 3) float32
        Their CIELAB colors (L 0 to 100).
    opacity : (n,) float32
        Probability that they are clothes and not skin.
    cluster : (n,) int
        Group of similar colors.
    region : (n,) int
        0 upper body, 1 legs, 2 feet.
    """

    rows: IntArray
    columns: IntArray
    lab: FloatArray
    opacity: FloatArray
    cluster: IntArray
    region: IntArray


_CLUSTERS = 4
_REGION_OF_PART = np.array(
    [{"thigh": 1, "shin": 1, "foot": 2}.get(name.split("_")[-1], 0) for name in PARTS]
)


def find_clothes(avatar: Avatar) -> Wardrobe:
    """Find an avatar's clothes: the texels below the head whose color differs from the person's
    hands and face.

    This is fast and sufficient.
    """
    import cv2

    part = part_map(avatar)
    lab = cv2.cvtColor(avatar.texture.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    hands = np.isin(part, [PARTS.index("left_hand"), PARTS.index("right_hand")])
    skin = np.stack(
        [np.median(lab[hands], axis=0), np.median(lab[part == PARTS.index("head")], axis=0)]
    )
    worn = (part >= 0) & (part != PARTS.index("head")) & ~hands
    rows, columns = np.nonzero(worn)
    own = lab[rows, columns]
    apart = (own[:, None] - skin[None]) * np.array([0.35, 1.0, 1.0], np.float32)
    distance = np.sqrt((apart**2).sum(axis=-1)).min(axis=1)
    seen = np.zeros(part.shape, np.uint8)
    seen[rows, columns] = np.rint(255 * np.clip((distance - 9) / 9, 0, 1))
    seen = cv2.medianBlur(seen, 9)  # specks of skin color are worn cloth
    opacity = cv2.GaussianBlur(seen, (0, 0), 1.0)[rows, columns] / np.float32(255)
    keep = opacity > 0.02
    return sort_clothes(part, rows[keep], columns[keep], own[keep], opacity[keep])


def sort_clothes(
    part: IntArray, rows: IntArray, columns: IntArray, own: FloatArray, opacity: FloatArray
) -> Wardrobe:
    """Make the wardrobe of texels of clothes.

    `rows` and `columns` (n,) are texels of a `part_map` (H, W), with their CIELAB colors (n, 3) and
    opacity (n,).
    """
    import cv2

    if len(own) < 100:
        return Wardrobe(
            rows, columns, own, opacity, np.zeros(len(own), int), np.zeros(len(own), int)
        )
    sample = np.ascontiguousarray(own[:: max(1, len(own) // 4000)])
    cv2.setRNGSeed(0)
    _, _, centers = cv2.kmeans(
        sample, _CLUSTERS, None, (cv2.TERM_CRITERIA_MAX_ITER, 12, 0.1), 1, cv2.KMEANS_PP_CENTERS
    )
    groups = np.zeros(part.shape, np.uint8)
    groups[rows, columns] = ((own[:, None] - centers[None]) ** 2).sum(axis=-1).argmin(axis=1)
    cluster = cv2.medianBlur(groups, 11)[rows, columns].astype(np.int64)
    return Wardrobe(rows, columns, own, opacity, cluster, _REGION_OF_PART[part[rows, columns]])


def recolor(texture: ByteArray, clothes: Wardrobe, generator: np.random.Generator) -> ByteArray:
    """Return the texture (H, W, 3) with other colors, and sometimes a pattern, on the clothes.

    Skin, hair and details of shoes are unchanged.
    """
    import cv2

    if not len(clothes.rows) or generator.random() < 0.15:
        return texture
    lab = clothes.lab.copy()
    by_cluster = generator.random() < 0.5
    groups = clothes.cluster if by_cluster else clothes.region
    for group in np.unique(groups):
        chosen = groups == group
        if generator.random() < 0.2:
            continue
        own = lab[chosen]
        middle = own.mean(axis=0)
        hue, chroma = generator.uniform(0, 2 * np.pi), min(abs(generator.normal(0, 26)), 60)
        target = np.array([generator.uniform(10, 92), chroma * np.cos(hue), chroma * np.sin(hue)])
        contrast = generator.uniform(0.8, 1.3)
        lab[chosen] = target + (own - middle) * np.array([contrast, 0.5, 0.5])
    for region in (0, 1):
        if generator.random() < 0.3:
            chosen = clothes.region == region
            lab[chosen] += draw_pattern(clothes.rows[chosen], clothes.columns[chosen], generator)
    lab[:, 0] = np.clip(lab[:, 0], 3, 97)
    new = cv2.cvtColor(lab[None].astype(np.float32), cv2.COLOR_LAB2RGB)[0]
    old = texture[clothes.rows, clothes.columns].astype(np.float32)
    mixed = old + clothes.opacity[:, None] * (255 * np.clip(new, 0, 1) - old)
    result = texture.copy()
    result[clothes.rows, clothes.columns] = np.rint(mixed).astype(np.uint8)
    return result


def draw_pattern(rows: IntArray, columns: IntArray, generator: np.random.Generator) -> FloatArray:
    """Draw stripes, checks, dots or blots: changes of color (n, 3) in CIELAB."""
    import cv2

    change = np.array([generator.normal(0, 22), generator.normal(0, 14), generator.normal(0, 14)])
    period, angle = (
        generator.uniform(8, 70),
        generator.choice([0.0, np.pi / 2, generator.uniform(0, np.pi)]),
    )
    along = (columns * np.cos(angle) + rows * np.sin(angle)) / period
    across = (rows * np.cos(angle) - columns * np.sin(angle)) / period
    duty = generator.uniform(0.2, 0.6)
    kind = generator.choice(["stripes", "checks", "dots", "blots"])
    if kind == "stripes":
        amount = (along % 1) < duty
    elif kind == "checks":
        amount = 0.5 * (((along % 1) < duty).astype(float) + ((across % 1) < duty))
    elif kind == "dots":
        amount = ((along % 1) - 0.5) ** 2 + ((across % 1) - 0.5) ** 2 < (0.5 * duty) ** 2
    else:
        coarse = generator.standard_normal((48, 48)).astype(np.float32)
        smooth = cv2.resize(coarse, (512, 512), interpolation=cv2.INTER_CUBIC)
        # a person without such clothes has no texels, but the same random numbers are drawn
        amount = (
            smooth[
                (rows * 512 // (rows.max(initial=0) + 1)),
                (columns * 512 // (columns.max(initial=0) + 1)),
            ]
            > 0.3
        )
    return np.asarray(np.asarray(amount, np.float64)[:, None] * change)

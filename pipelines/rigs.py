"""Options for the rig of exports, and the files that they make."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from a2v.animation import RIGS, prepare_rig, skin_of
from a2v.animation.rig_spec import OWN_RIG
from a2v.animation.visemes import NAMINGS
from a2v.errors import InputError
from a2v.formats import write_glb, write_rig_bvh
from a2v.formats.bare import write_rig_skeleton
from a2v.formats.characters import Strengths
from a2v.formats.gltf import VrmMeta, write_vrm, write_vrma
from a2v.formats.gltf.vrm import EDITIONS
from a2v.formats.smpl import write_smpl_motion
from a2v.motion.edit import Edit
from a2v.motion.on_rig import retarget_edited
from a2v.props import Props
from a2v.types import Body, Character, FloatArray, Motion
from pipelines.nodes.values import Poses
from pipelines.options import flag, option

AVATAR = ".vrm"
"""Suffix of a VRM file."""
RIG = f"bones: {', '.join(RIGS)}"
ROOT_MOTION = "add a root bone on the ground that carries travel and heading"
VISEMES = "add 15 visemes with the names of oculus or vrchat; or rig for those of the chosen rig"
"""Help of options with these names."""


@dataclass(frozen=True, kw_only=True)
class RigOptions:
    """Options for the tools that open the exports."""

    rig: str = option(RIG, default=OWN_RIG, choices=RIGS, metavar="RIG")
    root_motion: bool = flag(ROOT_MOTION, rare=True)
    visemes: str = option(
        VISEMES, default="rig", choices=("rig", *NAMINGS), metavar="WHOSE", rare=True
    )

    @property
    def plain(self) -> bool:
        """Whether exports use the body's own rig unchanged."""
        return self.rig == OWN_RIG and not self.root_motion and self.visemes == "rig"

    def prepare(
        self, character: Character, clips: Mapping[str, tuple[FloatArray, float]]
    ) -> tuple[Character, dict[str, tuple[FloatArray, float]]]:
        """Change the rig (see `a2v.animation.prepare_rig`); plain options change nothing."""
        if self.plain:
            return character, dict(clips)
        visemes = "" if self.visemes == "rig" else self.visemes
        return prepare_rig(
            character, clips, rig=self.rig, root_motion=self.root_motion, visemes=visemes
        )


def write_rigged(
    folder: Path,
    character: Character,
    poses: Poses,
    options: RigOptions,
    *,
    name: str,
    props: Props | None = None,
) -> list[Path]:
    """Write ``character.glb`` and ``motion.bvh`` of a character's clip on the requested rig."""
    clip = (poses.bone_transforms, poses.fps)
    person, clips = options.prepare(character, {name: clip})
    paths = [folder / "character.glb", folder / "motion.bvh"]
    write_glb(paths[0], person, clips, expressions={name: poses.expressions}, props=props)
    write_rig_bvh(paths[1], person.body, *clips[name])
    return paths


def write_avatar(
    path: Path,
    character: Character,
    clips: Mapping[str, tuple[FloatArray, float]],
    meta: VrmMeta,
    *,
    expressions: Strengths,
) -> list[Path]:
    """Write a ``.vrm`` and beside it one ``<stem>.<clip>.vrma`` per clip, with its expressions.

    See `AvatarOptions.meta`.
    """
    person, moves = prepare_rig(character, clips, rig="vrm")
    write_vrm(path, person, meta)
    paths = [path]
    for name, (transforms, fps) in moves.items():
        paths.append(path.with_name(f"{path.stem}.{name}.vrma"))
        strengths = expressions.get(name) if person.surface.face is not None else None
        write_vrma(paths[-1], person.body, transforms, fps, name=name, strengths=strengths)
    return paths


@dataclass(frozen=True, kw_only=True)
class AvatarOptions:
    """What a ``.vrm`` says of its author and license."""

    author: str = option("author of the avatar; a .vrm requires it", default="")
    license_url: str = option(
        "address of the license of the avatar; a .vrm requires it", default="", metavar="URL"
    )
    vrm: str = option(
        "edition of a .vrm; 0.x for VSeeFace and other programs that do not read 1.0",
        default=EDITIONS[0],
        choices=EDITIONS,
    )

    def meta(self, path: Path, rigging: RigOptions) -> VrmMeta | None:
        """Return the description that a ``.vrm`` holds; None for other files.

        Raises
        ------
        InputError
            A ``.vrm`` cannot have the rig or root motion, or has no author or license.
        """
        if path.suffix.lower() != AVATAR:
            return None
        if rigging.rig not in (OWN_RIG, "vrm"):
            raise InputError(
                f"a .vrm requires the rig vrm, not {rigging.rig}; leave --rig out, or write a .glb"
            )
        if rigging.root_motion:
            raise InputError(
                "a VRM animation has no root; leave --root-motion out, or write a .glb"
            )
        return VrmMeta(
            name=path.stem, author=self.author, license_url=self.license_url, edition=self.vrm
        )


def write_rigged_motion(path: Path, motion: Motion, options: RigOptions, edit: Edit) -> list[Path]:
    """Write edited clips, except for "in place", on the rig of an average adult.

    Several clips become numbered files. The suffix is one of `RIG_MOTIONS`.
    """
    from a2v.body import load_body_model, make_body

    person = skin_of(make_body(load_body_model(), grounded=True))
    batch = bool(motion.batch)
    paths = (
        [
            path.with_name(f"{path.stem}_{index:03d}{path.suffix}")
            for index in range(motion.batch[0])
        ]
        if batch
        else [path]
    )
    for index, target in enumerate(paths):
        clip = motion[index] if batch else motion
        moved, clips = options.prepare(
            person, {"motion": (retarget_edited(clip, person.body, edit), clip.fps)}
        )
        RIG_MOTIONS[path.suffix.lower()](target, moved.body, *clips["motion"])
    return paths


RIG_MOTIONS: dict[str, Callable[[Path, Body, FloatArray, float], object]] = {
    ".bvh": write_rig_bvh,
    ".fbx": write_rig_skeleton,
    ".glb": write_rig_skeleton,
    ".npz": write_smpl_motion,
    ".vrma": write_vrma,
}
"""Writers of motions on a rig, by suffix."""
ONLY_RIGS = {".npz": "smpl", ".vrma": "vrm"}
"""The rig that files of these suffixes need."""


def write_pose(path: Path, character: Character) -> Path:
    """Write the pose in which a character is bound as a motion of one frame, on the rig that the
    file needs, else on the body's own."""
    rig = ONLY_RIGS.get(path.suffix.lower(), OWN_RIG)
    still = character.body.bone_transforms[None]
    person, clips = RigOptions(rig=rig).prepare(character, {"pose": (still, 30.0)})
    RIG_MOTIONS[path.suffix.lower()](path, person.body, *clips["pose"])
    return path


def rig_of_motions(path: Path, rig: str | None, root_motion: bool) -> RigOptions | None:
    """Return the options of the rig of a motion file; None for the motion's own skeleton.

    Raises
    ------
    InputError
        The file cannot have the rig.
    """
    suffix = path.suffix.lower()
    rig = rig or ("vrm" if suffix == ".vrma" else None)
    if rig is None:
        if root_motion:
            raise InputError("--root-motion requires a rig; name one with --rig")
        return None
    known = [one for one in RIG_MOTIONS if ONLY_RIGS.get(one, rig) == rig]
    if suffix not in known:
        raise InputError(
            f"cannot write {path} with --rig {rig}; a motion on this rig is a "
            f"{', '.join(known)}, and a2v character writes characters"
        )
    if root_motion and suffix in ONLY_RIGS:
        raise InputError(f"a {suffix} has no root; leave --root-motion out")
    return RigOptions(rig=rig, root_motion=root_motion)

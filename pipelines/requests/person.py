"""Request for the person of a video: the photo, and the settings of the stages that use it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from a2v.animation import BindSettings, EngineSettings
from a2v.body import FitSettings, load_body_model
from a2v.body.registry import MODEL_SUFFIXES, MODELS
from a2v.errors import InputError
from a2v.io import read_bytes
from a2v.perception import Corrections, PerceptionSettings, read_corrections
from a2v.perception.corrections import MAX_BYTES
from a2v.reconstruction import (
    ColorSettings,
    FaceSettings,
    HandSettings,
    ImplicitSettings,
    SurfaceSettings,
)
from a2v.reconstruction.backends import DEFAULT_BACKEND, NAMES, BackendSettings, plugged
from a2v.reconstruction.canonical import CharacterSettings
from a2v.reconstruction.reading import ReadingSettings
from a2v.reconstruction.rules import COLORING, READING, left_out
from pipelines.engine.graph import Parameters
from pipelines.engine.refs import File
from pipelines.engine.store import Store
from pipelines.inputs import put_file
from pipelines.options import flag, option, settings
from pipelines.requests.fields import Request

ENGINE = EngineSettings()
"""Defaults of files for other tools."""


@dataclass(frozen=True, kw_only=True)
class PhotoOptions:
    """Options for the photo, and for user data that replaces the detectors' results."""

    photo: str = option(
        "photo of the whole person (JPEG, PNG...); repeat the option for further photos of the "
        "same person",
        more="more",
    )
    more: str | None = option(
        "further photos of the same person in the same clothes, separated by commas, for example "
        "from behind; the character has the pose of the first photo",
        default=None,
        metavar="FILES",
        rare=True,
    )
    mask: str | None = option(
        "image of the size of the photo, white where the person is; replaces the detected mask",
        default=None,
        metavar="FILE",
    )
    keypoints: str | None = option(
        "OpenPose JSON file; replaces the detected keypoints",
        default=None,
        metavar="FILE",
        rare=True,
    )
    corrections: str | None = option(
        "YAML file of corrections: landmarks, limbs in front or behind, strokes on the mask, which "
        "person",
        default=None,
        metavar="FILE",
    )


@dataclass(frozen=True, kw_only=True)
class PersonStages:
    """Settings of the stages from a photo to a character.

    The backend decides whether `implicit` or `shape` is used.
    """

    backend: str = option(
        f"reconstruction method: {', '.join(NAMES)}",
        default=DEFAULT_BACKEND,
        choices=NAMES,
        metavar="NAME",
    )
    pifuhd: str = option(
        "your file of PIFuHD's checkpoint, for the backend papers",
        default="",
        metavar="FILE",
        rare=True,
    )
    pifu_geometry: str = option(
        "your file of PIFu's net_G, for the shape if --pifuhd is absent; --pifu-color requires it",
        default="",
        metavar="FILE",
        rare=True,
    )
    pifu_color: str = option(
        "your file of PIFu's net_C: colors of unseen parts",
        default="",
        metavar="FILE",
        rare=True,
    )
    pamir_geometry: str = option(
        "your file of PaMIR's checkpoint for the shape; requires an SMPL file in --fit.model",
        default="",
        metavar="FILE",
        rare=True,
    )
    pamir_texture: str = option(
        "your file of PaMIR's checkpoint for the colors", default="", metavar="FILE", rare=True
    )
    pamir_refine: int = option(
        "number of steps in which PaMIR's field refines the body that its networks see; 0 for none",
        default=0,
        rare=True,
    )
    perception: PerceptionSettings = settings(
        PerceptionSettings, users=("confidence", "max_side", "face", "hands")
    )
    fit: FitSettings = settings(
        FitSettings, users=("model", "height", "distance", "starts", "seed")
    )
    implicit: ImplicitSettings = settings(
        ImplicitSettings, users=("weights", "resolution", "vertices")
    )
    shape: SurfaceSettings = settings(SurfaceSettings, users=("resolution", "vertices"))
    hands: HandSettings = settings(HandSettings)
    face: FaceSettings = settings(FaceSettings, users=("expressions",))
    character: str = option(
        "canonical: built in a rest pose; fused: built in the photo's pose",
        default="canonical",
        choices=("canonical", "fused"),
        metavar="KIND",
    )
    legs: str = option(
        "clothes on legs that the photo's lower edge cuts off, if it shows nothing of them",
        default="trousers",
        choices=("trousers", "shorts", "skirt"),
        metavar="KIND",
        rare=True,
    )
    legs_color: str = option(
        "their color as six hex digits, such as 803020 (default: dark blue)",
        default="",
        metavar="HEX",
        rare=True,
    )
    color: ColorSettings = settings(ColorSettings, users=("texture", "synthesis", "delight"))
    without: str = option(
        "rules of reading and coloring to leave out, separated by commas, to see what they do "
        "(docs/results/rules.md)",
        default="",
        metavar="NAMES",
        rare=True,
    )
    bind: BindSettings = settings(BindSettings, users=())
    triangles: int = option(
        "maximum number of triangles in exported files; 0: all",
        default=ENGINE.triangles,
    )
    texture: int = option(
        "width and height of the texture: 1024, 2048 or 4096 texels",
        default=ENGINE.texture,
        rare=True,
    )
    normal_map: int = option(
        "width and height of the normal map, texels; 0 for none",
        default=ENGINE.normal_map,
        rare=True,
    )
    one_material: bool = flag(
        "write one material in a .glb (default: one each for skin, hair, cloth, eyes and mouth)",
        rare=True,
    )

    @property
    def reconstruction(self) -> BackendSettings:
        """Return the settings of the requested backend with the digest of its weights."""
        if self.backend == "body-prior":
            return self.shape
        if self.backend == "pifu":
            return _with_digest(self.implicit)
        checkpoints = {
            name: getattr(self, name)
            for name in ("pifuhd", "pifu_geometry", "pifu_color", "pamir_geometry", "pamir_texture")
        }
        smpl = self.fit.model if self.pamir_geometry and self.fit.model.endswith(".npz") else ""
        refine = {"pamir_refine": self.pamir_refine} if self.pamir_refine else {}
        return plugged(self.backend, **checkpoints, **refine, smpl=smpl).pinned()

    def parameters(self) -> Parameters:
        """Return the settings of each stage by the name of the graph's parameter.

        Raises
        ------
        InputError
            A model's file is missing, or its name is unknown.
        """
        fit = dataclasses.replace(self.fit, model=FitSettings.model)  # a file counts by its content
        known = {
            "perception": self.perception,
            "fit": fit,
            "body_model": body_model_file(self.fit.model),
            "shape": self.reconstruction,
        }
        figure = CharacterSettings(
            kind="canonical" if self.character == "canonical" else "fused",
            legs=self.legs,  # type: ignore[arg-type]  # checked by the class
            legs_color=self.legs_color,
        )
        engine = EngineSettings(
            triangles=self.triangles,
            texture=self.texture,
            normal_map=self.normal_map,
            one_material=self.one_material,
        )
        off = left_out(self.without, {**READING, **COLORING})
        color = dataclasses.replace(
            self.color,
            texture=max(self.color.texture, engine.texture) if self.color.texture else 0,
            without=",".join(name for name in COLORING if name in off | self.color.off),
        )
        return {
            **known,
            "figure": figure,
            "hands": self.hands,
            "face": self.face,
            "color": color,
            "readers": ReadingSettings(without=",".join(name for name in READING if name in off)),
            "bind": self.bind,
            "engine": engine,
        }

    def with_photo(self, photo: str) -> PersonRequest:
        """Make the request for the person in a photo with these settings."""
        return PersonRequest(
            photo=photo,
            **{item.name: getattr(self, item.name) for item in dataclasses.fields(PersonStages)},
        )


@dataclass(frozen=True, kw_only=True)
class PersonRequest(Request, PersonStages, PhotoOptions):
    """A request for a character from a photo."""

    def resolve(self, store: Store) -> Parameters:
        """Return the graph's parameters from a photo to a character; copy files into `store`.

        Raises
        ------
        InputError
            A file cannot be read.
        """
        paths = listed(self.more or "")
        if paths and (self.character != "canonical" or self.fit.model != FitSettings.model):
            raise InputError(
                "several photos need the body model anny and --character canonical; leave "
                "--fit.model and --character out, or give one photo"
            )
        files = {name: getattr(self, name) for name in ("photo", "mask", "keypoints")}
        parameters = (
            {name: put_file(store, path) for name, path in files.items()}
            | self.parameters()
            | {"corrections": corrections_of(self.corrections)}
        )
        if not paths:
            return parameters
        photos = [
            ref for path in (self.photo, *paths) if (ref := put_file(store, path)) is not None
        ]
        if len({ref.digest for ref in photos}) < len(photos):
            raise InputError("one photo is given twice; give every photo of the person once")
        del parameters["body_model"]  # the common shape is Anny's
        return parameters | {
            "other": sorted(photos[1:], key=lambda ref: ref.digest)
        }  # the order of further photos does not matter


def corrections_of(path: str | None) -> Corrections:
    """Read the corrections in a YAML file; without a file there are none.

    Raises
    ------
    InputError
        The file cannot be read, or holds an invalid value.
    """
    return (
        Corrections() if path is None else read_corrections(read_bytes(path, limit=MAX_BYTES), path)
    )


MOST_PHOTOS = 8
"""Maximum number of photos of one person."""


def listed(more: str) -> list[str]:
    """Split a list of paths of further photos at its commas.

    Raises
    ------
    InputError
        With the first photo there are more than `MOST_PHOTOS`.
    """
    paths = [path.strip() for path in more.split(",") if path.strip()]
    if len(paths) >= MOST_PHOTOS:
        raise InputError(
            f"{len(paths) + 1} photos of one person are given; expected at most {MOST_PHOTOS}"
        )
    return paths


def body_model_file(name: str) -> File | None:
    """Return the file of a custom body model; None for the built-in models.

    Raises
    ------
    InputError
        Unknown name, or a missing file.
    """
    if name in MODELS:
        return None
    if not name.lower().endswith(MODEL_SUFFIXES):
        load_body_model(name)  # its error lists the names
    return File.of(name)


def _with_digest(settings: ImplicitSettings) -> ImplicitSettings:
    """Add the digest of the weights to the settings; cached results depend on it."""
    from a2v.reconstruction.implicit import ImplicitModel

    return dataclasses.replace(settings, digest=ImplicitModel.load(settings.weights or None).digest)

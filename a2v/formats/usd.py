"""Write characters as USD (UsdSkel), for Omniverse, Houdini, Maya, Unreal and Apple's viewers.

Needs the extra ``a2v[usd]``.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError, MissingDependencyError
from a2v.formats.characters import (
    Clips,
    ShadedTargets,
    Strengths,
    check_clips,
    encode_texture,
    linear_colors,
    parent_from_bone,
    strength_tables,
)
from a2v.geometry.mesh import vertex_normals
from a2v.io import atomic_path
from a2v.kinematics import rotmat_to_quat
from a2v.kinematics.resample import continuous
from a2v.props import Props
from a2v.types import Body, Character, FloatArray, Surface

SUFFIXES = (".usdz", ".usdc", ".usda", ".usd")


def write_usd(
    path: str | os.PathLike[str],
    character: Character,
    clips: Clips | None = None,
    *,
    name: str = "character",
    jpeg_quality: int = 92,
    expressions: Strengths | None = None,
    props: Props | None = None,
) -> None:
    """Write a textured (or vertex-colored), skinned and animated character as USD.

    The file has one SkelRoot with mesh, skeleton and one SkelAnimation per clip. The first clip
    plays, since USD binds one at a time. Time codes are frames of the first clip; keys of other
    clips are at their own times. Meters, y up.

    Parameters
    ----------
    path : path
        ``.usdz`` contains its texture; for ``.usdc``, ``.usda`` and ``.usd`` it is written next to
        the file as ``<stem>_texture.jpg`` or ``.png``.
    character : Character
    clips : Clips or None
    name : str
        Name of the root prim.
    jpeg_quality : int
        Quality of the texture, 1 to 100; 0 writes PNG.
    expressions : Strengths or None
        Strengths of the face's expressions in the clips.
    props : Props or None
        Solids in the scene: each has a mesh under ``/name/props``.

    Raises
    ------
    InputError
        The path has no suffix of USD; a clip has the wrong shape, is not finite or has no frames;
        unknown expressions.
    MissingDependencyError
        ``usd-core`` is not installed.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"cannot write {target}; expected a name that ends in {', '.join(SUFFIXES)}"
        )
    checked = check_clips(clips, len(character.body.bone_names))
    tables = strength_tables(character.surface.face, checked, expressions)
    _check_installed()
    from pxr import Usd, UsdUtils

    packed = target.suffix.lower() == ".usdz"
    texture = _texture_file(character.surface, "" if packed else f"{target.stem}_", jpeg_quality)
    with tempfile.TemporaryDirectory() as folder:
        scene = (
            Path(folder)
            / f"{target.stem if packed else 'scene'}{'.usdc' if packed else target.suffix.lower()}"
        )
        stage = Usd.Stage.CreateNew(str(scene))
        _fill_stage(
            stage,
            character,
            checked,
            tables,
            _identifier(name),
            None if texture is None else texture[0],
        )
        if props is not None and props.names:
            _add_props(stage, props, f"/{_identifier(name)}/props", next(iter(checked), ""))
        stage.GetRootLayer().Save()
        if packed:
            if texture is not None:
                (Path(folder) / texture[0]).write_bytes(texture[1])
            with atomic_path(target) as temporary:
                if not UsdUtils.CreateNewUsdzPackage(str(scene), str(temporary)):
                    raise InputError(f"cannot write {target}: USD refused to make the package")
            return
        beside = {} if texture is None else {target.with_name(texture[0]): texture[1]}
        for path_of, data in (beside | {target: scene.read_bytes()}).items():
            with atomic_path(path_of) as temporary:
                temporary.write_bytes(data)


def _check_installed() -> None:
    """Raise a `MissingDependencyError` if USD is not installed."""
    try:
        import pxr  # noqa: F401
    except ImportError as error:
        raise MissingDependencyError(
            "USD needs the package usd-core; install it with: pip install 'a2v[usd]'"
        ) from error


def _texture_file(surface: Surface, begin: str, quality: int) -> tuple[str, bytes] | None:
    """Name, which begins with `begin`, and bytes of a surface's texture; None without a texture."""
    if surface.uv is None or surface.texture is None:
        return None
    data, kind = encode_texture(surface.texture, quality)
    return f"{begin}texture{'.jpg' if kind == 'image/jpeg' else '.png'}", data


def _identifier(text: str) -> str:
    from pxr import Tf

    return str(Tf.MakeValidIdentifier(text))


def _fill_stage(
    stage: Any,
    character: Character,
    clips: Mapping[str, tuple[FloatArray, float]],
    tables: Mapping[str, FloatArray],
    name: str,
    texture: str | None,
) -> None:
    """Make the prims of a character, its clips and its expressions under ``/name``; `texture` is
    the name of the file next to the stage."""
    from pxr import UsdGeom, UsdSkel

    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    root = UsdSkel.Root.Define(stage, f"/{name}")
    stage.SetDefaultPrim(root.GetPrim())
    skeleton = _add_skeleton(stage, character.body, f"/{name}/skeleton")
    mesh = _add_mesh(stage, character.surface, f"/{name}/surface", textured=texture is not None)
    _add_material(stage, mesh, f"/{name}/material", texture)
    _bind_skin(mesh, character, skeleton)
    if character.surface.face is not None:
        _add_expressions(stage, mesh, ShadedTargets(character.surface))
    speed = next((fps for _, fps in clips.values()), 24.0)
    stage.SetTimeCodesPerSecond(speed)
    stage.SetFramesPerSecond(speed)
    moves = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    joints = skeleton.GetJointsAttr().Get()
    taken = {"skeleton", "surface", "material", "props"}
    for index, (key, (transforms, fps)) in enumerate(clips.items()):
        label = _identifier(key) or "clip"
        while label in taken:
            label += "_"
        taken.add(label)
        steps = parent_from_bone(transforms, character.body.bone_parents)
        codes = np.arange(len(steps)) * speed / fps
        animation = _add_animation(stage, f"/{name}/{label}", joints, steps, codes=codes)
        if key in tables and character.surface.face is not None:
            _animate_face(animation, character.surface.face.names, tables[key], codes=codes)
        if index == 0:
            moves.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
            stage.SetStartTimeCode(0)
            stage.SetEndTimeCode(len(steps) - 1)


def _add_skeleton(stage: Any, body: Body, path: str) -> Any:
    from pxr import UsdSkel, Vt

    labels = [_identifier(bone) for bone in body.bone_names]
    joints: list[str] = []
    for bone, parent in enumerate(body.bone_parents.tolist()):
        joints.append(labels[bone] if parent < 0 else f"{joints[parent]}/{labels[bone]}")
    bind = body.bone_transforms.astype(np.float64)

    def matrices(
        values: FloatArray,
    ) -> Any:  # USD's points are rows: v M, so matrices are transposed
        return Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(np.swapaxes(values, 1, 2)))

    skeleton = UsdSkel.Skeleton.Define(stage, path)
    skeleton.CreateJointsAttr(joints)
    skeleton.CreateBindTransformsAttr(matrices(bind))
    skeleton.CreateRestTransformsAttr(matrices(parent_from_bone(bind[None], body.bone_parents)[0]))
    return skeleton


def _add_props(stage: Any, props: Props, path: str, clip: str) -> None:
    """Add a mesh for each of the solids under the prim `path`; none is bound to the skeleton. Those
    that move have a matrix in each frame of the clip that plays; those of other clips are left
    out."""
    from pxr import Gf, UsdGeom

    UsdGeom.Xform.Define(stage, path)
    for (name, solid), mover in zip(props.surfaces(), props.movers.tolist(), strict=True):
        if mover >= 0 and props.clips[mover] not in ("", clip):
            continue
        mesh = _add_mesh(stage, solid, f"{path}/{_identifier(name)}", textured=False)
        if mover >= 0:
            placed = mesh.AddTransformOp()
            for frame, matrix in enumerate(props.moves[:, mover].astype(np.float64)):
                placed.Set(Gf.Matrix4d(*matrix.T.ravel().tolist()), frame)


def _add_mesh(stage: Any, surface: Surface, path: str, *, textured: bool) -> Any:
    from pxr import Sdf, UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    points = np.ascontiguousarray(surface.vertices, np.float32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(surface.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(
        Vt.IntArray.FromNumpy(np.ascontiguousarray(surface.faces, np.int32).ravel())
    )
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateNormalsAttr(
        Vt.Vec3fArray.FromNumpy(
            vertex_normals(
                surface.vertices, surface.faces.astype(np.int64), dtype=np.float32
            ).astype(np.float32)
        )
    )
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
    if textured and surface.uv is not None:
        uv = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
            "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
        )
        uv.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(surface.uv.reshape(-1, 2), np.float32)))
    else:
        shown = mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex)
        shown.Set(Vt.Vec3fArray.FromNumpy(linear_colors(surface.colors).astype(np.float32)))
    return mesh


def _bind_skin(mesh: Any, character: Character, skeleton: Any) -> None:
    from pxr import Gf, UsdSkel, Vt

    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateJointIndicesPrimvar(False, 4).Set(
        Vt.IntArray.FromNumpy(np.ascontiguousarray(character.bones, np.int32).ravel())
    )
    weights = character.weights / character.weights.sum(axis=1, keepdims=True)
    binding.CreateJointWeightsPrimvar(False, 4).Set(
        Vt.FloatArray.FromNumpy(np.ascontiguousarray(weights, np.float32).ravel())
    )
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])


def _add_expressions(stage: Any, mesh: Any, expressions: ShadedTargets) -> None:
    """Add a BlendShape below the mesh for each expression."""
    from pxr import UsdSkel, Vt

    paths, names = [], expressions.face.names
    for name in names:
        vertices, offsets, turns = expressions(name)
        shape = UsdSkel.BlendShape.Define(stage, f"{mesh.GetPath()}/{_identifier(name)}")
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(offsets, np.float32)))
        shape.CreateNormalOffsetsAttr(
            Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(turns, np.float32))
        )
        shape.CreatePointIndicesAttr(
            Vt.IntArray.FromNumpy(np.ascontiguousarray(vertices, np.int32))
        )
        paths.append(shape.GetPath())
    binding = UsdSkel.BindingAPI(mesh.GetPrim())
    binding.CreateBlendShapesAttr([_identifier(name) for name in names])
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)


def _animate_face(
    animation: Any, names: Sequence[str], table: FloatArray, *, codes: FloatArray
) -> None:
    """Add strengths (T, N) of the expressions `names` to a SkelAnimation, if they are above 0 in
    any frame."""
    from pxr import Vt

    used = np.flatnonzero(table.any(axis=0))
    animation.CreateBlendShapesAttr([_identifier(names[index]) for index in used])
    weights = animation.CreateBlendShapeWeightsAttr()
    for row, code in zip(table, codes.tolist(), strict=True):
        weights.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(row[used], np.float32)), code)


def _add_animation(
    stage: Any, path: str, joints: Any, steps: FloatArray, *, codes: FloatArray
) -> Any:
    """Make a SkelAnimation of transforms (T, B, 4, 4) in the parents' frames, with keys at the time
    codes (T,)."""
    from pxr import Gf, UsdSkel, Vt

    animation = UsdSkel.Animation.Define(stage, path)
    animation.CreateJointsAttr(joints)
    quats = np.stack(
        [continuous(rotmat_to_quat(steps[:, bone, :3, :3])) for bone in range(steps.shape[1])],
        axis=1,
    )
    rotations, translations = animation.CreateRotationsAttr(), animation.CreateTranslationsAttr()
    animation.CreateScalesAttr().Set(Vt.Vec3hArray([Gf.Vec3h(1)] * steps.shape[1]))
    for frame, code in enumerate(codes.tolist()):
        # numpy's quaternions are wxyz, the memory of Gf.Quatf is xyzw
        rotations.Set(
            Vt.QuatfArray.FromNumpy(
                np.ascontiguousarray(quats[frame][:, [1, 2, 3, 0]], np.float32)
            ),
            code,
        )
        translations.Set(
            Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(steps[frame, :, :3, 3], np.float32)), code
        )
    return animation


def _add_material(stage: Any, mesh: Any, path: str, texture: str | None) -> None:
    from pxr import Sdf, UsdShade

    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/preview")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.9)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.0)
    color = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    reader = UsdShade.Shader.Define(stage, f"{path}/reader")
    if texture is None:
        reader.CreateIdAttr("UsdPrimvarReader_float3")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
        color.ConnectToSource(reader.CreateOutput("result", Sdf.ValueTypeNames.Float3))
    else:
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        image = UsdShade.Shader.Define(stage, f"{path}/texture")
        image.CreateIdAttr("UsdUVTexture")
        image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(f"./{texture}"))
        image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
        image.CreateInput("wrapS", Sdf.ValueTypeNames.Token).Set("clamp")
        image.CreateInput("wrapT", Sdf.ValueTypeNames.Token).Set("clamp")
        image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(
            reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        )
        color.ConnectToSource(image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    material.CreateSurfaceOutput().ConnectToSource(
        shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    )
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)

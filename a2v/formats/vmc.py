"""Poses as messages of the VMC protocol (OSC over UDP), which programs for VRM avatars receive.

The protocol is described at https://protocol.vmc.info: positions and quaternions are those of
Unity, whose x axis points to the other side.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from a2v.errors import InputError
from a2v.kinematics import rotmat_to_quat
from a2v.types import FloatArray

PORT = 39539
"""Usual port of programs that receive motions."""
_THUMB = {"ThumbProximal": "ThumbIntermediate", "ThumbMetacarpal": "ThumbProximal"}


def unity_name(bone: str) -> str:
    """Return Unity's name of a humanoid bone of VRM 1.0."""
    for own, theirs in _THUMB.items():
        bone = bone.replace(own, theirs) if bone.endswith(own) else bone
    return bone[:1].upper() + bone[1:]


def to_unity(place: FloatArray, rotmat: FloatArray) -> list[float]:
    """Return position and quaternion (x, y, z, w) in Unity's axes.

    Parameters
    ----------
    place : (3,)
        Meters, y up, +z to the front.
    rotmat : (3, 3)
    """
    w, x, y, z = (float(value) for value in rotmat_to_quat(rotmat))
    return [-float(place[0]), float(place[1]), float(place[2]), x, -y, -z, w]


def vmc_bundle(
    local: Mapping[str, FloatArray],
    *,
    time: float,
    strengths: Mapping[str, float] | None = None,
) -> bytes:
    """Return one OSC bundle with a pose.

    Parameters
    ----------
    local : mapping of VRM's bone names to (4, 4)
        Parent from bone of a rig whose bones have the axes of the world in the T-pose. The bone
        "root" is the person's place.
    time : float
        Seconds since the start.
    strengths : mapping, optional
        Expressions by name, each in [0, 1].

    Raises
    ------
    InputError
        The package python-osc is not installed.
    """
    try:
        from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
        from pythonosc.osc_message_builder import OscMessageBuilder
    except ImportError:
        raise InputError(
            "VMC needs the package python-osc; install it with: pip install 'a2v[vmc]'"
        ) from None

    bundle = OscBundleBuilder(IMMEDIATELY)

    def add(address: str, *values: Any) -> None:
        message = OscMessageBuilder(address=address)
        for value in values:
            message.add_arg(value)
        bundle.add_content(message.build())

    add("/VMC/Ext/OK", 1)
    add("/VMC/Ext/T", float(time))
    for name, matrix in local.items():
        values = to_unity(matrix[:3, 3], matrix[:3, :3])
        if name == "root":
            add("/VMC/Ext/Root/Pos", "root", *values)
        else:
            add("/VMC/Ext/Bone/Pos", unity_name(name), *values)
    for name, value in (strengths or {}).items():
        add("/VMC/Ext/Blend/Val", name, float(value))
    if strengths:
        add("/VMC/Ext/Blend/Apply")
    found: bytes = bundle.build().dgram
    return found

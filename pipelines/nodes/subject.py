"""Nodes from a photo to the person in it."""

from __future__ import annotations

import dataclasses
from contextlib import AbstractContextManager

from a2v.beside import loading_beside
from a2v.errors import InputError
from a2v.perception import Corrections, PerceptionSettings
from a2v.types import Subject
from pipelines.engine.memo import memo, note
from pipelines.engine.refs import Ref
from pipelines.engine.store import get, put
from pipelines.nodes.values import Blob


@memo()
def subject(
    photo: Ref[Blob],
    mask: Ref[Blob] | None,
    keypoints: Ref[Blob] | None,
    corrections: Corrections,
    perception: PerceptionSettings,
) -> Ref[Subject]:
    """Find the person: landmarks, mask, crop.

    A mask (an image) and OpenPose keypoints (JSON) replace the detectors. Corrections change
    either.
    """
    return put(found_in(photo, mask, keypoints, corrections, perception))


def found_in(
    photo: Ref[Blob],
    mask: Ref[Blob] | None,
    keypoints: Ref[Blob] | None,
    corrections: Corrections,
    perception: PerceptionSettings,
) -> Subject:
    """The person in a photo; see `subject`."""
    from a2v.perception import decode_mask, decode_photo, find_person, read_openpose
    from a2v.perception.photo import focal_length

    name = photo.source or "the photo"
    data = bytes(get(photo, Blob))
    pixels = decode_photo(data, name)
    given_mask = (
        None if mask is None else decode_mask(bytes(get(mask, Blob)), mask.source or "the mask")
    )
    given_keypoints = (
        None
        if keypoints is None
        else read_openpose(
            bytes(get(keypoints, Blob)),
            photo_size=(pixels.shape[1], pixels.shape[0]),
            name=keypoints.source or "the keypoints file",
        )
    )
    try:
        with _loading_what_follows():
            found = find_person(
                pixels,
                mask=given_mask,
                keypoints=given_keypoints,
                settings=perception,
                corrections=corrections,
            )
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    for warning in found.warnings:
        note(warning)
    return dataclasses.replace(found, focal_length=focal_length(data))


def _loading_what_follows() -> AbstractContextManager[None]:
    """Import what matting and the fit of the body need while the detectors run: 2 s of imports.

    pymeshlab is not among them: loaded in a thread beside mediapipe, it corrupted the heap.
    """
    from a2v.geometry.rays import load_open3d
    from a2v.perception.matting import load_pymatting

    def load_fit() -> None:
        import scipy.optimize  # noqa: F401
        import torch.fx.experimental.symbolic_shapes  # noqa: F401  the Hessian of the fit imports it

    return loading_beside(load_pymatting, load_fit, load_open3d)

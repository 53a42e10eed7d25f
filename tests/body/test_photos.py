"""The fit on real photographs, through a2v's own perception."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.body import fit_body, load_body_model
from a2v.body.pose_space import pose_space


@pytest.mark.slow
@pytest.mark.parametrize(
    ("photo", "mask", "iou"),
    [
        ("PIFu_ryota.png", "PIFu_ryota_mask.png", 0.80),
        ("tfjs_pose.jpg", None, 0.80),
        ("mmpose_coco_000000000785.jpg", None, 0.70),
    ],
)
def test_keypoints_of_real_people_are_met(
    data_dir: Path, photo: str, mask: str | None, iou: float
) -> None:
    from a2v.perception import decode_mask, decode_photo, find_person

    folder = data_dir / "photos"
    if not (folder / photo).is_file():
        pytest.skip(f"{folder / photo} is absent")
    pixels = decode_photo((folder / photo).read_bytes(), photo)
    given = None if mask is None else decode_mask((folder / mask).read_bytes(), mask)
    result = fit_body(find_person(pixels, mask=given))
    assert result.residuals["keypoint_mean"] < 0.02
    assert result.residuals["keypoint_max"] <= 0.03
    assert result.residuals["silhouette_iou"] > iou
    space = pose_space(load_body_model())
    angles = result.body.parameters["angles"]
    assert (angles > space.limits[:, 0] - 0.1).all()
    assert (angles < space.limits[:, 1] + 0.1).all()
    if photo.startswith("PIFu"):  # he stands: straight legs, feet level, upright trunk
        for side in ("left", "right"):
            assert abs(angles[space.index(f"{side}_knee_bend")]) < np.radians(12)
        joints = result.body.bone_transforms[:, :3, 3]
        names = result.body.bone_names
        assert abs(joints[names.index("upperleg01.L"), 2] - joints[names.index("foot.L"), 2]) < 0.08
        assert abs(joints[names.index("neck01"), 2] - joints[0, 2]) < 0.12
    if photo.startswith(
        "tfjs"
    ):  # his right knee is bent by a right angle, the left leg is straight
        assert angles[space.index("right_knee_bend")] > np.radians(50)
        assert abs(angles[space.index("left_knee_bend")]) < np.radians(20)
        # he looks past his right hand
        head = result.body.bone_names.index("head")
        ahead = result.body.bone_transforms[head, :3, :3] @ [0, 0, 1]
        assert np.degrees(np.arctan2(ahead[0], ahead[2])) < -45

"""Poses that people can take."""

from __future__ import annotations

import numpy as np

from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.posing import joint_noise, natural_pose, open_pose
from a2v.lab.studio.studio import Studio


def test_poses_are_human(avatar: Avatar, studio: Studio) -> None:
    generator = np.random.default_rng(0)
    bone = avatar.bone_names.index
    for make in (
        natural_pose,
        open_pose,
        lambda g: studio.library.pose(int(g.integers(len(studio.library.actions)))),
    ):
        for _ in range(25):
            placed = avatar.bone_transforms(joint_noise(make(generator), generator))[:, :3, 3]
            for side in ("Left", "Right"):
                hip, knee, ankle = (
                    placed[bone(f"{side}{name}")] for name in ("UpLeg", "Leg", "Foot")
                )
                if make is not natural_pose and make is not open_pose:
                    continue
                assert knee[1] < hip[1] - 0.25  # standing
                assert ankle[1] < knee[1] - 0.25
            span = placed[bone("LeftArm")] - placed[bone("RightArm")]
            assert np.hypot(span[0], span[2]) > 0.1
    elbows = [avatar.bone_transforms(natural_pose(generator)) for _ in range(20)]
    for transforms in elbows:
        shoulder, elbow, wrist = (
            transforms[bone(f"Left{name}"), :3, 3] for name in ("Arm", "ForeArm", "Hand")
        )
        reach = np.linalg.norm(wrist - shoulder) / (
            np.linalg.norm(elbow - shoulder) + np.linalg.norm(wrist - elbow)
        )
        assert reach > 0.25  # no forearm folded through the upper arm

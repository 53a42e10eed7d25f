"""The hand-written gradient of forward kinematics agrees with autograd."""

from __future__ import annotations

import pytest
import torch

from a2v.kinematics import SKELETONS, forward_kinematics
from a2v.kinematics.gradient import ChainPlan, local_kinematics


@pytest.mark.parametrize("name", sorted(SKELETONS))
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-12), (torch.float32, 2e-5)])
def test_values_and_gradients_are_autograds(
    name: str, dtype: torch.dtype, tolerance: float
) -> None:
    skeleton = SKELETONS[name]
    generator = torch.Generator().manual_seed(0)
    rotations = torch.randn(7, skeleton.n_joints, 3, dtype=dtype, generator=generator)
    # no rotation, a tiny one (where the series applies), and more than half a turn
    rotations[0], rotations[1], rotations[2], rotations[3] = (
        0,
        rotations[1] * 1e-7,
        rotations[2] * 0.25,
        rotations[3] * 3,
    )
    rotations.requires_grad_()
    lengths = torch.rand(7, skeleton.n_joints, dtype=dtype, generator=generator)
    weights = torch.randn(7, skeleton.n_joints, 3, dtype=dtype, generator=generator)
    plan = ChainPlan.of(skeleton, dtype)
    joints = local_kinematics(rotations, lengths, plan)
    with torch.no_grad():
        assert torch.equal(local_kinematics(rotations, lengths, plan), joints)
    expected = forward_kinematics(rotations, rotations.new_zeros(7, 3), lengths, skeleton)
    assert (joints - expected).abs().max().item() < tolerance
    (ours,) = torch.autograd.grad((weights * joints).sum(), rotations)
    (theirs,) = torch.autograd.grad((weights * expected).sum(), rotations)
    assert theirs.abs().max().item() > 0.5
    # entry 0 is not used
    assert (ours - theirs)[:, 1:].abs().max().item() < 20 * tolerance
    assert ours[:, 0].abs().max().item() == 0

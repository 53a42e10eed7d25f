"""Displacements that are observed from the reconstructed surface."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import on_parts
from a2v.reconstruction.canonical import Sight, canonical_person
from a2v.reconstruction.canonical.build import with_teeth
from a2v.reconstruction.canonical.topology import topology
from a2v.reconstruction.canonical.wear import without_anatomy
from a2v.types import Body
from tests.support.bodies import with_turned_limb
from tests.support.faces import CAMERA, photographed
from tests.support.sights import with_skirt
from tests.support.surfaces import coated


def test_an_arm_that_hangs_on_the_trunk_gives_no_wings(body: Body) -> None:
    hanging = with_turned_limb(
        with_turned_limb(body, "upperarm01.L", (0, 0, -38)), "upperarm01.R", (0, 0, 38)
    )
    surface = coated(hanging, cell=0.012, coat=0.025)
    standing = canonical_person(
        with_skirt(Sight(photographed(hanging), hanging, CAMERA, surface), False)
    ).surface.standing
    assert standing is not None
    mesh = topology()
    rest = mesh.refined(without_anatomy(hanging, with_teeth(hanging)[1]))
    parts = hanging.parts[mesh.nearest].astype(np.int64)
    own = on_parts(parts, "left_upper_arm", "right_upper_arm", "torso") & mesh.skin
    moved = np.linalg.norm(standing.vertices - rest, axis=1)[own]
    assert 0.02 < np.median(moved) < 0.045
    assert moved.max() < 0.07

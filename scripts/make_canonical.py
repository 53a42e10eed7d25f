"""Compute what all canonical characters share: ``a2v/body/data/texture_corners_anny.npz`` and
``a2v/reconstruction/canonical/weights_anny.npz``.

    python scripts/make_canonical.py

Run it again after a change of `found_corners`, `found_weights`, the topology, or the version of
anny: tests compare the files with what these functions give.
"""

from __future__ import annotations

import numpy as np

from a2v.body import load_body_model, make_body
from a2v.body.face import CORNERS, found_corners
from a2v.io import digest_of_arrays, write_npz
from a2v.reconstruction.canonical.binding import WEIGHTS, binding_key, found_weights
from a2v.reconstruction.canonical.topology import topology


def main() -> None:
    """Write both files."""
    model = load_body_model("anny")
    places, corners = np.unique(
        found_corners(model.faces).reshape(-1, 2), axis=0, return_inverse=True
    )
    write_npz(
        CORNERS,
        {
            "key": digest_of_arrays(np.asarray(model.faces, np.int64)),
            "places": places,
            "corners": corners.reshape(-1, 3).astype(np.uint16),
        },
        compress=True,
    )
    mesh = topology()
    pose = np.zeros((len(model.bone_names), 3), np.float32)
    body = make_body(model, pose, model.shape_default)
    weights, bones = found_weights(mesh, body)
    write_npz(
        WEIGHTS,
        {"key": binding_key(mesh, body), "weights": weights, "bones": bones.astype(np.uint8)},
        compress=True,
    )


if __name__ == "__main__":
    main()

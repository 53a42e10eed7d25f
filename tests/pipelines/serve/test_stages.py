"""Each stage of a person that is computed leaves its shape for the stage of the page."""

from __future__ import annotations

import struct
from pathlib import Path

from a2v.samples import load_ready_person
from a2v.types import Reconstruction
from pipelines.engine.progress import NodeStats
from pipelines.engine.run import Outcome
from pipelines.engine.store import Store
from pipelines.serve.stages import STAGES, shapes

NODES = ("photo_body", "surface", "colored_surface")


def outcome(store: Store, cached: int) -> Outcome:
    """A run that has called each node once, `cached` of them answered from the store."""
    ready = load_ready_person()
    surface = Reconstruction(surface=ready.shaded_surface, backend="pifu")
    values = {name: store.put(value) for name, value in ready.outputs.items() if name in NODES}
    nodes = {name: NodeStats(calls=1, cached=cached) for name in NODES}
    return Outcome({**values, "surface": store.put(surface)}, nodes, 1.0, 0, store)


def test_a_computed_stage_writes_its_shape_and_a_remembered_one_does_not(tmp_path: Path) -> None:
    told: list[str] = []
    stages = shapes(tmp_path, told.append)
    assert tuple(stages) == NODES
    store = Store(tmp_path / "store")
    remembered, computed = outcome(store, cached=1), outcome(store, cached=0)
    for write in stages.values():
        write(remembered)
    assert told == []
    assert not [path for path in tmp_path.iterdir() if path.is_file()]
    for write in stages.values():
        write(computed)
    assert told == list(STAGES)
    for name in STAGES.values():
        data = (tmp_path / name).read_bytes()
        vertices, faces = struct.unpack("<II", data[:8])
        assert len(data) == 8 + 12 * vertices + 12 * faces + 3 * vertices
        assert len(data) > 100_000

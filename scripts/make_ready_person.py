"""Make ``a2v/samples/ready_person.npz``, the person that the pipeline makes of the sample photo.

    python scripts/make_ready_person.py

Run it again when `tests/samples/test_ready.py` says that the pipeline makes another person.
"""

from __future__ import annotations

import dataclasses
from typing import get_type_hints

from a2v.samples import ReadyPerson
from a2v.samples.ready import FILE, PHOTO
from pipelines.engine.store import Store
from pipelines.requests.video import photo_parameters
from pipelines.run import run


def made_now(store: Store) -> ReadyPerson:
    """Run the pipeline on the sample photo; results in the store are taken from there."""
    kinds = get_type_hints(ReadyPerson)
    names = [item.name for item in dataclasses.fields(ReadyPerson)]
    # the motion, the film and the views have no part in it
    outcome = run(names, store=store, executor="serial", **photo_parameters(store, PHOTO))
    return ReadyPerson(**{name: outcome.get(name, kinds[name]) for name in names})


if __name__ == "__main__":
    made_now(Store()).save(FILE)
    print(f"{FILE}: {FILE.stat().st_size / 1e6:.2f} MB")

"""Export a finished flow run to a shipped motion model: ``python scripts/export_flow.py RUN DATASET DATA OUT LICENCE``."""

from __future__ import annotations

import sys

from a2v.datasets import load_dataset
from a2v.motion.flow import load_flow
from export.flow import export_flow


def main(run: str, name: str, data: str, out: str, licence: str) -> None:
    dataset = load_dataset(name, data)
    model = load_flow(run, dataset)
    export_flow(model, dataset, out, licence=licence, extra={"training": vars(model.network.settings)})


if __name__ == "__main__":
    main(*sys.argv[1:])

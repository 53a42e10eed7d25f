"""Rounds of a fit: correspondences and minimization in turns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from a2v.body.lbfgs import GRADIENT
from a2v.body.objective import Objective, Stage
from a2v.body.settings import FitSettings
from a2v.body.unknowns import Unknowns

FAR = 2.0
"""Change of an unknown in a round, in units of the metric, after which the metric is computed
again."""


@dataclass
class Rounds:
    """Rounds of a fit: each updates the correspondences of silhouette or surface and lowers the
    objective, until a round moves nothing."""

    objective: Objective
    unknowns: Unknowns
    settings: FitSettings
    stage: Stage

    def run(self) -> Iterator[int]:
        """Yield the number of each finished round."""
        metric, change = None, np.inf
        for done in range(1, self.settings.rounds + 1):
            self.objective.renew(self.unknowns, self.stage)
            if change > FAR:
                metric = self.objective.metric(self.unknowns, stage=self.stage)
            # Correspondences that still change are not worth an exact minimum.
            change = self.objective.minimize(
                self.unknowns,
                self.settings.steps,
                stage=self.stage,
                metric=metric,
                gradient=max(GRADIENT, 0.03 * min(change, 10.0)),
            )
            yield done
            if change < self.settings.tolerance:
                break

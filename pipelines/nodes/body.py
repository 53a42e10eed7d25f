"""From the person to a parametric body and the photo's camera."""

from __future__ import annotations

from a2v.body import FitSettings
from a2v.types import Body, OrthographicCamera, Subject
from pipelines.memo import measure, memo, progress
from pipelines.store import Ref, get, put


@memo(uses=("body", "kinematics"))
def body(subject: Ref[Subject], fit: FitSettings) -> tuple[Ref[Body], Ref[OrthographicCamera]]:
    """Fit the body model's shape and pose to landmarks and silhouette."""
    from a2v.body import fit_body

    result = fit_body(get(subject, Subject), settings=fit, progress=progress())
    measure(result.residuals)
    return put(result.body), put(result.camera)

"""Losses of the body map, and its errors in metric units."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from a2v.kinematics.names import BLAZEPOSE
from a2v.lab.bodymap.examples import Example
from a2v.lab.bodymap.networks import MAPS, BodyMaps

_LIMB_LANDMARKS = [
    index
    for index, name in enumerate(BLAZEPOSE)
    if name.split("_")[-1] in ("elbow", "wrist", "knee", "ankle")
]
_FRONT, _LOG_FRONT, _LOG_PLACE, _INSIDE = (
    MAPS.index(name) for name in ("front", "log_front", "log_place", "inside")
)


def tensors(batch: Example, device: torch.device) -> dict[str, Tensor]:
    """Return the arrays of a batch by name, on a device; pictures are in channels-last memory
    format."""
    found = {name: torch.from_numpy(values).to(device) for name, values in vars(batch).items()}
    found["picture"] = found["picture"].contiguous(memory_format=torch.channels_last)
    return found


def losses(predicted: BodyMaps, true: dict[str, Tensor]) -> dict[str, Tensor]:
    """Return the weighted losses of a batch: mean absolute errors, and negative log likelihoods of
    Laplace distributions with the predicted scales.

    Parameters
    ----------
    predicted : BodyMaps
    true : mapping of str to Tensor
        A batch's `tensors`.
    """
    weights, error = true["weights"], (predicted.points - true["points"]).abs()
    plane, depth = error[..., :2].mean(dim=-1), error[..., 2]
    first = (predicted.first - true["points"]).abs().mean(dim=-1)
    seen, maps = true["seen"], predicted.maps
    count = seen[:, 0].sum().clamp(min=1)
    place = (maps[:, :_FRONT] - true["places"]).abs().mean(dim=1)
    depths = (maps[:, _FRONT:_LOG_FRONT] - true["depths"]).abs()

    def mean(values: Tensor, there: Tensor) -> Tensor:
        return (values * there).sum() / count

    likelihood = _laplace(plane, predicted.log_scales[..., 0]) + _laplace(
        depth, predicted.log_scales[..., 1]
    )
    of_maps = mean(_laplace(place, maps[:, _LOG_PLACE].clamp(-6, 1)), seen[:, 0])
    of_maps = of_maps + mean(_laplace(depths, maps[:, _LOG_FRONT:_LOG_PLACE].clamp(-7, 0)), seen)
    return {
        "plane": 10 * (plane * weights).mean(),
        "depth": 15 * (depth * weights).mean(),
        "first": 5 * (first * weights).mean(),
        "likelihood": 0.1 * (likelihood * weights).mean(),
        "place": 2 * mean(place, seen[:, 0]),
        "front": 8 * mean(depths[:, 0], seen[:, 0]),
        "back": 4 * mean(depths[:, 1], seen[:, 1]),
        "maps_likelihood": 0.05 * of_maps,
        "inside": 0.1
        * functional.binary_cross_entropy_with_logits(maps[:, _INSIDE], seen[:, 0].float()),
    }


def _laplace(error: Tensor, log_scale: Tensor) -> Tensor:
    """Negative log likelihood, up to a constant, of absolute errors."""
    return error * torch.exp(-log_scale) + log_scale


def errors(predicted: BodyMaps, true: dict[str, Tensor]) -> dict[str, Tensor]:
    """Return mean errors (B,) of each view, centimeters (places: in their own unit); NaN if nothing
    is visible.

    They are, for elbows, wrists, knees and ankles within the picture, the distance in the picture's
    plane and in depth; the depth of all landmarks; and the depth of the front.
    """
    centimeters = 100 / true["scale"]
    inside = true["weights"] > 0.25
    gap = torch.where(inside[..., None], predicted.points - true["points"], torch.nan)
    seen = true["seen"][:, 0]
    count = seen.sum(dim=(1, 2))
    front = ((predicted.maps[:, _FRONT] - true["depths"][:, 0]).abs() * seen).sum(
        dim=(1, 2)
    ) / count
    place = ((predicted.maps[:, :_FRONT] - true["places"]).abs().mean(dim=1) * seen).sum(
        dim=(1, 2)
    ) / count
    return {
        "limbs": gap[:, _LIMB_LANDMARKS, :2].norm(dim=-1).nanmean(dim=1) * centimeters,
        "limbs_depth": gap[:, _LIMB_LANDMARKS, 2].abs().nanmean(dim=1) * centimeters,
        "landmarks_depth": gap[..., 2].abs().nanmean(dim=1) * centimeters,
        "front_depth": front * centimeters,
        "places": place,
    }

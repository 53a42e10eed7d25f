"""Names of the shipped motion models and of actions."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence

from a2v.errors import InputError

BUNDLED: Mapping[str, str] = {
    "cmu": "motion_cmu.onnx",
    "cmu-fine": "motion_cmu_fine.onnx",
    "humanact12": "motion_humanact12.onnx",
    "humanact12-fine": "motion_humanact12_fine.onnx",
    "cmu-glmi-m": "motion_cmu_glmi_m.onnx",
    "cmu-glmi-r": "motion_cmu_glmi_r.onnx",
    "cmu-lie": "motion_cmu_lie.onnx",
    "cmu-plain": "motion_cmu_plain.onnx",
    "humanact12-fine-glmi-m": "motion_humanact12_fine_glmi_m.onnx",
    "humanact12-fine-glmi-r": "motion_humanact12_fine_glmi_r.onnx",
    "humanact12-fine-lie": "motion_humanact12_fine_lie.onnx",
    "humanact12-fine-plain": "motion_humanact12_fine_plain.onnx",
    "humanact12-glmi-m": "motion_humanact12_glmi_m.onnx",
    "humanact12-glmi-r": "motion_humanact12_glmi_r.onnx",
    "humanact12-lie": "motion_humanact12_lie.onnx",
    "humanact12-plain": "motion_humanact12_plain.onnx",
}
"""Shipped motion models by name."""


def find_action(action: str, actions: Sequence[str], model: str) -> int:
    """Return the index of an action among `actions`; case, spaces, hyphens and underscores don't
    matter.

    Raises
    ------
    InputError
        Unknown action; the message names `model` and the nearest actions.
    """
    plain = {plain_name(name): index for index, name in enumerate(actions)}
    wanted = plain_name(action)
    if wanted in plain:
        return plain[wanted]
    near = difflib.get_close_matches(wanted, plain, n=3, cutoff=0.5)
    hint = (
        f"did you mean {' or '.join(actions[plain[name]] for name in near)}?"
        if near
        else f"it knows {', '.join(actions)}"
    )
    raise InputError(f"unknown action '{action}' for model '{model}'; {hint}")


def plain_name(name: str) -> str:
    """Return an action's name without case, spaces, hyphens and underscores, for comparisons."""
    return "".join(character for character in name.lower() if character.isalnum())

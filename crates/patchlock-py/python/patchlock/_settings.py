"""The settings of the tracker, by name and type."""

from __future__ import annotations

from typing import Literal, TypedDict

from patchlock import _patchlock
from patchlock._types import Parameter


class Settings(TypedDict, total=False):
    """Keywords of `Tracker` and `track` that override a preset; `parameters()` describes each."""

    method: Literal["patchwise"]
    seed: int
    particles: int
    sigma_x: float
    sigma_y: float
    sigma_scale: float
    sigma_rotation: float
    sigma_aspect: float
    sigma_skew: float

    template_side: int
    large_patch: int
    large_step: int
    small_patch: int
    small_step: int
    subtract_mean: bool
    atoms: int
    buffer: int
    min_residual: float
    epsilon: float
    beta: float
    position_weights: bool
    occlusion_weights: bool
    gamma: Literal["exp_visible", "one", "visible", "exp_error"]
    scales: Literal["both", "large", "small"]
    templates: int

    update_interval: int
    small_update_interval: int
    delta: float
    large_buffer_guard: float
    small_buffer_guard: float
    replacement_growth: float
    forgetting: float
    subspace_keep: float
    subspace_vectors: int
    lambda_: float
    guided_radius: int
    guided_epsilon: float


def parameters() -> list[Parameter]:
    """The table of all settings, one row per setting, in the order of the paper's sections."""
    return [Parameter(*row) for row in _patchlock.parameters()]

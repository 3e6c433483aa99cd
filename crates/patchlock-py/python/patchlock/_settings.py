"""The settings of the tracker, by name and type."""

from __future__ import annotations

from typing import Literal, TypedDict

from patchlock import _patchlock
from patchlock._types import Parameter


class Settings(TypedDict, total=False):
    """Keywords of `Tracker` and `track` that override a preset; `parameters()` describes each."""

    method: Literal["patchwise", "robust"]
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

    search: float
    label_width: float
    temporal: float
    penalty: float
    max_patch: float
    min_patch: float
    filters: int
    wide_mask: float
    wide_temporal: float
    wide_penalty: float
    slow_temporal: float
    slow_penalty: float
    scale_count: int
    scale_step: float
    scale_label_width: float
    scale_rate: float
    scale_area: float
    rotate: bool
    rotation_below: float
    rotation_least: float
    rotation_margin: float
    rotation_rate: float
    colour_weight: float
    colour_contrast: float
    colour_rate: float
    around_rate: float
    memory_rate: float
    sure: float
    first_frames: int
    jump_ratio: float
    jump_least: float
    lost_below: float
    lost_drop: float
    lost_hidden: float
    lost_after: int
    covered_share: float
    covered_visible: float
    covered_elsewhere: float
    covered_contrast: float
    covered_below: float
    covered_after: int
    found_above: float
    trial: int
    search_windows: int
    scale_least: float
    visible_step: int
    score_bias: float
    score_visible: float
    score_elsewhere: float


def parameters() -> list[Parameter]:
    """The table of all settings, one row per setting, those of all methods first, then method by method."""
    return [Parameter(*row) for row in _patchlock.parameters()]

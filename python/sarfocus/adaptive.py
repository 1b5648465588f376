"""The steps of scene-adaptive phase gradient autofocus, one by one; `sarfocus.adaptive_pga` runs them one after the other."""

from ._core.adaptive import (
    cell_dtype,
    cfar_gate,
    choose_gates,
    gate_energies,
    gates_to_denoise,
    mean_filter,
    sub_apertures,
)

__all__ = [
    "cell_dtype",
    "cfar_gate",
    "choose_gates",
    "gate_energies",
    "gates_to_denoise",
    "mean_filter",
    "sub_apertures",
]

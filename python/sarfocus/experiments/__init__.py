"""The experiments behind ``sarfocus reproduce NAME``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from . import (
    bwsi,
    crlb,
    do_no_harm,
    gotcha,
    luo2025,
    luo2025_studies,
    luo2025_time,
    strip_clutter,
    xie2023,
    xie2023_time,
    zhou2022_table2,
    zhou2022_table3,
)
from .model import Reproduction, Requirement

Experiment = Callable[..., Reproduction]
EXPERIMENTS: dict[str, Experiment] = {
    "bwsi-trajectory": bwsi.run,
    "crlb": crlb.run,
    "do-no-harm": do_no_harm.run,
    "gotcha": gotcha.run,
    "xie2023-table3": xie2023.run,
    "xie2023-random": xie2023.run_random,
    "xie2023-time": xie2023_time.run,
    "strip-clutter": strip_clutter.run,
    "luo2025-table7": luo2025.run,
    "luo2025-table8": luo2025_time.run,
    "luo2025-studies": luo2025_studies.run,
    "zhou2022-table2": zhou2022_table2.run,
    "zhou2022-table3": zhou2022_table3.run,
}
# Take a folder of measured data; the last two run without, too.
MEASURED = frozenset({"bwsi-trajectory", "gotcha", "luo2025-table7", "zhou2022-table3"})
PICTURES: dict[str, Callable[[Reproduction, Path], list[Path]]] = {
    "bwsi-trajectory": bwsi.draw,
    "crlb": crlb.draw,
    "xie2023-table3": xie2023.draw,
    "strip-clutter": strip_clutter.draw,
    "luo2025-table7": luo2025.draw,
    "luo2025-table8": luo2025_time.draw,
    "luo2025-studies": luo2025_studies.draw,
    "zhou2022-table2": zhou2022_table2.draw,
    "zhou2022-table3": zhou2022_table3.draw,
}


def run(name: str, **options: Any) -> Reproduction:
    """Run an experiment.

    Raises
    ------
    ValueError
        There is none of that name (the message says which there are), or it measures no data of the caller's.
    """
    if name not in EXPERIMENTS:
        raise ValueError(f"reproduce: no experiment {name!r}, expected one of: {', '.join(sorted(EXPERIMENTS))}")
    if "data" in options and name not in MEASURED:
        raise ValueError(f"data: {name} simulates its own, expected none")
    return EXPERIMENTS[name](**options)


__all__ = ["EXPERIMENTS", "PICTURES", "Reproduction", "Requirement", "run"]

"""``simulate``, ``reproduce`` and ``bench``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .. import benchmark, experiments
from ..built_in import SCENES
from ..io import PhaseHistory, write
from ..io.dispatch import writable
from .files import describe_history, describe_image
from .output import Json, Output, Threads, progress_bar, show, show_rows

Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Of the random numbers; printed with the result.")]


def simulate(
    scene: Annotated[str, typer.Argument(help=f"Which scene: {', '.join(SCENES)}.")],
    *,
    output: Output,
    seed: Seed = None,
    error_rms: Annotated[
        float | None, typer.Option("--motion-error", min=0.0, help="RMS of the unrecorded motion, m; 0 for none; by default the scene's.")
    ] = None,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Write a built-in scene with a motion error that nobody recorded: a phase history (spotlight) or an image (strip)."""
    target = writable(output)
    if scene not in SCENES:
        raise typer.BadParameter(f"no scene {scene!r}, expected one of: {', '.join(SCENES)}")
    with progress_bar() as progress:
        chosen = {"seed": seed, "motion_rms": error_rms}
        options: dict[str, Any] = {"threads": threads, "progress": progress} | {k: v for k, v in chosen.items() if v is not None}
        made = SCENES[scene](**options).item
    write(target, made)
    described = describe_history(made) if isinstance(made, PhaseHistory) else describe_image(made)
    show({"output": str(target), "scene": scene} | described, as_json=as_json)


def reproduce(
    name: Annotated[str, typer.Argument(help=f"Which experiment: {', '.join(experiments.EXPERIMENTS)}.")],
    *,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="A folder for pictures.")] = None,
    data: Annotated[Path | None, typer.Option(help="The folder of measured data, for the experiments that need it.")] = None,
    seed: Seed = None,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Run an experiment and say whether its requirements hold; exit status 1 where one does not."""
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
    with progress_bar() as progress:
        options: dict[str, Any] = {"threads": threads, "progress": progress} | ({} if seed is None else {"seed": seed})
        if data is not None:
            options["data"] = data
        result = experiments.run(name, **options)
    payload = result.model_dump()
    if output is not None and name in experiments.PICTURES:
        experiments.PICTURES[name](result, output)
    show({"name": result.name} | result.parameters if not as_json else payload, as_json=as_json)
    if not as_json:
        show_rows(result.rows)
        show_rows([item.model_dump() for item in result.required], "required")
    if not result.holds:
        raise typer.Exit(1)


def bench(threads: Threads = 0, as_json: Json = False) -> None:
    """Time the kernels on small problems, each with its error beside its speed."""
    with progress_bar() as progress:
        rows = benchmark.run(threads=threads, progress=progress)
    show({"rows": rows}, as_json=as_json)
    if not as_json:
        show_rows(rows)

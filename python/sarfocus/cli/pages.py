"""``demo`` and ``report``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..io import Image, read
from .output import Json, Threads, progress_bar, show
from .scenes import Seed


def demo(
    output: Annotated[Path, typer.Option("-o", "--output", help="A folder for the report and the result.")] = Path("demo"),
    scene: Annotated[str, typer.Option("--scene", help="strip or spotlight.")] = "strip",
    seed: Seed = None,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Simulate a scene with an unrecorded motion, focus it, and write a report."""
    from .. import demo as program  # noqa: PLC0415  matplotlib only where a page is drawn

    if scene not in program.DEMOS:
        raise typer.BadParameter(f"no scene {scene!r}, expected one of: {', '.join(program.DEMOS)}")
    output.mkdir(parents=True, exist_ok=True)
    with progress_bar() as progress:
        figures = program.run(output, scene=scene, seed=seed, threads=threads, progress=progress)
    show(figures, as_json=as_json)


def report(
    result: Annotated[Path, typer.Argument(help="An image as autofocus wrote it (.h5, .npz).", metavar="RESULT")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The page.")] = Path("report.html"),
    as_json: Json = False,
) -> None:
    """Write a self-contained page about a result."""
    from ..report.build import build  # noqa: PLC0415  matplotlib only where a page is drawn
    from ..report.page import write_page  # noqa: PLC0415

    item = read(result)
    if not isinstance(item, Image):
        raise ValueError(f"{result}: expected a result of autofocus, got a phase history")
    if output.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"{output}: expected a name that ends in .html")
    source = item.metadata.get("source")
    page = build(
        item,
        title=f"Autofocus of {result.name}",
        lead=f"Image of {item.data.shape[0]} x {item.data.shape[1]} pixels, source: {source or 'not stated'}.",
    )
    write_page(output, page)
    show({"report": str(output), "verdict": page.verdict, "figures": [item.model_dump() for item in page.headline]}, as_json=as_json)

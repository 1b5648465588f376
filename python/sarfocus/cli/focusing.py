"""``autofocus`` and ``measure``."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import measurement, method_names
from ..focusing import focus_history, focus_image
from ..grids import default_grid
from ..io import Image, PhaseHistory, read, write
from ..io.dispatch import writable
from . import forecast
from .files import read_history
from .output import Centre, Json, Output, Size, Spacing, Threads, numbers, progress_bar, show, show_rows


class Method(str, Enum):
    """The methods of ``autofocus``."""

    auto = "auto"
    pga = "pga"
    pga_2d = "pga_2d"
    adaptive_pga = "adaptive_pga"
    conventional_pga = "conventional_pga"
    minimum_entropy = "minimum_entropy"
    maximum_contrast = "maximum_contrast"
    gpga = "gpga"
    spga_linear = "spga_linear"
    spga = "spga"


Pixel = Annotated[Any, typer.Option("--at", parser=numbers(2, "azimuth,range in pixels"), metavar="AZ,RG", help="Pixel to measure at.")]


def autofocus(
    inputs: Annotated[list[Path], typer.Argument(help="An image, or a phase history (gpga).", metavar="INPUT...")],
    *,
    output: Output,
    method: Annotated[
        Method,
        typer.Option(help="auto: for an image, the method that does best on strong points it has not seen; gpga for a phase history."),
    ] = Method.auto,
    centre: Centre = None,
    size: Size = None,
    spacing: Spacing = None,
    time_offset: Annotated[
        bool,
        typer.Option("--time-offset/--no-time-offset", help="Estimate the offset between the clocks of radar and track, if there are two."),
    ] = True,
    keep_before: Annotated[bool, typer.Option("--before/--no-before", help="Keep the image before autofocus in the result.")] = True,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Estimate the phase error and write the image without it."""
    target = writable(output)
    item = read(inputs[0] if len(inputs) == 1 else inputs)
    method = suitable(method, item, inputs[0])
    grid = None if isinstance(item, Image) else default_grid(read_history(inputs), centre=centre, size=size, spacing=spacing)
    forecast.announce(item, grid, method.value, threads)
    with progress_bar() as progress:
        if isinstance(item, Image):
            focused = focus_image(item, method.value, threads=threads, progress=progress)
        else:
            assert grid is not None
            focused = focus_history(item, grid, time_offset=time_offset, threads=threads, progress=progress)
    if not keep_before:
        focused.image.arrays.pop("before", None)
    write(target, focused.image)
    found = focused.image.metadata["autofocus"]
    shown = found if as_json else {name: value for name, value in found.items() if name != "diagnostics"}
    show({"output": str(target)} | shown, as_json=as_json)


def suitable(method: Method, item: PhaseHistory | Image, source: Path) -> Method:
    """Return the method to use; one that can't work on the item is refused."""
    if isinstance(item, PhaseHistory):
        if method not in (Method.auto, Method.gpga):
            raise ValueError(f"{source}: {method.value} works on an image, got a phase history; use --method gpga, or form the image first")
        return Method.gpga
    if method is Method.gpga:
        raise ValueError(f"{source}: gpga works on a phase history, got an image; use --method pga")
    possible = method_names(strip=item.geometry is not None)
    if method is not Method.auto and method.value not in possible:
        if item.geometry is None:
            raise ValueError(
                f"{source}: {method.value} needs the stripmap geometry, and this image has none; use --method {' or '.join(possible)}"
            )
        raise ValueError(f"{source}: {method.value} is for spotlight images, and this is a strip; use --method {' or '.join(possible)}")
    return method


def measure(
    file: Annotated[Path, typer.Argument(help="An image.", metavar="IMAGE")],
    at: Pixel = None,
    count: Annotated[int, typer.Option("--count", min=1, help="How many strong points to look for.")] = 5,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Measure entropy and contrast of an image, and the responses of its strong points."""
    item = read(file)
    if not isinstance(item, Image):
        raise ValueError(f"{file}: expected an image, got a phase history; form the image first")
    whole = measurement.whole_image(item.data, threads)
    places = [at] if at is not None else measurement.strong_points(item.data, count)
    points = [measurement.response_figures(measurement.response(item, place)) for place in places]
    show({"file": str(file), "shape": list(item.data.shape)} | whole | {"points": points}, as_json=as_json)
    if not as_json:
        short = [{name.replace("azimuth", "az").replace("range", "rg"): value for name, value in point.items()} for point in points]
        show_rows(short, "points (widths in pixels)")

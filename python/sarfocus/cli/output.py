"""What the sub-commands share: results on stdout, progress on stderr, options."""

from __future__ import annotations

import functools
import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, ParamSpec, TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table

from .. import __version__
from ..plain import plain

P = ParamSpec("P")
T = TypeVar("T")
PIPE_WIDTH = 140  # characters of a line where stdout is no terminal
LOG_INTERVAL = 30.0  # s between lines of progress where stderr is none
ProgressCallback = Callable[[str, int, int], None]


class Interrupted(Exception):
    """Ctrl-C, as an exception that the option parser doesn't handle in its own way."""


def interruptible(function: Callable[P, T]) -> Callable[P, T]:
    """Turn KeyboardInterrupt into Interrupted."""

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            return function(*args, **kwargs)
        except KeyboardInterrupt as error:
            raise Interrupted from error

    return wrapped


def print_json(payload: Mapping[str, Any]) -> None:
    """One JSON object on stdout."""
    sys.stdout.write(json.dumps(plain(payload), allow_nan=False, ensure_ascii=False) + "\n")


def show(payload: Mapping[str, Any], *, as_json: bool, title: str = "") -> None:
    """Print the payload: as JSON, or its single values as a table of names and values."""
    if as_json:
        print_json(payload)
        return
    table = Table(title=title or None, show_header=False, box=None, title_justify="left", title_style="bold", pad_edge=False)
    table.add_column(style="dim")
    table.add_column(overflow="fold")
    for name, value in payload.items():
        if not (isinstance(value, Sequence) and value and isinstance(value[0], Mapping)):
            table.add_row(name.replace("_", " "), text(value))
    console().print(table)


def console() -> Console:
    """Return a console for stdout; without a terminal, lines are long rather than cut."""
    made = Console()
    return made if made.is_terminal else Console(width=PIPE_WIDTH)


def show_rows(rows: Sequence[Mapping[str, Any]], title: str = "") -> None:
    """Print rows of equal keys as a table."""
    if not rows:
        return
    table = Table(title=title or None, box=None, title_justify="left", title_style="bold", pad_edge=False)
    for name in rows[0]:
        table.add_column(name.replace("_", " "), overflow="fold", justify="left" if isinstance(rows[0][name], str) else "right")
    for row in rows:
        table.add_row(*(text(value) for value in row.values()))
    console().print(table)


def text(value: object) -> str:
    """Return a value for a reader: four significant digits for floats."""
    value = plain(value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.6g}"
    if isinstance(value, dict):
        return ", ".join(f"{name} {text(item)}" for name, item in value.items())
    if isinstance(value, list):
        return ", ".join(text(item) for item in value)
    return "–" if value is None else str(value)


@contextmanager
def progress_bar() -> Iterator[ProgressCallback]:
    """Yield a progress callback that draws on stderr; where that is no terminal, it writes a line from time to time."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield progress_lines()
        return
    tasks: dict[str, TaskID] = {}
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:

        def update(phase: str, done: int, total: int) -> None:
            if phase not in tasks:
                tasks[phase] = progress.add_task(phase, total=total)
            progress.update(tasks[phase], completed=done, total=total)

        yield update


def progress_lines() -> ProgressCallback:
    """Return a progress callback for logs."""
    last = time.monotonic()

    def update(phase: str, done: int, total: int) -> None:
        nonlocal last
        if time.monotonic() - last >= LOG_INTERVAL:
            last = time.monotonic()
            sys.stderr.write(f"{phase}: {done} of {total}\n")
            sys.stderr.flush()

    return update


def numbers(count: int, unit: str) -> Callable[[str], tuple[float, ...]]:
    """Return a parser of `count` numbers separated by commas; a single one stands for two equal ones where two are wanted."""

    def parse(value: str) -> tuple[float, ...]:
        try:
            parts = tuple(float(part) for part in value.split(","))
        except ValueError as error:
            raise typer.BadParameter(f"expected {count} numbers separated by commas ({unit}), got {value!r}") from error
        if count == 2 and len(parts) == 1:
            parts *= 2
        if len(parts) != count:
            raise typer.BadParameter(f"expected {count} numbers separated by commas ({unit}), got {value!r}")
        return parts

    return parse


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Threads = Annotated[int, typer.Option("--threads", min=0, help="0: all processors. The result does not depend on it.")]
Output = Annotated[Path, typer.Option("-o", "--output", help="Where the result goes: .h5, .hdf5, .npz or .npy.")]
Centre = Annotated[Any, typer.Option("--centre", parser=numbers(3, "x,y,z in m"), metavar="X,Y,Z", help="Scene centre, m.")]
Size = Annotated[Any, typer.Option("--size", parser=numbers(2, "azimuth,range in m"), metavar="AZ,RG", help="Size of the image, m.")]
Spacing = Annotated[Any, typer.Option("--spacing", parser=numbers(2, "azimuth,range in m"), metavar="AZ,RG", help="Pixel spacing, m.")]


def print_version(wanted: bool) -> None:
    """Print the version and leave, if it is wanted."""
    if wanted:
        sys.stdout.write(f"sarfocus {__version__}\n")
        raise typer.Exit

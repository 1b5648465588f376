"""The table of sub-commands."""

from __future__ import annotations

from typing import Annotated

import typer

from .. import __version__
from .files import form, info
from .focusing import autofocus, measure
from .output import interruptible, print_version
from .pages import demo, report
from .scenes import bench, reproduce, simulate

app = typer.Typer(
    name="sarfocus",
    help="Brings defocused synthetic aperture radar data into focus.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=print_version, is_eager=True, help=f"Print {__version__} and leave.")
    ] = False,
) -> None:
    """Brings defocused synthetic aperture radar data into focus."""


for command in (demo, info, form, autofocus, measure, simulate, reproduce, report, bench):
    app.command(command.__name__)(interruptible(command))

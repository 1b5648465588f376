"""From arguments to exit status: every error becomes one line on stderr."""

from __future__ import annotations

import os
import sys
import traceback

import typer

from .. import Cancelled
from ..io.errors import one_line
from .app import app
from .output import Interrupted, print_json

BAD_INPUT = 2
INTERRUPTED = 130


def usage_errors() -> tuple[type[Exception], type[Exception]]:
    """UsageError and Exit as typer raises them: newer versions carry their own copy of click."""
    return typer.BadParameter.__mro__[1], typer.Exit


def run(argv: list[str]) -> int:
    """Parse, run, and map what is raised to an exit status."""
    command = typer.main.get_command(app)
    try:
        status = command.main(args=argv, prog_name="sarfocus", standalone_mode=False)
        sys.stdout.flush()
        return status if isinstance(status, int) else 0
    except BrokenPipeError:  # whoever read stdout has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        return report(argv, error)


def report(argv: list[str], error: Exception) -> int:
    """Say what went wrong and return the exit status."""
    usage_error, leave = usage_errors()
    if isinstance(error, leave):
        return int(getattr(error, "exit_code", 0))
    if isinstance(error, Interrupted | Cancelled):
        return fail(argv, INTERRUPTED, "interrupted")
    if isinstance(error, usage_error):
        return fail(argv, BAD_INPUT, error.format_message())  # type: ignore[attr-defined]
    if isinstance(error, MemoryError):
        return fail(argv, BAD_INPUT, f"not enough memory: {one_line(error)}")
    if isinstance(error, ValueError | OSError):
        return fail(argv, BAD_INPUT, one_line(error))
    traceback.print_exception(error)  # a defect: the traceback belongs in the report of it
    return fail(argv, 1, f"failure inside: {type(error).__name__}: {one_line(error)}")


def fail(argv: list[str], status: int, message: str) -> int:
    """Write the one line, and with --json the one object."""
    line = " ".join(message.split())
    sys.stderr.write(f"sarfocus: {line}\n")
    if "--json" in argv:
        print_json({"error": line, "exit_status": status})
    return status

"""The error of this sub-package."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class FormatError(ValueError):
    """A file that is missing, damaged, of an unknown kind, or whose content does not fit together. The message is one line."""


def one_line(error: BaseException) -> str:
    """Return the text of an exception on one line."""
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn whatever goes wrong inside into a FormatError that names the file."""
    try:
        yield
    except FormatError as error:
        text = str(error)
        raise FormatError(text if text.startswith(str(path)) else f"{path}: {text}") from error
    except FileNotFoundError as error:
        raise FormatError(f"{path}: no such file") from error
    except MemoryError:
        raise
    except ValueError as error:
        raise FormatError(f"{path}: {one_line(error)}") from error
    except Exception as error:  # a damaged file makes the libraries beneath raise almost anything
        raise FormatError(f"{path}: damaged or cut short: {one_line(error)}") from error

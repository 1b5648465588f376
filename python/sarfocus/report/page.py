"""Rendering of the page."""

from __future__ import annotations

import platform
from importlib import metadata
from pathlib import Path

import jinja2

from .. import __version__
from ..io.atomic import replacing
from .model import Report

VERSIONED = ("numpy", "scipy", "h5py", "matplotlib")


def versions() -> dict[str, str]:
    """Versions of the package, of Python and of the libraries that took part."""
    found = {"sarfocus": __version__, "Python": platform.python_version()}
    return found | {name: metadata.version(name) for name in VERSIONED} | {"system": f"{platform.system()} {platform.machine()}"}


def render(report: Report) -> str:
    """Return the page as HTML; it needs no other file."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("sarfocus.report", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.j2").render(report=report)


def write_page(path: Path, report: Report) -> None:
    """Write the page, replacing an existing one only when the new one is complete."""
    html = render(report)
    with replacing(path) as temporary:
        temporary.write_text(html, encoding="utf-8")

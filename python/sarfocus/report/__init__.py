"""A result as one self-contained HTML page, and its figures."""

from .model import Comparison, Report, Section, Table
from .page import render, write_page

__all__ = ["Comparison", "Report", "Section", "Table", "render", "write_page"]

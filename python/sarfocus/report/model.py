"""What a report page holds."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Strict(BaseModel):
    """A model that refuses fields it doesn't know."""

    model_config = ConfigDict(extra="forbid")


class Table(Strict):
    """Cells as text; the first column is left-aligned, the others are numbers, unless `words` says that the last one is text."""

    caption: str
    head: list[str]
    rows: list[list[str]]
    words: bool = False


class Section(Strict):
    """A heading, paragraphs, then a picture (PNG data URI) with its caption or a table."""

    title: str
    text: list[str] = []
    picture: str | None = None
    description: str = ""
    caption: str = ""
    table: Table | None = None


class Comparison(Strict):
    """One headline figure, before and after."""

    name: str
    before: str
    after: str
    note: str = ""


class Report(Strict):
    """The whole page."""

    title: str
    lead: str
    verdict: str
    headline: list[Comparison] = []
    sections: list[Section] = []
    parameters: dict[str, str] = {}
    timings: dict[str, str] = {}
    versions: dict[str, str] = {}

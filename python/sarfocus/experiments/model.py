"""What an experiment returns: the format of ``sarfocus reproduce NAME --json``."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Requirement(BaseModel):
    """One bound and whether the run keeps it."""

    model_config = ConfigDict(extra="forbid")
    what: str
    bound: float
    value: float
    holds: bool


class Reproduction(BaseModel):
    """An experiment that has been run."""

    model_config = ConfigDict(extra="forbid")
    name: str
    parameters: dict[str, Any]
    rows: list[dict[str, Any]]
    required: list[Requirement]
    pictures: dict[str, Any] = Field(default_factory=dict, exclude=True, repr=False)  # arrays to draw, not part of the result

    @property
    def holds(self) -> bool:
        """Whether every requirement is met."""
        return all(item.holds for item in self.required)


def at_most(what: str, value: float, bound: float) -> Requirement:
    """Return the requirement that `value` doesn't exceed `bound`."""
    return Requirement(what=what, bound=bound, value=value, holds=bool(value <= bound))


def at_least(what: str, value: float, bound: float) -> Requirement:
    """Return the requirement that `value` doesn't fall below `bound`."""
    return Requirement(what=what, bound=bound, value=value, holds=bool(value >= bound))

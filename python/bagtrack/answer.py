"""The answer to a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Sequence, Tuple, Union

import numpy.typing as npt

Box = Tuple[float, float, float, float]
BoxLike = Union[Sequence[float], npt.NDArray[Any]]
"""Four numbers."""
Status = Literal["tracking", "uncertain", "lost"]


@dataclass(frozen=True)
class Answer:
    """Where the target is in a frame."""

    frame: int
    """The frame's number; the first is 0."""
    box: Box
    """x, y, width and height in pixels."""
    score: float
    """The chance, from 0 to 1, that the box overlaps the target by half or more."""
    status: Status
    """What the score and its history mean."""

    @property
    def ok(self) -> bool:
        """Whether the target is not lost."""
        return self.status != "lost"

    @classmethod
    def parse(cls, document: dict[str, Any]) -> Answer:
        """Reads an answer of the service."""
        return cls(document["frame"], parse_box(document["box"]), document["score"], document["status"])


@dataclass(frozen=True)
class TargetAnswer(Answer):
    """Where one of several targets is in a frame."""

    target: int
    """Which target, counted from 0 in the order of the boxes."""


def parse_box(document: dict[str, float]) -> Box:
    """Reads a box of the service."""
    return (
        float(document["x"]),
        float(document["y"]),
        float(document["width"]),
        float(document["height"]),
    )

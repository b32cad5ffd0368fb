"""The tracker for the VOT toolkit, over TraX. In `trackers.ini`:

    [bagtrack]
    label = bagtrack
    protocol = trax
    command = bagtrack-trax --seed 0

Several objects are followed at once, each by a tracker of its own.
"""

from __future__ import annotations

import argparse
from typing import Any, Optional, Sequence
from urllib.parse import unquote, urlparse

import bagtrack
from bagtrack.adapters.extras import needs

with needs("vot"):
    import trax

    from bagtrack.adapters import pictures


class Targets:
    """The objects of a sequence."""

    def __init__(self, preset: str, seed: Optional[int]) -> None:
        self._preset = preset
        self._seed = seed
        self._trackers: list[bagtrack.Tracker] = []

    def forget(self) -> None:
        """Before a new sequence."""
        self._trackers = []

    def answer(self, image: Any, new: Any) -> list[tuple[Any, dict[str, float]]]:
        """Where the objects are, those first that came first."""
        frame = pictures.read(path(image))
        for tracker in self._trackers:
            tracker.update(frame)
        for region, _ in new or []:
            tracker = bagtrack.Tracker(self._preset, self._seed)
            tracker.init(frame, region.bounds())
            self._trackers.append(tracker)
        return [(trax.Rectangle.create(*tracker.box), {"confidence": tracker.score}) for tracker in self._trackers]


def path(image: Any) -> str:
    """The file of an image."""
    location = str(image.path())
    return unquote(urlparse(location).path) if location.startswith("file:") else location


def serve(preset: str, seed: Optional[int]) -> None:
    """Answers the toolkit on the standard streams, until it ends."""
    targets = Targets(preset, seed)
    with trax.Server(
        [trax.Region.RECTANGLE],
        [trax.Image.PATH],
        tracker_name="bagtrack",
        tracker_description="Bags of affine subspaces",
        multiobject=True,
    ) as server:
        while True:
            request = server.wait()
            if request.type == trax.TraxStatus.QUIT:
                return
            if request.type == trax.TraxStatus.INITIALIZE:
                targets.forget()
            server.status(targets.answer(request.image["color"], request.objects))


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """The program `bagtrack-trax`."""
    parser = argparse.ArgumentParser(prog="bagtrack-trax", description="The tracker for the VOT toolkit, over TraX.")
    parser.add_argument("--preset", default="robust", choices=["robust", "paper"])
    parser.add_argument("--seed", type=int, help="the same seed gives the same boxes; drawn without it")
    options = parser.parse_args(arguments)
    serve(options.preset, options.seed)


if __name__ == "__main__":
    main()

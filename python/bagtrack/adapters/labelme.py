"""Propagates the rectangles of a labelme file over the images after it. The program `bagtrack-labelme`.

    bagtrack-labelme images/0120.json --frames 500

In labelme, draw rectangles in one image and save. Each goes on through the images of the folder, in the order of their
names, into the labelme file of each: with the label, the group and the flags of the first, and a `score`, which labelme
keeps. Other shapes of these files stay. An image in which the target is lost gets no shape. A rectangle ends before the
next image that has one of the same label and group, which somebody has drawn. Nothing is changed before all images are
tracked, and nothing at all with --dry-run.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from bagtrack._native import Tracker
from bagtrack.adapters.extras import needs
from bagtrack.answer import Box

with needs("labelme"):
    from PIL import Image, ImageOps

    from bagtrack.adapters import pictures

Document = dict[str, Any]

_IMAGES = {".jpg", ".jpeg", ".png", ".webp", ".bmp", ".tif", ".tiff"}


def propagate(
    file: Path, *, count: Optional[int] = None, backwards: bool = False, tracker: Optional[Tracker] = None
) -> dict[Path, Document]:
    """The files that get shapes when the rectangles of this labelme file go on, at most `count` images far.

    `tracker` has the parameters. `ValueError` where the file has no rectangle, or an image cannot be used.
    """
    tracker = tracker or Tracker()
    begun = _read(file)
    drawn = [shape for shape in begun["shapes"] if _is_rectangle(shape)]
    if not drawn:
        raise ValueError(f"{file} has no rectangle")
    image = file.parent / begun["imagePath"].replace("\\", "/")
    followed = {place: tracker.of_target(place) for place in range(len(drawn))}
    first = _pixels(image)
    for place, one in followed.items():
        one.init(first, pictures.box_of_corners([*drawn[place]["points"][0], *drawn[place]["points"][1]]))
    changed: dict[Path, Document] = {}
    for path in _after(image, backwards, count):
        other = file.parent / f"{path.stem}.json"
        document = _read(other) if other.is_file() else None
        there = {_name(shape) for shape in document["shapes"] if _is_rectangle(shape)} if document else set()
        followed = {place: one for place, one in followed.items() if _name(drawn[place]) not in there}
        if not followed:
            break
        frame = _pixels(path)
        shapes = [shape for place, one in followed.items() for shape in _next(drawn[place], one, frame)]
        if shapes:
            document = document or _empty(begun, path, file.parent, frame)
            changed[other] = {**document, "shapes": document["shapes"] + shapes}
    return changed


def _next(drawn: Document, one: Tracker, frame: npt.NDArray[np.uint8]) -> Iterator[Document]:
    """The rectangle in the next image, as far as it is in it; none where the target is lost."""
    ok, box = one.update(frame)
    corners = _inside(box, frame)
    if ok and corners:
        points = [[round(value, 2) for value in corner] for corner in corners]
        yield {**drawn, "points": points, "score": round(one.score, 4)}


def _inside(box: Box, frame: npt.NDArray[np.uint8]) -> Optional[list[list[float]]]:
    x, y, width, height = box
    left, top = max(x, 0.0), max(y, 0.0)
    right, bottom = min(x + width, float(frame.shape[1])), min(y + height, float(frame.shape[0]))
    return [[left, top], [right, bottom]] if left < right and top < bottom else None


def _after(image: Path, backwards: bool, count: Optional[int]) -> list[Path]:
    """The images after this one in its folder, in the order in which they are tracked."""
    files = sorted((path for path in image.parent.iterdir() if path.suffix.lower() in _IMAGES), key=_order)
    if image.name not in [path.name for path in files]:
        raise ValueError(f"there is no image {image}")
    at = [path.name for path in files].index(image.name)
    return (files[:at][::-1] if backwards else files[at + 1 :])[:count]


def _order(path: Path) -> list[tuple[int, str]]:
    """By numbers where names have some, as labelme lists them."""
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", path.name.lower())]


def _pixels(path: Path) -> npt.NDArray[np.uint8]:
    """An image upright, as labelme shows it."""
    with Image.open(path) as image:
        return np.ascontiguousarray(pictures.array(ImageOps.exif_transpose(image)))


def _read(file: Path) -> Document:
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{file} cannot be read as JSON: {error}") from error
    if not isinstance(document, dict) or "imagePath" not in document or "shapes" not in document:
        raise ValueError(f"{file} is no file of labelme")
    return document


def _write(file: Path, document: Document) -> None:
    """Puts the document in the place of the file at once: where the disk is full, what somebody has drawn stays."""
    target = file.resolve()
    new = target.with_name(f"{target.name}.tmp")
    try:
        new.write_text(json.dumps(document, ensure_ascii=False, indent=2), encoding="utf-8")
        if target.exists():
            shutil.copymode(target, new)
        os.replace(new, target)
    except OSError as error:
        with suppress(OSError):
            new.unlink()
        reason = error.strerror or error
        raise OSError(f"{file} cannot be written, and is as it was: {reason}") from error


def _empty(begun: Document, image: Path, folder: Path, frame: npt.NDArray[np.uint8]) -> Document:
    """A file for an image that has none."""
    path = Path(os.path.relpath(image, folder)).as_posix()
    size = {"imageHeight": frame.shape[0], "imageWidth": frame.shape[1]}
    return {"version": begun.get("version"), "flags": {}, "shapes": [], "imagePath": path, "imageData": None, **size}


def _is_rectangle(shape: Document) -> bool:
    return shape.get("shape_type") == "rectangle" and len(shape["points"]) == 2


def _name(shape: Document) -> tuple[Any, Any]:
    return shape["label"], shape.get("group_id")


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """The program `bagtrack-labelme`."""
    description = "Propagates the rectangles of a labelme file over the images after it."
    parser = argparse.ArgumentParser(prog="bagtrack-labelme", description=description)
    parser.add_argument("file", type=Path, metavar="FILE.json", help="the labelme file that has the rectangles")
    parser.add_argument("--frames", type=int, metavar="N", help="go at most so many images far (default: to the last)")
    parser.add_argument("--backwards", action="store_true", help="go to the images before it")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dry-run", action="store_true", help="change nothing")
    options = parser.parse_args(arguments)
    try:
        tracker = Tracker(seed=options.seed)
        changed = propagate(options.file, count=options.frames, backwards=options.backwards, tracker=tracker)
        if not options.dry_run:
            for file, document in changed.items():
                _write(file, document)
    except (OSError, ValueError) as error:
        sys.exit(f"bagtrack-labelme: {error}")
    names = [file.name for file in changed]
    print(f"{len(changed)} files with new shapes" + (f", {names[0]} to {names[-1]}" if names else ""))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Makes clips in the layout of the OTB benchmark from annotated sequences that lie in folders, and checks them.

    pip install opencv-contrib-python-headless
    tools/footage.py clips data_seq/car14 VOT2018/bag LaSOT/car/car-1
    tools/footage.py clips/part UAV123/data_seq/group1 --annotation UAV123/anno/group1_3.txt --first 840
    bagtrack-eval clips/* --seeds 4

A SEQUENCE is the folder of a sequence or of its frames. Its frames are in `img/` (OTB, LaSOT), in `color/` (VOT), in
`img1/` or in the folder itself (UAV123, UAVDT, VOT). Its annotation is `groundtruth_rect.txt`, `groundtruth.txt` or a
file of the sequence's name in a folder `anno/` beside it or above it (UAV123); `--annotation` names another file.

A line of an annotation is a box `x,y,width,height`, or a polygon (VOT) that becomes the box around it. Boxes of VOT
count from pixel 0 with `--from-zero`. A line with `NaN`, or with a side of 0, is a frame without annotation.

Each clip gets a contact sheet, `sheet.jpg`: look whether the boxes fit before you measure anything. Footage of
benchmarks is for research: never commit a frame of it.
"""

import argparse
import math
import pathlib
import re
import sys

try:
    import cv2
    import numpy
except ImportError:
    sys.exit("footage: OpenCV is missing; pip install opencv-contrib-python-headless")

IMAGES = {".jpg", ".jpeg", ".png", ".bmp"}
FRAME_FOLDERS = ["img", "color", "img1", "."]
ANNOTATIONS = ["groundtruth_rect.txt", "groundtruth.txt"]
SHEET_FRAMES = 12
SHEET_COLUMNS = 4
SHEET_WIDTH = 400


def number_of(path):
    """The number in a frame's name: the last one, since some names begin with that of the camera."""
    numbers = re.findall(r"\d+", path.stem)
    return int(numbers[-1]) if numbers else -1


def frames_of(folder):
    """The frames of a sequence in their order."""
    for name in FRAME_FOLDERS:
        inside = folder / name
        if inside.is_dir():
            frames = [path for path in inside.iterdir() if path.suffix.lower() in IMAGES and number_of(path) >= 0]
            if frames:
                return sorted(frames, key=number_of)
    sys.exit(f"footage: no frames in {folder}")


def annotation_of(folder):
    """The annotation of a sequence: beside its frames, or in a folder `anno` beside it or above it."""
    for name in ANNOTATIONS:
        if (folder / name).is_file():
            return folder / name
    for above in list(folder.resolve().parents)[:3]:
        found = sorted((above / "anno").rglob(f"{folder.name}.txt"))
        if found:
            return found[0]
    sys.exit(f"footage: no annotation of {folder}; name it with --annotation")


def box_of(line, from_zero):
    """The box that a line says, counted from pixel 1. None where the frame is not annotated."""
    numbers = [float(number) for number in re.split(r"[,;\s]+", line.strip()) if number]
    if len(numbers) not in (4, 8):
        raise ValueError(f"a box has 4 numbers and a polygon 8, not {len(numbers)}")
    if not all(map(math.isfinite, numbers)):
        return None
    if len(numbers) == 8:
        across, down = numbers[0::2], numbers[1::2]
        numbers = [min(across), min(down), max(across) - min(across), max(down) - min(down)]
    x, y, width, height = numbers
    if width <= 0 or height <= 0:
        return None
    return (x + from_zero, y + from_zero, width, height)


def boxes_of(file, from_zero):
    """The boxes that an annotation says, one a line."""
    boxes = []
    for number, line in enumerate(file.read_text().splitlines(), 1):
        if line.strip():
            try:
                boxes.append(box_of(line, from_zero))
            except ValueError as error:
                sys.exit(f"footage: {file}:{number}: {error}")
    return boxes


def doubts(boxes, frames, shapes):
    """What speaks against a clip."""
    if len(boxes) != len(frames):
        yield f"{len(frames)} frames, {len(boxes)} lines"
    if len(set(shapes)) > 1:
        yield "frames of several sizes"
    height, width = shapes[0]
    outside = 0
    for box in filter(None, boxes):
        x, y, w, h = box
        outside += x + w / 2 < 0 or y + h / 2 < 0 or x + w / 2 > width + 1 or y + h / 2 > height + 1
    if outside:
        yield f"{outside} boxes whose centre is outside of the frame"
    centres = [(box[0] + box[2] / 2, box[1] + box[3] / 2) if box else None for box in boxes]
    for number, (a, b) in enumerate(zip(centres, centres[1:]), 2):
        if a and b and math.dist(a, b) > 0.25 * math.hypot(width, height):
            yield f"the box jumps at frame {number}"


def sheet(pictures, boxes):
    """Some frames with their boxes, in rows."""
    chosen = numpy.linspace(0, len(pictures) - 1, SHEET_FRAMES).round().astype(int)
    tiles = []
    for at in chosen:
        picture, box = cv2.imread(str(pictures[at])), boxes[at]
        if box:
            x, y, w, h = (round(value) for value in box)
            corners, thickness = ((x - 1, y - 1), (x - 1 + w, y - 1 + h)), max(1, picture.shape[1] // 300)
            cv2.rectangle(picture, *corners, (0, 255, 255), thickness)
        size = (SHEET_WIDTH, round(picture.shape[0] * SHEET_WIDTH / picture.shape[1]))
        tile = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        cv2.putText(tile, str(at + 1), (4, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 255, 255), 1)
        tiles.append(tile)
    rows = [numpy.hstack(tiles[row : row + SHEET_COLUMNS]) for row in range(0, len(tiles), SHEET_COLUMNS)]
    return numpy.vstack(rows)


def save(clip, frames, boxes):
    """Writes a clip that begins with its first box."""
    if not any(boxes):
        sys.exit(f"footage: {clip.name} has no annotated frame")
    first = next(at for at, box in enumerate(boxes) if box)
    (clip / "img").mkdir(parents=True)
    lines, shapes, written = [], [], []
    for number, (frame, box) in enumerate(zip(frames[first:], boxes[first:]), 1):
        to = clip / "img" / f"{number:04}.jpg"
        picture = cv2.imread(str(frame))
        if picture is None:
            sys.exit(f"footage: {frame} cannot be read")
        if frame.suffix.lower() in {".jpg", ".jpeg"}:
            to.write_bytes(frame.read_bytes())
        else:
            cv2.imwrite(str(to), picture, [cv2.IMWRITE_JPEG_QUALITY, 95])
        shapes.append(picture.shape[:2])
        written.append(to)
        lines.append(",".join(f"{value:g}" for value in box) if box else "0,0,0,0")
    (clip / "groundtruth_rect.txt").write_text("\n".join(lines) + "\n")
    cv2.imwrite(str(clip / "sheet.jpg"), sheet(written, boxes[first:]))
    return shapes, first


def convert(folder, out, arguments):
    """Makes one clip, and prints what it is and what speaks against it."""
    boxes = boxes_of(arguments.annotation or annotation_of(folder), arguments.from_zero)
    frames = [frame for frame in frames_of(folder) if number_of(frame) >= arguments.first]
    name = arguments.name or folder.resolve().name
    clip = out / name
    if clip.exists():
        sys.exit(f"footage: {clip} is there already")
    said = (boxes, frames)
    if arguments.frames:
        boxes, frames = boxes[: arguments.frames], frames[: arguments.frames]
    shapes, first = save(clip, frames, boxes)
    height, width = shapes[0]
    print(f"{clip}: {len(shapes)} frames of {width} x {height}, {sum(map(bool, boxes))} annotated, {first} passed over")
    for doubt in doubts(*said, shapes):
        print(f"  {doubt}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT", type=pathlib.Path, help="the clips' folder; it is made")
    parser.add_argument("sequences", metavar="SEQUENCE", type=pathlib.Path, nargs="+")
    parser.add_argument("--annotation", type=pathlib.Path, metavar="FILE", help="of the one sequence given")
    parser.add_argument("--name", help="of the one clip made, in place of its folder's")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="number of the first annotated frame")
    parser.add_argument("--frames", type=int, metavar="N", help="at most so many frames")
    parser.add_argument("--from-zero", action="store_true", help="boxes count from pixel 0, not 1")
    arguments = parser.parse_args()
    if (arguments.annotation or arguments.name) and len(arguments.sequences) > 1:
        parser.error("--annotation and --name are for one sequence")
    for folder in arguments.sequences:
        convert(folder, arguments.out, arguments)


if __name__ == "__main__":
    main()

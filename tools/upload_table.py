#!/usr/bin/env python3
"""What to upload: overlap on the same clips, sent in other sizes, JPEG qualities and rates. Prints a markdown table.

    pip install opencv-contrib-python-headless
    cargo build --release
    tools/upload_table.py path/to/wild/*

Every argument is a folder in the OTB layout. Each clip is written again with a longer side of so many pixels (never
larger than it is), in JPEG of a quality, with one of so many frames; its boxes are scaled along. `bagtrack-eval` runs on
the copies. A column stands for clips whose first box has such a side, the root of its area, in the clip's own pixels.
"""

import argparse
import pathlib
import statistics
import sys
import tempfile

try:
    import cv2
except ImportError:
    sys.exit("upload_table: OpenCV is missing; pip install opencv-contrib-python-headless")

import compare_opencv

# Longer side, JPEG quality, and one of how many frames is sent.
UPLOADS = [(1280, 90, 1), (1280, 50, 1), (1280, 20, 1), (640, 90, 1), (640, 50, 1), (640, 90, 2), (640, 90, 3)]
SMALL = 64.0


def rewrite(folder, upload, out):
    """Writes the clip of `folder` to `out`; gives the mean bytes of a frame."""
    side, quality, every = upload
    (out / "img").mkdir(parents=True)
    paths = sorted((p for p in (folder / "img").iterdir() if p.suffix.lower() in compare_opencv.FRAME_ENDINGS), key=compare_opencv.natural)
    sizes, scale = [], (1.0, 1.0)
    for index, path in enumerate(paths[::every]):
        frame = cv2.imread(str(path))
        height, width = frame.shape[:2]
        factor = min(1.0, side / max(width, height))
        size = (round(width * factor), round(height * factor))
        if size != (width, height):
            frame = cv2.resize(frame, size, interpolation=cv2.INTER_AREA)
        scale = (size[0] / width, size[1] / height)
        file = out / "img" / f"{index + 1:05}.jpg"
        cv2.imwrite(str(file), frame, [cv2.IMWRITE_JPEG_QUALITY, quality])
        sizes.append(file.stat().st_size)
    lines = []
    for box in compare_opencv.read_boxes(folder / compare_opencv.BOXES)[::every]:
        x, y, w, h = box or (-1, -1, 0, 0)
        # OTB counts from pixel 1.
        lines.append(f"{x * scale[0] + 1:.3f},{y * scale[1] + 1:.3f},{w * scale[0]:.3f},{h * scale[1]:.3f}")
    (out / compare_opencv.BOXES).write_text("\n".join(lines) + "\n")
    return statistics.fmean(sizes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    compare_opencv.add_common(parser)
    parser.add_argument("--seeds", default=3, type=compare_opencv.positive, help="default: %(default)s")
    args = parser.parse_args()
    clips = compare_opencv.folders(args.sequences, parser)
    first = [compare_opencv.read_boxes(clip / compare_opencv.BOXES)[0] for clip in clips]
    small = [(box[2] * box[3]) ** 0.5 < SMALL for box in first]
    print(f"| longer side | JPEG quality | of so many frames one | KiB a frame | target under {SMALL:.0f} px | larger target |")
    print("|---:|---:|---:|---:|---:|---:|")
    for upload in UPLOADS:
        with tempfile.TemporaryDirectory() as parent:
            copies = [pathlib.Path(parent) / clip.resolve().name for clip in clips]
            sizes = [rewrite(clip, upload, copy) for clip, copy in zip(clips, copies)]
            found = compare_opencv.run_bagtrack(args.bagtrack, "robust", args.seeds, copies)["sequences"]
        overlaps = [sequence["overlap"] for sequence in found]
        means = [statistics.fmean(o for o, s in zip(overlaps, small) if s == which) for which in (True, False)]
        kib = statistics.fmean(sizes) / 1024
        side, quality, every = upload
        print(f"| {side} | {quality} | {every} | {kib:.0f} | {means[0]:.2f} | {means[1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()

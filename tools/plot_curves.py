#!/usr/bin/env python3
"""Draws the precision plot and the success plot of OTB from the boxes of trackers: precision.svg and success.svg.

    bagtrack-eval path/to/sequences/* --seeds 10 --results results/robust
    tools/plot_curves.py path/to/sequences/* --results results/robust results/another --out docs/figures

Needs Python 3 alone. Every argument is a folder in the OTB layout, of which groundtruth_rect.txt is read. A folder of
results is a tracker, called as the folder is: NAME.txt for each sequence, a box a line, as `bagtrack-eval --results`
and the toolkits of OTB and pysot write them, or folders seed-0, seed-1 ... of such files.

The measures are those of `bagtrack-eval`: the first frame, whose box is given, and frames without an annotation are not
scored; shares are means over the seeds of a sequence, then over the sequences, each with the same weight.
"""

import argparse
import math
import pathlib
import re
import statistics
import sys
import xml.sax.saxutils

PRECISION_RADIUS = 20
RADII = range(51)
# The steps of the success plot: the area under it is the mean over these.
THRESHOLDS = [step / 20 for step in range(21)]
# Colours that people with the common colour blindnesses can tell apart (Okabe and Ito).
COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#464646"]
# The edges of the plane between the axes, and the width of the figure.
LEFT, TOP, RIGHT, BOTTOM, WIDTH = 72, 42, 611, 393, 640


def read_boxes(path):
    """The boxes of a file, None where a frame is not annotated."""
    boxes = []
    for line in path.read_text().rstrip().splitlines():
        x, y, width, height = (float(field) for field in re.split(r"[,\s]+", line.strip()))
        known = all(map(math.isfinite, (x, y, width, height))) and width > 0 and height > 0
        boxes.append((x, y, width, height) if known else None)
    return boxes


def center_error(a, b):
    return math.hypot(a[0] + a[2] / 2 - b[0] - b[2] / 2, a[1] + a[3] / 2 - b[1] - b[3] / 2)


def overlap(a, b):
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    shared = max(0.0, width) * max(0.0, height)
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)


def runs(results):
    """The folders of a tracker's runs, one for each seed."""
    return sorted(results.glob("seed-*")) or [results]


def score(sequences, results):
    """A tracker's centre errors and overlaps: for each sequence, for each seed, those of its scored frames."""
    errors, overlaps = [], []
    for name, truth in sequences.items():
        scored = []
        for folder in runs(results):
            found = read_boxes(folder / f"{name}.txt")
            if len(found) != len(truth):
                sys.exit(f"plot_curves: {folder / name}.txt: {len(found)} boxes of {len(truth)} frames")
            scored.append([pair for pair in zip(found[1:], truth[1:]) if pair[1]])
        # A tracker may have no box where it has lost the target.
        errors.append([[center_error(a, b) if a else math.inf for a, b in run] for run in scored])
        overlaps.append([[overlap(a, b) if a else 0.0 for a, b in run] for run in scored])
    return errors, overlaps


def share(sequences, holds):
    """The share of frames of which `holds` is true."""
    return statistics.fmean(statistics.fmean(statistics.fmean(map(holds, run)) for run in runs) for runs in sequences)


def text(x, y, size, words, rest=""):
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}"{rest}>{xml.sax.saxutils.escape(words)}</text>'


def line(x1, y1, x2, y2, color, width=1):
    return f'<path d="M{x1:g} {y1:g}L{x2:g} {y2:g}" stroke="{color}" stroke-width="{width}"/>'


def figure(title, x_label, marks, curves, legend):
    """The figure of curves with values from 0 to 1, over the numbers of `marks` along the other axis."""
    def place(x, y):
        return LEFT + (RIGHT - LEFT) * x / marks[-1], BOTTOM - (BOTTOM - TOP) * y
    height = BOTTOM + 73 + 22 * len(curves)
    drawn = [f'<rect width="{WIDTH}" height="{height}" fill="white"/>', text(14, 26, 16, title)]
    for mark in marks:
        x, y = place(mark, mark / marks[-1])
        drawn += [line(x, BOTTOM + 5, x, TOP, "#e1e1e1"), line(LEFT - 5, y, RIGHT, y, "#e1e1e1")]
        drawn.append(text(x, BOTTOM + 21, 13, f"{mark:g}", ' text-anchor="middle"'))
        drawn.append(text(LEFT - 10, y + 4, 13, f"{mark / marks[-1]:.1f}", ' text-anchor="end"'))
    drawn += [line(LEFT, TOP, LEFT, BOTTOM, "#282828"), line(LEFT, BOTTOM, RIGHT, BOTTOM, "#282828")]
    drawn.append(text((LEFT + RIGHT) / 2, BOTTOM + 46, 13, x_label, ' text-anchor="middle"'))
    middle = (TOP + BOTTOM) / 2
    drawn.append(text(24, middle, 13, "share of frames", f' text-anchor="middle" transform="rotate(-90 24 {middle:g})"'))
    # The first tracker is drawn last, on top.
    for index, (points, words) in reversed(list(enumerate(zip(curves, legend)))):
        color, y = COLORS[index % len(COLORS)], BOTTOM + 70 + 22 * index
        path = " ".join("{:.1f},{:.1f}".format(*place(*point)) for point in points)
        drawn.append(f'<polyline points="{path}" stroke="{color}" stroke-width="2"/>')
        drawn += [line(LEFT, y, LEFT + 26, y, color, 3), text(LEFT + 36, y + 5, 14, words)]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}"'
    # Text inherits its colour, lines are not filled.
    style = "<style>text { fill: #282828; font-family: sans-serif } polyline { fill: none }</style>"
    return "\n".join([f"{head}>", style, *drawn, "</svg>", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", nargs="+", type=pathlib.Path, metavar="DIR", help="sequences; files among them are passed over")
    parser.add_argument("--results", nargs="+", required=True, type=pathlib.Path, metavar="DIR", help="a folder for each tracker")
    parser.add_argument("--out", required=True, type=pathlib.Path, metavar="DIR", help="where the figures go")
    args = parser.parse_args()
    folders = [path.resolve() for path in args.sequences if not path.is_file()]
    sequences = {folder.name: read_boxes(folder / "groundtruth_rect.txt") for folder in folders}
    scored = [score(sequences, results) for results in args.results]
    names = [results.resolve().name for results in args.results]
    seeds = max(len(runs(results)) for results in args.results)
    of = f"{len(sequences)} sequence{'s' * (len(sequences) > 1)}, {seeds} seed{'s' * (seeds > 1)}"

    precision = [[(radius, share(errors, lambda error: error <= radius)) for radius in RADII] for errors, _ in scored]
    legend = [f"{name} ({points[PRECISION_RADIUS][1]:.3f} at {PRECISION_RADIUS} px)" for name, points in zip(names, precision)]
    drawn = figure(f"Precision: {of}", "centre error of at most, in pixels", range(0, 51, 5), precision, legend)
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / "precision.svg").write_text(drawn)

    success = [[(least, share(overlaps, lambda value: value > least)) for least in THRESHOLDS] for _, overlaps in scored]
    areas = [statistics.fmean(value for _, value in points) for points in success]
    legend = [f"{name} ({area:.3f} area under the curve)" for name, area in zip(names, areas)]
    drawn = figure(f"Success: {of}", "overlap of more than", [mark / 10 for mark in range(11)], success, legend)
    (args.out / "success.svg").write_text(drawn)


if __name__ == "__main__":
    main()

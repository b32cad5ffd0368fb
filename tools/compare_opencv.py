#!/usr/bin/env python3
"""Sets bagtrack beside OpenCV's trackers on the same annotated frames, and prints a markdown report.

    pip install opencv-contrib-python-headless
    cargo build --release
    tools/compare_opencv.py path/to/sequences/*

Every argument is a folder in the OTB layout: img/ with the frames, groundtruth_rect.txt with x,y,width,height a line.
The rules are those of `bagtrack-eval`, so that the rows can be compared:

- boxes are 1-based in the file and 0-based here; a line without a size (0,0,0,0) or with NaN is not annotated;
- the first box is given, and its frame is not scored; unannotated frames are tracked and not scored;
- while a tracker says that it has lost the target, its last box is held, and scored;
- figures are means over the annotated frames of a video, then over the videos, each with the same weight; bagtrack's
  are means over its seeds first;
- the standard error is that of the videos' mean centre errors: sample standard deviation by the root of their number;
- time is that of the update alone, decoding excluded, on one thread.

OpenCV's trackers get the frames in colour, as its own examples do, and the box rounded to whole pixels, as their
interface wants it. `static` is the given box, which never moves. Boosting, MIL and TLD draw random numbers: OpenCV's generator
gets the same seed before each video.
"""

import argparse
import json
import math
import pathlib
import re
import statistics
import subprocess
import sys
import time

from plot_curves import center_error, overlap

try:
    import cv2
except ImportError:
    sys.exit("compare_opencv: OpenCV is missing; pip install opencv-contrib-python-headless")

FRAME_ENDINGS = {".jpg", ".jpeg", ".png", ".webp"}
BOXES = "groundtruth_rect.txt"
PRECISION_RADIUS = 20.0
SEED = 0
ALL = ["CSRT", "MIL", "KCF", "TLD", "MOSSE", "MedianFlow", "Boosting", "static"]


class Static:
    """The box that never moves."""

    def init(self, _frame, box):
        self.box = box

    def update(self, _frame):
        return True, self.box


def new_tracker(name, nano=None):
    """A tracker of OpenCV by its short name, from wherever this version keeps it; `nano` is that of the model files."""
    if name == "static":
        return Static()
    if name == "Nano":
        parameters = cv2.TrackerNano_Params()
        parameters.backbone, parameters.neckhead = map(str, nano)
        try:
            return cv2.TrackerNano_create(parameters)
        except cv2.error as error:
            sys.exit(f"compare_opencv: --nano: OpenCV cannot read the two model files: {error}")
    for module in (cv2, getattr(cv2, "legacy", None)):
        create = getattr(module, f"Tracker{name}_create", None)
        if create is not None:
            return create()
    sys.exit(f"compare_opencv: OpenCV {cv2.__version__} has no tracker {name}: is it the contrib package?")


def natural(path):
    """Sorts frame2 before frame10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", path.name)]


def read_boxes(path):
    """The 0-based boxes of a sequence, None where a frame is not annotated."""
    boxes = []
    for line in path.read_text().rstrip().splitlines():
        x, y, width, height = (float(field) for field in re.split(r"[,\s]+", line.strip()))
        annotated = all(map(math.isfinite, (x, y, width, height))) and width > 0 and height > 0
        boxes.append((x - 1, y - 1, width, height) if annotated else None)
    return boxes


def load(folder):
    """Frames and boxes of a sequence."""
    pictures = folder / "img" if (folder / "img").is_dir() else folder
    paths = sorted((p for p in pictures.iterdir() if p.suffix.lower() in FRAME_ENDINGS), key=natural)
    boxes = read_boxes(folder / BOXES)
    if len(paths) != len(boxes):
        sys.exit(f"compare_opencv: {folder}: {len(paths)} frames, but {len(boxes)} lines in {BOXES}")
    if not boxes or boxes[0] is None or not any(boxes[1:]):
        sys.exit(f"compare_opencv: {folder}: the first frame and at least one more must be annotated")
    frames = [cv2.imread(str(path)) for path in paths]
    for path, frame in zip(paths, frames):
        if frame is None:
            sys.exit(f"compare_opencv: {path} cannot be decoded")
    return frames, boxes


def updates(name, frames, boxes, nano=None):
    """One tracker through one sequence: for each frame after the first the seconds of its update, whether it says that it
    has the target, and its box, which is held while it has not."""
    cv2.setRNGSeed(SEED)
    tracker = new_tracker(name, nano)
    held = boxes[0] if name == "static" else tuple(round(value) for value in boxes[0])
    tracker.init(frames[0], held)
    for frame in frames[1:]:
        start = time.perf_counter()
        try:
            found, box = tracker.update(frame)
        except cv2.error:
            # KCF and others raise when their window leaves the frame.
            found = False
        seconds = time.perf_counter() - start
        if found:
            held = box
        yield seconds, found, held


def track(name, frames, boxes, nano=None):
    """One tracker through one sequence: its figures under the names that `bagtrack-eval` gives them."""
    errors, overlaps, spent = [], [], 0.0
    for truth, (seconds, _, held) in zip(boxes[1:], updates(name, frames, boxes, nano)):
        spent += seconds
        if truth is not None:
            errors.append(center_error(held, truth))
            overlaps.append(overlap(held, truth))
    return {
        "center_error": statistics.fmean(errors),
        "precision_20": statistics.fmean(error <= PRECISION_RADIUS for error in errors),
        "overlap": statistics.fmean(overlaps),
        "step_ms": spent * 1000 / (len(frames) - 1),
    }


def run_bagtrack(binary, preset, seeds, folders):
    """bagtrack's figures by sequence, in the order of the folders."""
    command = [str(binary), *map(str, folders), "--preset", preset]
    command += ["--seeds", str(seeds), "--jobs", "1", "--format", "json"]
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    except FileNotFoundError:
        sys.exit(f"compare_opencv: {binary} is not there; cargo build --release, or name it with --bagtrack")
    except subprocess.CalledProcessError as error:
        sys.exit(f"compare_opencv: bagtrack-eval ended with {error.returncode}")
    return json.loads(done.stdout)


def standard_error(values):
    return statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else None


def markdown(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|---|" + "---:|" * (len(header) - 1)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def report(names, results):
    """The two tables: means over the sequences, and every sequence. `results` is label -> figures by sequence."""
    means, by_sequence = [], []
    for label, figures in results.items():
        mean = {key: statistics.fmean(f[key] for f in figures) for key in ("center_error", "precision_20", "overlap", "step_ms")}
        error = standard_error([f["center_error"] for f in figures])
        means.append([
            label,
            f"{mean['center_error']:.1f}",
            "-" if error is None else f"{error:.1f}",
            f"{mean['precision_20']:.3f}",
            f"{mean['overlap']:.3f}",
            f"{mean['step_ms']:.2f}",
        ])
        by_sequence.append([label] + [f"{f['center_error']:.1f} / {f['overlap']:.2f}" for f in figures])
    header = ["tracker", "centre error, px", "standard error", "precision at 20 px", "overlap", "ms a frame"]
    return "\n".join([
        markdown(header, means),
        "",
        "Centre error in pixels / overlap:",
        "",
        markdown(["tracker", *names], by_sequence),
    ])


def positive(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("it must be 1 or more")
    return value


def add_common(parser):
    """The arguments that every comparison with bagtrack has."""
    root = pathlib.Path(__file__).resolve().parent.parent
    parser.add_argument("sequences", nargs="+", type=pathlib.Path, metavar="DIR", help="sequences; files among them are passed over")
    parser.add_argument("--bagtrack", default=root / "target/release/bagtrack-eval", type=pathlib.Path, metavar="BINARY", help="default: %(default)s")


def folders(paths, parser):
    """The sequences among the paths; the program ends where there is none, or one without boxes."""
    found = [path for path in paths if not path.is_file()]
    if not found:
        parser.error("none of the paths is a folder")
    for path in found:
        if not (path / BOXES).is_file():
            parser.error(f"{path} has no {BOXES}")
    return found


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_common(parser)
    parser.add_argument("--trackers", default=",".join(ALL), help="which of OpenCV's, by commas (default: %(default)s); may be empty")
    parser.add_argument(
        "--nano", nargs=2, type=pathlib.Path, metavar=("BACKBONE", "HEAD"),
        help="also OpenCV's TrackerNano with these two ONNX files, nanotrack_backbone_sim.onnx and nanotrack_head_sim.onnx",
    )
    parser.add_argument("--presets", default="robust", help="bagtrack's presets, by commas (default: %(default)s)")
    parser.add_argument("--seeds", default=10, type=positive, help="bagtrack's seeds (default: %(default)s)")
    args = parser.parse_args()
    known = {name.lower(): name for name in ALL}
    wanted = [name.strip() for name in args.trackers.split(",") if name.strip()]
    for name in wanted:
        if name.lower() not in known:
            parser.error(f"there is no tracker {name}; there are {', '.join(ALL)}")
    args.trackers = [known[name.lower()] for name in wanted]
    for file in args.nano or []:
        if not file.is_file():
            parser.error(f"--nano: {file} is not a file")
    if args.nano:
        args.trackers.append("Nano")
    args.presets = [name.strip() for name in args.presets.split(",") if name.strip()]
    args.sequences = folders(args.sequences, parser)
    return args


def main():
    args = arguments()
    cv2.setNumThreads(1)
    names = [path.resolve().name for path in args.sequences]
    results = {}
    for preset in args.presets:
        print(f"bagtrack {preset} ...", file=sys.stderr)
        evaluated = run_bagtrack(args.bagtrack, preset, args.seeds, args.sequences)
        found = evaluated["sequences"]
        assert [sequence["name"] for sequence in found] == names, "bagtrack names the same folders in the same order"
        results[f"bagtrack {preset}"] = found
    for name in args.trackers:
        results[name] = []
    # One sequence in memory at a time.
    for folder in args.sequences:
        if args.trackers:
            frames, boxes = load(folder)
        for name in args.trackers:
            print(f"{name} on {folder.name} ...", file=sys.stderr)
            results[name].append(track(name, frames, boxes, args.nano))
    seeds = f"{args.seeds} seed{'s' if args.seeds > 1 else ''}"
    print(f"{len(names)} sequences; bagtrack: mean over {seeds}; OpenCV {cv2.__version__}; one thread each.\n")
    print(report(names, results))


if __name__ == "__main__":
    main()

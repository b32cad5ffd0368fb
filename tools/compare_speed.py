#!/usr/bin/env python3
"""Times bagtrack's presets and OpenCV's trackers on the same frames, in turns on one core, and prints how many times as long they take.

    pip install opencv-contrib-python-headless
    cargo build --release
    tools/compare_speed.py path/to/sequences/*

Sequences and the rules of a run are those of compare_opencv.py: time is that of the update alone (`Tracker::step` for bagtrack,
wall time), decoding excluded, one thread each, the mean over the frames of a video, then over the videos, each with the same weight.

The program and all that it starts are pinned to one core (--cpu). On each video the trackers take turns, and both presets run
again before each of OpenCV's, so that other work on the machine hits all alike; of the runs of one tracker on one
video the median counts. --rounds repeats all of it.

KCF and MOSSE do less, or next to nothing, on frames on which they say that they have lost the target. So their times are given a
second time over the frames alone on which they say that they have it, with the share of such frames. That they have it is what
they say: compare_opencv.py tells how often it is so.
"""

import argparse
import os
import statistics
import sys

import compare_opencv
from compare_opencv import cv2

PRESETS = ["robust", "paper"]
PEERS = ["MIL", "CSRT", "KCF", "MOSSE"]
# Those whose answer is cheap when they have lost the target.
IDLE_WHEN_LOST = ["KCF", "MOSSE"]
RATIOS = [("MIL", "robust"), ("CSRT", "robust"), ("KCF", "robust"), ("MIL", "paper"), ("CSRT", "paper"), ("MOSSE", "paper")]


def held(name):
    return f"{name}, has the target"


def peer_ms(name, frames, boxes):
    """Milliseconds an update, the same where it says that it has the target (None without such a frame), and their share."""
    done = list(compare_opencv.updates(name, frames, boxes))
    found = [seconds for seconds, found, _ in done if found]
    return (
        statistics.fmean(seconds for seconds, _, _ in done) * 1e3,
        statistics.fmean(found) * 1e3 if found else None,
        len(found) / len(done),
    )


def measure(folder, args):
    """Milliseconds a frame on one sequence by tracker, and the shares of frames on which a tracker says that it has the target."""
    frames, boxes = compare_opencv.load(folder)
    times, shares = {}, {}
    for _ in range(args.rounds):
        for name in PEERS:
            print(f"{folder.name}: {', '.join(PRESETS)}, {name} ...", file=sys.stderr)
            for preset in PRESETS:
                report = compare_opencv.run_bagtrack(args.bagtrack, preset, 1, [folder])
                times.setdefault(preset, []).append(report["sequences"][0]["step_ms"])
            every, while_held, share = peer_ms(name, frames, boxes)
            times.setdefault(name, []).append(every)
            if name in IDLE_WHEN_LOST:
                times.setdefault(held(name), []).append(while_held)
                shares[name] = share
    median = {name: None if None in values else statistics.median(values) for name, values in times.items()}
    return median, shares


def with_mean(values):
    """The values of the videos and their mean; that of those that are there."""
    there = [value for value in values if value is not None]
    return [*values, statistics.fmean(there) if there else None]


def cells(values, digits):
    return ["-" if value is None else f"{value:.{digits}f}" for value in values]


def report(names, measured):
    """The tables: milliseconds, shares, and ratios by video and of the means. `measured` has what `measure` gives for each sequence."""
    times = {name: with_mean([times[name] for times, _ in measured]) for name in measured[0][0]}
    header = ["ms a frame", *names, "mean"]
    rows = []
    for name in [*PRESETS, *PEERS]:
        rows.append([f"bagtrack {name}" if name in PRESETS else name, *cells(times[name], 3)])
        if name in IDLE_WHEN_LOST:
            rows.append([held(name), *cells(times[held(name)], 3)])
            shares = with_mean([shares[name] for _, shares in measured])
            rows.append([f"{name}, share of such frames", *cells(shares, 2)])
    ratios = []
    for theirs, ours in RATIOS:
        for label in [theirs, held(theirs)] if theirs in IDLE_WHEN_LOST else [theirs]:
            pairs = zip(times[label], times[ours])
            ratios.append([f"{label} / {ours}", *cells([a and a / b for a, b in pairs], 1)])
    lines = [compare_opencv.markdown(header, rows), "", "How many times as long (mean: of the means above):", ""]
    return "\n".join([*lines, compare_opencv.markdown(["times", *names, "mean"], ratios)])


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    compare_opencv.add_common(parser)
    parser.add_argument("--rounds", default=1, type=compare_opencv.positive, help="how often all run on each sequence (default: %(default)s)")
    available = sorted(os.sched_getaffinity(0))
    parser.add_argument("--cpu", default=available[-1], type=int, choices=available, help="the core to run on (default: %(default)s)")
    args = parser.parse_args()
    args.sequences = compare_opencv.folders(args.sequences, parser)
    return args


def main():
    args = arguments()
    os.sched_setaffinity(0, {args.cpu})
    cv2.setNumThreads(1)
    measured = [measure(folder, args) for folder in args.sequences]
    names = [path.resolve().name for path in args.sequences]
    rounds = "1 round" if args.rounds == 1 else f"{args.rounds} rounds"
    print(f"{len(names)} sequences, {rounds}, in turns on one core; OpenCV {cv2.__version__}.\n")
    print(report(names, measured))


if __name__ == "__main__":
    main()

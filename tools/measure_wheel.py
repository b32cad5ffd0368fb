#!/usr/bin/env python3
"""Times a step through the Python package beside `Tracker::step` in the program, in turns on the same gray frames.

    cargo build --release
    pip install ./python opencv-python-headless
    tools/measure_wheel.py path/to/sequences/*

The program's time is that of `bagtrack-eval`: the step alone, decoding excluded. Frames in colour would add their
conversion to luma and chroma, which the program does while it decodes. Prints the medians of the rounds, and that of
their ratios.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import time

import bagtrack
import cv2


def step_of_program(program, folder):
    command = [program, folder, "--seeds", "1", "--format", "json"]
    report = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return json.loads(report)["sequences"][0]["step_ms"]


def step_of_wheel(frames, box):
    tracker = bagtrack.Tracker(seed=0)
    tracker.init(frames[0], box)
    started = time.perf_counter()
    for frame in frames[1:]:
        tracker.update(frame)
    return 1000 * (time.perf_counter() - started) / (len(frames) - 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", nargs="+", type=pathlib.Path, help="folders in the OTB layout")
    parser.add_argument("--program", default="target/release/bagtrack-eval")
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    for folder in options.sequences:
        frames = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in sorted((folder / "img").iterdir())]
        first = (folder / "groundtruth_rect.txt").read_text().splitlines()[0].replace(",", " ")
        x, y, width, height = (float(number) for number in first.split())
        # The file counts pixels from 1.
        box = (x - 1, y - 1, width, height)
        rounds = [(step_of_program(options.program, folder), step_of_wheel(frames, box)) for _ in range(options.rounds)]
        program, wheel = (statistics.median(times) for times in zip(*rounds))
        ratio = statistics.median(ours / theirs for theirs, ours in rounds)
        print(f"{folder.name}: program {program:.2f} ms, package {wheel:.2f} ms, ratio {ratio:.2f}")


if __name__ == "__main__":
    main()

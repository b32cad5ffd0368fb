#!/usr/bin/env python3
"""Decoding of JPEGs in bagtrack beside OpenCV's imdecode in colour, on the same files in one run.

    tools/decode_table.py [VIDEO_FRAME.jpg]

Needs cargo and python3 with cv2 (opencv-python), and for the feature `turbo` a C compiler, cmake and nasm. The frame,
or else a drawn one, is scaled to four sizes and written as JPEG of quality 85, 4:2:0. bagtrack decodes each, in colour and strictly, to the working image of a target that has a
sixth of the frame's width and height, and of one of 24 x 24 pixels, without and with the feature `turbo`. OpenCV decodes
it in colour with the greatest reduction (2, 4 or 8) that leaves at least that size, and area-averages the rest. Printed:
medians of processor time in milliseconds, one thread; each file is decoded by all in turn, several times over, and a
ratio is the median of those of the turns.
"""

import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import cv2
import numpy

SIZES = [(320, 240), (640, 480), (1280, 720), (1920, 1080)]
ROUNDS = 40
TURNS = 5
PROJECT = pathlib.Path(__file__).resolve().parent.parent
REDUCED = {
    1: cv2.IMREAD_COLOR,
    2: cv2.IMREAD_REDUCED_COLOR_2,
    4: cv2.IMREAD_REDUCED_COLOR_4,
    8: cv2.IMREAD_REDUCED_COLOR_8,
}


def drawn():
    """A picture with edges, gradients and some noise."""
    random = numpy.random.default_rng(1)
    picture = numpy.zeros((1080, 1920, 3), numpy.uint8)
    picture[:] = numpy.linspace(40, 200, 1920)[None, :, None]
    for _ in range(400):
        x, y = int(random.integers(1920)), int(random.integers(1080))
        colour = [int(value) for value in random.integers(0, 255, 3)]
        cv2.circle(picture, (x, y), int(random.integers(5, 90)), colour, -1)
    noise = random.normal(0, 4, picture.shape)
    return numpy.clip(picture + noise, 0, 255).astype(numpy.uint8)


def opencv_ms(data, width, working):
    """Median milliseconds of imdecode in reduced colour and down to the working size."""
    factor = max(f for f in REDUCED if f == 1 or width / f >= working[0])
    times = []
    for _ in range(ROUNDS):
        start = time.thread_time()
        decoded = cv2.imdecode(data, REDUCED[factor])
        if decoded.shape[1] > working[0]:
            cv2.resize(decoded, working, interpolation=cv2.INTER_AREA)
        times.append(time.thread_time() - start)
    return statistics.median(times) * 1e3, factor


def program(features):
    """Builds the benchmark's tables; gives the program's path."""
    command = ["cargo", "bench", "--quiet", "--no-run", "--bench", "tables", "--message-format", "json", *features]
    built = subprocess.run(command, cwd=PROJECT, check=True, stdout=subprocess.PIPE, text=True)
    messages = map(json.loads, built.stdout.splitlines())
    return next(m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "tables")


def bagtrack_ms(tables, file):
    """For each target the working size, and median milliseconds of decoding and of a step."""
    table = subprocess.run([tables, "decode", file], check=True, capture_output=True, text=True)
    rows = [line.split("\t") for line in table.stdout.splitlines()[1:]]
    return [((int(row[3]), int(row[4])), float(row[5]), float(row[6])) for row in rows]


def main():
    cv2.setNumThreads(1)
    picture = cv2.imread(sys.argv[1]) if len(sys.argv) > 1 else drawn()
    if picture is None:
        sys.exit(f"{sys.argv[1]} cannot be read")
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for width, height in SIZES:
            scaled = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
            file = pathlib.Path(folder) / f"{width}x{height}.jpg"
            if not cv2.imwrite(str(file), scaled, [cv2.IMWRITE_JPEG_QUALITY, 85]):
                sys.exit(f"{file} cannot be written")
            files.append(str(file))
        programs = [program([]), program(["--features", "turbo"])]
        print("| frame | KiB | decoded to | OpenCV ms (reduction) | bagtrack ms | ratio | with `turbo` ms | ratio | step ms |")
        print("|---|---|---|---|---|---|---|---|---|")
        for (width, height), file in zip(SIZES, files):
            data = numpy.fromfile(file, numpy.uint8)
            turns = {}
            for _ in range(TURNS):
                for (working, default, step), (_, turbo, _) in zip(*(bagtrack_ms(tables, file) for tables in programs)):
                    theirs, factor = opencv_ms(data, width, working)
                    row = (theirs, default, default / theirs, turbo, turbo / theirs, step)
                    turns.setdefault((working, factor), []).append(row)
            for (working, factor), rows in turns.items():
                theirs, default, ratio, turbo, turbo_ratio, step = (statistics.median(column) for column in zip(*rows))
                print(
                    f"| {width} × {height} | {len(data) // 1024} | {working[0]} × {working[1]} | {theirs:.3f} (1/{factor}) "
                    f"| {default:.3f} | {ratio:.2f} | {turbo:.3f} | {turbo_ratio:.2f} | {step:.3f} |"
                )


if __name__ == "__main__":
    main()

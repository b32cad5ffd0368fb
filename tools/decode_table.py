#!/usr/bin/env python3
"""Decoding of JPEGs in bagtrack beside OpenCV's imdecode to reduced gray, on the same files in one run.

    tools/decode_table.py [VIDEO_FRAME.jpg]

Needs cargo and python3 with cv2 (opencv-python). The frame, or else a drawn one, is scaled to four sizes and written
as JPEG of quality 85, 4:2:0. bagtrack decodes each to its working image (luma, strict, at most 320 pixels
on the longer side); OpenCV decodes it with the greatest reduction (2, 4 or 8) that leaves at least the working
image, and area-averages the rest. Printed: medians in milliseconds, one thread.
"""

import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import cv2
import numpy

SIZES = [(320, 240), (640, 480), (1280, 720), (1920, 1080)]
WORKING_SIDE = 320
ROUNDS = 40
REDUCED = {
    1: cv2.IMREAD_GRAYSCALE,
    2: cv2.IMREAD_REDUCED_GRAYSCALE_2,
    4: cv2.IMREAD_REDUCED_GRAYSCALE_4,
    8: cv2.IMREAD_REDUCED_GRAYSCALE_8,
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


def opencv_ms(data, width):
    """Median milliseconds of imdecode to reduced gray and down to the working side."""
    factor = max(f for f in REDUCED if f == 1 or width / f >= WORKING_SIDE)
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        gray = cv2.imdecode(data, REDUCED[factor])
        if gray.shape[1] > WORKING_SIDE:
            size = (WORKING_SIDE, round(gray.shape[0] * WORKING_SIDE / gray.shape[1]))
            gray = cv2.resize(gray, size, interpolation=cv2.INTER_AREA)
        times.append(time.perf_counter() - start)
    return statistics.median(times) * 1e3, factor


def main():
    cv2.setNumThreads(1)
    project = pathlib.Path(__file__).resolve().parent.parent
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
        command = ["cargo", "bench", "--quiet", "--bench", "tables", "--", "decode", *files]
        table = subprocess.run(command, cwd=project, check=True, capture_output=True, text=True)
        print("| frame | KiB | bagtrack ms | OpenCV ms (reduction) | ratio | step ms |")
        print("|---|---|---|---|---|---|")
        for line in table.stdout.splitlines()[1:]:
            file, width, height, decode, step = line.split("\t")
            data = numpy.fromfile(file, numpy.uint8)
            theirs, factor = opencv_ms(data, int(width))
            ratio = float(decode) / theirs
            print(
                f"| {width} × {height} | {len(data) // 1024} | {decode} | {theirs:.3f} (1/{factor}) "
                f"| {ratio:.2f} | {step} |"
            )


if __name__ == "__main__":
    main()

"""The sample clip, what the library answers to it, and how a client's answers are compared with that."""

import json
import math
import pathlib
import subprocess
import tempfile
import time

SEED = 7
FRAMES = 101


def rounded(answer):
    """To a hundredth of a pixel."""
    frame, box, status = answer
    return frame, [math.floor(100 * side + 0.5) for side in box], status


class Clip:
    def __init__(self, program):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([program, "sample", "--out", folder, "--frames", str(FRAMES)], check=True, capture_output=True)
            self.frames = [path.read_bytes() for path in sorted(pathlib.Path(folder, "img").iterdir())]
            first = pathlib.Path(folder, "groundtruth_rect.txt").read_text().split("\n")[0]
            x, y, width, height = (float(number) for number in first.split(","))
            # The file counts pixels from 1.
            self.box = f"{x - 1:.1f},{y - 1:.1f},{width:.1f},{height:.1f}"
            flags = ["--box", self.box, "--seed", str(SEED), "--format", "json"]
            track = subprocess.run([program, "track", folder, *flags], check=True, capture_output=True, text=True)
        self.answers = [json.loads(line) for line in track.stdout.splitlines()]

    def compare(self, name, post):
        """Posts all frames but the first with `post(number, bytes)`, which tells (frame, [x, y, width, height], status)."""
        started = time.monotonic()
        answers = [post(number, frame) for number, frame in enumerate(self.frames) if number > 0]
        self.check(name, answers, 1000 * (time.monotonic() - started) / len(answers))

    def check(self, name, answers, each):
        """Compares the answers to all frames but the first with the library's; a frame took `each` milliseconds."""
        expected = [
            (answer["frame"], [answer["box"][side] for side in ("x", "y", "width", "height")], answer["status"])
            for answer in self.answers[1:]
        ]
        equal = sum(rounded(answer) == rounded(wanted) for answer, wanted in zip(answers, expected))
        print(f"{name}: {equal} of {len(expected)} boxes equal to the library's, {each:.1f} ms a frame")
        assert len(expected) == FRAMES - 1 and equal == len(expected), answers

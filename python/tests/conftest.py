"""Clips with the boxes that the library gives, and servers.

The program `bagtrack` is that of $BAGTRACK, or target/debug/bagtrack, the example `tiny_network` that of
$BAGTRACK_TINY_NETWORK, or target/debug/examples/tiny_network: `cargo test` builds both. Real clips are taken from
$BAGTRACK_SEQUENCES.
"""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("BAGTRACK", ROOT / "target/debug/bagtrack")).resolve()
TINY_NETWORK = Path(os.environ.get("BAGTRACK_TINY_NETWORK", ROOT / "target/debug/examples/tiny_network")).resolve()
SEED = 7
FRAMES = 100
REAL_CLIPS = ["Coke", "Surfer", "Girl"]


@dataclass
class Clip:
    """A folder of PNG frames, and what `bagtrack track` says of it."""

    folder: Path
    files: list[Path]
    box: tuple[float, float, float, float]
    expected: list[dict]

    def frames(self) -> list[np.ndarray]:
        """The frames as OpenCV reads them: gray, or BGR."""
        return [read(file) for file in self.files]

    def boxes(self) -> list[tuple[float, ...]]:
        return [box_of(line["box"]) for line in self.expected]

    def answered(self) -> list[tuple[float, ...]]:
        """The boxes as the service tells them, to a hundredth of a pixel."""
        return [to_hundredths(box) for box in self.boxes()]


def to_hundredths(box: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(math.floor(value * 100 + 0.5) / 100 for value in box)


def read(file: Path) -> np.ndarray:
    image = Image.open(file)
    if image.mode == "L":
        return np.asarray(image)
    return np.ascontiguousarray(np.asarray(image.convert("RGB"))[:, :, ::-1])


def as_video(frames: list[np.ndarray], file: Path) -> Path:
    """Writes a video of Motion JPEGs, for which OpenCV is needed."""
    import cv2

    size = (frames[0].shape[1], frames[0].shape[0])
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"MJPG"), 25, size)
    for frame in frames:
        writer.write(frame)
    writer.release()
    return file


@contextmanager
def clock(what: str, frames: int) -> Iterator[None]:
    """Prints how long each frame took; pytest's option -s shows it."""
    started = time.perf_counter()
    yield
    print(f"{what}: {1000 * (time.perf_counter() - started) / frames:.2f} ms a frame")


def box_of(document: dict) -> tuple[float, ...]:
    return (document["x"], document["y"], document["width"], document["height"])


def run(*arguments: object) -> str:
    finished = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


def tracked(folder: Path, box: tuple[float, ...]) -> Clip:
    files = sorted((folder / "img").iterdir())
    text = ",".join(map(repr, box))
    output = run("track", folder, "--box", text, "--seed", SEED, "--format", "json")
    expected = [json.loads(line) for line in output.splitlines()]
    assert len(expected) == len(files)
    return Clip(folder, files, box, expected)


def first_box(folder: Path) -> tuple[float, float, float, float]:
    """The first annotated box of a folder in the OTB layout, which is 1-based."""
    line = (folder / "groundtruth_rect.txt").read_text().splitlines()[0]
    x, y, width, height = (float(number) for number in re.split(r"[,\s]+", line.strip()))
    return (x - 1, y - 1, width, height)


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Clip:
    """The sample clip, in colour, as PNG."""
    folder = tmp_path_factory.mktemp("sample") / "clip"
    run("sample", "--out", folder, "--frames", FRAMES, "--format", "png")
    return tracked(folder, first_box(folder))


@pytest.fixture(scope="session")
def network(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The two files of a network without training."""
    folder = tmp_path_factory.mktemp("network")
    subprocess.run([TINY_NETWORK, folder], check=True)
    return folder / "backbone.onnx", folder / "head.onnx"


@pytest.fixture(scope="session", params=REAL_CLIPS)
def real_clip(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Clip:
    """A video of the paper, as PNG."""
    videos = os.environ.get("BAGTRACK_SEQUENCES")
    if not videos:
        pytest.skip("BAGTRACK_SEQUENCES names no folder of videos")
    source = Path(videos) / request.param
    folder = tmp_path_factory.mktemp("real") / request.param
    (folder / "img").mkdir(parents=True)
    for file in sorted((source / "img").iterdir())[:FRAMES]:
        Image.open(file).save(folder / "img" / f"{file.stem}.png", compress_level=1)
    return tracked(folder, first_box(source))


class Server:
    """`bagtrack serve` as a process of its own."""

    def __init__(self, log: Path, *options: str, port: int = 0) -> None:
        self._log = log
        self._options = options
        self.url = ""
        self._start(port)

    def _start(self, port: int) -> None:
        command = [PROGRAM, "serve", "--listen", f"127.0.0.1:{port}", "--log-format", "json", *self._options]
        environment = {**os.environ, "BAGTRACK_SNAPSHOT_KEYS": "a secret for the tests of 32 characters"}
        with self._log.open("w") as log:
            self.process = subprocess.Popen(command, stderr=log, env=environment)
        while not (address := re.search(r"http://127\.0\.0\.1:(\d+)", self._log.read_text())):
            assert self.process.poll() is None, self._log.read_text()
        self.url = address.group(0)
        self.port = int(address.group(1))

    def kill(self) -> None:
        """Kills it without a warning."""
        self.process.kill()
        self.process.wait()

    def drain(self) -> None:
        """Asks it to end."""
        self.process.send_signal(signal.SIGTERM)

    def start_again(self) -> None:
        """Starts it at the same port, with nothing in its memory."""
        self._start(self.port)


@pytest.fixture
def start_server(tmp_path: Path) -> Iterator[Callable[..., Server]]:
    servers: list[Server] = []

    def start(*options: str) -> Server:
        servers.append(Server(tmp_path / f"server{len(servers)}.log", *options))
        return servers[-1]

    yield start
    for server in servers:
        server.process.kill()
        server.process.wait()

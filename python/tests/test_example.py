"""The example runs as its first lines say."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import bagtrack
from conftest import ROOT, SEED, Clip, Server, as_video

cv2 = pytest.importorskip("cv2", reason="the package opencv-python-headless cannot be had", exc_type=ImportError)


def lines(*arguments: object) -> list[list[str]]:
    command = [sys.executable, ROOT / "python/examples/video_capture.py", *map(str, arguments)]
    finished = subprocess.run(command, capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    return [line.split() for line in finished.stdout.splitlines()]


def test_a_video_is_followed_in_process_and_with_a_service(
    clip: Clip, tmp_path: Path, start_server: Callable[..., Server]
) -> None:
    video, tracked = tmp_path / "clip.avi", tmp_path / "tracked.mp4"
    frames = clip.frames()
    as_video(frames, video)

    options = [video, "--box", ",".join(map(str, clip.box)), "--seed", SEED]
    in_process = lines(*options, "--out", tracked)
    capture = cv2.VideoCapture(str(video))
    tracker = bagtrack.Tracker(seed=SEED)
    tracker.init(capture.read()[1], clip.box)
    for number, line in enumerate(in_process):
        if number > 0:
            tracker.update(capture.read()[1])
        assert line == [str(number), *(f"{it:.2f}" for it in (*tracker.box, tracker.score)), tracker.status]
    assert len(in_process) == len(frames)
    assert int(cv2.VideoCapture(str(tracked)).get(cv2.CAP_PROP_FRAME_COUNT)) == len(frames)

    # As JPEG, so the boxes are nearly the same.
    with_service = lines(*options, "--url", start_server().url)
    difference = np.array([line[1:5] for line in with_service], float) - np.array([it[1:5] for it in in_process], float)
    assert len(with_service) == len(frames) and np.abs(difference).max() < 6

"""`bagtrack.propagate`, the examples around it, and `to_detections`: against the command, and with supervision."""

from __future__ import annotations

import csv
import functools
import json
import subprocess
import sys
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest

import bagtrack
from conftest import ROOT, SEED, Clip, as_video, box_of, run

cv2 = pytest.importorskip("cv2", reason="the package opencv-python-headless cannot be had", exc_type=ImportError)
OTHER = (200.0, 30.0, 40.0, 40.0)


def command(clip: Clip, *options: object) -> list[tuple[object, ...]]:
    """What `bagtrack track` says of the clip."""
    output = run("track", clip.folder, "--seed", SEED, "--format", "json", *options)
    lines = [json.loads(line) for line in output.splitlines()]
    return [(it["frame"], it["target"], *box_of(it["box"]), it["status"]) for it in lines]


def rows(answers: object) -> list[tuple[object, ...]]:
    return [(it.frame, it.target, *it.box, it.status) for it in answers]


def text(box: tuple[float, ...]) -> str:
    return ",".join(map(repr, box))


def test_it_gives_the_boxes_of_the_command(clip: Clip) -> None:
    boxes = [clip.box, OTHER]
    flags = ["--box", text(clip.box), "--box", text(OTHER), "--frames", 40]
    expected = command(clip, *flags)
    assert len(expected) == 82
    assert rows(bagtrack.propagate(clip.folder, boxes, count=40, seed=SEED)) == expected
    assert rows(bagtrack.propagate(iter(clip.frames()), boxes, count=40, seed=SEED)) == expected
    keys = command(clip, *flags, "--keyframes")
    assert len(keys) < len(expected) / 2
    assert rows(bagtrack.propagate(clip.frames(), boxes, count=40, seed=SEED, keyframes=True)) == keys


def test_a_video_may_have_an_address(clip: Clip, tmp_path: Path) -> None:
    video = as_video(clip.frames()[:20], tmp_path / "clip.avi")
    handler = functools.partial(SimpleHTTPRequestHandler, directory=tmp_path)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}"
        given = rows(bagtrack.propagate(f"{address}/clip.avi", clip.box, seed=SEED))
        with pytest.raises(ValueError, match=f"^{address}/nothing.avi cannot be read as a video"):
            next(bagtrack.propagate(f"{address}/nothing.avi", clip.box))
        server.shutdown()
    assert given == rows(bagtrack.propagate(video, clip.box, seed=SEED)) and len(given) == 20


def test_it_goes_backwards_through_folders_sequences_and_videos(clip: Clip, tmp_path: Path) -> None:
    start, box = 60, clip.boxes()[60]
    expected = command(clip, "--box", text(box), "--start", start, "--backwards")
    assert [row[0] for row in expected] == list(range(start, -1, -1))
    backwards = {"start": start, "backwards": True, "seed": SEED}
    assert rows(bagtrack.propagate(clip.folder, box, **backwards)) == expected
    assert rows(bagtrack.propagate(clip.frames(), box, **backwards)) == expected
    video = as_video(clip.frames(), tmp_path / "clip.avi")
    forwards = cv2.VideoCapture(str(video))
    decoded = [forwards.read()[1] for _ in range(len(clip.files))]
    of_arrays = rows(bagtrack.propagate(decoded, box, **backwards))
    assert rows(bagtrack.propagate(video, box, **backwards)) == of_arrays
    assert len(of_arrays) == start + 1


def test_it_ends_where_the_target_is_lost(clip: Clip) -> None:
    frames = clip.frames()[:20] + [np.full_like(clip.frames()[0], 128)] * 60
    all_of_it = rows(bagtrack.propagate(frames, clip.box))
    lost = [row[-1] for row in all_of_it].index("lost")
    assert rows(bagtrack.propagate(frames, clip.box, until_lost=True)) == all_of_it[: lost + 1]


def test_what_cannot_be_used_is_told(clip: Clip) -> None:
    frames = clip.frames()[:3]
    for options in ({"start": 3}, {"start": -1}, {"count": -1}):
        with pytest.raises(ValueError, match="no frame 3|are 0 or more"):
            list(bagtrack.propagate(frames, clip.box, **options))
    for boxes in ((1, 2, 3), [], [(1, 2, 3, 4, 5)]):
        with pytest.raises(ValueError, match="boxes are"):
            list(bagtrack.propagate(frames, boxes))
    with pytest.raises(ValueError, match="backwards"):
        list(bagtrack.propagate(iter(frames), clip.box, start=2, backwards=True))
    with pytest.raises(ValueError, match="give start"):
        list(bagtrack.propagate(frames, clip.box, backwards=True))
    with pytest.raises(ValueError, match="cannot be read"):
        list(bagtrack.propagate("no-such-file.mp4", clip.box))
    # Which of a thousand it was, was not said.
    for bad, error in ((frames[0][:-8], ValueError), (None, TypeError)):
        with pytest.raises(error, match="^frame 2 cannot be tracked: "):
            list(bagtrack.propagate([*frames[:2], bad], clip.box))
    with pytest.raises(ValueError, match="^frame 1 cannot be tracked: "):
        list(bagtrack.propagate(frames, (500, 500, 10, 10), start=1))


def example(name: str, *arguments: object, path: Path | None = None) -> str:
    program = [sys.executable, str(ROOT / "python/examples" / name), *map(str, arguments)]
    environment = {"PYTHONPATH": str(path)} if path else None
    finished = subprocess.run(program, capture_output=True, text=True, env=environment)
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


def test_many_videos_are_tracked_in_threads_as_one_after_the_other(clip: Clip, tmp_path: Path) -> None:
    videos = [as_video(clip.frames(), tmp_path / f"{name}.avi") for name in "abc"]
    arguments = [f"{video}:{text(clip.box)}" for video in videos]
    for threads in (1, 3):
        out = tmp_path / f"threads-{threads}"
        print(threads, "threads:", example("many_videos.py", *arguments, "--threads", threads, "--out", out))
        for name in "abc":
            with open(out / f"{name}.csv", newline="") as file:
                read = [(int(row["frame"]), float(row["x"])) for row in csv.DictReader(file)]
            assert read == [(it.frame, it.box[0]) for it in bagtrack.propagate(videos[0], clip.box)]


DETECTOR = """
import cv2, numpy
patches = [numpy.load(file) for file in {files!r}]
def target(frame):
    found = []
    for patch in patches:
        _, likeness, _, (x, y) = cv2.minMaxLoc(cv2.matchTemplate(frame, patch, cv2.TM_CCOEFF_NORMED))
        found += [(x, y, patch.shape[1], patch.shape[0])] if likeness > 0.8 else []
    return found
"""


def test_a_detector_is_asked_at_the_start_and_after_a_loss(clip: Clip, tmp_path: Path) -> None:
    frames = clip.frames()[:20]
    x, y, width, height = map(round, clip.box)
    first = frames[0][y : y + height, x : x + width]
    # What comes later is another thing, which a tracker of the first one does not take for it.
    second = np.kron(np.random.default_rng(SEED).integers(0, 255, (8, 8, 3), np.uint8), np.ones((6, 6, 1), np.uint8))
    files = [str(tmp_path / name) for name in ("first.npy", "second.npy")]
    for file, patch in zip(files, (first, second)):
        np.save(file, patch)
    (tmp_path / "detectors.py").write_text(DETECTOR.format(files=files))
    # It comes, is followed, goes away for long, and another thing comes.
    nothing = np.full_like(frames[0], 128)
    back = nothing.copy()
    back[100:148, 150:198] = second
    as_video([nothing] * 3 + frames + [nothing] * 60 + [back] * 10, tmp_path / "clip.avi")
    output = example("detect_and_follow.py", tmp_path / "clip.avi", "--detector", "detectors:target", path=tmp_path)
    lines = [line.split() for line in output.splitlines()]
    assert len(lines) == 93
    detected = [int(line[0]) for line in lines if line[1] == "detected"]
    assert len(detected) == 2 and 3 <= detected[0] < 9 and 83 <= detected[1] < 89, detected
    assert all(line[1] == "followed" for line in lines[detected[0] + 1 : 23])
    assert all(line[1] == "followed" for line in lines[detected[1] + 1 :])
    assert abs(float(lines[-1][2]) - 150) < 4 and abs(float(lines[-1][3]) - 100) < 4, lines[-1]


def test_supervision_draws_and_keeps_what_it_gets(clip: Clip) -> None:
    sv = pytest.importorskip("supervision", reason="the package supervision cannot be had", exc_type=ImportError)
    from bagtrack.adapters.supervision import to_detections

    frames = clip.frames()[:5]
    tracker = bagtrack.Tracker(seed=SEED)
    tracker.init(frames[0], clip.box)
    for frame in frames[1:]:
        tracker.update(frame)
    detections = to_detections([tracker])
    x, y, width, height = tracker.box
    assert detections.xyxy.tolist() == [[x, y, x + width, y + height]]
    assert detections.confidence.tolist() == [tracker.score] and detections.tracker_id.tolist() == [0]
    assert detections.data["frame"].tolist() == [4] and detections.data["status"].tolist() == ["tracking"]
    drawn = sv.BoxAnnotator().annotate(frames[-1].copy(), detections)
    assert (drawn != frames[-1]).any()

    answers = [it for it in bagtrack.propagate(frames, [clip.box, OTHER], seed=SEED) if it.frame == 4]
    of_answers = to_detections(answers)
    assert of_answers.tracker_id.tolist() == [0, 1]
    assert of_answers.xyxy[0].tolist() == detections.xyxy[0].tolist()
    lost = bagtrack.TargetAnswer(7, (1.0, 2.0, 3.0, 4.0), 0.1, "lost", 0)
    assert len(to_detections([lost])) == 0 and len(to_detections([lost], keep_lost=True)) == 1

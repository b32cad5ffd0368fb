"""The adapter for Label Studio, behind the web application of Label Studio's own package for backends."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("label_studio_ml.model", reason="the package label-studio-ml cannot be had", exc_type=ImportError)
cv2 = pytest.importorskip("cv2", reason="the package opencv-python-headless cannot be had", exc_type=ImportError)

from label_studio_ml.api import init_app  # noqa: E402

import bagtrack  # noqa: E402
from bagtrack.adapters.label_studio import BagTrack  # noqa: E402
from conftest import ROOT, SEED, Clip, clock, run  # noqa: E402

CONFIG = """
<View>
  <Labels name="kinds" toName="clip"><Label value="Person"/></Labels>
  <Video name="clip" value="$film"/>
  <VideoRectangle name="box" toName="clip"/>
</View>
"""
RATE = 20.0


class Backend(BagTrack):
    """With a seed, so that the boxes can be foretold."""

    settings = {"seed": SEED}


@pytest.fixture
def video(clip: Clip, tmp_path: Path) -> Path:
    file = tmp_path / "clip.avi"
    frames = clip.frames()
    size = (frames[0].shape[1], frames[0].shape[0])
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"MJPG"), RATE, size)
    for frame in frames:
        writer.write(frame)
    writer.release()
    return file


def predict(video: Path, tmp_path: Path, context: dict | None) -> list[dict]:
    """What the backend answers when Label Studio asks for a prediction."""
    app = init_app(Backend, model_dir=str(tmp_path)).test_client()
    request = {
        "tasks": [{"id": 1, "data": {"other": "text", "film": str(video)}}],
        "project": "1.1",
        "label_config": CONFIG,
        "params": {"context": context},
    }
    setup = {"project": "1.1", "schema": CONFIG, "hostname": "http://127.0.0.1", "access_token": ""}
    assert app.post("/setup", json=setup).status_code == 200
    assert app.get("/health").get_json()["status"] == "UP"
    answer = app.post("/predict", json=request)
    assert answer.status_code == 200, answer.get_data(as_text=True)
    return answer.get_json()["results"]


def region(sequence: list[dict], name: str = "one") -> dict:
    value = {"framesCount": 100, "duration": 5.0, "sequence": sequence, "labels": ["Person"]}
    return {"id": name, "type": "videorectangle", "from_name": "box", "to_name": "clip", "value": value}


def drawn(frame: int, box: tuple, size: tuple) -> dict:
    x, y, width, height = (np.array(box) / [*size, *size] * 100).tolist()
    return {"frame": frame, "x": x, "y": y, "width": width, "height": height, "enabled": True, "rotation": 0}


def test_a_box_goes_on_through_the_video(clip: Clip, video: Path, tmp_path: Path) -> None:
    capture = cv2.VideoCapture(str(video))
    frames = []
    while (read := capture.read())[0]:
        frames.append(read[1])
    assert len(frames) == len(clip.files)
    size = (frames[0].shape[1], frames[0].shape[0])
    # One object from the first frame on; one that somebody drew in frame 5 and corrected in frame 11.
    one = [drawn(1, clip.box, size)]
    two = [drawn(11, clip.boxes()[10], size), drawn(5, clip.boxes()[4], size)]
    drawn_regions = {"result": [region(one), {"type": "labels"}, region(two, "two")]}
    with clock("label-studio-ml, two regions", len(frames)):
        [result] = predict(video, tmp_path, drawn_regions)
    tracks = {it["id"]: it["value"]["sequence"] for it in result["result"]}
    assert [item["frame"] for item in tracks["one"]] == list(range(1, 101))
    assert [item["frame"] for item in tracks["two"]] == [5, *range(11, 101)]
    for name, first in (("one", 1), ("two", 11)):
        track = [item for item in tracks[name] if item["frame"] >= first]
        tracker = bagtrack.Tracker(seed=SEED)
        shares = np.array([track[0][side] for side in ("x", "y", "width", "height")])
        tracker.init(frames[first - 1], shares / 100 * [*size, *size])
        for item in track[1:]:
            _, box = tracker.update(frames[item["frame"] - 1])
            found = [item[side] for side in ("x", "y", "width", "height")]
            assert found == (np.array(box) / [*size, *size] * 100).tolist()
            assert item["enabled"] and item["time"] == (item["frame"] - 1) / RATE
    assert result["result"][0]["value"]["labels"] == ["Person"]
    assert 0 < result["score"] < 1


def test_without_a_box_there_is_no_track(video: Path, tmp_path: Path) -> None:
    assert predict(video, tmp_path, None) == [{"result": [], "score": 0.0}]


def test_a_call_tracks_no_more_frames_than_it_may(video: Path, tmp_path: Path, monkeypatch, clip: Clip) -> None:
    monkeypatch.setattr(BagTrack, "max_frames", 7)
    [result] = predict(video, tmp_path, {"result": [region([drawn(3, clip.boxes()[2], (320, 240))])]})
    assert [item["frame"] for item in result["result"][0]["value"]["sequence"]] == list(range(3, 11))


def test_a_lost_target_is_shown_in_no_frame(tmp_path: Path) -> None:
    """Label Studio shows a key frame itself, whether it is enabled or not."""
    run("sample", "--out", tmp_path / "leaves", "--scene", "leaves", "--frames", 90, "--format", "png")
    frames = [cv2.imread(str(file)) for file in sorted((tmp_path / "leaves" / "img").iterdir())]
    truth = (tmp_path / "leaves" / "groundtruth_rect.txt").read_text().split()
    x, y, width, height = (float(value) for value in truth[0].split(","))
    file = tmp_path / "leaves.avi"
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"MJPG"), RATE, (320, 240))
    for frame in frames:
        writer.write(frame)
    writer.release()
    [result] = predict(file, tmp_path, {"result": [region([drawn(1, (x - 1, y - 1, width, height), (320, 240))])]})
    sequence = result["result"][0]["value"]["sequence"]
    read, tracker, shown = cv2.VideoCapture(str(file)), bagtrack.Tracker(seed=SEED), []
    shares = np.array([sequence[0][side] for side in ("x", "y", "width", "height")])
    tracker.init(read.read()[1], shares / 100 * [320, 240, 320, 240])
    for number in range(2, 91):
        ok, _ = tracker.update(read.read()[1])
        before = [item for item in sequence if item["frame"] <= number][-1]
        shown.append(ok)
        assert ok == (before["frame"] == number or before["enabled"]), number
    assert not all(shown) and any(shown)


DOCKER = ROOT / "docker" / "label-studio"


@pytest.fixture
def as_in_the_image(tmp_path: Path) -> Iterator[str]:
    """The address of the backend, started by the command of the image."""
    if not (Path(sys.executable).parent / "gunicorn").exists():
        pytest.skip("the package gunicorn cannot be had")
    [command] = re.findall(r"^CMD (\[.*\])$", (DOCKER / "Dockerfile").read_text(), re.MULTILINE)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PORT": str(port), "MODEL_DIR": str(tmp_path), "HOME": str(tmp_path)}
    process = subprocess.Popen(json.loads(command), cwd=DOCKER, env=environment)
    try:
        late = time.monotonic() + 60
        while not answers(f"http://127.0.0.1:{port}/health"):
            assert process.poll() is None and time.monotonic() < late
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait()


def answers(url: str) -> bool:
    try:
        with urllib.request.urlopen(url) as response:
            return bool(json.load(response)["status"] == "UP")
    except urllib.error.URLError:
        return False


def test_the_command_of_the_image_runs_the_backend(as_in_the_image: str, clip: Clip, video: Path) -> None:
    def post(path: str, document: dict) -> dict:
        body, headers = json.dumps(document).encode(), {"Content-Type": "application/json"}
        with urllib.request.urlopen(urllib.request.Request(as_in_the_image + path, body, headers)) as response:
            return dict(json.load(response))

    setup = {"project": "1.1", "schema": CONFIG, "hostname": "http://127.0.0.1", "access_token": ""}
    post("/setup", setup)
    task = {"id": 1, "data": {"film": str(video)}}
    context = {"result": [region([drawn(1, clip.box, (320, 240))])]}
    request = {"tasks": [task], "project": "1.1", "label_config": CONFIG, "params": {"context": context}}
    [result] = post("/predict", request)["results"]
    assert len(result["result"][0]["value"]["sequence"]) == len(clip.files)


def test_the_image_is_built_of_what_is_there() -> None:
    """Docker takes what the Dockerfile copies, and pip what the wheel's adapter needs."""
    ignored = (DOCKER / "Dockerfile.dockerignore").read_text().split()
    kept = [line[1:] for line in ignored if line.startswith("!")]
    copied = re.findall(r"^COPY (?!--from)(.*) \S+$", (DOCKER / "Dockerfile").read_text(), re.MULTILINE)
    for source in " ".join(copied).split():
        assert (ROOT / source).exists(), source
        assert any(source == folder or source.startswith(f"{folder}/") for folder in kept), source

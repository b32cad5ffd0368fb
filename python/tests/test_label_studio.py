"""The adapter for Label Studio, behind the web application of Label Studio's own package for backends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("label_studio_ml.model", reason="the package label-studio-ml cannot be had", exc_type=ImportError)
cv2 = pytest.importorskip("cv2", reason="the package opencv-python-headless cannot be had", exc_type=ImportError)

from label_studio_ml.api import init_app  # noqa: E402

import bagtrack  # noqa: E402
from bagtrack.adapters.label_studio import BagTrack  # noqa: E402
from conftest import SEED, Clip, clock  # noqa: E402

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
            ok, box = tracker.update(frames[item["frame"] - 1])
            found = [item[side] for side in ("x", "y", "width", "height")]
            assert found == (np.array(box) / [*size, *size] * 100).tolist()
            assert item["enabled"] == ok and item["time"] == (item["frame"] - 1) / RATE
    assert result["result"][0]["value"]["labels"] == ["Person"]
    assert 0 < result["score"] < 1


def test_without_a_box_there_is_no_track(video: Path, tmp_path: Path) -> None:
    assert predict(video, tmp_path, None) == [{"result": [], "score": 0.0}]


def test_a_call_tracks_no_more_frames_than_it_may(video: Path, tmp_path: Path, monkeypatch, clip: Clip) -> None:
    monkeypatch.setattr(BagTrack, "max_frames", 7)
    [result] = predict(video, tmp_path, {"result": [region([drawn(3, clip.boxes()[2], (320, 240))])]})
    assert [item["frame"] for item in result["result"][0]["value"]["sequence"]] == list(range(3, 11))

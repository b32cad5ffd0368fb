"""`bagtrack-cvat` with the real cvat-sdk, against a server that answers as CVAT does."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from PIL import Image

cvat_sdk = pytest.importorskip("cvat_sdk", reason="the package cvat-sdk cannot be had", exc_type=ImportError)

import bagtrack  # noqa: E402
from bagtrack.adapters import cvat_propagation  # noqa: E402
from conftest import SEED, Clip  # noqa: E402

START = 50


def rectangle(frame: int, points: list[float], outside: bool = False) -> dict:
    shape = {"type": "rectangle", "frame": frame, "points": points, "outside": outside, "occluded": False}
    return {**shape, "z_order": 0, "rotation": 0.0, "attributes": []}


def corners(box: tuple) -> list[float]:
    x, y, width, height = box
    return [x, y, x + width, y + height]


class Cvat(ThreadingHTTPServer):
    """The part of CVAT's interface that the program uses, with one task."""

    def __init__(self, pictures: list[bytes], tracks: list[dict]) -> None:
        super().__init__(("127.0.0.1", 0), Answers)
        self.pictures, self.tracks = pictures, tracks
        self.deleted: list[int] = []
        self.patches: list[dict] = []
        self.read: list[int] = []


class Answers(BaseHTTPRequestHandler):
    server: Cvat

    def do_GET(self) -> None:
        url = urlsplit(self.path)
        url = url._replace(path=url.path.rstrip("/"))
        query = parse_qs(url.query)
        if url.path == "/api/server/about":
            version = cvat_sdk.version.VERSION
            self.answer({"name": "CVAT", "description": "", "version": version, "logo_url": "", "subtitle": ""})
        elif self.headers["Authorization"] != "Bearer a token":
            self.answer({"detail": "Authentication credentials were not provided."}, 401)
        elif url.path == "/api/tasks/17":
            size, jobs = len(self.server.pictures), {"completed": 0, "validation": 0, "url": ""}
            self.answer({"id": 17, "name": "clip", "size": size, "jobs": jobs, "labels": {"url": ""}})
        elif url.path == "/api/tasks/17/data/meta":
            meta = {"chunks_updated_date": "2026-01-01T00:00:00Z", "image_quality": 70, "frames": []}
            self.answer({**meta, "deleted_frames": self.server.deleted})
        elif url.path == "/api/tasks/17/annotations":
            self.answer({"version": 1, "tags": [], "shapes": [], "tracks": self.server.tracks})
        elif url.path == "/api/tasks/17/data" and query["type"] == ["frame"] and query["quality"] == ["original"]:
            number = int(query["number"][0])
            self.server.read.append(number)
            self.answer(self.server.pictures[number], kind="image/png")
        else:
            self.answer({"detail": "Not found."}, 404)

    def do_PATCH(self) -> None:
        patch = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        assert urlsplit(self.path).path.rstrip("/") == "/api/tasks/17/annotations" and "action=update" in self.path
        self.server.patches.append(patch)
        self.answer({"version": 1, "tags": [], "shapes": [], "tracks": []})

    def answer(self, body: object, status: int = 200, kind: str = "application/vnd.cvat+json") -> None:
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *_: object) -> None:
        pass


def track(number: int, shapes: list[dict]) -> dict:
    return {"id": number, "frame": shapes[0]["frame"], "label_id": 3, "group": 0, "source": "manual", "shapes": shapes}


@pytest.fixture
def cvat(clip: Clip, monkeypatch: pytest.MonkeyPatch) -> Iterator[Cvat]:
    """CVAT with the clip, and a track whose rectangle is that of the frame START."""
    tracks = [track(5, [rectangle(START, corners(clip.boxes()[START]))])]
    server = Cvat([file.read_bytes() for file in clip.files], tracks)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setenv("CVAT_ACCESS_TOKEN", "a token")
    yield server
    server.shutdown()
    server.server_close()


def run(cvat: Cvat, *options: object) -> int | str:
    """The exit status of the program, or the line with which it ends with status 1."""
    host = f"http://127.0.0.1:{cvat.server_address[1]}"
    arguments = ["--host", host, "--task", "17", "--frame", START, "--seed", SEED, *options]
    with pytest.raises(SystemExit) as ended:
        cvat_propagation.main([str(it) for it in arguments])
    return ended.value.code


def shown(shapes: list[dict], frame: int) -> list[float] | None:
    """What CVAT draws in a frame: straight lines between key frames, nothing where the last one is outside."""
    before = [shape for shape in shapes if shape["frame"] <= frame]
    after = [shape for shape in shapes if shape["frame"] > frame]
    if not before or before[-1]["outside"]:
        return None
    if not after or after[0]["outside"]:
        return before[-1]["points"]
    a, b = before[-1], after[0]
    part = (frame - a["frame"]) / (b["frame"] - a["frame"])
    return [one + part * (other - one) for one, other in zip(a["points"], b["points"])]


def test_a_track_gets_key_frames_that_show_what_the_tracker_says(cvat: Cvat, clip: Clip) -> None:
    assert run(cvat, "--frames", 40) == 0
    [patch] = cvat.patches
    [changed] = patch["tracks"]
    assert (changed["id"], changed["label_id"], changed["frame"]) == (5, 3, START)
    shapes = changed["shapes"]
    assert shapes[0]["points"] == corners(clip.boxes()[START]) and shapes[-1]["frame"] == START + 40
    assert len(shapes) < 25
    assert sorted(cvat.read) == list(range(START, START + 41))
    for answer in bagtrack.propagate(clip.frames(), clip.boxes()[START], start=START, count=40, seed=SEED):
        assert answer.ok
        assert np.abs(np.subtract(shown(shapes, answer.frame), corners(answer.box))).max() < 1.001, answer


def test_it_goes_backwards_past_deleted_frames(cvat: Cvat) -> None:
    cvat.deleted = [START - 3]
    assert run(cvat, "--frames", 20, "--backwards") == 0
    [changed] = cvat.patches[0]["tracks"]
    assert changed["frame"] == START - 21 and changed["shapes"][-1]["frame"] == START
    frames = [shape["frame"] for shape in changed["shapes"]]
    assert frames == sorted(frames) and START - 3 not in cvat.read


def test_it_ends_before_the_next_key_frame_of_somebody(cvat: Cvat) -> None:
    later = rectangle(START + 10, [1.0, 2.0, 31.0, 42.0])
    cvat.tracks[0]["shapes"].append(later)
    assert run(cvat) == 0
    shapes = cvat.patches[0]["tracks"][0]["shapes"]
    assert shapes[-1] == {**shapes[-1], **later} and shapes[-2]["frame"] == START + 9


def test_a_lost_target_is_switched_off(cvat: Cvat, clip: Clip) -> None:
    empty = Image.new("RGB", Image.open(clip.files[0]).size, (128, 128, 128))
    folder = clip.folder / "empty.png"
    empty.save(folder)
    cvat.pictures[START + 5 :] = [folder.read_bytes()] * (len(cvat.pictures) - START - 5)
    folder.unlink()
    assert run(cvat) == 0
    shapes = cvat.patches[0]["tracks"][0]["shapes"]
    assert [shape["outside"] for shape in shapes].count(True) == 1 and shapes[-1]["outside"]
    assert shown(shapes, shapes[-1]["frame"] - 1) is not None and shown(shapes, len(clip.files) - 1) is None


def test_nothing_is_changed_where_nothing_can_be_done(cvat: Cvat, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(cvat, "--dry-run", "--frames", 3) == 0
    assert "track 5: " in capsys.readouterr().out
    assert run(cvat, "--track", 6) == 1
    assert "with Track" in capsys.readouterr().err
    cvat.deleted = [START]
    assert run(cvat) == 1
    assert "there is no frame 50" in capsys.readouterr().err
    assert cvat.patches == []


def test_ordinary_mistakes_are_told_in_a_line(cvat: Cvat, monkeypatch: pytest.MonkeyPatch) -> None:
    cvat.pictures[START + 1] = b"no picture"
    monkeypatch.setattr("urllib3.util.Retry.sleep", lambda *_: None)
    told = [
        run(cvat, "--host", "http://127.0.0.1:9"),
        run(cvat, "--task", 18),
        run(cvat, "--frames", 3),
    ]
    monkeypatch.setenv("CVAT_ACCESS_TOKEN", "another token")
    told.append(run(cvat))
    expected = ["no answer from http://127.0.0.1:9, ", " answered 404 ", "cannot identify image", " answered 401 "]
    for line, words in zip(told, expected):
        assert isinstance(line, str) and line.startswith("bagtrack-cvat: ") and "\n" not in line, told
        assert words in line and len(line) < 400, told
    assert cvat.patches == []

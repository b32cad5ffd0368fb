"""`bagtrack.cv.Tracker` in the place of one of OpenCV's trackers, in OpenCV's own sample script, too.

The script is that of Debian's package opencv-doc; $OPENCV_SAMPLES names the folder that it was unpacked into.
"""

from __future__ import annotations

import copy
import inspect
import json
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bagtrack
from conftest import Clip, first_box, run

cv2 = pytest.importorskip("cv2", reason="the package opencv-python-headless cannot be had", exc_type=ImportError)

FRAMES = 150
BLUE = (200, 0, 0)
NOWHERE = (False, (0, 0, 0, 0))

# In place of windows, which need a screen: the user's box is given, and what the script shows is looked at.
WITHOUT_WINDOWS = """
import json, runpy, sys
import cv2, numpy as np

script, box, found = sys.argv[1], tuple(json.loads(sys.argv[2])), sys.argv[3]
sys.argv[1:] = sys.argv[4:]
shown = []

def imshow(name, image):
    ys, xs = np.nonzero((image == (200, 0, 0)).all(axis=2))
    shown.append([int(it) for it in (xs.min(), ys.min(), xs.max() + 1, ys.max() + 1)] if len(xs) else None)

cv2.selectROI = lambda name, image: box
cv2.imshow = imshow
cv2.namedWindow = cv2.destroyAllWindows = lambda *names: None
cv2.waitKey = lambda delay: -1
runpy.run_path(script, run_name="__main__")
json.dump(shown, open(found, "w"))
"""


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """The sample clip as a video that ffmpeg made, and the true boxes, 0-based."""
    if not shutil.which("ffmpeg"):
        pytest.skip("there is no ffmpeg")
    folder = tmp_path_factory.mktemp("film")
    run("sample", "--out", folder / "clip", "--frames", FRAMES, "--format", "png")
    video = folder / "clip.mp4"
    source = ["-framerate", "25", "-i", folder / "clip/img/%04d.png"]
    command = ["ffmpeg", "-v", "error", *source, "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", video]
    subprocess.run([str(word) for word in command], check=True)
    truth = np.loadtxt(folder / "clip/groundtruth_rect.txt", delimiter=",")
    return video, truth - (1, 1, 0, 0)


def whole(box: np.ndarray | tuple[float, ...]) -> tuple[int, ...]:
    return tuple(round(float(number)) for number in box)


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    low, high = np.maximum(one[:2], other[:2]), np.minimum(one[:2] + one[2:], other[:2] + other[2:])
    both = np.prod(np.maximum(high - low, 0))
    return float(both / (np.prod(one[2:]) + np.prod(other[2:]) - both))


def frames_of(video: Path) -> list[np.ndarray]:
    capture = cv2.VideoCapture(str(video))
    frames = []
    while (read := capture.read())[0]:
        frames.append(read[1])
    return frames


def test_opencvs_own_sample_script_runs_with_one_line_changed(
    film: tuple[Path, np.ndarray], tmp_path: Path
) -> None:
    samples = os.environ.get("OPENCV_SAMPLES", "")
    if not (Path(samples) / "tracker.py").is_file():
        pytest.skip("OPENCV_SAMPLES names no folder with OpenCV's tracker.py (Debian's package opencv-doc)")
    video, truth = film
    for file in Path(samples).glob("*.py"):
        shutil.copy(file, tmp_path)
    script = tmp_path / "tracker.py"
    text = script.read_text()
    theirs = "tracker = cv.TrackerMIL_create()"
    assert text.count(theirs) == 1
    script.write_text(text.replace(theirs, "import bagtrack.cv; tracker = bagtrack.cv.Tracker_create()"))

    found = tmp_path / "found.json"
    box = json.dumps(whole(truth[0]))
    command = [sys.executable, "-c", WITHOUT_WINDOWS, script, box, found, "--input", video]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    finished = subprocess.run([str(word) for word in command], capture_output=True, text=True, env=environment)
    assert finished.returncode == 0, finished.stderr
    assert finished.stdout.rstrip().endswith("Done"), finished.stdout
    drawn = json.loads(found.read_text())
    assert len(drawn) == FRAMES - 1
    good = 0
    for corners, true in zip(drawn, truth[1:]):
        if corners is not None:
            left, top, right, bottom = corners
            good += overlap(np.array([left, top, right - left, bottom - top]), true) > 0.5
    print(f"{good} of {len(drawn)} boxes overlap the truth by more than half")
    assert good >= 0.95 * len(drawn)


def test_boxes_are_whole_numbers_of_python_as_with_opencv(film: tuple[Path, np.ndarray]) -> None:
    video, truth = film
    frames = frames_of(video)[:40]
    theirs = cv2.TrackerMIL.create()
    assert theirs.init(frames[0], whole(truth[0])) is None
    their_answer = theirs.update(frames[1])
    for create in (bagtrack.cv.Tracker_create, bagtrack.cv.Tracker.create, bagtrack.cv.Tracker):
        ours = create()
        assert ours.init(frames[0], whole(truth[0])) is None
        answer = ours.update(frames[1])
        assert [type(it) for it in (*answer, *answer[1])] == [type(it) for it in (*their_answer, *their_answer[1])]
        cv2.rectangle(frames[1].copy(), answer[1], BLUE)
        assert isinstance(ours.getTrackingScore(), float) and 0.5 < ours.getTrackingScore() <= 1
    for box in (list(whole(truth[0])), np.array(whole(truth[0])), truth[0]):
        bagtrack.cv.Tracker_create().init(image=frames[0], boundingBox=box)
    # The whole numbers are the nearest ones.
    plain = bagtrack.Tracker()
    plain.init(frames[0], whole(truth[0]))
    ours.init(frames[0], whole(truth[0]))
    for frame in frames[1:]:
        assert ours.update(image=frame) == (True, whole(plain.update(frame)[1]))


def test_the_arguments_have_opencvs_names() -> None:
    for method in ("init", "update"):
        theirs = getattr(cv2.Tracker, method).__doc__ or ""
        names = [name for name in inspect.signature(getattr(bagtrack.cv.Tracker, method)).parameters if name != "self"]
        assert theirs.startswith(f"{method}({', '.join(names)}) -> "), theirs


def test_frames_that_cannot_be_used_do_not_count(clip: Clip) -> None:
    frames = clip.frames()
    box = whole(clip.box)
    tracker, other = bagtrack.cv.Tracker_create(), bagtrack.cv.Tracker_create()
    with pytest.raises(RuntimeError, match="call init"):
        tracker.update(frames[0])
    for it in (tracker, other):
        it.init(frames[0], box)
    unusable = [None, np.zeros((0, 0, 3), np.uint8), frames[1][:-1], cv2.resize(frames[1], (640, 480))]
    for frame in unusable:
        assert tracker.update(frame) == NOWHERE
        assert tracker.getTrackingScore() == 0
    assert [tracker.update(frame) for frame in frames[1:20]] == [other.update(frame) for frame in frames[1:20]]
    assert tracker.getTrackingScore() == other.getTrackingScore() > 0
    with pytest.raises(ValueError, match="dtype uint8, not float32"):
        tracker.update(frames[1].astype(np.float32))
    with pytest.raises(TypeError, match="NumPy array, not str"):
        tracker.update("frame.png")
    for image, wrong, error in ((frames[0], (10, 10, 2, 2), "too small"), (frames[0], (900, 9, 40, 40), "outside")):
        with pytest.raises(ValueError, match=error):
            tracker.init(image, wrong)


def test_a_lost_target_has_no_box_and_may_be_found_again(clip: Clip) -> None:
    frames = clip.frames()
    tracker = bagtrack.cv.Tracker_create()
    tracker.init(frames[0], whole(clip.box))
    for frame in frames[1:10]:
        assert tracker.update(frame)[0]
    blank = np.full_like(frames[0], 127)
    for _ in range(60):
        answer = tracker.update(blank)
        if answer == NOWHERE:
            break
        assert answer[0]
    assert answer == NOWHERE and tracker.tracker.status == "lost" and tracker.getTrackingScore() < 0.5
    for _ in range(60):
        found, box = tracker.update(frames[9])
        if found:
            break
        assert box == (0, 0, 0, 0)
    assert found and overlap(np.array(box), np.array(clip.boxes()[9])) > 0.5


def test_the_same_run_twice_gives_the_same_boxes(clip: Clip) -> None:
    frames = clip.frames()[:30]

    def boxes(tracker: bagtrack.Tracker) -> list:
        tracker.init(frames[0], clip.box)
        return [tracker.update(frame) for frame in frames[1:]]

    assert bagtrack.Tracker().params["seed"] == 0
    assert boxes(bagtrack.Tracker()) == boxes(bagtrack.Tracker()) == boxes(bagtrack.Tracker(seed=0))
    assert boxes(bagtrack.Tracker()) != boxes(bagtrack.Tracker(seed=1))
    assert boxes(bagtrack.cv.Tracker()) == boxes(bagtrack.cv.Tracker())


def copies(tracker):
    pickled = [pickle.loads(pickle.dumps(tracker, protocol)) for protocol in range(pickle.HIGHEST_PROTOCOL + 1)]
    return [*pickled, copy.deepcopy(tracker), copy.copy(tracker)] if isinstance(tracker, bagtrack.Tracker) else [
        *pickled,
        copy.deepcopy(tracker),
    ]


@pytest.mark.parametrize("kind", [bagtrack.Tracker, bagtrack.cv.Tracker])
def test_copies_go_on_bit_for_bit(clip: Clip, kind) -> None:
    frames = clip.frames()
    tracker = kind(preset="paper", seed=3, particles=50)
    fresh = copies(tracker)
    tracker.init(frames[0], clip.box)
    for frame in frames[1:20]:
        tracker.update(frame)
    begun = copies(tracker)
    expected = [tracker.update(frame) for frame in frames[20:40]]
    for other in begun:
        assert [other.update(frame) for frame in frames[20:40]] == expected
    for other in fresh:
        other.init(frames[0], clip.box)
        boxes = [other.update(frame) for frame in frames[1:40]]
        assert boxes[19:] == expected
    inner = tracker.tracker if kind is bagtrack.cv.Tracker else tracker
    assert inner.params["particles"] == 50
    for other in (*begun, *fresh):
        inner_copy = other.tracker if kind is bagtrack.cv.Tracker else other
        assert inner_copy.params == inner.params and inner_copy.save() == inner.save()


def test_trackers_go_to_other_processes(clip: Clip, tmp_path: Path) -> None:
    frames = clip.frames()
    tracker = bagtrack.Tracker()
    tracker.init(frames[0], clip.box)
    file = tmp_path / "tracker.pickle"
    file.write_bytes(pickle.dumps((tracker, frames[1])))
    code = "import pickle, sys; t, f = pickle.load(open(sys.argv[1], 'rb')); print(repr(t.update(f)))"
    there = subprocess.run([sys.executable, "-c", code, str(file)], capture_output=True, text=True, check=True)
    assert there.stdout.strip() == repr(tracker.update(frames[1]))


def test_the_version_is_that_of_the_package() -> None:
    from importlib.metadata import version

    assert bagtrack.__version__ == version("bagtrack")

"""The tracker in process: the same boxes as the library's, and errors that say what is wrong."""

from __future__ import annotations

import copy
import json
import pickle
import queue
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import bagtrack
from conftest import SEED, Clip, box_of, clock, run


def follow(clip: Clip, tracker: bagtrack.Tracker) -> list[tuple]:
    first, *others = clip.frames()
    tracker.init(first, clip.box)
    answers = [(tracker.frame, tracker.box, tracker.score, tracker.status)]
    with clock("Tracker.update", len(others)):
        for frame in others:
            ok, box = tracker.update(frame)
            assert (ok, box) == (tracker.status != "lost", tracker.box)
            answers.append((tracker.frame, tracker.box, tracker.score, tracker.status))
    return answers


def expected(clip: Clip) -> list[tuple]:
    lines = zip(clip.expected, clip.boxes())
    return [(line["frame"], box, line["score"], line["status"]) for line, box in lines]


def test_the_sample_clip_gets_the_librarys_answers(clip: Clip) -> None:
    assert follow(clip, bagtrack.Tracker(seed=SEED)) == expected(clip)


def test_real_clips_get_the_librarys_answers(real_clip: Clip) -> None:
    assert follow(real_clip, bagtrack.Tracker(seed=SEED)) == expected(real_clip)


def test_arrays_of_any_layout_give_the_same_boxes(clip: Clip) -> None:
    first, second, *_ = clip.frames()
    plain = bagtrack.Tracker(seed=SEED)
    plain.init(first, clip.box)
    plain.update(second)
    wide = np.zeros((second.shape[0], 2 * second.shape[1], 3), np.uint8)
    wide[:, ::2] = second
    layouts = [
        np.asfortranarray(second),
        wide[:, ::2],
        second[::-1][::-1],
        np.ascontiguousarray(second[:, :, ::-1])[:, :, ::-1],
    ]
    for frame in layouts:
        assert (frame == second).all()
        tracker = bagtrack.Tracker(seed=SEED)
        tracker.init(first, np.array(clip.box))
        assert tracker.update(frame)[1] == plain.box
    frame = second.copy()
    frame.flags.writeable = False
    tracker = bagtrack.Tracker(seed=SEED)
    tracker.init(first, list(clip.box))
    assert tracker.update(frame)[1] == plain.box


def test_colour_counts_and_has_the_order_of_opencv(clip: Clip) -> None:
    frames = clip.frames()[:30]

    def last(change) -> tuple:
        tracker = bagtrack.Tracker(seed=SEED)
        tracker.init(change(frames[0]), clip.box)
        for frame in frames[1:]:
            tracker.update(change(frame))
        return tracker.box

    as_it_is = last(lambda frame: frame)
    assert as_it_is == clip.boxes()[29]
    assert last(lambda frame: frame[:, :, ::-1]) != as_it_is
    gray = last(lambda frame: frame[:, :, 1])
    assert gray == last(lambda frame: frame[:, :, 1:2]) != as_it_is


def test_a_saved_tracker_goes_on_bit_for_bit(clip: Clip) -> None:
    frames = clip.frames()
    tracker = bagtrack.Tracker("robust", SEED)
    tracker.init(frames[0], clip.box)
    for frame in frames[1:40]:
        tracker.update(frame)
    other = bagtrack.Tracker.load(tracker.save())
    assert (other.box, other.score, other.status, other.frame) == (
        tracker.box,
        tracker.score,
        tracker.status,
        39,
    )
    assert other.params == tracker.params
    assert [other.update(frame)[1] for frame in frames[40:60]] == clip.boxes()[40:60]
    # The first one has not moved.
    assert tracker.frame == 39


def test_a_network_gives_a_second_opinion_as_on_the_command_line(
    clip: Clip, network: tuple[Path, Path], tmp_path: Path
) -> None:
    files = f"--model=nanotrack:{network[0]},{network[1]}"
    alone = expected(clip)
    sure = next((at for at, (_, _, score, _) in enumerate(alone) if score < 0.95), len(alone))
    assert sure > 10
    for in_doubt in [False, True]:
        flags = ["--box", ",".join(map(repr, clip.box)), "--seed", SEED, "--format", "json", files]
        said = run("track", clip.folder, *flags, *(["--model-in-doubt"] if in_doubt else []))
        lines = [json.loads(line) for line in said.splitlines()]
        model = bagtrack.NanoTrack(*network, in_doubt=in_doubt)
        answers = follow(clip, bagtrack.Tracker(seed=SEED, model=model))
        assert [box for _, box, _, _ in answers] == [box_of(line["box"]) for line in lines]
        assert [score for _, _, score, _ in answers] == [line["score"] for line in lines]
        # In doubt it has no part in what the filter is sure of.
        assert (answers[:sure] == alone[:sure]) == in_doubt


def test_a_tracker_with_a_network_goes_on_with_the_same_one_alone(clip: Clip, network: tuple[Path, Path]) -> None:
    frames = clip.frames()
    model = bagtrack.NanoTrack(str(network[0]), str(network[1]))
    tracker = bagtrack.Tracker(seed=SEED, model=model)
    copied = pickle.loads(pickle.dumps(tracker))
    for one in [tracker, copied]:
        one.init(frames[0], clip.box)
        one.update(frames[1])
    assert copied.save() == tracker.save()
    others = [bagtrack.Tracker.load(tracker.save(), model), copy.deepcopy(tracker), pickle.loads(pickle.dumps(tracker))]
    answer = tracker.update(frames[2])
    assert [other.update(frames[2]) for other in others] == [answer] * 3
    with pytest.raises(ValueError, match="--model"):
        bagtrack.Tracker.load(tracker.save())
    with pytest.raises(ValueError):
        bagtrack.Tracker.load(tracker.save(), bagtrack.NanoTrack(*network, in_doubt=True))
    with pytest.raises(FileNotFoundError, match="nowhere.onnx"):
        bagtrack.NanoTrack(network[0], "nowhere.onnx")
    with pytest.raises(ValueError, match="no NanoTrack"):
        bagtrack.NanoTrack(network[1], network[0])
    with pytest.raises(ValueError, match="robust"):
        bagtrack.Tracker("paper", model=model).init(frames[0], clip.box)


def test_a_corrected_box_is_the_answer_to_its_frame(clip: Clip) -> None:
    frames = clip.frames()
    tracker = bagtrack.Tracker(seed=SEED)
    tracker.init(frames[0], clip.box)
    tracker.update(frames[1])
    tracker.retarget(frames[2], (100, 80, 40, 30))
    assert (tracker.frame, tracker.box) == (2, (100, 80, 40, 30))
    tracker.init(frames[0], clip.box)
    assert tracker.frame == 0
    assert [tracker.update(frame)[1] for frame in frames[1:10]] == clip.boxes()[1:10]


def test_parameters_are_checked_and_told(clip: Clip) -> None:
    tracker = bagtrack.Tracker("paper", seed=3, particles=50, alpha=1, motion_std_x=np.float32(4))
    params = tracker.params
    assert params["seed"] == 3 and params["particles"] == 50 and params["alpha"] == 1.0
    assert params["motion_std_x"] == 4.0 and len(params) == 16
    assert bagtrack.Tracker(particles=64.0).params["particles"] == 64
    assert bagtrack.Tracker(seed=None).params["seed"] != bagtrack.Tracker(seed=None).params["seed"]
    with pytest.raises(ValueError, match="robust or paper, not \"fast\""):
        bagtrack.Tracker("fast")
    for make in (bagtrack.Tracker, bagtrack.cv.Tracker_create):
        for seed in (-1, 2**64, np.int64(-1)):
            with pytest.raises(ValueError, match=f"the seed is a whole number from 0 to {2**64 - 1}, not {seed}"):
                make(seed=seed)
        with pytest.raises(TypeError):
            make(seed=1.5)
    assert bagtrack.Tracker(seed=2**64 - 1).params["seed"] == 2**64 - 1
    with pytest.raises(ValueError, match="targets are counted from 0, not -1"):
        tracker.of_target(-1)
    with pytest.raises(TypeError):
        tracker.of_target(1.5)
    with pytest.raises(TypeError, match="no parameter particle; the parameters are particles, patch_width"):
        bagtrack.Tracker(particle=10)
    with pytest.raises(TypeError, match="no parameter search;"):
        # The preset's own.
        bagtrack.Tracker(search="answer")
    with pytest.raises(ValueError, match="parameter particles is 2000; it must be from 1 to 1000"):
        bagtrack.Tracker(particles=2000)
    for value in (1.5, "many", True):
        with pytest.raises(ValueError, match="parameter particles cannot be"):
            bagtrack.Tracker(particles=value)


def test_what_is_no_frame_and_no_box_is_said_and_changes_nothing(clip: Clip) -> None:
    frames = clip.frames()
    tracker = bagtrack.Tracker(seed=SEED)
    for call in (lambda: tracker.update(frames[0]), tracker.save, lambda: tracker.box, lambda: tracker.score):
        with pytest.raises(RuntimeError, match=r"call init\(frame, box\) first"):
            call()
    for box in ((1, 2, 3), "box", (1, 2, 3, None), 5):
        with pytest.raises(ValueError, match="a box is four numbers"):
            tracker.init(frames[0], box)
    with pytest.raises(ValueError, match="the box is too small"):
        tracker.init(frames[0], (10, 10, 2, 20))
    # Two corners, shares of the frame, and corners that may be a box.
    with pytest.raises(ValueError, match="looks like x1,y1,x2,y2.*box=300,200,18,38"):
        tracker.init(frames[0], (300, 200, 318, 238))
    with pytest.raises(ValueError, match="looks like fractions.*box=160,120,64,48"):
        tracker.init(frames[0], (0.5, 0.5, 0.2, 0.2))
    with pytest.warns(UserWarning, match="If it is x1,y1,x2,y2.*box=100,80,140,120"):
        tracker.init(frames[0], (100, 80, 240, 200))
    tracker.init(frames[0], clip.box)
    bad = [
        (frames[1].astype(np.float32), ValueError, "dtype uint8, not float32"),
        (np.zeros((4, 4, 4), np.uint8), ValueError, r"not \(4, 4, 4\)"),
        (np.zeros(100, np.uint8), ValueError, r"not \(100\)"),
        (np.zeros((0, 10), np.uint8), ValueError, "0 pixels do not make a frame"),
        (frames[1][:-1], ValueError, "the frame is 320 x 239, the session's frames are 320 x 240"),
        ("frame.png", TypeError, "a frame is a NumPy array, not str"),
        (None, TypeError, "a frame is a NumPy array, not NoneType"),
    ]
    for frame, error, words in bad:
        with pytest.raises(error, match=words):
            tracker.update(frame)
    with pytest.raises(ValueError, match="the box is outside the frame"):
        tracker.retarget(frames[1], (5000, 5000, 40, 40))
    with pytest.raises(ValueError, match="looks like x1,y1,x2,y2"):
        tracker.retarget(frames[1], (300, 200, 318, 238))
    with pytest.raises(ValueError, match="the snapshot"):
        bagtrack.Tracker.load(b"no snapshot")
    assert [tracker.update(frame)[1] for frame in frames[1:6]] == clip.boxes()[1:6]


def test_other_threads_run_while_a_step_is_taken(clip: Clip) -> None:
    """The interpreter takes the lock from no thread here, so the other one runs only where a step gives it up."""
    frames = clip.frames()
    tracker = bagtrack.Tracker(seed=SEED, particles=1000)
    tracker.init(frames[0], clip.box)
    calls: queue.SimpleQueue = queue.SimpleQueue()
    heard = []
    thread = threading.Thread(target=lambda: [heard.append(call) for call in iter(calls.get, None)])
    meanwhile = 0
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        thread.start()
        for number, frame in enumerate(frames[1:]):
            calls.put(number)
            before = len(heard)
            tracker.update(frame)
            meanwhile += len(heard) > before
        calls.put(None)
        thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert len(heard) == len(frames) - 1
    assert meanwhile > 0


def test_two_threads_may_use_one_tracker(clip: Clip) -> None:
    frames = clip.frames()
    tracker = bagtrack.Tracker(seed=SEED)
    tracker.init(frames[0], clip.box)
    threads = [threading.Thread(target=lambda: [tracker.update(frames[1]) for _ in range(20)]) for _ in range(2)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        assert len(tracker.box) == 4
    assert tracker.frame == 40

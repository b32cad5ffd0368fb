"""The adapter for CVAT, in the code that CVAT's own agent runs it with."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("cvat_sdk", reason="the package cvat-sdk cannot be had", exc_type=ImportError)
pytest.importorskip("cvat_cli", reason="the package cvat-cli cannot be had", exc_type=ImportError)

import cvat_sdk.auto_annotation as cvataa  # noqa: E402
from cvat_cli._internal import agent_driver_tracking  # noqa: E402
from cvat_cli._internal.common import FunctionLoader  # noqa: E402

import bagtrack  # noqa: E402
from conftest import SEED, Clip, clock  # noqa: E402


def corners(box: tuple) -> list[float]:
    x, y, width, height = box
    return [x, y, x + width, y + height]


@pytest.fixture
def agent(monkeypatch: pytest.MonkeyPatch):
    """The part of the agent that holds the function and its states, in this process."""
    loader = FunctionLoader("bagtrack.adapters.cvat", None, {"seed": SEED})
    function = loader.load()
    monkeypatch.setattr(agent_driver_tracking, "worker_current_function", lambda: function)
    numbers = itertools.count()
    agent_driver_tracking.AgentTrackingFunctionDriver.init_worker(lambda: f"state {next(numbers)}")
    assert agent_driver_tracking.AgentTrackingFunctionDriver.get_remote_function_fields(function.spec) == {
        "supported_shape_types": ["rectangle"]
    }
    return agent_driver_tracking


def test_the_agent_gets_the_boxes_of_the_tracker(agent, clip: Clip) -> None:
    images = [Image.open(file) for file in clip.files]
    # Whole numbers: no digit is lost between corners and sides.
    box = tuple(float(round(number)) for number in clip.box)
    tracker = bagtrack.Tracker(seed=SEED)
    tracker.init(clip.frames()[0], box)
    shape = cvataa.TrackableShape(type="rectangle", points=corners(box))
    # From right to left and from the bottom to the top it is the same.
    left, top, right, bottom = corners((150, 60, 50, 40))
    other = cvataa.TrackableShape(type="rectangle", points=[right, bottom, left, top])
    states = agent._worker_job_init_tracking(1, images[0], [shape, other])
    assert len(states) == 2
    found = []
    with clock("cvat-sdk, two shapes of which one is followed", len(images) - 1):
        for image in images[1:]:
            answer, _ = agent._worker_job_track(1, image, states)
            assert answer.type == "rectangle"
            found.append(answer.points)
    assert found == [corners(tracker.update(frame)[1]) for frame in clip.frames()[1:]]


def test_a_lost_shape_has_no_answer(agent, clip: Clip) -> None:
    first = Image.open(clip.files[0]).convert("L")
    shape = cvataa.TrackableShape(type="rectangle", points=corners(clip.box))
    states = agent._worker_job_init_tracking(1, first, [shape])
    noise = np.random.default_rng(1).integers(0, 256, (40, first.size[1], first.size[0]), np.uint8)
    answers = [agent._worker_job_track(1, Image.fromarray(image), states)[0] for image in noise]
    assert answers[-1] is None


def test_parameters_that_cannot_be_used_are_said_at_the_start() -> None:
    with pytest.raises(ValueError, match="robust or paper"):
        FunctionLoader("bagtrack.adapters.cvat", None, {"preset": "fast"}).load()

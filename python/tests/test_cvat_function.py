"""The function that CVAT calls through Nuclio, with Nuclio's own types and a service."""

from __future__ import annotations

import base64
import importlib.util
import json
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("nuclio_sdk", reason="the package nuclio-sdk cannot be had", exc_type=ImportError)

import nuclio_sdk  # noqa: E402
from conftest import ROOT, SEED, Clip, Server, clock  # noqa: E402


def load():
    spec = importlib.util.spec_from_file_location("function", ROOT / "docker/cvat/main.py")
    function = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(function)
    return function.handler


class Caller:
    """As CVAT calls a function of Nuclio: JSON, which Nuclio has parsed."""

    def __init__(self) -> None:
        self._handler = load()
        self._context = nuclio_sdk.Context(nuclio_sdk.Logger(level=50))

    def __call__(self, file: Path, shapes: list, states: list) -> nuclio_sdk.Response:
        image = base64.b64encode(file.read_bytes()).decode()
        body = {"image": image, "shapes": shapes, "states": states}
        event = nuclio_sdk.Event(body=body, content_type="application/json", method="POST")
        return self._handler(self._context, event)


def corners(box: tuple) -> list[float]:
    x, y, width, height = box
    return [x, y, x + width, y + height]


def test_shapes_get_the_boxes_of_the_library(
    clip: Clip, start_server: Callable[..., Server], monkeypatch: pytest.MonkeyPatch
) -> None:
    server = start_server()
    monkeypatch.setenv("BAGTRACK_URL", server.url)
    monkeypatch.setenv("BAGTRACK_QUERY", f"seed={SEED}")
    call = Caller()
    # CVAT begins with shapes and no states, and goes on with states and as many nulls.
    first = call(clip.files[0], [corners(clip.box), corners(clip.box)], [])
    assert first.status_code == 200
    states = json.loads(first.body)["states"]
    with clock("nuclio-sdk, two shapes", len(clip.files) - 1):
        for file, expected in zip(clip.files[1:], clip.boxes()[1:]):
            answer = call(file, [None, None], states)
            assert answer.content_type == "application/json"
            answer = json.loads(answer.body)
            for shape in answer["shapes"]:
                # The service rounds corner and size, so a far corner may be off by two halves of a hundredth.
                assert shape == pytest.approx(corners(expected), abs=0.0101)
            # What CVAT signs and sends back is the state as JSON.
            states = json.loads(json.dumps(answer["states"], separators=(",", ":")))


def test_a_refusal_and_a_service_that_is_away_reach_cvat(
    clip: Clip, start_server: Callable[..., Server], monkeypatch: pytest.MonkeyPatch
) -> None:
    server = start_server()
    monkeypatch.setenv("BAGTRACK_URL", server.url)
    call = Caller()
    refused = call(clip.files[0], [[5, 5, 5, 9]], [])
    assert refused.status_code == 422
    assert json.loads(refused.body)["type"] == "/docs/problems#invalid-box"
    server.kill()
    assert call(clip.files[0], [corners(clip.box)], []).status_code == 503

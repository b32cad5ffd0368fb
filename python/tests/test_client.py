"""The clients against the real server: the same boxes as the library's, whatever happens to the line."""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import httpx
import numpy as np
import pytest
from websockets.sync.server import ServerConnection, serve

import bagtrack
from bagtrack.session import Session
from bagtrack.steps import ConnectionLost, Pause, Reply, Request, Run
from bagtrack.stream import Connect, Stream
from bagtrack.transport import Services
from conftest import SEED, Clip, Server, clock, to_hundredths
from lossy_line import LossyLine

StartServer = Callable[..., Server]
DURABLE = ("--shutdown-delay", "60s")


def follow(client: bagtrack.Client, clip: Clip, before: dict[int, Callable[[], object]] | None = None) -> list:
    """The boxes of all frames; `before` has what happens before a frame is sent."""
    bodies = [file.read_bytes() for file in clip.files]
    client.init(bodies[0], clip.box)
    boxes = [client.box]
    with clock("Client.update", len(bodies) - 1):
        for number, body in enumerate(bodies[1:], 1):
            (before or {}).get(number, lambda: None)()
            ok, box = client.update(body)
            assert (ok, box, client.frame) == (client.status != "lost", client.box, number)
            boxes.append(box)
    return boxes


def answer_to(frame: int) -> str:
    """An answer of a stream."""
    box = {"x": 1, "y": 2, "width": 30, "height": 40}
    return json.dumps({"frame": frame, "box": box, "score": 1.0, "status": "tracking"})


UNIT = 1000
"""Bytes of the first frame of `frames_of`."""
OPENED = httpx.MockTransport(
    lambda _: httpx.Response(
        201, json={"id": "x", "frame": 0, "box": dict(x=1, y=2, width=30, height=40), "parameters": {"seed": 7}}
    )
)
"""A service that opens each session."""


def frames_of(count: int) -> list[bytes]:
    """Frames that `scripted` tells by their lengths."""
    return [bytes(UNIT * number) for number in range(1, count + 1)]


@contextmanager
def scripted(scripts: list[list[str | int]]) -> Iterator[str]:
    """A service whose streams say these texts, and wait for the frames of these numbers between. All but the last one
    break then."""

    def say(line: ServerConnection) -> None:
        for step in scripts.pop(0):
            if isinstance(step, str):
                line.send(step)
                continue
            while not isinstance(body := line.recv(), bytes):
                pass
            assert len(body) == UNIT * step
        if not scripts:
            list(line)

    with serve(say, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.socket.getsockname()[1]}"


def test_a_hundred_frames_get_the_librarys_answers(start_server: StartServer, clip: Clip) -> None:
    with bagtrack.Client(start_server().url, seed=SEED) as client:
        assert follow(client, clip) == clip.answered()
        last = clip.expected[-1]
        assert (client.score, client.status, client.frame) == (round(last["score"], 3), last["status"], last["frame"])
        assert client.params["seed"] == SEED


def test_arrays_are_sent_without_loss_as_png_and_with_some_as_jpeg(start_server: StartServer, clip: Clip) -> None:
    url = start_server().url
    frames = clip.frames()[:20]
    boxes = {}
    for encoding in ("png", "jpeg"):
        with bagtrack.Client(url, seed=SEED, encoding=encoding) as client:
            client.init(frames[0], clip.box)
            boxes[encoding] = [client.update(frame)[1] for frame in frames[1:]]
    assert boxes["png"] == clip.answered()[1:20]
    difference = np.abs(np.array(boxes["jpeg"]) - np.array(boxes["png"])).max()
    assert 0 < difference < 3


def test_a_killed_server_that_starts_again_goes_on_from_the_snapshot(start_server: StartServer, clip: Clip) -> None:
    server = start_server()

    def kill_and_start_again() -> None:
        server.kill()
        server.start_again()

    with bagtrack.Client(server.url, seed=SEED, snapshot_every=20) as client:
        # Once with only the first frame to begin from, once from a snapshot that is some frames old.
        boxes = follow(client, clip, {7: kill_and_start_again, 55: kill_and_start_again})
    assert boxes == clip.answered()


def test_a_seed_that_the_service_drew_is_kept_when_it_is_killed(start_server: StartServer, clip: Clip) -> None:
    server = start_server()

    def kill_and_start_again() -> None:
        server.kill()
        server.start_again()

    with bagtrack.Client(server.url) as client:
        boxes = follow(client, clip, {7: kill_and_start_again})
        tracker = bagtrack.Tracker(seed=client.params["seed"])
    frames = clip.frames()
    tracker.init(frames[0], clip.box)
    assert boxes[1:] == [to_hundredths(tracker.update(frame)[1]) for frame in frames[1:]]


def test_a_frame_whose_answer_was_lost_is_not_tracked_twice(start_server: StartServer, clip: Clip) -> None:
    """The line breaks after the service has answered, before the answer has come."""
    with LossyLine(start_server().port, loses={5, 6, 40}) as line:
        with bagtrack.Client(line.url, seed=SEED) as client:
            assert follow(client, clip) == clip.answered()
        assert line.lost == 3


def test_without_snapshots_a_lost_session_is_said(start_server: StartServer, clip: Clip) -> None:
    server = start_server()
    client = bagtrack.Client(server.url, seed=SEED, snapshot_every=0)
    body = clip.files[0].read_bytes()
    client.init(body, clip.box)
    client.update(body)
    server.kill()
    server.start_again()
    with pytest.raises(bagtrack.ServiceError) as lost:
        client.update(body)
    assert lost.value.kind == "session-not-found"


def test_a_client_goes_to_another_service_when_one_drains(start_server: StartServer, clip: Clip) -> None:
    first, second = start_server(*DURABLE), start_server()
    with bagtrack.Client([first.url, second.url], seed=SEED, snapshot_every=0) as client:
        boxes = follow(client, clip, {30: first.drain, 60: first.kill})
    assert boxes == clip.answered()


def test_a_client_goes_on_at_a_single_service_that_drains_and_starts_again(
    start_server: StartServer, clip: Clip
) -> None:
    server = start_server(*DURABLE)

    def start_again() -> None:
        server.kill()
        server.start_again()

    with bagtrack.Client(server.url, seed=SEED, snapshot_every=50) as client:
        boxes = follow(client, clip, {30: server.drain, 40: start_again})
    assert boxes == clip.answered()


def test_a_server_that_is_away_for_a_while_is_waited_for_and_then_given_up(
    start_server: StartServer, clip: Clip
) -> None:
    server = start_server()
    bodies = [file.read_bytes() for file in clip.files]
    client = bagtrack.Client(server.url, seed=SEED, retry_for=0.3)
    client.init(bodies[0], clip.box)
    server.kill()
    with pytest.raises(bagtrack.ServiceUnavailable, match="no answer within 0.3 s"):
        client.update(bodies[1])
    server.start_again()
    # The frame without an answer is sent before the next one.
    assert client.update(bodies[2])[1] == clip.answered()[2]
    assert client.frame == 2


def test_an_address_without_its_scheme_is_refused_at_once() -> None:
    with pytest.raises(ValueError, match="'localhost:8080' does not begin with http://"):
        bagtrack.Client(["http://localhost:8080", "localhost:8080"])


@pytest.mark.parametrize("address", ["http://", "http://:8080", "http://localhost:99999", "http://localhost:0"])
@pytest.mark.parametrize("make", [bagtrack.Client, bagtrack.AsyncClient])
def test_an_address_that_names_no_service_is_refused_at_once(make: Callable, address: str) -> None:
    with pytest.raises(ValueError, match=f"the address '{address}' "):
        make(address)


@pytest.mark.parametrize("make", [bagtrack.Client, bagtrack.AsyncClient])
def test_arguments_that_cannot_be_meant_are_told_at_once(make: Callable) -> None:
    url = "http://localhost:8080"
    with pytest.raises(TypeError, match="the API key is a text, not bytes"):
        make(url, b"0123456789abcdef")
    with pytest.raises(TypeError, match="the address of a service is a text, not bytes"):
        make(url.encode())
    for seed in (-1, 2**53, np.int64(-1)):
        with pytest.raises(ValueError, match=f"the seed is a whole number from 0 to {2**53 - 1}, not {seed}"):
            make(url, seed=seed)
    with pytest.raises(TypeError):
        make(url, seed=1.5)
    for retry_for in ("20", float("nan"), -1.0):
        with pytest.raises(ValueError, match="retry_for is a number of seconds from 0 on, not "):
            make(url, retry_for=retry_for)


def test_all_names_can_be_imported_without_the_extra() -> None:
    """It was an `ImportError` for a name that nobody had asked for."""
    code = "import sys\nsys.modules.update(httpx=None)\nfrom bagtrack import *\nprint(Tracker, 'Client' in globals())"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "<class 'bagtrack.Tracker'> False\n"
    exec("from bagtrack import *", names := {})
    assert names["Client"] is bagtrack.Client


@pytest.mark.parametrize("make", [bagtrack.Client, bagtrack.AsyncClient])
def test_a_key_that_no_header_takes_is_refused_at_once_and_not_shown(make: Callable) -> None:
    for key in ("one-secret\nanother-secret", "geheimnis-\u00fc", " \n"):
        with pytest.raises(ValueError, match="the API key ") as refused:
            make("http://localhost:8080", key)
        assert "secret" not in str(refused.value) and "geheimnis" not in str(refused.value)


def test_a_key_may_have_the_line_break_of_its_file(start_server: StartServer, clip: Clip) -> None:
    url = start_server("--api-keys", "me:0123456789abcdef").url
    with bagtrack.Client(url, "0123456789abcdef\n", seed=SEED, retry_for=1.0) as client:
        client.init(clip.files[0].read_bytes(), clip.box)
        assert client.update(clip.files[1].read_bytes())[1] == clip.answered()[1]


def test_a_large_frame_has_longer_to_go_over_a_slow_line(clip: Clip) -> None:
    client = bagtrack.Client("http://localhost:8080", retry_for=0.0, timeout=2.0)
    given = []

    def take(request: httpx.Request) -> httpx.Response:
        given.append(request.extensions["timeout"])
        raise httpx.WriteTimeout("it takes long")

    client._http = httpx.Client(transport=httpx.MockTransport(take))
    for size in (0, 1_000_000):
        with pytest.raises(bagtrack.ServiceUnavailable):
            client.init(bytes(50_000 + size), clip.box)
    assert given == [dict.fromkeys(("connect", "read", "write", "pool"), 3.0 + more) for more in (0, 20)]


@pytest.mark.parametrize("is_async", [False, True], ids=["blocking", "asyncio"])
def test_large_frames_of_a_stream_have_longer_to_go_over_a_slow_line(
    monkeypatch: pytest.MonkeyPatch, is_async: bool
) -> None:
    """After a broken line the stored answers counted as those to the frames that were sent behind them."""
    # What the service says, and the frames that it waits for. Once the line breaks it has frames 2 and 3.
    scripts = [
        ['{"next": 1}', 1, 2, 3, answer_to(1), 4],
        ['{"next": 4}', 4, answer_to(2), 5, answer_to(3), answer_to(4), answer_to(5)],
    ]
    sizes = []

    def longest(timeout: float, size: int) -> float:
        sizes.append(size // UNIT)
        return timeout

    async def follow(url: str) -> list[int]:
        client = bagtrack.AsyncClient(url)
        client._http = httpx.AsyncClient(transport=OPENED)
        await client.init(b"a frame", (1, 2, 30, 40))
        monkeypatch.setattr("bagtrack.transport.longest", longest)
        return [answer.frame async for answer in client.track(frames_of(5), window=3)]

    with scripted(scripts) as url:
        if is_async:
            answered = asyncio.run(follow(url))
        else:
            client = bagtrack.Client(url)
            client._http = httpx.Client(transport=OPENED)
            client.init(b"a frame", (1, 2, 30, 40))
            monkeypatch.setattr("bagtrack.transport.longest", longest)
            answered = [answer.frame for answer in client.track(frames_of(5), window=3)]
    assert answered == [1, 2, 3, 4, 5]
    assert sizes[:4] == [1 + 2 + 3, 2 + 3 + 4, 4, 4 + 5]


@pytest.mark.parametrize("is_async", [False, True], ids=["blocking", "asyncio"])
def test_answers_do_not_wait_for_the_next_frames_of_a_camera(
    start_server: StartServer, clip: Clip, is_async: bool
) -> None:
    """They came `window` frames late, though the service had given them long before."""
    url = start_server().url
    bodies = [file.read_bytes() for file in clip.files[:30]]
    answers, before_the_last = [], []

    def camera(session: str) -> Iterator[bytes]:
        for number, body in enumerate(bodies[1:], 1):
            yield body
            # The next picture comes once the service has tracked this one.
            while httpx.get(f"{url}/sessions/{session}").json()["frames"] <= number:
                pass
        before_the_last.extend(answers)

    async def follow() -> None:
        async with bagtrack.AsyncClient(url, seed=SEED) as client:
            await client.init(bodies[0], clip.box)
            async for answer in client.track(camera(client.id), window=32):
                answers.append(answer.box)

    if is_async:
        asyncio.run(follow())
    else:
        with bagtrack.Client(url, seed=SEED) as client:
            client.init(bodies[0], clip.box)
            answers.extend(answer.box for answer in client.track(camera(client.id), window=32))
    assert answers == clip.answered()[1:30]
    assert before_the_last


@pytest.mark.parametrize("error", [httpx.LocalProtocolError, httpx.UnsupportedProtocol])
def test_what_another_try_would_not_mend_is_told_at_once(error: type[httpx.TransportError], clip: Clip) -> None:
    client = bagtrack.Client("http://localhost:8080", retry_for=1.0)

    def fail(_: httpx.Request) -> httpx.Response:
        raise error("it cannot be sent")

    client._http = httpx.Client(transport=httpx.MockTransport(fail))
    with pytest.raises(error, match="it cannot be sent"):
        client.init(b"a frame", clip.box)


@pytest.mark.parametrize("encoding", ["PNG", "jpg", ""])
@pytest.mark.parametrize("make", [bagtrack.Client, bagtrack.AsyncClient])
def test_an_encoding_that_there_is_not_is_refused(make: Callable, encoding: str) -> None:
    with pytest.raises(ValueError, match=f"encoding is 'jpeg' or 'png', not '{encoding}'"):
        make("http://localhost:8080", encoding=encoding)


def test_refusals_are_told_and_change_nothing(start_server: StartServer, clip: Clip) -> None:
    bodies = [file.read_bytes() for file in clip.files]
    with bagtrack.Client(start_server().url, seed=SEED) as client:
        # A stream asked the service for the session `None`.
        for call in (lambda: client.update(bodies[0]), lambda: list(client.track(bodies)), client.save):
            with pytest.raises(RuntimeError, match=r"call init\(frame, box\) first"):
                call()
        with pytest.raises(bagtrack.ServiceError) as refused:
            client.init(bodies[0], (0, 0, 1, 1))
        assert (refused.value.status, refused.value.kind) == (422, "invalid-box")
        with pytest.raises(ValueError, match="a box is four numbers"):
            client.init(bodies[0], (1, 2, 3))
        client.init(bodies[0], clip.box)
        with pytest.raises(bagtrack.ServiceError, match="cannot be decoded") as refused:
            client.update(bodies[1][:-20])
        assert refused.value.kind == "frame-damaged"
        with pytest.raises(ValueError, match="dtype uint8"):
            client.update(np.zeros((240, 320)))
        assert [client.update(body)[1] for body in bodies[1:5]] == clip.answered()[1:5]
        client.retarget(bodies[5], (100, 80, 40, 30))
        assert client.answer == bagtrack.Answer(5, (100, 80, 40, 30), 1.0, "tracking")


def test_parameters_may_be_numbers_of_numpy(start_server: StartServer, clip: Clip) -> None:
    given = {"particles": np.int64(50), "alpha": np.float32(0.5), "sigma": np.float64(20.5), "seed": np.uint8(3)}
    with bagtrack.Client(start_server().url, **given) as client:
        client.init(clip.files[0].read_bytes(), clip.box)
        params = {"particles": 50, "alpha": 0.5, "sigma": 20.5, "seed": 3}
        assert client.params.items() >= params.items()
    with pytest.raises(TypeError, match="a parameter is a number, a truth value or a text, not ndarray"):
        bagtrack.Client("http://localhost:8080", alpha=np.zeros(2))


def test_a_key_is_sent(start_server: StartServer, clip: Clip, tmp_path) -> None:
    keys = tmp_path / "keys"
    keys.write_text("somebody:a-key-of-sufficient-length-for-tests\n")
    url = start_server("--api-keys-file", str(keys)).url
    body = clip.files[0].read_bytes()
    with pytest.raises(bagtrack.ServiceError) as refused:
        bagtrack.Client(url).init(body, clip.box)
    assert refused.value.kind == "unauthorized"
    with bagtrack.Client(url, "a-key-of-sufficient-length-for-tests", seed=SEED) as client:
        bodies = [file.read_bytes() for file in clip.files[:10]]
        client.init(bodies[0], clip.box)
        assert [answer.box for answer in client.track(bodies[1:])] == clip.answered()[1:10]


def test_a_saved_session_goes_on_elsewhere(start_server: StartServer, clip: Clip) -> None:
    bodies = [file.read_bytes() for file in clip.files]
    with bagtrack.Client(start_server().url, seed=SEED) as client:
        client.init(bodies[0], clip.box)
        for body in bodies[1:30]:
            client.update(body)
        with bagtrack.Client.load(client.save(), start_server().url) as other:
            assert other.answer == client.answer
            assert [other.update(body)[1] for body in bodies[30:40]] == clip.answered()[30:40]


def test_a_stream_gives_the_librarys_answers(start_server: StartServer, clip: Clip) -> None:
    bodies = [file.read_bytes() for file in clip.files]
    for window in (1, 8, 32):
        with bagtrack.Client(start_server().url, seed=SEED, snapshot_every=10) as client:
            client.init(bodies[0], clip.box)
            with clock(f"Client.track, window {window}", 59):
                answers = list(client.track(bodies[1:60], window))
            assert [answer.frame for answer in answers] == list(range(1, 60))
            assert [answer.box for answer in answers] == clip.answered()[1:60]
            # Posts and a second stream go on from there.
            assert client.update(bodies[60])[1] == clip.answered()[60]
            assert [answer.box for answer in client.track(bodies[61:])] == clip.answered()[61:]


@pytest.mark.parametrize("snapshot_every", [5, 20, 1000])
def test_a_stream_survives_a_killed_server(start_server: StartServer, clip: Clip, snapshot_every: int) -> None:
    server = start_server()
    bodies = [file.read_bytes() for file in clip.files]
    with bagtrack.Client(server.url, seed=SEED, snapshot_every=snapshot_every) as client:
        client.init(bodies[0], clip.box)
        boxes = []
        for answer in client.track(bodies[1:]):
            boxes.append(answer.box)
            if answer.frame in (25, 70):
                server.kill()
                server.start_again()
    assert boxes == clip.answered()[1:]


def test_a_stream_opens_a_session_again_that_ends_meanwhile() -> None:
    """The problem that answers the next frame ended it, where a post opens the session again."""
    gone = {"type": "/docs/problems#session-not-found", "status": 404, "detail": "There is no such session."}
    with scripted([['{"next": 1}', 1, json.dumps(gone)], ['{"next": 1}', 1, answer_to(1), 2, answer_to(2)]]) as url:
        client = bagtrack.Client(url)
        client._http = httpx.Client(transport=OPENED)
        client.init(b"a frame", (1, 2, 30, 40))
        assert [answer.frame for answer in client.track(frames_of(2), window=1)] == [1, 2]


def test_a_stream_goes_on_after_a_broken_line_and_tracks_no_frame_twice(
    start_server: StartServer, clip: Clip
) -> None:
    bodies = [file.read_bytes() for file in clip.files]
    with LossyLine(start_server().port, loses=set()) as line:
        with bagtrack.Client(line.url, seed=SEED) as client:
            client.init(bodies[0], clip.box)
            first, boxes = client.id, []
            for answer in client.track(bodies[1:]):
                boxes.append(answer.box)
                if answer.frame in (3, 25, 26, 70):
                    line.cut()
            # The service still had the session: nothing was opened anew.
            assert (boxes, client.id) == (clip.answered()[1:], first)


def test_a_stream_moves_when_the_service_drains(start_server: StartServer, clip: Clip) -> None:
    first, second = start_server(*DURABLE), start_server()
    bodies = [file.read_bytes() for file in clip.files]
    with bagtrack.Client([first.url, second.url], seed=SEED) as client:
        client.init(bodies[0], clip.box)
        boxes = []
        for answer in client.track(bodies[1:]):
            boxes.append(answer.box)
            if answer.frame == 30:
                first.drain()
            if answer.frame == 70:
                first.kill()
    assert boxes == clip.answered()[1:]


def test_a_stream_tells_of_a_bad_frame_and_the_session_goes_on(start_server: StartServer, clip: Clip) -> None:
    bodies = [file.read_bytes() for file in clip.files]
    with bagtrack.Client(start_server().url, seed=SEED) as client:
        client.init(bodies[0], clip.box)
        boxes = []
        with pytest.raises(bagtrack.ServiceError, match="cannot be decoded"):
            for answer in client.track([*bodies[1:10], bodies[10][:-20], *bodies[11:20]]):
                boxes.append(answer.box)
        assert boxes == clip.answered()[1:10]
        assert [answer.box for answer in client.track(bodies[10:20])] == clip.answered()[10:20]


@pytest.mark.parametrize("is_async", [False, True], ids=["blocking", "asyncio"])
def test_a_stream_names_the_frame_that_is_none(start_server: StartServer, clip: Clip, is_async: bool) -> None:
    """With None, as `cv2.imread` gives for a file that it cannot read, a stream ended as after its last frame."""
    bodies = [file.read_bytes() for file in clip.files]
    url = start_server().url
    answers = []

    async def follow() -> None:
        client = bagtrack.AsyncClient(url)
        await client.init(bodies[0], clip.box)
        async for answer in client.track([*bodies[1:20], None, *bodies[20:]]):
            answers.append(answer.frame)

    with bagtrack.Client(url, seed=SEED) as client:
        with pytest.raises(TypeError, match="frame 20 cannot be sent: a frame is a NumPy array.*, not NoneType"):
            if is_async:
                asyncio.run(follow())
            client.init(bodies[0], clip.box)
            answers += [answer.frame for answer in client.track([*bodies[1:20], None, *bodies[20:]])]
        if not is_async:
            # Nothing was lost.
            assert client.update(bodies[20])[1] == clip.answered()[20]
            assert client.frame == 20


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_forked_processes_do_not_share_a_connection(start_server: StartServer, clip: Clip) -> None:
    """They read each other's answers."""
    bodies = [file.read_bytes() for file in clip.files[:40]]
    client = bagtrack.Client(start_server().url, seed=SEED, retry_for=10.0)
    client.init(bodies[0], clip.box)
    context = multiprocessing.get_context("fork")
    answers = context.Queue()

    def follow() -> None:
        try:
            client.init(bodies[0], clip.box)
            answers.put([client.update(body)[1] for body in bodies[1:]])
        except Exception as error:
            answers.put(repr(error))

    processes = [context.Process(target=follow) for _ in range(4)]
    for process in processes:
        process.start()
    assert [answers.get() for _ in processes] == [clip.answered()[1:40]] * 4
    for process in processes:
        process.join()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_process_has_asynchronous_connections_of_its_own(start_server: StartServer, clip: Clip) -> None:
    bodies = [file.read_bytes() for file in clip.files[:3]]
    client = bagtrack.AsyncClient(start_server().url, seed=SEED, retry_for=10.0)
    asyncio.run(client.init(bodies[0], clip.box))
    context = multiprocessing.get_context("fork")
    answers = context.Queue()

    async def follow() -> tuple:
        before = client._http
        await client.init(bodies[0], clip.box)
        boxes = [(await client.update(body))[1] for body in bodies[1:]]
        return client._http is before, boxes

    process = context.Process(target=lambda: answers.put(asyncio.run(follow())))
    process.start()
    assert answers.get(timeout=60) == (False, clip.answered()[1:3])
    process.join()


@pytest.mark.parametrize("window", [0, -1, 33])
def test_a_window_that_a_stream_does_not_have_is_refused(start_server: StartServer, clip: Clip, window: int) -> None:
    body = clip.files[0].read_bytes()

    async def follow() -> None:
        async with bagtrack.AsyncClient(url) as client:
            await client.init(body, clip.box)
            async for _ in client.track([body], window):
                pass

    url = start_server().url
    with bagtrack.Client(url) as client:
        client.init(body, clip.box)
        # Without an answer it waited for ever.
        with pytest.raises(ValueError, match=f"window is from 1 to 32, not {window}"):
            next(client.track([body], window))
    with pytest.raises(ValueError, match=f"window is from 1 to 32, not {window}"):
        asyncio.run(follow())


def test_a_stream_ends_with_the_time_for_retries(monkeypatch: pytest.MonkeyPatch) -> None:
    """A silent service was tried for minutes, and one that loses the session each time without end and without pause."""
    now = 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    opened = {"id": "x", "frame": 0, "box": dict(x=1, y=2, width=30, height=40), "parameters": {"seed": 7}}
    gone = {"type": "/docs/problems#session-not-found"}

    def follow(lost: ConnectionLost, takes: float, retry_for: float) -> list[str]:
        """The steps of a session whose streams are lost after so many seconds."""
        nonlocal now
        session, steps = Session(30, retry_for), []
        run = Run(session.open({}, b"a frame", "image/jpeg"))
        run.next()
        run.next(Reply(201, {}, b"", opened))
        run = Run(Stream(session, 8).run())
        step = run.next()
        with pytest.raises(bagtrack.ServiceError if lost.status else bagtrack.ServiceUnavailable):
            while step is not None:
                steps.append(type(step).__name__)
                result = Reply(201, {}, b"", opened) if isinstance(step, Request) else None
                if isinstance(step, Connect):
                    now += takes
                    result = lost
                if isinstance(step, Pause):
                    now += step.seconds
                step = run.next(result)
        return steps

    assert follow(ConnectionLost("timed out"), 15.0, 60.0).count("Connect") == 5
    once = ["Connect", "Disconnect", "Request", "Connect", "Disconnect"]
    assert follow(ConnectionLost("gone", 404, gone), 0.0, 0.0) == once
    again = follow(ConnectionLost("gone", 404, gone), 0.0, 1.0)
    assert again[:6] == [*once, "Pause"] and again.count("Request") == 3


def test_a_client_that_is_used_otherwise_within_a_stream_says_so(start_server: StartServer, clip: Clip) -> None:
    bodies = [file.read_bytes() for file in clip.files]
    with bagtrack.Client(start_server().url, seed=SEED) as client:
        client.init(bodies[0], clip.box)
        answers = []
        # It ended after the first answer, as if there were no more frames.
        with pytest.raises(RuntimeError, match="leave its loop first"):
            for answer in client.track(bodies[1:5]):
                answers.append(answer.frame)
                client.update(bodies[5])
        assert answers == [1]
        client.init(bodies[0], clip.box)
        assert [answer.box for answer in client.track(bodies[1:10])] == clip.answered()[1:10]


@pytest.mark.parametrize("is_async", [False, True], ids=["blocking", "asyncio"])
def test_two_streams_at_once_are_refused(start_server: StartServer, clip: Clip, is_async: bool) -> None:
    """The second sent the frames of the first again, and gave their answers as its own."""
    bodies = [file.read_bytes() for file in clip.files[:20]]
    url, told = start_server().url, "another `track` of this client goes on: leave its loop first"

    async def boxes(client: bagtrack.AsyncClient) -> list:
        return [answer.box async for answer in client.track(bodies[1:])]

    async def follow() -> list:
        async with bagtrack.AsyncClient(url, seed=SEED) as client:
            await client.init(bodies[0], clip.box)
            first, second = await asyncio.gather(boxes(client), boxes(client), return_exceptions=True)
            assert isinstance(second, RuntimeError) and told in str(second)
            assert first == clip.answered()[1:20]
            await client.init(bodies[0], clip.box)
            async for _ in client.track(bodies[1:3], window=1):
                break
            # A loop that was left is none, though asyncio has not ended it yet.
            return [answer.box async for answer in client.track(bodies[2:])]

    if is_async:
        assert asyncio.run(follow()) == clip.answered()[2:20]
        return
    with bagtrack.Client(url, seed=SEED) as client:
        client.init(bodies[0], clip.box)
        stream = client.track(bodies[1:10])
        found = [next(stream).box]
        with pytest.raises(RuntimeError, match=told):
            next(client.track(bodies[10:]))
        found += [answer.box for answer in stream]
        found += [answer.box for answer in client.track(bodies[10:])]
        assert found == clip.answered()[1:20]


@pytest.mark.parametrize("messages", [['{"ok": true}'], ['{"next": 1}', '{"ok": true}']], ids=["hello", "answer"])
@pytest.mark.parametrize("is_async", [False, True], ids=["blocking", "asyncio"])
def test_what_is_no_answer_in_a_stream_is_told(
    start_server: StartServer, clip: Clip, messages: list[str], is_async: bool
) -> None:
    """It was a bare `KeyError`."""

    def say(line: ServerConnection) -> None:
        for message in messages:
            line.send(message)
        list(line)

    body = clip.files[0].read_bytes()
    told = r"the stream sent what is no answer of bagtrack: '\{\"ok\": true\}'"

    async def follow() -> None:
        client = bagtrack.AsyncClient(url)
        await client.init(body, clip.box)
        client._services = other
        async for _ in client.track([body]):
            pass

    url = start_server().url
    with serve(say, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        other = Services(f"http://127.0.0.1:{server.socket.getsockname()[1]}")
        with pytest.raises(bagtrack.ServiceError, match=told) as refused:
            if is_async:
                asyncio.run(follow())
            client = bagtrack.Client(url)
            client.init(body, clip.box)
            client._services = other
            list(client.track([body]))
        assert refused.value.status == 101


def test_a_stream_without_its_package_names_it(
    start_server: StartServer, clip: Clip, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = clip.files[0].read_bytes()
    with bagtrack.Client(start_server().url) as client:
        client.init(body, clip.box)
        monkeypatch.setitem(sys.modules, "websockets", None)
        for name in [name for name in sys.modules if name == "bagtrack.sockets" or name.startswith("websockets.")]:
            monkeypatch.delitem(sys.modules, name)
        with pytest.raises(ImportError, match=r"track needs websockets.*: pip install 'bagtrack\[stream\]'"):
            next(client.track([body]))
        assert client.frame == 0


def test_a_stream_goes_on_after_many_calls_without_an_answer(start_server: StartServer, clip: Clip) -> None:
    """The service no longer had the answer to the first of them, and the stream ended with 409."""
    bodies = [file.read_bytes() for file in clip.files]
    # Each call sends the frame before its own again first, whose answer comes.
    with LossyLine(start_server().port, loses=set(range(2, 81, 2))) as line:
        client = bagtrack.Client(line.url, seed=SEED, retry_for=0.0)
        client.init(bodies[0], clip.box)
        for body in bodies[1:41]:
            with pytest.raises(bagtrack.ServiceUnavailable):
                client.update(body)
        assert (line.lost, client.frame) == (40, 0)
        answers = list(client.track(bodies[41:60]))
        assert answers[-1].frame == 59
        assert [answer.box for answer in answers] == [clip.answered()[answer.frame] for answer in answers]


def test_frames_on_their_way_count_when_a_stream_is_left(start_server: StartServer, clip: Clip) -> None:
    bodies = [file.read_bytes() for file in clip.files]
    with bagtrack.Client(start_server().url, seed=SEED) as client:
        client.init(bodies[0], clip.box)
        frames = enumerate(bodies[1:], 1)
        stream = client.track(body for _, body in frames)
        assert next(stream).frame == 1
        stream.close()
        number, body = next(frames)
        assert number > 2
        assert (client.update(body)[1], client.frame) == (clip.answered()[number], number)


def test_the_asynchronous_client_does_the_same(start_server: StartServer, clip: Clip) -> None:
    first, second = start_server(), start_server()
    bodies = [file.read_bytes() for file in clip.files]

    async def follow_one() -> list:
        async with bagtrack.AsyncClient([first.url, second.url], seed=SEED, snapshot_every=20) as client:
            await client.init(bodies[0], clip.box)
            boxes = [client.box]
            for body in bodies[1:40]:
                boxes.append((await client.update(body))[1])
            if first.process.poll() is None:
                first.kill()
            async for answer in client.track(bodies[40:70]):
                boxes.append(answer.box)
            other = await bagtrack.AsyncClient.load(await client.save(), second.url)
            async with other:
                for body in bodies[70:]:
                    boxes.append((await other.update(body))[1])
            return boxes

    async def follow_two() -> list:
        return await asyncio.gather(follow_one(), follow_one())

    assert asyncio.run(follow_two()) == [clip.answered()] * 2

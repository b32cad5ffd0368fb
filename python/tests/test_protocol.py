"""The clients do what docs/PROTOCOL.md says: the exchanges of tests/protocol/exchanges.json."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator

import pytest

import bagtrack
from scripted_service import TABLE, ScriptedService


@pytest.fixture
def service() -> Iterator[ScriptedService]:
    service = ScriptedService()
    yield service
    service.close()


def call(client: bagtrack.Client | bagtrack.AsyncClient, wait: Callable, what: dict) -> dict | None:
    """Makes a call; what it gives, in the words of the table."""
    try:
        match what:
            case {"open": frame}:
                wait(client.init(frame.encode(), TABLE["box"]))
            case {"track": frame}:
                ok, box = wait(client.update(frame.encode()))
                assert ok and (client.frame, client.box) == (box[0], box)
                return {"frame": client.frame}
            case {"correct": frame, "box": box}:
                wait(client.retarget(frame.encode(), box))
                return {"frame": client.frame}
            case {"snapshot": True}:
                return {"snapshot": wait(client.save()).decode()}
            case {"end": True}:
                wait(client.close())
            case _:
                raise AssertionError(f"the table has an unknown call: {what}")
    except bagtrack.ServiceError as error:
        return {"refused": error.status, "kind": error.kind}
    except bagtrack.ServiceUnavailable:
        return {"unavailable": True}
    return None


@pytest.mark.parametrize("is_async", [False, True], ids=["blocking", "asyncio"])
@pytest.mark.parametrize("scenario", TABLE["scenarios"], ids=lambda scenario: scenario["name"])
def test_exchanges(service: ScriptedService, scenario: dict, is_async: bool) -> None:
    loop = asyncio.new_event_loop()
    wait = loop.run_until_complete if is_async else lambda value: value
    make = bagtrack.AsyncClient if is_async else bagtrack.Client
    client = make(service.url, **scenario.get("client", {}))
    for step in scenario["steps"]:
        service.expect(step["exchanges"])
        given = call(client, wait, step["call"])
        service.check()
        assert given == step.get("gives"), step["call"]
    loop.close()


@pytest.mark.parametrize("document", [["no"], "no", 7, None])
def test_a_refusal_in_json_that_is_no_object_is_told(service: ScriptedService, document: object) -> None:
    service.expect([{"request": "PUT /sessions/{1}", "frame": "a", "reply": {"status": 400, "json": document}}])
    with pytest.raises(bagtrack.ServiceError, match="the service answered 400") as refused:
        bagtrack.Client(service.url).init(b"a", TABLE["box"])
    assert (refused.value.status, refused.value.problem) == (400, {})
    service.check()


def test_a_client_that_could_not_move_goes_on_at_the_address_that_it_came_from(service: ScriptedService) -> None:
    other = ScriptedService()
    client = bagtrack.Client([service.url, other.url])
    answer = {"status": 200, "answer": 1, "headers": {"Draining": "true"}}
    service.expect(
        [
            {"request": "PUT /sessions/{1}", "frame": "a", "reply": {"status": 201, "created": 0}},
            {"request": "POST /sessions/{1}/frames?frame=1", "frame": "b", "reply": answer},
            {"request": "GET /sessions/{1}/snapshot", "reply": {"status": 200, "snapshot": "S1"}},
            {"request": "POST /sessions/{1}/frames?frame=2", "frame": "c", "reply": {"status": 200, "answer": 2}},
        ]
    )
    other.expect([{"request": "PUT /sessions/{2}", "snapshot": "S1", "reply": {"status": 503, "text": ""}}])
    client.init(b"a", TABLE["box"])
    assert [client.update(frame)[1][0] for frame in (b"b", b"c")] == [1, 2]
    service.check()
    other.check()
    other.close()


PAGE = {"status": 200, "text": "<html>Please log in</html>"}
NO_ANSWERS = [PAGE, {"status": 200, "json": {"ok": True}}, {"status": 200, "json": []}]
OPENED = {"request": "PUT /sessions/{1}", "frame": "a", "reply": {"status": 201, "created": 0}}


def posted(number: int, frame: str, reply: dict) -> dict:
    return {"request": f"POST /sessions/{{1}}/frames?frame={number}", "frame": frame, "reply": reply}


@pytest.mark.parametrize("is_async", [False, True], ids=["blocking", "asyncio"])
@pytest.mark.parametrize("reply", NO_ANSWERS, ids=["page", "other-json", "list"])
def test_what_is_no_answer_of_the_service_is_told_with_its_address(
    service: ScriptedService, reply: dict, is_async: bool
) -> None:
    loop = asyncio.new_event_loop()
    wait = loop.run_until_complete if is_async else lambda value: value
    client = (bagtrack.AsyncClient if is_async else bagtrack.Client)(service.url)
    told = rf"^{service.url}/sessions/.* answered 200 with what is no answer of bagtrack \("
    service.expect([{"request": "PUT /sessions/{1}", "frame": "a", "reply": reply}])
    with pytest.raises(bagtrack.ServiceError, match=told) as refused:
        wait(client.init(b"a", TABLE["box"]))
    assert (refused.value.status, refused.value.kind, client.id) == (200, "", None)
    assert "preset" not in str(refused.value), "the query is long"
    if "text" in reply:
        assert str(refused.value).endswith("(text/html): '<html>Please log in</html>'")
    service.check()
    loop.close()


@pytest.mark.parametrize("reply", NO_ANSWERS, ids=["page", "other-json", "list"])
def test_a_session_goes_on_after_what_is_no_answer_of_the_service(service: ScriptedService, reply: dict) -> None:
    client = bagtrack.Client(service.url, snapshot_every=1)
    told = "with what is no answer of bagtrack"
    snapshot = "GET /sessions/{1}/snapshot"
    lost = {"status": 409, "problem": {"type": "/docs/problems#frame-out-of-order", "expected_frame": 1}}
    service.expect(
        [
            OPENED,
            posted(1, "b", reply),
            posted(1, "c", {"status": 200, "answer": 1}),
            # The first frame stays what opens the session again.
            {"request": snapshot, "reply": reply},
            posted(2, "d", lost),
            # Nor is a frame that is sent again taken for one that has arrived.
            posted(1, "c", reply),
            posted(1, "c", {"status": 200, "answer": 1}),
            posted(2, "e", {"status": 200, "answer": 2}),
            {"request": snapshot, "reply": reply},
            {"request": snapshot, "reply": reply},
        ]
    )
    client.init(b"a", TABLE["box"])
    with pytest.raises(bagtrack.ServiceError, match=told):
        client.update(b"b")
    client.update(b"c")
    assert client.frame == 1
    with pytest.raises(bagtrack.ServiceError, match=told):
        client.update(b"d")
    client.update(b"e")
    assert client.frame == 2
    with pytest.raises(bagtrack.ServiceError, match=told):
        client.save()
    service.check()


def test_a_redirection_is_told_with_where_it_leads(service: ScriptedService) -> None:
    headers = {"Location": "https://login.example/?next=bagtrack"}
    service.expect([{"request": "PUT /sessions/{1}", "frame": "a", "reply": {"status": 302, "text": "", "headers": headers}}])
    with pytest.raises(bagtrack.ServiceError, match="answered 302 .*which leads to https://login.example/") as refused:
        bagtrack.Client(service.url.replace("//", "//me:secret@")).init(b"a", TABLE["box"])
    assert "secret" not in str(refused.value)
    service.check()

"""Runs that are stopped, and services that were: what was tracked is shown, corrected, and goes on."""

import pathlib
import re

from browser import (
    choose,
    drag,
    drawn_frames,
    frames,
    held,
    held_file,
    is_held,
    kept_rows,
    near,
    numbers,
    rows,
    said,
    say_nothing,
    slow,
    to_the_end,
    was_said,
)
from clips import FRAMES, H264
from files import check_distance, choose_file, sent_box
from service import Service
from studio import to_frame, values

OFF = [30, 200, 80, 60]


def stopped_with_the_service(checks):
    """Frames on their way when a run is stopped are no failure: it can be corrected."""
    page = checks.page()
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 40)
    page.locator("#stop").click()
    said(page, "Stopped")
    page.wait_for_timeout(1000)
    assert page.locator("#message.bad").count() == 0, page.locator("#message").inner_text()
    said(page, "Stopped")
    before = rows(page)
    to_frame(page, 20)
    drag(page, OFF)
    said(page, "Followed anew from frame 20")
    after = rows(page)
    assert len(after) == len(before) and values(after[:20]) == values(before[:20])
    page.context.close()


def service_with_other_keys(checks):
    """The service takes no states of before its restart: a page that is loaded anew goes on from the last box."""
    service = Service(checks.program)
    page = checks.page(url=service.url, allowed=("422", "404", "WebSocket", "ERR_CONNECTION", "Failed to load"))
    truth = checks.clips["card"]["truth"]
    choose(page, "card")
    drag(page, truth[0])
    frames(page, 70)
    page.locator("#pause").click()
    before = kept_rows(page)
    service.stop()
    service = Service(checks.program, port=service.port)
    page.reload()
    said(page, "card is here again")
    page.locator("#pause").click()
    was_said(page, "It goes on from the last box")
    to_the_end(page)
    table = rows(page)
    assert len(table) == 150 and values(table[: len(before)]) == values(before)
    to_frame(page, 50)
    drag(page, OFF)
    said(page, "Followed anew from frame 50")
    assert abs(numbers(rows(page)[50])[0] - OFF[0]) <= 1
    page.context.close()
    service.stop()


def asked_for_a_key_later(checks):
    """A service is started again with keys: once the page has one, what that had stopped goes on where it stood."""
    service = Service(checks.program)
    page = checks.page(url=service.url, allowed=("401", "422", "404", "WebSocket", "ERR_CONNECTION", "Failed to load"))
    truth = checks.clips["card"]["truth"]
    choose(page, "card")
    drag(page, truth[0])
    frames(page, 20)
    page.locator("#pause").click()
    before = kept_rows(page)
    for key, asks in (("0123456789abcdef", "asks for an API key"), ("fedcba9876543210", "does not know this key")):
        service.stop()
        service = Service(checks.program, port=service.port, BAGTRACK_API_KEYS=f"page:{key}")
        if len(before) == len(truth):
            to_frame(page, 20)
            drag(page, OFF)
        said(page, asks)
        page.locator("#key").fill(key)
        page.keyboard.press("Enter")
        if len(before) < len(truth):
            to_the_end(page)
            table = rows(page)
            assert values(table[: len(before)]) == values(before) and len(table) == len(truth), len(table)
            before = table
    said(page, "Followed anew from frame 20")
    assert abs(numbers(rows(page)[20])[0] - OFF[0]) <= 1
    page.context.close()
    service.stop()


def gone_on_after_a_stop(checks):
    """A stopped run goes on where it was, of a file and of a clip, also after the page was loaded anew."""
    for where, name in (("there", "file"), ("here", "card"), ("here", "again")):
        page = checks.page(where=where)
        if name == "card":
            choose(page, "card")
            drag(page, checks.clips["card"]["truth"][0])
        else:
            rest = held_file(page, FRAMES // 2)
            choose_file(page, checks.files.file("clip.mp4", 30, H264))
            drag(page, sent_box(checks.files.truth[0]))
        frames(page, 30)
        page.locator("#stop").click()
        said(page, "or go on")
        if name != "card":
            rest()
        before = kept_rows(page)
        if name == "again":
            page.reload()
            said(page, "clip.mp4 is here again")
        page.locator("#pause" if name == "again" else "#resume").click()
        to_the_end(page)
        table = rows(page)
        count = 150 if name == "card" else FRAMES
        assert [int(row["frame"]) for row in table] == list(range(count)), (where, name)
        assert values(table[: len(before)]) == values(before), (where, name)
        if name != "card":
            check_distance(pathlib.Path("clip.mp4"), table, checks.files.truth)
        assert page.locator("#resume").is_hidden()
        page.context.close()


def drawn_as_it_goes_on(checks):
    """A box that is drawn while the file of a stopped run is opened again is followed first. Then the run goes on."""
    for where in ("here", "there"):
        page = checks.page(where=where)
        choose_file(page, checks.files.file("clip.mp4", 30, H264))
        # The source waits there, so it cannot have ended when the test stops it.
        rest = held_file(page, FRAMES // 2)
        drag(page, sent_box(checks.files.truth[0]))
        frames(page, 20)
        page.locator("#stop").click()
        said(page, "or go on")
        rest()
        before = kept_rows(page)
        last = len(before) - 1
        file, picture = held_file(page, 0), held(page, 0)
        page.locator("#resume").click()
        drag(page, sent_box(checks.files.truth[last]))
        page.locator("#cancel").wait_for()
        file()
        # Long enough for the source to open, and for a run that did not wait for the cancelled work to go on.
        page.wait_for_timeout(1000)
        picture()
        to_the_end(page)
        table = rows(page)
        assert [int(row["frame"]) for row in table] == list(range(FRAMES)), where
        assert drawn_frames(page) == [0, last], where
        assert values(table[:last]) == values(before[:last]), where
        check_distance(pathlib.Path("clip.mp4"), table, checks.files.truth)
        page.context.close()


def stopped_after_a_reload(checks):
    """A run that is stopped after the page was loaded anew goes on all the same."""
    page = checks.page(where="here")
    hurry = slow(page)
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    drag(page, sent_box(checks.files.truth[0]))
    frames(page, 20)
    page.locator("#pause").click()
    kept_rows(page)
    hurry()
    page.reload()
    said(page, "clip.mp4 is here again")
    page.locator("#stop").click()
    said(page, "or go on")
    page.locator("#resume").click()
    to_the_end(page)
    assert [int(row["frame"]) for row in rows(page)] == list(range(FRAMES))
    page.context.close()


def failed_after_it_was_left(checks):
    """A run whose session fails once another one has taken its place leaves that alone."""
    page = checks.page(allowed=("500",))
    held = []
    opening = "**/sessions/*?*box=*"
    page.route(opening, lambda route: held.append(route))
    choose(page, "leaves")
    with page.expect_request(opening):
        drag(page, checks.clips["leaves"]["truth"][0])
    page.locator("#here").evaluate("button => button.click()")
    page.locator("#sources summary").click()
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    page.locator("#pause").click()
    with page.expect_response(opening):
        held[0].fulfill(status=500, content_type="application/problem+json", body='{"status": 500}')
    page.locator("#pause").click()
    to_the_end(page)
    assert page.locator("#message.bad").count() == 0
    page.context.close()


PROBLEM = {"status": 500, "content_type": "application/problem+json", "body": '{"status": 500}'}


def no_session_is_left(checks):
    """Where a run is stopped or fails while its sessions are opened, the service keeps none of them."""
    service = Service(checks.program)
    page = checks.page(url=service.url, allowed=("500",))
    truth = checks.clips["card"]["truth"]
    held = []
    opening = "**/sessions/*?*box=*"
    page.route(opening, lambda route: held.append(route))
    choose(page, "card")
    with page.expect_request(opening):
        drag(page, truth[0])
    page.locator("#stop").click()
    with page.expect_response(opening):
        held[0].continue_()
    service.wait_for_no_session()
    page.unroute(opening)
    page.locator("#resume").click()
    frames(page, 40)
    page.locator("#pause").click()
    page.locator("#add").click()
    drag(page, OFF)
    page.locator("#list li:nth-child(2)").wait_for()
    page.locator("#stop").click()
    service.wait_for_no_session()
    opened = []

    def answer(route):
        """The first object is followed again, the second is not."""
        if route.request.method == "PUT":
            opened.append(route.request.url)
        if len(opened) > 1 and route.request.method == "PUT":
            route.fulfill(**PROBLEM)
        else:
            route.continue_()

    page.route(re.compile(r"/sessions/[^/]+$"), answer)
    page.locator("#resume").click()
    page.locator("#message.bad").wait_for()
    assert len(opened) == 2, opened
    service.wait_for_no_session()
    page.context.close()
    service.stop()


def corrections_leave_no_session(checks):
    """A correction in a frame before the first state that is kept, and what undoes it: no session is left of either."""
    service = Service(checks.program, "--session-first", "10m")
    page = checks.page(url=service.url)
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 40)
    page.locator("#stop").click()
    kept_rows(page)
    to_frame(page, 10)
    drag(page, OFF)
    said(page, "Followed anew from frame 10")
    service.wait_for_no_session()
    page.locator("#undo").click()
    said(page, "is undone")
    service.wait_for_no_session()
    page.context.close()
    service.stop()


def deleted_as_it_goes_on(checks):
    """Objects are deleted while a stopped run is gone on with: the one at work and one whose turn has not come. The one
    between them is followed on, and no session is left."""
    for where in ("here", "there"):
        service = Service(checks.program, "--session-first", "10m")
        page = checks.page(url=service.url, where=where)
        choose(page, "card")
        drag(page, OFF)
        frames(page, 40)
        page.locator("#pause").click()
        for at, box in enumerate((checks.clips["card"]["truth"][len(kept_rows(page)) - 1], [400, 200, 60, 60])):
            page.locator("#add").click()
            drag(page, box)
            page.locator(f"#list li:nth-child({at + 2})").wait_for()
        page.locator("#stop").click()
        kept_rows(page)
        # Opening the clip again reads two pictures.
        release = held(page, 2)
        page.locator("#resume").click()
        is_held(page)
        for name in ("Object 1", "Object 3"):
            page.get_by_role("button", name=f"Delete {name}").click()
        release()
        to_the_end(page)
        table = rows(page)
        assert {row["target"] for row in table} == {"1"}, where
        assert [int(row["frame"]) for row in table] == list(range(150 - len(table), 150)), where
        if where == "there":
            service.wait_for_no_session()
        page.context.close()
        service.stop()


def stopped_before_the_first_box(checks):
    """A run is stopped while its first box is on its way: it goes on once that is followed, or another one is drawn."""
    refused = {"status": 422, "content_type": "application/problem+json", "body": '{"status": 422}'}
    for answer in ({}, refused):
        page = checks.page(allowed=("422",))
        truth = checks.clips["card"]["truth"]
        held = []
        opening = "**/sessions/*?*box=*"
        page.route(opening, lambda route: route.continue_() if held else held.append(route))
        choose(page, "card")
        with page.expect_request(opening):
            drag(page, truth[0])
        page.locator("#stop").click()
        said(page, "or go on")
        if not answer:
            page.locator("#resume").click()
            said(page, "Beginning")
        if answer:
            held[0].fulfill(**answer)
            page.locator("#message.bad").wait_for()
            drag(page, truth[0])
        else:
            held[0].continue_()
        to_the_end(page)
        assert len(rows(page)) == len(truth), len(rows(page))
        page.context.close()


def offline(checks):
    """A machine that has lost its network is told of it at once, and goes on when it has one again. The socket tells
    nothing for a minute."""
    page = checks.page(allowed=("ERR_INTERNET_DISCONNECTED", "WebSocket"))
    page.set_default_timeout(30_000)
    hurry = slow(page)
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    drag(page, sent_box(checks.files.truth[0]))
    frames(page, 10)
    page.context.set_offline(True)
    page.locator("#message.bad").filter(has_text="The line is broken").wait_for()
    page.context.set_offline(False)
    hurry()
    to_the_end(page)
    assert [int(row["frame"]) for row in rows(page)] == list(range(FRAMES))
    page.context.close()


def sample_broken_off(checks):
    """A sample whose frames do not come any more, as when the service has gone, goes on when they do; until then the
    page says that one may try again."""
    for where in ("here", "there"):
        page = checks.page(where=where, allowed=("Failed to load",))
        missing = "**/sample/card/*"
        choose(page, "card")
        drag(page, checks.clips["card"]["truth"][0])
        frames(page, 40)
        page.route(missing, lambda route: route.abort())
        said(page, 'Press "Go on" to try again')
        before = kept_rows(page)
        assert len(before) < 150, "it has ended before the line broke"
        say_nothing(page)
        page.locator("#resume").click()
        said(page, 'Press "Go on" to try again')
        page.unroute(missing)
        page.locator("#resume").click()
        to_the_end(page)
        table = rows(page)
        assert [int(row["frame"]) for row in table] == list(range(150)) and values(table[: len(before)]) == values(before)
        page.context.close()


WORKERS = """() => {
    const Own = Worker;
    window.end = () => undefined;
    window.Worker = class extends Own {
        constructor(...given) {
            super(...given);
            window.end = () => {
                this.terminate();
                this.dispatchEvent(new ErrorEvent("error", { message: "It has no more memory." }));
            };
        }
    };
}"""


def worker_ended(checks):
    """Where the browser ends what tracks in the page, the page says so, and goes on from there."""
    page = checks.page(where="here")
    page.evaluate(WORKERS)
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 40)
    page.evaluate("window.end()")
    page.locator("#message.bad").filter(has_text='Press "Go on" to try again').wait_for()
    told = page.locator("#message").inner_text()
    assert "service" not in told and "Choose" not in told, told
    before = kept_rows(page)
    page.locator("#resume").click()
    to_the_end(page)
    table = rows(page)
    assert [int(row["frame"]) for row in table] == list(range(150)) and values(table[: len(before)]) == values(before)
    page.context.close()


def drawn_before_it_is_shown(checks):
    """A box that is drawn while the frame where to begin is on its way is of the one that is still shown."""
    page = checks.page(where="here")
    held = []
    page.route("**/sample/card/50.jpg", lambda route: route.continue_() if held else held.append(route))
    choose(page, "card")
    moved = "bar => { bar.value = '2'; bar.dispatchEvent(new Event('input')); }"
    with page.expect_request("**/sample/card/50.jpg"):
        page.locator("#begin-at").evaluate(moved)
    truth = checks.clips["card"]["truth"]
    drag(page, truth[0])
    held[0].continue_()
    to_the_end(page)
    table = rows(page)
    assert [int(row["frame"]) for row in table] == list(range(150)) and near(table, truth) >= 100
    page.context.close()


PLAYS = """(last) => {
    const now = Number(document.getElementById("timeline").ariaValueNow);
    return now >= 3 && now < last;
}"""


def played_again(checks):
    """Space plays what was tracked, from its beginning, and pauses; figures are those of the frame that is shown."""
    page = checks.page(where="here")
    # It waits for this frame: it cannot have ended when it is stopped.
    page.route("**/sample/card/120.jpg", lambda route: None)
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 120)
    page.locator("#stop").click()
    said(page, "Stopped")
    table = kept_rows(page)
    at = lambda: int(page.locator("#timeline").get_attribute("aria-valuenow"))
    # The clip waits for the sixth picture, so it still plays when the test pauses it.
    release = held(page, 5)
    page.keyboard.press("Space")
    page.wait_for_function(PLAYS, arg=len(table) - 1)
    page.keyboard.press("Space")
    # The page is updated with the next repaint of the screen.
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    paused = at()
    release()
    page.locator("#pause", has_text="Play").wait_for()
    assert at() == paused, "it plays on"
    row = table[paused]
    assert page.locator("#status").inner_text() == row["status"]
    assert abs(float(page.locator("#score").inner_text()) - float(row["score"])) <= 0.0051
    page.keyboard.press("Space")
    page.locator(f"#timeline[aria-valuenow='{len(table) - 1}']").wait_for()
    page.locator("#pause", has_text="Play").wait_for()
    to_frame(page, 10)
    assert abs(float(page.locator("#score").inner_text()) - float(table[10]["score"])) <= 0.0051
    page.context.close()


def gone_on_while_it_plays(checks):
    """Where one goes on while it plays, the button in the middle shows what it does after the next stop."""
    page = checks.page(where="here")
    # It waits for this frame: it cannot have ended.
    page.route("**/sample/card/120.jpg", lambda route: None)
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 60)
    page.locator("#stop").click()
    kept_rows(page)
    page.locator("#pause").click()
    page.locator("#pause.playing").wait_for()
    page.locator("#resume").click()
    page.locator("body[data-state=following]").wait_for()
    page.wait_for_timeout(500)
    page.locator("#stop").click()
    page.locator("body[data-state=ended]").wait_for()
    assert page.locator("#pause").inner_text() == "Play"
    assert page.locator("#pause.playing").count() == 0, "its icon is that of a pause"
    page.context.close()


ALL = [
    stopped_with_the_service,
    service_with_other_keys,
    asked_for_a_key_later,
    gone_on_after_a_stop,
    drawn_as_it_goes_on,
    stopped_after_a_reload,
    failed_after_it_was_left,
    no_session_is_left,
    corrections_leave_no_session,
    deleted_as_it_goes_on,
    stopped_before_the_first_box,
    offline,
    sample_broken_off,
    worker_ended,
    drawn_before_it_is_shown,
    played_again,
    gone_on_while_it_plays,
]

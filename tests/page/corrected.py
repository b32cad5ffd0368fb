"""Corrections: what is there stays until the new rows are, up to the next correction, and comes back when undone."""

import json
import signal

from browser import (
    DRAW,
    choose,
    drag,
    drawn_frames,
    frames,
    held,
    kept_rows,
    near,
    numbers,
    rows,
    rows_when,
    said,
    say_nothing,
    to_the_end,
)
from clips import FRAMES, H264
from files import SECRET, choose_file, sent_box
from kept import kept_says
from kept import told as whole
from service import Service
from studio import of_target, to_frame, values

OFF = [30, 200, 80, 60]
"""A box of the ground, off the target."""


def is_off(table):
    """Whether the last row is the box that was drawn off the target. That is never there."""
    return all(abs(one - other) <= 1 for one, other in zip(numbers(table[-1])[:2], OFF))


def paused_clip(page, truth, count=40):
    """The rows of the sample clip, which is paused after so many frames."""
    choose(page, "card")
    drag(page, truth[0])
    frames(page, count)
    page.locator("#pause").click()
    return kept_rows(page)


def tracked_clip(checks, where="here"):
    page = checks.page(where=where)
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    to_the_end(page)
    return page


def tracked_anew_and_cancelled(checks):
    """What is tracked anew is cancelled, and interrupted by a reload: all rows are as before."""
    page = checks.page(where="here")
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    drag(page, sent_box(checks.files.truth[0]))
    to_the_end(page)
    before = rows(page)
    kept_says(page, f"{FRAMES} rows")
    for cancel in (lambda: page.keyboard.press("Escape"), page.locator("#cancel").click):
        to_frame(page, 10)
        release = held(page, 5)
        drag(page, OFF)
        said(page, "Following anew: frame 1")
        assert whole(rows(page)) == whole(before), "rows are lost while it is tracked anew"
        cancel()
        release()
        said(page, "Cancelled")
        assert page.locator("#cancel").is_hidden()
        assert whole(rows(page)) == whole(before) and drawn_frames(page) == [0]
    held(page, 5)
    drag(page, OFF)
    said(page, "Following anew: frame 1")
    page.reload()
    said(page, "clip.mp4 is here again")
    assert whole(rows(page)) == whole(before)
    page.context.close()


def up_to_the_next_correction(checks):
    """A correction changes the rows up to the next one, and undoing brings back rows and key frames."""
    page = tracked_clip(checks)
    first = rows(page)
    to_frame(page, 100)
    drag(page, OFF)
    said(page, "Followed anew from frame 100")
    second = rows(page)
    to_frame(page, 50)
    drag(page, [10, 20, 60, 60])
    said(page, "Followed anew from frame 50")
    third = rows(page)
    assert drawn_frames(page) == [0, 50, 100]
    assert values(third[:50]) == values(first[:50]) and values(third[100:]) == values(second[100:])
    assert numbers(third[50])[:2] == [10, 20] and len(third) == 150
    page.locator("#undo").click()
    said(page, "is undone")
    assert values(rows(page)) == values(second) and drawn_frames(page) == [0, 100]
    say_nothing(page)
    page.keyboard.press("Control+z")
    said(page, "is undone")
    assert page.locator("#undo").is_disabled()
    assert values(rows(page)) == values(first) and drawn_frames(page) == [0]
    to_frame(page, 20)
    page.locator("#backwards").click()
    said(page, "Followed 19 frames backwards")
    page.locator("#undo").click()
    said(page, "is undone")
    assert values(rows(page)) == values(first)
    page.context.close()


def undone_while_it_is_followed(checks):
    """A box in the last frame is undone, and the object is followed on from where it was."""
    for where in ("here", "there"):
        page = checks.page(where=where)
        truth = checks.clips["card"]["truth"]
        before = paused_clip(page, truth)
        drag(page, OFF)
        said(page, "The box is corrected")
        rows_when(page, is_off)
        page.keyboard.press("Control+z")
        said(page, "is undone")
        assert values(rows(page)) == values(before)
        page.locator("#pause").click()
        to_the_end(page)
        table = rows(page)
        last = truth[149]
        assert len(table) == 150 and values(table[: len(before)]) == values(before)
        assert abs(numbers(table[-1])[0] - last[0]) < 15 and abs(numbers(table[-1])[1] - last[1]) < 15, (table[-1], last)
        page.context.close()


def undone_with_frames_on_their_way(checks):
    """A box that is drawn while frames are on their way corrects the last of them: undoing takes it back there."""
    service = Service(checks.program)
    page = checks.page(url=service.url, where="there")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    service.process.send_signal(signal.SIGSTOP)
    try:
        # Frames come for another moment, and are not answered.
        page.wait_for_timeout(300)
        page.locator("#pause").click()
        drag(page, OFF)
        said(page, "The box is corrected")
    finally:
        service.process.send_signal(signal.SIGCONT)
    before = rows_when(page, is_off)
    page.keyboard.press("Control+z")
    said(page, "is undone")
    after = rows(page)
    assert len(after) == len(before) and values(after[:-1]) == values(before[:-1])
    assert abs(numbers(after[-1])[0] - numbers(after[-2])[0]) < 15, (after[-2:], before[-1])
    page.context.close()
    service.stop()


def undone_after_more_frames(checks):
    """A wrong box is undone after more frames were tracked: those that followed from it are tracked anew."""
    for where, begun, stops in (("here", 40, False), ("there", 40, True), ("here", 10, True)):
        page = checks.page(where=where)
        truth = checks.clips["card"]["truth"]
        before = paused_clip(page, truth, begun)
        drag(page, OFF)
        rows_when(page, is_off)
        page.locator("#pause").click()
        frames(page, len(before) + 15)
        page.locator("#stop" if stops else "#pause").click()
        wrong = kept_rows(page)
        page.locator("#undo").click()
        said(page, "is undone")
        table = rows(page)
        assert len(table) == len(wrong) and values(table[: len(before)]) == values(before)
        assert near(table, truth) > 0.8 * len(table), [numbers(row) for row in table]
        page.locator("#resume" if stops else "#pause").click()
        to_the_end(page)
        table = rows(page)
        assert len(table) == 150 and near(table, truth) > 120
        page.context.close()


def deletion_undone(checks):
    """An object that was deleted comes back when that is undone, and is followed on; corrections before it are undone."""
    for where in ("here", "there"):
        page = checks.page(where=where)
        truth = checks.clips["card"]["truth"]
        before = paused_clip(page, truth)
        page.locator("#add").click()
        drag(page, OFF)
        page.locator("#list li:nth-child(2)").wait_for()
        page.get_by_role("button", name="Delete Object 1").click()
        page.locator("#pause").click()
        frames(page, len(before) + 15)
        page.locator("#pause").click()
        page.locator("#undo").click()
        said(page, "Object 1 is undone")
        table = of_target(rows(page), 0)
        assert len(table) > len(before) + 10 and values(table[: len(before)]) == values(before)
        page.locator("#undo").click()
        said(page, "Object 2 is undone")
        page.locator("#pause").click()
        to_the_end(page)
        table = rows(page)
        assert len(of_target(table, 0)) == len(table) == 150 and near(table, truth) > 120
        page.context.close()


def no_object_left(checks):
    """Once the last object is deleted, frames wait for another box, and "Go on" asks for one. From the box on it goes on
    as before."""
    for where in ("here", "there"):
        page = checks.page(where=where)
        choose(page, "card")
        drag(page, checks.clips["card"]["truth"][0])
        frames(page, 20)
        page.get_by_role("button", name="Delete Object 1").click()
        said(page, DRAW)
        shown = int(page.locator("#frames").inner_text())
        # Long enough for frames to go past, if the page did not wait.
        page.wait_for_timeout(1000)
        drag(page, OFF)
        frames(page, shown + 20)
        page.locator("#pause").click()
        table = kept_rows(page)
        assert int(table[0]["frame"]) < shown + 10, (shown, table[0])
        for again, state in (("#pause", "paused"), ("#resume", "ended")):
            page.get_by_role("button", name="Delete Object").click()
            page.locator(again).click()
            said(page, f"There is no object. {DRAW}")
            page.locator(f"body[data-state={state}]").wait_for()
            page.locator("#undo").click()
            said(page, "Object 2 is undone")
            if state == "paused":
                page.locator("#stop").click()
        page.locator("#resume").click()
        to_the_end(page)
        rest = [int(row["frame"]) for row in rows(page)]
        assert rest == list(range(rest[0], 150)) and rest[0] == int(table[0]["frame"]), rest
        page.context.close()


def undone_without_the_service(checks):
    """What cannot be undone while the service is away stays as it is, and is undone when it is back."""
    service = Service(checks.program, **SECRET)
    page = checks.page(url=service.url, allowed=("WebSocket", "ERR_CONNECTION", "Failed to load"))
    before = paused_clip(page, checks.clips["card"]["truth"])
    drag(page, OFF)
    wrong = rows_when(page, is_off)
    service.process.kill()
    service.process.wait()
    page.locator("#undo").click()
    page.locator("#message.bad").wait_for()
    assert values(rows(page)) == values(wrong)
    service = Service(checks.program, port=service.port, **SECRET)
    say_nothing(page)
    page.locator("#undo").click()
    said(page, "is undone")
    assert values(rows(page)) == values(before)
    page.locator("#pause").click()
    to_the_end(page)
    page.context.close()
    service.stop()


LONG = """async (length) => {
    const { FollowedObject } = await import("/page/objects.js");
    const object = new FollowedObject(0, { save: async () => new Uint8Array(1) });
    for (let frame = 0; frame < length; frame += 1) {
        object.note({ frame });
        await 0;
    }
    await new Promise((resolve) => setTimeout(resolve));
    return object.saves.map(({ after }) => after);
}"""


def states_of_a_long_video(checks):
    """Of the states of a long video so many are kept as memory allows, and one before each frame that may be corrected:
    what is tracked again to come to it is little beside what is tracked again after it."""
    page = checks.page()
    length = 20_000
    states = page.evaluate(LONG, length)
    assert len(states) <= 200, len(states)
    assert states[0] < 30 and states[-1] >= length - 30
    for state, following in zip(states, states[1:]):
        assert following - state <= max(30, (length - state) / 10), (state, following)
    page.context.close()


STEPS = """async ([count, own, shared]) => {
    const { Undoing } = await import("/page/undo.js");
    const undoing = new Undoing();
    const states = [{ bytes: { length: shared } }];
    for (let number = 0; number < count; number += 1) {
        undoing.push({ number, saves: [...states, { bytes: { length: own } }], last: 0 });
    }
    return undoing.steps.map(({ number }) => number);
}"""


def memory_of_steps(checks):
    """The newest steps can be undone: so many as memory allows. What several have takes its bytes once."""
    page = checks.page()
    assert page.evaluate(STEPS, [200, 1000, 100 << 20]) == list(range(150, 200))
    assert page.evaluate(STEPS, [50, 10 << 20, 0]) == list(range(38, 50))
    assert page.evaluate(STEPS, [3, 500 << 20, 0]) == [2]
    page.context.close()


CAMERA = """async () => {
    const { Run } = await import("/page/run.js");
    const sent = [];
    const track = (_, header) => new Promise((answer) => sent.push({ header, answer }));
    const [box, nothing] = [{ x: 1, y: 1, width: 8, height: 8 }, () => undefined];
    const stream = { ended: new Promise(nothing), close: nothing, track };
    const client = { open: async () => ({ box, stream: () => stream, end: async () => undefined }) };
    let deliver;
    const start = (give) => new Promise(() => (deliver = give));
    const source = { isLive: true, size: { width: 10, height: 10 }, skipped: 0, start, hold: nothing, stop: nothing };
    const picture = (frame) => ({ frame, time: frame, blob: new Blob(), image: { width: 10, height: 10 } });
    const told = { answer: nothing, fail: nothing, rest: nothing, refuse: nothing, line: nothing, anew: nothing };
    const run = new Run(client, source, picture(0), told);
    await run.begin(box);
    run.draw(box, run.chosen, nothing, nothing);
    [1, 2].forEach((frame) => deliver(picture(frame)));
    const boxes = sent.map(({ header }) => header.box !== undefined);
    sent.forEach(({ answer }, frame) => answer({ frame, box, score: 1, status: "tracking" }));
    await new Promise((resolve) => setTimeout(resolve));
    return [boxes, [...run.chosen.rows.values()].map(({ frame, corrected }) => [frame, corrected]), run.skipped, run.isFull];
}"""


def corrected_on_camera(checks):
    """Frames of a camera follow a correction at once: none is skipped while it is on its way."""
    page = checks.page()
    told = page.evaluate(CAMERA)
    assert told == [[True, False, False], [[0, True], [1, False], [2, False]], 0, False], told
    page.context.close()


def added_over_a_slow_line(checks):
    """No frame goes past an object while its session is opened: it has a row of each frame from its box on."""
    page = checks.page()
    last = len(paused_clip(page, checks.clips["card"]["truth"])) - 1
    held = []
    opening = "**/sessions/*?*box=*"
    page.route(opening, lambda route: held.append(route))
    page.locator("#add").click()
    with page.expect_request(opening):
        drag(page, OFF)
    page.locator("#pause").click()
    # Long enough for frames to go past it, if the page did not wait.
    page.wait_for_timeout(1000)
    held[0].continue_()
    to_the_end(page)
    assert [int(row["frame"]) for row in of_target(rows(page), 1)] == list(range(last, 150))
    page.context.close()


OPENING = "**/sessions/*?*box=*"


def added_to_a_paused_clip(checks):
    """A page with a new object whose session is not opened yet, and a list with the request that opens it."""
    page = checks.page()
    paused_clip(page, checks.clips["card"]["truth"])
    held = []
    page.route(OPENING, lambda route: held.append(route))
    page.locator("#add").click()
    with page.expect_request(OPENING):
        drag(page, OFF)
    return page, held


def added_and_undone_at_once(checks):
    """A new object that is undone while its session is opened does not come."""
    page, held = added_to_a_paused_clip(checks)
    page.keyboard.press("Control+z")
    # Long enough for a page to finish that does not wait for the answer.
    page.wait_for_timeout(500)
    with page.expect_response(OPENING):
        held[0].continue_()
    said(page, "Object 2 is undone")
    assert page.locator("#list li").count() == 1 and page.locator("#undo").is_disabled()
    page.locator("#pause").click()
    to_the_end(page)
    table = rows(page)
    assert len(table) == len(of_target(table, 0)) == 150, len(table)
    page.context.close()


def two_added_at_once(checks):
    """While the session of a new object is opened, another box is not taken: each object comes, and undoing takes back
    the newest one."""
    page, held = added_to_a_paused_clip(checks)
    page.locator("#add").click()
    drag(page, [400, 200, 60, 60])
    said(page, "The box of the new object is on its way")
    held[0].continue_()
    page.locator("#list li:nth-child(2)").wait_for()
    page.unroute(OPENING)
    drag(page, [400, 200, 60, 60])
    page.locator("#list li:nth-child(3)").wait_for()
    for count in (2, 1):
        page.locator("#undo").click()
        said(page, f"Object {count + 1} is undone")
        assert page.locator("#list li").count() == count
    assert {row["target"] for row in rows(page)} == {"0"} and page.locator("#undo").is_disabled()
    page.context.close()


def box_at_the_edge(checks):
    """Arrows move a box to the edge of the picture and no further, and a paused run goes on after it."""
    page = checks.page(where="here")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 40)
    page.locator("#pause").click()
    before = kept_rows(page)
    to_frame(page, 20)
    page.locator("#picture").focus()
    for key in ["Enter", *["ArrowLeft"] * 90, *["Shift+ArrowDown"] * 90, "Enter"]:
        page.keyboard.press(key)
    said(page, "Followed anew from frame 20")
    table = rows(page)
    x, y, width, height = numbers(table[20])
    assert x == 0 and y + height == 360, table[20]
    assert len(table) == len(before) and values(table[:20]) == values(before[:20])
    page.locator("#pause").click()
    to_the_end(page)
    page.context.close()


def refused_box(checks):
    """A box that the service does not take, in an earlier frame and for a new object: nothing changes, and it goes on. One
    that is refused late takes back no other change."""
    page = checks.page(allowed=("422",))
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 40)
    page.locator("#pause").click()
    before = kept_rows(page)
    problem = json.dumps({"type": "https://localhost/problems#invalid-box", "status": 422, "detail": "The box is refused."})
    opening = "**/sessions/*?*box=*"
    page.route(opening, lambda route: route.fulfill(status=422, content_type="application/problem+json", body=problem))
    page.locator("#add").click()
    drag(page, OFF)
    said(page, "This box cannot be followed")
    assert whole(rows(page)) == whole(before) and page.locator("#undo").is_disabled()
    to_frame(page, 20)
    say_nothing(page)
    drag(page, OFF)
    said(page, "This box cannot be followed")
    assert whole(rows(page)) == whole(before) and page.locator("#undo").is_disabled()
    page.unroute(opening)
    asked = []
    page.route(opening, lambda route: asked.append(route))
    say_nothing(page)
    to_frame(page, len(before) - 1)
    page.locator("#add").click()
    with page.expect_request(opening):
        drag(page, OFF)
    page.get_by_role("button", name="Delete Object 1").click()
    asked[0].fulfill(status=422, content_type="application/problem+json", body=problem)
    said(page, "This box cannot be followed")
    page.unroute(opening)
    page.locator("#undo").click()
    said(page, "Object 1 is undone")
    page.locator("#pause").click()
    to_the_end(page)
    assert values(rows(page)[: len(before)]) == values(before)
    page.context.close()


ALL = [
    tracked_anew_and_cancelled,
    up_to_the_next_correction,
    undone_while_it_is_followed,
    undone_with_frames_on_their_way,
    undone_after_more_frames,
    deletion_undone,
    no_object_left,
    undone_without_the_service,
    states_of_a_long_video,
    memory_of_steps,
    corrected_on_camera,
    added_over_a_slow_line,
    added_and_undone_at_once,
    two_added_at_once,
    box_at_the_edge,
    refused_box,
]

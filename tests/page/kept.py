"""Nothing is lost: the page is loaded anew, and a project file is opened again."""

import json

from browser import DRAW, choose, drag, frames, kept_rows, numbers, rows, said, saved, say_nothing, slow, stop, to_the_end
from clips import FRAMES, H264
from files import GRAY, check_rows, choose_file, sent_box
from studio import to_frame

LARGE = 20 << 20
"""Bytes of a file that the browser has no room for."""


def told(table):
    return [(row["frame"], numbers(row), row["status"], row["target"], row["name"]) for row in table]


def kept_says(page, text):
    page.locator("#kept-text").filter(has_text=text).wait_for()


def same_rows(page, before):
    """The rows, which must be those of before, and at most the one of the frame that was under way."""
    found = rows(page)
    assert told(found[: len(before)]) == told(before) and len(found) <= len(before) + 1, (len(found), len(before))
    return found


def reloaded_in_the_middle(checks):
    """The tab is loaded anew while a file is tracked: rows, names and the file are there, and it goes on to the end."""
    path = checks.files.file("clip.mp4", 30, H264)
    page = checks.page(where="here")
    hurry = slow(page)
    choose_file(page, path)
    drag(page, sent_box(checks.files.truth[0]))
    page.locator("#list input[type=text]").fill("The card")
    frames(page, 40)
    page.locator("#pause").click()
    hurry()
    before = kept_rows(page)
    kept_says(page, "clip.mp4, 1 object, ")
    page.reload()
    said(page, "clip.mp4 is here again")
    before = same_rows(page, before)
    assert 50 < page.evaluate(GRAY) < 200, "the last picture is not shown"
    checks.no_axe_violations(page, "brought back")
    page.locator("#pause").click()
    to_the_end(page)
    after = rows(page)
    assert told(after[: len(before)]) == told(before), "rows have changed"
    check_rows(after, path, checks.files.truth, list(range(FRAMES)), [number / 30 for number in range(FRAMES)])
    assert {row["name"] for row in after} == {"The card"}
    kept_says(page, f"{FRAMES} rows")
    page.reload()
    said(page, "clip.mp4 is here again")
    assert told(rows(page)) == told(after)
    page.locator("#forget").click()
    page.reload()
    page.locator("#hero").wait_for()
    assert page.locator("#kept").is_hidden() and page.locator("#results").is_hidden()
    page.context.close()


def kept_run(checks, page):
    """Tracks a part of the sample in a page, and gives its rows."""
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    page.locator("#stop").click()
    return kept_rows(page)


def renamed_and_reloaded(checks):
    """The tab is loaded anew at once after a change."""
    page = checks.page(where="here")
    kept_run(checks, page)
    name = page.locator("#list input[type=text]")
    for text in ("The card", "The ace", "The ace of spades"):
        name.fill(text)
        page.reload()
        said(page, "card is here again")
        assert name.input_value() == text, name.input_value()
    page.context.close()


def offers(page, names):
    """Waits until a page offers to go on with these, newest first."""
    for _ in range(50):
        # As if the user had returned to the tab.
        page.evaluate("() => void document.dispatchEvent(new Event('visibilitychange'))")
        page.wait_for_timeout(300)
        texts = page.locator("#works li").all_inner_texts()
        found = [text.split(",")[0].removeprefix("Kept in this browser: ") for text in texts]
        if found == names:
            return
    raise AssertionError(f"{found} are offered, not {names}")


def go_on(page, name):
    page.locator("#works li").filter(has_text=name).locator(".go-on").click()
    said(page, f"{name} is here again")


def each_tab_for_itself(checks):
    """Tabs keep their work for themselves. What no tab has open is offered with its own pictures, not opened."""
    path = checks.files.file("clip.mp4", 30, H264)
    page = checks.page(where="here")
    before = kept_run(checks, page)
    other = page.context.new_page()
    other.goto(page.url)
    offers(other, [])
    other.locator("#here").evaluate("button => button.click()")
    choose_file(other, path)
    drag(other, sent_box(checks.files.truth[0]))
    to_the_end(other)
    own = kept_rows(other)
    with page.context.expect_page() as opened:
        page.evaluate("() => void open(location.href)")
    duplicate = opened.value
    said(duplicate, "Nothing is uploaded")
    duplicate.wait_for_timeout(1500)
    assert duplicate.locator("#results").is_hidden(), "a duplicate is a tab of its own"
    offers(duplicate, [])
    duplicate.close()
    page.reload()
    said(page, "card is here again")
    same_rows(page, before)
    page.close()
    offers(other, ["card"])
    checks.no_axe_violations(other, "work of another tab")
    go_on(other, "card")
    same_rows(other, before)
    assert other.evaluate("document.getElementById('picture').width") == checks.clips["card"]["width"]
    offers(other, ["clip.mp4"])
    go_on(other, "clip.mp4")
    assert told(rows(other)) == told(own)
    other.locator("#works button").filter(has_text="Forget it").click()
    other.locator("#works li").wait_for(state="detached")
    offers(other, [])
    other.context.close()


def left_for_another_source(checks):
    """What cannot be opened leaves the run as it is, and so does what is pasted into a name. Another source takes its
    place, and it can be gone on with."""
    path = checks.files.file("clip.mp4", 30, H264)
    text = checks.files.folder / "notes.txt"
    text.write_text("no video")
    page = checks.page(where="here")
    hurry = slow(page)
    choose_file(page, path)
    drag(page, sent_box(checks.files.truth[0]))
    frames(page, 20)
    page.locator("#pause").click()
    hurry()
    before = kept_rows(page)
    page.locator("#file").set_input_files(text)
    page.locator("#message.bad").wait_for()
    same_rows(page, before)
    assert page.locator("#pause").inner_text() == "Go on"
    page.locator("#list input[type=text]").evaluate(PASTED)
    page.wait_for_timeout(500)
    before = same_rows(page, before)
    page.locator("#sources summary").click()
    page.locator("#card").click()
    said(page, "clip.mp4 is kept: below you can go on with it")
    assert page.locator("#results").is_hidden()
    go_on(page, "clip.mp4")
    before = same_rows(page, before)
    page.locator("#pause").click()
    to_the_end(page)
    after = rows(page)
    assert told(after[: len(before)]) == told(before) and len(after) == FRAMES
    page.context.close()


def no_room_for_the_file(checks):
    """A file for which the browser has no room is not kept: its rows are, and all that was kept before."""
    path = checks.files.folder / "large.mp4"
    # An empty MP4 box at the end makes the file large.
    nothing = LARGE.to_bytes(4, "big") + b"free" + bytes(LARGE - 8)
    path.write_bytes(checks.files.file("clip.mp4", 30, H264).read_bytes() + nothing)
    page = checks.page(where="here")
    other = page.context.new_page()
    other.goto(page.url)
    browser = other.context.new_cdp_session(other)
    # The browser reads the quota only now and then, so it is set at the beginning.
    browser.send("Storage.overrideQuotaForOrigin", {"origin": checks.service.url, "quotaSize": LARGE})
    kept_run(checks, page)
    page.close()
    offers(other, ["card"])
    other.locator("#here").evaluate("button => button.click()")
    choose_file(other, path)
    drag(other, sent_box(checks.files.truth[0]))
    to_the_end(other)
    kept_says(other, f"{FRAMES} rows. The pictures are not kept.")
    offers(other, ["card"])
    before = rows(other)
    other.reload()
    said(other, "Choose large.mp4 to see its pictures")
    assert told(rows(other)) == told(before)
    other.context.close()


def data_cleared_meanwhile(checks):
    """Where the browser removes what pages keep, for want of room or as its user wants, the page keeps it anew with the
    next change, also the file."""
    page = checks.page(where="here")
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    drag(page, sent_box(checks.files.truth[0]))
    to_the_end(page)
    kept_rows(page)
    browser = page.context.new_cdp_session(page)
    browser.send("Storage.clearDataForOrigin", {"origin": checks.service.url, "storageTypes": "indexeddb"})
    page.locator("#kept-text").evaluate("place => { place.textContent = ''; }")
    page.locator("#list input[type=text]").fill("van")
    kept_says(page, f"Kept in this browser: clip.mp4, 1 object, {FRAMES} rows.")
    page.reload()
    said(page, f"clip.mp4 is here again, with {FRAMES} frames.")
    assert "Choose" not in page.locator("#message").inner_text()
    assert {row["name"] for row in rows(page)} == {"van"}
    page.context.close()


PASTED = """(input) => {
    const clipboardData = new DataTransfer();
    const canvas = document.createElement("canvas");
    const bytes = Uint8Array.from(atob(canvas.toDataURL("image/png").split(",")[1]), (sign) => sign.charCodeAt(0));
    clipboardData.items.add(new File([bytes], "image.png", { type: "image/png" }));
    input.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true }));
}"""


def saved_project(checks, page, name):
    """Saves the project as a file of this name, and leaves the page."""
    path = checks.files.folder / f"{name}.bagtrack.json"
    path.write_bytes(saved(page, "#save-project"))
    page.context.close()
    return path


def project_opened_again(checks):
    """A project is opened without its video, then with it, and corrected in an earlier frame."""
    path = checks.files.file("clip.mp4", 30, H264)
    page = checks.page(where="here")
    choose_file(page, path)
    drag(page, sent_box(checks.files.truth[0]))
    to_the_end(page)
    before = rows(page)
    project = saved_project(checks, page, "work")

    page = checks.page(where="here")
    page.locator("#file").set_input_files(project)
    said(page, "Choose clip.mp4 to see its pictures")
    assert told(rows(page)) == told(before)
    page.locator("#file").set_input_files(path)
    said(page, f"with {FRAMES} frames.")
    assert told(rows(page)) == told(before)
    to_frame(page, 40)
    checks.shot(page, "project")
    box = sent_box(checks.files.truth[40])
    drag(page, [box[0] + 6, box[1] + 6, box[2], box[3]])
    said(page, "Followed anew from frame 40")
    after = rows(page)
    assert told(after[:40]) == told(before[:40]) and told(after[40:]) != told(before[40:])
    assert len(after) == FRAMES
    page.context.close()

    damaged = json.loads(project.read_text())
    damaged["objects"][0]["rows"][3][2] = "left"
    project.write_text(json.dumps(damaged))
    page = checks.page(where="here")
    page.locator("#file").set_input_files(project)
    said(page, "a row of it is damaged")
    page.context.close()


def half_tracked_project(checks):
    """A project of a part of its video is opened without it, then with it under another name, and goes on to the end.
    Another video is refused along with it, and opened for itself afterwards."""
    path = checks.files.file("clip.mp4", 30, H264)
    page = checks.page(where="here")
    hurry = slow(page)
    choose_file(page, path)
    drag(page, sent_box(checks.files.truth[0]))
    frames(page, 20)
    page.locator("#pause").click()
    hurry()
    project = saved_project(checks, page, "half")

    renamed = checks.files.folder / "clip (1).mp4"
    renamed.write_bytes(path.read_bytes())
    page = checks.page(where="here")
    page.locator("#file").set_input_files(project)
    said(page, "Choose clip.mp4 to see its pictures")
    before = rows(page)
    assert json.loads(saved(page, "#save-project"))["ended"] is False
    page.locator("#file").set_input_files(renamed)
    said(page, "clip (1).mp4 is here again")
    same_rows(page, before)
    page.locator("#pause").click()
    to_the_end(page)
    after = rows(page)
    assert told(after[: len(before)]) == told(before) and len(after) == FRAMES
    page.context.close()

    other = checks.files.file("small.mp4", 30, H264, turned="scale=528:396")
    page = checks.page(where="here")
    page.locator("#file").set_input_files([project, other])
    said(page, "small.mp4 has 528 × 396 pixels, the video of this project (clip.mp4) 1056 × 792")
    page.locator("#file").set_input_files(project)
    said(page, "Choose clip.mp4 to see its pictures")
    page.locator("#file").set_input_files(other)
    said(page, "clip.mp4 is kept: below you can go on with it")
    assert page.locator("#results").is_hidden()
    page.context.close()


def project_without_objects(checks):
    """A project that one wrote by hand, with no objects or with one that has no rows, is opened and takes a first box."""
    path = checks.files.file("clip.mp4", 30, H264)
    video = {"name": "clip.mp4", "width": 1056, "height": 792}
    project = {"bagtrack_project": 1, "video": video, "ended": False, "skipped": 0, "objects": []}
    empty = checks.files.folder / "empty.bagtrack.json"
    nothing = {"number": 0, "name": "van", "color": "#ffb000", "shown": True, "rows": []}
    for objects, together in (([], True), ([nothing], False)):
        empty.write_text(json.dumps({**project, "objects": objects}))
        page = checks.page(where="here")
        page.locator("#file").set_input_files([empty, path] if together else empty)
        if not together:
            said(page, "Choose clip.mp4 to draw one")
            page.locator("#file").set_input_files(path)
        said(page, DRAW)
        drag(page, sent_box(checks.files.truth[0]))
        to_the_end(page)
        assert len(rows(page)) == FRAMES
        page.context.close()


def opened_by_hand(checks, objects):
    """A page with a project that one wrote by hand, and its video."""
    path = checks.files.file("clip.mp4", 30, H264)
    video = {"name": "clip.mp4", "width": 1056, "height": 792}
    project = checks.files.folder / "hand.bagtrack.json"
    project.write_text(json.dumps({"bagtrack_project": 1, "video": video, "objects": objects}))
    page = checks.page(where="here")
    page.locator("#file").set_input_files([project, path])
    said(page, "clip.mp4 is here again, with 1 frames.")
    return page


def project_of_rows_alone(checks):
    """Objects of a project that one wrote by hand, which has their rows alone, have names and numbers, and go on."""
    objects = [{"rows": [[0, 0, *box, 1, "tracking", 1]]} for box in (checks.files.truth[0], [20, 20, 60, 60])]
    page = opened_by_hand(checks, objects)
    page.locator("#pause").click()
    to_the_end(page)
    assert {(row["target"], row["name"]) for row in rows(page)} == {("0", "Object 1"), ("1", "Object 2")}
    assert len(rows(page)) == 2 * FRAMES
    page.context.close()


def project_of_one_number(checks):
    """Two objects of a project that one wrote by hand have one number: each is a target of its own."""
    card, other = checks.files.truth[0], [20, 20, 60, 60]
    objects = [
        {"number": 3, "name": name, "rows": [[0, 0, *box, 1, "tracking", 1]]}
        for name, box in (("card", card), ("ground", other), ("sky", [200, 20, 60, 60]))
    ]
    objects[2]["number"] = -1
    page = opened_by_hand(checks, objects)
    targets = lambda: {(row["target"], row["name"]) for row in rows(page)}
    assert targets() == {("3", "card"), ("4", "ground"), ("5", "sky")}, targets()
    page.get_by_role("button", name="Delete ground").click()
    page.get_by_label("Choose card").check()
    page.locator("#undo").click()
    said(page, "The last change to ground is undone")
    assert targets() == {("3", "card"), ("4", "ground"), ("5", "sky")}, targets()
    page.context.close()


READ_LATE = """() => {
    const own = Blob.prototype.text;
    let isRead;
    const done = new Promise((resolve) => (isRead = resolve));
    const released = new Promise((resolve) => {
        window.release = () => {
            resolve();
            return done;
        };
    });
    Blob.prototype.text = async function () {
        await released;
        const text = await own.call(this);
        setTimeout(isRead);
        return text;
    };
}"""


def refused_project_overtaken(checks):
    """A project is refused with a reason; where a video was chosen meanwhile, nothing is said of it."""
    path = checks.files.folder / "torn.bagtrack.json"
    path.write_text("{")
    page = checks.page(where="here")
    page.locator("#file").set_input_files(path)
    said(page, "torn.bagtrack.json is no JSON.")
    page.evaluate(READ_LATE)
    page.locator("#file").set_input_files(path)
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    page.evaluate("() => window.release()")
    assert page.locator("#message").inner_text().startswith(DRAW), page.locator("#message").inner_text()
    page.context.close()


MANY = 10_000
"""Frames, each with a row of 16 objects: more rows than arguments that a browser takes."""


def project_of_many_rows(checks):
    """A project of a long video with many objects is opened, saved, and compared with its video."""
    row = lambda frame: [frame, frame / 30, 10, 10, 20, 20, 0.9, "tracking", int(frame == 0)]
    table = [row(frame) for frame in range(MANY)]
    objects = [{"number": at, "name": "", "color": "#ffb000", "shown": True, "rows": table} for at in range(16)]
    video = {"name": "clip.mp4", "width": 1056, "height": 792, "rate": 30}
    project = {"bagtrack_project": 1, "video": video, "ended": True, "skipped": 0, "objects": objects}
    path = checks.files.folder / "many.bagtrack.json"
    path.write_text(json.dumps(project))
    page = checks.page(where="here")
    page.locator("#file").set_input_files(path)
    said(page, f"with {MANY} frames")
    assert f"<size>{MANY}</size>".encode() in saved(page, "#save-cvat")
    page.locator("#file").set_input_files([path, checks.files.file("clip.mp4", 30, H264)])
    said(page, f"clip.mp4 has {FRAMES} frames, and this project (clip.mp4) a box in frame {MANY - 1}")
    page.context.close()


REFUSED = """for (const name of ["sessionStorage", "localStorage", "indexedDB"]) {
    Object.defineProperty(window, name, { get() { throw new DOMException("", "SecurityError"); } });
}"""


def nothing_may_be_kept(checks):
    """A browser whose user lets pages keep nothing tracks all the same, and the page says that nothing is kept."""
    page = checks.page(where="here")
    page.context.add_init_script(REFUSED)
    page.reload()
    page.locator("#here").evaluate("button => button.click()")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    to_the_end(page)
    kept_says(page, "The browser keeps nothing of this")
    assert len(rows(page)) == 150
    page.context.close()


def last_object_deleted(checks):
    """Nothing is told and kept of an object that was deleted."""
    page = checks.page(where="here")
    page.locator("#see").evaluate("box => box.checked || box.click()")
    kept_run(checks, page)
    page.locator("#seen-now").wait_for()
    page.locator("#list .remove").click()
    said(page, DRAW)
    assert [page.locator(name).inner_text() for name in ("#status", "#score")] == ["–", "–"]
    assert page.locator("#seen-now").is_hidden()
    page.locator("#kept").wait_for(state="hidden")
    page.reload()
    page.locator("#hero").wait_for()
    offers(page, [])
    assert page.locator("#results").is_hidden()
    page.context.close()


def video_made_of_another_run(checks):
    """While the video of a run is made, the run that has taken its place can be saved."""
    page = checks.page(where="here")
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    drag(page, sent_box(checks.files.truth[0]))
    to_the_end(page)
    slow(page)
    button = page.locator("#save-video")
    with page.expect_download() as download:
        button.click()
        button.filter(has_text="Making the video").wait_for()
        page.locator("#sources summary").click()
        choose(page, "card")
        for _ in range(10):
            assert button.text_content() == "Video (WebM)" and button.is_enabled()
            page.wait_for_timeout(50)
    assert download.value.suggested_filename == "clip-boxes.webm"
    page.context.close()


def project_without_its_video(checks):
    """Without pictures nothing is tracked and no video is made: the page says which file to choose."""
    path = checks.files.file("clip.mp4", 30, H264)
    page = checks.page(where="here")
    choose_file(page, path)
    drag(page, sent_box(checks.files.truth[0]))
    frames(page, 30)
    stop(page)
    before = kept_rows(page)
    project = saved_project(checks, page, "alone")

    page = checks.page(where="here")
    page.locator("#file").set_input_files(project)
    said(page, "Choose clip.mp4 to see its pictures")
    to_frame(page, 20)
    for act in (page.locator("#backwards").click, lambda: drag(page, [30, 200, 80, 60]), page.locator("#save-video").click):
        page.locator("#list input[type=radio]").check()
        act()
        page.locator("#message.bad").filter(has_text="Choose clip.mp4 first").wait_for()
        say_nothing(page)
    assert told(rows(page)) == told(before)
    page.locator("#list .remove").click()
    page.locator("#undo").click()
    said(page, "is undone")
    assert told(rows(page)) == told(before)
    page.context.close()


ALL = [
    half_tracked_project,
    project_without_objects,
    project_of_rows_alone,
    project_of_one_number,
    refused_project_overtaken,
    project_of_many_rows,
    nothing_may_be_kept,
    last_object_deleted,
    video_made_of_another_run,
    reloaded_in_the_middle,
    renamed_and_reloaded,
    each_tab_for_itself,
    no_room_for_the_file,
    data_cleared_meanwhile,
    left_for_another_source,
    project_opened_again,
    project_without_its_video,
]

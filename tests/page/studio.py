"""Several objects, the timeline, corrections of earlier frames, and what is saved of them."""

import io
import json
import re
import time
import xml.etree.ElementTree
import zipfile

from browser import (
    FRAMES_A_SECOND,
    TO_THE_END,
    begin_at,
    choose,
    drag,
    frames,
    kept_rows,
    near,
    numbers,
    rows,
    said,
    saved,
    slow,
    to_the_end,
)
from clips import H264, run
from files import choose_file, sent_box
from service import Service

CORRECTED = 100
KEY = 40
"""Where one begins in the middle."""


def to_frame(page, frame):
    """Goes to a frame on the timeline, by keyboard."""
    timeline = page.locator("#timeline")
    timeline.focus()
    page.keyboard.press("Home")
    shown(page, 0)
    for _ in range(frame // 10):
        before = int(timeline.get_attribute("aria-valuenow"))
        page.keyboard.press("PageDown")
        shown(page, before + 10)


def shown(page, frame):
    page.locator(f"#timeline[aria-valuenow='{frame}']").wait_for()


def of_target(table, target):
    return [row for row in table if row["target"] == str(target)]


def values(table):
    return [(row["frame"], numbers(row), row["score"], row["status"]) for row in table]


def two_objects(page, clip):
    """The first object is the clip's; the second one is a part of the ground."""
    choose(page, "card")
    drag(page, clip["truth"][0])
    frames(page, 20)
    page.locator("#pause").click()
    page.locator("#add").click()
    said(page, "Draw a box around the object to add")
    drag(page, [20, 20, 60, 60])
    page.locator("#list li:nth-child(2)").wait_for()
    page.locator("#pause").click()
    page.locator("#list li:nth-child(1) input[type=radio]").check()
    to_the_end(page)


def objects_in(checks, where):
    page = checks.page(where=where)
    clip = checks.clips["card"]
    two_objects(page, clip)
    checks.shot(page, f"objects-{where}")
    checks.no_axe_violations(page, "two objects")
    table = rows(page)
    first, second = of_target(table, 0), of_target(table, 1)
    assert len(first) == 150 and near(first, clip["truth"]) >= 100
    begun = int(second[0]["frame"])
    assert 19 <= begun < 150 and [int(row["frame"]) for row in second] == list(range(begun, 150))
    assert numbers(second[0]) == [20, 20, 60, 60], second[0]

    to_frame(page, CORRECTED)
    mouse_tells_a_frame(page)
    checks.shot(page, f"earlier-{where}")
    box = [30, 200, 80, 60]
    drag(page, box)
    said(page, f"Followed anew from frame {CORRECTED}")
    after = rows(page)
    assert values(of_target(after, 1)) == values(second), "the other object has changed"
    redone = of_target(after, 0)
    assert values(redone[:CORRECTED]) == values(first[:CORRECTED]), "earlier frames have changed"
    assert len(redone) == 150
    assert all(abs(one - other) <= 1 for one, other in zip(numbers(redone[CORRECTED]), box)), redone[CORRECTED]
    assert values(redone[CORRECTED:]) != values(first[CORRECTED:])
    check_exports(page, after)
    page.get_by_role("button", name="Delete Object 2").click()
    assert not of_target(rows(page), 1)
    page.context.close()


def mouse_tells_a_frame(page):
    """Where the mouse is over the timeline, a line with the frame and its score is drawn."""
    timeline = page.locator("#timeline")
    drawn = lambda: timeline.evaluate("canvas => canvas.toDataURL('image/png')")
    before = drawn()
    timeline.hover(position={"x": 100, "y": 40})
    late = time.monotonic() + TO_THE_END / 1000
    while drawn() == before:
        assert time.monotonic() < late, "it tells nothing"
        page.wait_for_timeout(50)
    assert timeline.get_attribute("aria-valuenow") == str(CORRECTED), "the mouse has moved it"


def long_video(checks):
    """Of a video of minutes so much of the timeline is tracked after a second that one can go to a frame in it."""
    path = checks.files.folder / "long.mp4"
    run("ffmpeg", "-v", "error", "-y", "-f", "lavfi", "-i", "testsrc=size=160x120:rate=30:duration=120", *H264, path)
    page = checks.page(where="here")
    choose_file(page, path)
    slow(page)
    drag(page, [20, 20, 60, 60])
    frames(page, 20)
    page.locator("#pause").click()
    page.locator("#timeline").click(position={"x": 30, "y": 40})
    page.locator("body[data-state=paused]").wait_for()
    page.wait_for_function("Number(document.getElementById('timeline').getAttribute('aria-valuenow')) < 15")
    shown, last = (int(page.locator("#timeline").get_attribute(f"aria-value{name}")) for name in ("now", "max"))
    assert 2 < shown < 15 and last >= 19, (shown, last)
    page.context.close()


def check_exports(page, table):
    """All formats tell the same boxes."""
    told = {(int(row["frame"]), int(row["target"])): numbers(row) for row in table if row["status"] != "lost"}
    whole = {key: box for key, box in told.items() if box[0] >= 0 and box[1] >= 0 and box[0] + box[2] <= 480 and box[1] + box[3] <= 360}
    assert len(whole) > 100

    def same(found, by):
        assert set(found) >= set(whole)
        for key, box in whole.items():
            assert max(abs(one - other) for one, other in zip(found[key], box)) <= by, (key, found[key], box)

    lines = [line.split(",") for line in saved(page, "#save-mot").decode().splitlines()]
    assert len(lines) == len(table) and all(len(line) == 10 for line in lines)
    same({(int(f) - 1, int(t) - 1): [float(x) - 1, float(y) - 1, float(w), float(h)] for f, t, x, y, w, h, *_ in lines}, 0.001)

    coco = json.loads(saved(page, "#save-coco"))
    images = {image["id"]: image for image in coco["images"]}
    assert {category["name"] for category in coco["categories"]} == {"Object 1", "Object 2"}
    frame = lambda note: images[note["image_id"]]["frame_id"]
    same({(frame(note), note["category_id"] - 1): note["bbox"] for note in coco["annotations"]}, 0.01)
    assert len({note["id"] for note in coco["annotations"]}) == len(coco["annotations"])

    archive = zipfile.ZipFile(io.BytesIO(saved(page, "#save-yolo")))
    assert archive.testzip() is None and "data.yaml" in archive.namelist()
    found = {}
    for name in archive.namelist()[1:]:
        frame = int(re.search(r"(\d+)\.txt$", name)[1])
        for line in archive.read(name).decode().splitlines():
            target, x, y, w, h = line.split()
            w, h = float(w) * 480, float(h) * 360
            found[frame, int(target)] = [float(x) * 480 - w / 2, float(y) * 360 - h / 2, w, h]
    same(found, 0.01)

    cvat = xml.etree.ElementTree.fromstring(saved(page, "#save-cvat"))
    assert cvat.findtext("version") == "1.1" and cvat.findtext("meta/task/size") == "150"
    boxes = {}
    for track in cvat.iter("track"):
        for box in track.iter("box"):
            left, top, right, bottom = (float(box.get(side)) for side in ("xtl", "ytl", "xbr", "ybr"))
            boxes[int(box.get("frame")), int(track.get("id"))] = [left, top, right - left, bottom - top]
    assert len(boxes) == len(table)
    same(boxes, 0.011)


    [task] = json.loads(saved(page, "#save-label-studio"))
    found = {}
    for region in task["annotations"][0]["result"]:
        assert region["type"] == "videorectangle" and region["value"]["framesCount"] == 150, region
        for box in region["value"]["sequence"]:
            scaled = [box["x"] * 4.8, box["y"] * 3.6, box["width"] * 4.8, box["height"] * 3.6]
            found[box["frame"] - 1, int(region["id"].split("-")[1]) - 1] = scaled
    # Label Studio has no box for frames in which an object is lost.
    assert task["data"] == {"video": "card"} and told.keys() <= found.keys(), told.keys() - found.keys()
    same(found, 0.01)


def objects_in_the_page(checks):
    objects_in(checks, "here")


def objects_with_the_service(checks):
    objects_in(checks, "there")


def tracked_backwards(checks):
    """From a key frame in the middle to the beginning: frames before the first box are fetched, those after are kept."""
    page = checks.page(where="here")
    truth = checks.clips["card"]["truth"]
    choose(page, "card")
    begin_at(page, KEY / FRAMES_A_SECOND, KEY)
    drag(page, truth[KEY])
    frames(page, 10)
    page.locator("#stop").click()
    before = kept_rows(page)
    page.locator("#timeline").focus()
    page.keyboard.press("Home")
    shown(page, KEY)
    page.locator("#backwards").click()
    said(page, f"Followed {KEY} frames backwards")
    table = rows(page)
    assert [int(row["frame"]) for row in table] == list(range(KEY + len(before)))
    assert values(table[KEY:]) == values(before), "frames after the key frame have changed"
    close = near(table[:KEY], truth)
    print(f"  {close} of {KEY} frames within 10 px, backwards")
    assert close >= 0.9 * KEY
    assert page.locator("#frames").inner_text() == str(len(table))
    page.locator("#timeline").focus()
    page.keyboard.press("Home")
    shown(page, 0)
    page.locator("#undo").click()
    said(page, "is undone")
    # Undoing has removed the frame on the screen, so the last frame is shown.
    shown(page, KEY + len(before) - 1)
    assert page.locator("#frames").inner_text() == str(len(before)) and values(rows(page)) == values(before)
    page.locator("#timeline").focus()
    page.keyboard.press("Home")
    shown(page, KEY)
    page.context.close()


def saved_to_the_service(checks):
    """A session of the page goes on in the service: whole where it takes such states, else from its last frame."""
    for flags, says, whole in ((["--unsigned-snapshots"], "all that was learned", True), ([], "--unsigned-snapshots", False)):
        service = Service(checks.program, *flags)
        page = checks.page(url=service.url, where="here", allowed=("422",))
        choose(page, "card")
        drag(page, checks.clips["card"]["truth"][0])
        frames(page, 40)
        page.locator("#stop").click()
        table = kept_rows(page)
        for _ in range(2):
            page.locator("#hand-over").click()
            said(page, says)
            session = page.locator("#handed a").get_attribute("href")
            view = service.call("GET", f"/{session}")
            assert view["frames"] == (len(table) if whole else 1), (view, len(table))
            box = [view["answer"]["box"][side] for side in ("x", "y", "width", "height")]
            assert max(abs(one - other) for one, other in zip(box, numbers(table[-1]))) <= 0.02, (box, table[-1])
            # The same after the page was loaded anew.
            page.reload()
            said(page, "card is here again")
        page.context.close()
        service.stop()


def panel_of_a_new_source(checks):
    """Until its first box is answered, there is nothing of the run before beside a new source: no object to delete, no
    frame on the timeline, no figure."""
    page = checks.page(where="here")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    page.locator("#stop").click()
    kept_rows(page)
    held = []
    page.route("**/sessions/*?*box=*", lambda route: held.append(route))
    page.locator("#there").evaluate("button => button.click()")
    # The buttons of the sources are in a closed menu at this point.
    page.evaluate("document.getElementById('leaves').click()")
    said(page, "Draw a box around what to follow")
    with page.expect_request("**/sessions/*?*box=*"):
        drag(page, checks.clips["leaves"]["truth"][0])
    said(page, "Beginning")
    told = {name: page.locator(f"#{name}").inner_text() for name in ("status", "score", "frames", "rate", "trip", "skipped")}
    assert set(told.values()) == {"–"}, told
    assert page.locator("#list li").count() == 0, page.locator("#list").inner_html()
    assert page.locator("#undo").is_disabled() and page.locator("#backwards").is_disabled()
    shown(page, 0)
    page.locator("#timeline").click()
    page.locator("#timeline").press("End")
    assert page.locator("body").get_attribute("data-state") == "following", "the old timeline has paused it"
    held[0].continue_()
    frames(page, 10)
    assert page.get_by_label("Delete Object 1").count() == 1
    page.context.close()


FARTHEST = """() => {
    const own = CanvasRenderingContext2D.prototype.roundRect;
    window.farthest = 0;
    CanvasRenderingContext2D.prototype.roundRect = function (x, y, width, ...rest) {
        const right = ((x + width) * this.getTransform().a) / this.canvas.width;
        if (this.canvas.id === "overlay") window.farthest = Math.max(window.farthest, right);
        return own.call(this, x, y, width, ...rest);
    };
}"""
"""Notes how far to the right boxes and names are painted, as a share of the picture's width."""


def long_names(checks):
    """The name of a file and of an object, longer than there is room: nothing runs over the edge, of the page or of the
    picture."""
    short = checks.files.file("clip.mp4", 30, H264)
    path = short.with_name("a_recording_of_the_whole_" + 8 * "afternoon_" + ".mp4")
    path.write_bytes(short.read_bytes())
    page = checks.page(where="here", viewport={"width": 400, "height": 800})
    slow(page)
    choose_file(page, path)
    drag(page, sent_box(checks.files.truth[0]))
    frames(page, 10)
    page.locator("#pause").click()
    page.locator("#add").click()
    drag(page, [850, 100, 90, 90])
    page.evaluate(FARTHEST)
    page.locator("#list li:nth-child(2) input[type=text]").fill("what stands at the edge of the field " * 3)
    kept_rows(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
    assert 0.9 < page.evaluate("window.farthest") <= 1.001, page.evaluate("window.farthest")
    page.context.close()


def seen_no_more(checks):
    """What the tracker sees goes from the picture when it is switched off, also of a paused run, and comes back."""
    page = checks.page(where="here")
    page.locator("#see").evaluate("box => box.checked || box.click()")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    page.locator("#pause").click()
    kept_rows(page)
    over = lambda: page.evaluate("document.getElementById('overlay').toDataURL()")
    before = over()
    page.locator("#see").evaluate("box => box.click()")
    assert over() != before
    page.locator("#see").evaluate("box => box.click()")
    assert over() == before
    page.context.close()


ICON = """() => {
    const button = document.getElementById("pause");
    return [getComputedStyle(button, "::before").backgroundColor, getComputedStyle(button).color];
}"""


def colors_of_the_system(checks):
    """Where the system's colours take the place of the page's, icons have that of their text."""
    page = checks.page(where="here", forced_colors="active")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    page.locator("#pause").click()
    icon, text = page.evaluate(ICON)
    assert icon == text, (icon, text)
    page.context.close()


def whole_picture(checks):
    """On a low screen the bar covers nothing of the picture in which one is to draw, and the first screen is filled. On a
    narrow one what the page says covers nothing of it, also where the first screen was scrolled."""
    page = checks.page(where="here", viewport={"width": 844, "height": 390}, has_touch=True, is_mobile=True)
    panel, welcome = (page.locator(name).bounding_box()["width"] for name in (".panel", "#welcome"))
    assert panel == welcome, (panel, welcome)
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    picture, controls = (page.locator(name).bounding_box() for name in ("#picture", "#controls"))
    assert picture["y"] >= 0 and picture["y"] + picture["height"] <= controls["y"], (picture, controls)
    page.context.close()
    page = checks.page(where="here", viewport={"width": 390, "height": 700}, has_touch=True, is_mobile=True)
    page.locator("#program").scroll_into_view_if_needed()
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    picture, message = (page.locator(name).bounding_box() for name in ("#picture", "#message"))
    assert message["width"] == 390 and picture["y"] >= message["y"] + message["height"], (picture, message)
    page.context.close()


ALL = [
    objects_in_the_page,
    objects_with_the_service,
    tracked_backwards,
    long_video,
    saved_to_the_service,
    panel_of_a_new_source,
    long_names,
    seen_no_more,
    colors_of_the_system,
    whole_picture,
]

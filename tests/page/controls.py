"""Keyboards and fingers: where the focus goes, keys of other letters, a second finger."""

import json
import time

from browser import (
    DRAW,
    TO_THE_END,
    choose,
    corners,
    drag,
    frames,
    held,
    kept_rows,
    said,
    say_nothing,
    saved,
    stop,
    to_the_end,
)
from clips import H264
from files import sent_box
from studio import shown, to_frame

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True, "device_scale_factor": 2}
FOCUS = "document.activeElement.getAttribute('aria-label') ?? document.activeElement.id"


def add_by_keyboard(page, *keys):
    """Adds an object: the focus goes to the picture, and the picture to where it is seen."""
    page.locator("#add").focus()
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "picture"
    area = page.locator("#picture").bounding_box()
    assert area["y"] < page.viewport_size["height"] and area["y"] + area["height"] > 0, area
    count = page.locator("#list li").count()
    for key in ("Enter", *keys, "Enter"):
        page.keyboard.press(key)
    page.locator("#list li").nth(count).wait_for()


def objects_by_keyboard(checks):
    """Who adds, names and deletes objects by keyboard, on a laptop at 150 %, stays where they are in the list, and is
    told the names that objects have."""
    page = checks.page(where="here", viewport={"width": 911, "height": 433}, device_scale_factor=1.5, locale="he-IL")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 5)
    page.keyboard.press("Space")
    for count in range(3):
        add_by_keyboard(page, *["ArrowLeft"] * 4 * count)
    names = page.locator("#list input[type=text]")
    for at, name in enumerate(("van", "שלום", "bus", "cat")):
        names.nth(at).focus()
        page.keyboard.press("Control+a")
        page.keyboard.type(name)
    told = [page.locator("#list button.remove").nth(at).get_attribute("aria-label") for at in range(4)]
    assert told == ["Delete van", "Delete שלום", "Delete bus", "Delete cat"], told
    page.locator("#list button.remove").nth(1).focus()
    for left in ("bus", "cat"):
        page.keyboard.press("Enter")
        page.get_by_label(f"Delete {left}").wait_for()
        assert page.evaluate(FOCUS) == f"Delete {left}", page.evaluate(FOCUS)
    # A restored object gets the focus: otherwise Enter would delete the one beside it.
    page.keyboard.press("Control+z")
    page.get_by_label("Delete bus").wait_for()
    assert page.evaluate(FOCUS) == "Choose bus", page.evaluate(FOCUS)
    page.locator("#list button.remove").nth(1).focus()
    page.keyboard.press("Enter")
    page.get_by_label("Delete bus").wait_for(state="detached")
    # A restored object does not take the focus from a name field.
    names.nth(1).focus()
    page.locator("#undo").evaluate("button => button.click()")
    page.keyboard.type("!")
    page.locator("#list li").nth(2).wait_for()
    page.keyboard.type("?")
    stored = json.loads(saved(page, "#save-project"))["objects"]
    assert sorted(found["name"] for found in stored) == ["bus", "cat!?", "van"], stored
    checks.no_axe_violations(page, "objects")
    # After a click, Space is the page's shortcut, and deletes no other object.
    page.locator("#list button.remove").first.click()
    page.keyboard.press("Space")
    assert page.locator("#list li").count() == 2
    page.context.close()


def focus_in_the_list(checks):
    """An object that is new after a while leaves the focus where one has gone meanwhile. Where the last one is deleted by
    keyboard, the focus is beside it, and comes back with it."""
    page = checks.page(where="here")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    page.locator("#pause").click()
    # Waits until no request for a picture is open: it would count as one of those that are let through.
    kept_rows(page)
    to_frame(page, 10)
    release = held(page, 5)
    page.locator("#add").click()
    drag(page, [30, 200, 80, 60])
    said(page, "Following: frame 1")
    page.keyboard.press("Shift")
    page.locator("#list button.remove").focus()
    assert page.locator("#list button.remove:focus-visible").count() == 1
    release()
    page.get_by_label("Delete Object 2").wait_for()
    assert page.evaluate(FOCUS) == "Delete Object 1", page.evaluate(FOCUS)
    page.keyboard.press("Enter")
    assert page.evaluate(FOCUS) == "Delete Object 2", page.evaluate(FOCUS)
    page.keyboard.press("Enter")
    said(page, DRAW)
    assert page.evaluate(FOCUS) == "add", page.evaluate(FOCUS)
    page.keyboard.press("Control+z")
    page.get_by_label("Delete Object 2").wait_for()
    assert page.evaluate(FOCUS) == "Choose Object 2", page.evaluate(FOCUS)
    page.context.close()


def keyboard_of_other_letters(checks):
    """Shortcuts are where they are on a Latin keyboard: Ctrl+Z undoes, though the key is a я; so with Caps Lock."""
    page = checks.page(where="here")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    to_the_end(page)
    keys = page.context.new_cdp_session(page)

    def press(key, code, modifiers=0):
        for kind in ("keyDown", "keyUp"):
            keys.send("Input.dispatchKeyEvent", {"type": kind, "key": key, "code": code, "modifiers": modifiers})

    to_frame(page, 140)
    for key, code, frame in (("в", "KeyD", 139), ("а", "KeyF", 140), ("D", "KeyD", 139)):
        press(key, code)
        shown(page, frame)
    drag(page, [20, 20, 60, 60])
    said(page, "Followed anew from frame 139")
    press("я", "KeyZ", modifiers=2)
    said(page, "is undone")
    page.context.close()


def second_finger(checks):
    """A hand that touches the picture while a finger draws changes nothing of the box, and does not end it."""
    page = checks.page(where="here", **PHONE)
    choose(page, "card")
    page.locator("#draw").tap()
    page.locator("#draw[aria-pressed=true]").wait_for()
    page.locator("#picture").scroll_into_view_if_needed()
    truth = checks.clips["card"]["truth"][0]
    (left, top), (right, bottom) = corners(page, truth)
    touch = page.context.new_cdp_session(page)

    def touched(kind, **fingers):
        touches = [{"x": x, "y": y, "id": len(name)} for name, (x, y) in fingers.items()]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    touched("touchStart", one=(left, top))
    touched("touchMove", one=(right - 5, bottom - 5))
    touched("touchStart", one=(right - 5, bottom - 5), other=(right + 60, bottom + 60))
    touched("touchMove", one=(right, bottom), other=(right + 70, bottom + 70))
    # What is told of is lifted.
    touched("touchEnd", other=(right + 70, bottom + 70))
    assert page.locator("body[data-state=first]").count() == 1, "the second finger has ended the box"
    touched("touchEnd")
    frames(page, 5)
    row = json.loads(saved(page, "#save-project"))["objects"][0]["rows"][0]
    assert all(abs(drawn - side) < 4 for drawn, side in zip(row[2:6], truth)), (row, truth)
    page.context.close()


def drag_that_does_not_end(checks):
    """Where another window takes the focus while a box is drawn, and where the browser takes the finger, no end of it is
    told: the box is given up, and the next one is drawn from where it begins."""
    page = checks.page(where="here", **PHONE)
    choose(page, "card")
    page.locator("#picture").scroll_into_view_if_needed()
    truth = checks.clips["card"]["truth"][0]
    (left, top), (right, bottom) = corners(page, truth)
    hand = page.context.new_cdp_session(page)
    over = lambda: page.evaluate("document.getElementById('overlay').toDataURL()")
    nothing = over()

    def shows(is_box):
        late = time.monotonic() + TO_THE_END / 1000
        while (over() != nothing) != is_box:
            assert time.monotonic() < late, "the box is still there" if not is_box else "no box is drawn"
            page.wait_for_timeout(20)

    def mouse(kind, x, y, **more):
        hand.send("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, **more})

    def finger(kind, *points):
        touches = [{"x": x, "y": y} for x, y in points]
        hand.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    held = {"button": "left", "buttons": 1, "clickCount": 1}
    mouse("mousePressed", right + 60, top - 20, **held)
    mouse("mouseMoved", left, top, **held)
    shows(True)
    page.evaluate("() => void dispatchEvent(new Event('blur'))")
    shows(False)
    mouse("mouseMoved", right, bottom)
    shows(False)
    page.locator("#draw").tap()
    page.locator("#draw[aria-pressed=true]").wait_for()
    page.locator("#picture").scroll_into_view_if_needed()
    (left, top), (right, bottom) = corners(page, truth)
    finger("touchStart", (right + 60, top - 20))
    finger("touchMove", (left, top))
    shows(True)
    finger("touchCancel")
    shows(False)
    finger("touchStart", (left, top))
    finger("touchMove", (right, bottom))
    finger("touchEnd")
    frames(page, 5)
    row = json.loads(saved(page, "#save-project"))["objects"][0]["rows"][0]
    assert all(abs(drawn - side) < 4 for drawn, side in zip(row[2:6], truth)), (row, truth)
    page.context.close()


def steps_over_a_gap(checks):
    """Where frames were skipped, as a camera does, keys and buttons step to the next one that was tracked."""
    path = checks.files.file("clip.mp4", 30, H264)
    box = sent_box(checks.files.truth[0])
    table = [[frame, frame / 30, *box, 1, "tracking", int(frame == 0)] for frame in (0, 5, 10, 20, 40)]
    project = checks.files.folder / "gaps.bagtrack.json"
    video = {"name": "clip.mp4", "width": 1056, "height": 792}
    document = {"bagtrack_project": 1, "video": video, "ended": True, "objects": [{"rows": table}]}
    project.write_text(json.dumps(document))
    page = checks.page(where="here")
    page.locator("#file").set_input_files([project, path])
    said(page, "clip.mp4 is here again")
    page.locator("#timeline").focus()
    for key, frame in (("Home", 0), ("ArrowRight", 5), ("PageDown", 40), ("ArrowLeft", 20), ("PageUp", 0), ("f", 5)):
        page.keyboard.press(key)
        shown(page, frame)
    page.locator("#forward").click()
    shown(page, 10)
    page.locator("#picture").focus()
    for key, frame in (("ArrowRight", 20), ("f", 40), ("d", 20), ("ArrowLeft", 10)):
        page.keyboard.press(key)
        shown(page, frame)
    page.locator("#back").click()
    shown(page, 5)
    page.context.close()


def box_of_another_source(checks):
    """A box that is drawn as another source arrives is given up: it is not taken in that, and keys do what they do."""
    for begin, end in (
        (lambda page: page.keyboard.press("Enter"), lambda page: None),
        (lambda page: (page.mouse.move(400, 400), page.mouse.down(), page.mouse.move(500, 500)), lambda page: page.mouse.up()),
    ):
        page = checks.page(where="here")
        choose(page, "card")
        page.locator("#picture").focus()
        begin(page)
        say_nothing(page)
        # Opens the clip by script, as a dropped file would: a click would take the focus.
        page.evaluate("document.getElementById('leaves').click()")
        said(page, DRAW)
        page.mouse.move(520, 510)
        end(page)
        assert page.locator("body").get_attribute("data-state") == "first", "the box was taken"
        page.keyboard.press("f")
        page.locator("#begin-time").filter(has_text=", frame 1").wait_for(timeout=20_000)
        page.context.close()


def box_left_by_the_keyboard(checks):
    """A box that the keyboard has begun is given up with Escape, and where the focus goes elsewhere: it goes on."""
    page = checks.page(where="here")
    # It waits for this frame: it cannot have ended.
    page.route("**/sample/card/140.jpg", lambda route: None)
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 5)
    page.locator("#picture").focus()
    page.keyboard.press("Enter")
    before = int(page.locator("#frames").inner_text())
    page.locator("#pause").click()
    page.locator("body[data-state=paused]").wait_for()
    page.locator("#pause").click()
    frames(page, before + 1)
    page.keyboard.press("Space")
    page.locator("body[data-state=paused]").wait_for(timeout=20_000)
    page.locator("#picture").focus()
    page.keyboard.press("Enter")
    page.evaluate("() => void dispatchEvent(new KeyboardEvent('keydown', { key: 'Escape' }))")
    page.keyboard.press("Space")
    page.locator("body[data-state=following]").wait_for(timeout=20_000)
    stop(page)
    page.context.close()


def adding_given_up(checks):
    """"Add an object" pressed again, and Escape, give up to draw one. Where there is none, each button that saves says
    so. Space that is held pauses once."""
    page = checks.page(where="here")
    # It waits for this frame: it cannot have ended.
    page.route("**/sample/card/140.jpg", lambda route: None)
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 5)
    for _ in range(4):
        page.keyboard.down("Space")
    page.keyboard.up("Space")
    page.locator("body[data-state=paused]").wait_for(timeout=20_000)
    for again in (lambda: page.locator("#add").click(), lambda: page.keyboard.press("Escape")):
        page.locator("#add").click()
        said(page, "Draw a box around the object to add")
        again()
        page.locator("#add[aria-pressed=false]").wait_for(timeout=20_000)
        page.locator("#draw[aria-pressed=false]").wait_for(state="attached", timeout=20_000)
        said(page, "Adding is given up")
    page.get_by_label("Delete Object 1").click()
    for name in ("project", "csv", "video"):
        say_nothing(page)
        page.locator(f"#save-{name}").click()
        said(page, "There is no object to save")
    say_nothing(page)
    page.locator("#hand-over").click()
    said(page, "There is no object to save")
    page.context.close()


ALL = [
    objects_by_keyboard,
    focus_in_the_list,
    keyboard_of_other_letters,
    second_finger,
    drag_that_does_not_end,
    steps_over_a_gap,
    box_of_another_source,
    box_left_by_the_keyboard,
    adding_given_up,
]

"""The page in a real browser: Debian's Chromium, driven by Playwright.

    python3 tests/page/check.py target/debug/bagtrack [--shots FOLDER] [--only NAME...]

Needs the packages playwright and axe-playwright-python from PyPI, and chromium.
"""

import argparse
import contextlib
import functools
import http.server
import json
import pathlib
import re
import tempfile
import threading
import time
import urllib.parse

import budgets
import controls
import corrected
import files
import kept
import line
import local
import quickstart
import sources
import stopped
import studio
import welcome
from browser import (
    DRAW,
    TO_THE_END,
    WEB,
    Checks,
    choose,
    corners,
    drag,
    frames,
    kept_rows,
    near,
    numbers,
    painted,
    rows,
    said,
    saved,
    to_the_end,
    was_said,
)
from clips import Clips
from playwright.sync_api import sync_playwright
from service import Line, Service

MAX_BYTES = 200_000
MAX_SECONDS_TO_PICTURE = 1.0
EXAMPLES = WEB.parent / "clients" / "js" / "examples"
PICTURE = "document.getElementById('picture').toDataURL('image/png')"
LEAST_TARGET = 44
"""Least side of what a finger presses, in pixels of the screen."""
SMALL = """(least) => [...document.querySelectorAll("button, summary, a, input, canvas[role=slider]")]
    .map((element) => element.closest("label") ?? element)
    .filter((element) => element.checkVisibility() && !element.classList.contains("hidden"))
    .filter((element) => Math.min(element.offsetWidth, element.offsetHeight) < least)
    .map((element) => element.outerHTML)"""


def opened(page, start):
    """What the session was opened with: its box and its seed."""
    with page.expect_response(lambda response: "?box=" in response.url) as response:
        start()
    created = response.value.json()
    query = urllib.parse.parse_qs(urllib.parse.urlsplit(response.value.url).query)
    session = urllib.parse.urljoin(response.value.url, response.value.headers["location"])
    view = page.request.get(session).json()
    return query["box"][0], view["parameters"]["seed"]


def same_as_the_api(checks, table, clip, box, seed):
    plain = checks.service.track(clip, box, seed, len(table))
    assert len(table) == len(plain) + 1
    for row, answer in zip(table[1:], plain):
        assert int(row["frame"]) == answer["frame"]
        assert numbers(row) == [answer["box"][name] for name in ("x", "y", "width", "height")], (row, answer)
        assert float(row["score"]) == answer["score"] and row["status"] == answer["status"]


def weight_and_first_picture(checks):
    page = checks.page()
    page.wait_for_load_state("networkidle")
    sizes = page.evaluate("""['navigation', 'resource'].flatMap((kind) => performance.getEntriesByType(kind))
        .map((entry) => [entry.name, entry.decodedBodySize])""")
    total = sum(size for _, size in sizes)
    print(f"  the page has {total} bytes in {len(sizes)} files")
    assert 10_000 < total <= MAX_BYTES, sizes
    begun, seconds = budgets.asked(), []
    for _ in range(3):
        page.reload()
        started = time.monotonic()
        choose(page, "card")
        seconds.append(time.monotonic() - started)
    print(f"  the first picture after {min(seconds):.2f} s")
    share, _ = min(begun, budgets.asked())
    assert min(seconds) <= MAX_SECONDS_TO_PICTURE / share, seconds


def sample_by_mouse(checks):
    page = checks.page()
    truth = checks.clips["card"]["truth"]
    checks.shot(page, "start-light")
    checks.no_axe_violations(page, "start")
    page.locator("#see").evaluate("box => box.click()")
    choose(page, "card")
    box, seed = opened(page, lambda: drag(page, truth[0]))
    frames(page, 60)
    checks.no_axe_violations(page, "following")
    checks.shot(page, "following-light")
    print(f"  {page.locator('#rate').inner_text()} frames/s, {page.locator('#trip').inner_text()}")
    to_the_end(page)
    table = rows(page)
    count = near(table, truth)
    print(f"  {count} of {len(table)} frames within 10 px")
    assert count >= 100 and len(table) == 150
    same_as_the_api(checks, table, "card", box, seed)
    stored = json.loads(saved(page, "#save-json"))
    assert [float(row["x"]) for row in table] == [row["x"] for row in stored["boxes"]]
    page.context.close()


def lost_and_found(checks):
    page = checks.page(color_scheme="dark")
    truth = checks.clips["leaves"]["truth"]
    choose(page, "leaves")
    drag(page, truth[0])
    was_said(page, "The target is lost")
    checks.shot(page, "lost-dark")
    was_said(page, "Found again")
    to_the_end(page)
    checks.shot(page, "ended-dark")
    checks.no_axe_violations(page, "ended, dark")
    table = rows(page)
    assert any(row["status"] == "lost" for row in table)
    assert near(table[-20:], truth) == 20, table[-20:]
    page.context.close()


def broken_line(checks):
    line = Line(checks.service.port)
    page = checks.page(url=line.url, allowed=("WebSocket", "ERR_CONNECTION", "ERR_EMPTY", "Failed to load"))
    truth = checks.clips["card"]["truth"]
    choose(page, "card")
    box, seed = opened(page, lambda: drag(page, truth[0]))
    for count in (30, 70):
        frames(page, count)
        assert line.cut() > 0
    to_the_end(page)
    table = rows(page)
    assert [int(row["frame"]) for row in table] == list(range(150))
    same_as_the_api(checks, table, "card", box, seed)
    page.context.close()


def phone_by_touch(checks):
    page = checks.page(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True, device_scale_factor=2)
    truth = checks.clips["card"]["truth"]
    page.locator("#card").tap()
    said(page, DRAW)
    page.locator("#picture").scroll_into_view_if_needed()
    (left, top), (right, bottom) = corners(page, truth[0])
    touch = page.context.new_cdp_session(page)

    def finger(kind, *points):
        touches = [{"x": x, "y": y} for x, y in points]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    def swipe():
        """A finger moves up over the picture; the page follows it, and no box is drawn."""
        before = page.evaluate("scrollY")
        x, y = (left + right) / 2, bottom
        finger("touchStart", (x, y))
        for step in range(1, 12):
            finger("touchMove", (x, y - 12 * step))
            page.wait_for_timeout(16)
        finger("touchEnd")
        late = time.monotonic() + TO_THE_END / 1000
        while (scrolled := page.evaluate("scrollY") - before) <= 50:
            assert time.monotonic() < late, scrolled
            page.wait_for_timeout(50)
        stands_still(page)
        page.evaluate("y => scrollTo(0, y)", before)

    swipe()
    said(page, "Tap Draw")
    assert page.locator("#figures").is_hidden(), "the swipe has drawn a box"
    look = lambda: page.locator("#draw").evaluate("button => getComputedStyle(button).backgroundColor")
    off = look()
    page.locator("#draw").tap()
    page.locator("#draw[aria-pressed=true]").wait_for()
    assert look() != off, "one cannot see that it is on"
    page.locator("#picture").scroll_into_view_if_needed()
    (left, top), (right, bottom) = corners(page, truth[0])
    finger("touchStart", (left, top))
    finger("touchMove", ((left + right) / 2, bottom))
    finger("touchMove", (right, bottom))
    finger("touchEnd")
    frames(page, 30)
    (left, top), (right, bottom) = corners(page, truth[30])
    swipe()
    frames(page, 60)
    checks.shot(page, "phone")
    width = page.evaluate("document.documentElement.scrollWidth")
    assert width <= 390, f"{width} px wide"
    small = page.evaluate(SMALL, LEAST_TARGET)
    assert not small, small
    # Phones zoom in on text fields with smaller letters.
    letters = page.locator("#list input[type=text]").evaluate("input => parseFloat(getComputedStyle(input).fontSize)")
    assert letters >= 16, letters
    to_the_end(page)
    stays_while_scrolled(page)
    table = rows(page)
    assert near(table, truth) >= 100 and len(table) == 150
    page.context.close()


def stands_still(page):
    """Waits until the page rolls no more: a tap would only stop it."""
    before = None
    while (now := page.evaluate("scrollY")) != before:
        before = now
        page.wait_for_timeout(100)


def stays_while_scrolled(page):
    """The picture stays, and the buttons are at the lower edge, while what is under them is scrolled to its end."""
    page.locator("#results").get_by_text("Label Studio").scroll_into_view_if_needed()
    assert page.evaluate("scrollY") > 200
    picture, controls = (page.locator(name).bounding_box() for name in ("#picture", "#controls"))
    assert picture["y"] >= 0 and picture["y"] + picture["height"] < controls["y"], (picture, controls)
    assert round(controls["y"] + controls["height"]) == 844, controls


def keyboard_alone(checks):
    page = checks.page()
    page.locator("#card").focus()
    page.keyboard.press("Enter")
    said(page, DRAW)
    page.locator("#picture").focus()
    for key in ("Enter", "ArrowLeft", "ArrowUp", "Shift+ArrowRight", "Shift+ArrowDown", "Enter"):
        page.keyboard.press(key)
    frames(page, 10)
    page.locator("#stop").click()
    first = numbers(rows(page)[0])
    assert first == [191, 131, 94, 94], first
    page.context.close()


def shortcuts(checks):
    """They work after a box was drawn and after buttons were clicked; not where one writes, and Tab keeps Space."""
    page = checks.page(where="here", viewport={"width": 1000, "height": 500})
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    scrolled = page.evaluate("scrollY")
    page.keyboard.press("Space")
    page.locator("body[data-state=paused]").wait_for()
    assert page.evaluate("scrollY") == scrolled
    last = len(kept_rows(page)) - 1
    page.locator("#back").click()
    at = lambda frame: page.locator(f"#timeline[aria-valuenow='{frame}']").wait_for()
    at(last - 1)
    for key, by in (("d", 2), ("ArrowLeft", 3), ("f", 2), ("ArrowRight", 1)):
        page.keyboard.press(key)
        at(last - by)
    page.locator("#picture").focus()
    for key, by in (("ArrowLeft", 2), ("d", 3), ("ArrowRight", 2)):
        page.keyboard.press(key)
        at(last - by)
    page.locator("#list input[type=text]").fill("")
    page.keyboard.type("a d f")
    assert page.locator("#list input[type=text]").input_value() == "a d f"
    at(last - 2)
    page.locator("#timeline").focus()
    page.keyboard.press("Tab")
    page.keyboard.press("Space")
    at(last - 3)
    page.locator("#back").evaluate("button => button.blur()")
    page.keyboard.press("Space")
    page.locator("body[data-state=following]").wait_for()
    page.context.close()


@contextlib.contextmanager
def camera_of_the_clip(checks):
    """A browser whose camera shows the sample clip."""
    with tempfile.NamedTemporaryFile(suffix=".mjpeg") as clip:
        for index in range(0, 150, 3):
            clip.write(checks.service.bytes(f"/sample/card/{index}.jpg"))
        clip.flush()
        browser = checks.launch(
            "--use-fake-ui-for-media-stream",
            "--use-fake-device-for-media-stream",
            f"--use-file-for-fake-video-capture={clip.name}",
        )
        yield browser
        browser.close()


def camera(checks):
    with camera_of_the_clip(checks) as browser:
        page = checks.page(browser=browser)
        page.locator("#camera").click()
        said(page, DRAW)
        shown = {page.evaluate(PICTURE)}
        while len(shown) < 5:
            page.wait_for_timeout(50)
            shown.add(page.evaluate(PICTURE))
        (left, top), (right, bottom) = corners(page, checks.clips["card"]["truth"][0])
        page.mouse.move(left, top)
        page.mouse.down()
        late = time.monotonic() + TO_THE_END / 1000
        still = ""
        while (now := page.evaluate(PICTURE)) != still:
            assert time.monotonic() < late, "the picture moves while the box is drawn"
            still = now
            page.wait_for_timeout(300)
        page.mouse.move(right, bottom, steps=4)
        page.mouse.up()
        frames(page, 30)
        page.locator("#stop").click()
        # The camera's pictures are not kept, so the page asks before another source replaces it. The test answers no.
        page.locator("#sources summary").click()
        page.locator("#card").click()
        said(page, "camera stays")
        table = rows(page)
        skipped = int(page.locator("#skipped").inner_text())
        numbers = [int(row["frame"]) for row in table]
        assert numbers == sorted(set(numbers)) and numbers[-1] + 1 <= len(table) + skipped, (numbers, skipped)
        assert float(table[-1]["time"]) > float(table[1]["time"]) > 0
        assert table[0]["video"] == "camera"
        print(f"  {len(table)} frames of the camera, {skipped} skipped")
        page.locator("#kept-text").filter(has_text="The pictures are not kept").wait_for()
        page.reload()
        said(page, "Pictures of the camera are not kept")


def page_of_another_origin(checks):
    """The example of the JavaScript client, with a camera."""
    pages = http.server.SimpleHTTPRequestHandler
    pages.log_message = lambda *_: None
    elsewhere = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(pages, directory=EXAMPLES))
    threading.Thread(target=elsewhere.serve_forever, daemon=True).start()
    origin = f"http://127.0.0.1:{elsewhere.server_port}"
    service = Service(checks.program, "--cors-origins", origin)
    with camera_of_the_clip(checks) as browser:
        page = browser.new_page()
        page.goto(f"{origin}/camera.html?service={service.url}")
        page.locator("#message").filter(has_text="Drag a box").wait_for()
        drag(page, checks.clips["card"]["truth"][0])
        page.locator("#message").filter(has_text=re.compile("Frame ([3-9][0-9]|[0-9]{3,}): ")).wait_for(timeout=TO_THE_END)
        drag(page, checks.clips["card"]["truth"][0])
        told = page.locator("#message").inner_text()
        assert re.fullmatch("Frame [0-9]+: (tracking|uncertain|lost)", told), told
        # A click draws a box without sides, which is refused: the session goes on.
        with page.expect_response(lambda response: "/target?" in response.url and response.status == 422) as refused:
            page.locator("#picture").click()
        number = int(re.search("frame=([0-9]+)", refused.value.url)[1])
        later = "(number) => Number(/^Frame ([0-9]+)/.exec(document.getElementById('message').textContent)?.[1]) >= number"
        page.wait_for_function(later, arg=number)
    service.stop()
    elsewhere.shutdown()


def camera_refused(checks):
    page = checks.page()
    page.locator("#camera").click()
    page.locator("#message.bad").wait_for()
    told = page.locator("#message").inner_text()
    assert "camera" in told and "video file" in told, told
    page.context.close()


def session_ended_elsewhere(checks):
    """The session is ended behind the page's back. The page goes on from its snapshot."""
    page = checks.page(allowed=("404",))
    truth = checks.clips["card"]["truth"]
    with page.expect_response(lambda response: "?box=" in response.url) as response:
        choose(page, "card")
        box, seed = opened(page, lambda: drag(page, truth[0]))
    frames(page, 45)
    checks.service.delete(response.value.json()["id"])
    to_the_end(page)
    same_as_the_api(checks, rows(page), "card", box, seed)
    page.context.close()


def asked_for_a_key(checks):
    """A page in which a first box is drawn, of a service that wants a key; and the service."""
    service = Service(checks.program, BAGTRACK_API_KEYS="page:0123456789abcdef")
    page = checks.page(url=service.url, allowed=("401",))
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    said(page, "asks for an API key")
    return page, service


def key_needed(checks):
    page, service = asked_for_a_key(checks)
    checks.shot(page, "key-light")
    # The box stays while the user types the key, and until the service has answered.
    painted(page, "overlay")
    held = []
    opening = "**/sessions/*?box=*"
    page.route(opening, lambda route: held.append(route))
    page.locator("#key").fill("neither")
    with page.expect_request(opening):
        page.keyboard.press("Enter")
    painted(page, "overlay")
    held[0].continue_()
    said(page, "does not know this key")
    page.unroute(opening)
    for key, says in (("not the key", "does not know this key"), ("0123456789abcdef", "Following")):
        page.locator("#key").fill(key)
        page.keyboard.press("Enter")
        said(page, says)
    frames(page, 20)
    page.context.close()
    service.stop()


def key_not_needed(checks):
    """Who is asked for a key and chooses another source, which needs none, is asked no more."""
    page, service = asked_for_a_key(checks)
    page.locator("#key-form").wait_for()
    page.locator("#sources summary").click()
    page.locator("#here").check()
    page.locator("#leaves").click()
    said(page, DRAW)
    assert page.locator("#key-form").is_hidden()
    page.context.close()
    service.stop()


def busy_service(checks):
    service = Service(checks.program, "--max-sessions", "1")
    box = ",".join(str(value) for value in checks.clips["card"]["truth"][0][:4])
    service.call("POST", f"/sessions?box={box}", service.bytes("/sample/card/0.jpg"))
    page = checks.page(url=service.url, allowed=("503",))
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    said(page, "The service is busy")
    page.context.close()
    service.stop()


ALL = [
    weight_and_first_picture,
    *welcome.ALL,
    sample_by_mouse,
    lost_and_found,
    broken_line,
    phone_by_touch,
    keyboard_alone,
    shortcuts,
    camera,
    page_of_another_origin,
    camera_refused,
    session_ended_elsewhere,
    key_needed,
    key_not_needed,
    busy_service,
    *budgets.ALL,
    *controls.ALL,
    *corrected.ALL,
    *files.ALL,
    *line.ALL,
    *local.ALL,
    *kept.ALL,
    *quickstart.ALL,
    *sources.ALL,
    *stopped.ALL,
    *studio.ALL,
]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--shots", help="where to put pictures of the page")
    parser.add_argument("--only", nargs="+", help="names of checks")
    parser.add_argument("--from-disk", action="store_true", help="takes the page from web/, not from the program")
    arguments = parser.parse_args()
    service = Service(arguments.program)
    try:
        with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
            checks = Checks(playwright, service, Clips(arguments.program, folder), arguments)
            for check in ALL:
                if not arguments.only or check.__name__ in arguments.only:
                    print(check.__name__, flush=True)
                    begun = time.monotonic()
                    check(checks)
                    assert not checks.faults, checks.faults
                    print(f"  ({time.monotonic() - begun:.0f} s)")
            checks.browser.close()
    finally:
        service.stop()
    print("The page does what it should.")


if __name__ == "__main__":
    main()

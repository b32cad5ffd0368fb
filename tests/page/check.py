"""The page in a real browser: Debian's Chromium, driven by Playwright.

    python3 tests/page/check.py target/debug/bagtrack [--shots FOLDER] [--only NAME]

Needs the packages playwright and axe-playwright-python from PyPI, and chromium.
"""

import argparse
import contextlib
import csv
import functools
import http.server
import io
import json
import pathlib
import re
import tempfile
import threading
import time
import urllib.parse

import axe_playwright_python
from playwright.sync_api import sync_playwright
from service import Line, Service

AXE = next(pathlib.Path(axe_playwright_python.__file__).parent.rglob("axe.min.js")).read_text()
MAX_BYTES = 150_000
MAX_SECONDS_TO_PICTURE = 1.0
FRAMES_A_SECOND = 25
TO_THE_END = 60_000
DRAW = "Draw a box around what to follow"
WEB = pathlib.Path(__file__).resolve().parents[2] / "web"
EXAMPLES = WEB.parent / "clients" / "js" / "examples"


class Checks:
    """One browser and one service, and what all pages of it must not do."""

    def __init__(self, playwright, service, arguments):
        self.playwright = playwright
        self.service = service
        self.program = arguments.program
        self.shots = arguments.shots
        self.from_disk = arguments.from_disk
        self.faults = []
        self.browser = self.launch()
        self.clips = {name: service.call("GET", f"/sample/{name}/clip.json") for name in ("card", "leaves")}

    def launch(self, *flags):
        # A page that does not come from the service's address may not open its socket.
        own = ["--no-sandbox"] + ["--disable-features=LocalNetworkAccessChecks"] * self.from_disk
        return self.playwright.chromium.launch(executable_path="/usr/bin/chromium", args=[*own, *flags])

    def page(self, url=None, browser=None, allowed=(), **options):
        """A new page of the service, watched for faults. `allowed` are texts of faults that a check provokes."""
        context = (browser or self.browser).new_context(**{"viewport": {"width": 1000, "height": 1100}, **options})
        page = context.new_page()
        url = url or self.service.url

        def fault(text):
            if not any(part in text for part in allowed):
                self.faults.append(text)

        page.on("console", lambda message: message.type == "error" and fault(f"console: {message.text}"))
        page.on("pageerror", lambda error: fault(f"script: {error}"))
        own = ("http://127.0.0.1", "ws://127.0.0.1", "blob:", "data:")
        page.on("request", lambda request: request.url.startswith(own) or fault(f"request to {request.url}"))
        if self.from_disk:
            page.route("**/page/**", lambda route: route.fulfill(path=on_disk(route.request.url)))
            page.route(url + "/", lambda route: route.fulfill(path=WEB / "index.html"))
        page.goto(url + "/")
        said(page, "Nothing is uploaded")
        return page

    def shot(self, page, name):
        if self.shots:
            page.screenshot(path=pathlib.Path(self.shots) / f"{name}.png", full_page=True)

    def no_axe_violations(self, page, where):
        page.evaluate(AXE)
        found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")["violations"]
        told = [(fault["id"], [node["html"] for node in fault["nodes"]]) for fault in found]
        assert not told, f"{where}: {told}"


def on_disk(url):
    """A file of the page, or of the client that it uses."""
    path = url.split("/page/")[1]
    return (WEB.parent / "clients" if path.startswith("js/") else WEB) / path


def said(page, text):
    """Waits until the page says this."""
    try:
        page.locator("#message").filter(has_text=text).wait_for(timeout=TO_THE_END)
    except Exception:
        print("  it says:", page.locator("#message").inner_text())
        raise


def choose(page, clip):
    page.locator(f"#{clip}").click()
    said(page, DRAW)


def corners(page, box):
    """The corners of a box of the picture, in pixels of the window."""
    area = page.locator("#picture").bounding_box()
    width = page.evaluate("document.getElementById('picture').width")
    scale = area["width"] / width
    x, y, w, h = box[:4]
    return [(area["x"] + a * scale, area["y"] + b * scale) for a, b in ((x, y), (x + w, y + h))]


def drag(page, box):
    page.locator("#picture").scroll_into_view_if_needed()
    (left, top), (right, bottom) = corners(page, box)
    page.mouse.move(left, top)
    page.mouse.down()
    page.mouse.move((left + right) / 2, bottom)
    page.mouse.move(right, bottom)
    page.mouse.up()


def frames(page, count):
    """Waits until the page has shown so many. Its policy forbids to evaluate texts in it."""
    late = time.monotonic() + TO_THE_END / 1000
    while not (shown := page.locator("#frames").inner_text()).isdigit() or int(shown) < count:
        assert time.monotonic() < late, f"{shown} frames; it says: {page.locator('#message').inner_text()}"
        page.wait_for_timeout(50)


def to_the_end(page):
    said(page, "The video has ended")


def saved(page, button):
    with page.expect_download() as download:
        page.locator(button).click()
    return pathlib.Path(download.value.path()).read_bytes()


def rows(page):
    return list(csv.DictReader(io.StringIO(saved(page, "#save-csv").decode())))


def numbers(row):
    return [float(row[name]) for name in ("x", "y", "width", "height")]


def distance(row, truth):
    x, y, width, height = numbers(row)
    across = x + width / 2 - truth[0] - truth[2] / 2
    down = y + height / 2 - truth[1] - truth[3] / 2
    return (across**2 + down**2) ** 0.5


def near(table, truth):
    """How many rows are within 10 pixels of the truth."""
    at = lambda row: truth[round(float(row["time"]) * FRAMES_A_SECOND)]
    return sum(distance(row, at(row)) <= 10 for row in table)


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
    seconds = []
    for _ in range(3):
        page.reload()
        started = time.monotonic()
        choose(page, "card")
        seconds.append(time.monotonic() - started)
    print(f"  the first picture after {min(seconds):.2f} s")
    assert min(seconds) <= MAX_SECONDS_TO_PICTURE, seconds


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
    assert [float(row["x"]) for row in table] == [row["x"] for row in stored]
    page.context.close()


def correction_and_recording(checks):
    page = checks.page()
    truth = checks.clips["card"]["truth"]
    choose(page, "card")
    page.locator("#record").check()
    drag(page, truth[0])
    frames(page, 20)
    page.locator("#pause").click()
    drag(page, [10, 10, 60, 50])
    said(page, "The box is corrected")
    page.locator("#pause").click()
    frames(page, 40)
    page.locator("#stop").click()
    table = rows(page)
    drawn = {"x": 10, "y": 10, "width": 60, "height": 50}
    corrected = [row for row in table[1:] if all(float(row[side]) == value for side, value in drawn.items())]
    assert len(corrected) == 1, corrected
    assert [int(row["frame"]) for row in table] == list(range(len(table)))
    video = saved(page, "#save-video")
    assert video.startswith(b"\x1a\x45\xdf\xa3") and len(video) > 10_000, "no WebM"
    page.context.close()


def lost_and_found(checks):
    page = checks.page(color_scheme="dark")
    truth = checks.clips["leaves"]["truth"]
    choose(page, "leaves")
    drag(page, truth[0])
    said(page, "The target is lost")
    checks.shot(page, "lost-dark")
    said(page, "Found again")
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

    finger("touchStart", (left, top))
    finger("touchMove", ((left + right) / 2, bottom))
    finger("touchMove", (right, bottom))
    finger("touchEnd")
    frames(page, 60)
    checks.shot(page, "phone")
    width = page.evaluate("document.documentElement.scrollWidth")
    assert width <= 390, f"{width} px wide"
    to_the_end(page)
    assert near(rows(page), truth) >= 100
    page.context.close()


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
        drag(page, checks.clips["card"]["truth"][0])
        frames(page, 30)
        page.locator("#stop").click()
        table = rows(page)
        assert [int(row["frame"]) for row in table] == list(range(len(table)))
        print(f"  {len(table)} frames of the camera, {page.locator('#skipped').inner_text()} skipped")


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
        page.locator("#message").filter(has_text=re.compile("Frame [3-9][0-9]: ")).wait_for(timeout=TO_THE_END)
        drag(page, checks.clips["card"]["truth"][0])
        told = page.locator("#message").inner_text()
        assert re.fullmatch("Frame [0-9]+: (tracking|uncertain|lost)", told), told
    service.stop()
    elsewhere.shutdown()


def camera_refused(checks):
    page = checks.page()
    page.locator("#camera").click()
    page.locator("#message.bad").wait_for()
    told = page.locator("#message").inner_text()
    assert "camera" in told and "video file" in told, told
    page.context.close()


def ended_session(checks):
    """The session is ended behind the page's back."""
    page = checks.page(allowed=("404",))
    with page.expect_response(lambda response: "?box=" in response.url) as response:
        choose(page, "card")
        drag(page, checks.clips["card"]["truth"][0])
    frames(page, 10)
    checks.service.delete(response.value.json()["id"])
    said(page, "The session has ended")
    page.context.close()


def key_needed(checks):
    service = Service(checks.program, BAGTRACK_API_KEYS="page:0123456789abcdef")
    page = checks.page(url=service.url, allowed=("401",))
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    said(page, "does not know this key")
    page.locator("#key").fill("0123456789abcdef")
    page.keyboard.press("Enter")
    frames(page, 20)
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
    sample_by_mouse,
    correction_and_recording,
    lost_and_found,
    broken_line,
    phone_by_touch,
    keyboard_alone,
    camera,
    page_of_another_origin,
    camera_refused,
    ended_session,
    key_needed,
    busy_service,
]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--shots", help="where to put pictures of the page")
    parser.add_argument("--only", help="the name of one check")
    parser.add_argument("--from-disk", action="store_true", help="takes the page from web/, not from the program")
    arguments = parser.parse_args()
    service = Service(arguments.program)
    try:
        with sync_playwright() as playwright:
            checks = Checks(playwright, service, arguments)
            for check in ALL:
                if arguments.only in (None, check.__name__):
                    print(check.__name__, flush=True)
                    check(checks)
                    assert not checks.faults, checks.faults
            checks.browser.close()
    finally:
        service.stop()
    print("The page does what it should.")


if __name__ == "__main__":
    main()

"""A page in Chromium, what a user does with it, and what it says."""

import csv
import io
import json
import pathlib
import time

import axe_playwright_python
from playwright.sync_api import TimeoutError

AXE = next(pathlib.Path(axe_playwright_python.__file__).parent.rglob("axe.min.js")).read_text()
FRAMES_A_SECOND = 25
TO_THE_END = 120_000
"""Milliseconds that anything may take on a machine that is busy with other things."""
DRAW = "Draw a box around what to follow"
WEB = pathlib.Path(__file__).resolve().parents[2] / "web"
TELLS = """addEventListener("DOMContentLoaded", () => {
    window.told = [];
    const tell = (changes) => changes.forEach(({ addedNodes }) => addedNodes.forEach((text) => told.push(text.data)));
    new MutationObserver(tell).observe(document.getElementById("message"), { childList: true });
});"""
"""Writes down what the page says."""


class Checks:
    """One browser and one service, and what all pages of it must not do."""

    def __init__(self, playwright, service, files, arguments):
        self.playwright = playwright
        self.service = service
        self.files = files
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

    def page(self, url=None, browser=None, allowed=(), where="there", **options):
        """A new page of the service, watched for faults. `allowed` are texts of faults that a check provokes. `where` it
        tracks: `there` at the service, or `here` in the page."""
        context = (browser or self.browser).new_context(**{"viewport": {"width": 1000, "height": 1100}, **options})
        context.set_default_timeout(TO_THE_END)
        context.add_init_script(TELLS)
        page = context.new_page()
        url = url or self.service.url

        def fault(text):
            if not any(part in text for part in allowed):
                self.faults.append(text)

        page.on("console", lambda message: message.type == "error" and fault(f"console: {message.text} ({message.location.get('url')})"))
        page.on("pageerror", lambda error: fault(f"script: {error}"))
        own = ("http://127.0.0.1", "ws://127.0.0.1", url, url.replace("http", "ws"), "blob:", "data:")
        page.on("request", lambda request: request.url.startswith(own) or fault(f"request to {request.url}"))
        if self.from_disk:
            context.route("**/page/**", lambda route: route.fulfill(path=on_disk(route.request.url)))
            context.route(url + "/", lambda route: route.fulfill(path=WEB / "index.html"))
        page.goto(url + "/")
        said(page, "Nothing is uploaded")
        page.locator(f"#{where}").evaluate("button => button.click()")
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


def was_said(page, text):
    """Waits until the page has said this, since it was loaded. It may say something else by now."""
    late = time.monotonic() + TO_THE_END / 1000
    while text not in (told := "\n".join(page.evaluate("window.told"))):
        assert time.monotonic() < late, told
        page.wait_for_timeout(100)


def say_nothing(page):
    """Empties the page's message, so that one can wait for the same one again."""
    page.locator("#message").evaluate("place => { place.textContent = ''; place.className = ''; }")


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


def painted(page, *names):
    """That something is painted on these canvases."""
    blank = page.evaluate(
        """(names) => names.filter((name) => {
            const canvas = document.getElementById(name);
            const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            return !pixels.data.some((value, at) => at % 4 === 3 && value > 0);
        })""",
        list(names),
    )
    assert not blank, f"nothing on {blank}"


def begin_at(page, time, frame):
    """Moves the bar under the first picture, and waits for the frame."""
    moved = "(bar, at) => { bar.value = String(at); bar.dispatchEvent(new Event('input')); }"
    page.locator("#begin-at").evaluate(moved, time + 0.005)
    page.locator("#begin-time").filter(has_text=f"frame {frame}").wait_for()


def frames(page, count):
    """Waits until the page has shown so many. Its policy forbids to evaluate texts in it."""
    late = time.monotonic() + TO_THE_END / 1000
    while not (shown := page.locator("#frames").inner_text()).isdigit() or int(shown) < count:
        assert time.monotonic() < late, f"{shown} frames; it says: {page.locator('#message').inner_text()}"
        page.wait_for_timeout(50)


def slow(page):
    """Makes the page's machine slow: a file that is tracked as fast as it can be has not ended when one acts. Returns
    what makes it as fast again as it was."""
    session = page.context.new_cdp_session(page)
    session.send("Emulation.setCPUThrottlingRate", {"rate": 5})
    return lambda: session.send("Emulation.setCPUThrottlingRate", {"rate": 1})


HELD = """(count) => {
    const own = window.createImageBitmap;
    let given = 0;
    const released = new Promise((resolve) => (window.release = resolve));
    window.createImageBitmap = async (...what) => {
        if ((given += 1) > count) {
            window.isHeld = true;
            await released;
        }
        return own(...what);
    };
}"""


HELD_FILE = """(count) => {
    const own = HTMLCanvasElement.prototype.toBlob;
    let given = 0;
    const released = new Promise((resolve) => (window.releaseFile = resolve));
    HTMLCanvasElement.prototype.toBlob = function (...what) {
        if ((given += 1) > count) released.then(() => own.apply(this, what));
        else own.apply(this, what);
    };
}"""


def held_file(page, count):
    """Lets a file give this many more frames; the next one waits for what this returns."""
    page.evaluate(HELD_FILE, count)
    return lambda: page.evaluate("window.releaseFile()")


def held(page, count):
    """Lets the page read this many of the frames that it keeps; the next one waits for what this returns."""
    page.evaluate(HELD, count)
    return lambda: page.evaluate("window.release()")


def is_held(page):
    """Waits until a frame is held."""
    late = time.monotonic() + TO_THE_END / 1000
    while not page.evaluate("window.isHeld"):
        assert time.monotonic() < late, "no frame is read"
        page.wait_for_timeout(50)


def stop(page):
    """Stops the run. Where it has ended already, this does nothing."""
    page.evaluate("document.getElementById('stop').click()")


def to_the_end(page):
    said(page, "The video has ended")


def saved(page, button):
    with page.expect_download() as download:
        page.locator(button).click()
    return pathlib.Path(download.value.path()).read_bytes()


def rows(page):
    return list(csv.DictReader(io.StringIO(saved(page, "#save-csv").decode())))


def rows_when(page, holds):
    """The rows, once this holds of them: an answer may be under way."""
    late = time.monotonic() + TO_THE_END / 1000
    while not holds(table := rows(page)):
        assert time.monotonic() < late, table[-1]
        page.wait_for_timeout(200)
    return table


def drawn_frames(page):
    """The frames with a box that was drawn, as the project has them."""
    [stored] = json.loads(saved(page, "#save-project"))["objects"]
    return [row[0] for row in stored["rows"] if row[8]]


def kept_rows(page):
    """The rows, once the browser keeps them. Frames that were under way when the run was stopped may come late."""
    for _ in range(10):
        found = rows(page)
        page.wait_for_timeout(300)
        try:
            page.locator("#kept-text").filter(has_text=f", {len(found)} rows").wait_for(timeout=5000)
        except TimeoutError:
            continue
        if len(rows(page)) == len(found):
            return found
    raise AssertionError(f"of {len(found)} rows the page says: {page.locator('#kept-text').text_content()}")


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

"""The clip of the first screen: it moves, and its box is the tracker's own.

    python3 tests/page/welcome.py target/debug/bagtrack

writes what the tracker gives of it into web/welcome-rows.js.
"""

import pathlib
import sys
import time

WEB = pathlib.Path(__file__).resolve().parents[2] / "web"
BOX = {"x": 268, "y": 246, "width": 128, "height": 73}
"""The van in the first frame."""
EVERY = 4
SHOWN = 16
"""Particles of a frame that are kept."""
MIN_OVERLAP = 0.9

# Runs in the page: its policy lets no text be evaluated by itself, so this is a function.
TRACK = """async (canvas, [box, seed]) => {
    const [{ FRAMES, HEIGHT, WIDTH, drawScene }, { LocalClient }] = await Promise.all(
        [import("/page/scene.js"), import("/page/js/bagtrack.js")]);
    const drawn = new OffscreenCanvas(WIDTH, HEIGHT);
    const context = drawn.getContext("2d", { willReadFrequently: true });
    const local = new LocalClient();
    const image = (frame) => { drawScene(context, frame); return context.getImageData(0, 0, WIDTH, HEIGHT); };
    const session = await local.open(image(0), box, { seed });
    const answers = [{ box: session.box, score: 1, particles: [] }];
    for (let frame = 1; frame < FRAMES; frame += 1) {
        const [{ box, score, particles }] = await local.track([session], image(frame), { see: true });
        answers.push({ box, score, particles: particles.slice(0, 60) });
    }
    await local.close();
    return answers;
}"""
RECORDED = """async (canvas) => {
    const { boxOf } = await import("/page/welcome.js");
    return Array.from({ length: 240 }, (_, frame) => boxOf(frame));
}"""
IS_BLANK = "canvas => canvas.toDataURL() === canvas.cloneNode().toDataURL()"
SEED = 7
DIGITS = "0123456789abcdefghijklmnopqrstuvwxyz"


def tracked(page):
    return page.locator("#hero").evaluate(TRACK, [BOX, SEED])


def two(value):
    value = max(0, min(1295, round(value)))
    return DIGITS[value // 36] + DIGITS[value % 36]


def written(answers):
    """The module with the rows."""
    rows = "".join(two(2 * answer["box"][side]) for answer in answers for side in ("x", "y", "width"))
    signs = ""
    for answer in answers[EVERY::EVERY]:
        box = answer["box"]
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        assert len(answer["particles"]) >= SHOWN
        for across, down, *_ in answer["particles"][:SHOWN]:
            signs += "".join(chr(80 + max(-44, min(44, round(value / 2)))) for value in (across - x, down - y))
    signs = signs.replace("\\", "]")
    return f"""// What the tracker gave of the clip of the first screen. Written by tests/page/welcome.py.

/** Frame by frame x, y and width in halves of pixels: two places to the base 36. */
export const ROWS =
  "{rows}";
/** The likeliest particles of every fourth frame after the first, as characters: places from the middle of the box in
 * pixels / 2 + 80. */
export const PARTICLES =
  "{signs}";
"""


def overlap(one, other):
    across = min(one["x"] + one["width"], other["x"] + other["width"]) - max(one["x"], other["x"])
    down = min(one["y"] + one["height"], other["y"] + other["height"]) - max(one["y"], other["y"])
    shared = max(0, across) * max(0, down)
    return shared / (one["width"] * one["height"] + other["width"] * other["height"] - shared)


def picture(page):
    return page.locator("#hero").evaluate("canvas => canvas.toDataURL('image/png')")


def something_moves_at_once(checks):
    for scheme in ("light", "dark"):
        page = checks.page(where="here", color_scheme=scheme, viewport={"width": 1280, "height": 800})
        seen = {picture(page)}
        for _ in range(100):
            page.wait_for_timeout(50)
            seen.add(picture(page))
            if len(seen) > 4:
                break
        assert len(seen) > 4, "the clip stands still"
        assert "nothing leaves this machine" in page.locator("#welcome").inner_text().lower()
        checks.shot(page, f"welcome-{scheme}")
        checks.no_axe_violations(page, f"first screen, {scheme}")
        page.context.close()
    page = checks.page(where="here", reduced_motion="reduce", viewport={"width": 390, "height": 844})
    late = time.monotonic() + 60
    while page.locator("#hero").evaluate(IS_BLANK):
        assert time.monotonic() < late, "nothing is shown"
        page.wait_for_timeout(50)
    still = picture(page)
    page.wait_for_timeout(700)
    assert picture(page) == still, "the clip moves for those who do not want motion"
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    checks.shot(page, "welcome-phone")
    page.context.close()


def recorded_rows_are_the_trackers(checks):
    page = checks.page(where="here")
    recorded = page.locator("#hero").evaluate(RECORDED)
    answers = tracked(page)
    shares = [overlap(row, answer["box"]) for row, answer in zip(recorded, answers)]
    mean = sum(shares) / len(shares)
    print(f"  mean overlap with what was recorded {mean:.3f}")
    assert len(answers) == len(recorded) and mean >= MIN_OVERLAP, shares
    page.context.close()


ALL = [something_moves_at_once, recorded_rows_are_the_trackers]


def main():
    import argparse
    import tempfile

    from browser import Checks
    from playwright.sync_api import sync_playwright
    from service import Service

    service = Service(sys.argv[1])
    arguments = argparse.Namespace(program=sys.argv[1], shots=None, from_disk=True)
    with sync_playwright() as playwright, tempfile.TemporaryDirectory():
        checks = Checks(playwright, service, None, arguments)
        answers = tracked(checks.page(where="here"))
        (WEB / "welcome-rows.js").write_text(written(answers))
        lost = sum(answer["score"] < 0.25 for answer in answers)
        print(f"{len(answers)} rows, {lost} of them lost")
        checks.browser.close()
    service.stop()


if __name__ == "__main__":
    main()

"""The page in Debian's build of WebKit, which Safari is made of, driven over its own WebDriver.

    python3 tests/page/webkit.py target/debug/bagtrack

Needs the package selenium from PyPI, and from Debian webkit2gtk-driver, xvfb, ffmpeg, gstreamer1.0-libav, and the base,
good and bad plugins of GStreamer.
"""

import os
import pathlib
import subprocess
import sys
import tempfile

from clips import FRAMES, H264, Clips
from driven import DrivenPage, whole_file
from selenium import webdriver
from selenium.common.exceptions import InvalidSessionIdException
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.by import By
from selenium.webdriver.webkitgtk.options import Options
from selenium.webdriver.webkitgtk.service import Service as Driver
from service import Service

TRIES = 3
"""This build ends by itself now and then, with what a page decodes."""


class Page(DrivenPage):
    """The page in WebKit."""

    def __init__(self, webkit, url):
        self.webkit = webkit
        webkit.get(url + "/")
        super().__init__(lambda name: webkit.find_element(By.ID, name), webkit.execute_script)

    def move(self, corners):
        actions = ActionBuilder(self.webkit)
        mouse = actions.pointer_action
        mouse.move_to_location(*corners[0]).pointer_down()
        for corner in corners[1:]:
            mouse.move_to_location(*corner)
        mouse.pointer_up()
        actions.perform()

    def height(self, name):
        return self.script(f"return document.getElementById('{name}').clientHeight")


def first_screen(page, _):
    """Its buttons can be pressed, and the work is here again after the page is loaded anew."""
    page.find("card").click()
    page.said("Draw a box")
    # The first box of the sample clip.
    page.drag((66, 152, 69, 86))
    shown = lambda: page.script("return !document.getElementById('seen-now').hidden")
    page.wait(shown, "it is not shown what the tracker sees")
    before = page.height("search")
    page.wait(lambda: int(page.find("frames").text) >= 40, "no 40 frames")
    after = page.height("search")
    assert 100 < after == before, f"the closer look was {before} pixels high, and is {after}"
    page.find("stop").click()
    page.said("Stopped")
    kept = lambda: f"{page.find('frames').text} rows" in page.find("kept").text
    page.wait(kept, "the browser does not keep all rows")
    rows = page.find("frames").text
    page.webkit.refresh()
    page.said(f"card is here again, with {rows} frames")


def in_webkit(service, act):
    """Acts in a browser that keeps nothing of another one."""
    for left in reversed(range(TRIES)):
        # Its downloads are put where its user is at home.
        with tempfile.TemporaryDirectory() as home:
            options = Options()
            driver = Driver("/usr/bin/WebKitWebDriver", env={**os.environ, "HOME": home})
            webkit = webdriver.WebKitGTK(options=options, service=driver)
            try:
                webkit.set_window_size(1300, 1000)
                act(Page(webkit, service.url), pathlib.Path(home))
                return
            except InvalidSessionIdException:
                print("WebKit has ended by itself")
                if left == 0:
                    raise
            finally:
                webkit.quit()


def main():
    screen, number = os.pipe()
    display = subprocess.Popen(
        ["Xvfb", "-displayfd", str(number), "-screen", "0", "1400x1100x24"], pass_fds=[number], stderr=subprocess.DEVNULL
    )
    os.environ["DISPLAY"] = ":" + os.read(screen, 16).decode().strip()
    service = Service(sys.argv[1])
    try:
        with tempfile.TemporaryDirectory() as folder:
            clips = Clips(sys.argv[1], pathlib.Path(folder) / "clip")
            every = list(range(FRAMES))
            in_webkit(service, first_screen)
            for path in clips.file("clip.mp4", 30, H264), clips.phone_file():
                in_webkit(service, lambda page, downloads: whole_file(page, path, every, clips.truth, downloads))
    finally:
        service.stop()
        display.terminate()
    print("The page does in WebKit what it should. Left out: files without WebCodecs, camera, touch, axe.")


if __name__ == "__main__":
    main()

"""Video files in Debian's Firefox, driven over Marionette, its own port for drivers.

    python3 tests/page/firefox.py target/debug/bagtrack

Needs the package marionette-driver from PyPI, and firefox-esr and ffmpeg. What Marionette cannot do is left out: it has
no way into the requests of a page, and axe is not run a second time.
"""

import pathlib
import socket
import sys
import tempfile
import time

from clips import FRAMES, H264, VP8, Clips
from driven import DrivenPage, whole_file
from files import sent_box
from marionette_driver.by import By
from marionette_driver.marionette import ActionSequence, Marionette
from service import Service


class Page(DrivenPage):
    """The page in Firefox."""

    def __init__(self, firefox, url):
        self.firefox = firefox
        firefox.navigate(url + "/")
        find = lambda name: firefox.find_element(By.ID, name)
        super().__init__(find, lambda text: firefox.execute_script(text, sandbox=None))

    def move(self, corners):
        mouse = ActionSequence(self.firefox, "pointer", "mouse", {"pointerType": "mouse"})
        mouse.pointer_move(*corners[0]).pointer_down()
        for corner in corners[1:]:
            mouse.pointer_move(*corner)
        mouse.pointer_up().perform()


def in_a_hidden_tab(page, path, truth):
    """A file is tracked while one looks at another tab. Timers go off once a second there: that would take longer."""
    page.find("file").send_keys(str(path))
    page.said("Draw a box")
    page.drag(sent_box(truth[0]))
    own = page.firefox.current_window_handle
    page.firefox.open(type="tab", focus=True)
    page.firefox.switch_to_window(own, focus=False)
    begun = time.monotonic()
    page.said("The video has ended")
    taken = time.monotonic() - begun
    assert page.script("return document.hidden")
    print(f"  {FRAMES} frames in {taken:.1f} s while the tab is hidden")
    assert taken < 0.8 * FRAMES, taken


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def in_firefox(service, act):
    """Acts in a browser that keeps nothing of another one."""
    with tempfile.TemporaryDirectory() as folder:
        downloads = pathlib.Path(folder) / "downloads"
        downloads.mkdir()
        prefs = {"browser.download.folderList": 2, "browser.download.dir": str(downloads)}
        log = str(pathlib.Path(folder) / "gecko.log")
        firefox = Marionette(
            bin="/usr/bin/firefox-esr", port=free_port(), headless=True, prefs=prefs, gecko_log=log
        )
        try:
            firefox.start_session()
            print(f"Firefox {firefox.session_capabilities['browserVersion']}")
            firefox.set_window_rect(width=1000, height=1200)
            act(Page(firefox, service.url), downloads)
        finally:
            firefox.quit()


def main():
    service = Service(sys.argv[1])
    try:
        with tempfile.TemporaryDirectory() as folder:
            clips = Clips(sys.argv[1], pathlib.Path(folder) / "clip")
            every = list(range(FRAMES))
            files = [
                (clips.file("clip.mp4", 30, H264), every),
                (clips.file("clip.webm", 25, VP8), every),
                (clips.file("clip.mkv", 30, H264), every),
                (clips.phone_file(), every),
                clips.varying_file(),
            ]
            for path, numbers in files:
                in_firefox(service, lambda page, downloads: whole_file(page, path, numbers, clips.truth, downloads))
            in_firefox(service, lambda page, _: in_a_hidden_tab(page, files[0][0], clips.truth))
    finally:
        service.stop()
    print("Left out in Firefox, since its driver does not give them: camera, touch, lines that are cut, axe.")


if __name__ == "__main__":
    main()

"""Video files in Debian's Firefox, driven over Marionette, its own port for drivers.

    python3 tests/page/firefox.py target/debug/bagtrack

Needs the package marionette-driver from PyPI, and firefox-esr and ffmpeg. What Marionette cannot do is left out: it has
no way into the requests of a page, and axe is not run a second time.
"""

import csv
import io
import pathlib
import socket
import sys
import tempfile
import time

from clips import FRAMES, H264, VP8, Clips
from files import GRAY, check_rows, check_video, sent_box, times_of
from marionette_driver.by import By
from marionette_driver.marionette import ActionSequence, Marionette
from service import Service

TO_THE_END = 180


class Page:
    """The page in Firefox."""

    def __init__(self, firefox, url):
        self.firefox = firefox
        firefox.navigate(url + "/")
        self.said("Nothing is uploaded")

    def find(self, name):
        return self.firefox.find_element(By.ID, name)

    def script(self, text):
        return self.firefox.execute_script(text, sandbox=None)

    def wait(self, what, told):
        late = time.monotonic() + TO_THE_END
        while not what():
            assert time.monotonic() < late, f"{told}; it says: {self.find('message').text}"
            time.sleep(0.05)

    def said(self, text):
        self.wait(lambda: text in self.find("message").text, f"no {text!r}")

    def drag(self, box):
        area = self.script("""
            const picture = document.getElementById("picture");
            picture.scrollIntoView({ block: "center" });
            const { left, top, width } = picture.getBoundingClientRect();
            return [left, top, width / picture.width];""")
        left, top, scale = area
        x, y, width, height = box
        at = lambda across, down: (round(left + across * scale), round(top + down * scale))
        mouse = ActionSequence(self.firefox, "pointer", "mouse", {"pointerType": "mouse"})
        mouse.pointer_move(*at(x, y)).pointer_down()
        mouse.pointer_move(*at(x + width / 2, y + height)).pointer_move(*at(x + width, y + height)).pointer_up().perform()

    def saved(self, button, folder):
        before = set(folder.iterdir())
        self.find(button).click()
        new = lambda: [path for path in set(folder.iterdir()) - before if path.suffix != ".part"]
        self.wait(lambda: new() and all(path.stat().st_size for path in new()), f"{button} saves nothing")
        self.wait(lambda: not list(folder.glob("*.part")), f"{button} does not finish")
        return new()[0]


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


def whole_file(page, path, numbers, truth, downloads):
    page.find("file").send_keys(str(path))
    page.said("Draw a box")
    gray = page.script(f"return ({GRAY})()")
    assert 50 < gray < 200, f"the first picture has the mean {gray}"
    page.drag(sent_box(truth[0]))
    page.said("The video has ended")
    skipped = page.find("skipped").text
    table = list(csv.DictReader(io.StringIO(page.saved("save-csv", downloads).read_text())))
    times = times_of(path)
    check_rows(table, path, truth, numbers, times)
    assert skipped == "0", skipped
    video = page.saved("save-video", downloads)
    # The last frame stays as long as the others do on the average.
    check_video(video, numbers, times[-1] + times[-1] / (len(times) - 1))


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

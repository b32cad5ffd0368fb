"""The page in browsers that Playwright does not drive as Debian has them: what their tests share."""

import csv
import io
import time

from files import GRAY, check_rows, check_video, sent_box, times_of

TO_THE_END = 180


class DrivenPage:
    """The page in a browser whose driver gives `find_element` and `execute_script`."""

    def __init__(self, find, script):
        self.find = find
        self.script = script
        # What is pressed before its scripts have run does nothing.
        self.wait(lambda: script("return document.body.dataset.state") == "start", "the page does not begin")

    def wait(self, what, told):
        late = time.monotonic() + TO_THE_END
        while not what():
            assert time.monotonic() < late, f"{told}; it says: {self.find('message').text}"
            time.sleep(0.05)

    def said(self, text):
        self.wait(lambda: text in self.find("message").text, f"no {text!r}")

    def move(self, corners):
        """Presses the mouse at the first of these places of the window, and lets go at the last."""
        raise NotImplementedError

    def drag(self, box):
        left, top, scale = self.script("""
            const picture = document.getElementById("picture");
            picture.scrollIntoView({ block: "center" });
            const { left, top, width } = picture.getBoundingClientRect();
            return [left, top, width / picture.width];""")
        x, y, width, height = box
        at = lambda across, down: (round(left + across * scale), round(top + down * scale))
        self.move([at(x, y), at(x + width / 2, y + height), at(x + width, y + height)])

    def saved(self, button, folder):
        before = set(folder.iterdir())
        self.find(button).click()
        new = lambda: [path for path in set(folder.iterdir()) - before if path.suffix in (".csv", ".webm", ".mp4")]
        self.wait(lambda: new() and all(path.stat().st_size for path in new()), f"{button} saves nothing")
        self.wait(lambda: not list(folder.glob("*.part")), f"{button} does not finish")
        return new()[0]


def whole_file(page, path, numbers, truth, downloads):
    """A file is tracked to its end, each frame once. Its rows and its video are saved."""
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

"""The steps of docs/QUICKSTART.md for the page: what stands there in bold is pressed, in its order."""

import re

from browser import DRAW, WEB, drag, frames, said

SAVED_BY = ("CSV", "COCO", "CVAT 1.1", "Video (WebM)")


def quickstart(checks):
    text = (WEB.parent / "docs" / "QUICKSTART.md").read_text()
    section = re.search(r"^## The page\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)[1]
    assert len(section.strip().splitlines()) <= 10, section
    labels = re.findall(r"\*\*(.+?)\*\*", section)
    assert labels == ["Sample clip", "Add an object", "Stop", *SAVED_BY], labels
    page = checks.page(where="here")
    press = lambda label: page.get_by_role("button", name=label, exact=True).click()
    # It waits for this frame: it cannot have ended when one acts.
    page.route("**/sample/card/120.jpg", lambda route: None)
    press(labels[0])
    said(page, DRAW)
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    press(labels[1])
    drag(page, [20, 20, 60, 60])
    page.locator("#list li:nth-child(2)").wait_for()
    press(labels[2])
    for label in labels[3:]:
        with page.expect_download() as download:
            press(label)
        assert download.value.suggested_filename.startswith("card-boxes."), download.value.suggested_filename
    page.context.close()


ALL = [quickstart]

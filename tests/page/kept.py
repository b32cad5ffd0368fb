"""Nothing is lost: the page is loaded anew, and a project file is opened again."""

import json

from browser import choose, drag, frames, kept_rows, numbers, rows, said, saved, slow, to_the_end
from clips import FRAMES, H264
from files import GRAY, check_rows, choose_file, sent_box
from studio import to_frame


def told(table):
    return [(row["frame"], numbers(row), row["status"], row["target"], row["name"]) for row in table]


def kept_says(page, text):
    page.locator("#kept-text").filter(has_text=text).wait_for()


def same_rows(page, before):
    """The rows, which must be those of before, and at most the one of the frame that was under way."""
    found = rows(page)
    assert told(found[: len(before)]) == told(before) and len(found) <= len(before) + 1, (len(found), len(before))
    return found


def reloaded_in_the_middle(checks):
    """The tab is loaded anew while a file is tracked: rows, names and the file are there, and it goes on to the end."""
    path = checks.files.file("clip.mp4", 30, H264)
    page = checks.page(where="here")
    slow(page)
    choose_file(page, path)
    drag(page, sent_box(checks.files.truth[0]))
    page.locator("#list input[type=text]").fill("The card")
    frames(page, 40)
    page.locator("#pause").click()
    before = kept_rows(page)
    kept_says(page, "clip.mp4, 1 object, ")
    page.reload()
    said(page, "clip.mp4 is here again")
    before = same_rows(page, before)
    assert 50 < page.evaluate(GRAY) < 200, "the last picture is not shown"
    checks.no_axe_violations(page, "brought back")
    page.locator("#pause").click()
    to_the_end(page)
    after = rows(page)
    assert told(after[: len(before)]) == told(before), "rows have changed"
    check_rows(after, path, checks.files.truth, list(range(FRAMES)), [number / 30 for number in range(FRAMES)])
    assert {row["name"] for row in after} == {"The card"}
    kept_says(page, f"{FRAMES} rows")
    page.reload()
    said(page, "clip.mp4 is here again")
    assert told(rows(page)) == told(after)
    page.locator("#forget").click()
    page.reload()
    page.locator("#hero").wait_for()
    assert page.locator("#kept").is_hidden() and page.locator("#results").is_hidden()
    page.context.close()


def left_in_another_tab(checks):
    """What another tab has left is offered, not opened."""
    page = checks.page(where="here")
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 20)
    page.locator("#stop").click()
    before = kept_rows(page)
    other = page.context.new_page()
    other.goto(page.url)
    kept_says(other, "card, 1 object")
    other.locator("#go-on").click()
    said(other, "card is here again")
    same_rows(other, before)
    page.context.close()


def project_opened_again(checks):
    """A project is opened without its video, then with it, and corrected in an earlier frame."""
    path = checks.files.file("clip.mp4", 30, H264)
    page = checks.page(where="here")
    choose_file(page, path)
    drag(page, sent_box(checks.files.truth[0]))
    to_the_end(page)
    before = rows(page)
    project = checks.files.folder / "work.bagtrack.json"
    project.write_bytes(saved(page, "#save-project"))
    page.context.close()

    page = checks.page(where="here")
    page.locator("#file").set_input_files(project)
    said(page, "Choose clip.mp4 to see its pictures")
    assert told(rows(page)) == told(before)
    page.locator("#file").set_input_files(path)
    said(page, f"with {FRAMES} frames.")
    assert told(rows(page)) == told(before)
    to_frame(page, 40)
    checks.shot(page, "project")
    box = sent_box(checks.files.truth[40])
    drag(page, [box[0] + 6, box[1] + 6, box[2], box[3]])
    said(page, "Followed anew from frame 40")
    after = rows(page)
    assert told(after[:40]) == told(before[:40]) and told(after[40:]) != told(before[40:])
    assert len(after) == FRAMES
    page.context.close()

    damaged = json.loads(project.read_text())
    damaged["objects"][0]["rows"][3][2] = "left"
    project.write_text(json.dumps(damaged))
    page = checks.page(where="here")
    page.locator("#file").set_input_files(project)
    said(page, "a row of it is damaged")
    page.context.close()


ALL = [reloaded_in_the_middle, left_in_another_tab, project_opened_again]

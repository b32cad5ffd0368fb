"""A slow line, and one that is gone before the page has all of its parts."""

from browser import DRAW, choose, drag, frames, painted, said
from clips import H264


def chosen_before_the_page_is_loaded(checks):
    """A file that is chosen while the page's scripts are on their way is opened once they are there."""
    page = checks.page(where="here")
    under_way = []
    page.route("**/page/main.js", lambda route: under_way.append(route))
    page.goto(checks.service.url + "/", wait_until="commit")
    page.locator("#file").set_input_files(checks.files.file("clip.mp4", 30, H264))
    while not under_way:
        page.wait_for_timeout(50)
    under_way[0].fallback()
    said(page, DRAW)
    page.context.close()


def service_gone_before_a_choice(checks):
    """Where the service has gone since the page was loaded, a choice says so, and works once it is back."""

    def choose_clip(page):
        page.locator("#file").set_input_files(checks.files.file("clip.mp4", 30, H264))

    for part, act in (
        ("project", choose_clip),
        ("run", choose_clip),
        ("clip", lambda page: page.locator("#card").click()),
    ):
        page = checks.page(where="here", allowed=("Failed to load",))
        page.route(f"**/page/{part}.js", lambda route: route.abort())
        act(page)
        said(page, "Is the service still running? Then load the page anew.")
        page.unroute(f"**/page/{part}.js")
        act(page)
        said(page, DRAW)
        page.context.close()


def drawn_before_the_tracker_is_loaded(checks):
    """The first box stays in the picture while the tracker is on its way, which is said, and there is no second one."""
    page = checks.page(where="here")
    under_way = []
    page.route("**/*_wasm_bg.wasm", lambda route: under_way.append(route))
    choose(page, "card")
    truth = checks.clips["card"]["truth"][0]
    drag(page, truth)
    said(page, "Beginning")
    painted(page, "overlay")
    drag(page, [20, 20, 60, 60])
    while not under_way:
        page.wait_for_timeout(50)
    under_way[0].fallback()
    said(page, "Following")
    frames(page, 5)
    assert page.locator("#list li").count() == 1
    page.context.close()


ALL = [chosen_before_the_page_is_loaded, service_gone_before_a_choice, drawn_before_the_tracker_is_loaded]

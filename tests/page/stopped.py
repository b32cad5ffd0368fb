"""Runs that are stopped, and services that were: what was tracked is shown, corrected, and goes on."""

from browser import choose, drag, frames, kept_rows, numbers, rows, said, to_the_end
from service import Service
from studio import to_frame, values

OFF = [30, 200, 80, 60]


def stopped_with_the_service(checks):
    """Frames on their way when a run is stopped are no failure: it can be corrected."""
    page = checks.page()
    choose(page, "card")
    drag(page, checks.clips["card"]["truth"][0])
    frames(page, 40)
    page.locator("#stop").click()
    said(page, "Stopped")
    page.wait_for_timeout(1000)
    assert page.locator("#message.bad").count() == 0, page.locator("#message").inner_text()
    said(page, "Stopped")
    before = rows(page)
    to_frame(page, 20)
    drag(page, OFF)
    said(page, "Followed anew from frame 20")
    after = rows(page)
    assert len(after) == len(before) and values(after[:20]) == values(before[:20])
    page.context.close()


def service_with_other_keys(checks):
    """The service takes no states of before its restart: a page that is loaded anew goes on from the last box."""
    service = Service(checks.program)
    page = checks.page(url=service.url, allowed=("422", "404", "WebSocket", "ERR_CONNECTION", "Failed to load"))
    truth = checks.clips["card"]["truth"]
    choose(page, "card")
    drag(page, truth[0])
    frames(page, 70)
    page.locator("#pause").click()
    before = kept_rows(page)
    service.stop()
    service = Service(checks.program, port=service.port)
    page.reload()
    said(page, "card is here again")
    page.locator("#pause").click()
    said(page, "It goes on from the last box")
    to_the_end(page)
    table = rows(page)
    assert len(table) == 150 and values(table[: len(before)]) == values(before)
    to_frame(page, 50)
    drag(page, OFF)
    said(page, "Followed anew from frame 50")
    assert abs(numbers(rows(page)[50])[0] - OFF[0]) <= 1
    page.context.close()
    service.stop()


ALL = [stopped_with_the_service, service_with_other_keys]

"""Video files in the page: every frame once, boxes in the file's own pixels, a video that can be saved."""

import json
import os
import statistics

from browser import DRAW, begin_at, distance, drag, drawn_frames, frames, held_file, kept_rows, rows, said, saved
from browser import say_nothing, slow, stop, to_the_end, was_said
from clips import DRAWN, FRAMES, H264, SIZE, VP8, frame_numbers, run
from service import Line, Service

SENT = (960, 720)
"""What the page sends of a larger file."""
GRAY = """() => {
    const canvas = document.getElementById("picture");
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return pixels.reduce((sum, value, index) => sum + (index % 4 === 3 ? 0 : value), 0) / (pixels.length / 4 * 3);
}"""
SECRET = {"BAGTRACK_SNAPSHOT_KEYS": "a secret of this test"}


def sent_box(truth):
    return [value * SENT[0] / SIZE[0] for value in truth]


def choose_file(page, path):
    page.locator("#file").set_input_files(path)
    said(page, DRAW)


def follow_file(checks, page, path):
    choose_file(page, path)
    gray = page.evaluate(GRAY)
    assert 50 < gray < 200, f"the first picture has the mean {gray}"
    drag(page, sent_box(checks.files.truth[0]))


def check_rows(table, path, truth, numbers, times):
    """The rows are those of the frames with these numbers in the clip, each once, and fit the file."""
    told = [(row["frame"], row["time"]) for row in table]
    assert [int(frame) for frame, _ in told] == list(range(len(numbers))), (told, times)
    late = [(row["time"], time) for row, time in zip(table, times) if abs(float(row["time"]) - time) > 0.0015]
    assert not late, late
    about = [[row[name] for name in ("video", "video_width", "video_height")] for row in table]
    assert about == [[path.name, str(SIZE[0]), str(SIZE[1])]] * len(table), about
    check_distance(path, table, [truth[number] for number in numbers])


def check_distance(path, table, truth):
    """The boxes of these rows are where the target is. With 48 seeds their centres are 1.7 to 3.3 pixels from it on
    average, and at least 9.5 pixels from where it is a frame earlier or later."""
    mean = statistics.fmean(distance(row, box) for row, box in zip(table, truth, strict=True))
    print(f"  {path.name}: {len(table)} frames, {mean:.1f} px from the target on average")
    assert mean <= 6, (mean, [(row["frame"], row["x"], row["y"], row["status"]) for row in table])


def check_video(video, numbers, seconds, size=SENT):
    """The saved video has these frames, ends when it should, and can be entered in the middle."""
    probed = run("ffprobe", "-v", "error", "-show_format", "-show_streams", "-of", "json", video)
    probed = json.loads(probed)
    duration = float(probed["format"]["duration"])
    print(f"  the saved video: {video.stat().st_size} bytes, {duration} s, {probed['streams'][0]['codec_name']}")
    assert abs(duration - seconds) < 0.05, (duration, seconds)
    shown = frame_numbers(video, *size)
    assert shown == numbers, shown
    middle = video.with_suffix(".middle.png")
    # With `-ss` before `-i`, ffmpeg seeks to a key frame and decodes from there.
    run("ffmpeg", "-v", "error", "-y", "-ss", duration / 2, "-i", video, "-frames:v", "1", middle)
    [entered] = frame_numbers(middle, *size)
    assert abs(entered - (numbers[0] + numbers[-1]) / 2) <= 2, entered


def saved_video(checks, page, name):
    path = checks.files.folder / name
    path.write_bytes(saved(page, "#save-video"))
    return path


def times_of(path):
    told = run("ffprobe", "-v", "error", "-select_streams", "v", "-show_entries", "frame=pts_time", "-of", "csv=p=0", path)
    return [float(line.strip().strip(",")) for line in told.decode().split()]


def h264_file(checks):
    whole_file(checks, checks.files.file("clip.mp4", 30, H264), 30)


def vp8_file(checks):
    whole_file(checks, checks.files.file("clip, of \"VP8\".webm", 25, VP8), 25)


def cut_file(checks):
    """A recording that broke off is tracked as far as it goes, and ends there. It was waited for without end, also
    where its end is where one begins."""
    whole = checks.files.file("whole.mkv", 30, H264).read_bytes()
    path = checks.files.folder / "cut.mkv"
    path.write_bytes(whole[: len(whole) * 3 // 4])
    for begins_at_its_end in (False, True):
        page = checks.page(where="here")
        choose_file(page, path)
        if begins_at_its_end:
            page.locator("#begin-at").focus()
            page.keyboard.press("End")
            page.locator("#begin-time").filter(has_text="frame").wait_for()
        drag(page, sent_box(checks.files.truth[0]))
        to_the_end(page)
        count = len(rows(page))
        assert count == 1 if begins_at_its_end else FRAMES / 2 < count < FRAMES, count
        page.context.close()


def cut_in_its_first_frame(checks):
    """A recording that broke off before it has a picture is refused with a reason, and the page goes on."""
    page = checks.page(where="here")
    for name, rate, codec in (("whole.mkv", 30, H264), ("whole.webm", 25, VP8)):
        whole = checks.files.file(name, rate, codec).read_bytes()
        path = checks.files.folder / f"begun-{name}"
        path.write_bytes(whole[:5000])
        page.locator("#file").set_input_files(path)
        said(page, f"{path.name} is cut in its first frame")
        assert page.locator("#stage video").count() == 0
        choose_file(page, checks.files.file("clip.mp4", 30, H264))
    page.context.close()


def whole_file(checks, path, rate):
    page = checks.page()
    follow_file(checks, page, path)
    frames(page, 10)
    print(f"  {page.locator('#rate').inner_text()} frames/s, {page.locator('#trip').inner_text()}")
    to_the_end(page)
    assert page.locator("#skipped").inner_text() == "0"
    numbers = list(range(FRAMES))
    table = rows(page)
    check_rows(table, path, checks.files.truth, numbers, [number / rate for number in numbers])
    assert abs(float(table[-1]["frame_rate"]) - rate) < 0.01, table[-1]
    stored = json.loads(saved(page, "#save-json"))
    told = [stored[name] for name in ("video", "video_width", "video_height", "skipped")]
    assert told == [path.name, *SIZE, 0] and abs(stored["frame_rate"] - rate) < 0.01, told
    assert [row["x"] for row in stored["boxes"]] == [float(row["x"]) for row in table]
    check_video(saved_video(checks, page, f"saved-{rate}.webm"), numbers, FRAMES / rate)
    # While the video was made, no more rows came.
    assert rows(page) == table
    assert page.locator("#stage video").count() == 0
    page.context.close()


def spoiled(checks, page, path, spoil):
    """A file that is removed or changed after some frames is to be chosen again."""
    choose_file(page, path)
    # Holds the file back: otherwise all of it may be read before the test damages it.
    release = held_file(page, 20)
    drag(page, sent_box(checks.files.truth[0]))
    frames(page, 8)
    page.locator("#pause").click()
    spoil()
    release()
    page.locator("#pause").click()
    said(page, f"The file cannot be read: it was moved, changed or removed. Choose {path.name} again.")
    assert page.locator("#resume").is_hidden()


def file_that_is_gone(checks):
    """A file that is removed or changed while it is tracked is no fault of the camera: what was tracked is kept, also
    over a reload, and goes on with the file."""
    whole = checks.files.file("large.mp4", 30, (*H264, "-b:v", "30M", "-g", "20"), turned="noise=alls=20:allf=t")
    path = checks.files.folder / "gone.mp4"
    for spoil in (lambda: path.unlink(), lambda: path.write_bytes(whole.read_bytes() + b"more")):
        path.write_bytes(whole.read_bytes())
        page = checks.page(where="here", allowed=("Failed to load",))
        spoiled(checks, page, path, spoil)
        count = len(kept_rows(page))
        assert 8 <= count < FRAMES, count
        page.reload()
        said(page, f"with {count} frames. Choose gone.mp4")
        path.write_bytes(whole.read_bytes())
        page.locator("#file").set_input_files(path)
        page.locator("body[data-state=paused]").wait_for()
        page.locator("#pause").click()
        to_the_end(page)
        assert len(rows(page)) == FRAMES
        page.context.close()


def file_changed_after_a_stop(checks):
    """A file that was changed or renamed after a stop is to be chosen again before one goes on. Another file of its size is
    a video of its own."""
    whole = checks.files.file("clip.mp4", 30, H264).read_bytes()
    path, other, renamed = (checks.files.folder / name for name in ("mine.mp4", "other.mp4", "renamed.mp4"))
    other.write_bytes(whole)
    for chosen in (path, renamed, other):
        path.write_bytes(whole)
        page = checks.page(where="here")
        hurry = slow(page)
        choose_file(page, path)
        drag(page, sent_box(checks.files.truth[0]))
        frames(page, 20)
        page.locator("#stop").click()
        hurry()
        before = kept_rows(page)
        if chosen == renamed:
            path.rename(renamed)
        else:
            os.utime(path, (1, 1))
        page.locator("#resume").click()
        said(page, "Choose mine.mp4 again.")
        assert page.locator("#resume").is_hidden() and rows(page) == before
        page.locator("#file").set_input_files(chosen)
        if chosen == other:
            said(page, DRAW)
        else:
            said(page, f"{chosen.name} is here again, with {len(before)} frames.")
            page.locator("#pause").click()
            to_the_end(page)
            assert len(rows(page)) == FRAMES
        page.context.close()


def file_of_varying_rate(checks):
    """After a while three of seven frames are missing, and the frame before them stays for longer."""
    path, numbers = checks.files.varying_file()
    page = checks.page()
    follow_file(checks, page, path)
    to_the_end(page)
    check_rows(rows(page), path, checks.files.truth, numbers, times_of(path))
    page.context.close()


def file_of_a_phone(checks):
    page = checks.page()
    follow_file(checks, page, path := checks.files.phone_file())
    to_the_end(page)
    check_rows(rows(page), path, checks.files.truth, list(range(FRAMES)), times_of(path))
    check_video(saved_video(checks, page, "phone.webm"), list(range(FRAMES)), FRAMES / 30)
    page.context.close()


def file_with_corrections(checks):
    """A corrected frame stays one frame of the video; the video is saved while the file goes on."""
    path = checks.files.file("clip.mp4", 30, H264)
    page = checks.page()
    slow(page)
    follow_file(checks, page, path)
    frames(page, 20)
    page.locator("#pause").click()
    drag(page, [200, 200, 80, 60])
    said(page, "The box is corrected")
    page.locator("#pause").click()
    frames(page, 30)
    video = saved_video(checks, page, "corrected.webm")
    stop(page)
    table = rows(page)
    scale = SIZE[0] / SENT[0]
    own = {"x": 200 * scale, "y": 200 * scale, "width": 80 * scale, "height": 60 * scale}
    # The table does not tell a box that was drawn from one that was tracked near it.
    [first, frame] = drawn_frames(page)
    assert first == 0 and all(abs(float(table[frame][side]) - own[side]) < 2 for side in own), table[frame]
    assert [int(row["frame"]) for row in table] == list(range(len(table)))
    shown = frame_numbers(video, *SENT)
    assert len(shown) >= 30 and shown == list(range(len(shown))), shown
    page.context.close()


class Mortal:
    """A service behind a line. It can be killed and started again."""

    def __init__(self, checks, *flags, **environment):
        self.start = lambda: Service(checks.program, *flags, **environment)
        self.service = self.start()
        self.line = Line(self.service.port)
        self.url = self.line.url

    def restart(self):
        self.service.process.kill()
        self.service.process.wait()
        self.service = self.start()
        self.line.target = self.service.port
        self.line.cut()


BROKEN = ("WebSocket", "ERR_CONNECTION", "ERR_EMPTY", "Failed to load")


def service_killed(checks):
    """The service is killed and started again. With its secret it takes the snapshot, without one the last box."""
    path = checks.files.file("clip.mp4", 30, H264)
    for environment, says in ((SECRET, "The line is back"), ({}, "had lost the session")):
        mortal = Mortal(checks, **environment)
        page = checks.page(url=mortal.url, allowed=BROKEN)
        hurry = slow(page)
        follow_file(checks, page, path)
        frames(page, 45)
        mortal.restart()
        was_said(page, says)
        hurry()
        to_the_end(page)
        check_rows(rows(page), path, checks.files.truth, list(range(FRAMES)), [n / 30 for n in range(FRAMES)])
        page.context.close()
        mortal.service.stop()


def paused_past_the_expiry(checks):
    service = Service(checks.program, "--session-idle", "3")
    page = checks.page(url=service.url, allowed=("404", "410"))
    hurry = slow(page)
    path = checks.files.file("clip.mp4", 30, H264)
    follow_file(checks, page, path)
    frames(page, 15)
    page.locator("#pause").click()
    hurry()
    service.wait_for_no_session()
    page.locator("#pause").click()
    to_the_end(page)
    check_rows(rows(page), path, checks.files.truth, list(range(FRAMES)), [n / 30 for n in range(FRAMES)])
    page.context.close()
    service.stop()


HOLE = 600 << 20
"""Bytes of nothing: more than a browser reads ahead, and than the page copies. They take no room on the disk."""


def picture_that_is_gone(checks):
    """Where the picture of an earlier frame cannot be read again, the file is to be chosen again: it takes the place of
    the one that is gone, and nothing is asked of what reads no more. So with a folder of images."""
    whole = checks.files.file("large.mp4", 30, (*H264, "-b:v", "30M", "-g", "20"), turned="noise=alls=20:allf=t")
    path = checks.files.folder / "gone.mp4"
    drawn = {checks.files.folder / f"gone{at}.jpg": checks.files.folder / f"img/{at + 1:04}.jpg" for at in range(6)}
    for copies, size, count, name in (({path: whole}, SIZE, 41, "gone.mp4"), (drawn, DRAWN, 6, "the images")):
        for copy, file in copies.items():
            copy.write_bytes(file.read_bytes())
        first, *_ = copies
        table = [[frame, frame / 30, 10, 10, 60, 60, 0.9, "tracking", int(frame == 0)] for frame in range(count)]
        video = {"name": first.name, "width": size[0], "height": size[1]}
        project = checks.files.folder / "gone.bagtrack.json"
        project.write_text(json.dumps({"bagtrack_project": 1, "video": video, "objects": [{"rows": table}]}))
        page = checks.page(where="here", allowed=("Failed to load",))
        page.locator("#file").set_input_files([project, *copies])
        said(page, f"{first.name} is here again")
        for copy in copies:
            copy.unlink()
        page.locator("#back").click()
        said(page, f"The file cannot be read: it was moved, changed or removed. Choose {name} again.")
        assert page.locator("#resume").is_hidden() and page.locator("body[data-state=ended]").count() == 1
        for copy, file in copies.items():
            copy.write_bytes(file.read_bytes())
        say_nothing(page)
        page.locator("#file").set_input_files(list(copies))
        said(page, f"{first.name} is here again, with {count} frames.")
        assert len(rows(page)) == count
        page.context.close()


def holed_file(checks, name):
    """A video whose last part lies far behind the others."""
    whole = checks.files.file("slow.mp4", 10, (*H264, "-b:v", "8M"), turned="noise=alls=20:allf=t")
    data = bytearray(whole.read_bytes())
    table = data.rindex(b"stco") + 12
    count = int.from_bytes(data[table - 4 : table], "big")
    places = range(table, table + 4 * count, 4)
    behind = places[3 * count // 4 :]
    cut = int.from_bytes(data[behind[0] :][:4], "big")
    for place in [data.index(b"mdat") - 4, *behind]:
        data[place : place + 4] = (int.from_bytes(data[place : place + 4], "big") + HOLE).to_bytes(4, "big")
    path = checks.files.folder / name
    with path.open("wb") as file:
        file.write(data[:cut])
        file.seek(HOLE, 1)
        file.write(data[cut:])
    return path


def file_gone_over_plain_http(checks):
    """A file that is removed or changed while it is played is to be chosen again. It goes on then where it stood; another
    one that is chosen is tracked for itself."""
    service = Service(checks.program, "--allowed-hosts", "machine.test")
    browser = checks.launch("--host-resolver-rules=MAP machine.test 127.0.0.1")
    url = f"http://machine.test:{service.port}"
    path = holed_file(checks, "gone.mp4")
    # Browsers notice a change by the file's modification time, in seconds.
    for spoil in (path.unlink, lambda: os.utime(path, (1, 1))):
        page = checks.page(url=url, browser=browser, where="here", allowed=("Cross-Origin-Opener-Policy", "Failed to load"))
        spoiled(checks, page, path, spoil)
        before = kept_rows(page)
        holed_file(checks, "gone.mp4")
        page.locator("#file").set_input_files(path)
        said(page, f"gone.mp4 is here again, with {len(before)} frames.")
        page.locator("#pause").click()
        frames(page, len(before) + 8)
        stop(page)
        table = rows(page)
        assert table[: len(before)] == before and [int(row["frame"]) for row in table] == list(range(len(table)))
        page.context.close()
    browser.close()
    service.stop()


BUSY = """() => {
    const { requestVideoFrameCallback: tell, pause } = HTMLVideoElement.prototype;
    HTMLVideoElement.prototype.requestVideoFrameCallback = function (told) {
        return tell.call(this, (now, frame) => {
            if (this.paused || frame.presentedFrames % 3 === 0) told(now, frame);
            else this.requestVideoFrameCallback(told);
        });
    };
    HTMLVideoElement.prototype.pause = function () {
        const late = performance.now() + 150;
        while (performance.now() < late);
        pause.call(this);
    };
}"""
"""A browser that tells of each third frame only while it plays, and pauses late."""


def played_on_a_busy_machine(checks):
    """A file that is played gives each frame its number and its time where the browser passes frames over: from the
    beginning on, after the page was loaded anew, and from the middle on."""
    service = Service(checks.program, "--allowed-hosts", "machine.test")
    browser = checks.launch("--host-resolver-rules=MAP machine.test 127.0.0.1")
    allowed = ("Cross-Origin-Opener-Policy", "Failed to load")
    page = checks.page(url=f"http://machine.test:{service.port}", browser=browser, where="here", allowed=allowed)
    path = checks.files.folder / "busy.mp4"
    whole = checks.files.file("clip.mp4", 30, H264).read_bytes()
    path.write_bytes(whole)
    page.evaluate(BUSY)
    follow_file(checks, page, path)
    frames(page, 10)
    page.locator("#stop").click()
    before = kept_rows(page)
    page.reload()
    said(page, "is here again")
    page.evaluate(BUSY)
    page.locator("#pause").click()
    frames(page, len(before) + 10)
    stop(page)
    table = rows(page)
    check_rows(table, path, checks.files.truth, range(len(table)), [number / 30 for number in range(len(table))])
    choose_file(page, path)
    begin_at(page, 1, 30)
    drag(page, sent_box(checks.files.truth[30]))
    frames(page, 5)
    stop(page)
    told = [(int(row["frame"]), round(30 * float(row["time"]), 1)) for row in rows(page)]
    assert told == [(number, number) for number in range(30, 30 + len(told))], told
    browser.close()
    service.stop()


def plain_http(checks):
    """A page that came over http from another machine: no camera, no encoder of videos; the rest works."""
    service = Service(checks.program, "--allowed-hosts", "machine.test")
    browser = checks.launch("--host-resolver-rules=MAP machine.test 127.0.0.1")
    # Chromium says in an error that it takes this header from https and localhost only.
    allowed = ("Cross-Origin-Opener-Policy",)
    page = checks.page(url=f"http://machine.test:{service.port}", browser=browser, allowed=allowed)
    page.locator("#camera").click()
    said(page, "https")
    assert not page.evaluate("isSecureContext")
    path = checks.files.file("clip.mp4", 30, H264)
    follow_file(checks, page, path)
    frames(page, 30)
    stop(page)
    table = rows(page)
    assert page.locator("#no-encoder").is_visible()
    video = saved_video(checks, page, "saved.mkv")
    check_video(video, list(range(len(table))), len(table) / 30)
    browser.close()
    service.stop()


ALL = [
    h264_file,
    vp8_file,
    cut_file,
    cut_in_its_first_frame,
    file_of_varying_rate,
    file_that_is_gone,
    picture_that_is_gone,
    file_changed_after_a_stop,
    file_of_a_phone,
    file_with_corrections,
    service_killed,
    paused_past_the_expiry,
    plain_http,
    played_on_a_busy_machine,
    file_gone_over_plain_http,
]

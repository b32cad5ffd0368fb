"""What one opens: a folder of images, files that are dropped or pasted, a file from its middle."""

import base64
import io
import json
import time
import zipfile

from browser import DRAW, TO_THE_END, begin_at, distance, drag, rows, said, saved, to_the_end
from clips import BITS, BLOCK, FRAMES, H264, MPEG4, SIZE, VP8
from files import check_distance, check_rows, check_video, choose_file, saved_video, sent_box, times_of

EMPTY = ("empty.mp4", "", "empty.mp4 is empty")
TEXT = ("text.txt", "a", "neither a video nor an image")
PHOTO = ("IMG_1.HEIC", "a", "is not an image that this browser can read. JPEG and PNG open in all.")
COUNT = 20
"""Images of a folder."""
BEGUN = 1.0
"""Where a file is begun, in seconds."""


def folder_of_images(checks):
    """The images are tracked in the order of their numbers, though their names are not padded."""
    folder = checks.files.folder / "walk"
    folder.mkdir(exist_ok=True)
    for index in range(COUNT):
        (folder / f"image{index}.jpg").write_bytes(checks.service.bytes(f"/sample/card/{3 * index}.jpg"))
    (folder / "notes.txt").write_text("no image")
    (folder / "labels.json").write_text("{}")
    page = checks.page(where="here")
    page.locator("#folder").set_input_files(folder)
    said(page, DRAW)
    truth = checks.clips["card"]["truth"][::3]
    drag(page, truth[0])
    to_the_end(page)
    table = rows(page)
    assert [int(row["frame"]) for row in table] == list(range(COUNT))
    assert table[0]["video"] == "walk", table[0]
    close = sum(distance(row, truth[int(row["frame"])]) <= 10 for row in table)
    assert close >= 0.9 * COUNT, close
    named_as_in_the_folder(page, truth[0])
    page.locator("#kept-text").filter(has_text="walk, 2 objects").wait_for()
    page.reload()
    said(page, "walk is here again")
    named_as_in_the_folder(page)
    page.context.close()


def named_as_in_the_folder(page, added=None):
    """What is saved of two objects of one name has one class, and calls the images as their files."""
    if added:
        page.locator("#add").click()
        drag(page, added)
        said(page, "Followed from frame")
        for name in page.locator("#list input[type=text]").all():
            name.fill("card")
    coco = json.loads(saved(page, "#save-coco"))
    assert {image["file_name"] for image in coco["images"]} == {f"image{index}.jpg" for index in range(COUNT)}
    assert coco["categories"] == [{"id": 1, "name": "card", "supercategory": ""}], coco["categories"]
    assert {(note["category_id"], note["track_id"]) for note in coco["annotations"]} == {(1, 1), (1, 2)}
    archive = zipfile.ZipFile(io.BytesIO(saved(page, "#save-yolo")))
    assert set(archive.namelist()) == {"data.yaml", *(f"labels/train/image{index}.txt" for index in range(COUNT))}
    assert archive.read("data.yaml").decode().endswith('names:\n  0: "card"\n')
    assert saved(page, "#save-cvat").decode().count("<label>") == 1


def folder_with_a_damaged_image(checks):
    """All images before one that cannot be read are tracked, and can be corrected."""
    folder = checks.files.folder / "torn"
    folder.mkdir(exist_ok=True)
    for index in range(COUNT):
        (folder / f"image{index}.jpg").write_bytes(checks.service.bytes(f"/sample/card/{3 * index}.jpg"))
    (folder / "image15.jpg").write_bytes(b"no image")
    for where in ("here", "there"):
        page = checks.page(where=where)
        page.locator("#folder").set_input_files(folder)
        said(page, DRAW)
        truth = checks.clips["card"]["truth"][::3]
        drag(page, truth[0])
        said(page, "image15.jpg is not an image")
        table = rows(page)
        assert [int(row["frame"]) for row in table] == list(range(15))
        page.locator("#timeline").focus()
        page.keyboard.press("Home")
        page.locator("#timeline[aria-valuenow='0']").wait_for()
        drag(page, truth[0])
        said(page, "Followed anew from frame 0")
        assert len(rows(page)) == 15
        page.context.close()


def folder_of_a_phone(checks):
    """Photos of a kind that the browser does not read are left out of a folder, which is said; the others are tracked."""
    folder = checks.files.folder / "photos"
    folder.mkdir(exist_ok=True)
    for index in range(COUNT):
        (folder / f"image{index}.jpg").write_bytes(checks.service.bytes(f"/sample/card/{3 * index}.jpg"))
    for index in (0, 7, 30):
        (folder / f"image{index}b.HEIC").write_bytes(b"\0\0\0\x18ftypheic")
    page = checks.page(where="here")
    page.locator("#folder").set_input_files(folder)
    said(page, "Left out, for this browser cannot read it: image0b.HEIC and 2 more.")
    drag(page, checks.clips["card"]["truth"][0])
    to_the_end(page)
    coco = json.loads(saved(page, "#save-coco"))
    assert [image["file_name"] for image in coco["images"]] == [f"image{index}.jpg" for index in range(COUNT)]
    page.context.close()


HANDED = """([kind, names, type, content]) => {
    const bytes = Uint8Array.from(atob(content), (sign) => sign.charCodeAt(0));
    const data = new DataTransfer();
    for (const name of names) data.items.add(new File([bytes], name, { type }));
    const event = kind === "paste"
        ? new ClipboardEvent("paste", { clipboardData: data, bubbles: true })
        : new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true });
    document.body.dispatchEvent(event);
}"""


def dropped_and_pasted(checks):
    path = checks.files.file("clip.webm", 25, VP8)
    content = base64.b64encode(path.read_bytes()).decode()
    for kind in ("drop", "paste"):
        page = checks.page(where="here")
        page.evaluate(HANDED, [kind, [path.name], "video/webm", content])
        said(page, DRAW)
        assert path.name not in page.locator("#message").inner_text()
        page.evaluate(HANDED, [kind, ["one.webm", "two.webm"], "video/webm", content])
        said(page, "Of 2 videos this is one.webm: open one at a time.")
        page.context.close()


RECORDED = """async ([mimeType, seconds]) => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [320, 240];
    const context = canvas.getContext("2d");
    const recorder = new MediaRecorder(canvas.captureStream(), { mimeType });
    const parts = [];
    recorder.ondataavailable = ({ data }) => parts.push(data);
    const stopped = new Promise((resolve) => (recorder.onstop = resolve));
    recorder.start(100);
    const begun = performance.now();
    for (let now = begun; now - begun < 1000 * seconds; now = await new Promise(requestAnimationFrame)) {
        for (let y = 0; y < 240; y += 40) for (let x = 0; x < 320; x += 40) {
            context.fillStyle = `hsl(${x + y} 30% 50%)`;
            context.fillRect(x, y, 40, 40);
        }
        context.fillStyle = "white";
        context.fillRect(100 + (now - begun) / 50, 100, 30, 30);
        context.fillStyle = "black";
        context.fillRect(108 + (now - begun) / 50, 108, 14, 14);
    }
    recorder.stop();
    await stopped;
    const reader = new FileReader();
    reader.readAsDataURL(new Blob(parts));
    await new Promise((resolve) => (reader.onload = resolve));
    return reader.result.split(",")[1];
}"""


def recorded_in_a_browser(checks):
    """What a browser records, it writes as it comes: neither the file nor its parts say how long they are, a part of an
    MP4 file begins later than the one before it ends, and H.264 in WebM is a stream of bytes."""
    page = checks.page(where="here")
    for kind in ("video/webm;codecs=vp8", "video/webm;codecs=h264", "video/mp4"):
        if not page.evaluate("(kind) => MediaRecorder.isTypeSupported(kind)", kind):
            print(f"  left out, for this browser does not record it: {kind}")
            continue
        path = checks.files.folder / ("recorded." + kind[len("video/") :].split(";")[0])
        path.write_bytes(base64.b64decode(page.evaluate(RECORDED, [kind, 2])))
        choose_file(page, path)
        drag(page, [100, 100, 30, 30])
        to_the_end(page)
        table, times = rows(page), times_of(path)
        assert len(times) > 10, times
        told = [float(row["time"]) for row in table]
        assert len(told) == len(times) and max(map(abs, map(float.__sub__, told, times))) < 0.0015, (told, times)
        # The target moves 20 pixels a second. On a busy machine, the last frame is drawn earlier.
        assert times[-1] > 1 and abs(float(table[-1]["x"]) - 100 - 20 * times[-1]) < 6, (kind, table[-1])
    page.context.close()


def begun_in_the_middle(checks):
    """A file is begun at a later frame. Its rows have the numbers and times of the file."""
    for path, rate in ((checks.files.file("clip.mp4", 30, H264), 30), (checks.files.file("clip.webm", 25, VP8), 25)):
        page = checks.page(where="here")
        choose_file(page, path)
        first = round(BEGUN * rate)
        begin_at(page, BEGUN, first)
        drag(page, sent_box(checks.files.truth[first]))
        to_the_end(page)
        table = rows(page)
        assert [int(row["frame"]) for row in table] == list(range(first, FRAMES)), [row["frame"] for row in table]
        off = [row["time"] for row, time in zip(table, times_of(path)[first:]) if abs(float(row["time"]) - time) > 0.0015]
        assert not off, off
        check_distance(path, table, checks.files.truth[first:])
        page.context.close()


def decoded_by_the_service(checks):
    """A file that the browser cannot play is uploaded when one says so, and is then tracked frame by frame, each at its
    own time. Three of seven frames are missing after a while."""
    path = checks.files.file("old.mp4", 30, MPEG4, "gt(mod(n,7),2)+lt(n,20)")
    numbers = [n for n in range(FRAMES) if n % 7 > 2 or n < 20]
    for where in ("here", "there"):
        page = checks.page(where=where)
        uploads = []
        page.on("request", lambda request: request.method == "POST" and uploads.append(request.url))
        page.locator("#file").set_input_files(path)
        said(page, "This browser cannot play old.mp4")
        checks.no_axe_violations(page, "a file that cannot be played")
        assert not uploads, uploads
        assert page.locator("#decode").inner_text() == "Let the service decode old.mp4"
        page.locator("#decode").click()
        said(page, DRAW)
        assert not page.locator("#decode").is_visible()
        drag(page, sent_box(checks.files.truth[0]))
        to_the_end(page)
        check_rows(rows(page), path, checks.files.truth, numbers, times_of(path))
        video = saved_video(checks, page, f"decoded-{where}.webm")
        check_video(video, numbers, times_of(path)[-1] + 1 / 30)
        page.context.close()


def frames_of_a_gif(checks):
    """An animation is tracked frame by frame, each at its own time: three of seven are missing after a while."""
    selected = "(gt(mod(n,7),2)+lt(n,20))*lt(n,34)"
    numbers = [n for n in range(34) if n % 7 > 2 or n < 20]
    path = checks.files.file("clip.gif", 25, (), selected, "scale=528:396")
    page = checks.page(where="here")
    choose_file(page, path)
    half = lambda box: [value / 2 for value in box]
    drag(page, half(checks.files.truth[0]))
    to_the_end(page)
    table = rows(page)
    told = [float(row["time"]) for row in table]
    assert len(told) == len(numbers) and max(map(abs, map(float.__sub__, told, times_of(path)))) < 0.0015, told
    check_distance(path, table, [half(checks.files.truth[number]) for number in numbers])
    page.locator("#kept-text").filter(has_text=f"{len(numbers)} rows").wait_for()
    page.reload()
    said(page, "clip.gif is here again")
    assert rows(page) == table
    page.context.close()


def animations_without_their_frames(checks):
    """Over plain http a page is not given the frames of an animation: it is not taken for a still image."""
    page = checks.page(where="here")
    page.context.add_init_script("delete window.ImageDecoder;")
    page.reload()
    begun = checks.files.folder / "begun.webp"
    begun.write_bytes(b"RIFF\xff\0\0\0WEBPVP8X" + bytes(14) + b"ANIM" + bytes(10) + b"ANMF" + bytes(210))
    frames = checks.files.file("clip.apng", 25, (), "lt(n,4)", "scale=264:198")
    for path in (frames.rename(frames.with_suffix(".png")), begun):
        page.locator("#file").set_input_files(path)
        said(page, f"This browser cannot play {path.name}")
    page.context.close()


def no_sample(checks):
    """A sample that does not come, as when the service has gone, is told in words of the page."""
    page = checks.page(where="here", allowed=("Failed to load",))
    page.route("**/sample/card/*", lambda route: route.abort())
    page.locator("#card").click()
    said(page, "The sample clip cannot be loaded")
    page.context.close()


def no_video_at_all(checks):
    """What neither the browser nor the service can read is refused with a reason, and the page goes on."""
    page = checks.page(where="here", allowed=("Failed to load",))
    path = checks.files.folder / "no video.mp4"
    path.write_bytes(bytes(4000))
    page.locator("#file").set_input_files(path)
    said(page, "This browser cannot play no video.mp4")
    page.locator("#decode").click()
    said(page, "MP4, WebM, GIF")
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    page.context.close()


def decoding_overtaken(checks):
    """Who chooses something else while the service decodes a file, stops the upload."""
    page = checks.page(where="here", allowed=("ERR_FAILED", "ERR_ABORTED"))
    page.route("**/frames", lambda route: None)
    page.locator("#file").set_input_files(checks.files.file("old.mp4", 30, MPEG4, "gt(mod(n,7),2)+lt(n,20)"))
    said(page, "This browser cannot play old.mp4")
    with page.expect_event("requestfailed", lambda request: request.url.endswith("/frames")):
        with page.expect_request("**/frames"):
            page.locator("#decode").click()
        page.locator("#card").evaluate("button => button.click()")
        said(page, DRAW)
    page.wait_for_timeout(300)
    said(page, DRAW)
    page.unroute_all(behavior="ignoreErrors")
    page.context.close()


def no_use_to_a_decoder(checks):
    """An empty file, a text and a photo of a phone are refused, and the service is not offered to decode them."""
    page = checks.page(where="here")
    for name, content, says in (EMPTY, TEXT, PHOTO):
        path = checks.files.folder / name
        path.write_text(content)
        page.locator("#file").set_input_files(path)
        said(page, says)
        assert page.locator("#decode").is_hidden()
    page.context.close()


def steps_of_varying_rate(checks):
    """Before the first box each step is one frame, also where the rate changes."""
    path, numbers = checks.files.varying_file()
    page = checks.page(where="here")
    choose_file(page, path)
    for frame in range(1, len(numbers)):
        page.locator("#forward").click()
        page.locator("#begin-time").filter(has_text=f", frame {frame}").wait_for()
        told = float(page.locator("#begin-time").inner_text().split()[0])
        assert abs(told - numbers[frame] / 30) < 0.006, (frame, told)
    page.locator("#back").click()
    page.locator("#begin-time").filter(has_text=f", frame {len(numbers) - 2}").wait_for()
    page.context.close()


OPEN = ("-x264-params", "open-gop=1:keyint=20:min-keyint=20", "-bf", "3")
"""Frames before one that decoding may begin with are made from it, and from those before it."""
LOOKS = """(canvas, [bits, block, size]) => {
    const side = (block * canvas.width) / size;
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const green = (x, y) => data[4 * (Math.floor(y) * canvas.width + Math.floor(x)) + 1];
    const isLit = (bit) => green((bit + 0.5) * side, side / 2) > 127;
    const number = Array.from({ length: bits }, (_, bit) => (isLit(bit) ? 2 ** bit : 0)).reduce((sum, one) => sum + one);
    const some = Array.from({ length: 2000 }, (_, at) => green((at * 37) % canvas.width, (at * 53) % canvas.height));
    return [number, some];
}"""
"""The number that is drawn into the picture, and some of its pixels."""


def steps_in_open_groups(checks):
    """Back and forth each step shows the same picture, also where decoding has to begin two groups of pictures before."""
    page = checks.page(where="here")
    choose_file(page, checks.files.file("open.mp4", 30, (*H264, *OPEN)))
    looked = {}
    for button, numbers in (("forward", range(1, 46)), ("back", range(44, 0, -1))):
        for number in numbers:
            page.locator(f"#{button}").click()
            late = time.monotonic() + TO_THE_END / 1000
            while (looks := page.locator("#picture").evaluate(LOOKS, [BITS, BLOCK, SIZE[0]]))[0] != number:
                assert time.monotonic() < late, (button, number, looks[0])
                page.wait_for_timeout(20)
            known = looked.setdefault(number, looks[1])
            off = sum(abs(one - other) > 8 for one, other in zip(known, looks[1]))
            assert off < 20, f"{button} to frame {number}: {off} of {len(known)} pixels differ"
    page.context.close()


TEXTS = """() => {
    window.texts = [];
    const fillText = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
        window.texts.push(text);
        return fillText.call(this, text, ...place);
    };
}"""


def size_while_drawing(checks):
    """The size of the box that is drawn is told in the video's own pixels."""
    page = checks.page(where="here")
    choose_file(page, checks.files.file("clip.mp4", 30, H264))
    page.evaluate(TEXTS)
    drag(page, [200, 200, 200, 100])
    # Other texts are those of the timeline.
    [width, height] = map(int, [text for text in page.evaluate("window.texts") if " × " in text].pop().split(" × "))
    assert abs(width - 220) <= 2 and abs(height - 110) <= 2, (width, height)
    page.context.close()


ALL = [
    decoding_overtaken,
    no_use_to_a_decoder,
    steps_of_varying_rate,
    size_while_drawing,
    steps_in_open_groups,
    folder_of_images,
    folder_with_a_damaged_image,
    folder_of_a_phone,
    dropped_and_pasted,
    recorded_in_a_browser,
    begun_in_the_middle,
    decoded_by_the_service,
    frames_of_a_gif,
    animations_without_their_frames,
    no_sample,
    no_video_at_all,
]

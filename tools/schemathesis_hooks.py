"""What no schema can tell: which bytes are a picture, which box lies on it, and which parameters are too much together.

schemathesis loads this file (`SCHEMATHESIS_HOOKS`). Pictures of one size are sent wherever a file is described, as are
snapshots of a session that is opened here. Requests that are meant to be valid get a box inside the picture, a fresh
idempotency key, and few tracker parameters. Requests that are meant to be invalid are sent as they were made, but for
flags of forms.
"""

import base64
import os
import struct
import uuid
import zlib

import requests
import schemathesis
from hypothesis import strategies as st
from schemathesis import GenerationMode
from schemathesis.transport.serialization import Binary

WIDTH, HEIGHT = 64, 48
URL = os.environ["BAGTRACK_URL"]


def png(t):
    """Picture t: a bright target on a pattern."""
    def pixel(x, y):
        inside = 20 + t <= x < 36 + t and 15 <= y < 27
        return 150 + ((x - t) * 11 ^ y * 7) % 100 if inside else (x * 3 ^ y * 5) % 90

    rows = b"".join(b"\0" + bytes(pixel(x, y) for x in range(WIDTH)) for y in range(HEIGHT))
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows)),
        (b"IEND", b""),
    ]
    body = b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + body


PICTURES = [png(t) for t in range(4)]


def snapshot():
    """The bytes of a session."""
    created = requests.post(f"{URL}/sessions", params={"box": "20,15,16,12"}, data=PICTURES[0], timeout=60)
    created.raise_for_status()
    return requests.get(f"{URL}{created.headers['location']}/snapshot", timeout=60).content


VIDEO = bytes.fromhex(
    "47494638396101000100800000000000ffffff21f90401000000002c00000000010001000002024401003b"
)
"""A GIF of one pixel, for the call that takes a video and no picture."""

# The service looks at the bytes: a picture is taken for any of these.
KINDS = ["image/png", "image/jpeg", "image/webp", "image/gif", "application/octet-stream"]
KINDS += ["video/mp4", "video/webm", "video/x-motion-jpeg"]
for kind in KINDS:
    schemathesis.openapi.media_type(kind, st.sampled_from(PICTURES))
# The parts of forms.
schemathesis.openapi.format("binary", st.sampled_from(PICTURES).map(Binary))
schemathesis.openapi.media_type("application/vnd.bagtrack.snapshot", st.just(snapshot()))


def box(number):
    """A box inside the picture, for a number."""
    return {"x": number % 30, "y": number % 20, "width": 12 + number % 10, "height": 10 + number % 8}


def text_of(box):
    return f"{box['x']},{box['y']},{box['width']},{box['height']}"


schemathesis.openapi.format("box", st.integers(0, 99).map(lambda number: text_of(box(number))))
schemathesis.openapi.format("boxes", st.just("20,15,16,12;30,20,12,10"))
schemathesis.openapi.format("json", st.sampled_from(["{}", '{"particles": 80}', '{"seed": 7, "sigma": 0.3}']))


def path_takes_several(case):
    return case.operation.path in ("/track", "/sessions/{id}/frames")


FLAGS = ["backwards", "draw", "keyframes", "until_lost", "verbose"]
FLAG_TEXTS = ["", "0", "1", "False", "True", "false", "true"]
"""A form has texts alone, and the service takes these for a flag."""


def make_flags_invalid(case):
    """A flag of a form that is invalid by its type alone has the same text as a valid one. It gets another."""
    if isinstance(case.body, dict) and case.media_type == "multipart/form-data":
        for name in FLAGS:
            value = case.body.get(name)
            if isinstance(value, (int, str)) and not isinstance(value, bool) and str(value) in FLAG_TEXTS:
                case.body[name] = "neither"


@schemathesis.hook
def before_call(context, case, kwargs):
    if case.meta is None:
        return
    if not case.meta.generation.mode.is_positive:
        make_flags_invalid(case)
        return
    before_call.count += 1
    count = before_call.count
    media_type = case.media_type or ""
    query = case.query or {}
    if case.headers and "Idempotency-Key" in case.headers:
        # A key belongs to one request.
        case.headers["Idempotency-Key"] = str(uuid.uuid4())
    body = case.body if isinstance(case.body, dict) else None
    if body is not None and media_type == "application/json":
        if body.get("box") is not None:
            body["box"] = box(count)
        if body.get("parameters") is not None:
            # Each value is in its range; large ones can be too much together.
            body["parameters"] = {name: body["parameters"][name] for name in ("seed",) if name in body["parameters"]}
        picture = base64.b64encode(PICTURES[count % len(PICTURES)]).decode()
        if body.get("frame") is not None:
            body["frame"] = picture
        if body.get("frames") is not None:
            body["frames"] = [picture for _ in body["frames"]]
        if path_takes_several(case) and body.get("frame") is None and not body.get("frames"):
            # One of the two has to be there.
            body["frame"] = picture
    path, method = case.operation.path, case.method.upper()
    # A target may be named where there are several; one frame alone is drawn.
    for name in ["target", "draw"]:
        query.pop(name, None)
        if body is not None and name in body:
            body.pop(name)
    # Boxes stand in place of a box.
    if body is not None:
        body.pop("boxes", None)
    if "box" in query or (body and body.get("box")):
        query.pop("boxes", None)
    elif "boxes" in query:
        query["boxes"] = "20,15,16,12;30,20,12,10"
    if path == "/sessions/{id}/target":
        query["target"] = 0
        case.query = query
    if (path, method) == ("/sessions/{id}", "PUT"):
        # An id belongs to one request.
        case.path_parameters["id"] = str(uuid.uuid4())
    if path == "/track":
        # What is sent are pictures, and these are for a video.
        for name in [
            "start", "count", "backwards", "until_lost", "keyframes", "format", "names", "video_name", "rate",
        ]:
            query.pop(name, None)
            if body is not None:
                body.pop(name, None)
    if path == "/frames":
        case.body = VIDEO
    if path == "/track" and body is not None:
        # A track begins: no picture is a snapshot, and a snapshot holds all settings.
        body.pop("snapshot", None)
    if media_type == "application/vnd.bagtrack.snapshot":
        # It holds all settings.
        query.clear()
    elif path in ("/sessions", "/sessions/{id}", "/sessions/{id}/target", "/track") and method in ("POST", "PUT"):
        # The box may be in the query or in the body, and has to be in one of them.
        if not {"box", "boxes"} & query.keys() and not (body and body.get("box")):
            query["box"] = text_of(box(count))
            case.query = query
    # schemathesis judges a changed request again, and takes the pictures of a form for no text.
    case.meta.generation.mode = GenerationMode.POSITIVE


before_call.count = 0

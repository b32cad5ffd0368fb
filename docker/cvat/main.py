"""The function that CVAT calls through Nuclio: it tracks each shape with `POST /track` of a bagtrack service.

Settings, from the environment: BAGTRACK_URL is the service; BAGTRACK_API_KEY is its key, where it has keys;
BAGTRACK_QUERY is what tracks begin with, as `preset=paper&seed=7`.

The state that CVAT keeps for a shape is the track's snapshot, signed by the service and in base64.
"""

import json
import os
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor

# CVAT gives a function 30 seconds.
TIMEOUT = 25
# Shapes that are tracked at a time: fewer than the requests that a client may have in flight by default.
PARALLEL = 4


class Refused(Exception):
    """The service has refused a shape, or gives no answer: the status and the body of the function's answer."""

    def __init__(self, status, body):
        super().__init__(body)
        self.status = status
        self.body = body


def track(request, query=""):
    """The service's answer to `POST /track`."""
    address = os.environ["BAGTRACK_URL"].rstrip("/") + "/track"
    post = urllib.request.Request(
        f"{address}?{query}" if query else address,
        data=json.dumps(request).encode(),
        headers={"Content-Type": "application/json"},
    )
    key = os.environ.get("BAGTRACK_API_KEY")
    if key:
        post.add_header("Authorization", f"Bearer {key}")
    try:
        with urllib.request.urlopen(post, timeout=TIMEOUT) as answer:
            return json.load(answer)
    except urllib.error.HTTPError as refusal:
        raise Refused(refusal.code, refusal.read().decode(errors="replace")) from refusal
    except OSError as error:
        body = json.dumps({"title": "bagtrack gives no answer", "detail": str(error)})
        raise Refused(503, body) from error


def step(image, shape, state):
    """The corners of a target in this image, None where it is lost, and its next state."""
    if state is None:
        xs, ys = sorted(shape[0::2]), sorted(shape[1::2])
        box = {"x": xs[0], "y": ys[0], "width": xs[1] - xs[0], "height": ys[1] - ys[0]}
        answer = track({"frame": image, "box": box}, os.environ.get("BAGTRACK_QUERY", ""))
    else:
        answer = track({"frame": image, "snapshot": state})
    if answer["status"] == "lost":
        return None, answer["snapshot"]
    box = answer["box"]
    corners = [box["x"], box["y"], box["x"] + box["width"], box["y"] + box["height"]]
    return corners, answer["snapshot"]


def handler(context, event):
    """Called by Nuclio for each frame, with an image, shapes and states."""
    request = event.body if isinstance(event.body, dict) else json.loads(event.body)
    shapes, states = request.get("shapes") or [], request.get("states") or []
    # CVAT begins with shapes and no states, and goes on with states and as many nulls.
    count = max(len(shapes), len(states))
    shapes = shapes + [None] * (count - len(shapes))
    states = states + [None] * (count - len(states))
    try:
        with ThreadPoolExecutor(PARALLEL) as pool:
            tracked = list(pool.map(lambda pair: step(request["image"], *pair), zip(shapes, states)))
    except Refused as refused:
        context.logger.warn(f"bagtrack answered {refused.status}: {refused.body}")
        return response(context, refused.body, refused.status)
    answer = {"shapes": [shape for shape, _ in tracked], "states": [state for _, state in tracked]}
    return response(context, json.dumps(answer), 200)


def response(context, body, status):
    """An answer of the function."""
    return context.Response(body=body, headers={}, content_type="application/json", status_code=status)

"""The function that CVAT calls: it sends what it gets to a bagtrack service, and the answer back.

Settings, from the environment: BAGTRACK_URL is the service; BAGTRACK_API_KEY is its key, where it has keys;
BAGTRACK_QUERY is what the service is asked with, as `preset=paper&seed=7`.
"""

import json
import os
import urllib.error
import urllib.request

# CVAT gives a function 30 seconds.
TIMEOUT = 25


def handler(context, event):
    """Called by Nuclio for each frame, with an image, shapes and states."""
    address = os.environ["BAGTRACK_URL"].rstrip("/") + "/integrations/cvat"
    query = os.environ.get("BAGTRACK_QUERY", "")
    request = urllib.request.Request(
        f"{address}?{query}" if query else address,
        data=event.body if isinstance(event.body, bytes) else json.dumps(event.body).encode(),
        headers={"Content-Type": "application/json"},
    )
    key = os.environ.get("BAGTRACK_API_KEY")
    if key:
        request.add_header("Authorization", f"Bearer {key}")
    try:
        with urllib.request.urlopen(request, timeout=TIMEOUT) as answer:
            status, body = answer.status, answer.read()
    except urllib.error.HTTPError as refusal:
        status, body = refusal.code, refusal.read()
        context.logger.warn(f"bagtrack answered {status}: {body.decode(errors='replace')}")
    except OSError as error:
        context.logger.error(f"bagtrack gives no answer: {error}")
        status, body = 503, json.dumps({"title": "bagtrack gives no answer"}).encode()
    return context.Response(
        body=body.decode(), headers={}, content_type="application/json", status_code=status
    )

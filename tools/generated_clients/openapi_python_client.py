"""Tracks the sample clip with the client that openapi-python-client generates: `PROGRAM URL`."""

import io
import sys

from clip import SEED, Clip
from generated_by_openapi_python_client import Client
from generated_by_openapi_python_client.api.sessions import (
    create_session,
    delete_session,
    get_session,
    get_snapshot,
    post_frames,
    put_target,
)
from generated_by_openapi_python_client.models import CreateForm
from generated_by_openapi_python_client.types import File

program, url = sys.argv[1:]
clip = Clip(program)
with Client(base_url=url) as client:

    def body(frame):
        return File(payload=io.BytesIO(frame))

    def flat(answer):
        box = answer.box
        return answer.frame, [box.x, box.y, box.width, box.height], answer.status.value

    def post(number, frame):
        return flat(post_frames.sync(session.id, client=client, body=body(frame), frame=number))

    settings = {"box": clip.box, "seed": SEED, "parameters": "{}"}
    session = create_session.sync(client=client, body=body(clip.frames[0]), **settings)
    clip.compare("openapi-python-client", post)
    assert get_session.sync(session.id, client=client).frames == len(clip.frames)
    corrected = put_target.sync(session.id, client=client, body=body(clip.frames[-1]), box="20,30,40,50")
    assert (corrected.box.x, corrected.box.height) == (20, 50), corrected
    # The generator has no name for this type of answer, so it gives the bytes alone.
    snapshot = get_snapshot.sync_detailed(session.id, client=client).content
    restored = create_session.sync(client=client, body=body(snapshot))
    assert restored.frame == len(clip.frames), restored
    # Where its functions would read every answer as JSON.
    drawn = client.get_httpx_client().post(
        f"/sessions/{restored.id}/frames", params={"draw": True}, content=clip.frames[0]
    )
    assert drawn.content.startswith(b"\x89PNG"), drawn
    form = CreateForm(frame=body(clip.frames[0]), box=clip.box, seed=SEED)
    again = create_session.sync(client=client, body=form)
    assert flat(post_frames.sync(again.id, client=client, body=body(clip.frames[1])))[0] == 1
    refused = post_frames.sync(again.id, client=client, body=body(b"no picture"))
    assert refused.type_ == "/docs/problems#unsupported-image", refused
    for ended in (session, restored, again):
        delete_session.sync_detailed(ended.id, client=client)

"""Tracks the sample clip with the Python client that openapi-generator generates: `PROGRAM URL`."""

import sys

from clip import SEED, Clip
from openapi_client import ApiClient, Configuration, SessionsApi
from openapi_client.exceptions import ApiException

program, url = sys.argv[1:]
clip = Clip(program)
with ApiClient(Configuration(host=url)) as client:
    sessions = SessionsApi(client)
    # Of several media types the generator would name the last, JSON.
    raw = {"_content_type": "application/octet-stream"}

    def post(number, frame):
        answer = sessions.post_frames(session.id, frame, frame=number, **raw)
        box = answer.box
        return answer.frame, [box.x, box.y, box.width, box.height], answer.status.value

    session = sessions.create_session(clip.frames[0], box=clip.box, seed=SEED, **raw)
    clip.compare("openapi-generator, Python", post)
    assert sessions.get_session(session.id).frames == len(clip.frames)
    corrected = sessions.put_target(session.id, clip.frames[-1], box="20,30,40,50", **raw)
    assert (corrected.box.x, corrected.box.height) == (20, 50), corrected
    restored = sessions.create_session(bytes(sessions.get_snapshot(session.id)), **raw)
    assert restored.frame == len(clip.frames), restored
    assert bytes(sessions.get_bag_picture(restored.id)).startswith(b"\x89PNG")
    drawn = sessions.post_frames_without_preload_content(restored.id, clip.frames[0], draw=True, **raw)
    assert drawn.read().startswith(b"\x89PNG"), drawn.status
    try:
        sessions.post_frames(restored.id, b"no picture", **raw)
        raise AssertionError("no picture was taken")
    except ApiException as error:
        assert error.status == 415, error
    for ended in (session, restored):
        sessions.delete_session(ended.id)

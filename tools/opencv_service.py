"""What one would write in place of bagtrack: a tracker of OpenCV behind FastAPI and uvicorn, each frame in a thread.

    TRACKER=CSRT uvicorn --app-dir tools opencv_service:app      # or KCF, MIL; Nano with NANO_BACKBONE and NANO_HEAD
"""

import os
import uuid

import cv2
import numpy
from fastapi import Body, FastAPI

NAME = os.environ.get("TRACKER", "CSRT")
app, sessions = FastAPI(), {}
cv2.setNumThreads(1)


def new_tracker():
    if NAME == "Nano":
        parameters = cv2.TrackerNano_Params()
        parameters.backbone, parameters.neckhead = os.environ["NANO_BACKBONE"], os.environ["NANO_HEAD"]
        return cv2.TrackerNano_create(parameters)
    module = cv2 if hasattr(cv2, f"Tracker{NAME}_create") else cv2.legacy
    return getattr(module, f"Tracker{NAME}_create")()


def picture(body):
    return cv2.imdecode(numpy.frombuffer(body, numpy.uint8), cv2.IMREAD_COLOR)


@app.post("/sessions", status_code=201)
def open_session(box: str, body: bytes = Body()):
    tracker, name = new_tracker(), str(uuid.uuid4())
    tracker.init(picture(body), [round(float(side)) for side in box.split(",")])
    sessions[name] = tracker
    return {"id": name}


@app.post("/sessions/{name}/frames")
def track(name: str, body: bytes = Body()):
    found, box = sessions[name].update(picture(body))
    return {"found": found, "box": box}


@app.delete("/sessions/{name}", status_code=204)
def end(name: str):
    del sessions[name]

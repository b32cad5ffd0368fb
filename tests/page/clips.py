"""Video files of the sample clip, as people have them: larger than what the page sends, each frame with its number."""

import pathlib
import struct
import subprocess

FRAMES = 80
SIZE = (1056, 792)
"""Of the files. The clip is drawn smaller."""
DRAWN = (480, 360)
BITS = 7
BLOCK = 48

H264 = ("-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p")
MPEG4 = ("-c:v", "mpeg4", "-q:v", "2")
"""No browser plays it."""
SOUND = ("-f", "lavfi", "-t", "3", "-i", "sine")
VP8 = ("-c:v", "libvpx", "-b:v", "8M", "-deadline", "realtime", "-cpu-used", "16")


class Clips:
    """Draws the sample clip once, and makes files of it."""

    def __init__(self, program, folder):
        self.folder = pathlib.Path(folder)
        size = ("--width", str(DRAWN[0]), "--height", str(DRAWN[1]), "--frames", str(FRAMES))
        run(program, "sample", "--out", self.folder, *size)
        scale = SIZE[0] / DRAWN[0]
        lines = (self.folder / "groundtruth_rect.txt").read_text().split()
        # OTB counts pixels from 1.
        boxes = [[float(value) for value in line.split(",")] for line in lines]
        self.truth = [[(x - 1) * scale, (y - 1) * scale, w * scale, h * scale] for x, y, w, h in boxes]

    def file(self, name, rate, codec, selected="1", turned="", others=()):
        """A video. `selected` says which frames are in it; the others leave their time to those before. `turned` is a
        filter that comes last, `others` are inputs beside it."""
        path = self.folder / name
        if not path.exists():
            box = f"y=0:h={BLOCK}:t=fill"
            number = [f"drawbox=x=0:w={BITS * BLOCK}:color=black:{box}"]
            number += [
                f"drawbox=x={bit * BLOCK}:w={BLOCK}:color=white:{box}:enable='mod(floor(n/{2**bit}),2)'"
                for bit in range(BITS)
            ]
            filters = ",".join([f"scale={SIZE[0]}:{SIZE[1]}", *number, f"select='{selected}'", *filter(None, [turned])])
            frames = ("-framerate", str(rate), "-i", self.folder / "img" / "%04d.jpg")
            run("ffmpeg", "-v", "error", "-y", *frames, *others, "-vf", filters, "-fps_mode", "vfr", *codec, path)
        return path

    def varying_file(self):
        """A video, and the numbers of its frames: after a while three of seven are missing."""
        numbers = [n for n in range(FRAMES) if n % 7 > 2 or n < 20]
        return self.file("vary.mp4", 30, H264, "gt(mod(n,7),2)+lt(n,20)"), numbers

    def phone_file(self):
        """A video as phones make it that are held upright: with sound, its pictures lie, and its header says so."""
        path = self.file("phone.mov", 30, H264, turned="transpose=cclock", others=SOUND)
        bytes = bytearray(path.read_bytes())
        # Skips the fields before the matrix in a track's header; the matrix turns by 90 degrees clockwise, in 16.16.
        begin = bytes.index(b"tkhd") + 4 + 40
        bytes[begin : begin + 20] = struct.pack(">5i", 0, 1 << 16, 0, -1 << 16, 0)
        path.write_bytes(bytes)
        return path


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True).stdout


def frame_numbers(video, width, height):
    """The numbers that are drawn into the frames of a video of this size."""
    block = BLOCK * width / SIZE[0]
    raw = run("ffmpeg", "-v", "error", "-i", video, "-fps_mode", "passthrough", "-f", "rawvideo", "-pix_fmt", "gray", "-")
    size = width * height
    assert len(raw) % size == 0, (len(raw), width, height)
    middle = int(block / 2) * width
    lit = lambda frame, bit: raw[frame * size + middle + int((bit + 0.5) * block)] > 127
    return [sum(lit(frame, bit) << bit for bit in range(BITS)) for frame in range(len(raw) // size)]

#!/usr/bin/env python3
"""bagtrack beside what one would write in its place: tools/opencv_service.py.

    cargo build --release
    pip install opencv-contrib-python-headless fastapi uvicorn psutil
    tools/compare_services.py CLIP... --trackers CSRT,KCF [--clients 1,8,64] [--nano BACKBONE HEAD] [--targets 16]

A clip is a folder in the layout of OTB. All services get the same frames of each clip in turns. A client sends each
frame when the one before is answered; the clients are one process on the same cores, so times and frames a second are
those of a busy machine. The processor time is the service's alone, and memory is its resident set at the end. Ratios
to bagtrack come first. With --targets there is a line for bagtrack with so many boxes all over the frame, too.
"""

import argparse
import http.client
import json
import os
import pathlib
import re
import socket
import subprocess
import sys
import threading
import time

import cv2
import numpy
import psutil

ROOT = pathlib.Path(__file__).resolve().parent.parent


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Service:
    """A process that tracks over HTTP."""

    def __init__(self, name, options):
        self.name, self.port = name, free_port()
        environment = dict(os.environ)
        if name.startswith("bagtrack"):
            command = [options.bagtrack, "serve", "--listen", f"127.0.0.1:{self.port}", "--log", "warn"]
            # All clients of this measurement have one address.
            command += ["--client-sessions", "1000", "--client-requests", "1000", "--client-connections", "1000"]
            command += ["--queue-delay", "0s"]
        else:
            environment["TRACKER"] = name
            if name == "Nano":
                environment["NANO_BACKBONE"], environment["NANO_HEAD"] = options.nano
            command = [sys.executable, "-m", "uvicorn", "--app-dir", str(ROOT / "tools"), "opencv_service:app"]
            command += ["--port", str(self.port), "--log-level", "warning"]
        self.process = subprocess.Popen(command, env=environment)
        self.watched = psutil.Process(self.process.pid)
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port)).close()
                return
            except OSError:
                time.sleep(0.02)

    def cpu(self):
        times = self.watched.cpu_times()
        return times.user + times.system

    def stop(self):
        self.process.terminate()
        self.process.wait()


class Clip:
    def __init__(self, folder, frames, targets=1):
        paths = sorted(path for path in (folder / "img").iterdir() if path.suffix in {".jpg", ".png"})
        self.name = folder.name
        self.files = [path.read_bytes() for path in paths[: frames + 1]]
        line = (folder / "groundtruth_rect.txt").read_text().split("\n", 1)[0]
        x, y, width, height = (float(number) for number in re.findall(r"[\d.-]+", line))
        self.boxes = [(x - 1, y - 1, width, height)]
        rows, columns = cv2.imdecode(numpy.frombuffer(self.files[0], numpy.uint8), cv2.IMREAD_GRAYSCALE).shape
        for number in range(1, targets):
            left, top = columns * (number % 4 + 0.5) / 4 - width / 2, rows * (number // 4 + 0.5) / 4 - height / 2
            self.boxes.append((left, top, width, height))
        self.type = "image/png" if paths[0].suffix == ".png" else "image/jpeg"


class Client(threading.Thread):
    """Follows the clip once. Its frames count from when all clients have their sessions."""

    def __init__(self, service, clip, frames, start):
        super().__init__()
        self.connection = http.client.HTTPConnection("127.0.0.1", service.port)
        self.clip, self.frames, self.start_together = clip, frames, start
        self.times, self.error = [], None

    def send(self, path, body):
        self.connection.request("POST", path, body, {"Content-Type": self.clip.type})
        answer = self.connection.getresponse()
        text = answer.read()
        if answer.status >= 300:
            raise RuntimeError(f"{answer.status}: {text[:200]}")
        return json.loads(text)

    def run(self):
        try:
            self.connection.connect()
            self.connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            boxes = ";".join(",".join(map(str, box)) for box in self.clip.boxes)
            setting = "box" if len(self.clip.boxes) == 1 else "boxes"
            name = self.send(f"/sessions?{setting}={boxes}", self.clip.files[0])["id"]
            self.start_together.wait()
            for number in range(self.frames):
                begun = time.perf_counter()
                self.send(f"/sessions/{name}/frames", self.clip.files[1 + number % (len(self.clip.files) - 1)])
                self.times.append(time.perf_counter() - begun)
            self.connection.request("DELETE", f"/sessions/{name}")
            self.connection.getresponse().read()
        except Exception as error:  # told by whoever waits for it
            self.error = error
            self.start_together.abort()


def measure(name, clip, clients, frames, options):
    service = Service(name, options)
    try:
        begun = {}

        def note():
            begun["cpu"], begun["at"] = service.cpu(), time.perf_counter()

        start = threading.Barrier(clients, action=note)
        threads = [Client(service, clip, frames, start) for _ in range(clients)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        errors = [thread.error for thread in threads if thread.error is not None]
        if errors:
            raise RuntimeError(f"{name}, {clip.name}: {errors[0]}")
        took, cpu = time.perf_counter() - begun["at"], service.cpu() - begun["cpu"]
        times = sorted(time for thread in threads for time in thread.times)
        return {
            "cpu": 1000 * cpu / len(times),
            "p50": 1000 * times[len(times) // 2],
            "p99": 1000 * times[len(times) * 99 // 100],
            "rate": len(times) / took,
            "memory": service.watched.memory_info().rss / 2**20,
        }
    finally:
        service.stop()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", nargs="+", type=pathlib.Path)
    parser.add_argument("--trackers", default="CSRT,KCF", help="trackers of OpenCV, or '' for none")
    parser.add_argument("--nano", nargs=2, metavar=("BACKBONE", "HEAD"), help="also NanoTrack, with these ONNX files")
    parser.add_argument("--clients", default="1,8,64")
    parser.add_argument("--targets", type=int, default=1, help="also bagtrack with so many targets of one client")
    parser.add_argument("--frames", type=int, default=100, help="frames of all clients together, and at least ten each")
    parser.add_argument("--bagtrack", default=str(ROOT / "target/release/bagtrack"))
    options = parser.parse_args()
    names = ["bagtrack", *filter(None, options.trackers.split(",")), *(["Nano"] if options.nano else [])]
    print("| clip | clients | service | CPU, × bagtrack | CPU ms a frame | p50 ms | p99 ms | frames a second | MiB |")
    print("|---|---:|---|---:|---:|---:|---:|---:|---:|")
    for folder in options.clips:
        for clients in map(int, options.clients.split(",")):
            frames = max(10, options.frames // clients)
            runs = [(name, 1) for name in names]
            if options.targets > 1 and clients == 1:
                runs.insert(1, (f"bagtrack, {options.targets} targets", options.targets))
            base = None
            for name, targets in runs:
                clip = Clip(folder, frames, targets)
                seen = measure(name, clip, clients, frames, options)
                base = base or seen["cpu"]
                print(
                    f"| {clip.name} | {clients} | {name} | {seen['cpu'] / base:.1f} | {seen['cpu']:.2f} | {seen['p50']:.1f} |"
                    f" {seen['p99']:.1f} | {seen['rate']:.0f} | {seen['memory']:.0f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""The price of the store: time a frame without it, with it in a folder and in a Redis, and with a new replica for each
frame.

    cargo build --release
    tools/measure_replicas.py /path/to/sequences/Coke

Starts a Redis and six replicas on free ports. The ways to send a frame are measured in turns, frame by frame, so that
they share what the machine does beside. Beside them: SET and GET of as many bytes as the store holds of the session.
Needs redis-server; no Python packages.
"""

import argparse
import http.client
import pathlib
import socket
import subprocess
import tempfile
import time
import urllib.parse
import uuid


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_for(port):
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port)).close()
        except OSError:
            time.sleep(0.01)


class Redis:
    """A connection that speaks as much of the protocol as is needed."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.file = self.socket.makefile("rb")

    def call(self, *words):
        return self.calls(words)[0]

    def calls(self, *commands):
        """The answers to commands that are sent together."""
        request = b""
        for words in commands:
            words = [word if isinstance(word, bytes) else str(word).encode() for word in words]
            request += b"*%d\r\n" % len(words)
            request += b"".join(b"$%d\r\n%s\r\n" % (len(word), word) for word in words)
        self.socket.sendall(request)
        return [self.answer() for _ in commands]

    def answer(self):
        line = self.file.readline()
        kind, rest = line[:1], line[1:-2]
        if kind == b"$":
            length = int(rest)
            return None if length < 0 else self.file.read(length + 2)[:-2]
        if kind == b"*":
            return [self.answer() for _ in range(int(rest))]
        return rest


class Replica:
    def __init__(self, program, flags):
        port = free_port()
        command = [program, "serve", "--listen", f"127.0.0.1:{port}", "--log", "warn", *flags]
        self.process = subprocess.Popen(command)
        wait_for(port)
        self.connection = http.client.HTTPConnection("127.0.0.1", port)
        self.connection.connect()
        self.connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, method, path, body):
        self.connection.request(method, path, body)
        answer = self.connection.getresponse()
        text = answer.read()
        assert answer.status < 300, (answer.status, text)
        return text


def start_redis(port, folder, fsync):
    """A Redis with an append-only file."""
    redis = subprocess.Popen(
        ["redis-server", "--port", str(port), "--bind", "127.0.0.1", "--save", "", "--appendonly", "yes",
         "--appendfsync", fsync], cwd=folder, stdout=subprocess.DEVNULL)
    wait_for(port)
    return redis


def read(video):
    """The files of a video in the OTB layout, which is 1-based, and the first box for a query."""
    files = [path.read_bytes() for path in sorted((video / "img").iterdir())]
    first = (video / "groundtruth_rect.txt").read_text().split("\n")[0]
    x, y, width, height = [float(number) for number in first.replace(",", " ").split()]
    return files, urllib.parse.quote(f"{x - 1},{y - 1},{width},{height}")


def percentile(times, share):
    return sorted(times)[min(len(times) - 1, int(share * len(times)))] * 1000


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("video", type=pathlib.Path, help="a folder in the OTB layout")
    options.add_argument("--program", default="target/release/bagtrack")
    options.add_argument("--rounds", type=int, default=5, help="how often the video is played")
    options.add_argument("--fsync", default="everysec", help="appendfsync of the Redis")
    options.add_argument("--folder", help="where the stores in folders are made; otherwise in the system's temporary one")
    options.add_argument("--every", default="1", help="--store-every")
    options = options.parse_args()
    files, box = read(options.video)
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        port = free_port()
        redis = start_redis(port, folder, options.fsync)
        store = ["--store", f"redis://127.0.0.1:{port}"]
        alone = Replica(options.program, [])
        in_folders = [
            Replica(options.program, ["--store", f"file:{folder}/{durability}", "--durability", durability])
            for durability in ["250ms", "each"]
        ]
        sticky = Replica(options.program, [*store, "--store-every", options.every])
        turns = [Replica(options.program, store) for _ in range(2)]
        calls = Redis(port)
        times = {"without a store": [], "in a folder, synced every 250 ms": [], "in a folder, each answer synced": [],
                 "with a store, one replica": [], "with a store, replicas in turns": [],
                 "SET and GET alone": []}
        sizes = []
        try:
            for _ in range(options.rounds):
                ids = [uuid.uuid4() for _ in range(5)]
                for replica, name in zip([alone, *in_folders, sticky, turns[0]], ids):
                    replica.send("PUT", f"/sessions/{name}?seed=1&box={box}", files[0])
                for number, file in enumerate(files[1:], 1):
                    replicas = [alone, *in_folders, sticky, turns[number % 2]]
                    for kind, replica, name in zip(times, replicas, ids):
                        before = time.perf_counter()
                        replica.send("POST", f"/sessions/{name}/frames?frame={number}", file)
                        times[kind].append(time.perf_counter() - before)
                    state = calls.call("HGET", f"bagtrack:session:{{{ids[4]}}}", "state")
                    sizes.append(len(state))
                    before = time.perf_counter()
                    calls.call("SET", "probe", state)
                    calls.call("GET", "probe")
                    times["SET and GET alone"].append(time.perf_counter() - before)
        finally:
            for replica in [alone, *in_folders, sticky, *turns]:
                replica.process.terminate()
            redis.terminate()
            redis.wait()
    base = percentile(times["without a store"], 0.5)
    print(f"{options.video.name}: {len(sizes)} frames; bytes of a state: median {sorted(sizes)[len(sizes) // 2]}, "
          f"greatest {max(sizes)}")
    for kind, values in times.items():
        median = percentile(values, 0.5)
        print(f"{kind:34} p50 {median:6.2f} ms ({median / base:4.2f})  p99 {percentile(values, 0.99):6.2f} ms")


if __name__ == "__main__":
    main()

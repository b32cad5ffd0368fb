#!/usr/bin/env python3
"""How many frames a second 1, 2 and 3 replicas get through with one store.

    cargo build --release
    sudo tools/measure_throughput.py /path/to/sequences/Coke

All of them run on this machine, so each replica is held to a share of a core by a control group: what is measured is
whether the store and the protocol let replicas add up, not what a machine of their own would do. 1, 2 and 3 replicas
are measured in turns. Linux only, and root; needs redis-server; no Python packages.
"""

import argparse
import http.client
import pathlib
import socket
import tempfile
import threading
import time
import uuid

from measure_replicas import Replica, free_port, read, start_redis

PERIOD = 20_000


class Share:
    """A control group that gives its processes a share of a core."""

    def __init__(self, share):
        old = pathlib.Path("/sys/fs/cgroup/cpu")
        self.folder = (old if old.is_dir() else old.parent) / f"bagtrack-{uuid.uuid4()}"
        self.folder.mkdir()
        quota = int(PERIOD * share)
        if old.is_dir():
            (self.folder / "cpu.cfs_period_us").write_text(str(PERIOD))
            (self.folder / "cpu.cfs_quota_us").write_text(str(quota))
        else:
            (self.folder / "cpu.max").write_text(f"{quota} {PERIOD}")

    def hold(self, process):
        (self.folder / "cgroup.procs").write_text(str(process.pid))


class Client(threading.Thread):
    """Sends the frames of a session as fast as they are answered, to its replica or to all in turns."""

    def __init__(self, replicas, in_turns, number, clip, end):
        super().__init__()
        self.replicas = replicas if in_turns else [replicas[number % len(replicas)]]
        self.connections = [http.client.HTTPConnection("127.0.0.1", port) for port in self.replicas]
        self.files, self.box = clip
        self.end, self.answered = end, 0

    def send(self, method, path, body, turn):
        connection = self.connections[turn % len(self.connections)]
        if connection.sock is None:
            connection.connect()
            connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.request(method, path, body)
        answer = connection.getresponse()
        text = answer.read()
        assert answer.status < 300, (answer.status, text)

    def run(self):
        name, number = uuid.uuid4(), 1
        self.send("PUT", f"/sessions/{name}?seed=1&box={self.box}", self.files[0], 0)
        while time.monotonic() < self.end:
            file = self.files[number % len(self.files)]
            self.send("POST", f"/sessions/{name}/frames?frame={number}", file, number)
            self.answered, number = self.answered + 1, number + 1
        self.send("DELETE", f"/sessions/{name}", None, number)


def measure(ports, in_turns, options, clip):
    """Frames a second."""
    end = time.monotonic() + options.seconds
    clients = [Client(ports, in_turns, number, clip, end) for number in range(options.clients)]
    for client in clients:
        client.start()
    for client in clients:
        client.join()
    return sum(client.answered for client in clients) / options.seconds


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("video", type=pathlib.Path, help="a folder in the OTB layout")
    options.add_argument("--program", default="target/release/bagtrack")
    options.add_argument("--share", type=float, default=0.2, help="of a core, for each replica")
    options.add_argument("--clients", type=int, default=6)
    options.add_argument("--seconds", type=float, default=6)
    options.add_argument("--rounds", type=int, default=5)
    options = options.parse_args()
    clip = read(options.video)
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        redis = start_redis(port, folder, "everysec")
        replicas = [Replica(options.program, ["--store", f"redis://127.0.0.1:{port}"]) for _ in range(3)]
        shares = []
        for replica in replicas:
            shares.append(Share(options.share))
            shares[-1].hold(replica.process)
        ports = [replica.connection.port for replica in replicas]
        rates = {}
        try:
            for _ in range(options.rounds):
                for in_turns in [False, True]:
                    for count in [1, 2, 3]:
                        rate = measure(ports[:count], in_turns, options, clip)
                        rates.setdefault((in_turns, count), []).append(rate)
        finally:
            for replica in replicas:
                replica.process.terminate()
                replica.process.wait()
            for share in shares:
                share.folder.rmdir()
            redis.terminate()
            redis.wait()
    for in_turns in [False, True]:
        base = sorted(rates[in_turns, 1])[options.rounds // 2]
        for count in [1, 2, 3]:
            middle = sorted(rates[in_turns, count])[options.rounds // 2]
            kind = "in turns" if in_turns else "each session at one replica"
            print(f"{count} replicas, {kind:27} {middle:6.1f} frames a second ({middle / base:4.2f})")


main()

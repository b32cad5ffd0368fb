#!/usr/bin/env python3
"""How many frames a second one core of a Redis stores: the processor time of the script that commits a frame.

    tools/measure_store.py [--bytes 48000] [--clients 8] [--fsync everysec]

Takes the scripts from crates/sessions/src/store/redis/scripts.rs and runs them as replicas do, each client a session of
its own, with a state of so many bytes and without one, as between checkpoints. The figure is the processor time of the
server alone, so what else the machine does changes it little. Needs redis-server; no Python packages.
"""

import argparse
import os
import pathlib
import re
import tempfile
import threading

from measure_replicas import Redis, free_port, start_redis

SCRIPTS = pathlib.Path(__file__).resolve().parent.parent / "crates/sessions/src/store/redis/scripts.rs"


def script(*names):
    source = SCRIPTS.read_text()
    return "".join(re.search(rf'const {name}: &str = r"(.*?)";', source, re.DOTALL).group(1) for name in names)


def processor_time(redis):
    """Seconds that the server has used."""
    lines = redis.call("INFO", "cpu").decode().split()
    used = dict(line.split(":") for line in lines if line.startswith("used_cpu_"))
    return float(used["used_cpu_user"]) + float(used["used_cpu_sys"])


def commit_frames(port, name, scripts, state, frames):
    """What a replica asks for a session of this name, whose frames are stored with `state`, or without one."""
    redis, (create, commit) = Redis(port), scripts
    keys, new = [name, f"{name}:ended"], f"{name}:new"
    redis.call("EVALSHA", create, 2, *keys, 1, 0, "token", "incarnation", "head", state or "state", 60_000)
    for frame in range(frames):
        arguments = [1, frame, frame + 1, f"token {frame}", 60_000, ""]
        if state:
            *_, (*_, answer) = redis.calls(
                ["MULTI"], ["HSET", new, "state", state], ["PEXPIRE", new, 10_000],
                ["EVALSHA", commit, 3, *keys, new, *arguments], ["EXEC"])
        else:
            answer = redis.call("EVALSHA", commit, 2, *keys, *arguments)
        assert answer[0] == b"1", answer


def measure(port, scripts, state, clients, frames):
    """Seconds of the server for a frame."""
    redis = Redis(port)
    names = [f"{{{len(state)} {client}}}" for client in range(clients)]
    threads = [threading.Thread(target=commit_frames, args=(port, name, scripts, state, frames)) for name in names]
    before = processor_time(redis)
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return (processor_time(redis) - before) / (clients * frames)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--bytes", type=int, default=48_000, help="of a state")
    options.add_argument("--clients", type=int, default=8)
    options.add_argument("--frames", type=int, default=3_000, help="of each client")
    options.add_argument("--fsync", default="everysec", help="appendfsync of the Redis")
    options = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        redis = start_redis(port, folder, options.fsync)
        try:
            call = Redis(port).call
            scripts = [
                call("SCRIPT", "LOAD", script(*names))
                for names in [("ABSENT", "TELL", "NEARLY_FULL", "CREATE"), ("ABSENT", "TELL", "COMMIT")]
            ]
            for state in [os.urandom(options.bytes), b""]:
                seconds = measure(port, scripts, state, options.clients, options.frames)
                print(f"{len(state):6} bytes: {seconds * 1e6:.0f} µs a frame, {1 / seconds:.0f} a second of a core")
        finally:
            redis.terminate()
            redis.wait()


if __name__ == "__main__":
    main()

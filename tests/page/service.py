"""The service, and a line to it that can be cut."""

import json
import os
import re
import socket
import subprocess
import threading
import time
import urllib.parse
import urllib.request


class Service:
    """The program on a free port."""

    def __init__(self, program, *flags, port=0, **environment):
        command = [program, "serve", "--listen", f"127.0.0.1:{port}", *flags]
        environment = {**os.environ, **environment}
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
        for line in self.process.stderr:
            found = re.search(r"http://127\.0\.0\.1:(\d+)", line)
            if found:
                self.port = int(found.group(1))
                break
        else:
            raise RuntimeError("the service did not start")
        self.url = f"http://127.0.0.1:{self.port}"
        threading.Thread(target=self._drain, daemon=True).start()

    def _drain(self):
        for _ in self.process.stderr:
            pass

    def call(self, method, path, body=None):
        request = urllib.request.Request(self.url + path, data=body, method=method)
        with urllib.request.urlopen(request) as response:
            return json.loads(response.read() or "null")

    def bytes(self, path):
        with urllib.request.urlopen(self.url + path) as response:
            return response.read()

    def track(self, clip, box, seed, count):
        """The answers of plain posts to the first frames of a clip."""
        query = urllib.parse.urlencode({"box": box, "seed": seed})
        created = self.call("POST", f"/sessions?{query}", self.bytes(f"/sample/{clip}/0.jpg"))
        frames = (self.bytes(f"/sample/{clip}/{index}.jpg") for index in range(1, count))
        path = f"/sessions/{created['id']}/frames"
        answers = [self.call("POST", path, frame) for frame in frames]
        self.delete(created["id"])
        return answers

    def delete(self, session):
        request = urllib.request.Request(f"{self.url}/sessions/{session}", method="DELETE")
        urllib.request.urlopen(request).close()

    def wait_for_no_session(self):
        late = time.monotonic() + 60
        while not re.search(r"^bagtrack_sessions 0$", self.bytes("/metrics").decode(), re.MULTILINE):
            assert time.monotonic() < late, "the session does not expire"
            time.sleep(0.05)

    def stop(self):
        self.process.terminate()
        self.process.wait(timeout=60)


class Line:
    """A port that leads to the service, until its connections are cut."""

    def __init__(self, port):
        self.target = port
        self.open = []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.listener.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            try:
                service = socket.create_connection(("127.0.0.1", self.target))
            except OSError:
                # The service is starting again.
                client.close()
                continue
            for end in (client, service):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.open += [client, service]
            for source, sink in ((client, service), (service, client)):
                threading.Thread(target=self._carry, args=(source, sink), daemon=True).start()

    def _carry(self, source, sink):
        try:
            while piece := source.recv(65536):
                sink.sendall(piece)
        except OSError:
            pass
        for end in (source, sink):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def cut(self):
        """Cuts what is open. New connections can be made."""
        count = len(self.open)
        for end in self.open:
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
        self.open.clear()
        return count

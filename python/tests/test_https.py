"""HTTPS, by the service itself and by Caddy in front of it: the same boxes as over plain HTTP, and nothing waits.

The certificate is made by openssl, the Caddyfile is that of `docker/`.
"""

from __future__ import annotations

import asyncio
import os
import re
import shutil
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest

import bagtrack
from conftest import PROGRAM, ROOT, SEED, Clip, Server

PATIENCE = 60
# Caddy's own part: no ports but the one of the test, and nothing outside of its folder.
OPTIONS = "{\n\tadmin off\n\tauto_https disable_redirects\n\tskip_install_trust\n}\n"


@pytest.fixture
def with_own_tls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The address of a service with a certificate, which clients trust by SSL_CERT_FILE."""
    if not shutil.which("openssl"):
        pytest.skip("there is no openssl")
    certificate, key, log = tmp_path / "cert.pem", tmp_path / "key.pem", tmp_path / "tls.log"
    command = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=bagtrack -addext subjectAltName=IP:127.0.0.1"
    subprocess.run([*command.split(), "-keyout", key, "-out", certificate], check=True, capture_output=True)
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
    flags = ["serve", "--listen", "127.0.0.1:0", "--tls-cert", certificate, "--tls-key", key]
    with log.open("w") as file:
        process = subprocess.Popen([PROGRAM, *map(str, flags)], stderr=file)
    try:
        while not (found := re.search(r"https://127\.0\.0\.1:\d+", log.read_text())):
            assert process.poll() is None, log.read_text()
        yield found.group(0)
    finally:
        process.kill()
        process.wait()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def behind_caddy(
    tmp_path: Path, start_server: Callable[..., Server], monkeypatch: pytest.MonkeyPatch
) -> Iterator[str]:
    """The address of Caddy with docker/Caddyfile before a service, as docker/compose.tls.yaml runs them."""
    caddy = shutil.which("caddy")
    if not caddy:
        pytest.skip("there is no caddy")
    service = start_server("--trusted-proxies", "127.0.0.0/8", "--api-keys", "me:0123456789abcdef")
    port = free_port()
    file = tmp_path / "Caddyfile"
    file.write_text(OPTIONS + (ROOT / "docker/Caddyfile").read_text())
    environment = {
        **os.environ,
        "HOME": str(tmp_path),
        "XDG_DATA_HOME": str(tmp_path / "data"),
        "XDG_CONFIG_HOME": str(tmp_path / "config"),
        "BAGTRACK_HOST": f"localhost:{port}",
        "BAGTRACK_TLS": "tls internal",
        "BAGTRACK_UPSTREAM": f"127.0.0.1:{service.port}",
    }
    command = [caddy, "run", "--adapter", "caddyfile", "--config", str(file)]
    with (tmp_path / "caddy.log").open("w") as log:
        process = subprocess.Popen(command, env=environment, stderr=log)
    authority = tmp_path / "data/caddy/pki/authorities/local/root.crt"
    try:
        deadline = time.monotonic() + PATIENCE
        # It listens before it has a certificate.
        while not (authority.is_file() and speaks_tls(port, authority)):
            assert process.poll() is None and time.monotonic() < deadline, (tmp_path / "caddy.log").read_text()
        monkeypatch.setenv("SSL_CERT_FILE", str(authority))
        yield f"https://localhost:{port}"
    finally:
        process.terminate()
        process.wait()


def speaks_tls(port: int, authority: Path) -> bool:
    try:
        context = ssl.create_default_context(cafile=str(authority))
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as probe:
            context.wrap_socket(probe, server_hostname="localhost").close()
        return True
    except OSError:
        return False


def follow(clip: Clip, url: str, key: str | None) -> None:
    """Half of the clip by posts, the rest over the stream."""
    files = [file.read_bytes() for file in clip.files]
    with bagtrack.Client(url, api_key=key, seed=SEED) as client:
        client.init(files[0], clip.box)
        posted = [client.update(file)[1] for file in files[1:50]]
        streamed = [answer.box for answer in client.track(files[50:])]
    assert posted + streamed == clip.answered()[1:]


def test_the_service_itself_speaks_https(clip: Clip, with_own_tls: str) -> None:
    follow(clip, with_own_tls, None)


def test_a_certificate_that_nobody_signed_is_told_at_once(
    clip: Clip, with_own_tls: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SSL_CERT_FILE")
    frame = clip.files[0].read_bytes()
    with pytest.raises(httpx.ConnectError, match="CERTIFICATE_VERIFY_FAILED"):
        bagtrack.Client(with_own_tls, retry_for=1.0).init(frame, clip.box)
    with pytest.raises(httpx.ConnectError, match="CERTIFICATE_VERIFY_FAILED"):
        asyncio.run(bagtrack.AsyncClient(with_own_tls, retry_for=1.0).init(frame, clip.box))


def test_a_certificate_that_the_stream_does_not_take_is_told_at_once(
    clip: Clip, with_own_tls: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = [file.read_bytes() for file in clip.files[:3]]
    with bagtrack.Client(with_own_tls, retry_for=1.0) as client:
        client.init(frames[0], clip.box)
        # Streams take the certificates of the system, posts those that they began with.
        monkeypatch.delenv("SSL_CERT_FILE")
        with pytest.raises(ssl.SSLCertVerificationError):
            list(client.track(frames[1:]))


def test_caddy_speaks_https_for_it(clip: Clip, behind_caddy: str) -> None:
    follow(clip, behind_caddy, "0123456789abcdef")


def test_caddy_holds_no_answer_back(clip: Clip, behind_caddy: str) -> None:
    files = [file.read_bytes() for file in clip.files]
    key = {"Authorization": "Bearer 0123456789abcdef"}
    with httpx.Client(base_url=behind_caddy, headers=key, timeout=PATIENCE) as client:
        query = {"box": ",".join(map(str, clip.box)), "parameters": '{"particles": 1000}'}
        created = client.post("/sessions", params=query, content=files[0])
        assert created.status_code == 201, created.text
        parts = [("frame", ("frame.png", file, "image/png")) for file in files[1:21]]
        started = time.monotonic()
        came = []
        lines = {"Accept": "application/x-ndjson"}
        path = created.headers["location"] + "/frames"
        with client.stream("POST", path, files=parts, headers=lines) as answer:
            for line in answer.iter_lines():
                came.append(time.monotonic() - started)
        assert len(came) == 20
        # The first line has come when most of the frames had their work before them.
        assert came[0] < came[-1] / 2, came


def test_a_stream_answers_each_frame_before_the_next(clip: Clip, behind_caddy: str) -> None:
    code = """
import asyncio, json, sys, httpx, websockets
url, key, box, *files = sys.argv[1:]
files = [open(file, "rb").read() for file in files]
bearer = {"Authorization": "Bearer " + key}

async def main():
    created = httpx.post(url + "/sessions", params={"box": box}, content=files[0], headers=bearer)
    address = url.replace("https", "wss") + created.headers["location"] + "/stream"
    async with websockets.connect(address, additional_headers=bearer) as stream:
        assert json.loads(await stream.recv())["next"] == 1
        for number, file in enumerate(files[1:], 1):
            await stream.send(file)
            assert json.loads(await asyncio.wait_for(stream.recv(), 60))["frame"] == number
    print(len(files))

asyncio.run(main())
"""
    box = ",".join(map(str, clip.box))
    command = [sys.executable, "-c", code, behind_caddy, "0123456789abcdef", box, *map(str, clip.files[:30])]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.strip() == "30", done.stderr

"""The lines of docs/QUICKSTART.md and of the README's first screen, as they are typed.

Only what differs from a reader's machine is replaced: the service's address, and Docker, whose daemon tests have not.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import ssl
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import PROGRAM, ROOT, Server, run

ADDRESS = "http://127.0.0.1:8080"
MOST_LINES = 10


def blocks(document: str, heading: str, language: str) -> list[str]:
    """The blocks of a section in this language."""
    text = (ROOT / document).read_text()
    found = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    assert found, heading
    return re.findall(rf"^```{language}\n(.*?)^```$", found[1], re.MULTILINE | re.DOTALL)


def block(document: str, heading: str, language: str = "sh", at: int = 0, most: int = MOST_LINES) -> str:
    text = blocks(document, heading, language)[at]
    assert len(text.splitlines()) <= most, text
    return text


def shell(script: str, folder: Path, **environment: str) -> str:
    """What a script prints, with `bagtrack` on the path."""
    command = ["bash", "-euo", "pipefail", "-c", script]
    environment = with_program(folder, environment)
    finished = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


def with_program(folder: Path, environment: dict[str, str]) -> dict[str, str]:
    programs = folder / "programs"
    programs.mkdir(exist_ok=True)
    if not (programs / "bagtrack").exists():
        (programs / "bagtrack").symlink_to(PROGRAM)
    return {**os.environ, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}", **environment}


def answers(output: str) -> list[dict]:
    return [json.loads(line) for line in output.splitlines() if line.startswith("{")]


def with_lines(script: str, server: Server) -> str:
    """A script against this service; curl ends its answers with a line, and fails where it is refused."""
    assert ADDRESS in script
    script = script.replace(ADDRESS, server.url)
    return re.sub(r"^curl ", "curl -sS --fail-with-body -w '\\\\n' ", script, flags=re.MULTILINE)


@pytest.mark.skipif(not (shutil.which("curl") and shutil.which("uuidgen")), reason="there is no curl or uuidgen")
@pytest.mark.parametrize("document, heading", [("docs/QUICKSTART.md", "curl"), ("README.md", "In five lines")])
def test_curl(document: str, heading: str, start_server: Callable[..., Server], tmp_path: Path) -> None:
    script = with_lines(block(document, heading), start_server())
    told = answers(shell(script, tmp_path))
    assert told[0]["box"]["x"] == 44.1
    assert told[1]["frame"] == 1 and abs(told[1]["box"]["x"] - 44) < 5
    assert [answer["frame"] for answer in told[2]["answers"]] == [2, 3]


@pytest.mark.parametrize("document, heading", [("docs/QUICKSTART.md", "Python"), ("README.md", "In five lines")])
def test_python(document: str, heading: str, tmp_path: Path) -> None:
    run("sample", "--out", tmp_path / "clip", "--frames", 20)
    script = block(document, heading, "python")
    finished = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    lines = finished.stdout.splitlines()
    assert len(lines) == 20 and lines[0].startswith("0 (44.1, 101.4,"), finished.stderr
    assert all("tracking" in line for line in lines)


def test_python_with_a_service(start_server: Callable[..., Server], tmp_path: Path) -> None:
    # With fewer frames the target moves further from one to the next.
    run("sample", "--out", tmp_path / "clip", "--frames", 20)
    script = block("docs/QUICKSTART.md", "Python", "python", at=1)
    assert ADDRESS in script
    script = script.replace(ADDRESS, start_server().url)
    finished = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    found = re.fullmatch(r"\(True, \(([\d.]+), .*\)\)\n", finished.stdout)
    assert found and abs(float(found[1]) - 43) < 5, finished.stdout + finished.stderr


@pytest.mark.skipif(not shutil.which("openssl"), reason="there is no openssl")
def test_phone(tmp_path: Path) -> None:
    script = block("docs/QUICKSTART.md", "A phone")
    where = "--listen 0.0.0.0:8443"
    assert where in script
    script = script.replace(where, "--listen 127.0.0.1:0")
    if not shutil.which("hostname") or not subprocess.run(["hostname", "-I"], capture_output=True).stdout.strip():
        script = script.replace("$(hostname -I | cut -d' ' -f1)", "127.0.0.1")
    log = tmp_path / "log"
    environment = with_program(tmp_path, {"NO_COLOR": "1"})
    command = ["bash", "-euo", "pipefail", "-c", script.replace("\nbagtrack", "\nexec bagtrack")]
    with log.open("w") as file:
        process = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=file, stderr=file)
    try:
        while not (found := re.search(r"listening on (https://127\.0\.0\.1:\d+)", log.read_text())):
            assert process.poll() is None, log.read_text()
        trusted = ssl.create_default_context(cafile=str(tmp_path / "cert.pem"))
        with urllib.request.urlopen(found[1], context=trusted) as page:
            assert b"Draw a box, and it follows" in page.read()
    finally:
        process.kill()
        process.wait()


@pytest.mark.skipif(not (shutil.which("curl") and shutil.which("openssl")), reason="there is no curl or openssl")
def test_containers_with_tls(start_server: Callable[..., Server], tmp_path: Path) -> None:
    lines = block("docs/QUICKSTART.md", "Containers with TLS").splitlines()
    *settings, up, ask = lines
    start = "docker compose -f docker/compose.tls.yaml "
    assert up.startswith(start + "up ")
    told = 'echo "$KEY" "$BAGTRACK_API_KEYS" "$BAGTRACK_SNAPSHOT_KEYS"'
    key, keys, secrets = shell("\n".join([*settings, told]), tmp_path).split()
    server = start_server("--api-keys", keys)
    ask = ask.replace("curl ", "curl -sS --fail ").replace("https://$BAGTRACK_HOST", server.url)
    assert "bagtrack_sessions 0" in shell(ask, tmp_path, KEY=key).splitlines()
    with pytest.raises(AssertionError, match="401"):
        shell(ask, tmp_path, KEY="another")
    assert len(secrets) >= 16
    if not (compose := compose_command()):
        pytest.skip("there is no docker compose and no docker-compose to read the file")
    script = "\n".join([*settings, f"{compose} -f docker/compose.tls.yaml config"])
    read = subprocess.run(["bash", "-euc", script], cwd=ROOT, capture_output=True, text=True)
    assert read.returncode == 0, read.stderr
    assert re.search(r"BAGTRACK_HOST: \"?tracker\.example\.org", read.stdout), read.stdout
    assert re.search(r"BAGTRACK_NO_AUTH: ['\"]false", read.stdout)


def compose_command() -> str | None:
    """What reads files of compose here."""
    for command in ("docker compose", "docker-compose"):
        words = command.split()
        if shutil.which(words[0]) and subprocess.run([*words, "version"], capture_output=True).returncode == 0:
            return command
    return None

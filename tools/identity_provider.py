#!/usr/bin/env python3
"""Signs in at a real OpenID Connect provider, and follows a target with the token that it gives.

    pip install oidc-provider-mock==0.3.4
    tools/identity_provider.py target/debug/bagtrack

The provider signs with RSA and changes its key when it starts again. The service finds its keys by discovery.
"""

import json
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request

CLIENT, REDIRECT = "tracker", "http://127.0.0.1:1/back"


class NoRedirect(urllib.request.HTTPRedirectHandler):
    """The redirection carries the code."""

    def redirect_request(self, *_):
        return None


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_for(url):
    end = time.monotonic() + 60
    while True:
        try:
            return urllib.request.urlopen(url).read()
        except urllib.error.HTTPError:
            return None
        except OSError:
            if time.monotonic() > end:
                sys.exit(f"{url} does not answer")
            time.sleep(0.05)


def provider_at(port):
    program = pathlib.Path(sys.executable).with_name("oidc-provider-mock")
    process = subprocess.Popen([program, "--port", str(port)], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    wait_for(f"http://127.0.0.1:{port}/.well-known/openid-configuration")
    return process


def sign_in(issuer, subject, client=CLIENT):
    """The authorization code flow, as a browser and an application take it. Gives the ID token."""
    document = json.loads(wait_for(f"{issuer}/.well-known/openid-configuration"))
    asked = {"client_id": client, "redirect_uri": REDIRECT, "response_type": "code", "scope": "openid", "state": "s"}
    url = f"{document['authorization_endpoint']}?{urllib.parse.urlencode(asked)}"
    browser = urllib.request.build_opener(NoRedirect)
    try:
        browser.open(url, urllib.parse.urlencode({"sub": subject}).encode())
        sys.exit("the provider does not send back")
    except urllib.error.HTTPError as error:
        back = urllib.parse.urlsplit(error.headers["Location"])
    code = urllib.parse.parse_qs(back.query)["code"][0]
    form = {
        "grant_type": "authorization_code",
        "code": code,
        "redirect_uri": REDIRECT,
        "client_id": client,
        "client_secret": "none",
    }
    answer = urllib.request.urlopen(document["token_endpoint"], urllib.parse.urlencode(form).encode())
    return json.loads(answer.read())["id_token"]


def call(url, token, data=None):
    """Status and JSON of an answer."""
    request = urllib.request.Request(url, data, {"Authorization": f"Bearer {token}"})
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, json.loads(answer.read())
    except urllib.error.HTTPError as error:
        return error.code, json.loads(error.read())


def expect(found, status, text=""):
    if found[0] != status or text not in found[1].get("detail", ""):
        sys.exit(f"expected {status} {text}, found {found}")


def clip(program, folder):
    """Frames of the sample, and the first box."""
    subprocess.run([program, "sample", "--out", folder], check=True, stdout=subprocess.DEVNULL)
    frames = sorted(pathlib.Path(folder).rglob("*.jpg"))[:10] or sorted(pathlib.Path(folder).rglob("*.png"))[:10]
    truth = next(pathlib.Path(folder).rglob("groundtruth*.txt")).read_text().splitlines()[0]
    return [frame.read_bytes() for frame in frames], ",".join(re.split(r"[,\s]+", truth.strip()))


def check(program, folder):
    frames, box = clip(program, folder)
    issuer_port, port = free_port(), free_port()
    issuer, url = f"http://127.0.0.1:{issuer_port}", f"http://127.0.0.1:{port}"
    flags = ["--listen", f"127.0.0.1:{port}", "--jwt-issuer", issuer, "--jwt-audience", CLIENT]
    # Without its issuer the service does not start, and says why.
    alone = subprocess.run([program, "serve", *flags], capture_output=True, text=True)
    if alone.returncode == 0 or "--jwt-keys" not in alone.stderr:
        sys.exit(f"without the issuer: {alone}")
    provider = provider_at(issuer_port)
    service = subprocess.Popen([program, "serve", *flags], stderr=subprocess.DEVNULL)
    try:
        wait_for(f"{url}/healthz")
        ann, ben = sign_in(issuer, "ann"), sign_in(issuer, "ben")
        created = call(f"{url}/sessions?box={box}", ann, frames[0])
        expect(created, 201)
        session = f"{url}/sessions/{created[1]['id']}"
        for frame in frames[1:]:
            expect(call(f"{session}/frames", ann, frame), 200)
        expect(call(session, ben), 404)
        expect(call(session, sign_in(issuer, "ann", "another")), 401, "`aud`")
        expect(call(session, ann[:-8] + "AAAAAAAA"), 401, "signature")
        # Started again, the provider has another key.
        provider.terminate()
        provider.wait()
        provider = provider_at(issuer_port)
        later = sign_in(issuer, "ann")
        end = time.monotonic() + 60
        while call(session, later)[0] == 401 and time.monotonic() < end:
            time.sleep(1)
        expect(call(session, later), 200)
        expect(call(session, ann), 401)
        print(f"{len(frames)} frames with a token of {issuer}; another subject, audience, signature and key refused")
    finally:
        service.terminate()
        provider.terminate()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        check(str(pathlib.Path(sys.argv[1]).resolve()), temporary)

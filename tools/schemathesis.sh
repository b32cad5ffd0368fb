#!/usr/bin/env bash
# Tests a server with requests that schemathesis makes from openapi/openapi.json: `tools/schemathesis.sh [SECONDS]`.
#
# All checks are on, and no failure is excused. Sessions are opened and the links of the document followed. Takes the
# binary of $BAGTRACK, or target/debug/bagtrack; makes a Python environment in target/schemathesis.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

version=4.32.0
seconds=${1:-}
environment=target/schemathesis
binary=${BAGTRACK:-target/debug/bagtrack}

if ! "$environment/bin/schemathesis" --version 2>/dev/null | grep --quiet --fixed-strings "$version"; then
    python3 -m venv "$environment"
    "$environment/bin/pip" install --quiet --disable-pip-version-check "schemathesis==$version"
fi

log=$(mktemp)
"$binary" serve --listen 127.0.0.1:0 --log-format json --max-sessions 40000 --client-sessions 40000 2>"$log" &
server=$!
trap 'kill "$server"; wait "$server" || true; rm -f "$log"' EXIT
until url=$(grep --only-matching --max-count=1 'http://127[0-9.:]*' "$log"); do
    kill -0 "$server"
    sleep 0.1
done

# A stream begins with a WebSocket handshake, which schemathesis does not speak; tests/http/streams does.
options=(--exclude-path '/sessions/{id}/stream')
[ -z "$seconds" ] || options+=(--max-time "$seconds")
BAGTRACK_URL=$url SCHEMATHESIS_HOOKS=tools/schemathesis_hooks.py PYTHONPATH=tools \
    "$environment/bin/schemathesis" run openapi/openapi.json --url "$url" --checks all "${options[@]}"

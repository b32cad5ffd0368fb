#!/usr/bin/env bash
# The JavaScript client: its tests against a real server, and its types: `tools/javascript_client.sh [PROGRAM]`.
#
# Needs Node.js from 20 on. TypeScript comes from npm; without it the types are left out, and a line says so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
BAGTRACK=$(realpath "${1:-target/debug/bagtrack}")
export BAGTRACK
typescript=7.0.2
tools=target/javascript_client

if ! command -v node >/dev/null || [ "$(node -p 'parseInt(process.versions.node)')" -lt 20 ]; then
    echo "Left out, for want of Node.js from 20 on: the tests of clients/js"
    exit 0
fi
(cd clients/js && node --experimental-websocket --test --test-timeout=600000 test/*.test.js)

if command -v npm >/dev/null && npm install --silent --no-audit --no-fund --prefix "$tools" "typescript@$typescript"; then
    rm -rf "$tools/types"
    "$tools/node_modules/.bin/tsc" --project clients/js/tsconfig.json --outDir "$tools/types"
    diff --recursive clients/js/types "$tools/types" || {
        echo "clients/js/types is not what the sources say; write it anew with \`npx tsc --project clients/js\`." >&2
        exit 1
    }
    "$tools/node_modules/.bin/tsc" --ignoreConfig --noEmit --strict --target es2022 --module nodenext clients/js/test/use.ts
else
    echo "Left out, for want of TypeScript from npm: the types of clients/js"
fi

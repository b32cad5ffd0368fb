#!/usr/bin/env bash
# Draws clips with exact boxes, each hard in one way, by the names of the attributes of OTB and UAV123: three of each.
#
#     cargo build --release
#     tools/hard_clips.sh hard
#     bagtrack-eval hard/* --seeds 3
#
# BAGTRACK names another program.
set -euo pipefail
program=${BAGTRACK:-$(dirname "${BASH_SOURCE[0]}")/../target/release/bagtrack}
out=${1:?the folder to write}

draw() {
    local name=$1
    shift
    for seed in 1 2 3; do
        "$program" sample --width 640 --height 480 --seed "$seed" --out "$out/$name-$seed" "$@" >/dev/null
    done
}

draw plain
draw low-resolution --low-resolution 0.1
draw fast-motion --fast-motion 5
draw motion-blur --fast-motion 3 --motion-blur 1
draw camera-motion --camera-motion 0.04
draw scale-variation --scale-variation 3
draw out-of-plane-rotation --out-of-plane-rotation 0.35
draw in-plane-rotation --in-plane-rotation 1.5
draw similar-objects --similar-objects 3
draw occlusion --scene covered
draw out-of-view --scene leaves

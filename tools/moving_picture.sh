#!/usr/bin/env bash
# Makes the moving picture of the README: `bagtrack track --draw` on a sample clip in which the target leaves and comes
# back. Needs ffmpeg with libwebp: `tools/moving_picture.sh [PROGRAM]`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program=${1:-target/release/bagtrack}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

"$program" sample --out "$folder/clip" --scene leaves --width 400 --height 225 --frames 110 >/dev/null
# The truth counts pixels from 1.
box=$(awk -F, 'NR == 1 { print $1 - 1 "," $2 - 1 "," $3 "," $4 }' "$folder/clip/groundtruth_rect.txt")
"$program" track "$folder/clip" --box "$box" --draw "$folder/drawn/" --format csv -o "$folder/rows.csv"
ffmpeg -v error -y -framerate 25 -i "$folder/drawn/%04d.jpg" -vf fps=12.5 -loop 0 -quality 50 -compression_level 6 \
    docs/figures/moving.webp

#!/usr/bin/env bash
# Instructions of one step of each preset and of decoding one JPEG, counted by callgrind: a regression shows whatever else
# the machine does. Needs cargo, valgrind and python3 with cv2 or a JPEG of your own:
#
#     tools/count_instructions.sh [FRAME.jpg]
#
# Start-up is taken out by counting two runs of different lengths. The counts are for the instructions that valgrind
# knows (AVX2, not AVX-512).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
jpeg=${1:-}
if [ -z "$jpeg" ]; then
    jpeg=$scratch/640x480.jpg
    python3 -c '
import cv2, pathlib, runpy, sys
tool = runpy.run_path("tools/decode_table.py")
picture = cv2.resize(tool["drawn"](), (640, 480), interpolation=cv2.INTER_AREA)
cv2.imwrite(sys.argv[1], picture, [cv2.IMWRITE_JPEG_QUALITY, 85])' "$jpeg"
fi

tables=$(cargo bench --no-run --bench tables --message-format json 2>/dev/null |
    sed -n 's/.*"executable":"\([^"]*tables-[^"]*\)".*/\1/p' | tail -1)
[ -x "$tables" ] || { echo "the bench program tables was not built" >&2; exit 1; }

# Collected while `repeat` does this so many times.
instructions() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$tables" repeat "$@" 2>&1 >/dev/null |
        sed -n 's/.*Collected : *\([0-9]*\).*/\1/p'
}

few=20
many=60
count() {
    local name=$1 low high
    shift
    low=$(instructions "${@/COUNT/$few}")
    high=$(instructions "${@/COUNT/$many}")
    echo "$name: $(((high - low) / (many - few))) instructions"
}

count "step of paper" step paper COUNT
count "step of robust" step robust COUNT
count "decode" decode COUNT "$jpeg"

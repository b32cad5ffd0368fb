#!/usr/bin/env bash
# Instructions of one step of each preset and of decoding one JPEG, counted by callgrind: a regression shows whatever else
# the machine does. Needs cargo and valgrind.
#
#     tools/count_instructions.sh              prints them
#     tools/count_instructions.sh --check      fails where one is 5 % above crates/ingest/benches/instructions.txt
#     tools/count_instructions.sh --accept     writes that file
#
# Start-up is taken out by counting two runs of different lengths. The counts are for x86-64 with the instructions that
# valgrind knows (AVX2, not AVX-512), and for the compiler that the file names.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

baseline=crates/ingest/benches/instructions.txt
action=${1:---print}
program=$(cargo bench --locked --no-run --package bagtrack-ingest --bench instructions --message-format json |
    sed -n 's/.*"executable":"\([^"]*instructions-[^"]*\)".*/\1/p' | tail -1)
[ -x "$program" ] || { echo "the bench program instructions was not built" >&2; exit 1; }

# Collected while the program does this so many times.
instructions() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "$@" 2>&1 >/dev/null |
        sed -n 's/.*Collected : *\([0-9]*\).*/\1/p'
}

few=2
many=12
count() {
    local name=$1 low high
    shift
    low=$(instructions "$@" "$few")
    high=$(instructions "$@" "$many")
    echo "$name: $(((high - low) / (many - few)))"
}

made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
for preset in paper robust; do
    "$program" fill "$preset" "$made/$preset"
done
for zoom in 2 4; do
    "$program" draw "$zoom" "$made/$zoom.jpg"
done
counts=$(
    count "a step of paper" step "$made/paper"
    count "a step of robust" step "$made/robust"
    count "decoding 640 x 480" decode "$made/2.jpg"
    count "decoding 1280 x 960" decode "$made/4.jpg"
)
echo "$counts"

case $action in
--print) ;;
--accept)
    {
        echo "# Instructions, by tools/count_instructions.sh --accept; $(rustc --version)"
        echo "$counts"
    } >"$baseline"
    ;;
--check)
    awk -F': ' '
        NR == FNR { if (!/^#/) before[$1] = $2; next }
        !($1 in before) { print $1 " is not in the baseline"; failed = 1; next }
        { change = 100 * ($2 / before[$1] - 1) }
        change > 5 { printf "%s: %.1f %% more than the %d of the baseline\n", $1, change, before[$1]; failed = 1 }
        change < -5 { printf "%s: %.1f %% less than the %d of the baseline: accept it\n", $1, -change, before[$1] }
        END { exit failed }' "$baseline" <(echo "$counts")
    ;;
*)
    echo "tools/count_instructions.sh [--check | --accept]" >&2
    exit 2
    ;;
esac

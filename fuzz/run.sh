#!/usr/bin/env bash
# Fuzzes each target, one after the other: `fuzz/run.sh SECONDS [TARGET...]`, an hour of each with `fuzz/run.sh 3600`.
# Ends at the first finding, which is left in fuzz/artifacts/TARGET/.
#
# A target is a plain program of libFuzzer, so cargo alone builds it, with any compiler: what `cargo fuzz` would pass to
# the compiler is here. It begins with the inputs in fuzz/corpus/TARGET/, which are part of the project, and with those
# that it has found itself: they are kept in fuzz/found/TARGET/, which is not.
#
# FUZZ_SANITIZER=address looks for faults of memory too, in three times the time. The compiler has it, but a stable one
# only offers it as if it were a nightly one, which RUSTC_BOOTSTRAP=1 makes it do.
#
# `fuzz/run.sh --keep SECONDS [TARGET...]` makes fuzz/corpus/TARGET/ anew: from the first inputs that fuzz/src/seeds.rs
# draws, what fuzz/found/TARGET/ has, and what SECONDS of fuzzing find with them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

keeps=
if [ "${1:-}" = --keep ]; then
    keeps=1
    shift
fi
seconds=${1:?how many seconds for each target}
shift
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || targets=(decode shares multipart json video snapshot records session)

# So much is kept of a target at most, so that the project stays small.
most_files=60
most_bytes=120000

host=$(rustc --version --verbose | sed -n 's/^host: //p')
flags="--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4"
for counted in inline-8bit-counters pc-table trace-compares; do
    flags+=" -Cllvm-args=-sanitizer-coverage-$counted"
done
sanitizer=${FUZZ_SANITIZER:-none}
if [ "$sanitizer" != none ]; then
    export RUSTC_BOOTSTRAP=1
    flags+=" -Zsanitizer=$sanitizer"
    # The threads of the service live as long as the process, and what they keep is no leak. The soak looks for leaks.
    export ASAN_OPTIONS=detect_leaks=0
fi
# With a target named, build scripts and macros are built without these flags.
export RUSTFLAGS=$flags CARGO_INCREMENTAL=0
cargo build --locked --target "$host" --target-dir "target/$sanitizer" --bins
programs=target/$sanitizer/$host/debug

# Keeps of a target the inputs that were drawn, which reach furthest, and some of each size of those that reach other
# branches: of the smallest most are refused at once.
keep() {
    local target=$1 whole=target/kept/$1 kept=corpus/$1 bytes=0 size name
    rm -rf "$whole" "$kept"
    mkdir -p "$whole" "$kept"
    find "found/$target" -name 'seed-*' -exec cp -t "$whole" {} +
    # Which branches, and not how often.
    "$programs/$target" -merge=1 -use_counters=0 -detect_leaks=0 "$whole" "found/$target" 2>"$whole.log"
    find "$whole" -name 'seed-*' -exec cp -t "$kept" {} +
    bytes=$(find "$kept" -type f -printf '%s\n' | awk '{sum += $1} END {print sum + 0}')
    while read -r size name; do
        bytes=$((bytes + size))
        [ "$bytes" -le "$most_bytes" ] || break
        cp "$whole/$name" "$kept/"
    done < <(
        find "$whole" -type f ! -name 'seed-*' -printf '%s %f\n' | sort -n |
            awk -v some=$((most_files - $(find "$kept" -type f | wc -l))) '
                {line[NR] = $0}
                END {for (k = 1; k <= NR; k++) if (int(k * some / NR) > int((k - 1) * some / NR)) print line[k]}'
    )
    echo "kept of $target: $(find "$kept" -type f | wc -l) of $(find "$whole" -type f | wc -l) inputs"
}

for target in "${targets[@]}"; do
    mkdir -p "found/$target" "artifacts/$target"
    folders=("found/$target")
    if [ -n "$keeps" ]; then
        "$programs/seeds" found
    else
        folders+=("corpus/$target")
    fi
    echo "== $target"
    # With what others leave of the processors: beside them a time costs them little.
    nice -n 10 "$programs/$target" "${folders[@]}" -artifact_prefix="artifacts/$target/" -max_total_time="$seconds" \
        -max_len=65536 -timeout=60 -rss_limit_mb=3000 -detect_leaks=0 -print_final_stats=1
    [ -z "$keeps" ] || keep "$target"
done

#!/usr/bin/env bash
# Fuzzes each target, one after the other: `fuzz/run.sh SECONDS [TARGET...]`. Needs a nightly compiler and cargo-fuzz.
# Ends at the first finding, which is left in fuzz/artifacts/.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

seconds=${1:?how many seconds for each target}
shift
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || targets=(decode shares multipart json snapshot session)

# The threads of the service live as long as the process, and what they keep is no leak. The soak looks for leaks.
export ASAN_OPTIONS=detect_leaks=0

# Without sockets the service is there for fuzzing only.
RUSTFLAGS="--cfg fuzzing" cargo +nightly run --target-dir target/seeds --bin seeds
for target in "${targets[@]}"; do
    mkdir -p "corpus/$target"
    cargo +nightly fuzz run --fuzz-dir . "$target" -- \
        -max_total_time="$seconds" -max_len=65536 -timeout=60 -rss_limit_mb=3000 -detect_leaks=0 -print_final_stats=1
done

# Recipes for `just` (https://just.systems). Each is one command, which can be typed as well.

# Lists the recipes.
default:
    @just --list

# The service, on http://127.0.0.1:8080.
run *flags:
    cargo run --release -- {{flags}}

# Both programs, in target/release.
build:
    cargo build --release

# The tests that need only the Rust toolchain.
test *filter:
    cargo test {{filter}}

# Locks and threads of sessions, in orders that shuttle chooses.
interleavings:
    cargo test --package bagtrack-sessions --features shuttle --lib interleavings

# Everything that is checked before a change lands.
ci:
    .ci/run

# Format and lints.
lint:
    cargo fmt --all --check && cargo clippy --all-targets -- -D warnings

# The replicas, with real servers: needs redis-server, haproxy, nginx and openssl.
replicas *filter:
    BAGTRACK_PREVIOUS=$(tools/previous_release.sh) cargo test --test replicas -- --ignored {{filter}}

# Accuracy on annotated sequences: `just eval ../sequences/* --seeds 10`.
eval *arguments:
    cargo run --release --package bagtrack-eval -- {{arguments}}

# The tables of docs/laboratory/PERFORMANCE.md: `just bench ratios`.
bench *table:
    cargo bench --bench tables -- {{table}}

# The service under load: `just load --sessions 64`.
load *flags:
    cargo build --release && cargo run --release --example load -- {{flags}}

# The attacks of docs/RELIABILITY.md: `just attack --short`.
attack *flags:
    cargo build --release && cargo run --release --example attack -- {{flags}}

# Faults put into the crates that hold who may do what: does a test fail? `just mutants sessions redis --shard 0/20`.
mutants crate="access" features="jwt" *flags:
    cargo mutants --package bagtrack-{{crate}} --features {{features}} {{flags}} -- --tests

# Instructions of a step and of decoding, by callgrind.
instructions:
    tools/count_instructions.sh

# The fuzz targets, a minute each: `just fuzz 60 decode`, or an hour each: `just fuzz 3600`.
fuzz seconds="60" *targets:
    fuzz/run.sh {{seconds}} {{targets}}

# The files of a release, in target/release-files.
release:
    tools/release.sh

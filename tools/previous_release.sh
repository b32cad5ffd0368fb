#!/usr/bin/env bash
# Builds the program of the release before this commit, and prints its path: `tools/previous_release.sh [COMMIT]`.
#
# The release is the last tag v* before this commit. Where a clone has no tags, it is the commit that is named here.
# COMMIT is any other one. Exits with 3 where the clone does not have the commit, as a shallow one.
#
# The sources and the program are put into a folder of the commit, target/previous/COMMIT. What cargo builds on the way
# is with that of this checkout (the build directory), so most crates from the registry are built once. Crates of the
# project get another version, for cargo would take them for those of this checkout.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# The last release, for clones without tags.
v0_1_0=d086794020ed7640293d5eb45da77095d2e1a9b4

commit=${1:-$(git describe --tags --abbrev=0 --match 'v[0-9]*' HEAD^ 2>/dev/null || echo "$v0_1_0")}
if ! commit=$(git rev-parse --quiet --verify "$commit^{commit}"); then
    echo "This clone does not have the commit of the release before." >&2
    exit 3
fi

build=${CARGO_TARGET_DIR:-$PWD/target}

# The tables of a Cargo.toml that are profiles (1), or all others (0).
tables() {
    awk -v profiles="$1" '/^\[/ {is_profile = /^\[profile\./} is_profile == profiles' "$2"
}

# Cargo takes older files for built ones, so two commits have no folder in common.
folder=$PWD/target/previous/$commit
if [ ! -d "$folder/source" ]; then
    rm -rf "$folder"
    mkdir -p "$folder/part"
    git archive "$commit" | tar --extract --directory "$folder/part"
    # With the profiles of this commit, so that what is built of the registry is the same.
    { tables 0 "$folder/part/Cargo.toml"; tables 1 Cargo.toml; } >"$folder/Cargo.toml"
    mv "$folder/Cargo.toml" "$folder/part/Cargo.toml"
    (
        cd "$folder/part"
        sed -i '/^\[workspace.package\]/,/^$/s/^version = "\(.*\)"/version = "\1+previous"/' Cargo.toml
        cargo update --quiet --workspace
    )
    mv "$folder/part" "$folder/source"
fi
cd "$folder/source"
CARGO_BUILD_BUILD_DIR=$build CARGO_TARGET_DIR=$folder cargo build --locked --bin bagtrack >&2
echo "$folder/debug/bagtrack"

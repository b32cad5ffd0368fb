#!/usr/bin/env bash
# Makes what a release has, in target/release-files/: the crates, the Python wheel, the container image where docker or
# podman runs, the bill of materials, and SHA256SUMS. Needs a clean checkout, and Python 3 with venv for the wheel.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

version=$(sed -n 's/^version = "\(.*\)"$/\1/p;T;q' Cargo.toml)
files=target/release-files
rm -rf "$files"
mkdir -p "$files"

crates=(bagtrack-tracker bagtrack-ingest bagtrack-sessions bagtrack-sample bagtrack-cli bagtrack-eval bagtrack bagtrack-client)
cargo package --locked "${crates[@]/#/--package=}"
for crate in "${crates[@]}"; do cp "target/package/$crate-$version.crate" "$files"; done

[ -x target/python/bin/pip ] || python3 -m venv target/python
target/python/bin/pip install --quiet --disable-pip-version-check "maturin>=1.9,<2"
target/python/bin/maturin build --quiet --release --locked --manifest-path python/Cargo.toml --out "$files"

builder=
for program in docker podman; do
    # A client alone builds nothing.
    if [ -z "$builder" ] && "$program" info >/dev/null 2>&1; then builder=$program; fi
done
# The format of OCI images has no HEALTHCHECK.
format=()
[ "$builder" != podman ] || format=(--format docker)
# Builds the image with this tag, with these options, and saves it.
image() {
    local tag=$1
    shift
    "$builder" build "${format[@]}" --file docker/Dockerfile --tag "bagtrack:$tag" "$@" \
        --build-arg "VERSION=$version" --build-arg "REVISION=$(git rev-parse HEAD)" .
    "$builder" save "bagtrack:$tag" | gzip >"$files/bagtrack-$tag-image.tar.gz"
}
if [ -n "$builder" ]; then
    image "$version"
    # Without ffmpeg.
    image "$version-small" --target small
else
    echo "Left out, for want of docker or podman, running: the image"
fi

tools/supply_chain.sh
cp target/bagtrack.cdx.json "$files/bagtrack-$version.cdx.json"

(cd "$files" && sha256sum -- * >SHA256SUMS && cat SHA256SUMS)

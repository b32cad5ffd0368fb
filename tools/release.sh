#!/usr/bin/env bash
# Makes the files of a release in target/release-files/: `tools/release.sh [PRODUCT]…`, by default all that can be made
# on this machine for it.
#
#     program [TARGET]   the programs, for a target of Rust; with cargo-zigbuild's glibc of 2012, or musl, on Linux
#     wheel [TARGET]     the Python wheel: manylinux_2_17 or musllinux_1_2 on Linux
#     source             the Python package's source
#     crates             the crates
#     npm, chart         the npm package, the Helm chart
#     bill               the bill of materials
#     image              the container images, where docker or podman runs
#     sums               SHA256SUMS of what is there
#     publish-crates     publishes the crates; needs CARGO_REGISTRY_TOKEN
#     version            prints the version
#
# BAGTRACK_REPOSITORY is the URL of the repository, which packages name: with it, the placeholder in the manifests is
# replaced in a copy of the commit, in target/release-source. Needs Python 3 with venv, and a clean checkout.
# .github/workflows/release.yml runs these products on the machines that each needs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

placeholder=https://example.org/bagtrack
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
root=$PWD
files=$root/target/release-files
mkdir -p "$files"
# A copy has the same target folder, and so the same dependencies.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target}
crates=(bagtrack-tracker bagtrack-api bagtrack-siamese bagtrack-ingest bagtrack-sessions bagtrack-net bagtrack-sample bagtrack-formats bagtrack-cli bagtrack-config bagtrack-quotas bagtrack-access bagtrack-eval bagtrack bagtrack-client)

# Goes to a copy of the commit with the URL of the repository in its manifests.
name_repository() {
    local copy=$root/target/release-source
    rm -rf "$copy"
    mkdir -p "$copy"
    git archive HEAD | tar --extract --directory "$copy"
    cd "$copy"
    grep --recursive --files-with-matches --null --fixed-strings "$placeholder" --include '*.toml' --include '*.json' \
        --include '*.yaml' . | xargs -0 sed -i.before "s#$placeholder#$BAGTRACK_REPOSITORY#"
    find . -name '*.before' -delete
}

# An environment with these packages of PyPI.
environment() {
    local folder=$root/target/release-tools
    [ -d "$folder" ] || python3 -m venv "$folder"
    bin=$folder/bin
    # Windows has another name for it.
    [ -d "$bin" ] || bin=$folder/Scripts
    "$bin/python" -m pip install --quiet --disable-pip-version-check "$@"
    export PATH=$bin:$PATH
}

host() {
    rustc -vV | sed -n 's/^host: //p'
}

program() {
    local target=${1:-$(host)} suffix='' folder
    case $target in
    *-linux-gnu)
        environment cargo-zigbuild ziglang
        cargo zigbuild --release --locked --package bagtrack --package bagtrack-eval --bins --target "$target.2.17"
        ;;
    *-linux-musl)
        environment cargo-zigbuild ziglang
        cargo zigbuild --release --locked --package bagtrack --package bagtrack-eval --bins --target "$target"
        ;;
    *)
        cargo build --release --locked --package bagtrack --package bagtrack-eval --bins --target "$target"
        ;;
    esac
    case $target in *windows*) suffix=.exe ;; esac
    folder=bagtrack-$version-$target
    rm -rf "${files:?}/$folder"
    mkdir -p "$files/$folder"
    cp "$CARGO_TARGET_DIR/$target/release/bagtrack$suffix" "$CARGO_TARGET_DIR/$target/release/bagtrack-eval$suffix" \
        README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE "$files/$folder"
    case $target in *-linux-*) cp deploy/systemd/* "$files/$folder" ;; esac
    tar --create --gzip --file "$files/$folder.tar.gz" --directory "$files" "$folder"
    rm -r "${files:?}/$folder"
}

wheel() {
    local target=${1:-$(host)} options=()
    case $target in
    *-linux-gnu) options=(--zig --compatibility manylinux2014) ;;
    *-linux-musl) options=(--zig --compatibility musllinux_1_2) ;;
    esac
    environment "maturin[zig]>=1.9,<2"
    maturin build --quiet --release --locked --manifest-path python/Cargo.toml --target "$target" ${options[@]+"${options[@]}"} --out "$files"
}

python_source() {
    environment "maturin>=1.9,<2"
    maturin sdist --manifest-path python/Cargo.toml --out "$files"
}

crates() {
    cargo package --locked --no-verify --allow-dirty "${crates[@]/#/--package=}"
    local crate
    for crate in "${crates[@]}"; do cp "$CARGO_TARGET_DIR/package/$crate-$version.crate" "$files"; done
}

publish_crates() {
    cargo publish --locked --allow-dirty "${crates[@]/#/--package=}"
}

npm_package() {
    local folder
    folder=$(mktemp -d)
    cp -r clients/js/. LICENSE-MIT LICENSE-APACHE "$folder"
    (cd "$folder" && npm pack --silent --pack-destination "$files")
    rm -r "$folder"
}

chart() {
    environment "helm-python-sdk==0.2.2"
    local folder
    folder=$(mktemp -d)
    cp -r deploy/helm "$folder/bagtrack"
    # The image is the one that this release publishes.
    [ -z "${IMAGE:-}" ] || sed -i.before "s#^  repository: bagtrack\$#  repository: $IMAGE#" "$folder/bagtrack/values.yaml"
    rm -f "$folder/bagtrack/values.yaml.before"
    python -c 'import sys, helm_python; helm_python.package(sys.argv[1], destination=sys.argv[1])' "$folder/bagtrack"
    # The npm package has the same name.
    mv "$folder/bagtrack/bagtrack-$version.tgz" "$files/bagtrack-chart-$version.tgz"
    rm -r "$folder"
}

bill() {
    tools/supply_chain.sh
    cp target/bagtrack.cdx.json "$files/bagtrack-$version.cdx.json"
}

image() {
    local builder='' candidate format=()
    for candidate in docker podman; do
        # A client alone builds nothing.
        if [ -z "$builder" ] && "$candidate" info >/dev/null 2>&1; then builder=$candidate; fi
    done
    if [ -z "$builder" ]; then
        echo "Left out, for want of docker or podman, running: the image"
        return
    fi
    # The format of OCI images has no HEALTHCHECK.
    [ "$builder" != podman ] || format=(--format docker)
    # Builds the image with this tag, with these options, and saves it.
    save() {
        local tag=$1
        shift
        "$builder" build ${format[@]+"${format[@]}"} --file docker/Dockerfile --tag "bagtrack:$tag" "$@" \
            --build-arg "VERSION=$version" --build-arg "REVISION=$(git -C "$root" rev-parse HEAD)" .
        "$builder" save "bagtrack:$tag" | gzip >"$files/bagtrack-$tag-image.tar.gz"
    }
    save "$version"
    # Without ffmpeg.
    save "$version-small" --target small
}

sums() {
    cd "$files"
    rm -f SHA256SUMS
    sha256sum -- * >SHA256SUMS
    cat SHA256SUMS
}

if [ $# -eq 0 ]; then
    rm -rf "$files"
    mkdir -p "$files"
    set -- crates source wheel program npm chart bill image sums
fi
[ -z "${BAGTRACK_REPOSITORY:-}" ] || [ "$*" = version ] || name_repository
while [ $# -gt 0 ]; do
    product=$1
    shift
    case $product in
    program | wheel)
        target=
        # What has a dash in it is a target.
        case ${1:-} in *-*-*) target=$1 && shift ;; esac
        "$product" "$target"
        ;;
    crates | chart | bill | image | sums) "$product" ;;
    source) python_source ;;
    npm) npm_package ;;
    publish-crates) publish_crates ;;
    version) echo "$version" ;;
    *) echo "There is no product $product" >&2 && exit 2 ;;
    esac
done

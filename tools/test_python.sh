#!/usr/bin/env bash
# Builds the Python package's wheel, installs it, and runs its tests: `tools/test_python.sh [PYTEST OPTIONS]`.
#
# Takes the server of $BAGTRACK, or target/debug/bagtrack. Makes Python environments in target/python and
# target/python-label-studio: the package for Label Studio's backends needs old versions of what others need new. A tool
# whose package cannot be had is left out, with a line that says so. Real clips come from $BAGTRACK_SEQUENCES, OpenCV's
# samples from Debian's package opencv-doc (96 MB, kept in target/opencv-samples).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

environment=target/python
label_studio=target/python-label-studio
export BAGTRACK=${BAGTRACK:-target/debug/bagtrack}
export MPLBACKEND=agg

# Makes an environment, where it is not there yet, with these packages.
environment_with() {
    local folder=$1
    shift
    [ -x "$folder/bin/pip" ] || python3 -m venv "$folder"
    "$folder/bin/pip" install --quiet --disable-pip-version-check "$@"
}

# Unpacks OpenCV's samples for Python into this folder. The package is neither installed nor kept.
opencv_samples() {
    [ ! -e "$1/tracker.py" ] || return 0
    local folder
    folder=$(mktemp -d)
    (cd "$folder" && apt-get download --quiet opencv-doc >/dev/null 2>&1) || return
    mkdir -p "$1"
    dpkg-deb --fsys-tarfile "$folder"/opencv-doc_*.deb |
        tar --extract --directory "$1" --strip-components 7 --wildcards './usr/share/doc/opencv-doc/examples/python/*'
    rm -r "$folder"
}

environment_with "$environment" "maturin>=1.9,<2" "mypy>=1.11" pyright "numpy>=1.21" "pytest>=8" "httpx>=0.27" \
    "websockets>=13" "pillow>=9" "opencv-python-headless>=4.5"
# attributee 0.1.10 is not what vot-toolkit 0.9 was made for.
for packages in "got10k==0.1.3" "vot-toolkit==0.9.0 vot-trax>=4 attributee==0.1.9" "cvat-sdk>=2.20 cvat-cli>=2.20" \
    "nuclio-sdk>=0.5" "supervision>=0.25" "labelme>=5.5"; do
    # shellcheck disable=SC2086
    environment_with "$environment" $packages || echo "Left out, for want of its package: $packages"
done

rm -rf target/wheels
"$environment/bin/maturin" build --quiet --release --locked --manifest-path python/Cargo.toml --out target/wheels
"$environment/bin/pip" install --quiet --disable-pip-version-check --force-reinstall --no-deps target/wheels/*.whl

(cd python && "../$environment/bin/mypy" bagtrack)
"$environment/bin/pyright" --pythonpath "$environment/bin/python" python/bagtrack/__init__.py python/bagtrack/cv.py \
    python/bagtrack/_native.pyi
opencv_samples target/opencv-samples || echo "Left out, for want of Debian's opencv-doc: OpenCV's sample script"
export OPENCV_SAMPLES=$PWD/target/opencv-samples
"$environment/bin/python" -m pytest --quiet -rs python/tests --ignore python/tests/test_label_studio.py "$@"

if environment_with "$label_studio" --requirement docker/label-studio/requirements.txt "numpy>=1.21" "pytest>=8" \
    "pillow>=9"; then
    "$label_studio/bin/pip" install --quiet --disable-pip-version-check --force-reinstall --no-deps target/wheels/*.whl
    "$label_studio/bin/python" -m pytest --quiet -rs --disable-warnings python/tests/test_label_studio.py
else
    echo "Left out, for want of its package: label-studio-ml"
fi

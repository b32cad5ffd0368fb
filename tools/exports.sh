#!/usr/bin/env bash
# What `bagtrack track --format` and the page write, read by those who are to read it: `tools/exports.sh [PROGRAM]`.
#
# A clip in which the target leaves for a while is tracked with a second target, and written in every format: by the
# program, and by the page's own module (web/save.js) in Node.js from the same rows. Both must tell the same. TrackEval,
# motmetrics, pycocotools, datumaro and label-studio-sdk of PyPI then read both; what cannot be had is left out, with a
# line that says so. Needs ffmpeg, Python 3 with venv, and Node.js for the page's half.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program=$(realpath "${1:-target/debug/bagtrack}")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

"$program" sample --out "$folder/clip" --scene leaves >/dev/null
ffmpeg -v error -framerate 25 -i "$folder/clip/img/%04d.jpg" -c:v mpeg4 -q:v 2 "$folder/clip.mp4"
mkdir "$folder/command" "$folder/part" "$folder/page" "$folder/page-part"
track() {
    local into=$1 format=$2 file=$3
    shift 3
    "$program" track "$folder/clip.mp4" --box "$box" --box 20,20,60,60 --name "a <thing> & \"more\"" --seed 1 \
        --format "$format" -o "$folder/$into/$file" "$@" 2>/dev/null
}
# The first line of the truth counts pixels from 1, as all of OTB.
box=$(awk -F, 'NR == 1 { print $1 - 1 "," $2 - 1 "," $3 "," $4 }' "$folder/clip/groundtruth_rect.txt")
for format in json mot.txt coco.json yolo cvat.xml label-studio.json; do
    file=$format
    [ "$format" != json ] || file=rows.json
    track command "${format%.*}" "$file"
    # Of a part nobody knows the rest, and CVAT would go on to show the last box.
    track part "${format%.*}" "$file" --start 20 --frames 60
done

if command -v node >/dev/null && [ "$(node -p 'parseInt(process.versions.node)')" -ge 20 ]; then
    # The page finds the JavaScript client in a folder of its own.
    cp -r web "$folder/web"
    cp -r clients/js "$folder/web/js"
    node tools/exports/page.mjs "$folder/web" "$folder/command/rows.json" "$folder/page" whole
    node tools/exports/page.mjs "$folder/web" "$folder/part/rows.json" "$folder/page-part" part
else
    echo "Left out, for want of Node.js from 20 on: what the page writes"
    rm -r "$folder/page" "$folder/page-part"
fi

# Reads with these readers, in an environment with these packages. uv finds in seconds what goes together, pip in minutes.
read_with() {
    local environment=target/exports/$1 readers=$2
    shift 2
    [ -x "$environment/bin/python" ] || python3 -m venv "$environment"
    if "$environment/bin/python" -m pip install --quiet --disable-pip-version-check uv &&
        "$environment/bin/uv" pip install --quiet --python "$environment/bin/python" "$@"; then
        # shellcheck disable=SC2086
        "$environment/bin/python" tools/exports/read.py "$folder" $readers
    else
        echo "Left out, for want of its packages: $*"
    fi
}
# TrackEval needs a newer NumPy than datumaro's OpenCV.
read_with trackeval trackeval "trackeval==1.3.0"
read_with others "motmetrics pycocotools label_studio_sdk datumaro" "motmetrics==1.4.0" "pycocotools==2.0.11" \
    "label-studio-sdk==2.1.2" "datumaro==1.13.12"

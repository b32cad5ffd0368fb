#!/usr/bin/env bash
# Checks the unit for systemd, and what it leaves the service to do: `tools/systemd_unit.sh [PROGRAM]`.
#
# Takes systemd-analyze from Debian's package systemd; without it the check is left out, and a line says so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

unit=deploy/systemd/bagtrack.service
if ! command -v systemd-analyze >/dev/null; then
    echo "Left out, for want of systemd-analyze (Debian's package systemd): $unit"
    exit 0
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# The unit with the program that is here, since systemd looks for it.
program=$(realpath "${1:-target/debug/bagtrack}")
sed "s#/usr/local/bin/bagtrack#$program#" "$unit" >"$folder/bagtrack.service"
said=$(systemd-analyze verify --man=no "$folder/bagtrack.service" 2>&1) || { echo "$said"; exit 1; }
# A setting that it does not know is a warning.
[ -z "$said" ] || { echo "$said"; exit 1; }
# An exposure of 2 of 10 at most; a unit without these settings has 9.6. The network alone is 1.
systemd-analyze security --offline=true --threshold=20 "$folder/bagtrack.service" | tail -n 1

# The program takes each setting of the file of variables.
help=$("$program" serve --help)
while IFS= read -r variable; do
    flag=--$(tr 'A-Z_' 'a-z-' <<<"${variable#BAGTRACK_}")
    grep --quiet -e "$flag" <<<"$help" || { echo "$variable is no setting"; exit 1; }
done < <(sed -n 's/^#\{0,1\}\(BAGTRACK_[A-Z_]*\)=.*$/\1/p' deploy/systemd/bagtrack.env)

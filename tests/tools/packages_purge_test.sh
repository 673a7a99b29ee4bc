#!/bin/bash
# What a purge of grouser-server leaves of its state folder (packaging/debian/server/postrm, run for another folder).
# Usage: packages_purge_test.sh
set -euo pipefail
ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
fail() { echo "packages_purge_test: FAILED: $*" >&2; exit 1; }
folder="$(mktemp -d "${TMPDIR:-/tmp}/grouser-purge.XXXXXX")"
trap 'rm -rf "$folder"' EXIT
# Of the script only what it does to the folder: neither systemd nor debhelper of this machine is told anything.
sed -e "s#^  state=/var/lib/grouser\$#  state=$folder/state#" -e 's#/run/systemd/system#/nonexistent#' \
  -e 's#/usr/bin/deb-systemd-helper#/nonexistent#g' "$ROOT/packaging/debian/server/postrm" >"$folder/postrm"
grep -q "state=$folder/state" "$folder/postrm" || fail "postrm names its state folder otherwise"

# As both services make it at their start.
started() {
  mkdir -p "$folder"/state/{jobs,models,runs,tiles,tables}
  touch "$folder"/state/jobs/{lock,jobs.sqlite} "$folder"/state/tables/{.lock,a.table}
}
for purged in 1 2; do  # the second time nothing is there
  [ $purged = 2 ] || started
  said="$(sh "$folder/postrm" purge 2>&1)"
  [ -z "$said" ] || fail "nothing was ever done, and it says: $said"
  [ ! -e "$folder/state" ] || fail "nothing was ever done, and it leaves: $(find "$folder/state")"
done
for work in models/0f.model runs/1.run.h5 tiles/a.tile jobs/0a1b/report.json; do
  started
  mkdir -p "$(dirname "$folder/state/$work")"
  touch "$folder/state/$work"
  grep -q 'still has models' <<<"$(sh "$folder/postrm" purge 2>&1)" || fail "$work: does not say that work is left"
  for file in "$work" jobs/jobs.sqlite; do [ -e "$folder/state/$file" ] || fail "$work: $file went"; done
  [ ! -e "$folder/state/tables" ] || fail "$work: tables are left"
  rm -rf "$folder/state"
done
echo "packages_purge_test: all held"

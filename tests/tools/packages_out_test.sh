#!/bin/bash
# The folder that `./grouser package` fills (cmake/frontdoor/package.sh), with a cpack that makes empty files in
# place of packages: what is deleted, when, and what is printed. Usage: packages_out_test.sh
# shellcheck disable=SC2317,SC2034  # called, and read, by word_package
set -euo pipefail
ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
folder="$(mktemp -d "${TMPDIR:-/tmp}/grouser-out.XXXXXX")"
trap 'rm -rf "$folder"' EXIT
failed() { echo "packages_out_test: FAILED: $*" >&2; exit 1; }
. "$ROOT/cmake/frontdoor/common.sh"
. "$ROOT/cmake/frontdoor/package.sh"
GROUSER_ROOT="$folder" PYTHON=true out="$folder/build/package"
install_missing() { :; }
build_preset() { :; }
describe_package() { [ -e "$1" ] || failed "not there: $1"; }
cpack() {
  local to=''
  while [ $# -gt 0 ]; do [ "$1" != -B ] || to="$2"; shift; done
  mkdir -p "$to/_CPack_Packages"
  touch "$to/grouser_1-2_amd64.deb"
  [ -z "${breaks:-}" ] || return 1
  touch "$to/python3-grouser_1-2_amd64.deb"
}

mkdir -p "$out"
before=(grouser_1-1_amd64.deb libgrouser-dev_1-1_amd64.deb my-grouser_1_all.deb other_1_all.deb)
touch "${before[@]/#/$out/}"
if (breaks=1; word_package --release 2) >/dev/null 2>&1; then failed "cpack failed, and it did not"; fi
for file in "${before[@]}"; do [ -e "$out/$file" ] || failed "cpack failed, and $file went"; done
[ ! -e "$out/grouser_1-2_amd64.deb" ] || failed "cpack failed, and a part of what it made stands among packages"
for again in first again; do
  said="$(word_package --release 2 2>/dev/null)"
  [ "$said" = "$out/grouser_1-2_amd64.deb"$'\n'"$out/python3-grouser_1-2_amd64.deb" ] || failed "$again: it prints: $said"
  left="$(cd "$out" && find . -mindepth 1 | LC_ALL=C sort | tr '\n' ' ')"
  [ "$left" = './grouser_1-2_amd64.deb ./my-grouser_1_all.deb ./other_1_all.deb ./python3-grouser_1-2_amd64.deb ' ] ||
    failed "$again: there is: $left"
done
echo "packages_out_test: all held"

#!/bin/bash
# Debian packages as somebody has them who never saw this repository: makes them twice (./grouser package),
# then installs, uses, upgrades, removes and purges them in a Debian 12 folder of its own. Programs are run there
# with no network but loopback.
#
#   tests/tools/packages_check.sh [--folder DIR [--made DIR]]
#
# --folder (default: a new one under $TMPDIR, removed at the end) is kept, and used again if it is such a
# folder; --made has packages in 1/ and 2/, which are made where they are not.
# Exit codes: 0 all held, 1 something did not, 77 it cannot be run here (it says why).
set -euo pipefail
ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
say() { printf 'packages_check: %s\n' "$*" >&2; }
fail() { say "FAILED: $*"; exit 1; }
# shellcheck source=tests/tools/debian_folder.sh
. "$ROOT/tests/tools/debian_folder.sh"

folder='' keep='' packed=''
while [ $# -gt 0 ]; do
  case "$1" in
    --folder) folder="$(realpath -m "$2")"; keep=1 ;;
    --made) packed="$(realpath -m "$2")" ;;
    *) sed -n '2,11s/^# \{0,1\}//p' "$0" >&2; [ "$1" = --help ]; exit ;;
  esac
  shift 2
done
why="$(why_no_folder)" || { say "skipped: $why"; exit 77; }
if [ -z "$folder" ]; then
  folder="$(mktemp -d "${TMPDIR:-/tmp}/grouser-packages.XXXXXX")"
  chmod 755 "$folder"  # mktemp gives 700, and the services are not root there
fi
made="$(mktemp -d "${TMPDIR:-/tmp}/grouser-packages-made.XXXXXX")"
# shellcheck disable=SC2064  # as they are now
trap "rm -rf '$made'; [ -n '$keep' ] || rm -rf --one-file-system '$folder'" EXIT

# step NAME COMMAND...: says how long it took.
step() {
  local started=$SECONDS
  "${@:2}" || fail "$1"
  say "$1 ($((SECONDS - started)) s)"
}
quietly() { "$@" >"$made/log" 2>&1 || { tail -n 40 "$made/log" >&2; return 1; }; }
install_release() {
  rm -rf "$folder/root/packages"
  cp -r "$packed/$1" "$folder/root/packages"
  quietly in_folder sh -c 'apt-get install -qy --no-install-recommends /root/packages/*.deb python3-grpcio'
}
names() { local file; for file in "$packed"/1/*.deb; do dpkg-deb -f "$file" Package; done; }
# Everything of Grouser that is there, but for what this script put there.
left() {
  find "$folder" -mindepth 1 -xdev \( -path "$folder/root" -o -path "$folder/var/cache" -o -path "$folder/var/log" \
    -o -path "$folder/tmp" \) -prune -o -iname '*grouser*' -print | sed "s#^$folder##" | sort
}

# A program that links the library, compiled here and run there: the folder has no compiler.
compile_planner() {
  cat >"$made/planner.cc" <<'SOURCE'
#include <cstdio>
#include "grouser/model.h"
int main(int, char** arguments) {
  const grouser::Model model = grouser::Model::Open(arguments[1]);
  const grouser::Answer answer = model.Evaluate({.v_x = 0.08, .v_y = 0, .rim_speed = 0.1, .load = 24});
  std::printf("pull %.2f N\n", answer.output[grouser::kFx].value);
}
SOURCE
  cat >"$made/CMakeLists.txt" <<'SOURCE'
cmake_minimum_required(VERSION 3.25)
project(planner LANGUAGES CXX)
find_package(grouser CONFIG REQUIRED NO_DEFAULT_PATH PATHS ${FOLDER}/usr)
add_executable(planner planner.cc)
target_link_libraries(planner PRIVATE grouser::model)
SOURCE
  quietly cmake -S "$made" -B "$made/build" -DFOLDER="$folder" -DCMAKE_BUILD_WITH_INSTALL_RPATH=ON &&
    quietly cmake --build "$made/build" && cp "$made/build/planner" "$folder/root/"
}

# The two services as their units say, without systemd; then everybody's first commands.
use() {
  cp "$ROOT/tests/tools/packages_use.sh" "$folder/root/use.sh"
  in_folder --offline bash /root/use.sh "$@"
}

# shellcheck disable=SC2046  # one word a package
purge() { quietly in_folder dpkg --purge $(names); }
check_left() {
  local found expected="$1"
  found="$(left)"
  [ "$found" = "$expected" ] || { diff <(echo "$expected") <(echo "$found") >&2; return 1; }
}

[ -n "$packed" ] || packed="$made/packages"
for release in 1 2; do
  ! compgen -G "$packed/$release/*.deb" >/dev/null || continue
  step "packages of release $release" quietly "$ROOT/grouser" package --release "$release" --out "$packed/$release"
done
step "a Debian 12" make_folder
step "its lists" quietly in_folder apt-get -q update
[ -z "$(left)" ] || fail "something of Grouser is there already: $(left)"
step "install" install_release 1
step "a planner for the library" compile_planner
step "use" use fresh
sed -i 's/^  #http: 127.0.0.1:50161/  http: 127.0.0.1:50161/' "$folder/etc/grouser/grouser.yaml"
step "upgrade" install_release 2
step "use, with the settings and the model from before" use upgraded
# shellcheck disable=SC2046  # one word a package
step "remove" quietly in_folder apt-get remove -qy $(names)
grep -q '^  http:' "$folder/etc/grouser/grouser.yaml" || fail "remove: the settings went too"
[ ! -e "$folder/usr/bin/grouser-server" ] || fail "remove: programs are left"
step "purge" purge
grep -q '/var/lib/grouser still has models' "$made/log" || fail "purge: does not say that models are left"
step "what a purge leaves: models alone" check_left /var/lib/grouser
model="$folder/var/lib/grouser/models/$(cat "$folder/root/digest").model"
[ -s "$model" ] || fail "purge: a model went: ${model#"$folder"}"
rm -rf "$folder/var/lib/grouser"  # what the message says to do
step "install again" install_release 2
step "use, with nothing done" use idle
[ -e "$folder/var/lib/grouser/jobs/jobs.sqlite" ] || fail "grouser-jobs made no database"
step "purge again" purge
step "which leaves nothing, where no models were" check_left ''

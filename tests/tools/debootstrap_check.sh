#!/bin/bash
# Shows that a clean clone works on a Debian 12 where nothing was installed by
# hand: makes such a folder with debootstrap, clones the committed tree into
# it, and runs words of the front door there (as root; see docs/development.md).
#
#   tests/tools/debootstrap_check.sh [--folder DIR] [--keep] [WORD...]
#
# Default words: test demo. DIR (default: a new one under $TMPDIR) is removed
# at the end unless --keep; an existing DIR is reused without its old clone.
# The mirror is the first Debian one of this machine's apt sources.
set -euo pipefail
ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
CLONE='/root/a clean clone'  # a space in the path is part of the check
say() { printf 'debootstrap_check: %s\n' "$*" >&2; }

folder='' keep=''
while [[ "${1:-}" == --* ]]; do
  case "$1" in
    --folder) folder="$(realpath -m "$2")"; keep=1; shift 2 ;;
    --keep) keep=1; shift ;;
    *) sed -n '2,10s/^# \{0,1\}//p' "$0" >&2; [ "$1" = --help ]; exit ;;
  esac
done
words=("$@")
[ $# -gt 0 ] || words=(test demo)
[ "$(id -u)" -eq 0 ] || { say "must be root (debootstrap, chroot)"; exit 2; }
command -v debootstrap >/dev/null || { say "needs the package debootstrap"; exit 2; }
[ -n "$folder" ] || folder="$(mktemp -d "${TMPDIR:-/tmp}/grouser-debian12.XXXXXX")"
[ -n "$keep" ] || trap 'rm -rf --one-file-system "$folder"' EXIT

mirror() {
  { cat /etc/apt/sources.list /etc/apt/sources.list.d/*.{list,sources} 2>/dev/null || true; } |
    grep -oE '^(URIs:|deb ).*' | grep -oE '(https?|file)://[^ ]+/debian/?( |$)' | tr -d ' ' | sed -n 1p
}

make_folder() {
  [ -x "$folder/usr/bin/apt-get" ] && return
  local from
  from="$(mirror)" || { say "no Debian mirror in this machine's apt sources"; exit 1; }
  say "debootstrap bookworm from $from into $folder"
  debootstrap --variant=minbase bookworm "$folder" "$from" >"$folder.log" 2>&1 ||
    { tail -n 20 "$folder.log" >&2; exit 1; }
  rm -f "$folder.log"
  # How this machine reaches its mirror holds there too (proxies, dates).
  apt-config dump | grep -E '^Acquire::(http|https|Check)' >"$folder/etc/apt/apt.conf.d/90host" || true
}

# Runs a command in the folder, in mount and process namespaces of its own:
# whatever it mounts or leaves running ends with it.
in_folder() {
  # shellcheck disable=SC2016  # expanded inside
  unshare --mount --pid --fork --kill-child -- /bin/bash -ec '
    folder="$1"; shift
    mount --make-rprivate /
    mount -t proc proc "$folder/proc"
    mount --rbind /dev "$folder/dev"
    mount -t sysfs -o ro sysfs "$folder/sys"
    exec chroot "$folder" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root \
      LC_ALL=C.UTF-8 "$@"' sh "$folder" "$@" </dev/null
}

make_folder
cp -L /etc/resolv.conf /etc/hosts "$folder/etc/"
rm -rf "${folder:?}$CLONE"
git clone --quiet --no-hardlinks "$ROOT" "$folder$CLONE"
say "clone of $(git -C "$ROOT" rev-parse --short HEAD); uncommitted changes are not in it"

failed=0
for word in "${words[@]}"; do
  started=$SECONDS result=passed
  in_folder "$CLONE/grouser" "$word" || { result=FAILED; failed=1; }
  printf 'debootstrap_check: ./grouser %s %s (%d s)\n' "$word" "$result" $((SECONDS - started))
done
[ -z "$keep" ] || say "kept: $folder"
exit $failed

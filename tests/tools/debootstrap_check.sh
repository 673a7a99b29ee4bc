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
[ -n "$folder" ] || folder="$(mktemp -d "${TMPDIR:-/tmp}/grouser-debian12.XXXXXX")"
[ -n "$keep" ] || trap 'rm -rf --one-file-system "$folder"' EXIT

# shellcheck source=tests/tools/debian_folder.sh
. "$ROOT/tests/tools/debian_folder.sh"
why="$(why_no_folder)" || { say "$why"; exit 2; }
make_folder
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

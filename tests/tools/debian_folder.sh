# shellcheck shell=bash
# A Debian 12 in a folder of its own, for scripts that set `folder` and have `say`.
: "${folder:=}"

# The mirror of bookworm that this machine's apt uses.
mirror() {
  # shellcheck disable=SC2016  # apt's own names
  apt-get indextargets --format '$(CODENAME) $(REPO_URI)' 'Created-By: Packages' | sed -n 's/^bookworm //p' | sed -n 1p
}

# Says why no such folder can be made here, and fails; else succeeds.
why_no_folder() {
  local from answer
  if [ "$(id -u)" -ne 0 ]; then echo "must be root (debootstrap, chroot)"; return 1; fi
  if ! command -v debootstrap >/dev/null; then echo "needs the package debootstrap"; return 1; fi
  if ! unshare --mount --pid --net --fork true 2>/dev/null; then echo "no namespaces may be made here"; return 1; fi
  from="$(mirror)" || true
  if [ -z "$from" ]; then echo "no mirror of bookworm in this machine's apt sources"; return 1; fi
  answer="$(mktemp)"
  if ! /usr/lib/apt/apt-helper download-file "${from%/}/dists/bookworm/InRelease" "$answer" >/dev/null 2>&1; then
    rm -f "$answer"
    echo "this machine's mirror of bookworm does not answer"
    return 1
  fi
  rm -f "$answer"
}

# Makes the folder, unless it is one already.
make_folder() {
  local from
  if [ ! -x "$folder/usr/bin/apt-get" ]; then
    from="$(mirror)"
    say "debootstrap bookworm from this machine's mirror into $folder"
    debootstrap --variant=minbase bookworm "$folder" "$from" >"$folder.log" 2>&1 ||
      { tail -n 20 "$folder.log" >&2; exit 1; }
    rm -f "$folder.log"
    # How this machine reaches its mirror holds there too (proxies, dates).
    apt-config dump | grep -E '^Acquire::(http|https|Check)' >"$folder/etc/apt/apt.conf.d/90host" || true
  fi
  cp -L /etc/resolv.conf /etc/hosts "$folder/etc/"
}

# in_folder [--offline] COMMAND...: runs it there, in mount and process namespaces of its own: whatever it
# mounts or leaves running ends with it. --offline: with no network but its own loopback interface.
in_folder() {
  local namespaces=(--mount --pid)
  if [ "$1" = --offline ]; then
    namespaces+=(--net)
    shift
  fi
  # shellcheck disable=SC2016  # expanded inside
  unshare "${namespaces[@]}" --fork --kill-child -- /bin/bash -ec '
    folder="$1" namespaces="$2"; shift 2
    case "$namespaces" in *--net*) ip link set lo up ;; esac
    mount --make-rprivate /
    mount -t proc proc "$folder/proc"
    mount --rbind /dev "$folder/dev"
    mount -t sysfs -o ro sysfs "$folder/sys"
    exec chroot "$folder" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root \
      LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"' sh "$folder" "${namespaces[*]}" "$@" </dev/null
}

# shellcheck shell=bash
# `./grouser package`: Debian packages of the release build.

package_help() {
  help_text <<'HELP'
Usage: ./grouser package [--release N] [--out DIR]
Builds the preset release and makes Debian packages of it by CPack: grouser-server, grouser-workers, grouser,
grouser-map, grouser-data, libgrouser-dev, python3-grouser; grouser-map and python3-grouser where they were
built (./grouser setup installs what they need). Prints their paths. What is in them: docs/packages.md.
  --release N   after the hyphen of the version (default: 1); a higher one upgrades
  --out DIR     folder of the packages, of which older ones go once the new are made (default: build/package)
Examples:
  ./grouser package
  sudo apt-get install $(./grouser package | grep -E '/(grouser|grouser-(server|workers|data))_')
HELP
}

# describe_package FILE: size, and how many packages it needs, for the log.
describe_package() {
  say "  $(dpkg-deb -f "$1" Package), $(du -k "$1" | cut -f1) KiB, installed $(dpkg-deb -f "$1" Installed-Size) KiB:" \
    "depends on $(dpkg-deb -f "$1" Depends | tr ',' '\n' | wc -l)"
}

word_package() {
  local release=1 out="$GROUSER_ROOT/build/package" log="$GROUSER_ROOT/build/package.log" dir aside file packages
  dir="$GROUSER_ROOT/build/release"
  if wants_help "$@"; then package_help; return; fi
  while [ $# -gt 0 ]; do
    [ $# -ge 2 ] || usage_error "package: $1 needs a value, or is unknown; see ./grouser package --help"
    case "$1" in
      --release) release="$2" ;;
      --out) out="$(realpath -m "$2")" ;;
      *) usage_error "package: unknown argument '$1'; see ./grouser package --help" ;;
    esac
    shift 2
  done
  [[ "$release" =~ ^[0-9][A-Za-z0-9.+~]*$ ]] ||
    usage_error "package: --release '$release': expected a number, and letters, digits, . + ~ after it"
  install_missing build libraries run package
  build_preset release packaged
  mkdir -p "$out"
  : >"$log"
  say "man pages and completions from the programs' command lines"
  "$PYTHON" "$GROUSER_ROOT/packaging/command_lines/write.py" --build "$dir" --out "$dir/command_lines" >>"$log" 2>&1 ||
    { tail -n 25 "$log" >&2; fail "they failed; all output is in $log"; }
  say "packing (log: build/package.log)"
  aside="$out/.making"  # on the same file system; the packages of before stay until all new ones are there
  rm -rf "$aside"
  cpack --config "$dir/CPackConfig.cmake" -G DEB -B "$aside" -D "CPACK_DEBIAN_PACKAGE_RELEASE=$release" >>"$log" 2>&1 ||
    { tail -n 25 "$log" >&2; fail "cpack failed; all output is in $log"; }
  mapfile -t packages < <(find "$aside" -maxdepth 1 -name '*.deb' -printf '%f\n' | sort)
  [ ${#packages[@]} -gt 0 ] || fail "cpack made no package; all output is in $log"
  mv -t "$out" -- "${packages[@]/#/$aside/}"
  find "$out" -maxdepth 1 \( -name 'grouser*_*.deb' -o -name 'libgrouser-dev_*.deb' -o -name 'python3-grouser_*.deb' \) \
    -printf '%f\n' | while read -r file; do
    [[ " ${packages[*]} " == *" $file "* ]] || rm "$out/$file"
  done
  rm -rf "$aside"
  packages=("${packages[@]/#/$out/}")
  for file in "${packages[@]}"; do describe_package "$file"; done
  printf '%s\n' "${packages[@]}"
}

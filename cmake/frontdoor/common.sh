# shellcheck shell=bash
# Parts of ./grouser that every word uses: messages, packages, build.

# Debian's: it has numpy and matplotlib.
# shellcheck disable=SC2034  # used by other parts
PYTHON=/usr/bin/python3

# Whether this is a checkout, and no installation.
is_checkout() { [ -e "$GROUSER_ROOT/CMakeLists.txt" ]; }
# Help texts call it ./grouser; an installed one is on the path.
help_text() { if is_checkout; then cat; else sed 's#\./grouser\b#grouser#g'; fi; }

say() {
  local text="$*"
  is_checkout || text="${text//.\/grouser/grouser}"
  printf 'grouser: %s\n' "$text" >&2
}
fail() { say "$*"; exit 1; }
usage_error() { say "$*"; exit 2; }

# Whether one of a word's arguments asks for its help.
wants_help() {
  local arg
  for arg in "$@"; do
    case "$arg" in -h | --help) return 0 ;; esac
  done
  return 1
}

state_dir() {
  local home="${HOME:-$(getent passwd "$(id -u)" | cut -d: -f6)}"
  printf '%s\n' "${GROUSER_STATE:-${XDG_STATE_HOME:-$home/.local/state}/grouser}"
}
shipped_dir() { printf '%s\n' "$GROUSER_ROOT/surrogate/shipped"; }
# Model files of the given folders; a folder that is not there has none.
model_files() { find "$@" -maxdepth 1 -name '*.model' 2>/dev/null || true; }
program_dir() {
  if is_checkout; then printf '%s\n' "$GROUSER_ROOT/build/release/bin"; else realpath -m "$GROUSER_ROOT/../../bin"; fi
}
program_path() { printf '%s/%s\n' "$(program_dir)" "$1"; }
# Programs of an installation, and the package that has each.
installed_programs() { grep -v '^#' "$GROUSER_ROOT/cmake/programs"; }

# Path of the CUDA compiler; fails where there is none.
find_nvcc() {
  command -v nvcc || { [ -x /usr/local/cuda/bin/nvcc ] && echo /usr/local/cuda/bin/nvcc; }
}

# Package names of the given groups of cmake/packages.debian.
package_list() {
  awk -v groups=" $* " '
    /^# group:/ { take = index(groups, " " $3 " ") > 0; next }
    /^ *(#|$)/ { next }
    take { print $1 }' "$GROUSER_ROOT/cmake/packages.debian"
}

# Those of the listed packages that are not installed.
missing_packages() {
  local wanted installed
  wanted="$(package_list "$@" | sort -u)"
  # shellcheck disable=SC2086  # one word a package
  installed="$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' $wanted 2>/dev/null |
    awk '$1 == "installed" {print $2}' | sort -u)" || true
  comm -23 <(printf '%s\n' "$wanted") <(printf '%s\n' "$installed")
}

# install_missing GROUP...: does nothing where nothing is missing.
install_missing() {
  if ! command -v dpkg-query >/dev/null; then
    say "no dpkg here: install what cmake/packages.debian names by hand"
    return 0
  fi
  local missing root=()
  mapfile -t missing < <(missing_packages "$@")
  [ ${#missing[@]} -eq 0 ] && return 0
  if [ -n "${GROUSER_NO_INSTALL:-}" ]; then
    fail "missing packages (GROUSER_NO_INSTALL is set): ${missing[*]}"
  fi
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "missing packages, and neither root nor sudo:" \
      "as root, run: apt-get install --no-install-recommends ${missing[*]}"
    root=(sudo)
  fi
  say "installing ${#missing[@]} Debian packages with ${root[*]:+sudo }apt-get: ${missing[*]}"
  local log="$GROUSER_ROOT/build/packages.log" apt
  mkdir -p "$GROUSER_ROOT/build"
  apt=("${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q)
  if ! { "${apt[@]}" update && "${apt[@]}" install -y --no-install-recommends "${missing[@]}"; } \
      </dev/null >"$log" 2>&1; then
    tail -n 25 "$log" >&2
    fail "apt-get failed; its output is in $log"
  fi
}

# Compilers at once: one a core, and 1.5 GiB of memory for each.
build_jobs() {
  local cores memory
  cores="$(nproc)"
  memory="$(awk '/^MemAvailable/ {print int($2 / 1572864)}' /proc/meminfo)"
  [ "$memory" -lt 1 ] && memory=1
  printf '%s\n' "${GROUSER_BUILD_JOBS:-$((cores < memory ? cores : memory))}"
}

# Passes a build log through to FILE and shows every tenth of its steps.
show_tenths() {
  tee -a "$1" | awk '
    match($0, /^\[[0-9]+\/[0-9]+\]/) {
      split(substr($0, 2, RLENGTH - 2), n, "/")
      tenth = int(10 * n[1] / n[2])
      if (n[2] >= 10 && tenth != last) {
        printf "grouser:   %3d %% of %d steps\n", 10 * tenth, n[2]; fflush(); last = tenth
      }
    }' >&2
}

# Runs ninja so that a signal for this shell alone ends it too.
run_ninja() {
  local code=0 ninja
  ninja -C "$1" -j "$(build_jobs)" "${@:3}" </dev/null > >(show_tenths "$2") 2>&1 &
  ninja=$!
  trap 'kill -TERM $ninja || true; wait $ninja || true; say "the build was interrupted"; exit 130' INT TERM HUP
  wait $ninja || code=$?
  trap - INT TERM HUP
  return $code
}

# Whether a build in folder $1 was configured without an optional package that is there now.
lacks_optional() {
  local library
  for library in Simbody GDAL; do
    grep -qs "^${library}_DIR:PATH=${library}_DIR-NOTFOUND" "$1/CMakeCache.txt" &&
      compgen -G "/usr/lib/*/cmake/${library,,}" >/dev/null && return 0
  done
  grep -qs '^MUJOCO_LIBRARY:FILEPATH=MUJOCO_LIBRARY-NOTFOUND' "$1/CMakeCache.txt" &&
    compgen -G '/usr/lib/*/libmujoco.so' >/dev/null && return 0
  grep -qs '^GROUSER_\(GENPY\|STD_MSGS\):[A-Z]*=.*-NOTFOUND' "$1/CMakeCache.txt" &&
    [ -e /usr/lib/genpy/genmsg_py.py ] && [ -e /usr/share/std_msgs/msg/Header.msg ] && return 0
  grep -qs '^GROUSER_PYTHON_FOUND:INTERNAL=OFF' "$1/CMakeCache.txt" && [ -e /usr/lib/cmake/pybind11 ] &&
    compgen -G '/usr/include/python3*/Python.h' >/dev/null && return 0
  # A build that searches for inputs (the others do not look for clang++), but could not.
  grep -qs '^GROUSER_CLANGXX:FILEPATH=' "$1/CMakeCache.txt" || return 1
  if grep -q '^GROUSER_CLANGXX:FILEPATH=GROUSER_CLANGXX-NOTFOUND' "$1/CMakeCache.txt"; then
    command -v clang++ >/dev/null
  else
    # clang++ alone links no libFuzzer; what was there already when that was tried does not count.
    ! grep -q '^GROUSER_CLANG_FUZZES:' "$1/CMakeCache.txt" &&
      [ -n "$(find "${LLVM_ROOT:-/usr/lib}"/llvm-* -name 'libclang_rt.fuzzer*' \
        -newercm "$1/CMakeCache.txt" 2>/dev/null | head -n 1)" ]
  fi
}

# build_preset PRESET [TARGET]: configures where that was not done, then builds. One
# build at a time; the output goes to build/PRESET.log.
build_preset() {
  local preset="$1" dir="$GROUSER_ROOT/build/$1" log="$GROUSER_ROOT/build/$1.log"
  local started=$SECONDS fresh=() home
  mkdir -p "$GROUSER_ROOT/build"
  exec 9>"$GROUSER_ROOT/build/.lock"
  flock -n 9 || { say "another build of this checkout is running; waiting for it"; flock 9; }
  : >"$log"
  home="$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$dir/CMakeCache.txt" 2>/dev/null || true)"
  if [ ! -f "$dir/build.ninja" ] || [ "$home" != "$GROUSER_ROOT" ] || lacks_optional "$dir"; then
    [ -z "$home" ] || fresh=(--fresh)  # the checkout was moved, or a configure failed
    say "configuring preset $preset"
    (cd "$GROUSER_ROOT" && cmake "${fresh[@]}" --preset "$preset") 9>&- </dev/null >>"$log" 2>&1 ||
      { tail -n 25 "$log" >&2; fail "configure failed; its output is in $log"; }
  fi
  say "building preset $preset (log: build/$preset.log)"
  if ! run_ninja "$dir" "$log" "${@:2}" 9>&-; then
    grep -nE -A 12 '^FAILED|error:|Error ' "$log" | head -n 60 >&2 || true
    fail "build failed; its output is in $log"
  fi
  exec 9>&-
  say "preset $preset is built ($((SECONDS - started)) s)"
}

# For the words that may install packages: setup, build, demo, test.
set_up() {
  install_missing build libraries run
  build_preset release
}

# For all other words: says what is missing and installs nothing.
require_packages() {
  command -v dpkg-query >/dev/null || return 0
  local missing
  if is_checkout; then
    mapfile -t missing < <(missing_packages "$@")
  else  # its own are there; Python's modules are recommended
    mapfile -t missing < <(missing_packages run | grep '^python3-' || true)
  fi
  [ ${#missing[@]} -gt 0 ] || return 0
  is_checkout || fail "missing packages: ${missing[*]}; as root: apt-get install ${missing[*]}"
  case "$*" in
    *docs* | *lint*)  # which no word installs but test --full
      fail "missing packages; as root: apt-get install --no-install-recommends ${missing[*]}" ;;
    *) fail "missing packages: ${missing[*]}; ./grouser setup installs them and builds" ;;
  esac
}

# installed_out NAME: where an installed word writes, which cannot beside its script.
installed_out() { is_checkout || printf -- '--out\n%s\n' "$PWD/out/$1"; }

# build_if_missing PROGRAM...: builds where a program is missing and all packages are there.
build_if_missing() {
  local program
  for program in "$@"; do
    [ -x "$(program_path "$program")" ] && continue
    is_checkout || fail "$program is not installed: the package" \
      "$(installed_programs | awk -v p="$program" '$1 == p {print $2}') has it"
    require_packages build libraries run
    build_preset release
    [ -x "$(program_path "$program")" ] || fail "$program was not built; see build/release.log"
  done
}

# run_program PROGRAM ARGS...: replaces this shell; builds first where needed.
run_program() {
  local path
  build_if_missing "$1"
  path="$(program_path "$1")"
  shift
  exec "$path" "$@"
}

# LCM is received on the loopback interface: what is sent to its group,
# 239.255.76.67, must be routed there.
has_multicast_route() {
  awk '$1 == "lo" && ($2 == "000000E0" && $8 == "000000F0" || $2 == "434CFFEF" && $8 == "FFFFFFFF") \
       { found = 1 } END { exit !found }' /proc/net/route 2>/dev/null
}

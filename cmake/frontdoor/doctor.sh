# shellcheck shell=bash
# `./grouser doctor`: what is missing, which features that disables, what to do about it.

# Findings as "level|name|what was found|effect|what to do". Levels:
# ok, absent (a feature less), missing (demo and tests cannot run).
finding() { FINDINGS+=("$1|$2|$3|${4:-}|${5:-}"); }

check_packages() {
  local missing
  if ! command -v dpkg-query >/dev/null; then
    finding absent packages "no dpkg: not a Debian" "nothing is installed for you" \
      "install what cmake/packages.debian names"
    return
  fi
  if ! is_checkout; then
    missing="$(missing_packages run | grep '^python3-' | tr '\n' ' ' || true)"
    if [ -z "$missing" ]; then finding ok packages "all that are recommended"; else
      finding absent packages "not installed: ${missing% }" "no pictures, pages and words in Python" \
        "apt-get install ${missing% }"; fi
    return
  fi
  missing="$(missing_packages build libraries run | tr '\n' ' ')"
  if [ -z "$missing" ]; then
    finding ok packages "all $(package_list build libraries run | wc -l) of cmake/packages.debian"
  else
    finding missing packages "not installed: ${missing% }" "no build" \
      "./grouser setup installs them; or: apt-get install --no-install-recommends ${missing% }"
  fi
  missing="$(missing_packages multibody)"
  [ -z "$missing" ] || finding absent joints "not installed: $missing" \
    "no joints and springs in experiment files, no reproduction of shin2020" \
    "./grouser setup installs it and builds with it"
  missing="$(missing_packages maps)"
  [ -z "$missing" ] || finding absent maps "not installed: $missing" "no ./grouser map" \
    "./grouser setup installs it and builds with it"
  missing="$(missing_packages mujoco)"
  [ -z "$missing" ] || finding absent mujoco "not installed: $missing" "no adapter to MuJoCo (docs/mujoco.md)" \
    "./grouser setup installs it and builds with it"
  missing="$(missing_packages ros | tr '\n' ' ')"
  [ -z "$missing" ] || finding absent ros "not installed: ${missing% }" \
    "no node for ROS 1 here, or none of its tests (docs/ros.md)" \
    "as root: apt-get install --no-install-recommends ${missing% }"
  missing="$(missing_packages python | tr '\n' ' ')"
  [ -z "$missing" ] || finding absent python "not installed: ${missing% }" \
    "no Python package grouser, or none of its clients of servers and no wheel" \
    "./grouser setup installs them and builds with them"
  missing="$(missing_packages docs | tr '\n' ' ')"
  [ -z "$missing" ] || finding absent docs "not installed: ${missing% }" "no ./grouser docs (the documents are Markdown)" \
    "as root: apt-get install --no-install-recommends ${missing% }"
}

check_build() {
  local program package absent=()
  if ! is_checkout; then
    while read -r program package; do
      if [ -x "$(program_path "$program")" ]; then finding ok program "$program"; else
        finding absent program "not installed: $program" "no words that need it" "apt-get install $package"; fi
    done < <(installed_programs)
    return
  fi
  for program in grouser-{dem,fit,server,jobs,client,bench}; do
    [ -x "$(program_path "$program")" ] || absent+=("$program")
  done
  if [ ${#absent[@]} -eq 0 ]; then
    finding ok build "build/release/bin"
  else
    finding absent build "not built: ${absent[*]}" "the first command builds first" "./grouser setup"
  fi
}

check_gpu() {
  local nvcc
  if nvcc="$(find_nvcc)"; then
    finding ok nvcc "$("$nvcc" --version | sed -n 's/.*release \([0-9.]*\).*/CUDA \1/p')"
  else
    finding absent nvcc "not found" "no GPU back end; everything else builds" "install the CUDA Toolkit"
  fi
}

check_multicast() {
  if has_multicast_route; then
    finding ok multicast "LCM messages are routed to lo, where they are received"
  else
    finding absent multicast "no route for 224.0.0.0/4 by lo" \
      "no LCM but with --lcm-interface; gRPC works (the demo makes a route in a network namespace of its own)" \
      "as root: ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo"
  fi
}

check_machine() {
  local cores memory disk
  cores="$(nproc)"
  memory="$(awk '/^MemTotal/ {print int($2 / 1048576 + 0.5)}' /proc/meminfo)"
  disk="$(df -Pk "$GROUSER_ROOT" | awk 'NR == 2 {print int($4 / 1048576)}')"
  if [ "$cores" -ge 2 ]; then finding ok cores "$cores"; else
    finding absent cores "$cores" "the demo takes about twice its 12 minutes"; fi
  if is_checkout; then  # compilers need them
    if [ "$memory" -ge 4 ]; then finding ok memory "$memory GiB"; else
      finding missing memory "$memory GiB" "compilers run out of it" "4 GiB or more"; fi
    if [ "$disk" -ge 6 ]; then finding ok disk "$disk GiB free"; else
      finding missing disk "$disk GiB free" "no room for the builds of all presets" "6 GiB or more"; fi
  fi
  if grep -qw avx2 /proc/cpuinfo; then
    finding ok avx "$(grep -owE -m 1 'avx2|avx512f' /proc/cpuinfo | sort -u | paste -sd ' ')"
  else
    finding absent avx "no avx2" "DEM and batch queries run several times slower"
  fi
}

check_models() {
  local count
  count="$(model_files "$(shipped_dir)" "$(state_dir)/models" | wc -l)"
  if [ "$count" -gt 0 ]; then finding ok models "$count model files (./grouser model list)"; else
    finding absent models "none shipped, none in $(state_dir)/models" "nothing to serve" \
      "./grouser demo, or ./grouser campaign run and ./grouser fit"; fi
}

json_string() {
  local text="${1//\\/\\\\}"
  printf '"%s"' "${text//\"/\\\"}"
}

print_findings_json() {
  local line level name found lost fix separator=''
  printf '{"ok": %s, "checks": [' "$1"
  for line in "${FINDINGS[@]}"; do
    IFS='|' read -r level name found lost fix <<<"$line"
    printf '%s\n  {"name": %s, "level": %s, "found": %s, "effect": %s, "fix": %s}' "$separator" \
      "$(json_string "$name")" "$(json_string "$level")" "$(json_string "$found")" \
      "$(json_string "$lost")" "$(json_string "$fix")"
    separator=','
  done
  printf '\n]}\n'
}

print_findings() {
  local line level name found lost fix
  for line in "${FINDINGS[@]}"; do
    IFS='|' read -r level name found lost fix <<<"$line"
    printf '%-8s %-10s %s\n' "$level" "$name" "$found"
    [ -z "$lost" ] || printf '%-19s effect: %s\n' '' "$lost"
    [ -z "$fix" ] || printf '%-19s to do: %s\n' '' "$fix"
  done
}

word_doctor() {
  if wants_help "$@"; then
    help_text <<'HELP'
Usage: ./grouser doctor [--json]
Says what this machine lacks, which features are unavailable or slow, and what to do about it.
  ok       there
  absent   one feature is unavailable; everything else works
  missing  demo and tests cannot run
Exit code: 0 nothing is missing, 1 something is.
Example: ./grouser doctor --json | jq '.checks[] | select(.level != "ok")'
HELP
    return
  fi
  local json='' ok=true
  case "$*" in '') ;; --json) json=1 ;; *) usage_error "doctor: unknown argument in '$*'" ;; esac
  FINDINGS=()
  check_packages; check_build; if is_checkout; then check_gpu; fi; check_multicast; check_machine; check_models
  [[ " ${FINDINGS[*]%%|*} " != *" missing "* ]] || ok=false
  if [ -n "$json" ]; then print_findings_json $ok; else print_findings; fi | help_text
  $ok
}

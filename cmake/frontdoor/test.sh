# shellcheck shell=bash
# `./grouser test`: release tests, and under ASan those of what an outsider can send; more under --full.

test_help() {
  help_text <<'HELP'
Usage: ./grouser test [--full] [--label LABEL]
Installs what is missing, builds, and runs:
  release   every test but those labelled "slow"
  asan      tests labelled "hostile" (they read what an outsider can send: files,
            datagrams, request messages), under AddressSanitizer and UBSan; nothing that
            needs gRPC or the DEM engine (scenes, experiments, campaigns)
  cuda      where nvcc is: every kernel compiled for sm_90 (run by tests/gpu/run)
With --full also:
  lint      what ./grouser lint checks
  asan      all tests labelled "unit" or "verify", with more checks of UBSan
  cuda      every kernel for sm_80 too
  slow      tests labelled "slow", among them the search for inputs that the readers fail on
  tsan      tests labelled "tsan" (engine, models, server/core, jobs, LCM), under TSan
  tidy      clang-tidy over all sources
  --label LABEL   only the release tests with that label (a regular expression)
Exit code: 0 all passed, 1 something failed. Logs: build/test-*.log
Examples:
  ./grouser test
  ./grouser test --label integration
HELP
}

# record_stage NAME COMMAND...: runs it, keeps its output and its result.
record_stage() {
  local name="$1" log="$GROUSER_ROOT/build/test-$1.log" started=$SECONDS result=passed
  shift
  mkdir -p "$GROUSER_ROOT/build"
  say "== $name"
  ("$@") 2>&1 | tee "$log" || { result=FAILED; TESTS_FAILED=1; }
  TEST_RESULTS+=("$(printf '%-8s %-7s %4d s  %s' "$name" "$result" $((SECONDS - started)) \
    "$(grep -E '^[0-9]+% tests passed' "$log" | tail -n 1)")")
}

# Why tests were skipped, by what they printed: CTest itself says that they were.
show_skipped() {
  awk '/^[0-9]+\/[0-9]+ Test: / { name = $3 } /^(grouser: )?skipped: / { print "  " name ": " $0 }' \
    "$GROUSER_ROOT/build/$1/Testing/Temporary/LastTest.log" || true
}

# ctest_preset PRESET ARGS...: runs tests of a preset that is built.
ctest_preset() {
  local code=0
  # As many compilers as in a build, where a test builds what it needs.
  CMAKE_BUILD_PARALLEL_LEVEL="$(build_jobs)" ctest --test-dir "$GROUSER_ROOT/build/$1" --output-on-failure --no-tests=error --parallel 2 "${@:2}" || code=$?
  show_skipped "$1"
  return "$code"
}

# run_ctest PRESET ARGS...: builds the preset (all but the fuzzers, which CTest builds), runs its tests.
run_ctest() { build_preset "$1" && ctest_preset "$@"; }

# Of --full, which would otherwise pass where no input was searched for.
run_slow() {
  build_preset release || return 1
  ctest --test-dir "$GROUSER_ROOT/build/release" --show-only --tests-regex '^fuzz_' |
    grep '^Total Tests: [1-9]' >/dev/null ||
    { say "no test fuzz_*: expected clang++ with libFuzzer (Debian: clang, libclang-rt-14-dev)"; return 1; }
  ctest_preset release --label-regex slow
}

# What is not tested there is not built, but for --full.
build_asan() { if [ -n "$1" ]; then build_preset asan-full; else build_preset asan hostile_tests; fi; }
run_asan() {
  local labels=hostile
  [ -z "$1" ] || labels='unit|verify'
  build_asan "$1" && ctest_preset "asan${1:+-full}" --label-regex "$labels"
}

# Many release tests wait, or use one core: what the next stages need is built meanwhile, with
# what time the tests leave. Those stages build again what fails here, and report it.
run_release() {
  local code=0 ahead
  build_preset release || return 1
  { renice -n 19 -p "$BASHPID" && build_asan "$1" && run_cuda "$1"; } \
    </dev/null >"$GROUSER_ROOT/build/test-ahead.log" 2>&1 &
  ahead=$!
  trap 'kill "$ahead" || true; exit 130' INT TERM HUP
  ctest_preset release --label-exclude slow || code=$?
  say "finishing the builds of the next stages (log: build/test-ahead.log)"
  wait "$ahead" || true
  trap - INT TERM HUP
  return "$code"
}

run_tsan() {
  # Address randomisation with many bits defeats the TSan of g++ 12.
  local fixed=(setarch "$(uname -m)" --addr-no-randomize)
  "${fixed[@]}" true 2>/dev/null || fixed=()
  build_preset tsan || return 1
  "${fixed[@]}" ctest --test-dir "$GROUSER_ROOT/build/tsan" --output-on-failure \
    --no-tests=error --parallel 2 --label-regex tsan
}

# Kernels are compiled; only a card can run them.
run_cuda() {
  local nvcc architectures="90${1:+;80}" log="$GROUSER_ROOT/build/kernels.log"
  nvcc="$(find_nvcc)" || { echo "no nvcc: kernels not compiled"; return; }
  CUDACXX="$nvcc" cmake -S "$GROUSER_ROOT/dem_offline/engine" -B "$GROUSER_ROOT/build/kernels" \
    -G Ninja -DCMAKE_BUILD_TYPE=Release -DGROUSER_CUDA=ON -DCMAKE_CUDA_ARCHITECTURES="$architectures" \
    -DCMAKE_CUDA_FLAGS=--threads=2 || return 1
  : >"$log"
  run_ninja "$GROUSER_ROOT/build/kernels" "$log" grouser_cuda grouser-gpu-law-check ||
    { tail -n 25 "$log"; return 1; }
}

# Its sources are compiled one by one, so that each has its own command line; of the
# build only the generated headers are needed.
run_tidy() {
  build_preset tidy grouser_messages grouser_services grouser_lcm_headers \
    generated_lite/grouser/v1alpha1/model.pb.h || return 1
  cd "$GROUSER_ROOT" || return
  git ls-files -z '*.cc' | xargs -0 -n 4 -P "$(nproc)" clang-tidy --quiet -p build/tidy
}

word_test() {
  local full='' label='' packages=()
  if wants_help "$@"; then test_help; return; fi
  while [ $# -gt 0 ]; do
    case "$1" in
      --full) full=1 ;;
      --label) [ $# -ge 2 ] || usage_error "test: --label needs a value"; label="$2"; shift ;;
      *) usage_error "test: unknown argument '$1'; see ./grouser test --help" ;;
    esac
    shift
  done
  TEST_RESULTS=() TESTS_FAILED=''
  case "$label" in *fuzz* | *slow*) packages=(full) ;; esac
  install_missing build libraries run multibody python fmi "${packages[@]}" ${full:+full maps mujoco ros docs lint}
  if [ -n "$label" ]; then
    record_stage release run_ctest release --label-regex "$label"
  else
    record_stage release run_release "$full"
    record_stage asan run_asan "$full"
    record_stage cuda run_cuda "$full"
    if [ -n "$full" ]; then
      record_stage lint word_lint
      record_stage slow run_slow
      record_stage tsan run_tsan
      record_stage tidy run_tidy
    fi
  fi
  echo
  printf '%s\n' "${TEST_RESULTS[@]}"
  [ -z "$TESTS_FAILED" ]
}

# shellcheck shell=bash
# The smaller words of ./grouser.

word_help() {
  help_text <<'HELP'
Grouser: what will this wheel do on this soil? In microseconds, with the error
bar of the DEM simulation behind it.

Usage: ./grouser WORD [arguments]      ./grouser WORD --help

HELP
  awk -F' *[|] *' 'NF == 3 { printf "  %-9s %s\n", $1, $3 }' <<<"$WORDS"
  help_text <<'HELP'

Words say which package they lack. Data on stdout, all else on stderr. Exit
codes: 0 ok, 1 failed, 2 bad usage or input.
HELP
  ! is_checkout || cat <<'HELP'

On a fresh Debian 12 start with ./grouser setup. Only setup, build, demo, test
and package install packages (sudo where not root; GROUSER_NO_INSTALL=1 forbids it).
HELP
  help_text <<'HELP'

Examples:
  ./grouser serve &
  ./grouser query --slip 0.2 --angle-deg 30 --load 24
HELP
}

word_version() {
  if ! is_checkout; then
    "$(program_path grouser-client)" --version | sed 's/^grouser-client/grouser/'
    return
  fi
  sed -n 's/^project(grouser VERSION \([0-9.]*\).*/grouser \1/p' "$GROUSER_ROOT/CMakeLists.txt"
}

word_setup() {
  if wants_help "$@"; then
    help_text <<'HELP'
Usage: ./grouser setup
Installs what is missing of cmake/packages.debian and builds all programs in
build/release: about ten minutes on two cores. A second call repeats nothing.
HELP
    return
  fi
  [ $# -eq 0 ] || usage_error "setup: takes no arguments; see ./grouser setup --help"
  install_missing multibody maps mujoco python
  set_up
}

word_build() {
  if wants_help "$@"; then
    help_text <<'HELP'
Usage: ./grouser build [PRESET]
Installs what is missing of cmake/packages.debian, configures and builds a
preset of CMakePresets.json (release) in build/PRESET; a second call repeats
nothing. Compilers at once: GROUSER_BUILD_JOBS (default: cores, as memory allows).
Examples:
  ./grouser build
  ./grouser build asan
HELP
    return
  fi
  [ $# -le 1 ] || usage_error "build: one preset at most"
  install_missing build libraries run
  build_preset "${1:-release}"
}

word_demo() {
  if wants_help "$@"; then
    [ -x "$PYTHON" ] && exec "$PYTHON" "$GROUSER_ROOT/clients/demo/demo.py" --help
    sed -n '2,/^"""$/s/^"*//p' "$GROUSER_ROOT/clients/demo/demo.py"  # nothing is installed yet
    return
  fi
  set_up
  local demo=("$PYTHON" "$GROUSER_ROOT/clients/demo/demo.py" --bin "$(program_dir)" "$@")
  if has_multicast_route; then exec "${demo[@]}"; fi
  say "no multicast route by lo here: running in a network namespace that has one"
  local unshare=(unshare --net)
  [ "$(id -u)" -eq 0 ] || unshare=(unshare --map-root-user --net)
  "${unshare[@]}" true || fail "LCM: no multicast route, and no network namespace may be made here;" \
    "as root: ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo"
  # shellcheck disable=SC2016  # expanded inside the namespace
  exec "${unshare[@]}" -- /bin/sh -ec \
    'ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo; exec "$@"' sh "${demo[@]}"
}

word_reproduce() {
  local script="$GROUSER_ROOT/dem_offline/reproduce/reproduce.py" out
  require_packages run
  wants_help "$@" || [ $# -eq 0 ] || build_if_missing grouser-dem
  mapfile -t out < <(installed_out reproduce)
  exec "$PYTHON" "$script" --bin "$(program_dir)" "${out[@]}" "$@"
}

word_validate() {
  local script="$GROUSER_ROOT/dem_offline/validate/validate.py" out
  require_packages run
  wants_help "$@" || [ $# -eq 0 ] || build_if_missing grouser-dem grouser-fit grouser-calibrate
  mapfile -t out < <(installed_out validate)
  exec "$PYTHON" "$script" --bin "$(program_dir)" "${out[@]}" "$@"
}

word_bevameter() {
  local script="$GROUSER_ROOT/dem_offline/bevameter/bevameter.py" out
  require_packages run
  wants_help "$@" || [ $# -eq 0 ] || build_if_missing grouser-dem grouser-calibrate
  mapfile -t out < <(installed_out bevameter)
  exec "$PYTHON" "$script" --bin "$(program_dir)" "${out[@]}" "$@"
}

word_campaign() {
  local driver=''
  case "${1:-}" in
    adapt) driver=adaptive/adapt.py ;;
    converge) driver=convergence/converge.py ;;
  esac
  if [ -n "$driver" ]; then
    shift
    require_packages run
    wants_help "$@" || [ $# -eq 0 ] || build_if_missing grouser-dem grouser-fit
    exec "$PYTHON" "$GROUSER_ROOT/dem_offline/$driver" --bin "$(program_dir)" "$@"
  fi
  build_if_missing grouser-dem
  case "${1:-}" in
    '' | -h | --help)
      local code=0
      "$(program_path grouser-dem)" campaign "$@" || code=$?
      say "campaign adapt: goes on where its model is least sure; see ./grouser campaign adapt --help"
      say "campaign converge: results at half the time step, in a larger bed, with a longer window"
      exit "$code" ;;
  esac
  run_program grouser-dem campaign "$@"
}

word_calibrate() {
  require_packages run
  if [ "${1:-}" = grains ]; then
    local out
    mapfile -t out < <(installed_out grains)
    shift
    wants_help "$@" || [ $# -eq 0 ] || build_if_missing grouser-dem grouser-calibrate
    exec "$PYTHON" "$GROUSER_ROOT/dem_offline/calibrate_grains/calibrate_grains.py" \
      --bin "$(program_dir)" "${out[@]}" "$@"
  fi
  wants_help "$@" || [ $# -eq 0 ] || build_if_missing grouser-calibrate
  exec "$PYTHON" "$GROUSER_ROOT/surrogate/calibrate/calibrate.py" --bin "$(program_dir)" "$@"
}

word_ladder() {
  if [ "${1:-}" != docs ] || ! is_checkout; then
    run_program grouser-ladder "$@"
    return
  fi
  shift
  require_packages run
  wants_help "$@" || build_if_missing grouser-ladder
  exec "$PYTHON" "$GROUSER_ROOT/surrogate/accuracy_benchmark/write_docs.py" \
    --bin "$(program_dir)" "$@"
}

# run_explained PROGRAM ARGUMENT...: runs the program; with --plot FILE among its arguments, one
# picture of what it explains as well.
run_explained() {
  local program="$1" plot=() rest=()
  shift
  while [ $# -gt 0 ]; do
    case "$1" in
      --plot)
        [ $# -gt 1 ] || usage_error "--plot: expected a file that ends with .png, .svg or .pdf"
        plot=(--plot "$2"); shift ;;
      --plot=*) plot=("$1") ;;
      *) rest+=("$1") ;;
    esac
    shift
  done
  if wants_help "${rest[@]}"; then
    build_if_missing "$program"
    "$(program_path "$program")" "${rest[@]}"
    say "--plot FILE.png|.svg|.pdf: one picture of the explanation"
    return
  fi
  [ ${#plot[@]} -gt 0 ] || run_program "$program" "${rest[@]}"
  require_packages run
  build_if_missing "$program"
  exec "$PYTHON" "$GROUSER_ROOT/surrogate/fit/explain.py" "${plot[@]}" -- "$(program_path "$program")" "${rest[@]}"
}

word_query() { run_explained grouser-client query "$@"; }

word_model() {
  local verb="${1:-}"
  case "$verb" in
    '' | -h | --help)
      help_text <<'HELP'
Usage: ./grouser model VERB [arguments]      ./grouser model VERB --help
  list      models of a running server, their aliases and domain
  served    one model of a running server, its error table and provenance
  show      what a model file holds: domain, errors, provenance, cone index of its soil
  eval      states, answered from a file
  plot      curves over slip with intervals, of one model or several, measured points beside them
  explain   why a state is answered so: flags, parts of the interval, the runs behind it; --plot
  numerics  traction beside published numeric laws at the soil's cone index
  make      a model of a wheel on a known soil or hard ground at once, nothing fitted
  compare   DEM, surrogate with interval, and measurement; --out: the model with sd_form
  regions   in which DEM is compared with measurements, and which a state is in
  gate      may this candidate replace that model?
Examples:
  ./grouser model list --json
  ./grouser model make --wheel my-wheel.yaml --soil 'LETE sand' --out my.model
  ./grouser model make --wheel my-wheel.yaml --ground asphalt --out asphalt.model
  ./grouser model show surrogate/shipped/NAME.model
  ./grouser model eval out/demo/model/demo.model --slip 0.2 --angle-deg 30 --load 24
  ./grouser model plot surrogate/pairs/cmu-smooth-62.5-8mm/hybrid.model --out curves.png
  ./grouser model explain out/demo/model/demo.model --slip 0.2 --load 24 --plot why.png
HELP
      [ -n "$verb" ] || exit 2 ;;
    list) shift; run_program grouser-client models "$@" ;;
    served) shift; run_program grouser-client model "$@" ;;
    explain) run_explained grouser-fit "$@" ;;
    plot)
      shift
      require_packages run
      build_if_missing grouser-fit
      exec "$PYTHON" "$GROUSER_ROOT/surrogate/fit/plot_model.py" --program "$(program_path grouser-fit)" "$@" ;;
    show | eval | numerics | make | compare | regions | gate) run_program grouser-fit "$@" ;;
    *) usage_error "model: unknown verb '$verb'; see ./grouser model --help" ;;
  esac
}

word_vehicle() {
  if [ "${1:-}" = measured ]; then
    shift
    run_program grouser-measured-vehicles "$@"
  fi
  if [ "${1:-}" = plot ]; then
    shift
    require_packages run
    build_if_missing grouser-vehicle
    exec "$PYTHON" "$GROUSER_ROOT/clients/vehicle/plot_vehicle.py" --program "$(program_path grouser-vehicle)" "$@"
  fi
  run_program grouser-vehicle "$@"
}

word_map() {
  require_packages run maps
  build_if_missing grouser-map
  exec "$(program_path grouser-map)" --pictures-by "$GROUSER_ROOT/surrogate/terrain_map/map_pictures.py" "$@"
}

word_fmu() {
  local module="$GROUSER_ROOT/build/release/fmi/grouser_wheel.so"
  wants_help "$@" || [ $# -eq 0 ] || {
    build_if_missing grouser-fit
    [ -e "$module" ] || build_preset release
  }
  exec "$PYTHON" "$GROUSER_ROOT/clients/fmi/make_fmu.py" --bin "$(program_dir)" "$@"
}

word_jobs() {
  local verb="${1:-}"
  case "$verb" in
    '' | -h | --help)
      help_text <<'HELP'
Usage: ./grouser jobs VERB [arguments]      ./grouser jobs VERB --help
Work in the background of a running ./grouser serve. Refinements: a fresh DEM run
at one state, a refit, a candidate model; campaigns; calibrations.
  submit    ask for a refinement
  submit-campaign   run a campaign file
  calibrate soil|grains   calibrate from a measurement file
  fetch     copy the results of a campaign or calibration here
  list      all jobs
  get       one job, with its gate and its run
  watch     follow a job until it ends; without one, all as a live table
  cancel    withdraw from a job
  promote   make a job's candidate the stable model
  history   where aliases pointed, when, who moved them, why
  move      point an alias at a model: canary to stable
  rollback  move an alias back to what it named before
  prune     remove what nothing names any more
Examples:
  ./grouser jobs submit --slip 0.35 --angle-deg 20 --load 24
  ./grouser jobs calibrate soil surrogate/calibrate/measured/cmu_plates.yaml --watch
  ./grouser jobs fetch JOB_ID --out out/my-soil
  ./grouser jobs watch JOB_ID
  ./grouser jobs promote JOB_ID --candidate DIGEST --who me --why "held-out error fell"
HELP
      [ -n "$verb" ] || exit 2 ;;
    list) shift; run_program grouser-client jobs "$@" ;;
    get) shift; run_program grouser-client job "$@" ;;
    history | move | rollback) run_program grouser-client model "$@" ;;
    prune | submit | submit-campaign | calibrate | fetch | watch | cancel | promote) run_program grouser-client "$@" ;;
    *) usage_error "jobs: unknown verb '$verb'; see ./grouser jobs --help" ;;
  esac
}

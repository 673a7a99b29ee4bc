# shellcheck shell=bash
# `./grouser serve`: grouser-server and grouser-jobs as one service.

serve_help() {
  help_text <<'HELP'
Usage: ./grouser serve [options]
Starts grouser-server (queries) and grouser-jobs (refinements, campaigns, calibrations) on the shipped
models and those of the state folder, and ends both together on Ctrl-C or
SIGTERM.
  --state DIR        state folder (default: $GROUSER_STATE, else
                     $XDG_STATE_HOME/grouser, else ~/.local/state/grouser)
  --shipped DIR      read-only models (default: surrogate/shipped)
  --vehicles PATH    vehicle file, or folder of them; may stand several times
                     (default: surrogate/vehicle/shipped)
  --vehicle-threads N  threads that solve and plan for them, 1 to 64 (default:
                     half of the processors)
  --grpc ADDR        of queries (default 127.0.0.1:50151)
  --jobs-grpc ADDR   of jobs (default 127.0.0.1:50152); both: HOST:PORT or unix:PATH
  --no-lcm           gRPC only (chosen for you where no multicast route goes by lo, unless
                     --config is given, which then has to say so)
  --lcm-url URL      e.g. udpm://239.255.76.67:7667?ttl=0
  --lcm-interface IF receives LCM queries by this interface, e.g. eth0 (default: lo,
                     from this machine alone)
  --port-file FILE, --jobs-port-file FILE   receive "grpc=ADDR"
  --http ADDR        of queries, for the web page, /metrics, /healthz, /readyz, /buildinfo and
                     calls as JSON (default: none); --jobs-http ADDR: of jobs
  --log-format text|json, --log-slow-s S   of both
  --query-log FILE   logs answered wheel queries for ./grouser replay (default: none)
  --config FILE      YAML file of settings of both (./grouser config --help); options
                     given here go before it, and it before the defaults above
  --max-connections N, --idle-s S, --drain-s S, --probe-s S, --memory-budget-mb N,
  --max-calls N, --answer-s S, --http-insecure   of both; see grouser-server --help
  --jobs-NAME VALUE  any option --NAME of grouser-jobs (its --help lists them), such as
                     --jobs-workers 2, --jobs-max-disk-mb 20000, --jobs-device cuda;
                     any other --NAME VALUE goes to grouser-server
  --tls-cert FILE, --tls-key FILE, --tls-client-ca FILE, --rights FILE, --insecure,
  --reflection       of both: who may reach them and do what; docs/security.md
Exit code: 0 ended by a signal, else that of the program that ended by itself.
Examples:
  ./grouser serve
  ./grouser serve --http 127.0.0.1:50161 --jobs-http 127.0.0.1:50162
  ./grouser serve --jobs-max-disk-mb 20000 --jobs-auto-promote canary
  ./grouser serve --state /var/lib/grouser --grpc 0.0.0.0:50151 --no-lcm \
    --tls-cert server.pem --tls-key server.key
then, elsewhere:
  ./grouser query --slip 0.2 --angle-deg 30 --load 24
  ./grouser vehicle solve husky --soil asphalt --speed 0.8 --radius 2 --server robot.example:50151 \
    --tls-ca ca.pem
HELP
}

# sets NAME SHOWN: whether the file of `--config-show` sets it.
sets() { grep -qE "^  $1: .*  # file\$" <<<"$2"; }

# Starts a program that dies with this shell, even if that is killed.
start_child() {
  setpriv --pdeathsig TERM -- "$@" </dev/null &
  CHILDREN+=($!)
}

# The first SIGINT or SIGTERM ends both; each drains by itself.
end_children() {
  SERVE_ENDED_BY_SIGNAL=1
  kill -TERM "${CHILDREN[@]}" 2>/dev/null || true
}

# Waits for the first to end, ends the other, sets SERVE_CODE.
reap_children() {
  local code=0
  wait -n "${CHILDREN[@]}" || code=$?
  if [ -z "$SERVE_ENDED_BY_SIGNAL" ]; then
    say "a program ended by itself (exit code $code); ending the other"
    SERVE_CODE=$((code == 0 ? 1 : code))
    kill -TERM "${CHILDREN[@]}" 2>/dev/null || true
  fi
  local child
  for child in "${CHILDREN[@]}"; do
    while kill -0 "$child" 2>/dev/null; do wait "$child" || true; done
  done
}

word_serve() {
  if wants_help "$@"; then serve_help; return; fi
  if [ -z "${GROUSER_SIGNALS_RESET:-}" ]; then
    # A script's background job starts with SIGINT ignored, which no shell can undo.
    GROUSER_SIGNALS_RESET=1 exec env --default-signal=INT,TERM,HUP "$GROUSER_ROOT/grouser" serve "$@"
  fi
  unset GROUSER_SIGNALS_RESET
  local state='' shipped='' server=() jobs=() vehicles=() config=() lcm='' shown=''
  while [ $# -gt 0 ]; do
    case "$1" in
      --no-lcm) server+=("$1"); lcm=1; shift; continue ;;
      --insecure | --reflection | --http-insecure) server+=("$1"); jobs+=("$1"); shift; continue ;;
      --*=*) set -- "${1%%=*}" "${1#*=}" "${@:2}" ;;
      --*) ;;
      *) usage_error "serve: '$1' is no option; see ./grouser serve --help" ;;
    esac
    [ $# -ge 2 ] || usage_error "serve: $1 needs a value, or is unknown; see ./grouser serve --help"
    case "$1" in
      --state) state="$2" ;;
      --shipped) shipped="$2" ;;
      --vehicles) vehicles+=("$1" "$2") ;;
      --config) config=("$1" "$2") ;;
      --max-connections | --idle-s | --drain-s | --probe-s | --memory-budget-mb | --max-calls | --answer-s | \
        --log-format | --log-slow-s | --tls-cert | --tls-key | --tls-client-ca | --rights)
        server+=("$1" "$2"); jobs+=("$1" "$2") ;;
      --lcm-url | --lcm-interface) server+=("$1" "$2"); lcm=1 ;;
      --jobs-*) jobs+=("--${1#--jobs-}" "$2") ;;
      *) server+=("$1" "$2") ;;  # grouser-server names those that it does not have
    esac
    shift 2
  done
  build_if_missing grouser-server grouser-jobs
  if [ ${#config[@]} -gt 0 ]; then
    # A file that is refused is named by both programs; what it does not set has the defaults.
    shown="$("$(program_path grouser-server)" "${config[@]}" --config-show)" || exit $?
    "$(program_path grouser-jobs)" "${config[@]}" --config-show >/dev/null || exit $?
    server+=("${config[@]}") jobs+=("${config[@]}") lcm=1
  fi
  [ -n "$state" ] || sets state "$shown" || state="$(state_dir)"
  [ -n "$shipped" ] || sets shipped "$shown" || shipped="$(shipped_dir)"
  [ ${#vehicles[@]} -gt 0 ] || sets vehicles "$shown" ||
    vehicles=(--vehicles "$GROUSER_ROOT/surrogate/vehicle/shipped")
  if [ -z "$shown" ] && [ -z "$(model_files "$shipped" "$state/models")" ]; then
    say "no model in $shipped or $state/models. Make one with ./grouser demo,"
    fail "or with ./grouser campaign run and ./grouser fit, and name its folder by --shipped."
  fi
  if [ -z "$lcm" ] && ! has_multicast_route; then
    say "no multicast route by lo, so no LCM (./grouser doctor has the two commands); gRPC only"
    server+=(--no-lcm)
  fi
  CHILDREN=() SERVE_ENDED_BY_SIGNAL='' SERVE_CODE=0
  trap end_children TERM INT HUP
  [ -z "$state" ] || { server+=(--state "$state"); jobs+=(--state "$state"); }
  [ -z "$shipped" ] || { server+=(--shipped "$shipped"); jobs+=(--shipped "$shipped"); }
  start_child "$(program_path grouser-server)" "${vehicles[@]}" "${server[@]}"
  start_child "$(program_path grouser-jobs)" "${jobs[@]}"  # its workers' programs are beside it
  reap_children
  exit "$SERVE_CODE"
}

config_help() {
  help_text <<'HELP'
Usage: ./grouser config check FILE          whether both programs take it
       ./grouser config show [FILE]         all settings, and where each comes from
       ./grouser config schema server|jobs  the JSON schema, for editors
One YAML file for the settings of grouser-server and grouser-jobs, by the names
of their options (see their --help). The command line goes before the file, a
program's own section before "both". Unknown keys are refused:
  both:   {state: /var/lib/grouser, shipped: /usr/share/grouser/surrogate/shipped, log-format: json}
  server: {http: 127.0.0.1:50161, no-lcm: true}
  jobs:   {http: 127.0.0.1:50162, workers: 2}
Exit codes: 0 ok, 1 failed, 2 bad file.
Examples:
  ./grouser config check grouser.yaml
  grouser-server --config grouser.yaml --http 127.0.0.1:0
HELP
}

word_config() {
  if wants_help "$@"; then config_help; return; fi
  local program file=()
  build_if_missing grouser-server grouser-jobs
  case "${1:-}" in
    check) [ $# -eq 2 ] || usage_error "config check: one file; see ./grouser config --help" ;;
    show) [ $# -le 2 ] || usage_error "config show: at most one file; see ./grouser config --help" ;;
    schema)
      case "${2:-}" in
        server | jobs) run_program "grouser-$2" --config-schema ;;
        *) usage_error "config schema: server or jobs; see ./grouser config --help" ;;
      esac ;;
    *) usage_error "config: check, show or schema; see ./grouser config --help" ;;
  esac
  [ $# -eq 1 ] || file=(--config "$2")
  for program in grouser-server grouser-jobs; do
    "$(program_path "$program")" "${file[@]}" "--config-$1" || return $?
  done
}

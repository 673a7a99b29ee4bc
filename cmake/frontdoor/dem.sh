# shellcheck shell=bash
# ./grouser dem: the program of experiments, and the pictures of its runs.

word_dem() {
  if [ "${1:-}" = view ]; then
    shift
    require_packages run
    exec "$PYTHON" "$GROUSER_ROOT/dem_offline/view/view.py" "$@"
  fi
  run_program grouser-dem "$@"
}

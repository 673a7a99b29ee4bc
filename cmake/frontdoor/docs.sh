# shellcheck shell=bash
# `./grouser docs`: the documents as HTML.

docs_help() {
  cat <<'HELP'
Usage: ./grouser docs [--out DIR] [--strict]
Makes HTML of docs/, with references of the commands, the C++ headers, the Python package and the
messages, in build/docs/html (--out), to open there or to serve as files; half a minute once the
programs are built. --strict: a warning, a link to nowhere for example, is an error.
Needs the packages of the group "docs" in cmake/packages.debian; installs nothing.
Exit code: 0 made, 1 failed, 2 bad usage.
Examples:
  ./grouser docs
  ./grouser docs --out /tmp/grouser-docs && xdg-open /tmp/grouser-docs/index.html
HELP
}

# Where the built Python package lies; nothing where it was not built.
built_python() {
  if compgen -G "$GROUSER_ROOT/build/release/python/grouser/_core.*.so" >/dev/null; then
    printf '%s\n' "$GROUSER_ROOT/build/release/python"
  fi
}

word_docs() {
  local out="$GROUSER_ROOT/build/docs/html" strict=() work="$GROUSER_ROOT/build/docs"
  if wants_help "$@"; then docs_help; return; fi
  while [ $# -gt 0 ]; do
    case "$1" in
      --out) [ $# -ge 2 ] || usage_error "docs: --out needs a folder"; out="$(realpath -m "$2")"; shift ;;
      --strict) strict=(-W --keep-going) ;;
      *) usage_error "docs: unknown argument '$1'; see ./grouser docs --help" ;;
    esac
    shift
  done
  require_packages docs
  build_if_missing grouser-{dem,fit,calibrate,client,vehicle,bench}  # --help of their words
  mkdir -p "$work/doxygen" "$out"
  cd "$GROUSER_ROOT" || return
  { cat docs/site/Doxyfile; printf 'OUTPUT_DIRECTORY = "%s"\n' "$work/doxygen"; } | doxygen - ||
    fail "doxygen failed"
  # -E: the references change where no document has.
  GROUSER_SITE_XML="$work/doxygen" GROUSER_SITE_PYTHON="$(built_python)" \
    "$PYTHON" -m sphinx -q -E "${strict[@]}" -b html -d "$work/doctrees" -c docs/site . "$out" ||
    fail "sphinx failed"
  say "documents: $out/index.html"
}

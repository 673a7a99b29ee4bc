# shellcheck shell=bash
# `./grouser lint`: formatting and static checks, as a contributor runs them before a commit.

lint_help() {
  help_text <<'HELP'
Usage: ./grouser lint [--fix] [--tidy REV]
Checks formatting (clang-format), shell scripts (shellcheck), who includes whom, the words
of identifiers, and that documents cite only what is in the repository.
  --fix        formats the sources in place
  --tidy REV   clang-tidy as well, over the sources that changed since REV (slow)
Needs the packages of the group "lint" in cmake/packages.debian; installs nothing.
Exit code: 0 clean, 1 findings.
Examples:
  ./grouser lint
  ./grouser lint --tidy HEAD~3
HELP
}

# lint_step NAME COMMAND...: keeps going after a finding.
lint_step() {
  local name="$1"
  shift
  if "$@"; then say "$name: clean"; else say "$name: findings"; LINT_FAILED=1; fi
}

lint_sources() { git ls-files -z -- '*.cc' '*.h' '*.inl' '*.cu'; }

tidy_changed() {
  build_preset tidy grouser_messages grouser_services grouser_lcm_headers \
    generated_lite/grouser/v1alpha1/model.pb.h || return 1
  git diff -z --name-only --diff-filter=d "$1" -- '*.cc' |
    xargs -0 -r -n 4 -P "$(nproc)" clang-tidy --quiet -p build/tidy
}

word_lint() {
  local mode=(--dry-run --Werror) since='' check
  if wants_help "$@"; then lint_help; return; fi
  while [ $# -gt 0 ]; do
    case "$1" in
      --fix) mode=(-i) ;;
      --tidy) [ $# -ge 2 ] || usage_error "lint: --tidy needs a revision"; since="$2"; shift ;;
      *) usage_error "lint: unknown argument '$1'; see ./grouser lint --help" ;;
    esac
    shift
  done
  require_packages lint
  cd "$GROUSER_ROOT" || return
  LINT_FAILED=''
  lint_step format xargs -0 clang-format "${mode[@]}" < <(lint_sources)
  lint_step shell shellcheck -x grouser cmake/frontdoor/*.sh
  for check in includes docs words; do
    lint_step "$check" "$PYTHON" "tests/tools/check_$check.py" "$GROUSER_ROOT"
  done
  [ -z "$since" ] || lint_step tidy tidy_changed "$since"
  [ -z "$LINT_FAILED" ]
}

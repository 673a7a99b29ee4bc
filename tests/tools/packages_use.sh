#!/bin/bash
# By tests/tools/packages_check.sh, in a folder where the packages were installed: packages_use.sh fresh|upgraded|idle
set -euo pipefail
cd /tmp
what="$1"
fail() { echo "packages_use: FAILED: $*" >&2; exit 1; }
expect() { grep -qE -- "$1" <<<"$2" || fail "expected '$1' in: ${2:0:2000}"; }

# start UNIT: its program, with the environment, user and folders that the unit gives it.
start() {
  local file="/usr/lib/systemd/system/$1.service" command
  (
    eval "$(sed -n 's/^Environment="\(.*\)"$/export "\1"/p' "$file")"
    set -a
    # shellcheck source=/dev/null
    . /etc/default/grouser
    install -d -o grouser -g grouser -m 750 /var/lib/grouser /var/lib/grouser/tables
    command="$(sed -n 's/^ExecStart=//p' "$file")"
    eval "set -- $command"
    exec setpriv --reuid=grouser --regid=grouser --clear-groups "$@"
  ) 2>"/root/$1.log" &
  services+=($!)
}
wait_ready() {
  local i
  for ((i = 0; i < 600; ++i)); do
    ! grep -q 'ready grpc=' "/root/$1.log" || return 0
    sleep 0.1
  done
  fail "$1 is not ready: $(tail -n 5 "/root/$1.log")"
}
as_nobody() { setpriv --reuid=nobody --regid=nogroup --clear-groups env HOME=/nonexistent "$@"; }

services=()
start grouser-server
start grouser-jobs
wait_ready grouser-server
wait_ready grouser-jobs
answer="$(as_nobody grouser query --slip 0.2 --angle-deg 30 --load 24 --model cmu-smooth-62.5 --json)"
expect '"f_x"' "$answer"
expect 'husky' "$(as_nobody grouser vehicle list --server 127.0.0.1:50151)"
expect '.' "$(as_nobody grouser jobs list --json)"
expect 'ok' "$(as_nobody grouser config check /etc/grouser/grouser.yaml)"
if [ "$what" = upgraded ]; then
  expect 'http=127.0.0.1:50161' "$(cat /root/grouser-server.log)"
  expect 'cmu-smooth-62.5-8mm' "$(as_nobody grouser model list)"
fi
# By Python, with grpcio.
expect 'client [-0-9]' "$(as_nobody python3 -c '
import grouser
import grouser.client
with grouser.client.Client("127.0.0.1:50151") as client:
    print("client", client.evaluate(grouser.States.of(0.08, 0, 0.1, 24), "cmu-smooth-62.5").f_x.value[0])')"
# What words and programs look up, from any folder, and Python.
expect 'LETE sand' "$(as_nobody grouser soil list)"
expect 'LETE sand' "$(as_nobody grouser-soil list)"
for model in /usr/share/grouser/surrogate/{shipped,pairs/*}/*.model; do
  expect '.' "$(as_nobody grouser model show "$model")"
done
for vehicle in /usr/share/grouser/surrogate/vehicle/shipped/*.vehicle.yaml; do
  expect '.' "$(as_nobody grouser vehicle show "$vehicle")"
done
printf 'radius_m: 0.13\nwidth_m: 0.10\n' >/tmp/wheel.yaml
chmod 644 /tmp/wheel.yaml
out="$(as_nobody mktemp -d)"
as_nobody grouser model make --wheel /tmp/wheel.yaml --soil 'Sandy loam 15 %' --out "$out/loam.model" >/dev/null
as_nobody grouser dem check /usr/share/grouser/dem_offline/experiments/plate.yaml >/dev/null
expect 'pull .* N' "$(as_nobody python3 -c '
import grouser
model = grouser.Model.open(grouser.MODEL_DIR / "cmu-smooth-62.5.model")
print("pull", model.evaluate(grouser.States.of(0.08, 0, 0.1, 24)).f_x.value[0], "N")')"
cp /root/planner "$out/planner"
chmod 755 "$out" "$out/planner"
expect 'pull .* N' "$(as_nobody "$out/planner" /usr/share/grouser/models/cmu-smooth-62.5.model)"
# Pages and completions lie where man and bash look.
for name in grouser grouser-server grouser-jobs grouser-client grouser-dem; do
  [ -s "/usr/share/man/man1/$name.1.gz" ] || fail "no manual page of $name"
  bash -n "/usr/share/bash-completion/completions/$name"
done
# A model of one's own: it outlives upgrade and purge.
if [ "$what" = fresh ]; then
  model=/usr/share/grouser/surrogate/pairs/cmu-smooth-62.5-8mm/hybrid.model
  digest="$(grouser model show "$model" | sed -n '1s/.*@sha256://p')"  # names a model of the state folder
  echo "$digest" >/root/digest
  install -D -o grouser -g grouser -m 640 "$model" "/var/lib/grouser/models/$digest.model"
fi
kill -TERM "${services[@]}"
for service in "${services[@]}"; do wait "$service" || fail "a service ended with $?"; done
echo "packages_use: $what: all held"
